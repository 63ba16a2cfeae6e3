"""ASF and AMC: against the published formulas written a second time, and what must be refused."""

import re
from pathlib import Path

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from motionloom import io
from motionloom.core.errors import MotionloomError
from motionloom.io.asf import find_asf, load_asf_amc, load_skeleton
from tests.io.motions import turns
from tests.shared import shared

ASF = """# made by hand
:version 1.10
:name TEST
:units
  mass 1.0
  length 0.45
  angle deg
:documentation
  words: with colons
:root
   order TX TY TZ RX RY RZ
   axis XYZ
   position 0 0 0
   orientation 0 0 0
:bonedata
  begin
     id 1
     name hip
     direction 1 0 0
     length 2
     axis 0 0 0 XYZ
  end
  begin
     id 2
     name thigh
     direction 0 -1 0
     length 6
     axis 10 20 30 XYZ
    dof rx ry rz
    limits (-160.0 20.0)
           (-70.0 70.0)
           (-60.0 70.0)
  end
  begin
     id 3
     name shin
     direction 0 -1 0
     length 7
     axis -5 0 20 XYZ
    dof rx
  end
  begin
     id 4
     name back
     direction 0 1 0.1
     length 3
     axis 0 0 0 XYZ
    dof rx rz
  end
:hierarchy
  begin
    root hip back
    hip thigh
    thigh shin
  end
"""
AMC = """#!OML:ASF made by hand
:FULLY-SPECIFIED
:DEGREES
1
root 1 2 3 10 20 30
thigh 5 -10 15
shin 40
back 7 8
2
root 1.5 2 3 -10 2e1 .5
back 0 0
thigh 0 0 0
shin -4e-1
"""


def write(folder: Path, asf: str = ASF, amc: str = AMC) -> tuple[Path, Path]:
    (folder / "a.asf").write_text(asf)
    (folder / "a.amc").write_text(amc)
    return folder / "a.asf", folder / "a.amc"


def naive(asf: str, amc: str, frame: int) -> dict[str, np.ndarray]:
    """Ends of all bones in metres: R(b) = R(p) C M C^-1, end(b) = end(p) + R(b) direction length."""

    def field(block: str, key: str) -> list[str]:
        found = re.search(rf"^\s*{key}\s+(.*)$", block, re.MULTILINE)
        return found[1].split() if found else []

    blocks = {field(b, "name")[0]: b for b in re.findall(r"begin\s+id.*?end", asf, re.DOTALL)}
    above = {}
    for line in asf[asf.index(":hierarchy") :].splitlines()[2:]:
        above |= {child: line.split()[0] for child in line.split()[1:]}
    body = re.split(r"^\d+\s*$", amc, flags=re.MULTILINE)[frame + 1]
    given = {line.split()[0]: [float(v) for v in line.split()[1:]] for line in body.strip().splitlines()}
    turned, ends = {"root": turns("ZYX", given["root"][:2:-1])}, {"root": np.array(given["root"][:3])}

    def place(bone: str) -> None:
        if bone in ends:
            return
        place(above[bone])
        angles = dict(zip(field(blocks[bone], "dof"), given.get(bone, [])))
        axis = turns("ZYX", [float(v) for v in field(blocks[bone], "axis")[2::-1]])
        own = turns("ZYX", [angles.get(d, 0.0) for d in ("rz", "ry", "rx")])
        turned[bone] = turned[above[bone]] @ axis @ own @ np.linalg.inv(axis)
        along = np.array(field(blocks[bone], "direction"), dtype=float) * float(field(blocks[bone], "length")[0])
        ends[bone] = ends[above[bone]] + turned[bone] @ along

    for bone in blocks:
        place(bone)
    return {bone: end * 0.0254 / 0.45 for bone, end in ends.items()}


@pytest.mark.parametrize("frame", [0, 1])
def test_bone_ends_are_where_the_formulas_put_them(tmp_path, frame):
    motion = load_asf_amc(*write(tmp_path), fps=30)
    places = motion.positions()[frame]
    for bone, end in naive(ASF, AMC, frame).items():
        np.testing.assert_allclose(places[motion.skeleton.index(bone)], end, atol=1e-9)


