"""Two people, where they are not sampled: a partner who is answered, two who go on, and how a sampled one gets a body.

Their own motions become one `PairMotion` when they come in, and what is sampled is one until it has a body again. What
lies between sees states in which part is `Observed`, whoever the people are.
"""

from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from motionloom.core.errors import MotionloomError
from motionloom.core.features import pair as two
from motionloom.core.features.humanml import positions_at
from motionloom.core.features.layout import FPS, LAYOUT
from motionloom.core.features.pair import PairMotion
from motionloom.core.ground import GroundPose
from motionloom.core.methods.edit import Observed
from motionloom.core.models.networks.pair import PairSession
from motionloom.core.models.prior import Prior
from motionloom.core.motion import Motion
from motionloom.core.skeleton import SMPL22
from motionloom.kinematics.shared_world import one_world, together
from motionloom.requests.shared import LONGEST
from motionloom.retarget import joints22, to_smpl22
from motionloom.retarget.anatomy import read_body
from motionloom.tasks.splice import apply_positions, concatenate, continue_motion, person_at, person_at_20
from motionloom.tasks.text import finish

Array = NDArray[np.float64]
Duet = tuple[Motion, Motion]

SHORTEST = 1.0
"""Seconds of the shortest motion that somebody can react to."""
CONTEXT = 3.0
"""Seconds of a motion that are looked at for where its floor is."""
PAST_FRAMES = 40
"""Frames of a past that the network sees, at 20 per second."""
SHORTEST_SEAM = 4
"""Frames behind a past that are retargeted at once, at least, for its seam to fade over."""
_UP = np.array([0.0, 1.0, 0.0])


def known_state(net: PairSession, known: PairMotion, frames: int) -> Observed:
    """States (2 * pairs, 1 + frames, 263) in which the first frames of a batch of pairs are known, and where they are.

    There may be no frames. The network sees what is known without noise.
    """
    state = net.states(known, frames)
    mask = np.zeros(state.shape, np.bool_)
    mask[:, : 1 + known.features.shape[-2]] = True
    return Observed(state, mask, noise_free=True)


def finish_person(prior: Prior, pair: PairMotion, person: int, *, foot_lock: bool) -> Motion:
    """One of two people, 0 or 1, in their world, by `finish`."""
    motion = finish(prior, pair.features[person], foot_lock=foot_lock)
    return motion.placed(GroundPose.of_numbers(pair.poses[person]))


@dataclass(frozen=True, eq=False)
class Partner:
    """A person to whose motion a second one is sampled."""

    motion: Motion
    known: PairMotion
    """The motion of both people at 20 frames per second on the ground of two, as far as it is known: his own."""
    ratio: float
    """How many times larger the second person's ways are on the ground of two."""
    floor: float
    """Metres: the height of his floor."""

    @staticmethod
    def of(motion: Motion) -> "Partner":
        """Raises MotionloomError for a motion of another length than `SHORTEST` to `LONGEST`, and for one that does not
        stand upright along +Y."""
        if not SHORTEST - 1e-6 <= motion.seconds <= LONGEST:
            raise MotionloomError(
                f"the given motion is {motion.seconds:.2f} s long; {SHORTEST:g} to {LONGEST:g} s can be reacted to"
            )
        legs = read_body(motion.skeleton).leg, read_body(SMPL22).leg
        alone = person_at_20(motion)
        places = one_world([alone, alone], legs)[0]
        few = motion.frames(0, min(len(motion), round(CONTEXT * motion.fps) + 2))
        uniform = to_smpl22(few)
        apply_positions(uniform.positions(), few, foot_lock=False)
        floor = float(np.median(joints22(few)[:, 0, 1] - legs[0] / legs[1] * uniform.root[:, 1]))
        return Partner(motion, two.encode(np.stack([places, places])), float(np.mean(legs)) / legs[1], floor)

    def state(self, net: PairSession, count: int) -> Observed:
        """States (2 * count, 1 + frames, 263) in which his motion is known, and not where he is from the other."""
        result = known_state(net, PairMotion.stack([self.known] * count), self.known.features.shape[-2])
        result.mask[:, 0] = result.mask[1::2] = False
        return result

    def answer(self, prior: Prior, sampled: PairMotion, *, foot_lock: bool) -> Motion:
        """The second person of a sampled pair, in his world, at his rate and on his floor."""
        second = finish_person(prior, sampled.moved_to(self.known.poses[0], 0), 1, foot_lock=foot_lock)
        second = second.at(np.arange(len(self.motion)) / self.motion.fps * FPS, self.motion.fps)
        return replace(second, root=second.root * [self.ratio, 1.0, self.ratio] + self.floor * _UP)


