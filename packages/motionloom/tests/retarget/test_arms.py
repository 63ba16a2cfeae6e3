"""Hands stay where they are against the chest, whatever carries the shoulders."""

from dataclasses import replace

import numpy as np
import pytest

from motionloom.core import rotations as rot
from motionloom.core.motion import Motion
from motionloom.core.skeleton import SMPL22, Skeleton
from motionloom.retarget import from_smpl22, joints22, to_smpl22

COLLARS = ("left_collar", "right_collar")
WRISTS = [20, 21]


def without_collars(size: float = 1.0) -> Skeleton:
    """The uniform person with its arms hung on the chest."""
    rest, keep = SMPL22.rest_positions() * size, [j for j, n in enumerate(SMPL22.names) if n not in COLLARS]
    parents = [-1 if SMPL22.parents[j] < 0 else SMPL22.parents[j] for j in keep]
    parents = [9 if p in (13, 14) else p for p in parents]
    offsets = [rest[j] - (rest[p] if p >= 0 else 0) for j, p in zip(keep, parents)]
    where = {j: k for k, j in enumerate(keep)} | {-1: -1}
    names = tuple(SMPL22.names[j] for j in keep)
    return Skeleton(names, tuple(where[p] for p in parents), np.array(offsets), on_floor=True)


def bent_arms(frames: int = 20) -> np.ndarray:
    """(frames, 22, 4): both arms ahead with bent elbows, the whole body turning."""
    turns = np.zeros((frames, 22, 3))
    time = np.linspace(0, 1, frames)
    turns[:, 0, 1], turns[:, 6, 0] = time, 0.3 * time
    for side, sign in ((0, 1.0), (1, -1.0)):
        turns[:, 16 + side, 1] = -sign * (0.9 + 0.2 * time)
        turns[:, 18 + side, 1] = -sign * 1.5
    return rot.rotvec_to_quat(turns)


def on_chest(motion: Motion) -> np.ndarray:
    """(frames, 2, 3) metres: the wrists from the chest, turned as it is."""
    places = joints22(motion)
    chest = motion.skeleton.index("spine3")
    world = motion.world_rotations()[:, chest]
    apart = places[:, WRISTS] - motion.positions()[:, chest, None]
    return rot.rotate(rot.inverse(world)[:, None], apart)


def pulled(size: float) -> Motion:
    """A person without collar bones whose shoulders an animator pulls ahead and in, both by some centimetres."""
    skeleton = without_collars(size)
    keep = [SMPL22.index(name) for name in skeleton.names]
    moved = np.tile(skeleton.offsets, (20, 1, 1))
    for name, sign in (("left_shoulder", 1.0), ("right_shoulder", -1.0)):
        moved[:, skeleton.index(name)] += np.linspace(0, size, 20)[:, None] * [-sign * 0.04, 0.02, 0.07]
    root = np.tile(skeleton.offsets[0], (20, 1))
    return Motion(skeleton, 30.0, root, bent_arms()[:, keep], moved)


@pytest.mark.parametrize("size", [1.0, 1.7])
def test_hands_of_arms_pulled_out_of_their_sockets_come_back_from_the_uniform_person(size: float) -> None:
    motion = pulled(size)
    person = to_smpl22(motion)
    assert np.allclose(on_chest(person), on_chest(motion) / size, atol=2e-3)
    back = from_smpl22(person, motion.skeleton)
    assert np.allclose(on_chest(back), on_chest(motion), atol=2e-3 * size)
    assert back.translations is None


def test_without_collars_the_hands_of_a_shrug_go_up_with_the_arms() -> None:
    turns = rot.quat_to_rotvec(bent_arms())
    turns[:, 13, 2], turns[:, 14, 2] = 0.4, -0.4
    shrug = Motion(SMPL22, 30.0, np.tile(SMPL22.offsets[0], (20, 1)), rot.rotvec_to_quat(turns))
    assert np.allclose(on_chest(from_smpl22(shrug, without_collars())), on_chest(shrug), atol=2e-3)


def test_a_straight_arm_that_must_shorten_bends_its_elbow_backwards() -> None:
    motion = pulled(1.0)
    still = replace(motion, rotations=np.tile(rot.IDENTITY, (*motion.rotations.shape[:2], 1)))
    assert motion.translations is not None
    inwards = motion.translations.copy()
    inwards[:, :, 2] = motion.skeleton.offsets[:, 2]
    person = to_smpl22(replace(still, translations=inwards))
    places = person.positions()[-1]
    for shoulder, elbow, wrist in ((16, 18, 20), (17, 19, 21)):
        assert places[elbow, 2] < places[[shoulder, wrist], 2].min() - 0.02


def test_arms_without_a_length_are_left_alone() -> None:
    skeleton = without_collars()
    offsets = skeleton.offsets.copy()
    offsets[[skeleton.index(f"{side}_{part}") for side in ("left", "right") for part in ("elbow", "wrist")]] = 0.0
    stump = replace(skeleton, offsets=offsets)
    shrug = Motion(SMPL22, 30.0, np.tile(SMPL22.offsets[0], (20, 1)), bent_arms())
    assert np.isfinite(from_smpl22(shrug, stump).rotations).all()
    assert np.isfinite(to_smpl22(from_smpl22(shrug, stump)).rotations).all()
