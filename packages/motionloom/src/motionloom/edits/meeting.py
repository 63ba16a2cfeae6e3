"""Two people who are sampled meet: they come near each other, and their hands to one place.

The contact in the words (`goals.contact`) has no time and no place. Both are found in the first estimate that is sure:
the frame in which what shall meet is nearest already. From then on every estimate is changed: the relative pose so that
both reach, then the arms, as any other goal does (`steering`). What is left is fitted when all is sampled (`met`).
"""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from motionloom.core.blending import smoothstep
from motionloom.core.features.pair import PairMotion, PlaceCode
from motionloom.core.ground import GroundPose, relative, turned
from motionloom.core.models.networks.pair import join, part
from motionloom.core.models.prior import Prior
from motionloom.core.motion import Motion, heading
from motionloom.core.skeleton import SMPL22
from motionloom.edits.apart import even, kept_apart, shift_apart
from motionloom.edits.fitting import fit
from motionloom.edits.relative_pose import lacking
from motionloom.edits.steering import toward
from motionloom.goals.contact import CHEST, RIGHT, Contact, Touch
from motionloom.goals.goal import Goal, overlaid
from motionloom.kinematics.capsules import ARMS, CAPSULES, RADII, capsule_ends, closest

Array = NDArray[np.float64]

MIDDLE = (0.25, 0.75)
"""Shares of the length between which people meet."""
LATE = 0.1
"""Metres that being at the end of that stretch, instead of in the middle, counts like."""
GAP = 0.04
"""Metres between two wrists that touch."""
OFFERED = 0.03
"""Metres below and above where hands meet at which a given person's hand is reached for."""
LEFT_OF = 0.06
"""Metres that each of two people in each other's arms stands to the left of the middle: heads and arms pass."""
ASIDE = 0.12
"""Metres on the ground, from the middle between two people, within which their hands meet."""


_STANDING = SMPL22.rest_positions()[:, 1] - SMPL22.rest_positions()[:, 1].min()
"""(22,) metres above the floor of the joints of somebody who stands."""


