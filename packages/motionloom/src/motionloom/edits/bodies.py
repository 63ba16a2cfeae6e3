"""Two bodies: how the denoised estimates of a pair are changed, so that people meet and are not in each other."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from motionloom.edits.apart import kept_apart
from motionloom.edits.meeting import Meeting
from motionloom.edits.steering import toward
from motionloom.features.pair import PairMotion, PlaceCode
from motionloom.ground import GroundPose
from motionloom.runtime.pair import join, part
from motionloom.weights.prior import Prior

SURE = 0.8
"""The noise of a level above which nothing is moved: where the two are is not decided."""


@dataclass(eq=False)
class Bodies:
    """How the estimates of one pair are changed: their hands meet where something says so, and they are kept apart."""

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

        begin: the ground poses before; None: those that the state's own D says.
        """
        places, motion = part(state)
        poses = code.decode(places) if begin is None else begin
        if prior.schedule.at(level)[1] > SURE:
            return state, poses
        free = np.array(self.free, dtype=np.float64)
        shares = free / free.sum().clip(1.0)
        pair = PairMotion(motion.astype(np.float64) * prior.spread + prior.mean, np.asarray(poses, dtype=np.float64))
        made, close = pair, (0, 0)
        if self.meeting:
            self.meeting.look(pair.places())
            made = self._reaching(prior, self.meeting.near(made, shares), level)
            close = self.meeting.close(motion.shape[1])
        made = kept_apart(made, shares, still=self.still, close=close)
        if made is pair:
            return state, poses
        # the difference: what is not sure yet is near 0, and must not become sure by this
        places = (places + code.encode(made.poses) - code.encode(pair.poses)).astype(places.dtype)
        return join(places, ((made.features - prior.mean) / prior.spread).astype(motion.dtype)), made.poses

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
