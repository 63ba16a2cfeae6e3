"""The obedience run: every check's prompt on several seeds, and the tables that come out of it.

What makes the motions may come in as a function, so that a fake one can be tested. What was done is kept in one JSON
file after every prompt; a run that was stopped goes on with the next one.
"""

import hashlib
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from statistics import median_high
from typing import Any

from motionloom.core.body.ik import motion_from_positions
from motionloom.core.errors import MotionloomError
from motionloom.core.files.atomic import with_folders
from motionloom.core.files.text import plain_json
from motionloom.core.models.prior import Prior
from motionloom.core.reading import read_bytes
from motionloom.kinematics.physics import Array
from motionloom.viz import draw
from motionloom.viz.video import draw_grid
from motionloom_lab.metrics.obedience import CHECKS, THEMES, Check
from motionloom_lab.report.files import check_report, write_json
from motionloom_lab.suites.harness import Generate, Run, generator
from motionloom_train.data.paths import DAMAGED

ENOUGH = 0.9
"""Share of seeds that must obey for a prompt to count as obeyed."""
MOSTLY = 0.7
"""Share of seeds that must obey for a prompt to count as mostly obeyed."""
_LARGEST = 64 << 20
"""Bytes of the attempts that a stopped run kept."""


@dataclass(frozen=True)
class Attempt:
    """One generated motion against its check."""

    prompt: str
    seed: int
    obeyed: bool
    measured: dict[str, float]
    """The numbers that the check bounds."""


@dataclass(frozen=True)
class Result:
    """All attempts at one check."""

    name: str
    attempts: tuple[Attempt, ...]

    def of(self, prompt: str) -> tuple[Attempt, ...]:
        """The attempts at one wording."""
        return tuple(a for a in self.attempts if a.prompt == prompt)


def attempts(check: Check, generate: Generate, prompt: str, *, seeds: int, first_seed: int) -> list[Attempt]:
    """Generate one prompt on seeds ``first_seed`` to ``first_seed + seeds - 1`` and judge it."""
    motions, fps = generate([prompt] * seeds, seconds=check.seconds, seed=first_seed)
    if len(motions) != seeds:
        raise MotionloomError(
            f"asked for {seeds} motions of {prompt!r} and got {len(motions)}; generate one per prompt"
        )
    found = []
    for row, positions in enumerate(motions):
        numbers = check.measured(positions, fps)
        kept = {bound.measure: numbers[bound.measure] for bound in check.bounds}
        found.append(Attempt(prompt, first_seed + row, check.obeyed(numbers), kept))
    return found


def run(
    run: Run,
    checks: Sequence[Check] = CHECKS,
    *,
    generate: Generate | None = None,
    seeds: int = 10,
    first_seed: int = 0,
    paraphrases: bool = False,
    settings: dict[str, Any] | None = None,
) -> list[Result]:
    """Every check's prompt on several seeds.

    Args:
        run: where and how; goes on from ``obedience.json`` in its folder, which is written after every prompt.
        checks: what is asked and what must hold.
        generate: makes the motions; None: the run's weights with their usual settings.
        seeds, first_seed: how many, from which on.
        paraphrases: try the checks' other wordings too.
        settings: what else the results depend on; kept results of other settings are refused.

    Raises:
        MotionloomError: for an impossible number of seeds, and kept results that are damaged or of other settings.
    """
    if not 1 <= seeds <= 10_000:
        raise MotionloomError(f"the number of seeds must be from 1 to 10000; got {seeds}")
    asked = {**(settings or {}), "seeds": seeds, "first_seed": first_seed, "checks": fingerprint(checks)}
    kept = check_report(run.folder / "obedience.json") if run.folder else None
    done = _read(kept, asked) if kept else {}
    generate = generate or generator(Prior.load(run.weights, device=run.device))
    for check in checks:
        for prompt in (check.prompt, *(check.paraphrases if paraphrases else ())):
            if any(a.prompt == prompt for a in done.get(check.name, ())):
                continue
            found = attempts(check, generate, prompt, seeds=seeds, first_seed=first_seed)
            done.setdefault(check.name, []).extend(found)
            run.progress(f"{sum(a.obeyed for a in found):3d}/{seeds}  {prompt}")
            if kept:
                write_json(kept, summary(_results(checks, done), checks, settings=asked))
    return _results(checks, done)


def fingerprint(checks: Sequence[Check]) -> str:
    """Changes whenever a prompt or a bound changes: results of other checks are not mixed in."""
    said = repr([(c.name, c.seconds, [(b.measure, b.low, b.high) for b in c.bounds]) for c in checks])
    return hashlib.sha256(said.encode()).hexdigest()[:16]


def _results(checks: Sequence[Check], done: dict[str, list[Attempt]]) -> list[Result]:
    return [Result(check.name, tuple(done[check.name])) for check in checks if check.name in done]


def _read(path: Path, settings: dict[str, Any]) -> dict[str, list[Attempt]]:
    if not path.is_file():
        return {}
    try:
        kept = plain_json(read_bytes(path, max_bytes=_LARGEST))
        if kept["settings"] != settings:
            raise MotionloomError(f"{path} was made with other settings; name another --out folder or delete it")
        return {str(check["name"]): [_attempt(a) for a in check["attempts"]] for check in kept["checks"]}
    except DAMAGED as error:
        if isinstance(error, MotionloomError):
            raise
        raise MotionloomError(f"{path} is not a result of this command ({error!r}); delete it to begin again") from None


