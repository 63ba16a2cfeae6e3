"""BABEL's 135 numbers against movements whose numbers can be written down by hand."""

from dataclasses import replace

import numpy as np
import pytest

from motionloom.core import rotations as rot
from motionloom.core.errors import MotionloomError
from motionloom.core.features import babel, humanml
from motionloom.core.motion import Motion
from motionloom.core.skeleton import SMPL22, Skeleton

H = np.pi / 2
SKEW = 2e-3
"""The uniform person's left collar is longer than the right one: by the shoulders they face 0.04 degrees off."""


def standing(frames: int = 10, *, yaw: float = 0.0, fps: float = 30.0) -> Motion:
    """The T-pose one metre up, turned by ``yaw`` about +Y."""
    turned = np.tile(rot.IDENTITY, (frames, 22, 1))
    turned[:, 0] = rot.rotvec_to_quat(np.array([0.0, yaw, 0.0]))
    return Motion(SMPL22, fps, np.tile([0.0, 1.0, 0.0], (frames, 1)), turned)


def walking(
    *, yaw: float = 0.0, frames: int = 31, fps: float = 30.0, start: tuple[float, float] = (0.0, 0.0)
) -> Motion:
    """The T-pose gliding 1.5 m/s where it faces: ``yaw`` about +Y from +Z."""
    still = standing(frames, yaw=yaw, fps=fps)
    way = np.array([np.sin(yaw), 0.0, np.cos(yaw)])
    return replace(still, root=still.root + [start[0], 0, start[1]] + np.arange(frames)[:, None] * 1.5 / fps * way)


def waving(seed: int = 0, frames: int = 12) -> Motion:
    """Every joint turned at random, the root wandering."""
    rng = np.random.default_rng(seed)
    turned = rot.normalize(rng.normal(size=(frames, 22, 4)))
    return Motion(SMPL22, 30.0, rng.normal(size=(frames, 3)) * 0.3 + [0, 1, 0], rot.unroll(turned))


def rows(*numbers: float) -> np.ndarray:
    return np.array(numbers, dtype=np.float64)


def rotation(joint: int) -> slice:
    """Where a joint's two rows are."""
    return slice(3 + 6 * joint, 9 + 6 * joint)


def test_the_blocks_fill_the_135_numbers_in_order() -> None:
    stops = [0]
    for block in babel.LAYOUT.values():
        assert block.start == stops[-1]
        stops.append(block.stop)
    assert stops == [0, 1, 3, babel.WIDTH]


def test_a_person_standing_as_the_rest_pose_is_a_quarter_turn_about_x() -> None:
    """+Y of the body is +Z of the world, +Z of the body is -Y: rows (1, 0, 0) and (0, 0, -1)."""
    numbers = babel.encode(standing(), start="kept")
    assert numbers.shape == (10, 135)
    assert numbers.dtype == np.float32
    np.testing.assert_allclose(numbers[:, :3], np.tile([1, 0, 0], (10, 1)), atol=1e-6)
    np.testing.assert_allclose(numbers[3, rotation(0)], rows(1, 0, 0, 0, 0, -1), atol=1e-6)
    np.testing.assert_allclose(numbers[3, rotation(17)], rows(1, 0, 0, 0, 1, 0), atol=1e-6)


def test_a_bent_elbow_is_written_as_two_rows_not_columns() -> None:
    """A quarter turn about +Y has the rows (0, 0, 1), (0, 1, 0) and the columns (0, 0, -1), (0, 1, 0)."""
    motion = standing()
    turned = motion.rotations.copy()
    turned[:, 18] = rot.rotvec_to_quat(rows(0, H, 0))
    numbers = babel.encode(replace(motion, rotations=turned), start="kept")
    np.testing.assert_allclose(numbers[0, rotation(18)], rows(0, 0, 1, 0, 1, 0), atol=1e-6)
    # a turned-in forearm reaches for what was ahead: the left arm along +X goes to -Z
    wrist = babel.decode(numbers).positions()[0, 20] - babel.decode(numbers).positions()[0, 18]
    np.testing.assert_allclose(wrist, [0, 0, -SMPL22.bone_lengths()[20]], atol=1e-6)


