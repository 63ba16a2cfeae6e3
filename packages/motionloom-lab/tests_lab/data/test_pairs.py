"""Pairs of people from files: one world, one scale, and a sentence for everything that is no pair."""

import pickle
import shutil
from pathlib import Path

import numpy as np
import pytest

from motionloom.core.body.ik import motion_from_positions
from motionloom.core.errors import MotionloomError
from motionloom.core.features import humanml as hml
from motionloom.core.skeleton import HUMANML_BONE_LENGTHS
from motionloom.io import save
from motionloom.kinematics import physics as ph
from motionloom.kinematics import shared_world
from motionloom_lab.metrics import pair as mp
from motionloom_lab.papers import readers, threedpw
from motionloom_train.data import pairs as dp
from tests.kinematics import people
from tests.shared import shared

FPS = 20.0


def walkers(apart: float = 1.0, seconds: float = 2.0) -> np.ndarray:
    """(2, frames, 22, 3): uniform people who walk side by side at other speeds."""
    a = hml.uniform(people.walking(1.0, seconds))
    b = hml.uniform(people.walking(0.6, seconds)) + np.array([apart, 0.0, 0.5])
    return np.stack([a, b])


def write(path: Path, positions: np.ndarray, *, fps: float = FPS) -> Path:
    path.parent.mkdir(parents=True, exist_ok=True)
    save(motion_from_positions(positions, fps), path)
    return path


def write_pair(folder: Path, name: str, pair: np.ndarray, *, nested: bool = False) -> None:
    for person, positions in zip("ab", pair, strict=True):
        write(folder / (f"{name}/{person}.bvh" if nested else f"{name}_{person}.bvh"), positions)


@pytest.fixture(scope="module")
def recorded(tmp_path_factory) -> Path:
    folder = tmp_path_factory.mktemp("recorded")
    write_pair(folder, "walk", walkers())
    return folder


@pytest.fixture
def one(recorded, tmp_path) -> Path:
    """A folder with the pair ``walk`` and its caption."""
    for path in recorded.iterdir():
        shutil.copy(path, tmp_path / path.name)
    (tmp_path / "captions.txt").write_text("walk: two people walk\n")
    return tmp_path


# A user's own --------------------------------------------------------------------------------------------------------


def test_a_pair_of_files_keeps_places_and_captions(one):
    (one / "captions.txt").write_text("# said by us\n\nwalk: two people: they walk\nwalk\tone goes  to the left\n")
    (pair,) = dp.find_pairs(one)
    assert (pair.name, pair.split, pair.source) == ("walk", "train", "own")
    assert pair.captions == ("two people: they walk", "one goes to the left")
    expected = walkers()
    np.testing.assert_allclose(mp.distance(pair.positions), mp.distance(expected), atol=0.03)
    np.testing.assert_allclose(ph.bone_lengths(pair.positions[0])[7], HUMANML_BONE_LENGTHS, atol=1e-9)
    assert abs(np.percentile(pair.positions[..., 10:12, 1].min(axis=-1), 20)) < 0.03


def test_both_layouts_of_names_are_read_and_ten_pairs_are_split(recorded, tmp_path):
    for n in range(10):
        for person in "ab":
            target = tmp_path / (f"p{n}/{person}.bvh" if n % 2 else f"p{n}_{person}.bvh")
            target.parent.mkdir(exist_ok=True)
            shutil.copy(recorded / f"walk_{person}.bvh", target)
    files = dp._pair_files(tmp_path)
    assert sorted(files) == [f"p{n}" for n in range(10)]
    assert files["p1"] == (tmp_path / "p1/a.bvh", tmp_path / "p1/b.bvh")
    pairs = dp.read_pair_folder(tmp_path, captions=False)
    assert [pair.split for pair in pairs] == ["train"] * 4 + ["val"] + ["train"] * 4 + ["test"]


def test_completion_needs_no_captions_and_text_does(one):
    (one / "captions.txt").unlink()
    assert dp.read_pair_folder(one, captions=False)[0].captions == ()
    with pytest.raises(MotionloomError, match=r"there is no .*captions\.txt"):
        dp.read_pair_folder(one)


