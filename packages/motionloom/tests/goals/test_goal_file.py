"""Goal files: what each key asks for, what is refused and how it is told, and that the schema says the same."""

import copy
import json
from pathlib import Path

import numpy as np
import pytest
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st

from motionloom import io
from motionloom.core.errors import MotionloomError
from motionloom.core.ground import GroundPose
from motionloom.core.motion import Motion
from motionloom.core.rotations import rotvec_to_quat
from motionloom.core.skeleton import SMPL22
from motionloom.goals.goal import Goal, start_of
from motionloom.goals.goal_file import follow, read_goal
from motionloom.goals.schemas import goal_schema
from motionloom.retarget import to_smpl22
from tests.schema_check import fits

EXAMPLES = sorted((Path(__file__).parents[4] / "examples" / "goals").glob("*.json"))
WRIST = SMPL22.index("left_wrist")


def walker(frames: int = 80, fps: float = 40.0) -> Motion:
    """Somebody in a T-pose who glides along +X at 1 m/s from (2, 1), facing +X, swinging an arm."""
    rotations = np.tile([1.0, 0, 0, 0], (frames, 22, 1))
    rotations[:, 0] = rotvec_to_quat(np.array([0, np.pi / 2, 0]))
    rotations[:, 18] = rotvec_to_quat(np.outer(np.sin(np.arange(frames) / 10), [0, 0, 1.0]))
    root = np.tile([2.0, SMPL22.offsets[0, 1], 1.0], (frames, 1))
    root[:, 0] += np.arange(frames) / fps
    return Motion(SMPL22, fps, root, rotations)


