"""Answers to somebody: one of a held-out pair is given, and a partner is generated; judged as duets from words are."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np

from motionloom.core.body.ik import motion_from_positions
from motionloom.core.diffusion import row_seed
from motionloom.core.features import pair as two
from motionloom.core.ground import GroundPose
from motionloom.core.models.pair import PairBlock
from motionloom.core.models.prior import Prior
from motionloom.kinematics.physics import Array
from motionloom.tasks.duet import react
from motionloom.tasks.people import Duet
from motionloom.tasks.text import LARGEST_SEED, frames_in, generate
from motionloom_lab.metrics import pair as mp
from motionloom_lab.report.report import Value
from motionloom_lab.report.tables import columns, notes
from motionloom_lab.suites import duet_text as judged
from motionloom_lab.suites.duet import HELD_OUT
from motionloom_lab.suites.duet_text import NOTES, DuetSettings, Make, Parts, Table
from motionloom_lab.suites.duet_ways import random_crop
from motionloom_lab.suites.items import NoData
from motionloom_train.data.pairs import Pair

FULL, QUICK = judged.FULL, judged.QUICK
COLUMNS = (*judged.COLUMNS, *columns("duet-answers"))


@dataclass(frozen=True, eq=False)
class Windows:
    """Random windows of held-out pairs, either person first."""

    pairs: tuple[Pair, ...]
    """All are long enough and have captions."""
    frames: int

    @staticmethod
    def of(pairs: Sequence[Pair], how: DuetSettings) -> "Windows":
        """Raises NoData where no held-out pair with a caption is long enough."""
        frames = frames_in(how.seconds, mp.FPS)
        chosen = tuple(p for p in pairs if p.split in HELD_OUT and p.frames >= frames and p.captions)
        if not chosen:
            raise NoData(
                f"there is no held-out pair of {frames} frames with a caption to answer; ten pairs or more give one"
            )
        return Windows(chosen, frames)

    def captions(self) -> tuple[str, ...]:
        """What people do in them, each once."""
        return tuple(dict.fromkeys(text for pair in self.pairs for text in pair.captions))

    def draw(self, caption: str, count: int, seed: int) -> list[Array]:
        """``count`` windows (2, frames, 22, 3) metres of pairs with that caption; the first person is given."""
        rng, some = np.random.default_rng(seed), [pair.positions for pair in self.pairs if caption in pair.captions]
        return [random_crop(some, self.frames, rng) for _ in range(count)]

    def all(self, how: DuetSettings) -> list[Array]:
        """Those of a whole run, in its order."""
        turns = judged.turns(self.captions(), how)
        return [window for caption, count, seed in turns for window in self.draw(caption, count, seed)]


def parts(prior: Prior, block: PairBlock, pairs: Sequence[Pair], how: DuetSettings) -> Parts:
    """Answers to people of the held-out pairs."""
    pool = Windows.of(pairs, how)
    about = {"given": "one of the two in random windows of validation and test pairs"}
    return table(pool, how), answers(prior, block, pool, how), alone(prior, pool, how), about


def table(pool: Windows, how: DuetSettings) -> Table:
    """The columns of duets from words, and how far partners are from the real ones."""
    return Table(
        "duet-answers",
        "Two people: answers to somebody",
        pool.captions(),
        (*NOTES, *notes("duet-answers")),
        columns=COLUMNS,
        more=lambda duets: apart(duets, pool.all(how)),
    )


def apart(duets: Sequence[Array], real: Sequence[Array]) -> Mapping[str, Value]:
    """Metres on the ground from each duet's second root to the real partner's, at the end of each horizon."""
    way = [np.linalg.norm((d[1, :, 0] - r[1, :, 0])[:, [0, 2]], axis=-1) for d, r in zip(duets, real, strict=True)]
    at = {k: round(k * mp.FPS) - 1 for k in mp.HORIZONS}
    return {f"root_{k}": Value.of([float(one[frame]) for one in way]) for k, frame in at.items() if frame < len(way[0])}


def answers(prior: Prior, block: PairBlock, pool: Windows, how: DuetSettings) -> Make:
    """`react` to the first person of each window."""

    def make(caption: str, count: int, seed: int) -> list[Duet]:
        duets = []
        for number, window in enumerate(pool.draw(caption, count, seed)):
            duets += react(
                prior,
                block,
                motion_from_positions(window[0], mp.FPS),
                caption,
                seed=own_seed(seed, number),
                **how.drawing,
            )
        return duets

    return make


def alone(prior: Prior, pool: Windows, how: DuetSettings) -> Make:
    """Partners from the prior alone, who begin where the real partner does, facing as they do."""

    def make(caption: str, count: int, seed: int) -> list[Duet]:
        duets = []
        for number, window in enumerate(pool.draw(caption, count, seed)):
            (partner,) = generate(prior, caption, seconds=how.seconds, seed=own_seed(seed, number), **how.drawing)
            begins = GroundPose.of_numbers(two.encode(window).poses[1])
            duets.append((motion_from_positions(window[0], mp.FPS), partner.placed(begins)))
        return duets

    return make


def own_seed(seed: int, number: int) -> int:
    """A usable seed, unlike that of another caption or duet."""
    return row_seed(seed, number) % (LARGEST_SEED // 2)
