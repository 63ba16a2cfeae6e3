"""Which robots are read, which joint is found to be which, and one sentence about everything else."""

import json
import signal
import subprocess
import sys
import time
from pathlib import Path

import numpy as np
import pytest

from motionloom.core.errors import MotionloomError
from tests.robots import models
from tests.robots.people import marching
from tests.shared import shared

pytest.importorskip("mujoco")

from motionloom.robots import trial
from motionloom.robots.body import Robot, read_robot


def written(folder: Path, text: str, name: str = "robot.xml") -> Path:
    path = folder / name
    path.write_text(text)
    return path


def read(folder: Path, text: str) -> Robot:
    return read_robot(written(folder, text))


LEG, ARM = ("hip", "knee", "ankle"), ("shoulder", "elbow")


@pytest.mark.parametrize("names", ["UNITREE", "H1", "BOOSTER", "FOURIER", "ENGINEAI", "ATLAS", "NAMELESS"])
def test_joints_are_found_by_names_and_by_shape(names: str, tmp_path: Path) -> None:
    """The knee is the fourth hinge of a leg and the elbow bends the arm, whatever they are called."""
    robot = read(tmp_path, models.humanoid(getattr(models, names)))
    order = getattr(models, names)
    for side in ("left", "right"):
        found = {part: [h.name for h in robot.parts.hinges[f"{side}_{part}"]] for part in (*LEG, *ARM)}
        said = [n.format(side=side, Side=side.title(), s=side[0], S=side[0].upper()) for n in order]
        assert found["hip"] == said[:3]
        assert found["knee"] == said[3:4]
        assert found["ankle"] == [name for name in said[4:6] if name]
        assert found["elbow"][-1] == said[10]
        assert found["shoulder"] + found["elbow"] == said[7:]
    assert robot.parts.hinges["waist"][0].name == order[6]
    assert ("shape" in robot.parts.how) == (names == "NAMELESS")


@pytest.mark.parametrize(
    ("name", "part"),
    [
        ("left_hip_pitch_joint", "left_hip"),
        ("left_knee_pitch_joint", "left_knee"),
        ("Left_Hip_Roll", "left_hip"),
        ("Right_Elbow_Yaw", "right_elbow"),
        ("Left_Hand_Roll", None),
        ("J09_KNEE_PITCH_R", "right_knee"),
        ("J12_WAIST_YAW", "waist"),
        ("right_knee_joint", "right_knee"),
        ("torso_joint", "waist"),
        ("waist_roll_joint", "waist"),
        ("left_wrist_yaw_joint", "left_wrist"),
        ("left_hand_thumb_0_joint", None),
        ("right_hand_index_1_joint", None),
        ("AAHead_yaw", "neck"),
        ("Head_pitch", "neck"),
        ("J18_ELBOW_YAW_L", "left_elbow"),
        ("J23_HEAD_YAW", "neck"),
        ("r_leg_akx", "right_ankle"),
        ("left_ank_pitch", "left_ankle"),
        ("right_sho_roll", "right_shoulder"),
        ("l_arm_wry", "left_wrist"),
        ("neck_ry", "neck"),
        ("abdomen_z", "waist"),
        ("imu", None),
    ],
)
def test_names_of_well_known_robots(name: str, part: str | None) -> None:
    from motionloom.robots.joints import _read

    assert _read(name) == part


def test_the_skeleton_has_the_models_own_lengths(tmp_path: Path) -> None:
    """Thighs, shins and arms are as long as the model's bodies are apart; the soles are on the ground."""
    robot = read(tmp_path, models.humanoid())
    rest = robot.skeleton.rest_positions()

    def apart(a: str, b: str) -> float:
        return float(np.linalg.norm(rest[robot.skeleton.index(a)] - rest[robot.skeleton.index(b)]))

    assert apart("left_hip", "left_knee") == pytest.approx(0.3)
    assert apart("right_knee", "right_ankle") == pytest.approx(0.3)
    assert apart("left_shoulder", "left_elbow") == pytest.approx(0.2)
    assert apart("left_elbow", "left_wrist") == pytest.approx(0.2)
    assert rest[robot.skeleton.index("left_ankle"), 1] == pytest.approx(0.05)
    assert rest[robot.skeleton.index("left_hip"), 0] == pytest.approx(0.1)