@pytest.mark.parametrize(
    ("yaw", "planar"),
    [(0.0, (0, -0.05)), (H, (0.05, 0)), (np.pi, (0, 0.05)), (-H, (-0.05, 0))],
    ids=["+Z", "+X", "-Z", "-X"],
)
def test_a_straight_walk_is_a_constant_planar_velocity(yaw: float, planar: tuple[float, float]) -> None:
    """1.5 m/s are 5 cm a frame; +Z of this world is -Y of AMASS's, +X is +X; the first frame has none."""
    numbers = babel.encode(walking(yaw=yaw, start=(3.0, -2.0)), start="kept")
    np.testing.assert_allclose(numbers[0, :3], [1, 0, 0], atol=1e-6)
    np.testing.assert_allclose(numbers[1:, 0], 1, atol=1e-6)
    np.testing.assert_allclose(numbers[1:, 1:3], np.tile(planar, (30, 1)), atol=1e-6)


@pytest.mark.parametrize("start", ["compatible", "corrected", "kept"])
@pytest.mark.parametrize("yaw", [0.0, 0.7, H, -2.5])
def test_a_walk_forward_stays_a_walk_forward(yaw: float, start: babel.Start) -> None:
    """Whatever turn is taken off, the decoded person goes 1.5 m where they face, upright, one metre up."""
    motion = babel.decode(babel.encode(walking(yaw=yaw, start=(1.0, 2.0)), start=start))
    gone = motion.root[-1] - motion.root[0]
    np.testing.assert_allclose(gone, 1.5 * babel.facing(motion), atol=SKEW)
    np.testing.assert_allclose(motion.root[0], [0, 1, 0], atol=1e-6)
    head = motion.positions()[:, 15] - motion.root
    assert (head[:, 1] > 0.5).all()
    ahead = babel.forward(motion)
    np.testing.assert_allclose(ahead.root[-1], [0, 1, 1.5], atol=SKEW)
    np.testing.assert_allclose(ahead.positions(), walking().positions(), atol=SKEW)


def test_a_walk_around_a_left_corner_turns_left() -> None:
    """From +Z to +X: the left hand leads a person who faces +Z, and so it does after the round trip."""
    motion = standing(61)
    yaw = np.linspace(0, H, 61)
    turned = motion.rotations.copy()
    turned[:, 0] = rot.rotvec_to_quat(yaw[:, None] * rows(0, 1, 0))
    steps = 0.05 * np.stack([np.sin(yaw), 0 * yaw, np.cos(yaw)], axis=-1)
    whole = replace(motion, rotations=turned, root=motion.root + np.cumsum(steps, axis=0) - steps[0])
    again = babel.forward(babel.decode(babel.encode(whole)))
    np.testing.assert_allclose(again.positions(), whole.positions(), atol=SKEW)
    assert again.root[-1, 0] > 1


def test_the_published_turn_of_known_orientations() -> None:
    """A quarter turn about x has no z: pi/2. With a quarter turn about z first it is 120 degrees about (1, 1, 1)."""
    upright = rot.rotvec_to_quat(rows(H, 0, 0))
    assert babel.published_turn(upright) == pytest.approx(H)
    turned = rot.multiply(rot.rotvec_to_quat(rows(0, 0, H)), upright)
    assert babel.published_turn(turned) == pytest.approx(2 * np.pi / 3 / np.sqrt(3) + H)
    assert babel.published_turn(rot.rotvec_to_quat(rows(0, 0, 0.3))) == pytest.approx(0.3 + H)


def test_the_published_start_faces_minus_x() -> None:
    """The upright person who faces -Y is turned back by pi/2: matrix rows (0, 0, -1), (-1, 0, 0), walking to -x."""
    for start in ("compatible", "corrected"):
        numbers = babel.encode(walking(), start=start)
        off = 1e-6 if start == "compatible" else SKEW
        np.testing.assert_allclose(numbers[0, rotation(0)], rows(0, 0, -1, -1, 0, 0), atol=off)
        np.testing.assert_allclose(numbers[5, 1:3], [-0.05, 0], atol=off)


def test_only_the_corrected_start_forgets_which_way_a_motion_began() -> None:
    """The published turn is no yaw: at 90 degrees it is 1.209 rad short of what it should be by 0.362."""
    corrected = [babel.encode(walking(yaw=yaw), start="corrected") for yaw in (0.0, 0.9, H, -3.0)]
    for other in corrected[1:]:
        np.testing.assert_allclose(other, corrected[0], atol=1e-5)
    off = babel.encode(walking(yaw=H))[5, 1:3]
    left = H - 2 * np.pi / 3 / np.sqrt(3)
    np.testing.assert_allclose(off, 0.05 * np.array([-np.cos(left), -np.sin(left)]), atol=1e-5)


