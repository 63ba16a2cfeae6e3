"""BVH: against forward kinematics by hand, odd but valid spellings, round trips, and what must be refused."""

import itertools
import tracemalloc
from pathlib import Path

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from motionloom import io
from motionloom.core.errors import MotionloomError
from motionloom.core.motion import Motion
from motionloom.core.rotations import rotvec_to_quat
from motionloom.core.skeleton import SMPL22, Skeleton
from motionloom.io.bvh import frame_rate, guess_unit, load_bvh, read_bvh, save_bvh
from tests.io.motions import largest_distance, motions, turns
from tests.shared import shared
from tests.work import work

ARM = """HIERARCHY
ROOT hip
{
  OFFSET 0 9 0
  CHANNELS 6 Xposition Yposition Zposition Zrotation Xrotation Yrotation
  JOINT arm
  {
    OFFSET 1 0 0
    CHANNELS 3 Zrotation Xrotation Yrotation
    End Site
    {
      OFFSET 0.5 0 0
    }
  }
}
MOTION
Frames: 2
Frame Time: 0.0333333
0 0 0 0 0 0 0 0 0
1 2 3 90 0 0 0 0 -90
"""


def write(folder: Path, text: str | bytes) -> Path:
    path = folder / "file.bvh"
    path.write_bytes(text if isinstance(text, bytes) else text.encode())
    return path


def test_a_small_file_gives_the_places_found_by_hand(tmp_path):
    motion = load_bvh(write(tmp_path, ARM), unit=1)
    assert motion.skeleton.names == ("hip", "arm", "arm End Site")
    assert motion.skeleton.ends == {2}
    assert motion.fps == 30
    by_hand = [[(0, 0, 0), (1, 0, 0), (1.5, 0, 0)], [(1, 2, 3), (1, 3, 3), (1, 3, 3.5)]]
    np.testing.assert_allclose(motion.positions(), by_hand, atol=1e-12)
    np.testing.assert_array_equal(motion.skeleton.offsets[0], (0, 9, 0))


@given(
    order=st.permutations("XYZ"),
    places=st.permutations("XYZ"),
    angles=st.lists(st.floats(-400, 400), min_size=6, max_size=6),
    rotation_first=st.booleans(),
)
def test_any_order_of_channels_means_the_product_of_turns_as_listed(
    tmp_path_factory, order, places, angles, rotation_first
):
    turning, placing = [f"{a}rotation" for a in order], [f"{a}position" for a in places]
    both = turning + placing if rotation_first else placing + turning
    where = {"X": "1.5", "Y": "-2", "Z": "0.25"}
    values = [where[c[0]] if c.endswith("position") else str(angles[turning.index(c)]) for c in both]
    text = ARM.replace("Xposition Yposition Zposition Zrotation Xrotation Yrotation", " ".join(both))
    text = text.replace("CHANNELS 3 Zrotation Xrotation Yrotation", "CHANNELS 3 " + " ".join(turning))
    rows = " ".join(values + [str(a) for a in angles[3:]])
    text = text.replace("Frames: 2", "Frames: 1").partition("0.0333333\n")[0] + "0.0333333\n" + rows
    motion = load_bvh(write(tmp_path_factory.mktemp("bvh"), text), unit=1)
    hip, arm = turns("".join(order), angles[:3]), turns("".join(order), angles[3:])
    place = np.array([1.5, -2, 0.25])
    expected = [place, place + hip @ [1, 0, 0], place + hip @ [1, 0, 0] + hip @ arm @ [0.5, 0, 0]]
    np.testing.assert_allclose(motion.positions()[0], expected, atol=1e-9)