def _attempt(found: dict[str, Any]) -> Attempt:
    measured = {str(name): float(value) for name, value in found["measured"].items()}
    return Attempt(str(found["prompt"]), int(found["seed"]), bool(found["obeyed"]), measured)


def summary(results: Sequence[Result], checks: Sequence[Check] = CHECKS, *, settings: dict[str, Any]) -> dict[str, Any]:
    """Everything as plain data for JSON."""
    by_name = {check.name: check for check in checks}
    listed = []
    for result in results:
        check = by_name[result.name]
        own = result.of(check.prompt)
        listed.append(
            {
                "name": check.name,
                "prompt": check.prompt,
                "seconds": check.seconds,
                "obeyed": sum(a.obeyed for a in own),
                "of": len(own),
                "wanted": [bound.text() for bound in check.bounds],
                "paraphrases": {p: sum(a.obeyed for a in result.of(p)) for p in check.paraphrases if result.of(p)},
                "attempts": [a.__dict__ for a in result.attempts],
            }
        )
    return {"settings": settings, "totals": totals(results, checks), "checks": listed}


def totals(results: Sequence[Result], checks: Sequence[Check] = CHECKS) -> dict[str, float]:
    """Share of seeds that obey, prompts obeyed and mostly obeyed, and the share for the other wordings."""
    prompts = {check.name: check.prompt for check in checks}
    own = [r.of(prompts[r.name]) for r in results]
    tried = [a for row in own for a in row]
    said = [r.of(prompt) for r in results for prompt in dict.fromkeys(a.prompt for a in r.attempts)]
    other = [row for row in said if row[0].prompt not in prompts.values()]
    found = {
        "prompts": len(own),
        "prompts_obeyed": _enough(own, ENOUGH),
        "prompts_mostly_obeyed": _enough(own, MOSTLY),
        "seeds_obeyed_share": round(sum(a.obeyed for a in tried) / max(1, len(tried)), 4),
    }
    if other:
        found["paraphrases"] = len(other)
        found["paraphrases_obeyed"] = _enough(other, ENOUGH)
        found["paraphrases_mostly_obeyed"] = _enough(other, MOSTLY)
        reworded = [a.obeyed for row in other for a in row]
        found["paraphrases_obeyed_share"] = round(sum(reworded) / len(reworded), 4)
    return found


def in_a_sentence(found: Mapping[str, float]) -> str:
    """What `totals` found."""
    said = (
        f"{found['prompts_obeyed']} of {found['prompts']} prompts obeyed on at least {ENOUGH:.0%} of the seeds, "
        f"{found['prompts_mostly_obeyed']} on at least {MOSTLY:.0%}; {found['seeds_obeyed_share']:.1%} of all seeds"
    )
    if "paraphrases_obeyed_share" in found:
        said += (
            f";\nin other words {found['paraphrases_obeyed']} of {found['paraphrases']}, "
            f"{found['paraphrases_mostly_obeyed']} and {found['paraphrases_obeyed_share']:.1%}"
        )
    return said


def _enough(rows: Sequence[Sequence[Attempt]], share: float) -> int:
    return sum(sum(a.obeyed for a in row) >= share * len(row) for row in rows if row)


def table(
    results: Sequence[Result], checks: Sequence[Check] = CHECKS, *, real: dict[str, Any] | None = None
) -> list[list[str]]:
    """Rows of text, the heading first: prompt, seeds, other wordings, real clips, seconds, the bounds with the median
    seen. Without ``real``, columns that are empty in every row are left out."""
    by_name = {check.name: check for check in checks}
    heading = ["prompt", "seeds", "reworded", "real held-out", "real all", "seconds", "median seen, of what is wanted"]
    rows = [heading]
    for result in results:
        check = by_name[result.name]
        own = result.of(check.prompt)
        other = [a for a in result.attempts if a.prompt != check.prompt]
        seen = "; ".join(
            f"{median_high([a.measured.get(b.measure, float('nan')) for a in own]):g} of {b.text()}"
            for b in check.bounds
        )
        known = (real or {}).get(check.name, {})
        rows.append(
            [
                check.prompt,
                f"{sum(a.obeyed for a in own)}/{len(own)}",
                f"{sum(a.obeyed for a in other)}/{len(other)}" if other else "",
                known.get("held_out", ""),
                known.get("all", ""),
                f"{check.seconds:g}",
                seen,
            ]
        )
    kept = [k for k in range(len(heading)) if real or any(row[k] for row in rows[1:])]
    return [[row[k] for k in kept] for row in rows]


DONE, NOT_DONE = draw.CONTACT, (208, 62, 62)
"""Colours before the captions of a picture: the check holds, or it does not."""


def themes(results: Sequence[Result]) -> list[list[str]]:
    """Rows of text, the heading first: theme, prompts, those on 9 and on 7 of 10 seeds, share of all seeds."""
    rows = [["theme", "prompts", f"on {ENOUGH:.0%} of seeds", f"on {MOSTLY:.0%}", "of all seeds"]]
    by_name = {result.name: result for result in results}
    for theme, checks in THEMES.items():
        found = [(by_name[c.name], c) for c in checks if c.name in by_name]
        if found:
            total = totals([r for r, _ in found], [c for _, c in found])
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
