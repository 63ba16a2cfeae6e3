"""What the stage shows besides the motion, and films of it."""

import io
from pathlib import Path

import numpy as np
from PIL import Image, ImageSequence

from tests.studio.studio import Studio


def _film(studio: Studio, **chosen: str) -> list[np.ndarray]:
    """The pictures of a GIF, by what is chosen in the dialog."""
    studio.key("Shift+V")
    for label, value in {"File": "gif", "Size": "640x360", **chosen}.items():
        studio.page.get_by_label(label, exact=True).select_option(value)
    with studio.page.expect_download() as file:
        studio.page.get_by_role("button", name="Write the film").click()
    assert file.value.suggested_filename == f"Test.{chosen.get('File', 'gif')}"
    data = Path(file.value.path()).read_bytes()
    if data[:3] != b"GIF":
        assert data[4:8] == b"ftyp"
        return []
    pictures = ImageSequence.Iterator(Image.open(io.BytesIO(data)))
    return [np.asarray(one.convert("RGB")).astype(int) for one in pictures]


def _changed(one: np.ndarray, two: np.ndarray) -> float:
    """The part of the pixels that differ."""
    return float((np.abs(one - two).max(axis=-1) > 24).mean())


def _blurred(picture: np.ndarray) -> np.ndarray:
    return picture.reshape(9, 40, 16, 40, 3).mean(axis=(1, 3))


def _still(studio: Studio) -> np.ndarray:
    """The stage once the camera has come to rest and the picture is sharp."""
    seen = studio.picture()
    for _ in range(30):
        before, seen = seen, studio.picture()
        if np.array_equal(before, seen):
            break
    return seen


def test_the_stage_becomes_a_film_picture_by_picture(studio: Studio):
    studio.key("ArrowRight", "ArrowRight", "c")  # the camera does not follow
    before = _still(studio)
    film = _film(studio)
    assert len(film) == 40
    assert film[0].shape == (360, 640, 3)
    assert 0.002 < _changed(film[0], film[-1]) < 0.2, "the person walks, and the camera is kept"
    again = _film(studio)
    assert all(_changed(one, two) == 0 for one, two in zip(film, again, strict=True))
    assert _changed(_still(studio), before) < 0.002, "the page shows again what it showed"
    assert "0.10 /" in studio.page.locator(".clock").inner_text()


def test_a_turntable_comes_back_to_where_it_began(studio: Studio):
    studio.open(("a person stands still", 2.0))
    studio.key("c")
    film = _film(studio, Camera="around")
    away = [float(np.abs(_blurred(one) - _blurred(film[0])).max()) for one in film]
    assert away[20] > 2 * max(away[1], away[-1]), "the sun is behind the person on the other side"
    assert _film(studio, Camera="kept", File="mp4") == []


def test_a_film_that_is_cancelled_leaves_nothing(studio: Studio):
    folder = studio.server.folder
    before = sorted(path.name for path in folder.rglob("*"))
    studio.key("Shift+V")
    studio.page.get_by_label("Size", exact=True).select_option("1280x720")
    studio.page.get_by_role("button", name="Write the film").click()
    studio.says(studio.page.locator("#film [role=status]"), "Picture ")
    studio.key("Escape")
    studio.page.wait_for_selector("#film", state="hidden")
    studio.page.wait_for_timeout(1000)
    assert sorted(path.name for path in folder.rglob("*")) == before
    assert studio.picture().std() > 1
    studio.key("Shift+V")  # and another one can be written
    assert studio.page.get_by_role("button", name="Write the film").is_enabled()
    studio.key("Escape")


