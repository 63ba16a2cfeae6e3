"""Groups of duets compared with real ones, with shuffled partners as the control.

**Within k times of the real spread.** Take one quantity of `SERIES` in every frame. The distance of two groups of clips
is Wasserstein-1 between the quantity's distributions over all their frames: metres or radians that it would have to be
moved by on average; of a yes-or-no quantity simply the difference of its shares. The *real spread* is how far one real
recording is from all the others together, mean over the recordings. The *ratio* is how far the judged group is from all
real clips, over that spread. A group is within k times of the real spread where its ratio is at most k: it differs from
real pairs no more than k times what one real pair differs from the rest.
"""

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass

import numpy as np

from motionloom.core.errors import MotionloomError
from motionloom.kinematics import physics as ph
from motionloom.kinematics.physics import Array
from motionloom_lab.metrics import pair as mp

LIMIT = 1.5
"""How many times the real spread a group may be away from real clips."""
SERIES: Mapping[str, Callable[[np.ndarray], np.ndarray]] = {
    "distance": mp.distance,
    "facing": mp.facing_angle,
    "looking_away": lambda p: mp.looking_away(p).ravel(),
    "mutual": lambda p: np.asarray((mp.looking_away(p) < mp.LOOK).all(axis=0), dtype=np.float64),
    "hand_distance": mp.hand_distance,
    "hand_contact": lambda p: (mp.hand_distance(p) < mp.HOLD).astype(np.float64),
    "touch": lambda p: (mp.hand_to_body(p) < mp.TOUCH).astype(np.float64),
    "penetration": mp.penetration_depth,
}
"""What is compared, by name: (2, frames, 22, 3) to a number for each frame (of each person), all of `pair`."""
JUDGED = ("distance", "looking_away", "hand_contact")
"""Distance, facing and hand contact: what separates partners from shuffled people."""
_LEVELS = 400


@dataclass(frozen=True)
class SpreadRatio:
    """One quantity of a group of duets against real ones."""

    name: str
    group: float
    """Mean over the frames of the group."""
    real: float
    """Mean over the frames of all real clips."""
    spread: float
    """Wasserstein distance of one real recording from the others, mean over recordings."""
    away: float
    """Wasserstein distance of the group from all real clips."""

    @property
    def ratio(self) -> float:
        """``away`` over ``spread``; infinite where real ones never differ and the group does."""
        if self.spread == 0:
            return 0.0 if self.away == 0 else float("inf")
        return self.away / self.spread

    def within(self, times: float = LIMIT) -> bool:
        """Whether the group is within so many times of the real spread."""
        return self.ratio <= times


def compare(
    group: Sequence[np.ndarray], real: Sequence[Sequence[np.ndarray]], *, names: Sequence[str] = tuple(SERIES)
) -> dict[str, SpreadRatio]:
    """Every quantity of `names` as a `SpreadRatio`.

    Args:
        group: The duets to be judged, each (2, frames, 22, 3) metres.
        real: The real clips of each recording; clips of as many frames as the judged ones see the same moments. At
            least two recordings.
        names: Of `SERIES`.

    Raises:
        MotionloomError: No duets, or fewer than two real recordings.
    """
    if not group or len(real) < 2 or not all(real):
        raise MotionloomError(
            f"a comparison needs duets and clips of at least 2 real recordings; got {len(group)} duets and "
            f"{len(real)} recordings"
        )
    result = {}
    for name in names:
        recordings = [_over_frames(clips, name) for clips in real]
        pool, judged = np.concatenate(recordings), _over_frames(group, name)
        others = [np.concatenate(recordings[:n] + recordings[n + 1 :]) for n in range(len(recordings))]
        spread = float(np.mean([wasserstein(one, rest) for one, rest in zip(recordings, others, strict=True)]))
        away = wasserstein(judged, pool)
        result[name] = SpreadRatio(name, float(judged.mean()), float(pool.mean()), spread, away)
    return result


def _over_frames(clips: Sequence[np.ndarray], name: str) -> Array:
    return np.concatenate([SERIES[name](clip) for clip in clips])


def wasserstein(a: np.ndarray, b: np.ndarray) -> float:
    """Wasserstein-1 of two samples (n,) and (m,): the mean difference of their sorted values.

    Both are read at 400 quantiles, so that samples of any sizes are compared; means of shares are exact.
    """
    if set(np.unique(a)) | set(np.unique(b)) <= {0.0, 1.0}:
        return abs(float(a.mean() - b.mean()))
    levels = (np.arange(_LEVELS) + 0.5) / _LEVELS
    return float(np.abs(np.quantile(a, levels) - np.quantile(b, levels)).mean())


# Shuffled partners ---------------------------------------------------------------------------------------------------


def shuffled(pairs: Sequence[np.ndarray], *, shift: int = 1, placed: bool = True) -> list[Array]:
    """Everybody with somebody else's partner: person 0 of each duet with person 1 of the one ``shift`` further on.

    Args:
        pairs: At least two duets (2, frames, 22, 3) metres; both are cut to the shorter.
        shift: Whose partner: no multiple of the number of duets. With windows of one recording in a row, more than
            their number, or neighbours in time take each other's partner.
        placed: Whether the stranger is moved rigidly on the ground to begin where the true partner begins, facing as
            they do, so that only what follows differs; False leaves everybody where they were recorded.

    Raises:
        MotionloomError: Fewer than two duets, or a shift that gives everybody the own partner back.
    """
    if len(pairs) < 2 or shift % len(pairs) == 0:
        raise MotionloomError(f"{len(pairs)} duets cannot be shuffled by {shift}; at least two are needed")
    return [_stranger(pair, pairs[(n + shift) % len(pairs)][1], placed=placed) for n, pair in enumerate(pairs)]


def _stranger(pair: np.ndarray, stranger: np.ndarray, *, placed: bool) -> Array:
    frames = min(pair.shape[1], len(stranger))
    first, partner, other = pair[0, :frames], pair[1, :frames], stranger[:frames]
    if placed:
        ground = np.array([1.0, 0.0, 1.0])
        turn = float(ph.heading(other[:1])[0] - ph.heading(partner[:1])[0])
        other = ph.turned(other - other[0, 0] * ground, turn) + partner[0, 0] * ground
    return np.stack([first, other])


@dataclass(frozen=True)
class Synchrony:
    """How much more true partners move together than strangers do."""

    partners: float
    """Mean correlation of root speeds over the duets."""
    strangers: float
    """The same of everybody with everybody else's partner."""
    size: float
    """Their difference in standard deviations of the strangers; 0 where strangers never differ."""


def synchrony_against_shuffled(
    pairs: Sequence[np.ndarray],
    *,
    of: Callable[[np.ndarray, float], float] = mp.speed_synchrony,
    fps: float = mp.FPS,
) -> Synchrony:
    """``of`` (`speed_synchrony` or `synchrony`) of at least two duets against all their shuffles."""
    own = np.array([of(pair, fps) for pair in pairs])
    others = np.array(
        [of(p, fps) for k in range(1, max(len(pairs), 2)) for p in shuffled(pairs, shift=k, placed=False)]
    )
    deviation = float(others.std())
    size = float(own.mean() - others.mean()) / deviation if deviation > 0 else 0.0
    return Synchrony(float(own.mean()), float(others.mean()), size)
