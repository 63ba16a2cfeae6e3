"""Motion on a robot: limits, soles, speeds, files and back; answers come from MuJoCo's own kinematics."""

import json
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from motionloom import io
from motionloom.cli import main
from motionloom.core import rotations as rot
from motionloom.core.errors import MotionloomError
from motionloom.core.skeleton import SMPL22
from tests.robots import models
from tests.robots.people import marching, stepping_aside
from tests.shared import shared

pytest.importorskip("mink")

from motionloom.robots.body import Robot, read_robot, to_motion
from motionloom.robots.clip import Clip, put_on_robot
from motionloom.robots.figures import measure
from motionloom.robots.files import load_clip, load_motion, save_clip
from motionloom.robots.physics import track

RECORDINGS = ("data/cmu/bvh/07_04.bvh", "data/cmu/asf_amc/135/135_04.amc")
ROBOTS = ("robots/unitree_g1/g1_29dof_without_meshes.xml", "robots/booster_t1/t1_mocap.xml")


@pytest.fixture(scope="module")
def robot(tmp_path_factory: pytest.TempPathFactory) -> Robot:
    path = tmp_path_factory.mktemp("robot") / "tin.xml"
    path.write_text(models.humanoid())
    return read_robot(path)


@pytest.fixture(scope="module")
def clip(robot: Robot) -> Clip:
    return put_on_robot(marching(), robot)


def test_a_march_keeps_every_limit_and_its_feet(robot: Robot, clip: Clip) -> None:
    figures = measure(clip, robot)
    assert clip.fps == 50
    assert figures.limits_broken == 0
    assert (clip.qpos[:, 7:] >= robot.file.lower).all()
    assert (clip.qpos[:, 7:] <= robot.file.upper).all()
    assert max(figures.float_cm, figures.slide_cm, figures.sunk_cm) < 0.1
    assert figures.effector_cm is not None
    assert figures.effector_cm < 1
    assert figures.faults() == []


def test_feet_are_lifted_in_turn(robot: Robot, clip: Clip) -> None:
    """The left foot is in the air at a quarter of a second and the right at three quarters, as the person's are."""
    places = to_motion(robot, clip.qpos, clip.fps).positions()
    heights = [places[:, robot.skeleton.index(f"{side}_ankle"), 1] for side in ("left", "right")]
    for frame, up, down in ((12, 0, 1), (37, 1, 0)):
        assert heights[up][frame] > 0.12
        assert heights[down][frame] == pytest.approx(0.05, abs=0.002)
        assert clip.planted[frame, down].all()
        assert not clip.planted[frame, up].any()


def test_the_same_motion_gives_the_same_bits(robot: Robot, clip: Clip) -> None:
    assert np.array_equal(put_on_robot(marching(), robot).qpos, clip.qpos)


def test_ankles_of_one_hinge_are_enough(tmp_path: Path) -> None:
    """As an H1 has them: soles cannot roll to the side, and yet stand."""
    (tmp_path / "h1.xml").write_text(models.humanoid(models.H1))
    robot = read_robot(tmp_path / "h1.xml")
    figures = measure(put_on_robot(marching(0.8), robot), robot)
    assert figures.limits_broken == 0
    assert max(figures.float_cm, figures.slide_cm) < 0.3


@pytest.mark.parametrize("path", [None, ROBOTS[0]], ids=["tin", "g1"])
def test_wide_steps_to_the_side_stand_on_the_edges_of_soles(path: str | None, robot: Robot) -> None:
    """Where ankles roll no further, soles stand on their inner edge, and neither slide nor let the legs swing about."""
    robot = robot if path is None else read_robot(shared(path))
    made = put_on_robot(stepping_aside(1.3), robot)
    figures = measure(made, robot)
    assert figures.faults() == []
    assert max(figures.float_cm, figures.slide_cm) < 0.1
    assert figures.largest_step < 0.1
    assert figures.sole_roll > 0.1
    places = to_motion(robot, made.qpos, made.fps).positions()
    ankles = [places[:, robot.skeleton.index(f"{side}_ankle"), 0] for side in ("left", "right")]
    legs = 2 * robot.skeleton.offsets[robot.skeleton.index("left_knee"), 1]
    assert (ankles[0] - ankles[1]).max() > 1.1 * abs(legs)  # as wide as was asked: 1.3 radians
    level = measure(put_on_robot(stepping_aside(0.5), robot), robot)
    assert level.sole_roll < 0.02