@pytest.mark.parametrize(
    ("text", "sentence"),
    [
        ("", "no line for the pair walk"),
        ("walk two people walk\n", "line 1 has no caption"),
        ("walk:\n", "line 1 has no caption"),
        ("walk: fine\nrun: they run\n", "line 2 names 'run', which is no pair of that folder; it has walk"),
        ("../walk: they escape\n", r"names '\.\./walk', which is no pair"),
        ("walk: " + "x" * 2000, "at most 1000"),
        ("walk: a\x1b[2Jb", "printable"),
        (b"walk: \xff\xfe", "UTF-8"),
        ("walk: x\n" * 200_000, "files above 1.0 MB"),
    ],
    ids=["empty", "no-mark", "no-words", "stranger", "escape", "long", "control", "binary", "large"],
)
def test_a_caption_file_that_does_not_fit_is_refused(one, text, sentence):
    (one / "captions.txt").write_bytes(text if isinstance(text, bytes) else text.encode())
    with pytest.raises(MotionloomError, match=sentence) as caught:
        dp.read_pair_folder(one)
    assert "\n" not in str(caught.value)


def test_every_missing_caption_is_counted(one):
    for n in range(3):
        for person in "ab":
            shutil.copy(one / f"walk_{person}.bvh", one / f"more{n}_{person}.bvh")
    with pytest.raises(MotionloomError, match="no line for the pair more0 and 2 more"):
        dp.read_pair_folder(one)


def test_a_missing_partner_is_named(one):
    (one / "walk_b.bvh").unlink()
    with pytest.raises(MotionloomError, match=r"walk_a\.bvh has no partner: .*walk_b\.bvh is missing"):
        dp.read_pair_folder(one)


def test_a_pair_that_is_there_twice_and_a_folder_without_pairs_are_refused(one, tmp_path):
    write_pair(one, "walk", walkers(), nested=True)
    with pytest.raises(MotionloomError, match="the pair walk twice"):
        dp.read_pair_folder(one)
    (tmp_path / "empty").mkdir()
    with pytest.raises(MotionloomError, match="has no pairs"):
        dp.find_pairs(tmp_path / "empty")
    with pytest.raises(MotionloomError, match="not a folder"):
        dp.find_pairs(tmp_path / "nowhere")


def test_the_same_file_twice_and_the_same_motion_elsewhere_are_refused(one):
    shutil.copy(one / "walk_a.bvh", one / "walk_b.bvh")
    with pytest.raises(MotionloomError, match="are the same file"):
        dp.read_pair_folder(one)
    write(one / "walk_b.bvh", walkers()[0] + np.array([2.0, 0.0, 1.0]))
    with pytest.raises(MotionloomError, match="are the same motion"):
        dp.read_pair_folder(one)


def test_other_lengths_rates_and_worlds_are_refused_with_both_numbers(one):
    pair = walkers()
    write(one / "walk_b.bvh", pair[1, :-3])
    with pytest.raises(MotionloomError, match="lengths differ, 40 and 37 frames"):
        dp.read_pair_folder(one)
    write(one / "walk_b.bvh", pair[1], fps=25.0)
    with pytest.raises(MotionloomError, match="rates differ, 20 and 25 frames"):
        dp.read_pair_folder(one)
    write(one / "walk_b.bvh", pair[1] + np.array([50.0, 0.0, 0.0]))
    with pytest.raises(MotionloomError, match=r"never nearer than 51\.\d m"):
        dp.read_pair_folder(one)
    write_pair(one, "walk", pair[:, :15])
    with pytest.raises(MotionloomError, match="at least 1 s"):
        dp.read_pair_folder(one)


# One world -----------------------------------------------------------------------------------------------------------


def test_people_of_other_legs_keep_their_distances_up_to_one_factor():
    pair = walkers(1.5)
    large = pair * np.array([1.2, 0.8])[:, None, None, None]  # two bodies, each about the origin
    uniform = [hml.uniform(person) for person in large]
    own = float(sum(HUMANML_BONE_LENGTHS[j] for j in (4, 7)))
    legs = [1.2 * own, 0.8 * own]
    together = shared_world.one_world(uniform, legs)
    before = np.linalg.norm((large[1] - large[0])[:, 0, [0, 2]], axis=-1)
    np.testing.assert_allclose(mp.distance(together), before, rtol=5e-3)  # the mean leg is the uniform one
    apart = mp.distance(np.stack(uniform))
    assert np.abs(apart / before - 1).max() > 0.05  # each by the own factor would not
    np.testing.assert_array_equal(together[..., 1], np.stack(uniform)[..., 1])


