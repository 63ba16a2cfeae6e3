"""The figures of a clip beside what MuJoCo itself says of the same poses: contacts, bodies, masses, one by one."""

import json
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from motionloom import io
from motionloom.cli import main
from motionloom.core import rotations as rot
from motionloom.core.skeleton import SMPL22
from tests.robots import models
from tests.robots.people import marching

pytest.importorskip("mink")

from motionloom.robots.body import Robot, read_robot
from motionloom.robots.clip import EFFECTORS, Clip, put_on_robot
from motionloom.robots.engine import load_mujoco
from motionloom.robots.figures import Figures, measure
from motionloom.robots.files import load_clip, save_clip
from motionloom.robots.targets import aim

BOX = np.array([[x, y, -1] for x in (-1, 1) for y in (-1, 1)])
"""Lower corners of a box, heels first."""


@pytest.fixture(scope="module")
def robot(tmp_path_factory: pytest.TempPathFactory) -> Robot:
    """With palms that can touch."""
    text = models.humanoid()
    for side in ("left", "right"):
        palm = f'<body name="{side}_palm" pos="0.0 0.0 -0.2">'
        assert palm in text or palm.replace("0.0 0.0", "0 0") in text
        for name in (palm, palm.replace("0.0 0.0", "0 0")):
            text = text.replace(name, name + '<geom type="sphere" size="0.04"/>')
    path = tmp_path_factory.mktemp("figures") / "tin.xml"
    path.write_text(text)
    return read_robot(path)


@pytest.fixture(scope="module")
def clip(robot: Robot) -> Clip:
    """A march whose arms go through the trunk."""
    motion = marching()
    turns, ease = motion.rotations.copy(), np.linspace(0, 1, len(motion))[:, None]
    for side, sign in (("left", 1.0), ("right", -1.0)):
        turns[:, SMPL22.index(f"{side}_shoulder")] = rot.rotvec_to_quat(ease * np.array([0.0, 0.0, -2.0 * sign]))
    return put_on_robot(replace(motion, rotations=turns), robot)


@pytest.fixture(scope="module")
def figures(robot: Robot, clip: Clip) -> Figures:
    return measure(clip, robot)


def test_soles_and_masses_are_those_of_the_bodies(robot: Robot, clip: Clip, figures: Figures) -> None:
    """Corners of the feet's boxes, and the sum of all bodies' masses, in MuJoCo's own model."""
    mujoco = load_mujoco()

    model = robot.file.model
    data, soles, centres = mujoco.MjData(model), [], []
    boxes = [
        next(g for g in range(model.ngeom) if model.geom_bodyid[g] == model.body(f"{side}_foot_b").id)
        for side in ("left", "right")
    ]
    for pose in clip.qpos:
        data.qpos = pose
        mujoco.mj_forward(model, data)
        centres.append((model.body_mass[:, None] * data.xipos).sum(axis=0) / model.body_mass.sum())
        soles.append(
            [data.geom_xpos[g] + (BOX * model.geom_size[g]) @ data.geom_xmat[g].reshape(3, 3).T for g in boxes]
        )
    corners = np.array(soles)
    up = corners[clip.planted.any(axis=2)][..., 2].min(axis=-1)
    assert figures.float_cm == pytest.approx(100 * np.percentile(np.abs(up), 95), abs=0.01)
    assert figures.sunk_cm == pytest.approx(100 * max(0, -corners[..., 2].min()), abs=0.01)
    edges = np.stack([corners[:, :, :2].mean(axis=2), corners[:, :, 2:].mean(axis=2)], axis=2)
    ways = np.linalg.norm(np.diff(edges[..., :2], axis=0), axis=-1)
    stays = clip.planted[1:] & clip.planted[:-1]
    assert figures.slide_cm == pytest.approx(100 * np.percentile(ways[stays], 95), abs=0.01)
    outside = [
        _beside(centre[:2], corners[frame][clip.planted[frame].any(axis=1)].reshape(-1, 3)[:, :2])
        for frame, centre in enumerate(centres)
        if clip.planted[frame].any()
    ]
    assert 0 < np.mean(outside) < 1
    assert figures.outside_support_share == pytest.approx(np.mean(outside), abs=0.02)
    assert figures.planted_share == pytest.approx(clip.planted.any(axis=(1, 2)).mean(), abs=0.001)


def _beside(point: np.ndarray, corners: np.ndarray) -> bool:
    """Whether some line parts a point from all the corners."""
    angles = np.linspace(0, 2 * np.pi, 3600)
    ways = np.stack([np.cos(angles), np.sin(angles)])
    return bool(((corners - point) @ ways < 0).all(axis=0).any())


def test_touching_is_what_mujocos_contacts_say(robot: Robot, clip: Clip, figures: Figures) -> None:
    mujoco = load_mujoco()

    model = robot.file.model
    data, frames = mujoco.MjData(model), 0
    for pose in clip.qpos:
        data.qpos = pose
        mujoco.mj_forward(model, data)
        frames += any(contact.dist < -0.002 for contact in data.contact)
    assert 0 < frames < len(clip)
    assert figures.collision_frames == frames