@pytest.mark.parametrize("turn", [0.0, 1.0, np.pi])
def test_a_robot_may_face_any_way_in_its_file(turn: float, tmp_path: Path) -> None:
    """A model that faces elsewhere gives the same skeleton."""
    plain = read(tmp_path, models.humanoid())
    turned = models.humanoid().replace('name="base"', f'name="base" euler="0 0 {turn}"')
    assert np.allclose(read(tmp_path, turned).skeleton.offsets, plain.skeleton.offsets, atol=1e-9)


def test_a_map_says_which_joint_is_which(tmp_path: Path) -> None:
    path = written(tmp_path, models.humanoid(("x{s}0", *models.UNITREE[1:])))
    chosen = tmp_path / "map.json"
    chosen.write_text(json.dumps({"left_hip": ["xl0", "left_hip_roll_joint", "left_hip_yaw_joint"]}))
    robot = read_robot(path, chosen)
    assert robot.parts.hinges["left_hip"][0].name == "xl0"
    for wrong, said in (
        ({"left_hip": "nobody"}, "the hinges are"),
        ({"tail": "xl0"}, "the parts are"),
        ([1], "object"),
    ):
        chosen.write_text(json.dumps(wrong))
        with pytest.raises(MotionloomError, match=said):
            read_robot(path, chosen)


def _with(text: str) -> str:
    return models.humanoid(extra=text)


BAD = {
    "on 4 legs": models.on_legs(4),
    "wheel does": models.on_wheels(),
    "no limits": models.humanoid().replace(' range="0 2.4"', "", 1),
    "2 things that move freely": models.humanoid().replace(
        "</worldbody>", '<body><freejoint/><geom size="0.1"/></body></worldbody>'
    ),
    "in metres": models.humanoid(size=39.37),
    "slides": _with('<body><joint type="slide" range="0 1"/><geom size="0.02"/></body>'),
    "ball joint": _with('<body><joint type="ball"/><geom size="0.02"/></body>'),
    "does not stand upright": models.humanoid().replace('name="base"', 'name="base" euler="1.57 0 0"'),
    "no model that MuJoCo reads": "<mujoco><bad/></mujoco>",
    "is empty": " ",
    "no bodies": "<mujoco/>",
}


@pytest.mark.parametrize("said", BAD)
def test_what_is_no_humanoid_is_refused_in_one_sentence(said: str, tmp_path: Path) -> None:
    with pytest.raises(MotionloomError, match=said) as caught:
        read(tmp_path, BAD[said])
    assert "\n" not in str(caught.value)
    assert str(caught.value).count("robot.xml") == 1
    assert "\\n" not in str(caught.value)


def test_missing_meshes_are_no_obstacle(tmp_path: Path) -> None:
    """They are told, and left out."""
    text = models.humanoid(extra='<geom type="mesh" mesh="face"/>').replace(
        "<worldbody>", '<asset><mesh name="face" file="face.stl"/></asset><worldbody>'
    )
    robot = read(tmp_path, text)
    assert any("face.stl" in note for note in robot.notes)


def test_a_model_without_actuators_and_one_with_a_fixed_base_are_told(tmp_path: Path) -> None:
    robot = read(tmp_path, models.humanoid(free=""))
    assert robot.model.nq == 7 + len(robot.file.hinges)
    assert any("no actuators" in note for note in robot.notes)
    assert any("set free" in note for note in robot.notes)


