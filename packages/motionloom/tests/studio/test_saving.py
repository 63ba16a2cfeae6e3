"""What is saved is replaced by nobody who has not seen it: two tabs, another project, a newer one, a full disk."""

import json
import resource
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import pytest

from tests.studio.studio import PROJECT, Studio

NO_LIMIT = (resource.RLIM_INFINITY, resource.RLIM_INFINITY)


@pytest.fixture
def second(studio: Studio, server) -> Iterator[Studio]:
    """Another tab of the same browser, on the same project."""
    page = studio.page.context.new_page()
    page.add_init_script("name = 'kept'")
    other = Studio(page, server)
    other.load()
    yield other
    page.close()


def words(studio: Studio) -> list[str]:
    return studio.page.locator(".block").all_inner_texts()


def write(studio: Studio, text: str) -> None:
    """Other words into the first block, by keyboard."""
    studio.page.locator(".block").first.dblclick()
    studio.page.keyboard.press("Control+a")
    studio.page.keyboard.type(text)
    studio.key("Enter")


def on_server(studio: Studio) -> list[str]:
    return [one["text"] for one in studio.server.ask("/project")["segments"]]


def unless_it_saves(route) -> None:
    """Let everything through to the server but what is to be saved."""
    route.abort() if route.request.method == "PUT" else route.continue_()


@pytest.fixture
def folder(studio: Studio) -> Iterator[Path]:
    """The server's folder with no page on it; what a test puts aside there is gone behind it."""
    studio.page.goto("about:blank")
    yield studio.server.folder
    for aside in studio.server.folder.glob("project.2*.json"):
        aside.unlink()


def test_a_second_tab_follows_the_first_and_asks_nobody(studio: Studio, second: Studio) -> None:
    write(studio, "a person jumps")
    studio.drawn()
    studio.says(second.page.locator(".block"), "a person jumps")
    second.drawn()
    write(second, "a person waves")
    second.drawn()
    studio.says(studio.page.locator(".block"), "a person waves")
    studio.drawn()
    assert on_server(studio) == ["a person waves"]
    assert studio.project()["takes"] == second.project()["takes"]
    for one in (studio, second):
        assert one.page.locator(".notice").count() == 0
        assert not one.faults


@pytest.mark.parametrize("choice", ["Keep mine as a copy", "Load the other", "Overwrite it with mine"])
def test_two_tabs_that_write_at_once_ask_which_is_to_be(
    studio: Studio, second: Studio, choice: str, tmp_path: Path
) -> None:
    second.page.route(
        "**/project*", lambda route: route.abort() if route.request.method == "PUT" else route.continue_()
    )
    second.page.route("**/project/stamp", lambda route: route.fulfill(json=None))
    write(second, "a person sits down")
    second.page.wait_for_selector(".notice.away")
    write(studio, "a person jumps")
    studio.drawn()
    second.page.unroute("**/project/stamp")
    second.page.unroute("**/project*")
    question = second.page.locator(".notice.conflict")
    second.says(question, "Somebody has saved this project on another page meanwhile")
    assert second.page.locator(".state").inner_text() == "not saved"
    assert on_server(studio) == ["a person jumps"]
    assert words(second)[0].startswith("a person sits down")
    button = question.get_by_text(choice)
    if choice == "Keep mine as a copy":
        with second.page.expect_download() as file:
            button.click()
        assert file.value.suggested_filename == "Test_mine.loom.json"
        copy = json.loads(Path(file.value.path()).read_text())
        assert [one["text"] for one in copy["segments"]] == ["a person sits down"]
    else:
        button.click()
    question.wait_for(state="detached")
    second.drawn()
    right = "a person sits down" if choice.startswith("Overwrite") else "a person jumps"
    assert on_server(studio) == [right]
    for one in (studio, second):
        one.says(one.page.locator(".block"), right)
        assert one.page.locator(".notice.conflict").count() == 0


