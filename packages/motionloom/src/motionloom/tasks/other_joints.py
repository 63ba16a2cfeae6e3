"""Prediction by networks of other joints than the 22: what a predictor says of its joints and rate is what is used.

A clip becomes a motion of the predictor's joints at its rate (`on_joints_of`), and its futures, held parts and
switches are motions of that skeleton. Published networks (Chen et al. 2023, HumanMAC) do not see the way through the
world: their people stay where the past ends. `tasks.predict` calls these functions; its docstrings list the arguments.
"""

from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from motionloom.core import rotations as rot
from motionloom.core.errors import MotionloomError
from motionloom.core.features.humanml import positions_at
from motionloom.core.features.positions import SMPL_LAYOUT
from motionloom.core.models.predictor import Predictor
from motionloom.core.motion import Motion
from motionloom.core.skeleton import SMPL22, Skeleton
from motionloom.goals.hold import FixedJoints
from motionloom.kinematics.layout_body import body_of_places, layout_skeleton, places_on_layout, smpl_joints
from motionloom.requests.sampling import PredictionSampling
from motionloom.tasks.completion import Known, WindowSampler, window_count
from motionloom.tasks.splice import concatenate, move_rigidly, person_at

Array = NDArray[np.float64]


def sees_person(predictor: Predictor) -> bool:
    """Whether a predictor sees the 22 joints and their way through the world, so that any skeleton goes on by it."""
    return predictor.layout.names == SMPL_LAYOUT.names and predictor.layout.root


def on_joints_of(predictor: Predictor, motion: Motion, *, skeleton: Skeleton | None = None) -> Motion:
    """A clip as a motion of the predictor's joints, at its rate.

    Args:
        predictor: says the joints and the rate.
        motion: of two frames or more, on any humanoid skeleton, or on the predictor's joints already.
        skeleton: the one to put it on, such as another clip's; None: of the clip's own bone lengths.

    Raises:
        MotionloomError: for a clip of one frame, and for joints that correspond to none of the 22.
    """
    if len(motion) < 2:
        raise MotionloomError(f"the past has {len(motion)} frame; at least 2 are needed to see how it moves")
    layout, count = predictor.layout, int((len(motion) - 1) / motion.fps * predictor.fps + 1e-6) + 1
    alike = motion.skeleton.names == layout.names and motion.skeleton.parents == layout.parents
    if alike and abs(motion.fps - predictor.fps) < 1e-6 and skeleton in (None, motion.skeleton):
        return motion
    at = np.arange(max(count, 2)) / predictor.fps * motion.fps
    places = positions_at(motion.positions(), at) if alike else places_on_layout(layout, person_at(motion, at))
    return body_of_places(places, skeleton or layout_skeleton(layout, places), predictor.fps)


def future_pieces(
    predictor: Predictor,
    past: Motion,
    *,
    total: int,
    numbers: Sequence[int],
    hold: FixedJoints | None,
    sampling: PredictionSampling,
) -> Iterator[list[Motion]]:
    """``total`` frames behind a past of the predictor's joints, window after window: of each future its next piece.

    Future i of ``numbers`` is sampled from (``seed``, i), whichever others there are.
    """
    seen = past.frames(max(len(past) - predictor.observed, 0), len(past)).positions()
    [seed] = replace(sampling, first=0, count=1).seeds(1)
    known = HeldPlaces.of(predictor, past, hold).known if hold else None
    person = np.broadcast_to(seen, (len(numbers), *seen.shape))
    windows = WindowSampler(predictor, sampling).windows(
        person, [(seed, i) for i in numbers], known, window_count(predictor, total / past.fps)
    )
    begin = 0
    for window in windows:
        count = min(window.shape[1], total - begin)
        yield [body_of_places(one[:count], past.skeleton, past.fps) for one in window]
        begin += count


