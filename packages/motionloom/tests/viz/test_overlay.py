"""People in one scene: who is where in the picture, in which colour, at which moment."""

import itertools
from collections.abc import Sequence
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from PIL import Image

from motionloom.core import rotations as rot
from motionloom.core.errors import MotionloomError
from motionloom.core.motion import Motion
from motionloom.core.skeleton import SMPL22, Skeleton
from motionloom.viz import draw, overlay
from motionloom.viz.overlay import PALETTE, PAST, TRUTH, draw_futures, draw_scene, tint
from motionloom.viz.scene import Actor, Stage, azimuth_of, follow

Colour = tuple[int, int, int]
SIZE = (320, 180)


def person(
    frames: int = 20,
    fps: float = 20.0,
    *,
    at: Sequence[float] = (0.0, 0.0, 0.0),
    speed: Sequence[float] = (0.0, 0.0, 0.0),
    turned: Sequence[float] = (0.0, 0.0, 0.0),
) -> Motion:
    """Somebody in T-pose at a place (metres), gliding (m/s), turned by a rotation vector."""
    time = np.arange(frames)[:, None] / fps
    turns = np.zeros((frames, 22, 3))
    turns[:, 0] = turned
    root = np.array([0.0, SMPL22.offsets[0, 1], 0.0]) + np.array(at) + np.array(speed) * time
    return Motion(SMPL22, fps, root, rot.rotvec_to_quat(turns))


def fan(count: int, frames: int = 20, fps: float = 20.0, *, reach: float = 2.0) -> list[Motion]:
    """Futures that glide apart from the origin in ``count`` directions, in metres per second."""
    ways = np.arange(count) / count * 2 * np.pi
    return [person(frames, fps, speed=(reach * np.sin(w), 0.0, reach * np.cos(w))) for w in ways]


def pictures(path: Path) -> list[np.ndarray]:
    film = Image.open(path)
    found = []
    for number in itertools.count():
        try:
            film.seek(number)
        except EOFError:
            return found
        found.append(np.asarray(film.convert("RGB")).astype(int))


def count_near(picture: np.ndarray, colour: Colour, tolerance: int = 6) -> int:
    return int((np.abs(picture - np.array(colour)).max(axis=-1) <= tolerance).sum())


# --- colours ------------------------------------------------------------------------------------------------------


def lab(colours: np.ndarray, view: np.ndarray) -> np.ndarray:
    """CIE L*a*b* (D65) of sRGB colours (count, 3) as seen through a matrix on linear RGB."""
    c = colours / 255
    linear = np.clip(np.where(c <= 0.04045, c / 12.92, ((c + 0.055) / 1.055) ** 2.4) @ view.T, 0, 1)
    to_xyz = np.array([[0.4125, 0.3576, 0.1804], [0.2127, 0.7152, 0.0722], [0.0193, 0.1192, 0.9503]])
    f = np.cbrt(np.maximum(linear @ to_xyz.T / [0.9505, 1, 1.0888], 0.0089))
    return np.stack([116 * f[:, 1] - 16, 500 * (f[:, 0] - f[:, 1]), 200 * (f[:, 1] - f[:, 2])], axis=-1)


def test_ten_people_past_and_truth_can_be_told_apart_by_every_colour_vision() -> None:
    """Protanopia and deuteranopia as simulated by Machado, Oliveira and Fernandes (2009)."""
    views = [
        np.eye(3),
        np.array([[0.152286, 1.052583, -0.204868], [0.114503, 0.786281, 0.099216], [-0.003882, -0.048116, 1.051998]]),
        np.array([[0.367322, 0.860646, -0.227968], [0.280085, 0.672501, 0.047413], [-0.01182, 0.04294, 0.968881]]),
    ]
    colours = np.array([*PALETTE, PAST, TRUTH, draw.PAPER], dtype=float)
    for view in views:
        seen = lab(colours, view)
        apart = np.linalg.norm(seen[:, None] - seen, axis=-1) + 1e3 * np.eye(len(seen))
        assert apart.min() > 14, np.unravel_index(apart.argmin(), apart.shape)


