"""The 263 features and their decoding against numbers recorded from the published code."""

import numpy as np
import pytest

from motionloom.core import rotations as rot
from motionloom.core.features import humanml
from motionloom.core.features.layout import LAYOUT
from motionloom.core.skeleton import SMPL22
from tests.conformance.runner import MOTION, Case, cases, compare, normal, stream


def formula_joints(case: Case) -> np.ndarray:
    """(frames, 22, 3) float32: the recorded input, from its formula."""
    c = case.config
    n, j, k = np.arange(c["frames"])[:, None, None], np.arange(22)[None, :, None], np.arange(3)
    w = 0.11 + 0.013 * ((7 * j + c["seed"]) % 5)
    vectors = c["amplitude"] * np.sin(w * (1 + 0.1 * k) * n + 0.7 * j + 1.3 * k + 0.31 * c["seed"])
    vectors[:, 0] *= 0.3
    local = rot.rotvec_to_quat(vectors)
    theta = c["yaw0"] + c["turn"] * np.arange(c["frames"])
    yaw = rot.rotvec_to_quat(theta[:, None] * [0, 1, 0])
    bones = humanml.OFFSETS * (c["scale"] * (1 + 0.06 * np.sin(np.arange(22))))[:, None]
    step = c["speed"] * np.stack([np.sin(theta), 0 * theta, np.cos(theta)], -1)
    place = np.zeros((c["frames"], 22, 3))
    place[:, 0] = np.array([0.5, 0.95, -0.2]) + np.cumsum(step, 0) - step
    place[:, 0, 1] += 0.03 * np.sin(0.3 * np.arange(c["frames"]))
    world = [rot.multiply(yaw, local[:, 0])]
    for joint, p in enumerate(SMPL22.parents[1:], start=1):
        world.append(rot.multiply(world[p], local[:, joint]))
        place[:, joint] = place[:, p] + rot.rotate(world[joint], bones[joint])
    return place.astype(np.float32)


@pytest.mark.parametrize("case", cases("humanml_features", kind="features"))
def test_encoding_gives_the_recorded_numbers(case: Case) -> None:
    joints = formula_joints(case)
    assert case.config["contact_threshold"] == humanml.CONTACT_THRESHOLD
    compare(case, "joints", joints)
    if case.config["mirror"]:
        joints = (joints * np.float32([-1, 1, 1]))[:, SMPL22.mirror_pairs()]
    uniform = humanml.uniform(joints)
    compare(case, "uniform", uniform)
    canonical = humanml.canonical(uniform)
    compare(case, "canonical", canonical)
    features = humanml.encode(canonical)
    assert features.dtype == np.float32
    for block, where in LAYOUT.items():
        flat = block in ("yaw_velocity", "root_height")
        compare(case, block, features[:, where.start] if flat else features[:, where])
    compare(case, "recovered", humanml.decode_positions(features))


@pytest.mark.parametrize("case", cases("humanml_features", kind="decode"))
def test_decoding_gives_the_recorded_numbers(case: Case) -> None:
    z = normal(stream(case.config["seed"], MOTION), (case.config["batch"], case.config["frames"], 263))
    features = np.concatenate(
        [
            0.03 * z[..., :3],
            0.9 + 0.05 * z[..., 3:4],
            0.3 * z[..., 4:67],
            z[..., 67:193],
            0.02 * z[..., 193:259],
            z[..., 259:] > 0,
        ],
        axis=-1,
    ).astype(np.float32)
    quaternion, place = humanml.recover_root(features)
    compare(case, "root_quaternion", quaternion)
    compare(case, "root_position", place)
    compare(case, "positions", humanml.decode_positions(features))
    compare(case, "positions_from_rot6d", humanml.positions_from_rot6d(features, humanml.OFFSETS))