def as_urdf(robot: Robot) -> str:
    """The robot's tree as URDF, hinges in the model's own order."""
    model, parts = robot.file.model, []
    inertial = '<inertial><mass value="1"/><inertia ixx="1" iyy="1" izz="1" ixy="0" ixz="0" iyz="0"/></inertial>'
    of = {hinge.body: hinge for hinge in robot.file.hinges}
    for body in range(1, model.nbody):
        name, above = model.body(body).name, model.body(int(model.body_parentid[body])).name
        parts.append(f'<link name="{name}">{inertial}</link>')
        if body == 1:
            continue
        place = " ".join(map(str, model.body_pos[body]))
        origin, ends = f'<origin xyz="{place}"/>', f'<parent link="{above}"/><child link="{name}"/>'
        if body not in of:
            parts.append(f'<joint name="fix_{name}" type="fixed">{ends}{origin}</joint>')
            continue
        row, axis = robot.file.hinges.index(of[body]), " ".join(map(str, of[body].axis))
        limit = (
            f'<limit lower="{robot.file.lower[row]}" upper="{robot.file.upper[row]}" effort="9" velocity="{4 + row}"/>'
        )
        parts.append(f'<joint name="{of[body].name}" type="revolute">{ends}{origin}<axis xyz="{axis}"/>{limit}</joint>')
    return f'<robot name="tin">{"".join(parts)}</robot>'


def test_urdf_is_read_with_its_speeds(tmp_path: Path) -> None:
    """MuJoCo drops a URDF's speeds and welds its base to the world; both are put right."""
    plain = read(tmp_path, models.humanoid())
    robot = read_robot(written(tmp_path, as_urdf(plain), "robot.urdf"))
    assert robot.file.joint_names() == plain.file.joint_names()
    assert robot.file.speed.tolist() == [4.0 + row for row in range(len(robot.file.hinges))]
    thigh = robot.skeleton.index("left_knee")
    assert np.allclose(robot.skeleton.offsets[thigh], plain.skeleton.offsets[thigh], atol=1e-6)


@pytest.mark.parametrize("where", ["", "urdf"])
def test_meshes_of_a_ros_package_are_found(where: str, tmp_path: Path) -> None:
    """``package://tin/meshes/foot.stl`` lies in the folder ``tin`` above the model; soles are read off such meshes."""
    (tmp_path / "tin" / where).mkdir(parents=True)
    (tmp_path / "tin" / "meshes").mkdir()
    low, high = np.array([-0.05, -0.03, -0.05]), np.array([0.17, 0.03, 0.0])
    corners = [low + (high - low) * [(i >> k) & 1 for k in range(3)] for i in range(8)]
    sides = (
        (0, 1, 3),
        (0, 3, 2),
        (4, 6, 7),
        (4, 7, 5),
        (0, 4, 5),
        (0, 5, 1),
        (2, 3, 7),
        (2, 7, 6),
        (0, 2, 6),
        (0, 6, 4),
    )
    faces = np.zeros(12, dtype=[("normal", "<3f4"), ("corners", "<9f4"), ("about", "<u2")])
    for row, side in enumerate((*sides, (1, 5, 7), (1, 7, 3))):
        faces["corners"][row] = np.concatenate([corners[i] for i in side])
    (tmp_path / "tin" / "meshes" / "foot.stl").write_bytes(bytes(80) + (12).to_bytes(4, "little") + faces.tobytes())
    text = as_urdf(read(tmp_path, models.humanoid()))
    mesh = '<collision><geometry><mesh filename="package://tin/meshes/foot.stl"/></geometry></collision>'
    for side in ("left", "right"):
        start = text.index(f'<link name="{side}_foot_b">')
        end = text.index("</link>", start)
        text = text[:end] + mesh + text[end:]
    robot = read_robot(written(tmp_path / "tin" / where, text, "tin.urdf"))
    assert len(robot.notes) == 1  # that it has no actuators
    corners_found = robot.soles["left"]
    assert np.ptp(corners_found, axis=0) == pytest.approx([0.22, 0.06, 0.0], abs=1e-5)
    assert corners_found[0, 2] == pytest.approx(-0.05, abs=1e-5)


def test_the_published_models_are_read() -> None:
    """Joint counts as their makers state them."""
    g1 = read_robot(shared("robots/unitree_g1/g1_29dof_without_meshes.xml"))
    assert (len(g1.file.hinges), len(g1.parts.hinges["waist"]), len(g1.parts.hinges["left_wrist"])) == (29, 3, 3)
    t1 = read_robot(shared("robots/booster_t1/t1_mocap.xml"))
    assert (len(t1.file.hinges), len(t1.parts.hinges["waist"]), "left_wrist" in t1.parts.hinges) == (21, 1, False)


