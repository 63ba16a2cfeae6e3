"""What people did whose way, turns and strokes are known."""

import json

import numpy as np
import pytest

from motionloom.core.motion import Motion
from motionloom.core.rotations import rotvec_to_quat
from motionloom.core.skeleton import SMPL22, Skeleton
from motionloom.kinematics.deeds import RATE, deeds_at, measure_deeds
from motionloom.kinematics.physics import ANKLES, TOES, J
from tests.kinematics.people import circling, jumping, moved, spun, standing, walking
from tests.kinematics.test_counts import waves

UPPER = [joint for joint in range(22) if joint not in (*ANKLES, *TOES)]


def lowered(body: np.ndarray, metres: np.ndarray) -> np.ndarray:
    low = np.zeros_like(body)
    low[:, UPPER, 1] = -metres[:, None]
    return body + low


def test_a_walk_has_its_way_direction_and_steps() -> None:
    did = deeds_at(walking(1.2, 4.0))
    assert did.way == pytest.approx(4.75, abs=0.1)
    assert (did.forward, did.left) == (pytest.approx(4.74, abs=0.1), pytest.approx(0, abs=0.01))
    assert did.steps == (4, 3)
    assert did.sentence == f"walks {did.forward:.1f} m forward, 7 steps"
    backwards = spun(walking(1.2, 4.0), np.full(80, np.pi))
    assert "backward" in deeds_at(backwards).sentence


def test_who_runs_runs_and_does_not_jump() -> None:
    did = deeds_at(walking(3.0, 4.0))
    assert did.sentence.startswith("runs 11.")
    assert not did.counts


@pytest.mark.parametrize("degrees", [-170, -90, 88, 300])
def test_a_turn_has_its_degrees_and_its_side(degrees: int) -> None:
    body = standing(4.0)
    angle = np.radians(degrees) * np.linspace(0, 1, len(body))
    did = deeds_at(spun(body, angle))
    assert did.turn == pytest.approx(degrees, abs=abs(degrees) / 50)
    said = f"turns {abs(did.turn):.0f} degrees to the {'left' if degrees > 0 else 'right'}"
    assert did.sentence.startswith(said)


def test_a_circle_ends_where_it_began() -> None:
    did = deeds_at(circling(1.5, 1.0))
    assert did.way == pytest.approx(2 * np.pi * 1.5, rel=0.03)
    assert did.sentence == "moves 9.4 m and ends where it began, turns 358 degrees to the left"


def test_a_jump_has_its_height() -> None:
    did = deeds_at(jumping(0.4))
    assert dict(did.counts) == {"jumps": 1}
    assert did.sentence == "jumps once"
    assert did.pelvis[1] - did.pelvis[0] == pytest.approx(0.4, abs=0.02)
    assert did.contacts["neither"] == pytest.approx(2 * np.sqrt(2 * 0.35 / 9.81) / 4, abs=0.05)


@pytest.mark.parametrize(("times", "said"), [(1, "squats once"), (2, "squats twice"), (3, "squats 3 times")])
def test_squats_are_counted(times: int, said: str) -> None:
    did = deeds_at(lowered(standing(7.0), 0.4 * waves(7.0, times)))
    assert did.sentence == said
    assert json.loads(json.dumps(did.public()))["counts"] == {"squats": times}


def test_who_goes_down_and_stays_ends_down_and_did_no_squat() -> None:
    did = deeds_at(lowered(standing(6.0), 0.45 * np.linspace(-6, 2, 120).clip(0, 1)))
    assert did.ends == "down"
    assert did.sentence == "stays in place, ends down"


def test_who_lies_at_the_end_ends_lying() -> None:
    body = standing(2.0)
    flat = body[:, :, [0, 2, 1]] + [0.0, 0.1, 0.0]
    assert deeds_at(np.concatenate([body, flat])).ends == "lying"


def test_who_stands_stays_in_place() -> None:
    did = deeds_at(standing(4.0))
    assert did.sentence == "stays in place"
    assert dict(did.contacts) == {"left": 1.0, "right": 1.0, "neither": 0.0}


def test_who_comes_up_somewhere_higher_ends_higher() -> None:
    body = standing(4.0)
    t = np.linspace(0, 1, len(body))
    did = deeds_at(moved(body, np.stack([0 * t, 0.8 * t, 1.5 * t], axis=-1)))
    assert "ends 0.8 m higher" in did.sentence
    assert "jumps" not in did.counts


def test_waving_is_told_of_its_hand() -> None:
    body, t = standing(4.0), np.arange(80) / RATE
    body[:, J["right_wrist"]] = body[:, J["right_shoulder"]] + [-0.2, 0.4, 0.1]
    body[:, J["right_wrist"], 0] += 0.2 * np.sin(2 * np.pi * t)
    assert deeds_at(body).sentence == "waves the right hand 4 times"


def glide(fps: float, frames: int) -> Motion:
    root = np.tile(SMPL22.offsets[0], (frames, 1))
    root[:, 2] += np.arange(frames) / fps
    return Motion(SMPL22, fps, root, np.tile([1.0, 0, 0, 0], (frames, 22, 1)))


@pytest.mark.parametrize("fps", [20, 30, 120])
def test_a_motion_is_measured_alike_at_every_rate(fps: int) -> None:
    did = measure_deeds(glide(fps, 3 * fps))
    assert did is not None
    assert did.forward == pytest.approx(3.0, abs=0.06)
    assert did.sentence.startswith("moves 3.0 m forward") or did.sentence.startswith("moves 2.9 m forward")
    assert json.loads(json.dumps(did.public()))["sentence"] == did.sentence


def test_a_pose_and_no_humanoid_have_no_deeds() -> None:
    assert measure_deeds(glide(20, 1)) is None
    chain = Skeleton(("a", "b"), (-1, 0), np.ones((2, 3)))
    assert measure_deeds(Motion(chain, 20, np.zeros((30, 3)), rotvec_to_quat(np.zeros((30, 2, 3))))) is None
