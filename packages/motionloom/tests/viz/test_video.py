"""Pictures and films: sizes, times, colours and refusals."""

import itertools
import subprocess
from collections.abc import Iterator, Sequence
from pathlib import Path

import imageio_ffmpeg
import numpy as np
import pytest
from PIL import Image

from motionloom.core import rotations as rot
from motionloom.core.errors import MotionloomError
from motionloom.core.motion import Motion
from motionloom.core.skeleton import SMPL22, Skeleton
from motionloom.viz import draw
from motionloom.viz.draw import Camera, capsules, hull
from motionloom.viz.figure import body_height, figure, joint_sides
from motionloom.viz.film import write_film
from motionloom.viz.video import draw_sheet, draw_video
from tests.work import work


def standing(frames: int = 20, fps: float = 20.0, *, speed: float = 0.0, turn: float = 0.0) -> Motion:
    """Somebody in T-pose who glides forward in metres per second and turns left in radians per second."""
    time = np.arange(frames) / fps
    root = np.stack([0 * time, np.full(frames, SMPL22.offsets[0, 1]), speed * time], axis=-1)
    turned = np.zeros((frames, 22, 3))
    turned[:, 0, 1] = turn * time
    return Motion(SMPL22, fps, root, rot.rotvec_to_quat(turned))


def renamed(motion: Motion, names: list[str]) -> Motion:
    old = motion.skeleton
    return Motion(Skeleton(tuple(names), old.parents, old.offsets), motion.fps, motion.root, motion.rotations)


def probe(path: Path) -> tuple[int, float, tuple[int, int]]:
    """Frames, seconds and size as ffmpeg reads them back."""
    reader = imageio_ffmpeg.read_frames(str(path))
    meta = next(reader)
    return sum(1 for _ in reader), meta["duration"], meta["size"]


def count_colour(picture: np.ndarray, colour: tuple[int, int, int]) -> int:
    return int((np.abs(picture.astype(int) - np.array(colour)).max(axis=-1) <= 4).sum())


# --- what a figure knows -----------------------------------------------------------------------------------------


def test_sides_follow_names_in_every_common_style() -> None:
    for left, right in (
        ("left_knee", "right_knee"),
        ("LeftUpLeg", "RightUpLeg"),
        ("lfemur", "rfemur"),
        ("Hand_L", "Hand_R"),
    ):
        skeleton = Skeleton(("root", right, left), (-1, 0, 0), np.zeros((3, 3)))
        assert joint_sides(skeleton) == (0, -1, 1)


def test_sides_of_unnamed_joints_follow_the_rest_pose() -> None:
    named = joint_sides(SMPL22)
    plain = renamed(standing(), [f"joint{i}" for i in range(22)])
    assert joint_sides(plain.skeleton) == named


def test_a_deep_skeleton_is_as_much_work_to_study_as_it_is_large() -> None:
    def studied(joints: int) -> int:
        names, parents = tuple(f"joint{n}" for n in range(joints)), tuple(range(-1, joints - 1))
        line = Skeleton(names, parents, np.tile([0.0, 0.01, 0.0], (joints, 1)))
        motion = Motion(line, 20.0, np.zeros((2, 3)), np.tile([1.0, 0, 0, 0], (2, joints, 1)))
        return work(lambda: figure(motion))

    assert studied(800) < 9 * studied(100)


def test_facing_starts_at_z_and_turns_to_the_left() -> None:
    shape = figure(standing(21, 20.0, turn=np.pi / 2))
    np.testing.assert_allclose(shape.forward[0], [0, 0, 1], atol=2e-3)
    np.testing.assert_allclose(shape.forward[-1], [1, 0, 0], atol=2e-3)
    assert shape.heading()[-1] == pytest.approx(np.pi / 2)


def test_standing_feet_touch_and_sliding_feet_do_not() -> None:
    feet = [SMPL22.index("left_foot"), SMPL22.index("right_foot")]
    assert figure(standing()).contacts[:, feet].all()
    assert not figure(standing(speed=1.0)).contacts.any()


