"""Long duets of several captions: are partners still partners in the last seconds, or have they drifted apart?

Their last stretch, and their first, are judged as duets from words are.
"""

from collections.abc import Sequence
from dataclasses import dataclass

from motionloom.core.ground import GroundPose
from motionloom.core.models.pair import PairBlock
from motionloom.core.models.prior import Prior
from motionloom.core.motion import Motion
from motionloom.goals.segment import Segment
from motionloom.tasks.duet import compose_pair
from motionloom.tasks.long import compose
from motionloom.tasks.people import Duet
from motionloom.tasks.text import frames_in
from motionloom_lab.metrics import pair as mp
from motionloom_lab.report.tables import notes
from motionloom_lab.suites import duet_text as judged
from motionloom_lab.suites.duet_answers import own_seed
from motionloom_lab.suites.duet_text import NOTES, Make, Parts, Table
from motionloom_lab.suites.protocol import check_ranges
from motionloom_train.data.pairs import Pair

MOST = 100
"""Segments."""


@dataclass(frozen=True)
class LongDuetSettings(judged.DuetSettings):
    """How long duets are generated and measured; ``seconds`` is the length of a segment."""

    segments: int = 3

    def __post_init__(self) -> None:
        super().__post_init__()
        check_ranges(self, {"segments": (2, MOST)})


FULL, QUICK = LongDuetSettings(), LongDuetSettings(duets=2, steps=6, segments=2)


def parts(prior: Prior, block: PairBlock, pairs: Sequence[Pair], how: LongDuetSettings) -> Parts:
    """Long duets for the captions of the train pairs."""
    captions = judged.captions_of(pairs)
    about = {"segments": how.segments, "whole": f"{how.segments * how.seconds:g} s"}
    return table(captions, how), ours(prior, block, captions, how), alone(prior, pairs, captions, how), about


def table(captions: tuple[str, ...], how: LongDuetSettings) -> Table:
    """The last and the first stretch, as long as a segment."""
    frames = frames_in(how.seconds, mp.FPS)
    cuts = (
        (f", last {how.seconds:g} s", lambda duet: duet[:, -frames:]),
        (f", first {how.seconds:g} s", lambda duet: duet[:, :frames]),
    )
    return Table("duet-long", "Two people for long", captions, (*NOTES, *notes("duet-long")), cuts)


def ours(prior: Prior, block: PairBlock, captions: Sequence[str], how: LongDuetSettings) -> Make:
    """`compose_pair` of captions in turn, from the requested one."""

    def make(caption: str, count: int, seed: int) -> list[Duet]:
        segments = timeline(captions, caption, how)
        seeds = [own_seed(seed, number) for number in range(count)]
        return [compose_pair(prior, block, segments, seed=own, **how.drawing) for own in seeds]

    return make


def alone(prior: Prior, pairs: Sequence[Pair], captions: Sequence[str], how: LongDuetSettings) -> Make:
    """Two long motions of the prior alone, which begin where partners of random train windows are."""
    begun = judged.beginnings(pairs, how)

    def one(caption: str, seed: int) -> Motion:
        return compose(prior, timeline(captions, caption, how), seed=seed, **how.drawing)

    def make(caption: str, count: int, seed: int) -> list[Duet]:
        duets = []
        for number, poses in enumerate(begun(count, seed)):
            first, second = (
                one(caption, own_seed(seed, 2 * number + i)).placed(GroundPose.of_numbers(pose))
                for i, pose in enumerate(poses)
            )
            duets.append((first, second))
        return duets

    return make


def timeline(captions: Sequence[str], caption: str, how: LongDuetSettings) -> list[Segment]:
    """``how.segments`` captions in turn, the first of which is ``caption``."""
    first = captions.index(caption)
    return [Segment(captions[(first + n) % len(captions)], how.seconds) for n in range(how.segments)]