@pytest.mark.parametrize(
    "change",
    [
        lambda s: s.replace("\n", "\r\n"),
        lambda s: s.replace("\n", "\r"),
        lambda s: s.replace("  ", "\t").replace(" ", "\t").replace("End\tSite", "End Site"),
        lambda s: s.rstrip("\n"),
        lambda s: "\ufeff" + s,
        lambda s: s + "\n \n\t\n",
        lambda s: s.replace("Frame Time: ", "Frame Time:\t"),
        lambda s: s.replace("Frame Time: ", "FrameTime:").replace("Frames: ", "Frames:"),
        lambda s: s.replace("Frame Time: 0.0333333", "frame time : 3.33333E-02"),
        lambda s: s.replace("Frames: 2\n", "\nFRAMES:   2  \n\n"),
        lambda s: s.replace("MOTION", "  Motion  "),
        lambda s: s.replace("End Site", "End site"),
        lambda s: s.replace("End Site", "End Site tip of arm"),
        lambda s: s.replace("{", " { ").replace("}\n", "} "),
        lambda s: s.partition("MOTION")[0].replace("\n", " ") + "\nMOTION" + s.partition("MOTION")[2],
        lambda s: s.replace("1 2 3 90 0 0 0 0 -90", "1e0 +2.0 30.E-1 9.0e+01 -0 0.0\n0 .0 -90."),
        lambda s: s.replace("Xposition", "XPOSITION").replace("Zrotation", "zrotation"),
        lambda s: s.replace("OFFSET 1 0 0", "OFFSET\n1\n0 0"),
    ],
)
def test_odd_but_valid_spellings_read_the_same(tmp_path, change):
    plain = load_bvh(write(tmp_path, ARM), unit=1)
    odd = load_bvh(write(tmp_path, change(ARM)), unit=1)
    assert odd.skeleton == plain.skeleton
    assert odd.fps == plain.fps
    np.testing.assert_allclose(odd.positions(), plain.positions(), atol=1e-12)


def test_names_that_braces_tell_apart_stay_unique(tmp_path):
    """Braces become brackets; a second joint of such a name gets its number, as often as that is another joint's."""
    skeleton = Skeleton(("hips", "a(_3", "a{", "a("), (-1, 0, 0, 0), np.eye(4)[:, :3])
    motion = Motion(skeleton, 30.0, np.zeros((2, 3)), np.tile([1.0, 0.0, 0.0, 0.0], (2, 4, 1)))
    names = load_bvh(save_bvh(motion, tmp_path / "a.bvh"), unit=1.0).skeleton.names
    assert names == ("hips", "a(_3", "a(", "a(_3_3")


@pytest.mark.parametrize(
    "name", ["mixamorig:Hips", "Left Arm", "Bip01 L Thigh", "a.b-c_d", "Hüfte", "腰", "ROOT", "End"]
)
def test_names_with_spaces_colons_and_other_letters_survive(tmp_path, name):
    motion = load_bvh(write(tmp_path, ARM.replace("JOINT arm", f"JOINT {name}")), unit=1)
    assert motion.skeleton.names[1] == name
    assert load_bvh(save_bvh(motion, tmp_path / "again.bvh"), unit=1).skeleton.names[1] == name


def test_position_channels_replace_the_offset_and_usual_ones_become_it(tmp_path):
    six = "CHANNELS 6 Xposition Yposition Zposition Zrotation Xrotation Yrotation"
    text = ARM.replace("CHANNELS 3 Zrotation Xrotation Yrotation", six)
    rows = "0 0 0 0 0 0 {} 5 6 0 0 0\n0 0 0 0 0 0 4 5 6 0 0 0\n"
    still = load_bvh(write(tmp_path, text.partition("0.0333333\n")[0] + "0.0333333\n" + rows.format(4)), unit=1)
    assert still.translations is None
    np.testing.assert_array_equal(still.skeleton.offsets[1], (4, 5, 6))
    moves = load_bvh(write(tmp_path, text.partition("0.0333333\n")[0] + "0.0333333\n" + rows.format(3)), unit=1)
    np.testing.assert_allclose(moves.positions()[:, 1], [(3, 5, 6), (4, 5, 6)])
    np.testing.assert_array_equal(moves.skeleton.offsets[1], (3.5, 5, 6))


