"""Features mean what they say: round trips and symmetries."""

import numpy as np
import pytest
from hypothesis import example, given, settings
from hypothesis import strategies as st

from motionloom.core import rotations as rot
from motionloom.core.errors import MotionloomError
from motionloom.core.features import humanml
from motionloom.core.features.layout import LAYOUT
from motionloom.core.skeleton import HUMANML_BONE_LENGTHS, SMPL22
from tests.core.features.people import wander
from tests.kinematics import people

PAIRS = list(SMPL22.mirror_pairs())
SEEDS = st.integers(0, 10_000)


def person(seed: int) -> np.ndarray:
    return humanml.canonical(humanml.uniform(wander(seed).positions()))


def turned(positions: np.ndarray, yaw: float) -> np.ndarray:
    return rot.rotate(rot.rotvec_to_quat(np.array([0, yaw, 0])), positions)


def distances(positions: np.ndarray) -> np.ndarray:
    return np.linalg.norm(positions[:, :, None] - positions[:, None], axis=-1)


@settings(max_examples=10, deadline=None)
@given(SEEDS)
@example(343)
@example(344)
@example(873)
def test_decoding_an_encoding_gives_the_positions_up_to_where_the_facing_passes_minus_z(seed: int) -> None:
    """Behind that frame the published numbers turn the whole person; the poses stay what they were."""
    positions = person(seed)
    turn = humanml.heading_quaternions(positions)
    passing = np.flatnonzero((turn[1:] * turn[:-1]).sum(-1) < 0)
    exact = len(positions) - 1 if passing.size == 0 else passing[0] + 1
    decoded = humanml.decode_positions(humanml.encode(positions))
    np.testing.assert_allclose(decoded[:exact], positions[:exact], atol=2e-5)
    np.testing.assert_allclose(distances(decoded), distances(positions[:-1]), atol=1e-4)
    np.testing.assert_allclose(decoded[..., 1], positions[:-1, :, 1], atol=2e-5)


@settings(max_examples=5, deadline=None)
@given(SEEDS)
def test_corrected_heading_loses_only_the_facing_of_frame_0(seed: int) -> None:
    positions = person(seed)
    decoded = humanml.decode_positions(humanml.encode(positions, heading="corrected"))
    q = humanml.heading_quaternions(positions, heading="corrected")[0]
    np.testing.assert_allclose(decoded, rot.rotate(q, positions)[:-1], atol=2e-5)


@pytest.mark.parametrize("rounds", [1.5, -2.0])
def test_corrected_heading_goes_on_when_somebody_turns_past_where_they_started(rounds: float) -> None:
    """The published code turns the frame in which the facing passes -Z by the wrong sign, and all that follow."""
    positions = humanml.uniform(people.circling(2.0, rounds))
    q = humanml.heading_quaternions(positions, heading="corrected")[0]
    there = rot.rotate(q, positions - positions[0, 0] * [1, 0, 1])[:-1]
    decoded = humanml.decode_positions(humanml.encode(positions, heading="corrected"))
    np.testing.assert_allclose(decoded, there, atol=1e-4)


@pytest.mark.parametrize("heading", ["compatible", "corrected"])
def test_displacements_of_decoded_places_are_the_stored_ones(heading: humanml.Heading) -> None:
    features = humanml.encode(person(5), heading=heading).astype(np.float64)
    stored = features[:-1, LAYOUT["joint_velocity"]].reshape(-1, 22, 3)
    np.testing.assert_allclose(humanml.displacements(features), stored, atol=2e-6)


@settings(max_examples=5, deadline=None)
@given(SEEDS, st.floats(-3, 3))
def test_features_do_not_see_place_and_facing(seed: int, yaw: float) -> None:
    positions = humanml.uniform(wander(seed).positions())
    moved = turned(positions, yaw) + np.array([3.0, 0.4, -2.0])
    same = humanml.encode(humanml.canonical(moved))
    np.testing.assert_allclose(same, humanml.encode(humanml.canonical(positions)), atol=1e-4)


