"""Guidance of the relative pose of two people: while they are sampled, the block estimates it again and again.

Features hold velocities, so small errors of an estimate add up, and two people who began as partners drift apart. A
block estimates the relative pose of two people at the first frame of whatever it is shown, and it learned that from
crops that begin anywhere. So every denoised estimate is cut at several frames, the *anchors*, the block estimates
the relative pose there, and both people are moved half of the way to its answers.
"""

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import TypeAlias

import numpy as np

from motionloom.core.diffusion import row_noise, row_seed
from motionloom.core.features.humanml import positions_at
from motionloom.core.features.pair import PairMotion, on_the_spot
from motionloom.core.ground import compose, relative
from motionloom.core.models.networks.pair import PLACE, PairSession, join, part, people
from motionloom.core.models.networks.prior_condition import Bound
from motionloom.core.models.prior import Prior

SPACING = 40
"""Frames from anchor to anchor, at most."""
CROP = 60
"""Frames behind an anchor that the block is shown, at most."""
LEAST = 20
"""Frames behind an anchor, at least."""
SURE = 40
"""Frames behind a past of both that stay as they are: their momentum is a better guess than the block's."""


PoseGuidance: TypeAlias = Callable[[np.ndarray, np.ndarray, int], np.ndarray]
"""(states (rows, 1 + frames, 263), their denoised estimates, level) -> the estimates, changed."""


def relative_pose_guidance(
    prior: Prior,
    net: PairSession,
    bound: Bound,
    *,
    seeds: Sequence[int],
    mask: np.ndarray,
    frozen: Sequence[bool],
    weight: float = 1.0,
) -> PoseGuidance:
    """What moves the estimates of pairs of one length to the relative poses that the block estimates later on.

    Nothing does where a block has no relative pose, and for codes of the kind world, which hold the places of crops in
    a file (published).

    Args:
        bound, seeds: of each row.
        mask: (rows, 1 + frames, 263) True where a state is known; it stays.
        frozen: who is not moved, as those are not whose frames are all known; then the other goes all of the way.
        weight: share of the way, 0 to 1.
    """
    if not weight or net.silent or net.places.kind != "mutual":
        return lambda state, denoised, level: denoised
    known = np.asarray(mask[:, 1:, :3].all(axis=-1))
    both = np.asarray(people(known).all(axis=1))
    fixed = [still or bool(row.all()) for still, row in zip(frozen, known, strict=True)]
    past = both.cumprod(axis=1).sum(axis=1).tolist()
    places = Places.of(seeds, known.shape[1], [count + SURE if count else 0 for count in past], fixed)

    def guided(state: np.ndarray, denoised: np.ndarray, level: int) -> np.ndarray:
        moved = places.guided(prior, net, bound, state=state, denoised=denoised, level=level, weight=weight)
        return np.where(mask, denoised, moved)

    return guided