def test_the_root_does_not_jump_to_feet_that_are_late(robot: Robot) -> None:
    """A body that is elsewhere from one frame to the next, its feet planted, is caught up with step by step."""
    motion = marching()
    root = motion.root.copy()
    root[20:, 0] += 0.2
    made = put_on_robot(replace(motion, root=root), robot)
    asked = np.abs(np.diff(root[:, 0])).max() * 30 / 50
    assert np.abs(np.diff(made.qpos[:, :3], axis=0)).max() <= asked + 2.0 / 50 + 0.01


def test_a_speed_is_kept_by_slowing_down(robot: Robot, clip: Clip) -> None:
    """No joint exceeds the speed, the clip is longer by what is told, and goes through the same poses."""
    slow = put_on_robot(marching(), robot, max_speed=2.0)
    speeds = np.abs(np.diff(slow.qpos[:, 7:], axis=0)) * slow.fps
    assert speeds.max() <= 2.0 + 1e-6
    assert np.abs(np.diff(clip.qpos[:, 7:], axis=0)).max() * clip.fps > 2.5
    assert slow.slowed == pytest.approx((len(slow) - len(clip)) / 50)
    nearest = np.abs(slow.qpos[:, None, 7:] - clip.qpos[None, :, 7:]).max(axis=-1).min(axis=1)
    assert nearest.max() < 0.1


def test_no_joint_jumps(robot: Robot) -> None:
    """A person who is elsewhere from one frame to the next is followed in steps of 0.3 rad."""
    motion = marching()
    turns = motion.rotations.copy()
    turns[20:, SMPL22.index("left_elbow")] = rot.rotvec_to_quat(np.array([0.0, -2.0, 0.0]))
    made = put_on_robot(replace(motion, rotations=turns), robot)
    assert np.abs(np.diff(made.qpos[:, 7:], axis=0)).max() <= 0.3 + 1e-9


def test_a_robots_poses_are_motion_exactly(robot: Robot, clip: Clip) -> None:
    """The skeleton's joints are where MuJoCo has the bodies; its own motion gives nearly its angles back."""
    import mujoco

    motion = to_motion(robot, clip.qpos, clip.fps)
    data = mujoco.MjData(robot.model)
    data.qpos = clip.qpos[30]
    mujoco.mj_kinematics(robot.model, data)
    for joint, body in (("left_ankle", "left_foot_b"), ("right_wrist", "right_palm"), ("left_knee", "left_shin_a")):
        x, y, z = data.body(body).xpos
        assert np.allclose(motion.positions()[30, robot.skeleton.index(joint)], [y, z, x], atol=1e-9)
    again = put_on_robot(motion, robot)
    assert np.median(np.abs(again.qpos - clip.qpos)) < 0.01


def test_parts_are_kept_apart(tmp_path: Path) -> None:
    """Arms that go through the trunk do not with `avoid_collisions`."""
    palms = '<body name="{0}_palm" pos="0 0 -0.2"><geom type="sphere" size="0.04"/>'
    text = models.humanoid()
    for side in ("left", "right"):
        text = text.replace(f'<body name="{side}_palm" pos="0.0 0.0 -0.2">', palms.format(side))
        text = text.replace(f'<body name="{side}_palm" pos="0 0 -0.2">', palms.format(side))
    path = tmp_path / "thick.xml"
    path.write_text(text)
    robot, motion = read_robot(path), marching()
    turns = motion.rotations.copy()
    ease = np.linspace(0, 1, len(motion))[:, None]
    for side, sign in (("left", 1.0), ("right", -1.0)):
        turns[:, SMPL22.index(f"{side}_shoulder")] = rot.rotvec_to_quat(ease * np.array([0.0, 0.0, -2.0 * sign]))
    motion = replace(motion, rotations=turns)
    through = measure(put_on_robot(motion, robot), robot)
    beside = measure(put_on_robot(motion, robot, avoid_collisions=True), robot)
    assert through.collision_frames
    assert beside.collision_frames == 0