@pytest.mark.parametrize("heading", ["compatible", "corrected"])
def test_mirrored_features_are_features_of_the_mirror_image(heading: humanml.Heading) -> None:
    positions = person(3)
    image = (positions * [-1, 1, 1])[:, PAIRS]
    features = humanml.encode(positions, heading=heading)
    np.testing.assert_allclose(humanml.mirror(features), humanml.encode(image, heading=heading), atol=2e-5)
    np.testing.assert_array_equal(humanml.mirror(humanml.mirror(features)), features)


def test_uniform_gives_everybody_the_same_bones_and_keeps_directions() -> None:
    positions = wander(1).positions() * 1.2
    result = humanml.uniform(positions)
    bones = np.diff(result[:, [SMPL22.parents[1:], range(1, 22)]], axis=1)[:, 0]
    np.testing.assert_allclose(np.linalg.norm(bones, axis=-1), np.tile(HUMANML_BONE_LENGTHS, (60, 1)), atol=1e-9)
    np.testing.assert_allclose(result[:, 0], positions[:, 0] / 1.2, atol=1e-9)


def test_both_decoders_agree_on_rotations_made_for_the_second_one() -> None:
    # The second decoder puts the heading itself at the head of the chains, so a person who never turns is needed.
    positions = person(5)
    features = humanml.encode(positions)
    still = np.tile(rot.IDENTITY, (len(positions), 1))
    features[:, LAYOUT["yaw_velocity"]] = 0
    features[:, LAYOUT["ric"]] = (positions - positions[:, :1] * [1, 0, 1])[:-1, 1:].reshape(-1, 63)
    features[:, LAYOUT["rot6d"]] = humanml.rotations6d(positions, still)[:-1].reshape(-1, 126)
    features[:, LAYOUT["root_velocity"]] = np.diff(positions[:, 0], axis=0)[:, [0, 2]]
    np.testing.assert_allclose(humanml.positions_from_rot6d(features), humanml.decode_positions(features), atol=1e-5)


def test_a_walk_forward_has_forward_velocity_only() -> None:
    rest = np.tile(SMPL22.rest_positions(), (30, 1, 1))
    rest[..., 2] += 0.05 * np.arange(30)[:, None]
    features = humanml.encode(humanml.canonical(rest))
    np.testing.assert_allclose(features[:, LAYOUT["root_velocity"]], np.tile([0, 0.05], (29, 1)), atol=2e-4)
    np.testing.assert_allclose(features[1:, LAYOUT["yaw_velocity"]], 0, atol=1e-6)
    assert (features[:, LAYOUT["contacts"]] == 0).all()  # 5 cm a frame is faster than the threshold


def test_resampling_keeps_circles_round() -> None:
    angle = np.arange(91) / 30 * 4
    circle = np.stack([np.cos(angle), np.sin(angle), 0 * angle], -1)[:, None].repeat(22, 1)
    result = humanml.resample_positions(circle, 30)
    assert len(result) == 61
    np.testing.assert_allclose(np.linalg.norm(result[2:-2], axis=-1), 1, atol=2e-4)


def test_the_whole_pipeline_takes_a_motion_at_any_rate() -> None:
    motion = wander(4, frames=91, fps=30)
    features = humanml.motion_to_features(motion)
    assert features.shape == (60, 263)
    assert np.isfinite(features).all()


def test_mistakes_are_reported_in_one_sentence() -> None:
    with pytest.raises(MotionloomError, match="positions must be"):
        humanml.encode(np.zeros((5, 21, 3)))
    with pytest.raises(MotionloomError, match="not finite"):
        humanml.encode(np.full((5, 22, 3), np.nan))
    with pytest.raises(MotionloomError, match="legs have no length"):
        humanml.uniform(np.zeros((5, 22, 3)))
    with pytest.raises(MotionloomError, match="features must be"):
        humanml.decode_positions(np.zeros((5, 262)))
    with pytest.raises(MotionloomError, match="heading must be"):
        humanml.encode(person(1), heading="backwards")  # type: ignore[arg-type]