def test_a_long_file_is_read_in_pieces_that_need_not_end_with_a_row(tmp_path, monkeypatch):
    """In some three times its size, the motion itself included; and the same as in one piece."""
    turning = Motion(
        SMPL22, 30.0, np.zeros((3000, 3)), rotvec_to_quat(0.3 * np.sin(np.arange(3000 * 66.0)).reshape(3000, 22, 3))
    )
    path = save_bvh(turning, tmp_path / "long.bvh")
    whole = load_bvh(path, unit=1)
    monkeypatch.setattr("motionloom.core.files.text._CHUNK", 50_000)
    tracemalloc.start()
    pieces = load_bvh(path, unit=1)
    _, peak = tracemalloc.get_traced_memory()
    tracemalloc.stop()
    assert peak < 3.5 * path.stat().st_size
    np.testing.assert_array_equal(pieces.rotations, whole.rotations)
    head, _, rows = path.read_text().partition("Frame Time: 0.03333333\n")
    path.write_text(head + "Frame Time: 0.03333333\n" + rows.replace(" ", "\n", 70_000))
    np.testing.assert_array_equal(load_bvh(path, unit=1).rotations, whole.rotations)


def test_position_channels_that_are_zero_throughout_leave_the_offset(tmp_path):
    """As MakeHuman writes them: the joints of a file whose bones had no length otherwise."""
    six = "CHANNELS 6 Xposition Yposition Zposition Zrotation Xrotation Yrotation"
    text = ARM.replace("CHANNELS 3 Zrotation Xrotation Yrotation", six).partition("0.0333333\n")[0]
    still = load_bvh(write(tmp_path, text + "0.0333333\n" + "0 0 0 0 0 0 0 0 0 0 0 0\n" * 2), unit=1)
    np.testing.assert_array_equal(still.positions()[:, 1], [(1, 0, 0)] * 2)
    assert still.translations is None
    root = load_bvh(write(tmp_path, ARM.replace("1 2 3 90", "0 0 0 90")), unit=1)
    np.testing.assert_array_equal(root.root, np.zeros((2, 3)))


def test_some_channels_only_leave_the_rest_at_offset_and_zero(tmp_path):
    text = ARM.replace("CHANNELS 3 Zrotation Xrotation Yrotation", "CHANNELS 2 Yposition Zrotation")
    text = text.replace("0 0 0 0 0 0 0 0 0\n1 2 3 90 0 0 0 0 -90", "0 0 0 0 0 0 7 0\n0 0 0 0 0 0 7 90")
    motion = load_bvh(write(tmp_path, text), unit=1)
    np.testing.assert_allclose(motion.positions()[1], [(0, 0, 0), (1, 7, 0), (1, 7.5, 0)], atol=1e-12)


def test_an_end_site_at_no_distance_is_left_out(tmp_path):
    motion = load_bvh(write(tmp_path, ARM.replace("0.5 0 0", "0 0 0")), unit=1)
    assert motion.skeleton.names == ("hip", "arm")
    assert not motion.skeleton.ends


@pytest.mark.parametrize(
    ("seconds", "fps"),
    [
        ("0.0333333", 30),
        ("0.033333", 30),
        ("0.03333", 30),
        ("0.033", 30),
        ("0.0083333", 120),
        ("0.008333", 120),
        ("0.01667", 60),
        ("0.0166", 60),
        ("0.0417", 24),
        ("0.04", 25),
        ("0.05", 20),
        ("1", 1),
        ("0.01", 100),
        ("3.33333e-02", 30),
        ("0.033366700", 29.97),
        ("0.0333667", 30000 / 1001),
        ("0.041708", 24000 / 1001),
        ("0.03e" + "0" * 5000, 1 / 0.03),
        ("3.33333e-" + "0" * 5000 + "2", 30),
        ("0." + "0" * 9000 + "5e9000", 2),
        ("1e" + "9" * 5000, None),
        ("1e-" + "9" * 5000, None),
        ("0.5", 2),
        ("0.03", 1 / 0.03),
        ("0.0123", 1 / 0.0123),
        ("0.002", 500),
        ("2.5", 0.4),
        ("0", None),
        ("-0.03", None),
        ("nan", None),
        ("inf", None),
        ("1e-9", None),
        ("", None),
        ("0,0333", None),
    ],
)
def test_the_frame_time_as_printed_gives_the_rate_that_was_meant(seconds, fps):
    assert frame_rate(seconds) == (fps if fps is None else pytest.approx(fps, rel=1e-6))