def test_a_lone_reference_joint_at_the_origin_is_no_part_of_the_body() -> None:
    motion = standing(30, speed=1.0)
    names = ("reference", *SMPL22.names)
    skeleton = Skeleton(
        names, (-1, *(p + 1 for p in SMPL22.parents)), np.concatenate([np.zeros((1, 3)), SMPL22.offsets])
    )
    turns = np.concatenate([np.tile(rot.IDENTITY, (30, 1, 1)), motion.rotations], axis=1)
    moves = np.tile(skeleton.offsets, (30, 1, 1))
    moves[:, 1] = motion.root
    shape = figure(Motion(skeleton, 20.0, np.zeros((30, 3)), turns, moves))
    assert shape.centre == 1
    assert all(0 not in bone for bone in shape.bones)
    assert len(shape.bones) == 21


# --- geometry ----------------------------------------------------------------------------------------------------


def test_the_camera_keeps_its_target_in_the_middle_and_its_span_in_the_height() -> None:
    camera = Camera(np.array([1.0, 2.0, 3.0]), (100, 50), 4.0, 0.7, 0.0)
    middle, _, scale = camera.see(camera.target)
    np.testing.assert_allclose(middle, [100, 50])  # half of the doubled picture
    assert scale == pytest.approx(100 / 4.0)
    above, _, _ = camera.see(camera.target + np.array([0, 2.0, 0]))
    np.testing.assert_allclose(above, [100, 0], atol=1e-9)


def test_the_camera_sees_the_left_of_a_person_who_faces_it_on_the_right_of_the_picture() -> None:
    camera = Camera(np.zeros(3), (100, 100), 2.0, 0.0, 0.2)
    left, *_ = camera.see(np.array([0.5, 0.0, 0.0]))
    near, depth, _ = camera.see(np.array([0.0, 0.0, 0.5]))
    assert left[0] > 100
    assert depth < camera.distance
    assert near[1] > 100


def test_capsules_stay_within_their_radius_and_reach_it() -> None:
    a, b = np.array([[0.0, 0.0]]), np.array([[10.0, 0.0]])
    outline = capsules(a, b, np.array([2.0]), np.array([1.0]))[0]
    assert outline[:, 0].max() == pytest.approx(11.0)
    assert outline[:, 0].min() == pytest.approx(-2.0)
    assert np.abs(outline[:, 1]).max() == pytest.approx(2.0)


def test_a_hull_of_one_disc_is_that_disc() -> None:
    points = np.array(hull(np.array([[3.0, 4.0]]), np.array([2.0])))
    np.testing.assert_allclose(np.hypot(*(points - [3.0, 4.0]).T), 2.0)
    assert len(points) == 20


# --- sheets ------------------------------------------------------------------------------------------------------


def test_a_sheet_has_a_row_per_motion_and_shows_both_sides_and_contact(tmp_path: Path) -> None:
    motion = standing()
    path = draw_sheet([motion, motion], tmp_path / "a sheet; $(x) 'ö'.png", captions=["one", "two"], columns=4)
    picture = np.asarray(Image.open(path))
    single = np.asarray(Image.open(draw_sheet([motion], tmp_path / "one.png", captions=["one"], columns=4)))
    assert picture.shape == (2 * single.shape[0], single.shape[1], 3)
    for colour in (draw.LEFT, draw.RIGHT, draw.CONTACT):
        assert count_colour(single, colour) > 50


def test_left_is_drawn_where_left_is(tmp_path: Path) -> None:
    """From the right front a T-pose shows its left hand, orange, to the right of its blue right hand."""
    assert draw.LEFT[0] > 2 * draw.LEFT[2]
    assert draw.RIGHT[2] > 2 * draw.RIGHT[0]
    sheet = np.asarray(Image.open(draw_sheet([standing(2)], tmp_path / "t.png", columns=2)))[50:, :170].astype(int)
    columns = [np.nonzero(np.abs(sheet - c).max(axis=-1) <= 4)[1].mean() for c in (draw.LEFT, draw.RIGHT)]
    assert columns[0] > columns[1]


