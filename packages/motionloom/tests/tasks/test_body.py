"""Bodies block by block, against the body of the whole at once."""

from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from motionloom.core import rotations as rot
from motionloom.core.body.feet import clean_feet
from motionloom.core.body.ik import motion_from_positions
from motionloom.core.motion import Motion
from motionloom.core.skeleton import SMPL22
from motionloom.goals.goal import Goal
from motionloom.tasks import body
from motionloom.tasks.body import Places, solve, solve_stream
from tests.tasks.test_edit import person


@pytest.fixture(autouse=True)
def small(monkeypatch: pytest.MonkeyPatch) -> None:
    """Blocks of a second and a half, so that few frames have many borders."""
    monkeypatch.setattr(body, "BLOCK", 60)
    monkeypatch.setattr(body, "MARGIN", 40)
    monkeypatch.setattr(body, "FADE", 15)


def places(frames: int, *, planted: bool = False, high: float = 0.0) -> Places:
    """Somebody who strides through the air or, planted, is said to stand on a foot every other second."""
    positions = person(frames / 20).positions()[:frames]
    positions[..., 1] += high
    contacts = np.zeros((frames, 4))
    if planted:
        contacts[:, :2] = (np.arange(frames)[:, None] % 40) < 15
    return Places(positions, contacts, Goal.nothing(frames))


def cut(whole: Places, sizes: list[int]) -> list[Places]:
    ends = np.cumsum(sizes)
    return [whole.crop(int(end - size), int(end)) for size, end in zip(sizes, ends) if size]


def strung(blocks: list[Motion]) -> Motion:
    root = np.concatenate([block.root for block in blocks])
    return replace(blocks[0], root=root, rotations=np.concatenate([block.rotations for block in blocks]))


def far_from(borders: list[int], frames: int) -> np.ndarray:
    """Frames that are not the first `FADE` of a block."""
    return np.array([all(not 0 <= f - b < body.FADE for b in borders) for f in range(frames)])


def test_blocks_are_the_whole_where_nothing_is_planted() -> None:
    """High above the floor no foot stands, and a body is a matter of its own frame and a few beside it."""
    whole = places(250, high=2.0)
    once, motion = solve(whole, 20.0), strung(list(solve_stream(cut(whole, [70, 1, 99, 80]), 20.0)))
    apart = np.abs(once.positions() - motion.positions()).max(axis=(1, 2))
    assert apart[far_from([60, 120, 180], 250)].max() < 1e-6
    assert apart.max() < 1e-6


def test_blocks_are_nearly_the_whole_where_feet_stand() -> None:
    whole = places(250, planted=True)
    once, motion = solve(whole, 20.0), strung(list(solve_stream([whole], 20.0)))
    apart = np.linalg.norm(once.positions() - motion.positions(), axis=-1).max(axis=1)
    assert apart.max() < 0.02
    assert apart[:60].max() < 0.005


def test_clean_and_contacts_are_those_of_the_frames() -> None:
    """One block: by hand, with and without planted feet."""
    whole = places(80, planted=True)
    raw = motion_from_positions(whole.positions, 20.0)
    for clean, expected in ((False, raw), (True, clean_feet(raw, contacts=whole.contacts))):
        motion = strung(list(solve_stream(cut(whole, [30, 50]), 20.0, foot_lock=clean)))
        np.testing.assert_allclose(motion.positions(), expected.positions(), atol=1e-9)
    assert not np.allclose(raw.positions(), clean_feet(raw, contacts=whole.contacts).positions(), atol=1e-4)


def test_nothing_jumps_at_a_border() -> None:
    """Neither place nor speed nor the sign of a quaternion: frames at borders are as calm as all are."""
    motion = strung(list(solve_stream([places(400, planted=True)], 20.0)))
    points = motion.positions()
    borders = np.arange(60, 400, 60)
    calm = np.setdiff1d(np.arange(2, 399), (borders[:, None] + np.arange(-2, 16)).ravel())
    for order in (1, 2):
        change = np.linalg.norm(np.diff(points, n=order, axis=0), axis=-1).max(axis=1)
        assert (
            change[(borders[:, None] + np.arange(-order, 15)).ravel().clip(0, len(change) - 1)].max()
            < 1.3 * change[calm - order].max()
        )
    assert (motion.rotations[1:] * motion.rotations[:-1]).sum(-1).min() > 0.9


