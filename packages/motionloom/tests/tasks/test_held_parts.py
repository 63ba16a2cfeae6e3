"""Parts that are held: exactly the source's, told to the network, led there and back, where they are not all of it."""

import numpy as np
import pytest

from motionloom.core import rotations as rot
from motionloom.core.errors import MotionloomError
from motionloom.core.ground import turned
from motionloom.core.motion import Motion
from motionloom.core.skeleton import SMPL22
from motionloom.goals.hold import FixedJoints, FixedPart
from motionloom.retarget import joints22
from motionloom.tasks import predict as task
from motionloom.tasks.completion import Past
from motionloom.tasks.predict import predict, predict_pieces, prepare_hold
from motionloom.tasks.splice import concatenate, ground_pose_at, move_rigidly, overlay
from tests.tasks.small_predictor import small_predictor
from tests.tasks.test_edit import floating, person, rig

PREDICTOR = small_predictor(lively=0.3)
PAST, SOURCE = person(1.0, 30.0), person(4.0, 30.0).frames(50, 110)


def held(
    *joints: str, spans: tuple[tuple[float, float], ...] = ((0.0, np.inf),), source: Motion = SOURCE, align: bool = True
) -> FixedJoints:
    return FixedJoints(source, (FixedPart(joints, spans),), align)


def future(hold: FixedJoints | None, *, past: Motion = PAST, seconds: float = 0.8, **options) -> Motion:
    motion = predict(PREDICTOR, past, count=1, seconds=seconds, steps=2, hold=hold, **options)[0]
    return motion.frames(len(past), len(motion))


@pytest.mark.parametrize("group", ["lower_body", "left_arm", "torso", "left_knee", "head"])
def test_held_joints_take_the_local_rotations_of_the_source_bit_for_bit(group: str) -> None:
    motion, joints = future(held(group)), sorted(SMPL22.resolve([group]))
    chosen = [j for j in joints if j != 0]  # the pelvis is moved with the aligned source
    assert np.array_equal(motion.rotations[:, chosen], SOURCE.rotations[:24, chosen])
    others = [j for j in range(22) if j not in joints]
    assert not np.allclose(motion.rotations[:, others], SOURCE.rotations[:24, others], atol=1e-3)


@pytest.mark.parametrize("moved", [False, True])
def test_held_joints_of_another_body_and_what_hangs_on_them(moved: bool) -> None:
    skeleton = rig()
    past, source = (Motion(skeleton, 30.0, m.root, _on_rig(m)) for m in (PAST, SOURCE))
    past, source = (floating(m) if moved else m for m in (past, source))
    motion = future(held("right_arm", source=source), past=past)
    joints = [skeleton.index(n) for n in ("r_collar", "r_shoulder", "r_elbow", "r_wrist", "r_finger")]
    assert np.array_equal(motion.rotations[:, joints], source.rotations[:24, joints])


def _on_rig(motion: Motion) -> np.ndarray:
    """The 22 rotations under a root that stays, and a bent finger."""
    finger = rot.rotvec_to_quat(np.linspace(0, 1, len(motion))[:, None] * [0, 0, 1.0])
    still = np.tile(rot.IDENTITY, (len(motion), 1, 1))
    return np.concatenate([still, motion.rotations, finger[:, None]], axis=1)


def test_the_way_of_an_aligned_source_is_taken_and_goes_on_where_the_past_ends() -> None:
    motion = future(held("root"))
    steps = turned(
        np.diff(SOURCE.root[:24], axis=0), ground_pose_at(PAST, 29).facing - ground_pose_at(SOURCE, 0).facing
    )
    np.testing.assert_allclose(np.diff(motion.root, axis=0), steps, atol=1e-9)
    np.testing.assert_allclose(motion.root[:, 1], SOURCE.root[:24, 1], atol=1e-12)
    first = (motion.root[0] - PAST.root[-1])[[0, 2]]
    np.testing.assert_allclose(first, (PAST.root[-1] - PAST.root[-2])[[0, 2]], atol=0.01)


def test_a_source_that_goes_on_already_and_one_that_is_not_to_be_aligned_stay_bit_for_bit() -> None:
    after = person(3.0, 30.0).frames(30, 60)
    assert np.array_equal(future(held("root", source=after)).root, after.root[:24])
    assert np.array_equal(future(held("root", "torso", align=False)).root, SOURCE.root[:24])
    turned = future(held("torso", align=False))
    assert np.array_equal(turned.rotations[:, 0], SOURCE.rotations[:24, 0])


def test_a_part_that_is_held_for_a_while_is_led_there_and_back() -> None:
    spans = ((0.3, 0.5),)
    motion = future(held("left_arm", spans=spans))
    times, joints = np.arange(1, 25) / 30, sorted(SMPL22.resolve(["left_arm"]))
    inside = (times > 0.3 - 1e-9) & (times < 0.5 + 1e-9)
    assert inside.sum() == 7
    same = (motion.rotations[:, joints] == SOURCE.rotations[:24, joints]).all((1, 2))
    assert np.array_equal(same, inside)
    ready = prepare_hold(Past.of(PREDICTOR, PAST), held("left_arm", spans=spans), 0.8)
    assert ready is not None
    share = ready.joints[:24, 16]
    assert np.array_equal(share == 1, inside)
    assert np.abs(np.diff(share)).max() < 0.3
    assert np.array_equal(share > 1e-6, (times > 0.1 + 1e-3) & (times < 0.7 - 1e-3))