@dataclass(frozen=True, eq=False)
class Places:
    """Where the pose is estimated, and who is moved; for some pairs of one length."""

    anchors: tuple[tuple[int, ...], ...]
    """Frames of each pair."""
    spread: tuple[np.ndarray, ...]
    """(frames, anchors) of each pair: how much of what is done at an anchor is done in a frame."""
    shares: np.ndarray
    """(pairs, 2) how much of the way each person goes."""
    noise: np.ndarray
    """(2 * all anchors, 4) of the numbers of D."""

    @staticmethod
    def of(seeds: Sequence[int], frames: int, begins: Sequence[int], fixed: Sequence[bool]) -> "Places":
        """seeds, fixed: one per row, whether that person is not moved; begins: one per pair, the last frame that
        stays as it is."""
        anchors = tuple(_anchors(begin, frames) for begin in begins)
        spread = tuple(_spread([begin, *some], frames) for some, begin in zip(anchors, begins, strict=True))
        free = 1.0 - np.array(fixed, dtype=np.float32).reshape(-1, 2)
        shares = free / free.sum(1, keepdims=True).clip(min=1.0)
        most = max(len(some) for some in anchors)
        shape = len(seeds), max(most, 1), PLACE
        noise = row_noise([row_seed(seed, 0, 2) for seed in seeds])(np.empty(shape, np.float32))
        own = [noise[2 * i : 2 * i + 2, : len(some)].swapaxes(0, 1) for i, some in enumerate(anchors)]
        return Places(anchors, spread, shares, np.concatenate([one.reshape(-1, PLACE) for one in own]))

    def guided(
        self,
        prior: Prior,
        net: PairSession,
        bound: Bound,
        *,
        state: np.ndarray,
        denoised: np.ndarray,
        level: int | np.ndarray,
        weight: float,
    ) -> np.ndarray:
        """Estimates (rows, 1 + frames, 263) of states at a level, changed; ``level``: one, or one per row."""
        owner = [pair for pair, some in enumerate(self.anchors) for _ in some]
        if not owner or not self.shares.any():
            return denoised
        code = net.places
        places, motion = part(denoised)
        pairs = PairMotion(people(motion * prior.spread + prior.mean), code.decode(people(places)))
        ways = pairs.ways()
        at = [anchor for some in self.anchors for anchor in some]
        now = np.stack([ways[pair, :, frame] for pair, frame in zip(owner, at, strict=True)])
        rows = np.array([2 * pair + person for pair in owner for person in (0, 1)])
        levels = level if isinstance(level, int) else level[rows]
        noised = prior.schedule.noised(code.encode(now).reshape(-1, PLACE), levels, self.noise)
        crops, lengths = _crops(state[:, 1:], rows.tolist(), [frame for frame in at for _ in (0, 1)])
        condition = Bound._make(one[rows] for one in bound)._replace(lengths=lengths)
        answer, _ = part(net(join(noised, crops), levels, condition))
        change = lacking(now, code.decode(people(answer))) * weight
        changed = (self._moved(pairs, change) - prior.mean) / prior.spread
        return join(places, changed.astype(np.float32, copy=False))

    def _moved(self, pairs: PairMotion, change: np.ndarray) -> np.ndarray:
        """Features (rows, frames, 263) with a change at the anchors (all anchors, 3) of facing, x and z."""
        own = np.split(change, np.cumsum([len(some) for some in self.anchors])[:-1])
        every = zip(pairs.each(), self.spread, own, self.shares, strict=True)
        return np.concatenate([pair.changed(spread @ some, shares).features for pair, spread, some, shares in every])


def _crops(motion: np.ndarray, rows: Sequence[int], begins: Sequence[int]) -> tuple[np.ndarray, np.ndarray]:
    """What of a motion (some rows, frames, 263) is in ``rows`` from frames ``begins`` on, padded; and how long."""
    crops = [motion[row, begin : begin + CROP] for row, begin in zip(rows, begins, strict=True)]
    lengths = [len(crop) for crop in crops]
    padded = np.zeros((len(crops), max(lengths), motion.shape[-1]), motion.dtype)
    for row, crop in zip(padded, crops, strict=True):
        row[: len(crop)] = crop
    return padded, np.array(lengths)


def _anchors(begin: int, frames: int) -> tuple[int, ...]:
    """Even steps from ``begin`` to `LEAST` frames before the end; none where that is too near."""
    room = frames - LEAST - begin
    count = -(-room // SPACING) if room >= SPACING // 2 else 0
    return tuple(begin + round(room * number / count) for number in range(1, count + 1))


def _spread(at: Sequence[int], frames: int) -> np.ndarray:
    """(frames, anchors), from the begin and the anchors behind it: smooth curves, 1 at the own anchor, 0 at the others
    and at the begin; level behind the last."""
    if len(at) == 1:
        return np.zeros((frames, 0), np.float32)
    along = np.interp(np.arange(frames), at, np.arange(len(at)))
    return positions_at(np.eye(len(at))[..., None], along)[:, 1:, 0].astype(np.float32)


def lacking(now: np.ndarray, target: np.ndarray, shares: Sequence[float] | np.ndarray = (0.5, 0.5)) -> np.ndarray:
    """(rows, 3): what the second person's facing, x and z lack, relative to the first; from poses (rows, 2, 4).

    shares: of it that the first and the second person do.
    """
    first, second = now[:, 0], now[:, 1]
    there = relative(target[:, 0], target[:, 1])
    turn = relative(relative(first, second), there)
    angle = np.arctan2(turn[:, 1], turn[:, 0])
    first = on_the_spot(first, -shares[0] * angle)
    line = compose(first, there)[:, 2:] - first[:, 2:]
    return np.concatenate([angle[:, None], line - (second - first)[:, 2:]], axis=1)