@dataclass(eq=False)
class Meeting:
    """Where in time two people touch, and how; found once."""

    contact: Contact
    free: tuple[bool, bool] = (True, True)
    """Who goes there."""
    still: int = 0
    """Frames that stay as they are."""
    frame: int | None = None
    """The middle of the touch."""
    way: tuple[Touch, ...] = ()

    def look(self, places: Array) -> None:
        """Find the frame and the way: those in which what meets is nearest; places (2, frames, 22, 3) metres."""
        if self.frame is not None:
            return
        frames = places.shape[1]
        first, last = (self.still + round(share * (frames - self.still)) for share in MIDDLE)
        at = np.arange(first, max(last, first + 1))
        late = LATE * np.abs(np.linspace(-1.0, 1.0, len(at)))
        ways = self.contact.ways
        far = []
        for way in ways:
            apart = [places[one.person, at, one.joint] - places[1 - one.person, at, one.other] for one in way]
            far.append(late + sum(np.linalg.norm(line, axis=-1) / len(way) for line in apart))
        chosen = int(np.argmin([one.min() for one in far]))
        self.way, self.frame = ways[chosen], int(at[far[chosen].argmin()])

    def near(self, pair: PairMotion, shares: Array) -> PairMotion:
        """The pair, as near to each other and turned as it takes; (2,) shares of the way, of sum 1 or 0."""
        if self.frame is None or not shares.any():
            return pair
        now = pair.ways()[:, self.frame]
        there = relative(now[0], now[1])
        target = np.stack([[1.0, 0.0, 0.0, 0.0], self._there(there)])
        change = lacking(now[None], target[None], shares)[0]
        frames = pair.features.shape[1]
        share = np.ones(frames)
        if self.still:
            share = smoothstep((np.arange(frames) - self.still + 1) / max(self.frame - self.still, 1))
        return pair.changed(share[:, None] * change, shares)

    def _there(self, there: Array) -> Array:
        """The second person's ground pose as the first sees it, (4,), changed as little as it takes."""
        c, s, x, z = there
        distance = float(np.hypot(x, z))
        target = float(np.clip(distance, *self.contact.apart))
        if self.contact.turn == "facing":
            return np.array([-1.0, 0.0, -2 * LEFT_OF if self.contact.close else 0.0, target])
        if self.contact.turn == "beside":
            side = -1.0 if self.way[0].joint == RIGHT else 1.0
            return np.array([1.0, 0.0, side * target, 0.0])
        scale = target / max(distance, 1e-6)
        return np.array([c, s, x * scale, z * scale])

    def goals(self, places: Array) -> tuple[Goal, Goal]:
        """The goals of each, in the world of places (2, frames, 22, 3) metres."""
        frames = places.shape[1]
        goals = Goal.nothing(frames), Goal.nothing(frames)
        if self.frame is None:
            return goals
        at = np.arange(*self._span(frames))
        poses = self._embrace(places[:, at]) if self.contact.close else None
        for touch in self.way:
            if touch.beside is not None:
                _ask(goals[touch.person], at, touch.joint, self._beside(touch, places[1 - touch.person, at], poses))
                continue
            ends = places[0, at, touch.joint], places[1, at, touch.other]
            if not all(self.free):  # a hand of somebody given is reached for only where such hands meet
                low, high = self.contact.height
                hand = ends[0] if self.free[1] else ends[1]
                if not low - OFFERED < float(hand[:, 1].mean()) < high + OFFERED:
                    continue
            point, across = self._point(places[:, at], ends)
            _ask(goals[0], at, touch.joint, point - GAP / 2 * across)
            _ask(goals[1], at, touch.other, point + GAP / 2 * across)
        for goal, pose in zip(goals, poses or (), strict=False):
            goal.positions[at, 0], goal.mask[at, 0] = (pose.x, 0.0, pose.z), (True, False, True)
            goal.facing[at], goal.facing_mask[at] = pose.facing, True
        return goals

    def _span(self, frames: int) -> tuple[int, int]:
        """The frames of the touch, of so many."""
        assert self.frame is not None
        half = max(round(self.contact.seconds * 10), 1)
        return max(self.frame - half, self.still), min(self.frame + half + 1, frames)

    def close(self, frames: int) -> tuple[int, int]:
        """The frames in which the two are in each other's arms, of so many."""
        return self._span(frames) if self.contact.close and self.frame is not None else (0, 0)

    def _embrace(self, places: Array) -> list[GroundPose]:
        """Where both stand while they are in each other's arms: as near and turned as the words say, in the middle
        between them."""
        hips = places[:, :, 0].mean(axis=1)
        line = (hips[1] - hips[0])[[0, 2]]
        distance = float(np.linalg.norm(line))
        half = float(np.clip(distance, *self.contact.apart)) / 2
        facing = float(np.arctan2(line[0], line[1])) if distance > 1e-3 else float(heading(places[0])[0])
        facing += float(np.arctan2(LEFT_OF, half))
        ahead = half * np.array([np.sin(facing), np.cos(facing)])
        left = LEFT_OF * np.array([np.cos(facing), -np.sin(facing)])
        x, z = hips.mean(axis=0)[[0, 2]]
        first, second = np.array([x, z]) - ahead + left, np.array([x, z]) + ahead - left
        return [
            GroundPose(float(first[0]), float(first[1]), facing),
            GroundPose(float(second[0]), float(second[1]), facing + np.pi),
        ]

    def _beside(self, touch: Touch, other: Array, poses: list[GroundPose] | None) -> Array:
        """(frames, 3) where a touch is on the other person, who is at (frames, 22, 3)."""
        beside = np.broadcast_to(np.array(touch.beside), (len(other), 3))
        if poses is None:
            return other[:, touch.other] + turned(beside, heading(other))
        return poses[1 - touch.person].to_world(beside + np.array([0.0, _STANDING[touch.other], 0.0]))

    def _point(self, places: Array, ends: tuple[Array, Array]) -> tuple[Array, Array]:
        """(frames, 3) where two hands meet, and the unit vectors from one to the other."""
        between = places[:, :, CHEST].mean(axis=0)
        line = (places[1, :, CHEST] - places[0, :, CHEST]) * [1.0, 0.0, 1.0]
        across = line / np.linalg.norm(line, axis=-1, keepdims=True).clip(1e-6)
        if not all(self.free):  # whoever is not moved holds the hand there
            fixed, sign = (ends[0], 1.0) if not self.free[0] else (ends[1], -1.0)
            return fixed + sign * GAP / 2 * across, across
        aside = ((ends[0] + ends[1]) / 2 - between).mean(axis=0)
        aside[1] = 0.0
        aside *= min(1.0, ASIDE / max(float(np.linalg.norm(aside)), 1e-9))
        height = np.clip((ends[0] + ends[1])[:, 1].mean() / 2, *self.contact.height)
        point = between + aside
        point[:, 1] = height
        return point, across