@dataclass(frozen=True, eq=False)
class PairPast:
    """Two people who go on: their own motions, and the one ground on which both are uniform people (`data.pairs`)."""

    motions: Duet
    legs: tuple[float, float]
    """Metres."""
    known: PairMotion
    """Their last frames at 20 per second, up to `PAST_FRAMES`, on that ground."""
    floors: Array
    """(2,) metres: the heights that their features call 0."""

    @staticmethod
    def of(motions: Duet) -> "PairPast":
        """Raises `MotionloomError` as `data.pairs.together` does."""
        first, second = motions
        alike = len(first) == len(second) and abs(first.fps - second.fps) <= 1e-3 * first.fps
        count = round(CONTEXT * first.fps) + 2 if alike else max(len(first), len(second))
        tails = [motion.frames(max(len(motion) - count, 0), len(motion)) for motion in motions]
        together(tails[0], tails[1], name="the past of the two")
        legs = read_body(first.skeleton).leg, read_body(second.skeleton).leg
        last, rate = len(tails[0]) - 1, first.fps / FPS
        at = last - np.arange(min(int(last / rate + 1e-6) + 1, PAST_FRAMES))[::-1] * rate
        places = one_world([person_at(tail, at) for tail in tails], legs)
        places = np.concatenate([places, 2 * places[:, -1:] - places[:, -2:-1]], axis=1)  # the last goes straight on
        return PairPast(motions, legs, two.encode(places), two.floors(places))

    def to_own_scale(self, person: int, places: Array) -> Array:
        """Places (frames, 22, 3) on the common ground as the uniform person that ``person`` alone is: `one_world`
        undone."""
        ratio = float(np.mean(self.legs)) / self.legs[person]
        return places + (ratio - 1.0) * places[:, :1] * np.array([1.0, 0.0, 1.0])

    def extend(self, sampled: PairMotion, added: int, *, foot_lock: bool) -> Duet:
        """The motions with ``added`` frames more, of a sampled pair that begins with what is known."""
        features = sampled.features.astype(np.float64)
        places = PairMotion(features, self.known.poses).places() + self.floors[:, None, None, None] * _UP
        contacts = features[..., LAYOUT["contacts"]]
        first, second = (self._extend_person(i, places[i], contacts[i], added, foot_lock) for i in (0, 1))
        return first, second

    def _extend_person(self, person: int, places: Array, contacts: Array, added: int, foot_lock: bool) -> Motion:
        motion, last = self.motions[person], self.known.features.shape[-2] - 1
        count = int(last / FPS * motion.fps + 1e-6) + 1
        tail = motion.frames(len(motion) - count, len(motion))
        at = (np.arange(count + max(added, SHORTEST_SEAM)) - (count - 1)) / motion.fps * FPS + last
        nearest = np.clip(at.round().astype(int), 0, len(contacts) - 1)
        sampled = positions_at(self.to_own_scale(person, places), at)
        new = continue_motion(tail, sampled, contacts=contacts[nearest], foot_lock=foot_lock)
        return concatenate(motion, new.frames(0, added))
