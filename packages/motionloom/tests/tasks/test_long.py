"""Long motion with a random prior: lengths, seams, goals and paths where they belong, going on from a clip."""

from collections.abc import Iterator
from dataclasses import replace
from itertools import islice
from pathlib import Path

import numpy as np
import pytest

from motionloom.core.errors import MotionloomError
from motionloom.core.features import humanml
from motionloom.core.features.placed import PlacedMotion
from motionloom.core.models.networks.prior import PriorSession
from motionloom.core.models.prior import Prior
from motionloom.core.motion import Motion
from motionloom.goals.goal import Goal
from motionloom.goals.segment import Segment
from motionloom.kinematics.physics import heading
from motionloom.retarget import to_smpl22
from motionloom.tasks.history import Past
from motionloom.tasks.long import compose, compose_stream, compose_takes, long_features
from motionloom.tasks.splice import move_rigidly
from motionloom.tasks.text import sample_features
from motionloom.tasks.unplaced import compose_unplaced
from motionloom.tasks.watching import Denoised, watching
from tests.recorded import tiny
from tests.tasks.test_edit import person
from tests.tasks.test_text import babel_prior

WALK, TURN = "a person walks", "a person turns left"


@pytest.fixture(scope="module")
def prior() -> Prior:
    """Random weights around a walking person, so that what is drawn has human sizes."""
    features = humanml.motion_to_features(person(2.0))
    std = np.full(263, 0.02, np.float32)
    std[:3] = 0.004
    return replace(tiny.prior(), mean=np.asarray(features.mean(0)), std=np.asarray(std))


def features(prior: Prior, segments, **more) -> list[np.ndarray]:
    return list(long_features(prior, segments, **{"steps": 3, **more}))


def whole(prior: Prior, segments, **more) -> Motion:
    blocks = list(compose_stream(prior, segments, **{"steps": 3, **more}))
    return replace(
        blocks[0],
        root=np.concatenate([block.root for block in blocks]),
        rotations=np.concatenate([block.rotations for block in blocks]),
    )


def on_ground(points: np.ndarray) -> Goal:
    """A path through x and z of the pelvis in every frame."""
    goal = Goal.nothing(len(points))
    goal.positions[:, 0, ::2], goal.mask[:, 0, ::2] = points, True
    return goal


def test_frames_are_the_sum_of_the_segments_rounded(prior: Prior) -> None:
    """Alone, shorter than a token, and more than a block of bodies."""
    for seconds in ([0.1], [0.15], [0.52, 1.23, 0.98], [4.0] * 5):
        segments = [Segment(WALK, s, transition=0.2) for s in seconds]
        frames = [round(s * 20) for s in seconds]
        assert [len(piece) for piece in features(prior, segments, steps=1)] == frames
        motion = whole(prior, segments, steps=1)
        assert (len(motion), motion.fps) == (sum(frames), 20)


def test_a_long_motion_is_the_blocks_of_its_stream(prior: Prior) -> None:
    segments = [Segment(WALK, 9.0), Segment(TURN, 9.0)]
    motion, joined = compose(prior, segments, seed=3, steps=1), whole(prior, segments, seed=3, steps=1)
    assert len(list(compose_stream(prior, segments, steps=1))) > 1
    np.testing.assert_array_equal(motion.root, joined.root)
    np.testing.assert_array_equal(motion.rotations, joined.rotations)
    with pytest.raises(MotionloomError, match="there is no segment"):
        compose(prior, [])


def test_company_and_patch_do_not_matter(prior: Prior) -> None:
    """Rows of several lengths, levels, texts and guidances in one network call, or each in its own."""
    net = replace(prior, net=tiny.prior(tiny.PUBLISHED).net)
    segments = [
        Segment((WALK, TURN, "jump")[i % 3], 1.0 + 0.15 * i, guidance=float(i), transition=0.1 * i) for i in range(6)
    ]
    for one in (prior, net):
        alone = features(one, segments, batch_size=1)
        for together in (2, 16):
            for a, b in zip(alone, features(one, segments, batch_size=together), strict=True):
                np.testing.assert_allclose(a, b, atol=1e-4, rtol=0)


def test_one_segment_is_drawn_as_a_single_motion_is(prior: Prior) -> None:
    """With one frame per token there is nothing to settle: the published net's `sample_features`, to the rounding."""
    one = replace(prior, net=tiny.prior(tiny.PUBLISHED).net)
    piece = features(one, [Segment(TURN, 1.0, guidance=4.0)], seed=9)[0]
    other = sample_features(one, [TURN], [20], seeds=[9], steps=3, guidance=4.0)[0]
    np.testing.assert_allclose(piece, other, atol=1e-5, rtol=0)