def test_people_of_equal_legs_are_not_moved():
    pair = walkers()
    np.testing.assert_array_equal(shared_world.one_world(list(pair), [0.7, 0.7]), pair)


def test_a_pair_on_another_place_of_the_world_is_the_same_pair():
    pair = walkers() * np.array([1.1, 0.9])[:, None, None, None]
    there = pair + np.array([30.0, 0.0, -20.0])
    first, second = (shared_world.one_world([hml.uniform(p) for p in both], [1.1, 0.9]) for both in (pair, there))
    np.testing.assert_allclose(mp.distance(first), mp.distance(second), atol=0.01)


# Variants ------------------------------------------------------------------------------------------------------------


def a_pair(frames: int = 40) -> dp.Pair:
    return dp.Pair("x", "train", ("one steps to the left",), "own", "", walkers(1.0, frames / 20))


def test_crops_cover_the_pair_and_may_be_all_of_it():
    pair = a_pair(40)
    assert dp.crop(pair, 0, 40).frames == 40
    np.testing.assert_array_equal(dp.crop(pair, 7, 20).positions, pair.positions[:, 7:27])
    assert [w.positions[0, 0, 0, 2] for w in dp.windows(pair, 20, 10)] == [
        pair.positions[0, s, 0, 2] for s in (0, 10, 20)
    ]
    assert list(dp.windows(pair, 41, 1)) == []
    for start, frames in ((-1, 10), (31, 10), (0, 41), (0, 0)):
        with pytest.raises(MotionloomError, match="are not in its 40"):
            dp.crop(pair, start, frames)


def test_a_mirrored_pair_has_mirrored_words_and_twice_is_itself():
    pair = a_pair()
    flip = dp.mirrored(pair)
    assert flip.captions == ("one steps to the right",)
    np.testing.assert_array_equal(flip.positions[..., 4, 0], -pair.positions[..., 5, 0])  # left knee, right knee
    np.testing.assert_array_equal(flip.positions[..., 4, 1:], pair.positions[..., 5, 1:])
    np.testing.assert_array_equal(dp.mirrored(flip).positions, pair.positions)
    np.testing.assert_allclose(mp.distance(flip.positions), mp.distance(pair.positions))
    np.testing.assert_allclose(ph.heading(flip.positions[0]), -ph.heading(pair.positions[0]), atol=1e-9)


@pytest.mark.parametrize("wrong", ["one", "nan", "joints"])
def test_a_pair_of_other_numbers_is_refused(wrong):
    positions = {"one": np.zeros((1, 20, 22, 3)), "joints": np.zeros((2, 20, 24, 3))}.get(
        wrong, np.full((2, 20, 22, 3), np.nan)
    )
    with pytest.raises(MotionloomError, match="finite positions"):
        dp.Pair("x", "train", (), "own", "", positions)


# The pack ------------------------------------------------------------------------------------------------------------


def write_pack(folder: Path, *, split: str = "val", partner: str = "two/b.bvh", path: str = "two/a.bvh") -> None:
    write_pair(folder, "two", walkers(), nested=True)
    columns = "path,partner,source,clip,fps,split,description,metres_per_unit\n"
    rows = [
        f"{path},{partner},cmu,60_01,20,val,salsa dance,1.0",
        f"two/b.bvh,{path},cmu,61_01,20,{split},salsa dance,1.0",
    ]
    (folder / "manifest.csv").write_text(columns + "\n".join(rows) + "\n")


def test_rows_that_name_each_other_are_a_pair_in_the_manifests_split(tmp_path):
    write_pack(tmp_path)
    (pair,) = dp.find_pairs(tmp_path)
    assert (pair.name, pair.split, pair.source) == ("60_01+61_01", "val", "cmu")
    assert "two people dance salsa together" in pair.captions
    np.testing.assert_allclose(mp.distance(pair.positions), mp.distance(walkers()), atol=0.03)


@pytest.mark.parametrize(
    ("change", "sentence"),
    [
        ({"split": "train"}, "no common split"),
        ({"partner": ""}, "no rows that name each other"),
        ({"partner": "two/c.bvh"}, "KeyError"),
        ({"path": "../a.bvh"}, "leads out of"),
    ],
    ids=["splits", "alone", "missing", "escape"],
)
def test_a_manifest_without_proper_pairs_is_refused(tmp_path, change, sentence):
    write_pack(tmp_path, **change)
    with pytest.raises(MotionloomError, match=sentence):
        dp.find_pairs(tmp_path)