def test_fifty_people_have_fifty_colours() -> None:
    assert len({tint(i) for i in range(50)}) == 50


# --- where people are in the picture ------------------------------------------------------------------------------


def test_a_body_is_drawn_in_its_colour_where_a_pinhole_camera_sees_it(tmp_path: Path) -> None:
    actors = [
        Actor(person(6, at=(0.8, 0, 0.3), speed=(1, 0, 0)), tint(0)),
        Actor(person(6, at=(-0.8, 0, 0)), tint(1)),
    ]
    shown = pictures(draw_scene(actors, tmp_path / "x.gif", size=SIZE))
    assert len(shown) == 6
    for time, camera in enumerate(follow(Stage(actors, 20.0), 6, SIZE)):
        right, up, back = camera.axes()
        for actor in actors:
            belly = actor.motion.positions()[time, [0, 6]].mean(axis=0) - camera.target
            depth = 3.2 * camera.span - belly @ back
            scale = SIZE[1] / camera.span * 3.2 * camera.span / depth
            x, y = SIZE[0] / 2 + belly @ right * scale, SIZE[1] / 2 - belly @ up * scale
            around = shown[time][round(y) - 2 : round(y) + 3, round(x) - 2 : round(x) + 3]
            assert count_near(around, actor.colour, 16) >= 10


@pytest.mark.parametrize("reach", [0.0, 0.5, 6.0])
def test_nobody_leaves_the_film_however_far_people_drift_apart(reach: float) -> None:
    past = person(10, speed=(0, 0, 3.0), at=(0, 0, -1.5))
    actors = [Actor(past, PAST, stays=False)]
    actors += [Actor(m, tint(i), past.seconds) for i, m in enumerate(fan(7, 30, reach=reach))]
    stage = Stage(actors, 20.0)
    for time, camera in enumerate(follow(stage, 40, SIZE)):
        for actor in actors:
            frame = time - round(actor.start * 20)
            if 0 <= frame < len(actor.motion):
                seen, _, _ = camera.see(actor.motion.positions()[frame])
                assert (seen > 0).all()
                assert (seen < np.array(SIZE) * draw.SMOOTH).all()


def test_a_picture_has_paper_at_its_panels_tops_and_nobody_cut_off(tmp_path: Path) -> None:
    """All pixels of people's colours lie inside the panels; above and below them is air."""
    people = [Actor(person(at=(0, 0, 0), speed=(2, 0, 0)), PALETTE[3]), Actor(person(at=(0, 0.5, 0)), PALETTE[0])]
    picture = np.asarray(Image.open(draw_scene(people, tmp_path / "x.png"))).astype(int)
    panel = picture[overlay.TITLE : overlay.TITLE + overlay.PANEL, : -overlay.PANEL]
    for colour in (PALETTE[3], PALETTE[0]):
        rows = np.nonzero(np.abs(panel - np.array(colour)).max(axis=-1) <= 4)[0]
        assert len(rows) > 200
        assert rows.min() > 8
        assert rows.max() < overlay.PANEL - 8


def test_walkers_go_from_left_to_right_and_lying_people_are_seen_lengthwise() -> None:
    for way in ((1.0, 0.0, 0.0), (0.0, 0.0, -1.0), (-0.6, 0.0, 0.8)):
        camera = azimuth_of(Stage([Actor(person(40, speed=way), PAST)], 20.0))
        right = np.array([np.cos(camera), 0.0, -np.sin(camera)])
        assert right @ way > 0.9
    lying = person(10, turned=(-np.pi / 2, 0, 0), at=(0, -0.8, 0))
    arms_down = rot.rotvec_to_quat(np.array([[0, 0, -1.4], [0, 0, 1.4]]))
    turns = lying.rotations.copy()
    turns[:, [SMPL22.index("left_shoulder"), SMPL22.index("right_shoulder")]] = arms_down
    camera = azimuth_of(Stage([Actor(replace(lying, rotations=turns), PAST)], 20.0))
    assert abs(np.sin(camera)) > 0.9  # the body lies along z