def test_several_takes_at_once_are_those_that_are_drawn_alone(prior: Prior) -> None:
    """Also where they are more rows than a network call takes; and each is seen on its way."""
    segments = [Segment(WALK, 1.0, transition=0.3), Segment(TURN, 1.2, transition=0.2), Segment(WALK, 0.8)]
    path = on_ground(np.linspace([0.5, 0.0], [1.0, 2.0], 60))
    for more in ({}, {"batch_size": 4}, {"path": path}):
        denoised: list[Denoised] = []
        alone = {name: value for name, value in more.items() if name != "batch_size"}
        with watching(denoised.append):
            takes = list(compose_takes(prior, segments, steps=3, seed=7, count=4, **more))
        assert len(takes) == 4
        for number, take in enumerate(takes):
            expected = whole(prior, segments, seed=7 + number, **alone)
            assert np.abs(take.positions() - expected.positions()).max() < 1e-3
            own = [one for one in denoised if one.rows == (number,)]
            assert [one.move for one in own][-1] == 3
            assert own[-1].positions().shape == (1, 1, 60, 22, 3)
        assert np.abs(takes[0].positions() - takes[1].positions()).max() > 1e-2


def test_seeds_guidance_texts_and_transitions_matter(prior: Prior) -> None:
    segments = [Segment(WALK, 1.5), Segment(TURN, 1.5), Segment(WALK, 1.5)]
    base = features(prior, segments)
    assert all(np.array_equal(a, b) for a, b in zip(base, features(prior, segments), strict=True))
    for at, change in [
        (1, {"guidance": 7.0}),
        (1, {"text": "jump"}),
        (1, {"transition": 0.5}),
        (0, {"transition": 0.3}),
    ]:
        changed = [replace(s, **change) if i == at else s for i, s in enumerate(segments)]
        assert np.abs(features(prior, changed)[at] - base[at]).max() > 1e-3
    assert np.abs(features(prior, segments, seed=1)[0] - base[0]).max() > 1e-3
    assert np.array_equal(features(prior, [replace(s, guidance=2.5) for s in segments])[1], base[1])
    assert np.abs(features(prior, segments, guidance=0.0)[2] - base[2]).max() > 1e-3


def test_guidance_weighs_the_text(prior: Prior) -> None:
    """At 0 the text does not matter."""
    a, b = (features(prior, [Segment(text, 1.0, guidance=0.0)])[0] for text in (WALK, "jump"))
    np.testing.assert_allclose(a, b, atol=1e-6, rtol=0)


def test_what_is_far_behind_changes_nothing(prior: Prior) -> None:
    """Rows tell their neighbours one row per move: with 2 moves, row i depends on rows up to i + 2 and no further."""
    segments = [Segment(WALK, 1.5) for _ in range(6)]
    base = features(prior, segments, steps=2)
    more = features(prior, [*segments[:5], Segment(TURN, 2.0), Segment("jump", 1.0)], steps=2, batch_size=3)
    apart = [np.abs(a - b).max(axis=1) for a, b in zip(base[:5], more)]
    assert max(float(one.max()) for one in apart[:3]) < 1e-4
    assert float(apart[3][:-10].max()) < 1e-4  # of the last it could reach, it reaches what is shared
    assert float(apart[4].max()) > 1e-3


def test_pieces_meet_at_the_seams(prior: Prior) -> None:
    """The step over a seam is one as others are, where neighbours share frames."""
    pieces = features(prior, [Segment(WALK if i % 2 else TURN, 1.5) for i in range(6)], steps=12)
    jumps = np.linalg.norm(np.diff(np.concatenate(pieces), axis=0) / prior.std, axis=1)
    seams = np.cumsum([len(piece) for piece in pieces])[:-1] - 1
    assert jumps[seams].mean() < 1.3 * np.delete(jumps, seams).mean()


def test_the_network_does_as_much_for_each_segment(prior: Prior) -> None:
    """Row moves are segments times steps: time is linear."""
    for count in (1, 4, 9):
        counts: list[int] = []
        features(prior, [Segment(WALK, 1.0, transition=0.3)] * count, steps=4, progress=counts.append)
        assert sum(counts) == 4 * count