@pytest.mark.parametrize(("unit", "size"), [*itertools.product([1.0, 0.01, 0.001, 0.0254], [0.75, 1.0, 1.2])])
def test_the_unit_of_a_person_between_children_and_giants_is_guessed(unit, size):
    assert guess_unit(SMPL22.parents, SMPL22.offsets * size / unit) == unit


def test_a_reference_joint_far_from_the_body_says_nothing_about_the_unit():
    parents = (-1, *(parent + 1 for parent in SMPL22.parents))
    offsets = np.concatenate([np.zeros((1, 3)), SMPL22.offsets * 100])
    offsets[1] = 0.8, 94, -452
    assert guess_unit(parents, offsets) == 0.01


@settings(deadline=None, max_examples=60)
@given(
    motion=motions(), order=st.permutations("XYZ").map("".join), unit=st.sampled_from([1.0, 0.01, 0.0254, 0.0564444])
)
def test_random_motions_survive_a_round_trip(tmp_path_factory, motion, order, unit):
    path = tmp_path_factory.mktemp("bvh") / "a.bvh"
    save_bvh(motion, path, order=order, unit=unit)
    again = load_bvh(path, unit=unit)
    tips = _end_names(motion.skeleton, again.skeleton)
    assert largest_distance(motion, again, tips) < 1e-4
    assert again.fps == pytest.approx(motion.fps, rel=1e-6)
    assert len(again) == len(motion)


def _end_names(skeleton: Skeleton, again: Skeleton) -> dict[str, str]:
    """How the ends of a skeleton are called after a round trip: they lose their names."""
    renamed = {}
    for parent in range(len(skeleton)):
        mine = [j for j in skeleton.children(parent) if j in skeleton.ends and skeleton.names[j] not in again.names]
        theirs = [n for n in again.names if n.startswith(f"{skeleton.names[parent]} End Site")]
        theirs = [n for n in theirs if again.names[again.parents[again.index(n)]] == skeleton.names[parent]]
        renamed |= {skeleton.names[a]: b for a, b in zip(mine, theirs)}
    return renamed


def test_a_motion_in_our_own_skeleton_comes_back_with_its_names(tmp_path, random_motion):
    again = io.load(io.save(random_motion, tmp_path / "a.bvh"))
    assert set(again.skeleton.names) == set(SMPL22.names)
    assert largest_distance(random_motion, again) < 1e-4


@pytest.fixture
def random_motion() -> Motion:
    random = np.random.default_rng(1)
    wander = rotvec_to_quat(np.cumsum(random.normal(0, 0.05, (40, 22, 3)), axis=0))
    return Motion(SMPL22, 30, np.cumsum(random.normal(0, 0.02, (40, 3)), axis=0), wander)


def test_order_and_unit_come_back_from_the_file(tmp_path, random_motion):
    orders = {"left_knee": "XYZ", "head": "YXZ"}
    file = read_bvh(save_bvh(random_motion, tmp_path / "a.bvh", order=orders, unit=0.01))
    assert file.unit == 0.01
    assert {n: o for n, o in file.orders.items() if o != "ZXY"} == orders
    save_bvh(file.motion, tmp_path / "b.bvh", order=file.orders, unit=file.unit)
    assert (tmp_path / "a.bvh").read_text() == (tmp_path / "b.bvh").read_text()