@pytest.mark.parametrize("frames", [1, 2, 3])
def test_short_motions_make_sheets_and_films(tmp_path: Path, frames: int) -> None:
    draw_sheet([standing(frames)], tmp_path / "x.png")
    draw_video([standing(frames)], tmp_path / "x.mp4", size=(96, 64))
    assert probe(tmp_path / "x.mp4")[0] == frames


def test_odd_skeletons_can_be_drawn(tmp_path: Path) -> None:
    point = Motion(Skeleton(("a",), (-1,), np.zeros((1, 3))), 30.0, np.zeros((3, 3)), np.tile(rot.IDENTITY, (3, 1, 1)))
    chain = Skeleton(("a", "b", "c"), (-1, 0, 1), np.array([[0, 0, 0], [0, 1, 0], [0, 1e6, 0]]))
    snake = Motion(chain, 30.0, np.full((3, 3), -1e6), np.tile(rot.IDENTITY, (3, 3, 1)))
    tiny = Motion(SMPL22, 30.0, 1e-9 * np.ones((2, 3)), np.tile(rot.IDENTITY, (2, 22, 1)), np.zeros((2, 22, 3)))
    upside = standing(3)
    for i, motion in enumerate((point, snake, tiny, renamed(upside, [f"ä{i}\n" for i in range(22)]))):
        draw_sheet([motion], tmp_path / f"{i}.png", columns=3)
        draw_video([motion], tmp_path / f"{i}.mp4", size=(96, 64))


# --- films -------------------------------------------------------------------------------------------------------


def test_a_film_has_the_motions_rate_length_and_codec(tmp_path: Path) -> None:
    path = draw_video([standing(60, 30.0)], tmp_path / "-odd name;%d.mp4", captions=["walk"], size=(161, 91))
    count, seconds, size = probe(path)
    assert (count, size) == (60, (160, 90))
    assert seconds == pytest.approx(2.0, abs=0.01)
    seen = subprocess.run(
        [imageio_ffmpeg.get_ffmpeg_exe(), "-i", f"file:{path}"], capture_output=True, check=False
    ).stderr
    assert b"h264" in seen
    assert b"yuv420p" in seen
    assert b"30 fps" in seen


def test_fast_recordings_are_filmed_at_a_whole_fraction_of_their_rate(tmp_path: Path) -> None:
    count, seconds, _ = probe(draw_video([standing(121, 120.0)], tmp_path / "x.mp4", size=(96, 64)))
    assert (count, seconds) == (61, pytest.approx(61 / 60, abs=0.01))


def test_people_side_by_side_hold_their_last_pose(tmp_path: Path) -> None:
    path = draw_video([standing(40), standing(10)], tmp_path / "x.mp4", size=(192, 96))
    assert probe(path)[0] == 40