WITHOUT = """
import importlib.abc, sys

class Nowhere(importlib.abc.MetaPathFinder):
    def find_spec(self, name, path=None, target=None):
        if name.partition(".")[0] in ("mujoco", "mink"):
            raise ModuleNotFoundError(f"No module named {name!r}", name=name)

sys.meta_path.insert(0, Nowhere())
from motionloom.cli import main
sys.exit(main(sys.argv[1:]))
"""


def test_without_the_extra_one_sentence_names_it(tmp_path: Path) -> None:
    """Everything else works; a robot is refused before any work."""
    path = written(tmp_path, models.humanoid())
    line = ["export", "nothing.bvh", str(tmp_path / "out.csv"), "--robot", str(path)]
    done = subprocess.run([sys.executable, "-c", WITHOUT, *line], capture_output=True, text=True, check=False)
    assert (done.returncode, done.stderr.count("\n")) == (2, 1)
    assert "motionloom[robots]" in done.stderr


def knees(robot: Robot) -> list[float]:
    return [float(robot.home[7 + robot.file.joint_names().index(f"{side}_knee_joint")]) for side in ("left", "right")]


@pytest.mark.parametrize(
    ("angles", "expected"),
    [((0.0, 0.0), (0.25, 0.25)), ((0.1, 0.6), (0.35, 0.6)), ((0.6, 0.7), (0.6, 0.7)), ((0.3, 0.3), (0.3, 0.3))],
)
@pytest.mark.parametrize("name", ["home", "stand"])
def test_a_straight_leg_of_a_keyframe_is_bent(
    name: str, angles: tuple[float, float], expected: tuple[float, float], tmp_path: Path
) -> None:
    """Each leg that is straight in it, and no other: a knee at the end of its range locks."""
    qpos = np.zeros(7 + 21)
    qpos[2:4] = 0.7, 1.0
    qpos[[7 + 3, 7 + 9]] = angles
    key = f'<keyframe><key name="{name}" qpos="{" ".join(map(str, qpos))}"/></keyframe></mujoco>'
    robot = read(tmp_path, models.humanoid().replace("</mujoco>", key))
    assert knees(robot) == pytest.approx(expected, abs=1e-9)


def test_knees_do_not_lock_where_the_hips_stand_out(tmp_path: Path) -> None:
    """The leg's plane is 10 cm beside the place where the axes of the hip meet, as on an H1."""
    pytest.importorskip("mink")
    from motionloom.robots.clip import put_on_robot

    text = models.humanoid(models.H1)
    for side, y in (("left", 0.1), ("right", -0.1)):
        text = text.replace(f'<body name="{side}_thigh_c">', f'<body name="{side}_thigh_c" pos="0 {y} 0">')
        text = text.replace(f'name="{side}_hip_yaw_joint" axis="0 1 0"', f'name="{side}_hip_yaw_joint" axis="0 0 1"')
        text = text.replace(
            f'name="{side}_hip_pitch_joint" axis="0 0 1"', f'name="{side}_hip_pitch_joint" axis="0 1 0"'
        )
    robot = read(tmp_path, text)
    clip = put_on_robot(marching(), robot)
    bent = [clip.qpos[:, 7 + robot.file.joint_names().index(f"{side}_knee_joint")] for side in ("left", "right")]
    assert np.min(bent) > 0.1
    assert clip.errors is not None
    assert np.median(clip.errors) < 0.01


COUPLED = """<equality><joint joint1="right_elbow_joint" joint2="left_elbow_joint" polycoef="0 1 0 0 0"/>
<joint joint1="left_ankle_pitch_joint" joint2="left_knee_joint" polycoef="0 -0.5 0 0 0"/>
<joint joint1="left_shoulder_yaw_joint" joint2="left_shoulder_roll_joint" polycoef="0.1 0 0.3 0 0"/>
<joint joint1="waist_yaw_joint" polycoef="0.1 0 0 0 0"/>
<connect body1="chest" body2="left_palm" anchor="0 0 0"/></equality></mujoco>"""