@pytest.mark.parametrize("suffix", [".csv", ".npz"])
@pytest.mark.parametrize("header", [True, False])
def test_files_come_back(suffix: str, header: bool, robot: Robot, clip: Clip, tmp_path: Path) -> None:
    path = save_clip(clip, robot, tmp_path / f"clip{suffix}", header=header)
    back = load_clip(path, robot)
    assert np.allclose(back.qpos, clip.qpos, atol=1e-6)
    assert back.fps == 50
    if suffix == ".csv":
        rows = path.read_text().splitlines()
        assert len(rows) == len(clip) + header
        first = [float(word) for word in rows[int(header)].split(",")]
        assert first[3:7] == pytest.approx(clip.qpos[0, [4, 5, 6, 3]], abs=1e-6)
        assert not header or rows[0].split(",")[7:] == list(robot.file.joint_names())
    else:
        assert np.array_equal(back.planted, clip.planted)


def test_velocities_are_those_of_mujoco(robot: Robot, clip: Clip, tmp_path: Path) -> None:
    """One step of MuJoCo's integrator with ``qvel`` leads from a frame to the next but one."""
    import mujoco

    with np.load(save_clip(clip, robot, tmp_path / "clip.npz")) as file:
        qpos, qvel = file["qpos"], file["qvel"]
    moved = qpos[10].copy()
    mujoco.mj_integratePos(robot.model, moved, qvel[11], 2 / 50)
    assert np.allclose(moved, qpos[12], atol=1e-9)


@pytest.mark.parametrize(
    ("text", "said"),
    [
        ("1,2,3\n", "has 3 columns"),
        ("", "is empty"),
        (",".join(["0"] * 28) + "\n", "quaternion"),
        (",".join(["x"] * 28) + "\n", "is not of tin"),
        (",".join(["0"] * 6 + ["1"] + ["0"] * 21) + "\n" + ",".join(["0"] * 27 + ["y"]) + "\n", "data row 2"),
        (",".join(["0"] * 6 + ["1"] + ["nan"] * 21) + "\n", "finite"),
    ],
)
def test_files_that_are_no_angles_are_refused(text: str, said: str, robot: Robot, tmp_path: Path) -> None:
    path = tmp_path / "bad.csv"
    path.write_text(text)
    with pytest.raises(MotionloomError, match=said):
        load_clip(path, robot)


def test_planted_soles_are_measured_as_they_are(robot: Robot, clip: Clip) -> None:
    """Raised by 2 cm a clip floats by 2 cm; moved by 1 cm a frame it slides by that; a knee bent backwards counts."""
    raised = clip.qpos.copy()
    raised[:, 2] += 0.02
    assert measure(replace(clip, qpos=raised), robot).float_cm == pytest.approx(2.0, abs=0.1)
    moved = clip.qpos.copy()
    moved[:, 0] += 0.01 * np.arange(len(moved))
    assert measure(replace(clip, qpos=moved), robot).slide_cm == pytest.approx(1.0, abs=0.1)
    bent = clip.qpos.copy()
    bent[3, 7 + robot.file.joint_names().index("left_knee_joint")] = -0.2
    assert measure(replace(clip, qpos=bent), robot).limits_broken == 1