def test_what_is_held_in_a_later_piece_is_the_sources_of_that_moment(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(task, "CHUNK", 0.9)
    hold = held("left_arm", spans=((0.8, 1.4),))
    _, *pieces = predict_pieces(PREDICTOR, PAST, seconds=1.6, steps=1, hold=hold)
    assert [len(piece) for piece in pieces] == [30, 18]
    times, joints = np.arange(1, 49) / 30, sorted(SMPL22.resolve(["left_arm"]))
    same = (concatenate(*pieces).rotations[:, joints] == SOURCE.rotations[:48, joints]).all((1, 2))
    assert np.array_equal(same, (times > 0.8 - 1e-9) & (times < 1.4 + 1e-9))


def test_a_source_that_ends_early_lets_go_without_a_jump() -> None:
    motion = future(held("left_arm", source=SOURCE.frames(0, 12)))
    joints = sorted(SMPL22.resolve(["left_arm"]))
    assert np.array_equal(motion.rotations[:12, joints], SOURCE.rotations[:12, joints])
    ready = prepare_hold(Past.of(PREDICTOR, PAST), held("left_arm", source=SOURCE.frames(0, 12)), 0.8)
    assert ready is not None
    share = np.append(ready.joints[:, 16], 0)
    assert (share[:12] == 1).all()
    assert np.abs(np.diff(share)).max() < 0.3


def test_what_is_held_is_shown_to_the_network_and_changes_the_free_joints() -> None:
    kicking = SOURCE.rotations.copy()
    kicking[:, [1, 2], 1] += 0.4
    other = Motion(SMPL22, 30.0, SOURCE.root, rot.normalize(kicking))
    whole, free = (joints22(future(held("lower_body", source=s, align=False))) for s in (SOURCE, other))
    arms = sorted(SMPL22.resolve(["left_arm", "right_arm"]))
    apart = (whole - whole[:, :1])[:, arms] - (free - free[:, :1])[:, arms]
    assert np.abs(apart).max() > 1e-3


def test_the_network_sees_the_source_at_its_own_moments_from_the_first_predicted_frame_on() -> None:
    after = person(3.0, 60.0).frames(60, 150)
    ready = prepare_hold(
        Past.of(PREDICTOR, person(1.0, 60.0)),
        held("left_arm", "root", source=after, spans=((0.0, 0.5),)),
        1.0,
    )
    assert ready is not None
    real = joints22(after)[1::2]
    known = ready.known(1, 31)
    assert known is not None
    assert np.abs((known.positions - known.positions[:, :1]) - (real - real[:, :1])[:30]).max() < 0.01
    assert np.array_equal(known.mask.any(axis=1), np.arange(1, 31) / 30 <= 0.5 + 1e-9)
    assert set(np.flatnonzero(known.mask[0])) == {0, *SMPL22.resolve(["left_arm"])}
    later = ready.known(11, 31)
    assert later is not None
    assert np.array_equal(later.positions, known.positions[10:])
    assert ready.known(16, 31) is None


def test_parts_laid_over_a_motion_are_exact_at_weight_one_and_nothing_at_none() -> None:
    one, other = PAST, move_rigidly(SOURCE, rot.IDENTITY, np.zeros(3), np.ones(3)).frames(0, 30)
    joints = np.zeros((30, 22))
    joints[5:10, 3], joints[10:, 3] = 0.5, 1
    mixed = overlay(one, other, joints, joints[:, 3])
    assert np.array_equal(mixed.rotations[:5], one.rotations[:5])
    assert np.array_equal(mixed.rotations[10:, 3], other.rotations[10:, 3])
    assert np.array_equal(mixed.root[10:], other.root[10:])
    np.testing.assert_allclose(mixed.root[5:10], (one.root + other.root)[5:10] / 2)


MISTAKES = {
    "unknown": (held("left_wing"), "no part called 'left_wing'"),
    "nothing": (held(), "nothing to hold"),
    "no parts": (FixedJoints(SOURCE, ()), "nothing to hold"),
    "no span": (held("head", spans=()), "nothing to hold"),
    "backwards": (held("head", spans=((0.5, 0.2),)), "no stretch from 0.5 to 0.2"),
    "negative": (held("head", spans=((-1.0, 0.2),)), "no stretch"),
    "nan": (held("head", spans=((float("nan"), 1.0),)), "no stretch"),
    "too late": (held("head", spans=((5.0, np.inf),)), "nothing to hold from 5 s on"),
    "short source": (held("head", spans=((0.0, 0.7),), source=SOURCE.frames(0, 10)), "give a longer one"),
    "everything": (held("lower_body", "upper_body"), "nothing to predict"),
    "skeleton": (held("head", source=Motion(rig(), 30.0, SOURCE.root, _on_rig(SOURCE))), "another skeleton"),
    "rate": (held("head", source=person(2.0, 25.0)), "25 fps"),
    "bones": (held("head", source=floating(SOURCE)), "constant length"),
}


@pytest.mark.parametrize("name", sorted(MISTAKES))
def test_what_cannot_be_held_is_reported(name: str) -> None:
    hold, words = MISTAKES[name]
    with pytest.raises(MotionloomError, match=words) as error:
        future(hold)
    assert "\n" not in str(error.value)