def _ask(goal: Goal, at: NDArray[np.intp], joint: int, places: Array) -> None:
    goal.positions[at, joint], goal.mask[at, joint] = places, True


# What is left when all is sampled


ROUNDS = 2
"""How often people are fitted to each other: each moves a little when the other does."""
DEEP = 0.01
"""Metres of an arm in somebody's body that stay."""
EVEN = 5
"""Frames over which the way out of a body is averaged."""


def met(people: Sequence[Motion], meeting: Meeting | None, also: Sequence[Goal | None]) -> tuple[Motion, Motion]:
    """Two people of the 22-joint skeleton at 20 frames per second in one world, fitted to each other.

    What meets is brought together, and who is in the other's body comes out of it. also: further goals of each.
    """
    free = np.array([goal is None for goal in also], dtype=np.float64)
    shares = free / free.sum().clip(1.0) * [-1.0, 1.0]
    for _ in range(ROUNDS):
        places = np.stack([motion.positions() for motion in people])
        touches = meeting.goals(places) if meeting else [Goal.nothing(places.shape[1])] * 2
        shift = shift_apart(places, close=meeting.close(places.shape[1]) if meeting else (0, 0))
        goals = [
            overlaid(touches[i], overlaid(arms_out(places[i], places[1 - i]), _stepped(places[i], shares[i] * shift)))
            for i in (0, 1)
        ]
        if all(goal.empty for goal in goals):
            break
        goals = [
            goal if goal.empty or own is None else overlaid(own, goal) for goal, own in zip(goals, also, strict=True)
        ]
        people = [fit(motion, goal) for motion, goal in zip(people, goals, strict=True)]
    return people[0], people[1]


def _stepped(own: Array, shift: Array) -> Goal:
    """The pelvis, (frames, 2) metres from where it is, where that is more than `DEEP`."""
    goal = Goal.nothing(len(own))
    at = np.flatnonzero(np.linalg.norm(shift, axis=-1) > DEEP)
    goal.positions[at, 0, 0], goal.positions[at, 0, 2] = (own[at, 0][:, [0, 2]] + shift[at]).T
    goal.mask[at, 0] = True, False, True
    return goal


def arms_out(own: Array, other: Array) -> Goal:
    """Where elbows and wrists of ``own`` must be so that no arm is in ``other``; (frames, 22, 3) metres."""
    frames = len(own)
    goal = Goal.nothing(frames)
    arms, body = capsule_ends(own)[:, list(ARMS)], capsule_ends(other)
    s, t, apart = closest(arms[:, :, None], body[:, None])
    thick = [r[..., 0] + at * (r[..., 1] - r[..., 0]) for r, at in ((RADII[list(ARMS)][:, None], s), (RADII, t))]
    deep = thick[0] + thick[1] - apart
    deep[..., list(ARMS)] /= 2  # two arms that cross each go half of the way
    worst = deep.argmax(axis=-1)
    for number, arm in enumerate(ARMS):
        depth = np.take_along_axis(deep[:, number], worst[:, number, None], axis=-1)[:, 0]
        inside = depth > DEEP
        if not inside.any():
            continue
        pick = np.arange(frames), worst[:, number]
        here = _at(arms[:, number], s[:, number][pick])
        there = _at(body[pick], t[:, number][pick])
        away = (here - there) / np.maximum(apart[:, number][pick], 1e-6)[:, None]
        push = even(np.where(inside[:, None], depth[:, None] * away, 0.0), EVEN)
        for end, weight in zip(CAPSULES[arm][:2], (s[:, number][pick] < 0.9, s[:, number][pick] > 0.1), strict=True):
            joint = end[0][0]
            at = np.flatnonzero(inside & weight)
            if joint in _BENDING:
                _ask(goal, at, joint, own[at, joint] + push[at])
    return goal