def test_the_dancing_couples_of_the_pack_hold_hands_and_do_not_pass_through_each_other(tmp_path):
    pack = shared("data/cmu/two_person").parents[1]
    rows = (pack / "manifest.csv").read_text().splitlines()
    (tmp_path / "cmu").symlink_to(pack / "cmu")
    (tmp_path / "manifest.csv").write_text("\n".join([rows[0], *(r for r in rows if "/12/" in r)]))
    with pytest.raises(MotionloomError, match="leads out of"):  # a link out of the folder is no part of it
        dp.read_pack_pairs(tmp_path)
    (tmp_path / "cmu").unlink()
    shutil.copytree(pack / "cmu/two_person/12", tmp_path / "cmu/two_person/12")
    (pair,) = dp.read_pack_pairs(tmp_path)
    assert (pair.split, pair.frames) == ("test", 559)
    assert 0.5 < np.median(mp.distance(pair.positions)) < 1.0
    assert mp.hand_contact(pair.positions) > 0.3
    assert mp.penetration(pair.positions) < 0.01


# 3DPW ----------------------------------------------------------------------------------------------------------------


def write_sequence(path: Path, positions: np.ndarray, camera: np.ndarray, *, turn: np.ndarray | None = None) -> None:
    """A file as the owners write it: ``positions`` (people, frames, 22, 3), ``camera`` (frames, 3) in their world."""
    turn = np.eye(3) if turn is None else turn
    hands = np.repeat(positions[:, :, -2:], 1, axis=2)
    joints = np.concatenate([positions, hands], axis=2) @ turn.T
    look = np.array([[0.0, 0, 1], [1, 0, 0], [0, 1, 0]])  # any rotation from the world to the camera
    poses = np.tile(np.eye(4), (len(camera), 1, 1))
    poses[:, :3, :3] = look
    poses[:, :3, 3] = -(camera @ turn.T) @ look.T
    people_, frames = joints.shape[:2]
    content = {
        "sequence": path.stem,
        "genders": ["m"] * people_,
        "jointPositions": [person.reshape(frames, 72) for person in joints],
        "poses": [np.zeros((frames, 72)) for _ in range(people_)],
        "cam_poses": poses,
        "campose_valid": [np.ones(frames, dtype=np.uint8) for _ in range(people_)],
    }
    path.parent.mkdir(parents=True, exist_ok=True)
    path.write_bytes(pickle.dumps(content, protocol=2))


def at_30(seconds: float = 4.0) -> np.ndarray:
    a = hml.uniform(people.walking(0.8, seconds, fps=30.0))
    b = hml.uniform(people.walking(0.5, seconds, fps=30.0)) + np.array([1.2, 0.0, 0.4])
    return np.stack([a, b])


Z_UP = np.array([[1.0, 0, 0], [0, 0, -1], [0, 1, 0]])
Y_DOWN = np.diag([1.0, -1.0, -1.0])


@pytest.mark.parametrize("turn", [np.eye(3), Z_UP, Y_DOWN], ids=["y-up", "z-up", "y-down"])
def test_a_3dpw_sequence_comes_upright_at_20_frames_with_its_places(tmp_path, turn):
    world = at_30()
    camera = np.tile([0.0, 1.6, -4.0], (world.shape[1], 1))
    write_sequence(tmp_path / "sequenceFiles/train/dance_00.pkl", world + np.array([0.0, 3.0, 0.0]), camera, turn=turn)
    write_sequence(tmp_path / "sequenceFiles/validation/alone_00.pkl", world[:1], camera, turn=turn)
    (tmp_path / "text/train").mkdir(parents=True)
    (tmp_path / "text/train/dance_00.txt").write_text("two people walk#two/NUM people/NOUN#0.0#0.0\nthey go\n")
    lines: list[str] = []
    (pair,) = threedpw.read_3dpw(tmp_path, say=lines.append)
    assert (pair.name, pair.split, pair.captions) == ("dance_00", "train", ("two people walk", "they go"))
    assert lines == ["left out alone_00.pkl: 1 person"]
    assert pair.frames == 80
    expected = np.stack([hml.resample_positions(person, 30.0) for person in world])
    np.testing.assert_allclose(mp.distance(pair.positions), mp.distance(expected), atol=5e-3)
    np.testing.assert_allclose(np.cos(ph.heading(pair.positions[0])), -1 if turn is Y_DOWN else 1, atol=1e-5)
    assert np.abs(pair.positions[..., 10:12, 1].min(axis=(1, 2))).max() < 0.02
    assert readers.find_pairs(tmp_path)[0].name == "dance_00"