def test_angles_written_do_not_jump_while_a_joint_spins(tmp_path):
    for axis in np.eye(3):
        spin = rotvec_to_quat(axis * np.radians(np.arange(0, 1080, 10))[:, None])[:, None]
        motion = Motion(Skeleton(("a",), (-1,), np.zeros((1, 3))), 30, np.zeros((len(spin), 3)), spin)
        text = save_bvh(motion, tmp_path / "a.bvh").read_text()
        angles = np.array([line.split() for line in text.splitlines()[-len(spin) :]], dtype=float)[:, 3:]
        assert np.abs(np.diff(angles, axis=0)).max() < 11


@pytest.mark.parametrize(
    ("old", "new", "message"),
    [
        ("HIERARCHY", "HELLO", "does not begin with HIERARCHY"),
        ("MOTION", "NOTION", "has no MOTION"),
        ("Frames: 2", "Frames: 3", "says 3 frames but holds 2"),
        ("Frames: 2", "Frames: 0", "line 17: Frames must be a whole number above 0"),
        ("Frames: 2", "Frames: -5", "Frames must be"),
        ("Frames: 2", "Frames: 99999999999999999999", "Frames must be"),
        ("Frame Time: 0.0333333", "Frame Time: 0", "Frame Time must be a number"),
        ("Frame Time: 0.0333333", "", "MOTION must be followed by"),
        ("1 2 3 90", "1 nan 3 90", "line 20: 'nan' is not a finite number"),
        ("1 2 3 90", "1 inf 3 90", "line 20: 'inf'"),
        ("1 2 3 90", "1 2,5 3 90", "line 20: '2,5'"),
        ("1 2 3 90", "1 1e300 3 90", "line 20: '1e300'"),
        ("1 2 3 90", "2 3 90", "line 20: 8 numbers where the hierarchy has 9 channels"),
        ("-90\n", "-90 1\n", "line 20: 10 numbers"),
        ("OFFSET 1 0 0", "OFFSET 1 0", "line 9: OFFSET needs 3 finite numbers"),
        ("OFFSET 1 0 0", "OFFSET 1 nan 0", "line 8: OFFSET needs 3 finite numbers"),
        ("    OFFSET 1 0 0\n", "", "'arm' has no OFFSET"),
        ("CHANNELS 3 Z", "CHANNELS 9 Z", "a count from 0 to 6"),
        ("CHANNELS 3 Zrotation", "CHANNELS 3 Wrotation", "line 9: 'Wrotation' is not a channel"),
        ("CHANNELS 3 Zrotation", "CHANNELS 3 Yrotation", "the same channel twice"),
        ("JOINT arm", "JOINT hip", "line 6: a second joint is called 'hip'"),
        ("JOINT arm", "JOINT", "JOINT without a name"),
        ("JOINT arm", "ROOT arm", "ROOT must stand outside"),
        ("MOTION", "ROOT b\n{\nOFFSET 0 0 0\nCHANNELS 0\n}\nMOTION", "a second ROOT"),
        ("}\nMOTION", "MOTION", "never closed"),
        ("}\nMOTION", "}\n}\nMOTION", "without a '{' before it"),
        ("OFFSET 0.5 0 0", "JOINT b { OFFSET 0 0 0 }", "an End Site cannot hold joints"),
        ("OFFSET 0.5 0 0", "OFFSET 1 0 0 CHANNELS 1 Xrotation", "cannot have these CHANNELS"),
        ("OFFSET 1 0 0", "OFFSETS 1 0 0", "line 8: 'OFFSETS' is not expected here"),
    ],
)
def test_a_fault_is_named_in_one_sentence_with_its_line(tmp_path, old, new, message):
    assert old in ARM
    with pytest.raises(MotionloomError) as caught:
        load_bvh(write(tmp_path, ARM.replace(old, new, 1)))
    assert message in str(caught.value)
    assert "file.bvh" in str(caught.value)
    assert "\n" not in str(caught.value)


