"""ComMDM's processed 3DPW folder, made of people whose places are known."""

from pathlib import Path

import numpy as np
import pytest

from motionloom.core.errors import MotionloomError
from motionloom.core.features.pair import encode
from motionloom_lab.papers import readers, threedpw
from tests_lab.data.test_pairs import walkers


def nine(pose: np.ndarray) -> np.ndarray:
    """A ground pose as the published file has it: rows of the rotation from the world to the person, a translation."""
    c, s, x, z = pose
    return np.array([c, 0, -s, 0, 1, 0, x, 0, z])


def write(
    folder: Path, name: str = "courtyard", split: str = "train", *, words: str = "they walk#they/a#0#0\n"
) -> Path:
    features, poses = encode(walkers(), heading="compatible")
    for part in ("new_joint_vecs", "canon_data", "text"):
        (folder / part / split).mkdir(parents=True, exist_ok=True)
    for person, end in enumerate(("_p0", "_p1")):
        np.save(folder / "new_joint_vecs" / split / f"{name}{end}.npy", features[person].astype(np.float32))
        np.save(folder / "new_joint_vecs" / split / f"{name}{end}_M.npy", features[person].astype(np.float32))
        np.save(folder / "canon_data" / split / f"{name}{end}.npy", nine(poses[person]))
    (folder / "text" / split / f"{name}_p0.txt").write_text("they walk#they/a#0#0\n")
    return folder


def test_both_people_are_where_they_were_and_mirrored_copies_are_left_out(tmp_path: Path) -> None:
    write(write(tmp_path), "arguing", "validation")
    first, second = readers.find_pairs(tmp_path)
    assert (first.name, first.split, first.captions) == ("courtyard", "train", ("they walk",))
    assert (second.name, second.split) == ("arguing", "val")
    real = walkers()[:, : first.frames]
    apart = first.positions[1, :, 0] - first.positions[0, :, 0]
    expected = real[1, :, 0] - real[0, :, 0]
    np.testing.assert_allclose(apart[:, [0, 2]], expected[:, [0, 2]], atol=0.05)
    assert np.abs(first.positions - real)[..., [0, 2]].max() < 0.1


@pytest.mark.parametrize("part", ["new_joint_vecs", "canon_data"])
@pytest.mark.parametrize(
    "array",
    [None, np.zeros((4, 7)), np.full((40, 263), np.nan), np.zeros((40, 263), "U3")],
    ids=["missing", "shape", "nan", "words"],
)
def test_a_file_that_lacks_or_is_of_another_form_is_named(tmp_path: Path, part: str, array: np.ndarray | None) -> None:
    path = write(tmp_path) / part / "train" / "courtyard_p1.npy"
    path.unlink() if array is None else np.save(path, array)
    with pytest.raises(MotionloomError, match="courtyard_p1"):
        readers.find_pairs(tmp_path)


def test_people_of_unequal_length_are_no_pair(tmp_path: Path) -> None:
    path = write(tmp_path) / "new_joint_vecs" / "train" / "courtyard_p1.npy"
    np.save(path, np.load(path)[:-5])
    with pytest.raises(MotionloomError, match="frames of one"):
        threedpw.read_processed(tmp_path)


def test_a_folder_without_such_files_is_refused(tmp_path: Path) -> None:
    with pytest.raises(MotionloomError, match="_p0"):
        threedpw.read_processed(tmp_path)