def test_physics_holds_the_hinges_and_lets_it_fall(robot: Robot, clip: Clip) -> None:
    """With the root held a slow clip is followed closely; a robot that begins lying on its side has fallen at once."""
    found = track(clip, robot)
    assert found.held_error < 0.15
    lying = clip.qpos.copy()
    lying[:, 3:7] = rot.rotvec_to_quat(np.array([1.4, 0.0, 0.0]))
    assert track(replace(clip, qpos=lying), robot).free_seconds < 0.1


def test_the_command_line_writes_checks_and_reads_back(
    robot: Robot, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    source, out = io.save(marching(), tmp_path / "march.bvh"), tmp_path / "march.csv"
    model = ["--robot", str(robot.file.path)]
    assert main(["export", str(source), str(out), *model, "--figures"]) == 0
    said = capsys.readouterr()
    assert json.loads(said.out.splitlines()[0])["limits_broken"] == 0
    assert "by their names" in said.err
    assert main(["robot-check", str(out), *model, "--json"]) == 0
    assert json.loads(capsys.readouterr().out)["faults"] == []
    assert main(["export", str(out), str(tmp_path / "back.bvh"), *model]) == 0
    assert len(io.load(tmp_path / "back.bvh")) == len(out.read_text().splitlines()) - 1
    assert main(["export", str(out), str(tmp_path / "again.csv"), *model]) == 0
    first, second = (np.loadtxt(path, delimiter=",", skiprows=1) for path in (out, tmp_path / "again.csv"))
    assert np.allclose(first, second, atol=2e-6)
    capsys.readouterr()
    for line in (["info", str(out)], ["export", str(source), str(out), "--max-speed", "3"]):
        assert main(line) == 2
        assert capsys.readouterr().err.count("\n") == 1


@pytest.mark.parametrize("suffix", [".bvh", ".glb"])
def test_files_of_poses_hold_the_robot(
    suffix: str, robot: Robot, clip: Clip, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    """A person's motion becomes the robot's, whatever the format; what is read from joint angles stays as it was."""
    source, model = io.save(marching(), tmp_path / "march.bvh"), ["--robot", str(robot.file.path)]
    out = tmp_path / f"robot{suffix}"
    assert main(["export", str(source), str(out), *model]) == 0
    assert f"{len(clip)} frames" in capsys.readouterr().out
    made, asked = io.load(out), to_motion(robot, clip.qpos, clip.fps)
    assert (made.fps, len(made)) == (pytest.approx(50), len(clip))
    hand = made.skeleton.index("left_wrist"), asked.skeleton.index("left_wrist")
    assert np.abs(made.positions()[:, hand[0]] - asked.positions()[:, hand[1]]).max() < 0.02
    angles = save_clip(clip, robot, tmp_path / "march.csv", header=False)
    assert main(["export", str(angles), str(out), *model, "--source-fps", "25", "--force"]) == 0
    back = io.load(out)
    assert (back.fps, len(back)) == (pytest.approx(25), len(clip))
    motion = load_motion(angles, robot.file.path, fps=25)
    assert np.abs(back.positions()[:, hand[0]] - motion.positions()[:, hand[1]]).max() < 0.01


@pytest.mark.parametrize("path", ROBOTS, ids=["g1", "t1"])
@pytest.mark.parametrize("recording", RECORDINGS, ids=["walk", "kicks"])
def test_recordings_reach_the_figures(path: str, recording: str) -> None:
    """Limits 0, float 1 cm, slide 0.3 cm a frame, hands and feet 6 cm, steps 0.3 rad, on both published robots."""
    robot, motion = read_robot(shared(path)), io.load(shared(recording), fps=30)
    figures = measure(put_on_robot(motion.frames(0, min(len(motion), 150)), robot), robot)
    assert figures.limits_broken == 0
    assert figures.float_cm <= 1.0
    assert figures.slide_cm <= 0.3
    assert figures.sunk_cm <= 0.5
    assert figures.largest_step <= 0.3001
    assert figures.effector_cm is not None
    assert figures.effector_cm <= 6.0