def test_endless_segments_come_as_they_are_read_and_leaving_stops_everything(prior: Prior) -> None:
    read: list[object] = []

    def endless() -> Iterator[Segment]:
        try:
            while True:
                read.append(1)
                yield Segment(WALK, 3.0)
        finally:
            read.append("closed")

    blocks = compose_stream(prior, endless(), steps=1, batch_size=2)
    assert not read
    block = next(blocks)
    assert len(block) > 0
    assert len(read) < 20
    blocks.close()  # type: ignore[attr-defined]
    assert read[-1] == "closed"
    assert len(list(islice(long_features(prior, endless(), steps=2), 3))) == 3


@pytest.mark.parametrize("facing", [0.0, 2.0], ids=["ahead", "aside"])
def test_a_goal_is_met_in_the_frame_of_its_segment(prior: Prior, facing: float) -> None:
    """The root of the second segment is asked 0.3 m to the left of and ahead of where it begins, a second later."""
    goal = Goal.nothing(40)
    goal.positions[20, 0, ::2], goal.mask[20, 0, ::2] = (0.3, 0.5), True
    clip = move_rigidly(person(2.0), np.array([np.cos(facing / 2), 0, np.sin(facing / 2), 0]), np.zeros(3), np.zeros(3))
    segments = [Segment(TURN, 2.0), Segment(WALK, 2.0, goal=goal), Segment(TURN, 2.0)]
    calm = prior.std.copy()
    calm[:3] = 0.001  # the neighbours do not know the goal, and what they draw of the overlaps counts
    prior = replace(prior, std=calm)
    first = features(prior, [replace(segments[1], text=TURN)], past=Past.of(clip))[0].astype(np.float64)
    np.testing.assert_allclose(humanml.decode_positions(first)[20, 0, ::2], (0.3, 0.5), atol=0.01)
    pieces = features(prior, segments, past=Past.of(clip))
    place = PlacedMotion(pieces[0], Past.of(clip).end).end
    places = humanml.decode_positions(pieces[1].astype(np.float64))
    np.testing.assert_allclose(places[20, 0, ::2], (0.3, 0.5), atol=0.1)
    motion = whole(prior, segments, start=clip, foot_lock=False)
    np.testing.assert_allclose(motion.root[60, ::2], place.to_world(np.array([0.3, 0, 0.5]))[::2], atol=0.01)


def test_a_path_is_followed_to_its_end(prior: Prior) -> None:
    """A circle around (5, -4) through 12 segments; the last second is as near as the first."""
    t = np.arange(12 * 30) / 20
    points = np.stack([5 + 3 * np.sin(0.3 * t), -4 + 3 * np.cos(0.3 * t)], axis=-1)
    motion = whole(prior, [Segment(WALK, 1.5) for _ in range(12)], path=on_ground(points))
    apart = np.linalg.norm(motion.root[:, ::2] - points, axis=-1)
    assert apart.max() < 0.02
    assert apart[-20:].mean() < apart[:20].mean() + 0.005
    way = np.arctan2(*np.diff(points, axis=0).T)
    turn = (heading(motion.positions())[:-1] - way + np.pi) % (2 * np.pi) - np.pi
    assert np.abs(turn[30:]).mean() < 1.0


@pytest.mark.parametrize("turn", [0.0, 1.0, -2.5])
def test_a_motion_goes_on_where_a_clip_ends(prior: Prior, turn: float) -> None:
    """A clip at 30 fps elsewhere, facing anywhere: next place and velocity are what the clip's last frames lead to."""
    quaternion = np.array([np.cos(turn / 2), 0, np.sin(turn / 2), 0])
    clip = move_rigidly(person(61 / 30, 30.0), quaternion, np.zeros(3), np.array([4.0, 0, -7.0]))
    assert len(clip) == 61  # two seconds: frames 0, 3, 6, ... are frames at 20 fps
    motion = whole(prior, [Segment(WALK, 2.0)], start=clip, foot_lock=False)
    old, new = to_smpl22(clip).resample(20).positions(), motion.positions()  # which stands on the floor
    step = old[-1] - old[-2]
    assert np.linalg.norm(new[0] - (old[-1] + step), axis=-1).max() < 0.05
    apart = np.linalg.norm((new[1] - new[0]) - step, axis=-1)
    assert apart[[0, 3, 6, 9, 12, 15]].max() < 0.005
    assert apart.max() < 0.07  # legs that swing are a pace faster or slower by such a step
    assert abs(float(np.diff(heading(np.stack([old[-1], new[0]])))[0])) < 0.05


def test_a_second_of_a_past_is_seen() -> None:
    assert len(Past.of(person(4.0)).known) == 20