def test_two_people_who_face_each_other_are_seen_from_the_side() -> None:
    for angle in (0.0, 0.7, 2.0):
        way = np.array([np.sin(angle), 0.0, np.cos(angle)])
        pair = [person(at=-way, turned=(0, angle, 0)), person(at=way, turned=(0, angle + np.pi, 0))]
        camera = azimuth_of(Stage([Actor(m, tint(i)) for i, m in enumerate(pair)], 20.0))
        assert abs(np.array([np.cos(camera), 0.0, -np.sin(camera)]) @ way) > 0.9


# --- when people are in the picture -------------------------------------------------------------------------------


@pytest.mark.parametrize(("fps", "rate"), [(30.0, 30.0), (120.0, 60.0), (25.0, 50.0)])
def test_the_past_is_shown_first_and_the_futures_from_the_frame_after_it(fps: float, rate: float) -> None:
    """Poses at time t of the scene are those of past and future strung together at time t."""
    past, future = person(13, fps, speed=(0, 0, 1.0)), person(31, fps, at=(0, 0, 13 / fps), speed=(0, 0, 1.0))
    stage = Stage([Actor(past, PAST, stays=False), Actor(future, tint(0), past.seconds)], rate)
    for time in range(int((13 + 30) / fps * rate)):
        (shot,) = stage.shots(time)
        assert (shot.actor.colour == PAST) == (time / rate < 13 / fps - 1e-9)
        clamped = min(time / rate, 12 / fps) if shot.actor.colour == PAST else time / rate
        assert shot.shape.places[shot.frame, 0, 2] == pytest.approx(clamped, abs=1e-9)


def test_a_film_of_futures_shows_no_future_before_its_time(tmp_path: Path) -> None:
    past = person(8, speed=(0.5, 0, 0), at=(-0.2, 0, 0))
    shown = pictures(draw_futures(past, fan(3, 10), tmp_path / "x.gif", truth=person(10), size=SIZE))
    assert len(shown) == 18
    above = [picture[: SIZE[1] - overlay.LEGEND] for picture in shown]
    assert all(count_near(p, PAST, 10) > 100 for p in above[:8])
    for i in range(3):
        before = [count_near(p, PALETTE[i], 10) for p in above[:8]]
        after = [count_near(p, PALETTE[i], 10) for p in above[8:]]
        assert max(before) <= 2
        assert min(after[2:]) > 2  # at first they cover each other


def test_a_picture_of_futures_shows_all_colours_past_truth_and_the_map(tmp_path: Path) -> None:
    path = draw_futures(person(20), fan(10, 40), tmp_path / "x.png", truth=person(40), caption="ten ways")
    picture = np.asarray(Image.open(path)).astype(int)
    panels = picture[overlay.TITLE : overlay.TITLE + overlay.PANEL, : -overlay.PANEL]
    ways = picture[overlay.TITLE : overlay.TITLE + overlay.PANEL, -overlay.PANEL :]
    assert count_near(panels, PAST) > 500
    for i in range(10):
        assert count_near(panels, PALETTE[i], 10) > 20
        line = draw.mix(draw.PAPER, PALETTE[i], 0.3 + 0.7 * float(np.clip(1.2 / np.sqrt(10), 0.2, 0.7)))
        assert count_near(ways, line) > 20


def test_held_joints_carry_white_dots_where_they_are(tmp_path: Path) -> None:
    futures = fan(2, 6)
    plain, marked = (
        np.asarray(Image.open(draw_futures(person(4), futures, tmp_path / f"{i}.png", held=held))).astype(int)
        for i, held in enumerate(([], ["left_wrist"]))
    )
    assert count_near(marked, (255, 255, 255), 3) > count_near(plain, (255, 255, 255), 3) + 20
    assert (marked != plain).any(axis=-1).mean() < 0.01