def test_front_and_side_are_beside_the_main_picture(studio: Studio):
    alone = _still(studio)
    wide = alone.shape[1]
    right, left = slice(int(0.71 * wide), int(0.9 * wide)), slice(int(0.1 * wide), int(0.6 * wide))
    middle = studio.page.evaluate("document.querySelector('#canvas').clientHeight") // 2
    studio.key("Shift+X")
    assert studio.page.locator(".view:visible").all_inner_texts() == ["Front", "Side"]
    side = _still(studio)
    assert _changed(alone[:, left], side[:, left]) > 0.01, "the main picture is in the middle of what is left"
    studio.key("Shift+X")
    assert studio.page.locator(".view:visible").all_inner_texts() == ["Front", "Above"]
    above = _still(studio)
    assert _changed(side[: middle - 5, right], above[: middle - 5, right]) == 0, "the front is the same"
    assert _changed(side[middle + 5 :, right], above[middle + 5 :, right]) > 0.02
    box = studio.page.locator(".view:visible").nth(1).bounding_box()
    at = box["x"] + 60, box["y"] + 60
    studio.drag(at, (at[0] + 40, at[1]))
    assert _changed(above, _still(studio)) < 0.001, "a drag over a view turns nothing"
    studio.key("Shift+X")
    assert _changed(alone, _still(studio)) < 0.001


def test_who_climbs_has_steps_below(studio: Studio):
    assert studio.page.locator("#canvas").get_attribute("data-steps") == "0"
    studio.open(("a person climbs stairs", 4.0))
    assert int(studio.page.locator("#canvas").get_attribute("data-steps") or 0) >= 2
    motion = studio.motion()[0]
    assert motion[:, :, 1].min(axis=1).max() > 0.15, "the person goes up"


def test_a_picture_is_behind_the_people_until_the_theme_is(studio: Studio, tmp_path: Path):
    before = studio.picture()[10, 200]
    file = tmp_path / "behind.png"
    Image.new("RGB", (3000, 200), (200, 30, 90)).save(file)

    def choose(path: Path) -> None:
        studio.key("Shift+B")
        with studio.page.expect_file_chooser() as chooser:
            studio.page.get_by_text("Choose a picture").click()
        chooser.value.set_files(path)

    choose(file)
    studio.until("(localStorage.getItem('motionloom-backdrop') || '').includes('data:image/jpeg')")
    studio.key("Escape")
    assert np.abs(studio.picture()[10, 200] - [200, 30, 90]).max() < 12
    studio.load()
    assert np.abs(studio.picture()[10, 200] - [200, 30, 90]).max() < 12, "the browser keeps it"
    assert len(studio.page.evaluate("localStorage.getItem('motionloom-backdrop')")) < 100_000
    file.write_bytes(b"no picture at all")
    choose(file)
    studio.says(studio.page.locator(".notice[role=alert]"), "no picture that a browser can show")
    assert np.abs(studio.picture()[10, 200] - [200, 30, 90]).max() < 12
    studio.key("Shift+B")
    studio.page.get_by_text("As the theme").click()
    studio.key("Escape")
    assert np.abs(studio.picture()[10, 200].astype(int) - before).max() < 12


def test_words_over_heads_are_in_a_film(studio: Studio):
    studio.open(("two people greet each other", 2.0), people=2, seed=4)
    studio.key("Home")
    _still(studio)
    canvas = studio.page.locator("#canvas").bounding_box()
    tags = [one.bounding_box() for one in studio.page.locator("#stage .tag").all()]
    page = np.asarray(Image.open(io.BytesIO(studio.page.screenshot())).convert("RGB")).astype(int)
    picture = _film(studio, Size="page")[0]
    for tag in tags:
        x, y = round(tag["x"]) + 1, round(tag["y"] + tag["height"] / 2)
        edge = picture[y - round(canvas["y"]) - 5 :, x - round(canvas["x"])][:10]
        assert np.abs(np.median(edge, axis=0) - np.median(page[y - 5 : y + 5, x], axis=0)).max() < 40, edge
    assert len({tuple(page[round(tag["y"]) + 10, round(tag["x"]) + 1]) for tag in tags}) == 2, "each has its colour"