def test_signs_stay_when_a_block_begins_with_the_other_ones(monkeypatch: pytest.MonkeyPatch) -> None:
    """Every second block comes with all quaternions negated, and no border shows it."""
    count = 0

    def moody(positions: np.ndarray, fps: float) -> Motion:
        nonlocal count
        count += 1
        motion = motion_from_positions(positions, fps)
        return replace(motion, rotations=motion.rotations * (-1) ** (count // 2))

    monkeypatch.setattr(body, "motion_from_positions", moody)
    joined = strung(list(solve_stream([places(400)], 20.0, foot_lock=False)))
    assert count >= 5
    assert (joined.rotations[1:] * joined.rotations[:-1]).sum(-1).min() > 0.9
    monkeypatch.undo()
    np.testing.assert_allclose(joined.positions(), solve(places(400), 20.0, foot_lock=False).positions(), atol=1e-6)


@pytest.mark.parametrize("frame", [59, 60, 66, 118, 125])
def test_a_goal_beside_a_border_is_met(frame: int) -> None:
    """The left wrist 10 cm higher than it goes, in the last frame of a block, the first, and in the fade."""
    whole = places(200)
    wrist = SMPL22.index("left_wrist")
    goal = Goal.nothing(200)
    once = solve(whole, 20.0).positions()[frame, wrist]
    goal.positions[frame, wrist], goal.mask[frame, wrist] = once + np.array([0, 0.1, 0]), True
    positions = strung(list(solve_stream(cut(replace(whole, goal=goal), [50, 50, 25, 75]), 20.0))).positions()
    assert np.linalg.norm(positions[frame, wrist] - goal.positions[frame, wrist]) < 0.005
    assert np.abs(positions[frame, SMPL22.index("right_wrist")] - once).max() > 0.1


@settings(max_examples=40, deadline=None)
@given(st.data())
def test_every_frame_comes_once(data: st.DataObject) -> None:
    """Whatever the lengths of pieces and blocks; frames are known by where they are."""
    fade = data.draw(st.integers(1, 4))
    margin = data.draw(st.integers(fade, 5))
    block = data.draw(st.integers(margin, 9))
    sizes = data.draw(st.lists(st.integers(1, 12), min_size=1, max_size=4))
    total = sum(sizes)
    with pytest.MonkeyPatch.context() as patch:
        for name, value in (("BLOCK", block), ("MARGIN", margin), ("FADE", fade)):
            patch.setattr(body, name, value)
        patch.setattr(body, "solve", lambda places, fps, foot_lock: standing(places.positions[:, 0]))
        whole = Places(np.arange(total)[:, None, None] * np.ones((1, 22, 3)), np.zeros((total, 4)), Goal.nothing(total))
        parts = list(solve_stream(cut(whole, sizes), 20.0))
    assert np.allclose(strung(parts).root[:, 0], np.arange(total))
    assert all(len(one) == block for one in parts[:-1])


def standing(root: np.ndarray) -> Motion:
    return Motion(SMPL22, 20.0, root, np.tile(rot.IDENTITY, (len(root), 22, 1)))


def test_a_block_begins_as_the_one_before_saw_it(monkeypatch: pytest.MonkeyPatch) -> None:
    """Bodies one metre further to the side in each block: the way there is smooth, and over after the fade."""
    count = 0

    def aside(places: Places, fps: float, *, foot_lock: bool) -> Motion:
        nonlocal count
        count += 1
        return standing(np.tile([float(count), 1.0, 0.0], (len(places), 1)))

    monkeypatch.setattr(body, "solve", aside)
    x = strung(list(solve_stream([places(170)], 20.0))).root[:, 0]
    assert x[:60] == pytest.approx(1)
    assert x[75:120] == pytest.approx(2)
    assert 0 < x[60] - 1 < 0.05
    assert 0 < 2 - x[74] < 0.05
    assert np.diff(x).min() >= 0
    assert x[67] == pytest.approx(1.5)


def test_how_frames_arrive_does_not_matter() -> None:
    whole = places(230, planted=True)
    one, other = (strung(list(solve_stream(cut(whole, sizes), 20.0))) for sizes in ([230], [7, 100, 3, 60, 60]))
    assert np.array_equal(one.root, other.root)
    assert np.array_equal(one.rotations, other.rotations)
    assert list(solve_stream([], 20.0)) == []