@pytest.fixture(scope="module")
def folder(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A motion and a drawing that goals may name."""
    place = tmp_path_factory.mktemp("goals")
    io.save(walker(), place / "walk.bvh")
    (place / "l.svg").write_text('<svg><path d="M40 90V10H0"/></svg>')
    (place / "up.svg").write_text('<svg><line x1="3" y1="9" x2="3" y2="1"/></svg>')
    return place


@pytest.fixture
def read(folder: Path):
    """A goal of five seconds from keys, as a file would hold them."""

    def goal(frames: int = 100, **keys) -> Goal:
        (folder / "goal.json").write_text(json.dumps(keys))
        return read_goal(folder / "goal.json", frames=frames, folder=folder)

    return goal


def places(goal: Goal) -> np.ndarray:
    return goal.positions[:, 0, ::2]


def test_a_path_begins_where_it_says_and_so_does_the_person(read) -> None:
    goal = read(path={"points": [[3, 1], [3, 5]]})
    assert places(goal)[[0, 99]].tolist() == [[3, 1], [3, 5]]
    assert goal.start == GroundPose(3, 1, 0)
    goal = read(path={"points": [[3, 1], [1, 1]]}, start={"facing": -90})
    assert (goal.start.x, goal.start.z, goal.start.facing) == pytest.approx((3, 1, -np.pi / 2))
    closed = read(path={"points": [[0, 0], [1, 0], [1, 1]], "closed": True, "smooth": False})
    assert places(closed)[99].tolist() == [0, 0]
    timed = read(path={"points": [[0, 0], [0, 1], [0, 1]], "times": [0, 2, 4]})
    assert places(timed)[[20, 40, 60, 80], 1] == pytest.approx([0.5, 1, 1, 1], abs=0.15)
    assert not timed.mask[81:].any()


def test_somebody_who_looks_elsewhere_has_a_second_to_turn(read) -> None:
    goal = read(path={"points": [[0, 0], [0, 4]]}, start={"facing": 90})
    assert goal.start.facing == pytest.approx(np.pi / 2)
    assert np.flatnonzero(goal.facing_mask).tolist() == list(range(20, 100))


def test_drawings_and_curves_lie_where_the_person_stands(read) -> None:
    """The drawing goes up the page, then to the left; 40 units across are 2 m."""
    goal = read(path={"svg": "l.svg", "width": 2, "facing": "free"}, start={"position": [5, 1]})
    assert places(goal)[[0, 99]] == pytest.approx(np.array([[5, 1], [7, 5]]))
    assert goal.positions[:67, 0, 0] == pytest.approx(5, abs=0.05)
    assert goal.start == GroundPose(5, 1, 0)
    assert places(read(path={"svg": "up.svg", "scale": 0.5}))[99].tolist() == [0, 4]
    assert places(read(path={"svg": "up.svg", "times": [1, 3]}))[60, 1] == pytest.approx(2.4)  # 1.2 m/s
    turned = read(path={"curve": "line", "size": 3}, start={"position": [1, 1], "facing": 90})
    assert places(turned)[99].tolist() == pytest.approx([4, 1])
    right = read(path={"curve": "circle", "size": 2, "turn": "right"}, frames=101)
    assert places(right)[25].tolist() == pytest.approx([-1, 1], abs=1e-3)


def test_joints_at_times_by_name_and_group(read) -> None:
    points = [{"time": 1, "position": [0.1, 1.2, 0.3]}, {"time": 5, "position": [None, 1.4, None]}]
    goal = read(joints=[{"joint": "left_wrist", "points": points}, {"joint": "feet", "every_frame": [None, [0, 0, 0]]}])
    assert goal.positions[20, WRIST].tolist() == [0.1, 1.2, 0.3]
    assert goal.mask[99, WRIST].tolist() == [False, True, False]
    assert np.flatnonzero(goal.mask[:, WRIST].any(-1)).tolist() == [20, 99]
    assert goal.mask[1].all(axis=-1).nonzero()[0].tolist() == [7, 8, 10, 11]
    assert start_of(goal) == GroundPose()


def test_a_curve_asks_for_every_frame_between_its_points(read) -> None:
    points = [{"time": t, "position": [0.3, y, 0.3]} for t, y in ((1, 1.0), (2, 1.5), (3, 1.5), (4, 1.2))]
    goal = read(joints=[{"joint": "left_wrist", "points": points, "curve": True}])
    y = goal.positions[20:81, WRIST, 1]
    assert goal.mask[:, WRIST, 1].nonzero()[0].tolist() == list(range(20, 81))
    assert y[[0, 20, 40, 60]] == pytest.approx([1, 1.5, 1.5, 1.2])
    assert y.max() == pytest.approx(1.5)


def test_places_seen_from_the_root_move_with_the_path(read) -> None:
    """Half a metre ahead of somebody who walks along +X is half a metre further along +X."""
    keys = {"joint": "left_wrist", "frame": "root", "points": [{"time": 2, "position": [0.2, 1.2, 0.5]}]}
    path = {"points": [[0, 0], [5, 0]], "times": [0, 5]}
    goal = read(path=path, joints=[keys])
    assert goal.positions[40, WRIST] == pytest.approx([2.5, 1.2, -0.2])
    with pytest.raises(MotionloomError, match=r"joints\[0\]\.points\[0\].*seen from the root at 2.00 s"):
        read(path=path | {"facing": "free"}, joints=[keys])


def test_a_pose_stands_where_the_person_does(read) -> None:
    """The same pose, turned from +X to +Z and moved; later on the path's place at that time."""
    own = to_smpl22(walker()).positions()[40]
    goal = read(poses=[{"time": 0, "from": "walk.bvh", "at": 1.0}], start={"position": [1, 2]})
    assert goal.mask[0].all()
    expected = np.stack([-own[:, 2] + own[0, 2] + 1, own[:, 1], own[:, 0] - own[0, 0] + 2], axis=-1)
    assert goal.positions[0] == pytest.approx(expected, abs=2e-3)
    goal = read(poses=[{"time": 0, "from": "walk.bvh", "position": [4, 4], "facing": 90}])
    assert goal.start == GroundPose(4, 4, np.pi / 2)
    assert goal.positions[0, :, 2] - 4 == pytest.approx(to_smpl22(walker()).positions()[0, :, 2] - 1, abs=2e-3)
    path = {"points": [[0, 0], [4, 0]], "times": [0, 4]}
    goal = read(path=path, poses=[{"time": 2, "from": "walk.bvh"}])
    assert goal.positions[40, 0, ::2] == pytest.approx([2, 0])
    assert goal.positions[40, WRIST, 2] < -0.3  # the left hand of somebody who goes along +X


def test_following_takes_the_places_of_the_other_world(read) -> None:
    clip = to_smpl22(walker()).positions()
    goal = read(follow={"from": "walk.bvh", "joints": ["left_wrist"], "from_time": 0.5})
    assert goal.joints == ("left_wrist",)
    assert goal.mask[:, WRIST].all(-1).sum() == 30  # the clip has 40 frames at 20 a second
    # the file does not say where the floor is: it is found anew, a millimetre off
    assert goal.positions[10, WRIST] == pytest.approx(clip[40, WRIST], abs=2e-3)
    assert (goal.start.x, goal.start.z, goal.start.facing) == pytest.approx((2.5, 1, np.pi / 2), abs=2e-3)
    sparse = read(follow=[{"from": "walk.bvh", "joints": ["hands"], "times": [0, 1.5]}], start={"position": [2, 1]})
    assert sparse.mask[:, WRIST].any(-1).nonzero()[0].tolist() == [0, 30]
    assert sparse.start == GroundPose(2, 1, 0)


def test_follow_of_a_motion() -> None:
    goal = follow(walker(), ["pelvis", "left_wrist"], frames=25)
    assert goal.joints == ("pelvis", "left_wrist")
    assert goal.positions[20, 0, ::2] == pytest.approx([3, 1], abs=2e-3)
    assert follow(walker(), ["head"], frames=100, at=[1.0]).mask[20, 15].all()
    for wrong in ([2.1], [-1.0], []):
        with pytest.raises(MotionloomError, match="can be followed at 0 to"):
            follow(walker(), ["head"], frames=100, at=wrong)
    with pytest.raises(MotionloomError, match="no joint 'tail'"):
        follow(walker(), ["tail"], frames=100)


LINE = {"points": [[0, 0], [0, 2]]}
REACHES = [{"joint": "left_wrist", "points": [{"time": 1, "position": [0, 1, 9]}]}]
MISTAKES = {
    "paths": ({"paths": LINE}, "unknown key 'paths' .did you mean 'path'"),
    "nothing": ({}, "asks for nothing"),
    "kinds": ({"path": {"points": [[0, 0]], "svg": "l.svg"}}, "'path' must have one of"),
    "times": ({"path": LINE | {"tmes": [0, 1]}}, "'path' has the unknown key 'tmes'"),
    "late": ({"path": LINE | {"times": [0, 9]}}, r"path.times\[1\]' must be 0 to 5; got 9"),
    "unsorted": ({"path": LINE | {"times": [1, 1]}}, "path.times' must rise"),
    "count": ({"path": LINE | {"times": [1]}}, "has 1 times; 2 are needed"),
    "word": ({"path": {"points": [[0, "1"]]}}, r"path.points\[0\]\[1\]' must be a number; got '1'"),
    "flag": ({"path": LINE | {"smooth": 1}}, "path.smooth' must be true or false"),
    "bool": ({"path": {"points": [[0, True]]}}, "must be a number; got true"),
    "far": ({"path": {"points": [[0, 1001]]}}, "must be -1000 to 1000; got 1001"),
    "huge": ({"path": {"points": [[0, 10**290]]}}, "a number beyond all bounds"),
    "fast": ({"path": {"points": [[0, 0], [0, 99]]}}, r"20.0 m/s.*at least 8.25 s"),
    "away": ({"path": LINE, "start": {"position": [1, 0]}}, "begins 1.00 m away from the 'start'"),
    "facing": ({"path": LINE | {"facing": [1, 2, 3]}}, "3 directions for 2 points"),
    "curve": ({"path": {"curve": "circl", "size": 1}}, "did you mean 'circle'"),
    "size": ({"path": {"curve": "circle"}}, "'path' has no 'size'"),
    "both": ({"path": {"svg": "l.svg", "width": 1, "scale": 1}}, "not both"),
    "upright": ({"path": {"svg": "up.svg", "width": 1}}, "give 'scale' instead"),
    "joint": ({"joints": [{"joint": "left_wrst", "points": []}]}, r"joints\[0\].joint' .*did you mean 'left_wrist'"),
    "neither": ({"joints": [{"joint": "head"}]}, "needs one of 'points' and 'every_frame'"),
    "half": ({"joints": [{"joint": "head", "every_frame": [[1, 1, None]]}]}, "x and z together"),
    "double": (
        {"joints": [{"joint": "head", "points": [{"time": t, "position": [0, 1, 0]} for t in (1, 1.01)]}]},
        r"points\[1\].time' must be at least a frame",
    ),
    "reach": ({"joints": REACHES, "path": LINE}, "left_wrist at 1.00 s 8.60 m away"),
    "start reach": (
        {"joints": [{"joint": "head", "every_frame": [[3, 1, 0]]}], "start": {"position": [0, 0]}},
        "head at 0.00 s 3.00 m away",
    ),
    "high": ({"joints": [{"joint": "head", "every_frame": [[0, 3.2, 0]]}]}, "head at 0.00 s 3.20 m high"),
    "contradiction": (
        {"joints": [{"joint": "head", "every_frame": [[0, y, 0]]} for y in (1, 1.5)]},
        r"joints\[1\]' cannot be had with the rest: .*head at 0.00 s .*0.50 m apart",
    ),
    "jump": (
        {"joints": [{"joint": "pelvis", "points": [{"time": t, "position": [t * 20, 1, 0]} for t in (1, 2)]}]},
        "asks for 20.0 m/s",
    ),
    "up": ({"follow": {"from": "../a.bvh", "joints": ["head"]}}, "leads out of the folder"),
    "root": ({"follow": {"from": "/etc/passwd", "joints": ["head"]}}, "leads out of the folder"),
    "windows": ({"follow": {"from": "C:\\a.bvh", "joints": ["head"]}}, "leads out of the folder"),
    "absent": ({"poses": [{"time": 0, "from": "no.bvh"}]}, r"poses\[0\].from' names 'no.bvh', and there is no such"),
    "kind": ({"poses": [{"time": 0, "from": "l.svg"}]}, "cannot be used"),
    "at": ({"poses": [{"time": 0, "from": "walk.bvh", "at": 3}]}, r"poses\[0\].at' must be 0 to 2"),
    "start": ({"start": {}}, "'start' says nothing"),
    "list": ({"joints": {}}, "'joints' must be a list; got a mapping"),
    "empty": ({"joints": []}, "'joints' has 0 entries"),
}


@pytest.mark.parametrize("name", MISTAKES)
def test_mistakes_are_reported_by_their_key(name: str, read, folder: Path) -> None:
    keys, sentence = MISTAKES[name]
    with pytest.raises(MotionloomError, match=sentence) as error:
        read(**keys)
    assert str(error.value).startswith(str(folder / "goal.json"))
    with pytest.raises(MotionloomError) as error:
        read_goal(keys, frames=100, folder=folder)
    assert "goal.json" not in str(error.value)


@pytest.mark.parametrize(
    ("text", "sentence"),
    [
        ("", "is empty"),
        ("{", "is not JSON .*line 1"),
        ("[]", "must be a mapping"),
        ("NaN", "NaN is no number"),
        ('{"path": {"points": [[0, Infinity]]}}', "Infinity is no number"),
        ('{"start": 1, "start": 2}', "'start' stands in it twice"),
        ('{"path": {"points": [[0, 1e999]]}}', "1e999 is no number that fits"),
        ("[" * 100_000, "too deep"),
        ("1" * 10_000, "10,000 digits, which is no number that fits"),
        ("\udcff", "utf-8"),
        ("\0", "binary"),
    ],
    ids=range(11),
)
def test_files_that_are_no_goals(tmp_path: Path, text: str, sentence: str) -> None:
    file = tmp_path / "goal.json"
    file.write_bytes(text.encode("utf-8", "surrogateescape"))
    with pytest.raises(MotionloomError, match=sentence):
        read_goal(file, frames=100, folder=tmp_path)


def test_a_mistake_in_a_file_names_line_and_key_and_editors_may_be_told_the_schema(tmp_path: Path) -> None:
    file = tmp_path / "goal.json"
    lines = [
        '{"$schema": "goal.schema.json",',
        ' "joints": [',
        '  {"joint": "head",',
        '   "points": [{"time": 1, "position": 3}]}]}',
    ]
    file.write_text("\n".join(lines))
    with pytest.raises(MotionloomError, match=r"goal\.json, line 4: 'joints\[0\]\.points\[0\]\.position' must be"):
        read_goal(file, frames=100, folder=tmp_path)
    file.write_text("\n".join(lines).replace("3}", "[0, 1.5, 0]}"))
    assert read_goal(file, frames=100, folder=tmp_path).joints == ("head",)
    assert fits(json.loads(file.read_text()), WHOLE, WHOLE)
    file.write_text('{\t"path": 3}')
    with pytest.raises(MotionloomError, match=r"goal\.json(, line 1)?: 'path' must be"):
        read_goal(file, frames=100, folder=tmp_path)


def test_a_large_file_and_a_link_outwards_are_not_read(folder: Path, tmp_path: Path) -> None:
    with (tmp_path / "goal.json").open("wb") as file:
        file.truncate(17_000_000)
    with pytest.raises(MotionloomError, match=r"above 16\.0 MB"):
        read_goal(tmp_path / "goal.json", frames=100, folder=tmp_path)
    (tmp_path / "link.bvh").symlink_to(folder / "walk.bvh")
    with pytest.raises(MotionloomError, match="a link that leads out"):
        read_goal({"poses": [{"time": 0, "from": "link.bvh"}]}, frames=9, folder=tmp_path)


# The schema ------------------------------------------------------------------------------------------------------

WHOLE = goal_schema()
STRUCTURE = {  # mistakes that the schema can see; the others are about times, reach and files
    "paths",
    "nothing",
    "kinds",
    "times",
    "word",
    "flag",
    "bool",
    "far",
    "huge",
    "curve",
    "size",
    "joint",
    "neither",
    "half",
    "high",
    "start",
    "list",
    "empty",
} - {"high"}
GOOD = [
    {"path": LINE | {"times": [0, 2], "closed": False, "smooth": False, "facing": "free"}, "start": {"facing": 0}},
    {"path": {"points": [[0, 0], [0, 2]], "closed": True, "facing": [0, 10, 20]}},
    {"path": {"svg": "l.svg", "width": 2, "times": [0, 4], "facing": 90}, "start": {"position": [0, 0]}},
    {"path": {"svg": "l.svg", "scale": 0.02}},
    {"path": {"curve": "s", "size": 3, "turn": "right", "times": [0, 4]}},
    {"joints": [{"joint": "hands", "every_frame": [None, [None, 1, None], [0, None, 0]]}]},
    {"joints": [{"joint": "head", "points": [{"time": 1, "position": [0, 1.5, 0]}], "curve": True, "frame": "world"}]},
    {"poses": [{"time": 1, "from": "walk.bvh", "at": 1, "position": [0, 0], "facing": 30}]},
    {"follow": {"from": "walk.bvh", "joints": ["head"], "from_time": 0.5, "times": [0, 1]}},
    {"follow": [{"from": "walk.bvh", "joints": ["left_arm", "head"]}]},
]


@pytest.mark.parametrize("name", MISTAKES)
def test_the_schema_sees_mistakes_of_structure(name: str) -> None:
    assert fits(MISTAKES[name][0], WHOLE, WHOLE) == (name not in STRUCTURE)


@pytest.mark.parametrize("example", EXAMPLES, ids=lambda path: path.stem)
def test_the_examples_are_read_and_fit_the_schema(example: Path) -> None:
    assert not read_goal(example, frames=120, folder=example.parent).empty
    assert fits(json.loads(example.read_text()), WHOLE, WHOLE)


ODD = st.sampled_from(
    [None, True, 0, -1, 1, 2.5, 1e6, "", "x", "free", [], [1], [0, 0], [0, None, 0], {}, [{}], {"x": 1}]
)


def spots(value, way=()):
    """The way to every value inside."""
    yield way
    inner = value.items() if isinstance(value, dict) else enumerate(value) if isinstance(value, list) else ()
    for key, part in inner:
        yield from spots(part, (*way, key))


@settings(max_examples=120, suppress_health_check=[HealthCheck.function_scoped_fixture])
@given(st.data())
def test_whatever_is_put_anywhere_is_a_goal_or_a_sentence_and_what_is_read_fits_the_schema(folder: Path, data) -> None:
    value = copy.deepcopy(data.draw(st.sampled_from(GOOD)))
    way = data.draw(st.sampled_from([way for way in spots(value) if way]))
    place = value
    for key in way[:-1]:
        place = place[key]
    if isinstance(place, dict) and data.draw(st.booleans()):
        place[data.draw(st.sampled_from(["x", "time", "points", "facing"]))] = place.pop(way[-1])
    else:
        place[way[-1]] = data.draw(ODD)
    try:
        goal = read_goal(value, frames=100, folder=folder)
    except MotionloomError:
        return
    assert len(goal) == 100
    assert fits(value, WHOLE, WHOLE)


@pytest.mark.parametrize("number", range(len(GOOD)))
def test_what_is_good_is_read_and_fits_the_schema(number: int, folder: Path) -> None:
    assert read_goal(GOOD[number], frames=100, folder=folder).mask.any()
    assert fits(GOOD[number], WHOLE, WHOLE)
