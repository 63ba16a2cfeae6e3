"""Files appear whole or not at all."""

import os
from pathlib import Path

import pytest

from motionloom.core.errors import MotionloomError
from motionloom.core.files.atomic import atomic_path, check_place


def test_the_file_appears_when_the_block_ends_and_not_before(tmp_path):
    target = tmp_path / "a.bvh"
    with atomic_path(target) as temporary:
        temporary.write_text("new")
        assert not target.exists()
        assert temporary.parent == tmp_path
        assert temporary.suffix == ".bvh"
    assert target.read_text() == "new"
    assert list(tmp_path.iterdir()) == [target]


@pytest.mark.parametrize("error", [RuntimeError, KeyboardInterrupt, MotionloomError])
def test_on_any_error_the_old_file_stays_and_nothing_else(tmp_path, error):
    target = tmp_path / "a.txt"
    target.write_text("old")

    def fail_half_way() -> None:
        with atomic_path(target) as temporary:
            temporary.write_text("half")
            raise error("stop")

    with pytest.raises(error):
        fail_half_way()
    assert target.read_text() == "old"
    assert list(tmp_path.iterdir()) == [target]


def test_a_writer_that_makes_its_own_file_at_the_path_is_fine(tmp_path):
    with atomic_path(tmp_path / "a.txt") as temporary:
        temporary.unlink()
        temporary.write_text("mine")
    assert (tmp_path / "a.txt").read_text() == "mine"


def test_a_link_is_written_through(tmp_path):
    (tmp_path / "real.txt").write_text("old")
    (tmp_path / "link.txt").symlink_to(tmp_path / "real.txt")
    with atomic_path(tmp_path / "link.txt") as temporary:
        temporary.write_text("new")
    assert (tmp_path / "link.txt").is_symlink()
    assert (tmp_path / "real.txt").read_text() == "new"


def test_the_file_has_the_usual_rights(tmp_path):
    (tmp_path / "plain.txt").touch()
    with atomic_path(tmp_path / "a.txt") as temporary:
        temporary.write_text("x")
    assert (tmp_path / "a.txt").stat().st_mode == (tmp_path / "plain.txt").stat().st_mode


@pytest.mark.parametrize(
    ("name", "message"), [("no/such/a.txt", "does not exist"), ("", "it is a folder"), ("a\0b.txt", "cannot write")]
)
def test_impossible_places_are_refused_before_work(tmp_path, name, message):
    with pytest.raises(MotionloomError, match=message), atomic_path(tmp_path / name):
        pytest.fail("the block must not run")
    assert not list(tmp_path.iterdir())


@pytest.mark.skipif(os.geteuid() == 0, reason="root may write anywhere")
def test_a_folder_without_write_permission_is_refused(tmp_path):
    tmp_path.chmod(0o500)
    with pytest.raises(MotionloomError, match="may not be written"), atomic_path(tmp_path / "a.txt"):
        pytest.fail("the block must not run")


def test_a_full_disk_names_the_file_that_was_asked_for(tmp_path):
    with pytest.raises(MotionloomError, match=r"cannot write .*a\.txt: No space left"), atomic_path(tmp_path / "a.txt"):
        raise OSError(28, "No space left on device")


def test_folders_are_made_for_what_is_written_and_go_where_it_fails(tmp_path: Path) -> None:
    place = tmp_path / "a" / "b" / "c.txt"
    with pytest.raises(MotionloomError, match="No space"), atomic_path(place, folders=True):
        raise OSError(28, "No space left on device")
    assert list(tmp_path.iterdir()) == []
    (tmp_path / "a").mkdir()
    with pytest.raises(ZeroDivisionError), atomic_path(place, folders=True):
        raise ZeroDivisionError
    assert list(tmp_path.rglob("*")) == [tmp_path / "a"]  # it was there before
    with atomic_path(place, folders=True) as temp:
        temp.write_text("whole")
    assert place.read_text() == "whole"


@pytest.mark.parametrize("name", ["file/x/y.json", "x/" + "n" * 300 + "/y.json", "x/" + "n" * 300, "x/\0/y", "l/x/y"])
def test_places_that_can_never_be_are_refused_before_work(tmp_path: Path, name: str) -> None:
    (tmp_path / "file").write_text("")
    (tmp_path / "l").symlink_to("l")
    before = sorted(tmp_path.rglob("*"))
    with pytest.raises(MotionloomError, match="cannot write"):
        check_place(tmp_path / name, folders=True)
    assert sorted(tmp_path.rglob("*")) == before
    check_place(tmp_path / "x" / "y" / "z.json", folders=True)
    with pytest.raises(MotionloomError, match="does not exist"):
        check_place(tmp_path / "x" / "y.json")