@pytest.mark.parametrize("start", ["compatible", "corrected", "kept"])
def test_random_poses_come_back(start: babel.Start) -> None:
    """Every rotation, with its twist; kept, the world orientation and the path from the origin too."""
    motion = waving()
    again = babel.decode(babel.encode(motion, start=start))
    same = np.abs((again.rotations[:, 1:] * motion.rotations[:, 1:]).sum(-1))
    np.testing.assert_allclose(same, 1, atol=1e-6)
    np.testing.assert_allclose(again.root[:, 1], motion.root[:, 1], atol=1e-6)
    moved = motion.root - motion.root[0] * [1, 0, 1]
    np.testing.assert_allclose(np.linalg.norm(again.root, axis=-1), np.linalg.norm(moved, axis=-1), atol=1e-5)
    if start == "kept":
        np.testing.assert_allclose(again.positions(), motion.positions() - motion.root[0] * [1, 0, 1], atol=1e-5)


def test_numbers_come_back() -> None:
    """A network's numbers are no rotations exactly; what they decode to encodes to numbers that decode the same."""
    noise = np.random.default_rng(1).normal(size=(9, 135)) * 0.3
    once = babel.decode(noise)
    twice = babel.decode(babel.encode(once, start="kept"))
    np.testing.assert_allclose(twice.positions(), once.positions(), atol=1e-5)


def test_the_velocity_of_the_first_frame_moves_nobody() -> None:
    """The published decoding takes the first velocity off again."""
    numbers = babel.encode(walking(), start="kept")
    pushed = numbers.copy()
    pushed[0, 1:3] = [7, -9]
    np.testing.assert_allclose(babel.decode(pushed).root, babel.decode(numbers).root, atol=1e-5)


def test_places_decode_as_motions_do() -> None:
    """Two implementations of forward kinematics: matrices here, quaternions in `Motion`; any leading axes."""
    noise = np.random.default_rng(2).normal(size=(2, 3, 7, 135))
    places = babel.decode_positions(noise)
    assert places.shape == (2, 3, 7, 22, 3)
    np.testing.assert_allclose(places[1, 2], babel.decode(noise[1, 2]).positions(), atol=1e-9)


def test_other_rates_are_resampled_to_thirty() -> None:
    """A second at 60 fps (61 frames) makes 31 frames of the same speed."""
    numbers = babel.encode(walking(frames=61, fps=60.0), start="kept")
    np.testing.assert_allclose(numbers, babel.encode(walking(), start="kept"), atol=1e-5)
    assert babel.decode(numbers).fps == 30


def test_both_representations_tell_the_same_walk() -> None:
    """The way to 263 numbers and back (20 fps) ends where the way to 135 numbers and back does."""
    walk = babel.forward(babel.decode(babel.encode(walking(yaw=1.1))))
    places = humanml.decode_positions(humanml.motion_to_features(walk, heading="corrected"))
    np.testing.assert_allclose(places[-1, 0, [0, 2]], [0, 1.5 * 19 / 20], atol=1e-3)


def test_what_is_no_motion_or_no_features_is_refused() -> None:
    small = Skeleton(("a", "b"), (-1, 0), np.ones((2, 3)))
    motion = Motion(small, 30.0, np.zeros((2, 3)), np.tile(rot.IDENTITY, (2, 2, 1)))
    for act, match in (
        (lambda: babel.encode(motion), "retarget"),
        (lambda: babel.encode(standing(), start="x"), "start must be"),  # type: ignore[arg-type]
        (lambda: babel.decode(np.zeros((4, 263))), "135"),
        (lambda: babel.decode(np.zeros((0, 135))), "at least one frame"),
        (lambda: babel.decode(np.zeros(135)), "frames"),
        (lambda: babel.decode(np.full((4, 135), np.nan)), "not finite"),
        (lambda: babel.decode_positions(np.zeros((3, 2, 134))), "135"),
    ):
        with pytest.raises(MotionloomError, match=match) as caught:
            act()
        assert "\n" not in str(caught.value)


def test_zeros_are_a_person_all_the_same() -> None:
    """An untrained network may say nothing at all; decoding gives finite rotations."""
    assert np.isfinite(babel.decode(np.zeros((3, 135))).positions()).all()