def test_the_past_shown_is_its_last_seconds(tmp_path: Path) -> None:
    assert (
        len(pictures(draw_futures(person(100, speed=(1, 0, 0)), fan(2, 5), tmp_path / "x.gif", lead=0.5, size=SIZE)))
        == 15
    )


# --- everything else ----------------------------------------------------------------------------------------------


def test_the_same_people_give_the_same_bytes(tmp_path: Path) -> None:
    for name in ("x.png", "x.gif"):
        first, second = (
            draw_futures(person(5), fan(3, 5), tmp_path / f"{i}{name}", size=(96, 64)).read_bytes() for i in range(2)
        )
        assert first == second


def test_people_of_one_skeleton_are_equally_tall_whatever_they_do() -> None:
    crouched = person(5)
    turns = crouched.rotations.copy()
    turns[:, 1:6] = rot.rotvec_to_quat(np.array([1.2, 0, 0]))
    stage = Stage([Actor(person(5), PAST), Actor(replace(crouched, rotations=turns), tint(0))], 20.0)
    assert len({shape.height for _, shape, _ in stage.cast}) == 1


def test_fifty_futures_short_ones_and_odd_skeletons_can_be_drawn(tmp_path: Path) -> None:
    draw_futures(person(3), fan(50, 1), tmp_path / "x.png")
    draw_futures(person(1), [person(1)], tmp_path / "x.mp4", size=(96, 64))
    point = Motion(Skeleton(("a",), (-1,), np.zeros((1, 3))), 30.0, np.zeros((3, 3)), np.tile(rot.IDENTITY, (3, 1, 1)))
    chain = Skeleton(("a", "b", "c"), (-1, 0, 1), np.array([[0, 0, 0], [0, 1, 0], [0, 1e6, 0]]))
    snake = Motion(chain, 30.0, np.full((3, 3), -1e6), np.tile(rot.IDENTITY, (3, 3, 1)))
    moved = Motion(SMPL22, 30.0, np.ones((2, 3)), np.tile(rot.IDENTITY, (2, 22, 1)), np.ones((2, 22, 3)))
    for i, motion in enumerate((point, snake, moved)):
        draw_futures(motion, [motion, motion], tmp_path / f"{i}.png", caption="ä\n" * 500)
        draw_scene(
            [Actor(motion, PAST, label="ö" * 900), Actor(person(2), TRUTH)], tmp_path / f"{i}.gif", size=(96, 64)
        )


@pytest.mark.parametrize(
    ("change", "words"),
    [
        ({"futures": []}, "no future"),
        ({"futures": [person(3, 30.0)]}, "frame rate"),
        ({"held": ["tail"]}, "tail"),
        ({"lead": 0.0}, "more than 0"),
        ({"path": "x.avi"}, "must end in"),
        ({"path": "nowhere/x.png"}, "nowhere"),
        ({"path": "x.mp4", "size": (10, 10)}, "pixels"),
        ({"futures": [person(2)] * 300}, "200"),
    ],
    ids=["none", "rate", "joint", "lead", "suffix", "folder", "size", "crowd"],
)
def test_what_cannot_be_drawn_is_refused_in_one_sentence(tmp_path: Path, change: dict, words: str) -> None:
    given = {"futures": [person(3)], "path": "x.png"} | change
    with pytest.raises(MotionloomError, match=words) as caught:
        draw_futures(person(3), given.pop("futures"), tmp_path / given.pop("path"), **given)
    assert "\n" not in str(caught.value)
    assert list(tmp_path.iterdir()) == []


def test_actors_who_never_come_or_cannot_be_seen_are_refused(tmp_path: Path) -> None:
    for actor in (Actor(person(2), PAST, -1.0), Actor(person(2), PAST, opacity=0.0), Actor(person(2), PAST, np.nan)):
        with pytest.raises(MotionloomError, match="opacity"):
            draw_scene([actor], tmp_path / "x.png")
