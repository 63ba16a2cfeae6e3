"""Several files that appear together: all of them or none, in a new folder or in an old one."""

import os
from pathlib import Path

import pytest

from motionloom.core.errors import MotionloomError
from motionloom.io.folder import atomic_folder, check_folder


def names(folder: Path) -> list[str]:
    return sorted(path.name for path in folder.iterdir())


def test_a_new_folder_appears_with_all_its_files(tmp_path):
    with atomic_folder(tmp_path / "new") as folder:
        (folder / "a").write_text("1")
        assert not (tmp_path / "new").exists()
        (folder / "b").write_text("2")
    assert names(tmp_path) == ["new"]
    assert names(tmp_path / "new") == ["a", "b"]


def test_an_old_folder_keeps_what_is_not_replaced(tmp_path):
    (tmp_path / "a").write_text("old")
    (tmp_path / "c").write_text("mine")
    with atomic_folder(tmp_path) as folder:
        (folder / "a").write_text("new")
        assert (tmp_path / "a").read_text() == "old"
    assert names(tmp_path) == ["a", "c"]
    assert (tmp_path / "a").read_text() == "new"


@pytest.mark.parametrize("name", ["new", "."])
@pytest.mark.parametrize("problem", [KeyboardInterrupt, RuntimeError])
def test_on_an_error_nothing_is_left(tmp_path, name, problem):
    (tmp_path / "a").write_text("old")

    def broken() -> None:
        with atomic_folder(tmp_path / name) as folder:
            (folder / "a").write_text("new")
            raise problem

    with pytest.raises(problem):
        broken()
    assert names(tmp_path) == ["a"]
    assert (tmp_path / "a").read_text() == "old"


def test_a_link_leads_to_its_folder(tmp_path):
    (tmp_path / "real").mkdir()
    os.symlink(tmp_path / "real", tmp_path / "link")
    with atomic_folder(tmp_path / "link") as folder:
        (folder / "a").write_text("1")
    assert names(tmp_path / "real") == ["a"]
    assert (tmp_path / "link").is_symlink()


def test_what_the_system_refuses_at_last_is_one_sentence(tmp_path):
    (tmp_path / "a").mkdir()
    with pytest.raises(MotionloomError, match="cannot write to"), atomic_folder(tmp_path) as folder:
        (folder / "a").write_text("1")
    assert names(tmp_path) == ["a"]


@pytest.mark.parametrize(
    ("name", "message"),
    [
        ("file", "it is a file; name a folder"),
        ("file/new", "cannot write"),
        ("absent/new", "does not exist; make it first"),
        ("x" * 300, "cannot write"),
        ("a\0b", "cannot write"),
    ],
)
def test_what_is_no_place_is_refused(tmp_path, name, message):
    (tmp_path / "file").write_text("")
    with pytest.raises(MotionloomError, match=message):
        check_folder(tmp_path / name)


@pytest.mark.skipif(not hasattr(os, "geteuid") or os.geteuid() == 0, reason="root may write everywhere")
def test_a_folder_that_may_not_be_written_to_is_refused(tmp_path):
    (tmp_path / "shut").mkdir(mode=0o500)
    with pytest.raises(MotionloomError, match="may not be written to"):
        check_folder(tmp_path / "shut")