def test_hands_and_feet_are_where_they_were_to_be(robot: Robot, clip: Clip, figures: Figures) -> None:
    """The median way from what was aimed at, of a clip whose hands are pulled 10 cm away."""
    mujoco = load_mujoco()

    targets = aim(marching(), robot, fps=50)
    made = put_on_robot(marching(), robot)
    data, away = mujoco.MjData(robot.model), []
    for frame, pose in enumerate(made.qpos):
        data.qpos = pose
        mujoco.mj_kinematics(robot.model, data)
        for joint in EFFECTORS:
            away.append(np.linalg.norm(data.site(robot.site(joint)).xpos - targets.place(joint)[frame]))
    assert measure(made, robot).effector_cm == pytest.approx(100 * np.median(away), abs=0.01)
    assert made.errors is not None
    assert measure(replace(made, errors=made.errors + 0.07), robot).effector_cm == pytest.approx(7, abs=0.5)


def test_joints_and_the_root_are_counted_as_they_are(robot: Robot, clip: Clip) -> None:
    """At a limit, over a speed, the root that jumps: each put into one frame of a clip that stands still."""
    qpos = np.tile(robot.home, (40, 1))
    still = Clip(50.0, qpos, np.ones((40, 2, 2), dtype=bool))
    found = measure(still, robot)
    assert (found.largest_step, found.root_step_cm, found.root_turn, found.top_speed) == (0, 0, 0, 0)
    waist = robot.file.joint_names().index("waist_yaw_joint")
    qpos = qpos.copy()
    qpos[:10, 7 + waist] = robot.file.upper[waist]
    qpos[10:20, 7 + waist] = robot.file.upper[waist] - 0.2
    qpos[20:, 7 + waist] = robot.file.upper[waist] - 0.3
    qpos[30:, :3] += [0.3, 0.0, 0.4]
    qpos[35:, 3:7] = -rot.multiply(rot.rotvec_to_quat(np.array([0.0, 0.0, 0.5])), qpos[35:, 3:7])
    found = measure(replace(still, qpos=qpos), robot, max_speed=5.0)
    resting = measure(still, robot).at_limit_share  # joints that are at a limit where the robot stands
    assert found.at_limit_share == pytest.approx(max(resting, 0.25))
    assert (found.fastest, found.largest_step) == ("waist_yaw_joint", pytest.approx(0.2))
    assert (found.top_speed, found.speed_share) == (pytest.approx(10), pytest.approx(2))
    assert found.root_step_cm == pytest.approx(50)
    assert found.root_turn == pytest.approx(0.5, abs=1e-4)
    faults = " and ".join(found.faults())
    assert "the root jumps 50.0 cm" in faults
    assert "2.00 times as fast" in faults
    assert measure(replace(still, qpos=qpos), robot).speed_share is None  # MJCF states no speeds


def test_a_pelvis_that_shakes_and_turns_away_is_told(robot: Robot) -> None:
    """A clip whose root trembles by 1 cm, one turned by 30 degrees, and one tilted by 25: each has its sentence."""
    made = put_on_robot(marching(), robot)
    assert not any("pelvis" in fault for fault in measure(made, robot).faults())

    def faults(change: np.ndarray, *, known: bool = True) -> str:
        qpos = made.qpos.copy()
        qpos[:, :3] += change[:, :3]
        qpos[:, 3:7] = rot.multiply(rot.rotvec_to_quat(change[:, 3:]), qpos[:, 3:7])
        return " and ".join(
            fault
            for fault in measure(replace(made, qpos=qpos, aims=made.aims if known else None), robot).faults()
            if "pelvis" in fault
        )

    still = np.zeros((len(made), 6))
    trembling = still + 0.01 * (-1.0) ** np.arange(len(made))[:, None] * np.eye(6)[0]
    acceleration = 0.04 * 50**2
    assert f"the pelvis shakes: its acceleration is {acceleration:.1f} m/s2, where the motion has 0." in faults(
        trembling
    )
    assert faults(trembling, known=False) == f"the pelvis shakes: its acceleration is {acceleration:.1f} m/s2"
    assert (
        faults(still + np.radians(30) * np.eye(6)[5])
        == "the pelvis faces up to 30 degrees away from the person's heading"
    )
    assert "the pelvis leans up to 2" in faults(still + np.radians(25) * np.eye(6)[3])
    assert faults(still + np.radians(15) * np.eye(6)[5]) == ""


def test_what_is_checked_is_the_part_that_is_asked(
    robot: Robot, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    """--start and --end of joint angles, --max-speed as their limit, and --check of export: the same figures."""
    made = put_on_robot(marching(), robot)
    path = save_clip(made, robot, tmp_path / "march.npz")
    line = [str(path), "--robot", str(robot.file.path), "--start", "0.4", "--end", "0.8", "--max-speed", "1"]
    assert main(["robot-check", *line, "--json"]) == 1
    told = json.loads(capsys.readouterr().out)
    asked = measure(load_clip(path, robot).frames(20, 40), robot, max_speed=1.0)
    assert told == {"file": str(path), **asked.as_dict(), "faults": asked.faults()}
    assert told["frames"] == 20
    assert told["speed_share"] > 1
    assert main(["export", *line, "--check"]) == 1
    assert json.loads(capsys.readouterr().out) == told
    source = io.save(marching(0.6), tmp_path / "march.bvh")
    assert main(["export", str(source), "--robot", str(robot.file.path), "--check"]) == 0
    assert json.loads(capsys.readouterr().out)["effector_cm"] < 1
    assert sorted(one.name for one in tmp_path.iterdir()) == ["march.bvh", "march.npz"]
    for wrong in (["export", str(source), "--check"], ["export", *line, "--check", "--out", "x.csv"]):
        assert main(wrong) == 2
        assert capsys.readouterr().err.count("\n") == 1