def test_drift_that_the_camera_shares_is_taken_from_both_alike():
    world = at_30()
    drift = np.linspace(0, 1, world.shape[1])[:, None] * np.array([0.6, 0.0, -0.3])
    still = np.tile([0.0, 1.6, -4.0], (world.shape[1], 1))
    people = threedpw.without_drift(world + drift[:, None], still + drift)
    np.testing.assert_allclose(people[:, 15:-15], world[:, 15:-15] + (people - world)[:, :1].mean(), atol=0.12)
    left = (people - world)[:, -20, 0] - (people - world)[:, 20, 0]
    assert np.linalg.norm(left) < 0.25 * np.linalg.norm(drift[-20] - drift[20]) * np.sqrt(2)
    np.testing.assert_allclose(people[1] - people[0], world[1] - world[0], atol=1e-12)


def test_a_camera_that_follows_takes_nothing_from_people_whose_feet_stand():
    world = at_30()
    follow = np.arange(world.shape[1])[:, None] / 30 * np.array([0.0, 0.0, 0.7])
    people = threedpw.without_drift(world, follow)
    assert np.abs(people - world).max() < 0.1 * 0.7 * 4


def test_the_camera_is_where_the_extrinsics_see_the_origin_from():
    place = np.array([1.0, 2.0, -3.0])
    look = np.array([[0.0, 0, 1], [1, 0, 0], [0, 1, 0]])
    poses = np.tile(np.eye(4), (5, 1, 1))
    poses[:, :3, :3], poses[:, :3, 3] = look, -look @ place
    poses[2] = 7.0  # not aligned to the image: between its neighbours
    path = threedpw._camera({"cam_poses": poses, "campose_valid": [np.array([1, 1, 0, 1, 1])]}, 5, Path("x.pkl"))
    assert path is not None
    np.testing.assert_allclose(path, np.tile(place, (5, 1)))


def damaged(content: dict, what: str) -> dict:
    joints = content["jointPositions"]
    return {
        "no-joints": {"poses": content["poses"]},
        "shapes": {**content, "jointPositions": [joints[0], joints[1][:, :66]]},
        "lengths": {**content, "jointPositions": [joints[0], joints[1][:-1]]},
        "nan": {**content, "jointPositions": [joints[0], joints[1] * np.nan]},
        "objects": {**content, "jointPositions": [joints[0], joints[1].astype(object)]},
        "camera": {**content, "cam_poses": content["cam_poses"][:-1]},
        "lying": {**content, "jointPositions": [np.zeros_like(j) for j in joints]},
        "crowd": {**content, "jointPositions": joints * 5},
    }[what]


@pytest.mark.parametrize("what", ["no-joints", "shapes", "lengths", "nan", "objects", "camera", "lying", "crowd"])
def test_a_damaged_sequence_is_refused_by_name(tmp_path, what):
    path = tmp_path / "train/x.pkl"
    write_sequence(path, at_30(1.0), np.zeros((30, 3)))
    path.write_bytes(pickle.dumps(damaged(pickle.loads(path.read_bytes()), what), protocol=2))
    with pytest.raises(MotionloomError, match=r"x\.pkl"):
        threedpw.read_3dpw(tmp_path)


def test_a_sequence_that_would_run_code_is_refused_and_does_not_run(tmp_path):
    mark = tmp_path / "ran"
    (tmp_path / "train").mkdir()
    (tmp_path / "train/x.pkl").write_bytes(b"cposix\nsystem\n(S'touch " + str(mark).encode() + b"'\ntR.")
    with pytest.raises(MotionloomError, match="not a pickle of plain values"):
        threedpw.read_3dpw(tmp_path)
    assert not mark.exists()


def test_folders_without_sequences_or_pairs_are_reported(tmp_path):
    with pytest.raises(MotionloomError, match="sequenceFiles"):
        threedpw.read_3dpw(tmp_path)
    write_sequence(tmp_path / "train/x.pkl", at_30(1.0)[:1], np.zeros((30, 3)))
    with pytest.raises(MotionloomError, match="no sequence with two people"):
        threedpw.read_3dpw(tmp_path)
    with pytest.raises(MotionloomError, match="no split 'dev'"):
        threedpw.read_3dpw(tmp_path, splits=("dev",))