@dataclass(frozen=True, eq=False)
class HeldPlaces:
    """A `FixedJoints` as places of a predictor's joints."""

    places: Array
    """(frames, joints, 3) metres, from the first frame to predict."""
    mask: NDArray[np.float32]
    """(frames, parts)"""

    @staticmethod
    def of(predictor: Predictor, past: Motion, hold: FixedJoints) -> "HeldPlaces":
        """Raises MotionloomError for a root whose way the predictor does not see, and for parts without a joint."""
        source = _turned_to(past, len(past) - 1, hold.source, 0) if hold.align else hold.source
        places, layout = source.positions(), predictor.layout
        mask = np.zeros((len(places), layout.parts), dtype=np.float32)
        times = np.arange(1, len(places) + 1) / past.fps
        joints_of = smpl_joints(layout)
        for part in hold.parts:
            if "root" in part.joints:
                layout.part(0)  # raises where the way is not seen
            chosen = set(SMPL22.resolve(name for name in part.joints if name != "root"))
            held = [j for j, joints in enumerate(joints_of) if set(joints) <= chosen and (j or layout.root)]
            if not held:
                raise MotionloomError(
                    f"the predictor has no joint of {', '.join(part.joints)} to hold; its joints are "
                    f"{', '.join(layout.names[not layout.root :])}"
                )
            inside = np.zeros(len(places), dtype=bool)
            for begin, end in part.spans:
                inside |= (times > begin - 1e-6) & (times < end + 1e-6)
            for joint in held:
                mask[inside, layout.part(joint)] = 1
        return HeldPlaces(places, mask)

    def known(self, first: int, last: int) -> Known | None:
        """What is known of the frames ``first`` to before ``last`` behind the past (1 is the first)."""
        frames = slice(first - 1, min(last - 1, len(self.places)))
        if first - 1 >= len(self.places) or not self.mask[frames].any():
            return None
        return Known(self.places[frames], self.mask[frames])


def arrive(
    sampler: WindowSampler, past: Motion, target: Motion, *, gap: int, number: int, turn: bool, shown: int
) -> Motion:
    """The past, ``gap`` sampled frames and the target, all of the predictor's joints; the target begins where the past
    ends, and faces as it does there with ``turn``. ``shown``: frames of the target that the network sees, at most."""
    predictor, layout = sampler.predictor, sampler.predictor.layout
    seen = past.frames(max(len(past) - predictor.observed, 0), len(past)).positions()
    moved = _turned_to(past, len(past) - 1, target, 0) if turn else target
    about = moved.root[0]
    moved = move_rigidly(moved, rot.IDENTITY, about, past.root[-1] * [1.0, 0.0, 1.0] + about * [0.0, 1.0, 0.0])
    last = min(predictor.frames - len(seen), gap + min(shown, len(moved)))
    goal = moved.positions()[: last - gap]
    places = np.concatenate([np.repeat(goal[:1], gap, axis=0), goal])
    mask = np.zeros((last, layout.parts), dtype=np.float32)
    mask[gap:] = 1
    seeds = [(sampler.sampling.seeds(1)[0], number)]
    sampled = sampler.window(seen[None], seeds, 2**20, Known(places, mask), frames=last)[0]
    return concatenate(past, body_of_places(sampled[:gap], past.skeleton, past.fps), moved)


def _turned_to(past: Motion, at: int, other: Motion, frame: int) -> Motion:
    """``other`` turned about the vertical so that it faces in a frame as ``past`` does in its own; as it is where a
    skeleton's hips have no names."""
    names = past.skeleton.names
    if not {"left_hip", "right_hip"} <= set(names):
        return other
    left, right = names.index("left_hip"), names.index("right_hip")

    def facing(motion: Motion, number: int) -> float:
        places = motion.frames(number, number + 1).positions()[0]
        across = places[left] - places[right]
        return float(np.arctan2(-across[2], across[0]))

    turn = rot.rotvec_to_quat(np.array([0.0, facing(past, at) - facing(other, frame), 0.0]))
    return move_rigidly(other, turn, other.root[frame], other.root[frame])