@pytest.mark.parametrize(
    ("seconds", "options", "sentence"),
    [
        ([1.0, 0.5, 1.0], {}, r"segment 2 \('a person walks'\) of 0.5 s is shorter"),
        ([0.05], {}, "segment 1 .* is shorter"),
        ([-1.0], {}, "segment 1 .* is shorter"),
        ([1.0, 1.0], {"path": on_ground(np.zeros((39, 2)))}, "path has 39 frames"),
        ([1.0], {"path": Goal.nothing(20)}, "in every frame"),
        ([1.0], {"seed": -1}, "seed"),
        ([1.0], {"seed": 2**62}, "seed"),
        ([1.0], {"steps": 0}, "steps must be a whole number from 1"),
        ([1.0], {"steps": 51}, "51 steps"),
        ([1.0], {"guidance": float("nan")}, "guidance"),
        ([1.0], {"start": person(0.9)}, "0.90 s long; at least 1 s"),
    ],
    ids=str,
)
def test_what_cannot_be_asked_is_reported(prior: Prior, seconds: list[float], options: dict, sentence: str) -> None:
    with pytest.raises(MotionloomError, match=sentence) as caught:
        compose(prior, [Segment(WALK, s) for s in seconds], **{"steps": 1, **options})
    assert "\n" not in str(caught.value)


@pytest.mark.parametrize(
    "more",
    [
        {"seconds": float("nan")},
        {"seconds": float("inf")},
        {"seconds": 1e6},
        {"transition": float("nan")},
        {"guidance": float("nan")},
        {"guidance": 1e9},
        {"goal": Goal.nothing(19)},
    ],
    ids=["nan", "inf", "hours", "transition", "guidance", "too strong", "goal"],
)
def test_segments_of_nonsense_are_refused(more: dict) -> None:
    with pytest.raises(MotionloomError, match="the segment 'a person walks' has"):
        Segment(**{"text": WALK, "seconds": 1.0, **more})


def test_weights_for_other_numbers_are_refused(prior: Prior) -> None:
    with pytest.raises(MotionloomError, match="135 numbers a frame"):
        compose(
            replace(prior, mean=np.zeros((135,), np.float32), std=np.ones((135,), np.float32)), [Segment(WALK, 1.0)]
        )


@pytest.mark.parametrize("flags", [False, True], ids=["plain", "transitions"])
def test_weights_of_babels_numbers_make_long_motions_at_their_own_rate(tmp_path: Path, flags: bool) -> None:
    """30 frames a second, from over the origin and facing +Z; take i is that of its own seed."""
    babel = babel_prior(tmp_path, flags=flags)
    segments = [Segment("walk", 1.0, transition=0.4), Segment("turn left", 2.0)]
    first, second = compose_unplaced(babel, segments, steps=3, count=2, foot_lock=False)
    assert [(len(one), one.fps) for one in (first, second)] == [(90, 30.0), (90, 30.0)]
    np.testing.assert_allclose(heading(first.positions())[0], 0, atol=1e-5)
    (alone,) = compose_unplaced(babel, segments, steps=3, seed=1, foot_lock=False)
    np.testing.assert_allclose(second.positions(), alone.positions(), atol=1e-3)


def test_a_network_with_flags_sees_what_neighbours_share(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """Transitions of 12 and 18 frames: half of either on each side of a seam, whole in both rows."""
    babel, seen = babel_prior(tmp_path, flags=True), []
    bind = PriorSession.bind
    monkeypatch.setattr(PriorSession, "bind", lambda net, cond: seen.append(cond) or bind(net, cond))
    segments = [Segment("walk", 1.0, transition=0.4), Segment("jump", 1.0, transition=0.6), Segment("walk", 1.0)]
    list(long_features(babel, segments, steps=2))
    rows = [cond.flags[0].tolist() for cond in seen[::2]]
    assert rows == [[0] * 24 + [1] * 12, [1] * 12 + [0] * 15 + [1] * 18, [1] * 18 + [0] * 21]


def test_babels_numbers_know_no_places(tmp_path: Path) -> None:
    babel, goal = babel_prior(tmp_path, flags=False), on_ground(np.zeros((20, 2)))
    with pytest.raises(MotionloomError, match="goals need 263"):
        list(compose_unplaced(babel, [Segment("walk", 1.0, goal=goal)], steps=2))
    with pytest.raises(MotionloomError, match="long motion needs 263"):
        list(compose(babel, [Segment("walk", 1.0)], steps=2))