def test_a_wrong_order_or_unit_is_refused(tmp_path, random_motion):
    for wrong in ("XYX", "AB", ""):
        with pytest.raises(MotionloomError, match="order of rotations"):
            save_bvh(random_motion, tmp_path / "a.bvh", order=wrong)
    with pytest.raises(MotionloomError, match="unit"):
        save_bvh(random_motion, tmp_path / "a.bvh", unit=0)
    assert not list(tmp_path.iterdir())


def test_ten_minutes_of_24_joints_are_a_line_of_work_for_each_line_of_the_file(tmp_path):
    """Written with less than two steps for a frame, read without any."""
    names = tuple(f"joint{j}" for j in range(24))
    skeleton = Skeleton(names, (-1, *range(23)), np.full((24, 3), 0.1))
    random = np.random.default_rng(0)
    swing = rotvec_to_quat(np.cumsum(random.normal(0, 0.02, (18_000, 24, 3)), axis=0))
    motion = Motion(skeleton, 30, np.cumsum(random.normal(0, 0.01, (18_000, 3)), axis=0), swing)
    short = Motion(skeleton, 30, motion.root[:100], motion.rotations[:100])
    save_bvh(short, tmp_path / "b.bvh")  # what is imported and compiled once does not count
    load_bvh(tmp_path / "b.bvh", unit=1)
    written = work(lambda: save_bvh(short, tmp_path / "b.bvh"))
    read = work(lambda: load_bvh(tmp_path / "b.bvh", unit=1))
    assert work(lambda: save_bvh(motion, tmp_path / "a.bvh")) - written < 2 * (18_000 - 100)
    assert work(lambda: load_bvh(tmp_path / "a.bvh", unit=1)) < 1.1 * read
    np.testing.assert_allclose(load_bvh(tmp_path / "a.bvh", unit=1).root, motion.root, atol=1e-4)


@pytest.mark.parametrize(
    ("path", "family", "joints"),
    [
        ("data/cmu/bvh/06_06.bvh", "Daz (CMU as BVH)", 57),
        ("data/bandai/dataset-1/dataset-1_walk_angry_001.bvh", "Bandai Namco", 22),
    ],
)
def test_clips_of_the_pack_are_read_in_metres_and_survive_a_round_trip(tmp_path, path, family, joints):
    from motionloom.io.info import describe

    file = read_bvh(shared(path))
    info = describe(file.motion)
    assert (info.skeleton, info.joints, info.fps, file.unit) == (family, joints, 30, 0.01)
    assert 1.2 < info.height < 1.8
    assert abs(info.floor) < 0.1
    assert not info.problems
    again = load_bvh(save_bvh(file.motion, tmp_path / "a.bvh", order=file.orders, unit=file.unit))
    assert again.skeleton.names == file.motion.skeleton.names
    assert largest_distance(file.motion, again) < 1e-6


def test_a_long_block_read_in_pieces_is_the_same_and_faults_keep_their_lines(tmp_path, monkeypatch):
    rows = [f"{i} {i / 7:.6f} -{i}e-2 0 0 0 0 0 {i % 360}" for i in range(500)]
    text = ARM.partition("0 0 0 0 0 0 0 0 0")[0].replace("Frames: 2", "Frames: 500")
    whole = load_bvh(write(tmp_path, text + "\n".join(rows)), unit=1)
    monkeypatch.setattr("motionloom.core.files.text._CHUNK", 100)
    pieces = load_bvh(write(tmp_path, text + "\n".join(rows)), unit=1)
    np.testing.assert_array_equal(pieces.root[:, 0], np.arange(500))
    np.testing.assert_array_equal(pieces.rotations, whole.rotations)
    rows[321] = rows[321].replace("e-2", "e-2?")
    with pytest.raises(MotionloomError, match=r"line 340: '-321e-2\?' is not"):
        load_bvh(write(tmp_path, text + "\n".join(rows)), unit=1)