@settings(deadline=None, max_examples=50)
@given(
    angles=st.lists(st.floats(-180, 180), min_size=12, max_size=12),
    parents=st.lists(st.integers(0, 3), min_size=4, max_size=4),
    random=st.integers(0, 2**32 - 1),
)
def test_any_tree_and_any_angles_agree_with_the_formulas(tmp_path_factory, angles, parents, random):
    numbers = np.random.default_rng(random).uniform(-1, 1, (4, 6)).round(4)
    bones = ["a", "b", "c", "d"]
    dofs = ["rx ry rz", "", "ry rz", "rx"]
    blocks, rows, children = "", "", {"root": [], "a": [], "b": [], "c": [], "d": []}
    for i, bone in enumerate(bones):
        x = numbers[i]
        dof = f"dof {dofs[i]}\n" if dofs[i] else ""
        blocks += f"begin\nid {i}\nname {bone}\ndirection {x[0]} {x[1]} {x[2]}\nlength 3\n"
        blocks += f"axis {x[3] * 90} {x[4] * 90} {x[5] * 90} XYZ\n{dof}end\n"
        children[["root", "a", "b", "c"][min(parents[i], i)]].append(bone)
        own = angles[3 * i : 3 * i + len(dofs[i].split())]
        rows += f"{bone} {' '.join(map(str, own))}\n" if own else ""
    tree = "".join(f"{p} {' '.join(c)}\n" for p, c in children.items() if c)
    head = ASF[: ASF.index(":bonedata")]
    asf = f"{head}:bonedata\n{blocks}:hierarchy\nbegin\n{tree}end\n"
    amc = f":FULLY-SPECIFIED\n:DEGREES\n7\nroot 0 1 2 {angles[9]} {angles[10]} {angles[11]}\n{rows}"
    motion = load_asf_amc(*write(tmp_path_factory.mktemp("asf"), asf, amc))
    for bone, end in naive(asf, amc, 0).items():
        np.testing.assert_allclose(motion.positions()[0, motion.skeleton.index(bone)], end, atol=1e-6)


def test_the_rest_pose_is_that_of_the_skeleton_file(tmp_path):
    skeleton = load_skeleton(write(tmp_path)[0])
    rest = dict(zip(skeleton.names, skeleton.rest_positions()))
    np.testing.assert_allclose(rest["shin"], np.array([2, -13, 0]) * 0.0254 / 0.45)
    assert load_asf_amc(*write(tmp_path)).skeleton == skeleton


def test_rate_and_unit_are_120_and_the_files_own_unless_told(tmp_path):
    asf, amc = write(tmp_path)
    motion = io.load(amc)
    assert motion.fps == 120
    np.testing.assert_allclose(motion.root[0], np.array([1, 2, 3]) * 0.0254 / 0.45)
    told = io.load(amc, asf=asf, fps=30, unit=2)
    assert told.fps == 30
    np.testing.assert_allclose(told.root[0], (2, 4, 6))


@pytest.mark.parametrize(
    ("asf", "amc"),
    [
        (ASF.replace("\n", "\r\n"), AMC.replace("\n", "\r\n")),
        (ASF.replace("     ", "\t"), AMC.replace(" ", "\t")),
        (ASF.rstrip(), AMC.rstrip()),
        (ASF.replace(":units", ":UNITS").replace("dof rx", "dof RX"), "\n" + AMC + "\n\n"),
        (ASF, AMC.replace("\n2\n", "\n5\n").replace("\n1\n", "\n4\n")),
    ],
)
def test_odd_but_valid_spellings_read_the_same(tmp_path, asf, amc):
    plain = load_asf_amc(*write(tmp_path))
    odd = load_asf_amc(*write(tmp_path, asf, amc))
    np.testing.assert_array_equal(odd.positions(), plain.positions())


def test_radians_are_radians(tmp_path):
    rows = AMC.partition("\n2\n")[0]
    in_radians = rows.replace(":DEGREES", ":RADIANS")
    for name, values in (("thigh", "5 -10 15"), ("shin", "40"), ("back", "7 8")):
        turned = " ".join(repr(np.radians(float(v)).item()) for v in values.split())
        in_radians = in_radians.replace(f"{name} {values}", f"{name} {turned}")
    in_radians = in_radians.replace("10 20 30", " ".join(repr(np.radians(v).item()) for v in (10, 20, 30)))
    degrees, radians = load_asf_amc(*write(tmp_path, ASF, rows)), load_asf_amc(*write(tmp_path, ASF, in_radians))
    np.testing.assert_allclose(degrees.positions(), radians.positions(), atol=1e-12)


def test_the_skeleton_beside_a_motion_is_found(tmp_path):
    amc = tmp_path / "39_01.amc"
    with pytest.raises(MotionloomError, match="there: none"):
        find_asf(amc)
    (tmp_path / "other.ASF").touch()
    assert find_asf(amc).name == "other.ASF"
    (tmp_path / "39.asf").touch()
    assert find_asf(amc).name == "39.asf"
    (tmp_path / "39_01.asf").touch()
    assert find_asf(amc).name == "39_01.asf"
    with pytest.raises(MotionloomError, match="name it with --asf"):
        find_asf(tmp_path / "40_01.amc")


