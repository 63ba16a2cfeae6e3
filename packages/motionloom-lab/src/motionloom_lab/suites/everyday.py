"""The everyday prompts as a whole: how each theme does, and one picture of all first draws."""

from collections.abc import Sequence
from pathlib import Path

from motionloom.io.atomic import with_folders
from motionloom.kinematics.ik import motion_from_positions
from motionloom.kinematics.physics import Array
from motionloom.viz import draw
from motionloom.viz.grid import draw_grid
from motionloom_lab.metrics.obedience import THEMES, Check
from motionloom_lab.suites import obey
from motionloom_lab.suites.harness import Generate

DONE, NOT_DONE = draw.CONTACT, (208, 62, 62)
"""Colours before the captions of a picture: the check holds, or it does not."""


def themes(results: Sequence[obey.Result]) -> list[list[str]]:
    """Rows of text, the heading first: theme, prompts, those on 9 and on 7 of 10 seeds, share of all seeds."""
    rows = [["theme", "prompts", f"on {obey.ENOUGH:.0%} of seeds", f"on {obey.MOSTLY:.0%}", "of all seeds"]]
    by_name = {result.name: result for result in results}
    for theme, checks in THEMES.items():
        found = [(by_name[c.name], c) for c in checks if c.name in by_name]
        if found:
            total = obey.totals([r for r, _ in found], [c for _, c in found])
            counts = [total["prompts"], total["prompts_obeyed"], total["prompts_mostly_obeyed"]]
            rows.append([theme, *(f"{n:g}" for n in counts), f"{total['seeds_obeyed_share']:.0%}"])
    return rows


class FirstDraws:
    """A generator that remembers the first motion of every prompt, for the picture."""

    def __init__(self, generate: Generate) -> None:
        self._generate = generate
        self._kept: dict[str, tuple[Array, float]] = {}

    def __call__(self, prompts: Sequence[str], *, seconds: float, seed: int) -> tuple[list[Array], float]:
        """As the generator inside."""
        motions, fps = self._generate(prompts, seconds=seconds, seed=seed)
        if motions:
            self._kept.setdefault(prompts[0], (motions[0], fps))
        return motions, fps

    def draw(self, checks: Sequence[Check], path: Path, *, seed: int) -> Path:
        """A picture of the first draw of every check: six poses, the prompt, green where it obeys and red where not.

        What was not generated here (a run that went on from files) is generated now, from ``seed``.
        """
        motions, marks = [], []
        for check in checks:
            if check.prompt not in self._kept:
                self([check.prompt], seconds=check.seconds, seed=seed)
            positions, fps = self._kept[check.prompt]
            motions.append(motion_from_positions(positions, fps))
            marks.append(DONE if check.obeyed(check.measured(positions, fps)) else NOT_DONE)
        with with_folders(path.parent):
            return draw_grid(motions, path, captions=[check.prompt for check in checks], marks=marks)