def test_hinges_that_others_move_follow_them(tmp_path: Path) -> None:
    """In all frames and at rest: gears, a polynomial, a hinge that is held; a closed chain is told."""
    pytest.importorskip("mink")
    from motionloom.robots.clip import put_on_robot

    robot = read(tmp_path, models.humanoid().replace("</mujoco>", COUPLED))
    assert any("1 constraints that close chains" in note for note in robot.notes)
    clip = put_on_robot(marching(), robot)
    poses = dict(zip(robot.file.joint_names(), np.vstack([clip.qpos, robot.home])[:, 7:].T))
    assert np.ptp(poses["left_knee_joint"]) > 0.5
    np.testing.assert_allclose(poses["right_elbow_joint"], poses["left_elbow_joint"], atol=1e-9)
    np.testing.assert_allclose(poses["left_ankle_pitch_joint"], -0.5 * poses["left_knee_joint"], atol=1e-9)
    expected = 0.1 + 0.3 * poses["left_shoulder_roll_joint"] ** 2
    np.testing.assert_allclose(poses["left_shoulder_yaw_joint"], expected, atol=1e-9)
    np.testing.assert_allclose(poses["waist_yaw_joint"], 0.1, atol=1e-9)
    assert clip.errors is not None
    assert np.median(clip.errors) < 0.02


BOMBS = {
    "bodies": "<replicate count='100000000' offset='0 0 1'><geom size='1'/></replicate>",
    "nested": "<replicate count='9999'><replicate count='9999'><geom size='1'/></replicate></replicate>",
    "soft": "<flexcomp name='f' type='grid' count='1000 1000 1000' spacing='.1 .1 .1' radius='.01' dim='3'/>",
}


@pytest.mark.parametrize("bomb", BOMBS)
def test_a_model_that_never_ends_is_refused(bomb: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """In a sentence; and the next model is read as ever."""
    monkeypatch.setattr(trial, "PROCESSOR_SECONDS", 1)
    trial.end()
    text = models.humanoid().replace("<worldbody>", f"<worldbody>{BOMBS[bomb]}")
    with pytest.raises(MotionloomError, match=r"cannot be read as a robot's model within 1 s of one core and 3 GB"):
        read(tmp_path, text)
    monkeypatch.undo()
    assert read(tmp_path, models.humanoid()).name == "tin"


@pytest.mark.parametrize(
    ("things", "words"),
    [
        ("<replicate count='3500' offset='0 0 1'><geom size='.1'/></replicate>", "3,524 bodies, geoms"),
        ("<replicate count='3500' offset='0 0 1'><site size='.1'/></replicate>", "3,500 bodies, geoms"),
    ],
)
def test_a_model_of_too_many_things_is_refused(things: str, words: str, tmp_path: Path) -> None:
    with pytest.raises(MotionloomError, match=words):
        read(tmp_path, models.humanoid().replace("<worldbody>", f"<worldbody>{things}"))


@pytest.mark.skipif(not Path("/proc/self/stat").exists(), reason="children are looked for in /proc")
@pytest.mark.parametrize("ending", [signal.SIGINT, signal.SIGTERM])
def test_a_signal_ends_a_command_whose_model_never_ends(ending: signal.Signals, tmp_path: Path) -> None:
    """And the process that reads the model with it."""
    path = written(tmp_path, models.humanoid().replace("<worldbody>", f"<worldbody>{BOMBS['bodies']}"))
    line = [sys.executable, "-m", "motionloom", "robot-check", str(path), "--robot", str(path)]
    with subprocess.Popen(line, stderr=subprocess.PIPE) as command:
        children: list[int] = []
        while command.poll() is None and not children:
            children = [
                int(one) for one in Path(f"/proc/{command.pid}/task/{command.pid}/children").read_text().split()
            ]
            time.sleep(0.02)
        command.send_signal(ending)
        assert command.wait(timeout=60) == 130
        assert not any(Path(f"/proc/{child}").exists() for child in children)