@pytest.mark.parametrize(
    ("old", "new", "message"),
    [
        (":bonedata", ":bones", "no :bonedata section"),
        ("length 0.45", "length 0", "line 6: the unit of length must be above 0"),
        ("length 0.45", "length nan", "line 6: length needs 1 finite"),
        ("direction 1 0 0", "direction 1 0", "line 19: direction needs 3 finite"),
        ("direction 1 0 0", "direction 1 0 inf", "line 19: direction needs 3 finite"),
        ("     length 2\n", "", "the bone that ends here has no length"),
        ("axis 10 20 30 XYZ", "axis 10 20 30 XYX", "an axis order such as XYZ is needed"),
        ("dof rx ry rz", "dof rx ry tx", "a bone may turn by rx, ry and rz"),
        ("dof rx ry rz", "dof rx rx", "a bone may turn by"),
        ("order TX TY TZ", "order TX TX TZ", "the root's order"),
        ("name shin", "name thigh", "the bone 'thigh' appears twice"),
        ("name shin", "name root", "the bone 'root' appears twice"),
        ("    thigh shin", "    thigh foot", "line 54: no bone is called 'foot'"),
        ("    thigh shin\n", "", "'shin' does not hang on the root"),
        ("root hip back\n    hip thigh", "root back\n    shin hip\n    hip thigh", "does not hang on the root"),
        ("    thigh shin", "    thigh shin\n    back shin", "cannot hang on a second bone"),
        ("    thigh shin", "    thigh shin\n    shin root", "cannot hang on a second bone"),
        ("  end\n  begin\n     id 2", "  begin\n     id 2", "'begin' before the bone above has its 'end'"),
    ],
)
def test_a_faulty_skeleton_is_named_in_one_sentence(tmp_path, old, new, message):
    assert old in ASF
    with pytest.raises(MotionloomError) as caught:
        load_asf_amc(*write(tmp_path, ASF.replace(old, new, 1)))
    assert message in str(caught.value)
    assert "a.asf" in str(caught.value)
    assert "\n" not in str(caught.value)


@pytest.mark.parametrize(
    ("old", "new", "message"),
    [
        ("shin 40", "shin 40 1", "line 7: 'shin' with 2 numbers has 1 in the ASF file"),
        ("shin 40", "shin", "line 7: 'shin' with 0 numbers"),
        ("shin 40", "foot 40", "line 7: 'foot' with 1 numbers is no turning bone"),
        ("shin 40", "shin nan", "line 7: 'nan' is not a finite number"),
        ("shin -4e-1", "shin -4e-1x", "'-4e-1x' is not a finite number"),
        ("shin 40", "thigh 1 2 3", "'thigh' appears twice in one frame"),
        ("shin -4e-1\n", "", "frame 2 lacks 'shin'"),
        ("shin 40\n", "", "frame 2 adds 'shin'"),
        ("\n2\n", "\n2\n3\n", "frame 2 is empty"),
        ("\n2\n", "\n0\n", "frame 1 is followed by frame 0"),
        ("\n1\n", "\n", "before the first frame number"),
        (AMC[AMC.index("\n1\n") :], "\n", "has no frames"),
    ],
)
def test_a_faulty_motion_is_named_in_one_sentence(tmp_path, old, new, message):
    assert old in AMC
    with pytest.raises(MotionloomError) as caught:
        load_asf_amc(*write(tmp_path, ASF, AMC.replace(old, new, 1)))
    assert message in str(caught.value)
    assert "a.amc" in str(caught.value)
    assert "\n" not in str(caught.value)


def test_frames_missing_in_the_middle_are_noticed(tmp_path):
    frames = "".join(f"{n}\nroot 0 0 0 0 0 0\nthigh 0 0 0\nshin 0\nback 0 0\n" for n in (1, 2, 3, 5, 6))
    with pytest.raises(MotionloomError, match="frame 3 is followed by frame 5"):
        load_asf_amc(*write(tmp_path, ASF, frames))


def test_two_files_that_do_not_belong_together_are_told_apart(tmp_path):
    asf, amc = write(tmp_path)
    with pytest.raises(MotionloomError, match=r"is not an ASF file|no :root"):
        load_asf_amc(amc, amc)
    with pytest.raises(MotionloomError, match="is this an AMC file"):
        load_asf_amc(asf, asf)


@pytest.mark.parametrize("clip", ["39/39_01", "01/01_01", "16/16_52"])
def test_clips_of_the_pack_agree_with_the_formulas(clip):
    amc = shared(f"data/cmu/asf_amc/{clip}.amc")
    asf = find_asf(amc)
    motion = load_asf_amc(asf, amc, fps=30)
    for frame in (0, len(motion) // 2, len(motion) - 1):
        places = motion.positions()[frame]
        for bone, end in naive(asf.read_text(), amc.read_text(), frame).items():
            np.testing.assert_allclose(places[motion.skeleton.index(bone)], end, atol=1e-6)