_BENDING = [joint for number in ARMS for joint, _ in CAPSULES[number][1]]
"""Elbows and wrists."""


def _at(ends: Array, share: Array) -> Array:
    """(frames, 3) on line segments (frames, 2, 3)."""
    return ends[:, 0] + share[:, None] * (ends[:, 1] - ends[:, 0])


# Two bodies: how the denoised estimates of a pair are changed


SURE = 0.8
"""The noise of a level above which nothing is moved: where the two are is not decided."""


@dataclass(eq=False)
class Bodies:
    """How the estimates of one pair are changed: their hands meet where there is a contact, and they are kept apart."""

    free: tuple[bool, bool]
    """Who may be moved as a whole."""
    bends: tuple[bool, bool]
    """Whose limbs may be moved."""
    still: int = 0
    """Frames in which both stay where they are."""
    meeting: Meeting | None = None

    @staticmethod
    def of(mask: np.ndarray, frozen: Sequence[bool], meeting: Meeting | None = None, *, still: int = 0) -> "Bodies":
        """mask: (2, 1 + frames, 263) True where the state is known; frozen: who is not moved as a whole; still: frames
        that stay in any case."""
        known = np.asarray(mask[:, 1:, :3].all(axis=-1))
        still = int(known.all(axis=0).cumprod().sum()) or int(mask[:, 0].any()) or still
        bends = not bool(known[0].all()), not bool(known[1].all())
        free = bends[0] and not frozen[0], bends[1] and not frozen[1]
        if meeting:
            meeting.free, meeting.still = bends, still
        return Bodies(free, bends, still, meeting if any(bends) else None)

    def edit(
        self, prior: Prior, code: PlaceCode, state: np.ndarray, level: int, begin: np.ndarray | None = None
    ) -> tuple[np.ndarray, np.ndarray]:
        """A denoised state (2, 1 + frames, 263), and the ground poses (2, 4) at its first frame, changed.

        begin: the ground poses before; None: those of the state's own D.
        """
        places, motion = part(state)
        poses = code.decode(places) if begin is None else begin
        if prior.schedule.at(level)[1] > SURE:
            return state, poses
        free = np.array(self.free, dtype=np.float64)
        shares = free / free.sum().clip(1.0)
        pair = PairMotion(motion.astype(np.float64) * prior.spread + prior.mean, np.asarray(poses, dtype=np.float64))
        moved, close = pair, (0, 0)
        if self.meeting:
            self.meeting.look(pair.places())
            moved = self._reaching(prior, self.meeting.near(moved, shares), level)
            close = self.meeting.close(motion.shape[1])
        moved = kept_apart(moved, shares, still=self.still, close=close)
        if moved is pair:
            return state, poses
        # the difference: what is not sure yet is near 0, and must not become sure by this
        places = (places + code.encode(moved.poses) - code.encode(pair.poses)).astype(places.dtype)
        return join(places, ((moved.features - prior.mean) / prior.spread).astype(motion.dtype)), moved.poses

    def _reaching(self, prior: Prior, pair: PairMotion, level: int) -> PairMotion:
        """The pair, with limbs that reach for what they are to touch."""
        assert self.meeting is not None
        features = pair.features.copy()
        for i, goal in enumerate(self.meeting.goals(pair.places())):
            if self.bends[i]:
                own = goal.relative_to(GroundPose.of_numbers(pair.poses[i]))
                standard = (features[i] - prior.mean) / prior.spread
                features[i] = toward(own, prior)(standard, level) * prior.spread + prior.mean
        return PairMotion(features, pair.poses)