def test_a_gif_has_the_colours_of_all_its_pictures(tmp_path: Path) -> None:
    ramp = np.linspace(40, 250, 64).astype(np.uint8)
    asked: list[list[int]] = []

    def frames(numbers: Sequence[int]) -> Iterator[Image.Image]:
        asked.append(list(numbers))
        for number in numbers:  # grey at first, then a ramp of another colour in each quarter
            picture = np.zeros((64, 64, 3), np.uint8)
            picture[..., [[0, 1, 2], [0], [1], [2]][number // 10]] = np.roll(ramp, number)[:, None]
            picture[number, :2] = (200, 90, 20)
            yield Image.fromarray(picture)

    film = Image.open(write_film(frames, tmp_path / "x.gif", (64, 64), rate=20, count=40))
    for number, wanted in enumerate(frames(range(40))):
        film.seek(number)
        assert np.abs(np.asarray(film.convert("RGB")).astype(int) - np.asarray(wanted)).max() < 14, number
    assert len(asked[0]) < 10
    assert asked[1] == list(range(40))


def test_a_gif_lasts_as_long_as_the_motion(tmp_path: Path) -> None:
    draw_video([standing(30, 20.0, speed=1.0)], tmp_path / "x.gif", size=(96, 64))
    film = Image.open(tmp_path / "x.gif")
    total = 0
    for frame in itertools.count():
        try:
            film.seek(frame)
        except EOFError:
            break
        total += film.info["duration"]
    assert total == 1500


def test_the_floor_stays_in_the_world_under_a_moving_camera() -> None:
    """A point of the floor moves on the screen by exactly what the camera moved in the world."""
    points = np.array([[0.5, 0.0, 0.5]])
    still = Camera(np.array([0.0, 0.0, 0.0]), (100, 100), 2.0, 0.3)
    moved = Camera(np.array([0.5, 0.0, 0.5]), (100, 100), 2.0, 0.3)
    np.testing.assert_allclose(moved.see(points)[0], still.see(points * 0)[0])


# --- refusals ----------------------------------------------------------------------------------------------------


@pytest.mark.parametrize(
    ("name", "options", "words"),
    [
        ("x.avi", {}, "must end in"),
        ("missing/x.mp4", {}, "missing"),
        ("x.mp4", {"size": (10, 10)}, "pixels"),
        ("x.mp4", {"size": (10**6, 10**6)}, "pixels"),
        ("x.mp4", {"fps": float("nan")}, "frames per second"),
        ("x.mp4", {"captions": ["a", "b"]}, "captions"),
    ],
)
def test_films_that_cannot_be_made_are_refused_in_one_sentence(
    tmp_path: Path, name: str, options: dict, words: str
) -> None:
    with pytest.raises(MotionloomError, match=words):
        draw_video([standing(2)], tmp_path / name, **options)
    assert list(tmp_path.iterdir()) == []


def test_nothing_to_draw_and_endless_gifs_are_refused(tmp_path: Path) -> None:
    with pytest.raises(MotionloomError, match="no motion"):
        draw_sheet([], tmp_path / "x.png")
    with pytest.raises(MotionloomError, match="mp4"):
        draw_video([standing(3000, 20.0)], tmp_path / "x.gif")
    with pytest.raises(MotionloomError, match="columns"):
        draw_sheet([standing(2)], tmp_path / "x.png", columns=1)


def test_a_failing_ffmpeg_leaves_nothing_and_says_why(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    fake = tmp_path / "ffmpeg"
    fake.write_text("#!/bin/sh\necho no room on the moon >&2\nexit 3\n")
    fake.chmod(0o755)
    monkeypatch.setattr(imageio_ffmpeg, "get_ffmpeg_exe", lambda: str(fake))
    folder = tmp_path / "out"
    folder.mkdir()
    with pytest.raises(MotionloomError, match="no room on the moon"):
        draw_video([standing(40)], folder / "x.mp4", size=(320, 240))
    assert list(folder.iterdir()) == []


def test_a_failing_scene_stops_ffmpeg_and_leaves_nothing(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    def broken(*_: object, **__: object) -> None:
        raise RuntimeError("brush lost")

    monkeypatch.setattr(draw, "paint_body", broken)
    with pytest.raises(RuntimeError, match="brush lost"):
        draw_video([standing(5)], tmp_path / "x.mp4", size=(96, 64))
    assert list(tmp_path.iterdir()) == []


def test_a_reference_joint_far_from_the_body_makes_nobody_taller() -> None:
    motion = standing()
    old = motion.skeleton
    far = np.array([0.0, 0.0, -5.0])
    place = motion.root - far
    skeleton = Skeleton(
        ("reference", *old.names),
        (-1, *(p + 1 for p in old.parents)),
        np.concatenate([far[None], old.offsets]),
    )
    rotations = np.insert(motion.rotations, 0, rot.IDENTITY, axis=1)
    moved = np.repeat(skeleton.offsets[None], len(motion), axis=0)
    moved[:, 1] = place + np.linspace(0, 1, len(motion))[:, None] * [1, 0, 0]
    walked = Motion(skeleton, motion.fps, np.tile(far, (len(motion), 1)), rotations, moved)
    assert body_height(skeleton, walked.positions()) == pytest.approx(body_height(old, motion.positions()))