def test_what_a_browser_kept_of_one_project_never_comes_into_another(studio: Studio, folder: Path) -> None:
    """The same address, another project: the first one's unsaved work waits for its own folder."""
    studio.load()
    place, film = folder / "project.json", studio.project()
    studio.page.route(
        "**/project*", lambda route: route.abort() if route.request.method == "PUT" else route.continue_()
    )
    write(studio, "unsaved work of film A")
    studio.page.wait_for_selector(".notice.away")
    studio.page.goto("about:blank")
    studio.page.wait_for_timeout(500)  # what the page sends while it is left does not arrive, either
    studio.page.unroute("**/project*")
    other = {**film, "id": "film-b", "name": "Film B", "revision": 1, "written": {"by": "", "from": 0}}
    other["segments"] = [{**film["segments"][0], "text": "precious work of film B"}]
    before = place.read_bytes()
    place.write_text(json.dumps(other))
    studio.load()
    assert on_server(studio) == ["precious work of film B"]
    assert studio.page.locator(".notice").count() == 0
    studio.page.goto("about:blank")
    place.write_bytes(before)
    studio.load()
    assert words(studio)[0].startswith("unsaved work of film A")
    assert on_server(studio) == ["unsaved work of film A"]


NEWER = {**PROJECT, "version": 99, "id": "film-c", "revision": 3, "layers": [1], "segments": [], "people": []}


@pytest.mark.parametrize(
    ("data", "why"),
    [(json.dumps(NEWER).encode(), "has version 99"), (b'{"version": 2, "se', "is not JSON")],
    ids=["newer", "damaged"],
)
def test_a_project_that_cannot_be_read_is_kept_aside_and_told(
    studio: Studio, folder: Path, data: bytes, why: str
) -> None:
    place = folder / "project.json"
    before = place.read_bytes()
    place.write_bytes(data)
    studio.load()
    (aside,) = folder.glob("project.2*.json")
    assert aside.read_bytes() == data
    told = studio.page.locator(".notice.told")
    studio.says(told, why)
    studio.says(told, f"stays in the project folder as {aside.name}")
    assert studio.project()["name"] == "Untitled"
    told.get_by_label("Close").click()
    told.wait_for(state="detached")
    studio.page.goto("about:blank")
    place.write_bytes(before)


@pytest.mark.skipif(not hasattr(resource, "prlimit"), reason="limits another process's files as Linux does")
def test_a_full_disk_is_told_and_what_finds_no_room_comes_later(studio: Studio, tmp_path: Path) -> None:
    file = tmp_path / "walk.bvh"
    file.write_bytes(studio.download("e"))
    before = sorted(studio.server.folder.rglob("*"))
    pid = studio.server.process.pid
    resource.prlimit(pid, resource.RLIMIT_FSIZE, (300, resource.RLIM_INFINITY))
    try:
        studio.drop(file)
        studio.says(studio.page.locator(".notice[role=alert]"), "walk.bvh: the disk of the project folder is full")
        studio.says(studio.page.locator(".state"), "the disk is full")
        assert studio.page.locator(".clip").count() == 0
        write(studio, "a person jumps")
        studio.says(studio.page.locator(".state"), "the disk is full")
        assert sorted(studio.server.folder.rglob("*")) == before
    finally:
        resource.prlimit(pid, resource.RLIMIT_FSIZE, NO_LIMIT)
    studio.key("r")
    studio.says(studio.page.locator(".state"), "saved")
    assert on_server(studio) == ["a person jumps"]
    project: dict[str, Any] = studio.project()
    assert project["takes"]
    studio.drop(file)
    studio.page.wait_for_selector(".clip")


@pytest.mark.skipif(not hasattr(resource, "prlimit"), reason="limits another process's files as Linux does")
def test_a_disk_with_room_for_words_only_is_called_full(studio: Studio, tmp_path: Path) -> None:
    """The project's words still fit: as long as a motion did not, the page does not say that all is saved."""
    file = tmp_path / "walk.bvh"
    file.write_bytes(studio.download("e"))
    state, alert = studio.page.locator(".state"), studio.page.locator(".notice[role=alert]")
    pid = studio.server.process.pid
    resource.prlimit(pid, resource.RLIMIT_FSIZE, (8000, resource.RLIM_INFINITY))
    try:
        studio.drop(file)
        studio.says(alert, "walk.bvh: the disk of the project folder is full")
        studio.page.wait_for_timeout(6000)
        assert state.inner_text() == "the disk is full"
        alert.get_by_label("Close").click()
        studio.says(state, "saved")
        write(studio, "a person jumps")
        studio.says(alert, "the disk of the project folder is full")
        while on_server(studio) != ["a person jumps"]:
            studio.page.wait_for_timeout(100)
        studio.page.wait_for_timeout(500)
        assert state.inner_text() == "the disk is full"
    finally:
        resource.prlimit(pid, resource.RLIMIT_FSIZE, NO_LIMIT)
    alert.get_by_role("button", name="Try again").click()
    assert studio.project()["takes"]
