"""Clips and what is said of them, as examples to learn from."""

from pathlib import Path

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from motionloom import io
from motionloom.core.body.ik import motion_from_positions
from motionloom.core.errors import MotionloomError
from motionloom.core.features import humanml as hml
from motionloom.core.motion import Motion
from motionloom_train.data.examples import LENGTH, MOST_CLIPS, CaptionedClip, find_examples, make_examples
from tests.kinematics import people


def motion(positions: np.ndarray) -> Motion:
    return motion_from_positions(positions, people.FPS)


def walk(seconds: float = 3.0) -> Motion:
    return motion(people.walking(1.2, seconds))


def bend() -> Motion:
    """Somebody who stands, leans to one side and stays there."""
    positions = people.standing(1.5)
    lean = np.linspace(0, 0.3, len(positions))[:, None] * (positions[..., 1] > 1.2)
    positions[..., 0] += lean
    return motion(positions)


@pytest.fixture
def clips(tmp_path: Path) -> Path:
    """A folder a_zombie_walks with one.bvh and two.bvh."""
    folder = tmp_path / "a_zombie_walks"
    folder.mkdir()
    for name in ("one", "two"):
        io.save(walk(1.0), folder / f"{name}.bvh")
    return folder


def captions(places: list[Path], caption: str = "") -> list[tuple[str, ...]]:
    return [captioned.captions for captioned in find_examples(places, caption)]


def test_one_caption_is_for_all(clips: Path) -> None:
    assert captions([clips / "one.bvh", clips / "two.bvh"], " a zombie   walks ") == [("a zombie walks",)] * 2


def test_a_folder_speaks_for_its_clips(clips: Path) -> None:
    assert captions([clips]) == [("a zombie walks",)] * 2
    assert captions([clips.parent]) == [("a zombie walks",)] * 2


def test_captions_of_a_folder_go_before_the_one_for_all(clips: Path) -> None:
    (clips / "captions.txt").write_text("# of the second\ntwo: a zombie runs\ntwo: he runs like a zombie\n")
    assert captions([clips], "a zombie walks") == [("a zombie walks",), ("a zombie runs", "he runs like a zombie")]


def test_the_file_beside_a_clip_goes_before_everything(clips: Path) -> None:
    (clips / "captions.txt").write_text("one: x\n")
    (clips / "one.txt").write_text("a zombie limps\n\n# no caption\nsomeone limps\n")
    assert captions([clips / "one.bvh"], "a zombie walks") == [("a zombie limps", "someone limps")]


def test_clips_in_order_and_once(clips: Path) -> None:
    captioned = find_examples([clips / "two.bvh", clips, clips / "two.bvh"], "a zombie")
    assert [one.path.name for one in captioned] == ["two.bvh", "one.bvh"]


def test_what_cannot_be_learned_from_is_refused(clips: Path, tmp_path: Path) -> None:
    for places, caption, reason in (
        ([], "x y", "there is no clip"),
        ([tmp_path / "none.bvh"], "x y", "there is no clip"),
        ([clips / "one.bvh"], "", "nothing is said of"),
        ([clips / "one.bvh"], "!?", "no caption"),
        ([clips / "one.bvh"], "x" * 400, "no caption"),
    ):
        with pytest.raises(MotionloomError, match=reason):
            find_examples(places, caption)
    (clips / "one.txt").write_bytes(b"\xff\xfe\x00")
    with pytest.raises(MotionloomError, match="not text in UTF-8"):
        find_examples([clips / "one.bvh"])


def test_many_clips_are_not_taught(clips: Path) -> None:
    for number in range(MOST_CLIPS + 1):
        (clips / f"{number}.bvh").write_bytes((clips / "one.bvh").read_bytes())
    with pytest.raises(MotionloomError, match="more than 20 clips"):
        find_examples([clips])


@given(st.text(max_size=40))
@settings(max_examples=60, deadline=None)
def test_whatever_stands_in_captions_it_is_read_or_refused(tmp_path_factory: pytest.TempPathFactory, text: str) -> None:
    folder = tmp_path_factory.mktemp("clips")
    (folder / "one.bvh").write_text("x")
    (folder / "captions.txt").write_text(text, encoding="utf-8", errors="surrogatepass")
    try:
        captioned = find_examples([folder / "one.bvh"], "a zombie")
    except MotionloomError:
        return
    assert all(caption.strip() for one in captioned for caption in one.captions)


CAPTIONED = CaptionedClip(Path("x/zombie.bvh"), ("a person walks to the left",))


def test_a_short_walk_goes_on() -> None:
    """A loop: the person goes on at 1.2 m/s for the ten seconds that a window may take."""
    example = make_examples(walk(3.0), CAPTIONED, mirror=False)[0]
    assert example.looped
    assert example.span == (0, LENGTH)
    way = hml.decode_positions(example.features.astype(np.float64))[:, 0]
    assert np.linalg.norm(way[-1] - way[0]) == pytest.approx(1.2 * LENGTH / 20, rel=0.1)


def test_a_short_change_is_held_at_both_ends() -> None:
    """What was recorded is in the middle, and before and behind it nearly nothing moves."""
    example = make_examples(bend(), CAPTIONED, mirror=False)[0]
    first, end = example.span
    assert not example.looped
    assert end - first == 29  # 1.5 s are 30 frames, and features are one fewer
    assert (first, len(example.features) - end) == (LENGTH - 29, LENGTH - 29)
    places = hml.decode_positions(example.features.astype(np.float64))
    lean = places[:, 15, 0] - places[:, 0, 0]
    assert np.ptp(lean[: first - 5]) < 0.05
    assert np.ptp(lean[end + 10 :]) < 0.05
    assert abs(lean[end + 10 :].mean() - lean[: first - 5].mean()) > 0.1


def test_a_mirror_image_has_mirrored_words() -> None:
    plain, mirrored = make_examples(walk(), CAPTIONED)
    assert mirrored.captions == ("a person walks to the right",)
    assert np.allclose(hml.mirror(mirrored.features), plain.features, atol=1e-4)


def test_what_is_done_with_a_certain_hand_is_not_mirrored() -> None:
    assert len(make_examples(walk(), CaptionedClip(Path("a.bvh"), ("a soldier salutes",)))) == 1
    assert len(make_examples(walk(), CAPTIONED, mirror=False)) == 1
