"""Blocks of a timeline that do not show what their words say plainly are sampled again, between frames that stay.

Blocks of timelines, and the actions of one sentence (`motionloom.tasks.worded`). A block is held against its words
(`motionloom.goals.expected`). Where something is missing it is sampled from up to three other seeds, with a common verb
for each rare one, as if it had been changed (`motionloom.tasks.redraw`), and the sample with the least missing stays.
"""

from collections.abc import Iterable, Sequence
from dataclasses import dataclass, replace
from itertools import accumulate

from motionloom.core.diffusion.sampling import row_seed
from motionloom.core.motion import Motion
from motionloom.goals.expected import FLOOR, missing
from motionloom.goals.remarks import Remark, clipped, replacement_line
from motionloom.goals.segment import Segment
from motionloom.goals.verbs import in_plainer_words
from motionloom.requests.sampling import LARGEST_SEED
from motionloom.tasks.long import compose
from motionloom.tasks.redraw import Run, Timed, resample_runs
from motionloom.tasks.sampling import Moves
from motionloom.tasks.watching import watching

ATTEMPTS = 4
"""Samples of which the best is kept, where words are plain without numbers."""
LONGEST = 120.0
"""Seconds of sampled blocks up to which requests have them held against their words."""


def attempt_seed(seed: int, number: int) -> int:
    """The seed of an attempt: the motion's own, then others that depend on it alone."""
    return seed if number == 0 else row_seed(seed, number) % LARGEST_SEED


PLAINER_FROM = 2
"""The attempt from which on the words are plainer ones; those before are of the words as they stand."""


@dataclass(frozen=True, eq=False)
class Reattempted:
    """A long motion whose blocks were held against their words."""

    motion: Motion
    again: dict[int, str]
    """The blocks that are of a later attempt, and the words in which they were sampled."""
    missing: dict[int, list[str]]
    """What a block does not show in any attempt; also of blocks that were not sampled again."""

    def notes(self, segments: Sequence[Segment]) -> list[Remark]:
        """A remark on each text that was replaced, and on each block that does not show what it should."""
        replaced = {segments[i].text: text for i, text in self.again.items() if text != segments[i].text}
        remarks = [Remark(one, replacement_line([(one, other)])) for one, other in replaced.items()]
        for i, missed in self.missing.items():
            text = segments[i].text
            if names := [name for name in missed if name != FLOOR]:  # who floats is lowered
                remarks.append(Remark(text, clipped(f"'{text[:40]}': not shown: {', '.join(names)}")))
        return remarks


def reattempt(
    timed: Timed,
    motion: Motion,
    blocks: Iterable[int],
    *,
    start: Motion | None = None,
    attempts: int = ATTEMPTS,
    progress: Moves | None = None,
) -> Reattempted:
    """The motion of a timeline with those of its blocks sampled again that do not show what their words say plainly.

    A block with a goal, on a path, or first behind a ``start`` that more blocks follow, stays as it is.

    Args:
        timed: the timeline; the segments' adapters are loaded.
        motion: what was sampled from it: the 22-joint person at 20 frames per second.
        blocks: numbers of those that may be sampled again.
        start: what the motion goes on from.
        attempts: samples of a block at most, with that of the motion.
        progress: called with the number of row moves, which are further ones.
    """
    looked = [i for i in range(len(timed.segments)) if _is_free(timed, i, start)]
    sampled = set(blocks)
    begins = [0, *accumulate(block.frames for block in timed.blocks)]
    plain = [in_plainer_words(one.text) for one in timed.segments]

    def unseen(of: Motion, near: Iterable[int]) -> dict[int, list[str]]:
        places = of.positions()
        cuts = {i: places[begins[i] : begins[i + 1]] for i in near if i in looked}
        return {i: missing(timed.segments[i].text, own, of.fps) for i, own in cuts.items()}

    best, kept = unseen(motion, looked), {}
    with watching(lambda denoised: None):  # what is watched is the first attempt
        for i in (i for i in looked if i in sampled):
            near = (i - 1, i, i + 1)
            for number in range(1, attempts):
                if not best[i]:
                    break
                words = plain[i] if number >= PLAINER_FROM else timed.segments[i].text
                again = _sample_again(timed, motion, i, words, number, start, progress)
                found = unseen(again, near)
                if _total(found) < _total({k: best[k] for k in found}):
                    motion, best, kept[i] = again, best | found, words
    return Reattempted(motion, kept, {i: names for i, names in best.items() if names})


def _is_free(timed: Timed, i: int, start: Motion | None) -> bool:
    goal = timed.segments[i].goal
    first_of_more = start is not None and i == 0 and len(timed.segments) > 1
    return timed.path is None and (goal is None or goal.empty) and not first_of_more


def _total(found: dict[int, list[str]]) -> int:
    return sum(map(len, found.values()))


def _sample_again(
    timed: Timed, motion: Motion, i: int, text: str, number: int, start: Motion | None, progress: Moves | None
) -> Motion:
    """The motion with block i in these words, from the seed of that attempt."""
    segments = [replace(one, text=text) if k == i else one for k, one in enumerate(timed.segments)]
    seed = attempt_seed(timed.sampling.seeds(1)[0] + i, number)
    if len(segments) == 1:
        own = replace(timed.sampling, seed=seed, first=0, count=1)
        return compose(timed.prior, segments, start=start, foot_lock=timed.foot_lock, sampling=own, progress=progress)
    again = replace(timed, segments=segments)
    return resample_runs(again, motion, timed.blocks, [Run(i, i + 1, i, i + 1)], progress, seed=seed)
