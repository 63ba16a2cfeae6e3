"""An answer to somebody's motion, and long duets, with a random prior and with samplers that know the answer."""

from dataclasses import replace

import numpy as np
import pytest

from motionloom.core.errors import MotionloomError
from motionloom.core.features import pair as two
from motionloom.core.features.pair import PairMotion
from motionloom.core.models.networks.pair import PairSession, join
from motionloom.core.models.networks.prior_condition import Bound
from motionloom.core.models.pair import PairBlock
from motionloom.core.models.prior import Prior
from motionloom.core.skeleton import SMPL22
from motionloom.goals.goal import Goal
from motionloom.goals.segment import Segment
from motionloom.kinematics.physics import heading
from motionloom.retarget import to_smpl22
from motionloom.tasks import duet as tasks
from motionloom.tasks.duet import compose_pair, compose_pair_stream, duet_features, react
from motionloom.tasks.splice import person_at_20
from tests.noise import normal
from tests.recorded import tiny
from tests.tasks.two_people import block as block_of
from tests.tasks.two_people import walkers

SEGMENTS = [
    Segment("a person walks", 1.0, transition=0.4),
    Segment("a person turns :: a person jumps", 0.8, transition=0.6),
    Segment("a person walks", 0.9),
]


@pytest.fixture(scope="module")
def prior() -> Prior:
    return tiny.prior()


@pytest.fixture(scope="module")
def block(prior: Prior) -> PairBlock:
    return block_of(prior)


# Somebody is given


def test_whoever_is_given_stays_and_the_other_stands_where_he_was_drawn(
    prior: Prior, block: PairBlock, monkeypatch: pytest.MonkeyPatch
) -> None:
    """In place of the sampler the features of the real partner, told in another world: he comes back in his place."""
    walker, partner = walkers(1.5, larger=1.0)
    truth = to_smpl22(partner)
    call = {}

    def true(prior, net, prompts, frames, **how):
        call.update(how)
        uniform = np.stack([person_at_20(motion) for motion in (walker, partner)])
        encoded = two.encode(uniform)
        elsewhere = two.compose(np.array([0.0, 1.0, 7.0, -3.0]), encoded.poses)
        return PairMotion.stack([encoded._replace(poses=elsewhere)])

    monkeypatch.setattr(tasks, "pair_features", true)
    [(first, second)] = react(prior, block, walker, "two people walk", foot_lock=False)
    assert first is walker
    assert (len(second), second.fps, second.skeleton) == (len(walker), walker.fps, SMPL22)
    apart = np.linalg.norm(second.positions() - truth.positions(), axis=-1)
    assert apart.mean() < 0.03
    mask = call["edits"].observed.mask
    assert mask[0, 1:].all()
    assert not mask[0, 0].any()
    assert not mask[1].any()


def test_the_given_motion_may_stand_on_a_floor_of_its_own(prior: Prior, block: PairBlock) -> None:
    first, _ = walkers(1.2)
    raised = replace(first, root=first.root + np.array([0.0, 0.2, 0.0]))
    [(_, low)] = react(prior, block, first, steps=2, foot_lock=False)
    [(_, high)] = react(prior, block, raised, steps=2, foot_lock=False)
    np.testing.assert_allclose(high.root - low.root, np.broadcast_to([0.0, 0.2, 0.0], low.root.shape), atol=0.01)


def test_motions_that_nobody_can_react_to_are_refused(prior: Prior, block: PairBlock) -> None:
    first, _ = walkers(1.2)
    for wrong in (first.frames(0, 5), replace(first, fps=0.1)):
        with pytest.raises(MotionloomError, match="can be reacted to"):
            react(prior, block, wrong)


# Several prompts


def test_a_long_duet_has_all_frames_of_its_segments_and_no_seam(prior: Prior, block: PairBlock) -> None:
    duet = compose_pair(prior, block, SEGMENTS, seed=1, steps=4, foot_lock=False)
    for motion in duet:
        assert len(motion) == 20 + 16 + 18
        steps = np.linalg.norm(np.diff(motion.root, axis=0), axis=-1)
        assert max(steps[19], steps[35]) < 1.5 * np.median(steps) + 0.05


def test_rows_denoised_together_or_alone_make_the_same(prior: Prior, block: PairBlock) -> None:
    net = block.net(prior)
    longer = [replace(segment, seconds=segment.seconds + 2.5) for segment in SEGMENTS]  # long enough for being led
    both = [tasks._segments_of(longer, i, None, 0) for i in (0, 1)]
    one, several = (list(duet_features(prior, net, both, steps=3, batch_size=n)) for n in (1, 8))
    for (a, poses), (b, others) in zip(one, several, strict=True):
        np.testing.assert_allclose(a, b, rtol=0, atol=1e-4)
        np.testing.assert_allclose(poses, others, atol=1e-3)
    assert [piece.shape for piece, _ in one] == [(2, n, 263) for n in (70, 66, 68)]
    again = one[1][0][:, 1:3] - one[0][0][:, -3:-1]  # the second row begins with what the first one ends with
    assert np.abs(again).max() > 1e-3


def test_only_who_listens_hears_the_prompt_of_the_other(prior: Prior, block: PairBlock) -> None:
    changed = [SEGMENTS[0], replace(SEGMENTS[1], text="a person turns :: a person walks left"), SEGMENTS[2]]
    for one, deaf in ((block, False), (block_of(prior, fresh=True), True)):
        rows = [[tasks._segments_of(some, i, None, 0) for i in (0, 1)] for some in (SEGMENTS, changed)]
        first, second = (
            np.concatenate([p[0] for p, _ in duet_features(prior, one.net(prior), r, steps=3)]) for r in rows
        )
        assert np.allclose(first, second, atol=1e-5) == deaf


def test_each_row_is_shown_and_moved_from_where_the_two_are_when_it_begins(
    prior: Prior, block: PairBlock, monkeypatch: pytest.MonkeyPatch
) -> None:
    """A network that always guesses the same: D of a later row, as shown without its noise, is what bodies made of
    the finished motion stand like at the first frame of that row; each is led with noise and words of its own."""
    inputs: dict[int, list[tuple[np.ndarray, int]]] = {}
    begins: dict[int, np.ndarray] = {}
    leads: list[dict] = []
    poses = np.array([[1.0, 0.0, 0.0, 0.0], [0.6, 0.8, 1.0, 2.0]])
    places = block.config.places.encode(poses)
    features = np.zeros((263,), np.float32)
    features[:4] = np.array([0.03, 0.01, 0.02, 0.9])  # everybody walks a circle, the second another one
    other = features * np.array([-0.5] + [1.0] * 262)
    clean = (np.stack([features, other]) - prior.mean) / prior.std

    def constant(net: PairSession, x: np.ndarray, level, bound) -> np.ndarray:
        half = len(x) // 2  # with text, then without
        for row in range(half // 2):
            length = int(bound.lengths[2 * row])
            inputs.setdefault(length, []).append((x[2 * row : 2 * row + 2, 0, :4].copy(), int(level[2 * row])))
        motion = np.repeat(np.tile(clean, (len(x) // 2, 1))[:, None], x.shape[1] - 1, axis=1)
        return join(np.tile(places, (len(x) // 2, 1)), motion)

    def led(_: object, row: tasks._PairRow, level: int, motion: np.ndarray, begin: np.ndarray, *, state):
        begins[row.length] = begin
        return motion

    def guidance(prior: Prior, net: PairSession, bound: Bound, **how) -> object:
        leads.append(how | {"text": bound.text})
        return None

    monkeypatch.setattr(PairSession, "__call__", constant)
    monkeypatch.setattr(tasks._PairDenoiser, "_with_pose_guidance", led)
    monkeypatch.setattr(tasks, "relative_pose_guidance", guidance)
    segments = [
        Segment("a person walks", 1.0, transition=0.4),
        Segment("a person turns :: a person jumps", 0.8, transition=0.6),
        Segment("a person walks", 1.1),
    ]
    both = [tasks._segments_of(segments, i, None, 0) for i in (0, 1)]
    both[1][0] = replace(both[1][0], goal=Goal.nothing(20))  # which asks for nothing
    pieces = list(duet_features(prior, block.net(prior), both, steps=4, pair_guidance=0.7))
    motion = np.concatenate([piece for piece, _ in pieces], axis=1).astype(np.float64)
    there = two.decode(motion, poses.astype(np.float64))[:, :, 0]
    for length, frame in ((4 + 16 + 6, 20 - 4), (6 + 22, 36 - 6)):  # by half of the transition earlier
        calls = inputs[length]
        noise = calls[0][0]
        signal, spread = prior.schedule.at(calls[-1][1])
        conditioned = (calls[-1][0] - spread * noise) / signal
        turned = 2 * np.array([-0.03, 0.015]) * frame  # the heading's convention: features tell minus half of the turn
        facing = np.array([0.0, np.arctan2(0.8, 0.6)]) + turned
        way = there[1, frame] - there[0, frame]
        c, s = np.cos(facing[0]), np.sin(facing[0])
        expected = [
            np.cos(facing[1] - facing[0]),
            np.sin(facing[1] - facing[0]),
            c * way[0] - s * way[2],
            c * way[2] + s * way[0],
        ]
        np.testing.assert_allclose(conditioned[0], expected, atol=1e-3)
        np.testing.assert_allclose(two.relative(begins[length][0], begins[length][1]), expected, atol=1e-3)
    assert len({seed for how in leads for seed in how["seeds"]}) == 6
    assert {how["weight"] for how in leads} == {0.7}
    assert not any(any(how["frozen"]) for how in leads)
    for how, text in zip(leads, ("a person walks", "a person turns", "a person walks"), strict=True):
        net = block.net(prior)
        words = [text, "a person jumps" if text == "a person turns" else text]
        np.testing.assert_allclose(how["text"], net.bind(prior.condition(words)).text, atol=1e-5)


@pytest.mark.parametrize("spacing", [None, 0, 1])
def test_a_block_that_wants_them_beside_each_other_keeps_them_there_for_long(
    prior: Prior, block: PairBlock, monkeypatch: pytest.MonkeyPatch, spacing: int | None
) -> None:
    """A network that always draws two people who walk apart by 0.3 m/s, and always says they stand 1 and 2 m apart;
    who has a goal of his own is not moved for that."""
    beside = np.array([[1.0, 0.0, 0.0, 0.0], [1.0, 0.0, 1.0, 2.0]])
    places, features = block.config.places.encode(beside), np.zeros((2, 263), np.float32)
    features[1, 2], features[:, 3] = 0.015, 0.9
    clean = (features - prior.mean) / np.where(prior.std > 0, prior.std, np.float32(1))

    def constant(net: PairSession, x: np.ndarray, level, bound) -> np.ndarray:
        motion = np.repeat(np.tile(clean, (len(x) // 2, 1))[:, None], x.shape[1] - 1, axis=1)
        return join(np.tile(places, (len(x) // 2, 1)), motion)

    monkeypatch.setattr(PairSession, "__call__", constant)
    segments = [Segment("a person walks", 4.0, transition=1.0)] * 3
    both = [tasks._segments_of(segments, i, None, 0) for i in (0, 1)]
    if spacing is not None:
        goal = Goal.nothing(80)
        goal.mask[0, 0, 1], goal.positions[0, 0, 1] = True, 0.9  # what he does anyway
        both[spacing] = [replace(segment, goal=goal) for segment in both[spacing]]
    for together, far in ((0.0, (3.0, 4.0)), (1.0, (0.0, 0.8))):
        pieces = list(duet_features(prior, block.net(prior), both, steps=4, pair_guidance=together))
        whole_features = np.concatenate([piece for piece, _ in pieces], axis=1).astype(np.float64)
        roots = two.decode(whole_features, pieces[0][1])[:, :, 0]
        off = np.linalg.norm((roots[1] - roots[0])[:, [0, 2]] - [1.0, 2.0], axis=-1)
        assert far[0] <= off.max() < far[1]
        if spacing is not None and together:
            np.testing.assert_allclose(
                roots[spacing, :, 2] - roots[spacing, 0, 2], spacing * 0.015 * np.arange(240), atol=0.02
            )


def test_a_row_is_led_from_where_it_begins_and_shows_the_noised_state(prior: Prior, block: PairBlock) -> None:
    net, call = block.net(prior), {}

    def lead(state: np.ndarray, clean: np.ndarray, level: int) -> np.ndarray:
        call.update(state=state, clean=clean, level=level)
        return clean + 1

    row = tasks._PairRow((), net, lead, None, None)
    denoiser = tasks._PairDenoiser(prior, net, [50, 1], 1.0, True)
    state, motion = normal((2, 2, 30, 263), 0)
    begin = np.array([[1.0, 0.0, 0.0, 0.0], [0.6, 0.8, 1.0, 2.0]])
    assert np.array_equal(denoiser._with_pose_guidance(row, 50, motion, begin, state=state), motion + 1)
    assert call["level"] == 50
    assert np.array_equal(call["state"], join(block.config.places.encode(begin), state))
    assert np.array_equal(call["clean"], join(block.config.places.encode(begin), motion))


def test_a_path_for_one_of_them_holds_through_all_segments(
    prior: Prior, block: PairBlock, monkeypatch: pytest.MonkeyPatch
) -> None:
    """A network that always draws two real people, who look where their features say that they do."""
    encoded = two.encode(np.stack([person_at_20(motion) for motion in walkers(1.2, larger=1.0)]))
    clean = (np.asarray(encoded.features[:, 8]).astype(np.float32) - prior.mean) / prior.std
    places = block.config.places.encode(np.asarray(encoded.poses).astype(np.float32))

    def constant(net: PairSession, x: np.ndarray, level, bound) -> np.ndarray:
        motion = np.repeat(np.tile(clean, (len(x) // 2, 1))[:, None], x.shape[1] - 1, axis=1)
        return join(np.tile(places, (len(x) // 2, 1)), motion)

    monkeypatch.setattr(PairSession, "__call__", constant)
    path = Goal.nothing(54)
    path.positions[:, 0, 0] = np.linspace(2.0, 5.0, 54)
    path.mask[:, 0] = [True, False, True]
    duet = compose_pair(prior, block, SEGMENTS, path=path, person=1, steps=3, foot_lock=False)
    off = np.linalg.norm((duet[1].root - path.positions[:, 0])[:, [0, 2]], axis=-1)
    assert off.mean() < 0.03
    assert abs(heading(duet[1].positions()[:1])[0] - np.pi / 2) < 0.5
    other = replace(path, positions=path.positions + np.array([0.0, 0.0, 1.0]))
    duet = compose_pair(prior, block, SEGMENTS, path=path, person=1, other=other, steps=3, foot_lock=False)
    for one, goal in zip(duet, (other, path), strict=True):
        assert np.linalg.norm((one.root - goal.positions[:, 0])[:, [0, 2]], axis=-1).mean() < 0.03
    with pytest.raises(MotionloomError, match="give both"):
        compose_pair(prior, block, SEGMENTS, other=other, steps=3)


def test_guesses_go_where_their_person_is_asked_to_be(
    prior: Prior, block: PairBlock, monkeypatch: pytest.MonkeyPatch
) -> None:
    """A network that always draws people who stand; the second is asked to be 0.3 m to his left after two seconds."""
    features = np.zeros((2, 263), np.float32)
    features[:, 3] = 0.9
    clean = (features - prior.mean) / np.where(prior.std > 0, prior.std, np.float32(1))

    def constant(net: PairSession, x: np.ndarray, level, bound) -> np.ndarray:
        motion = np.repeat(np.tile(clean, (len(x) // 2, 1))[:, None], x.shape[1] - 1, axis=1)
        return join(x[:, 0, :4], motion)

    monkeypatch.setattr(PairSession, "__call__", constant)
    both = [tasks._segments_of([Segment("a person walks", 2.0)], i, None, 0) for i in (0, 1)]
    goal = Goal.nothing(40)
    goal.mask[39, 0, 0], goal.positions[39, 0, 0] = True, 0.3
    both[1] = [replace(both[1][0], goal=goal)]
    [(piece, _)] = duet_features(prior, block.net(prior), both, steps=4, pair_guidance=0.0)
    first, second = two.along(piece.astype(np.float64))[:, 39, 2]
    assert abs(first) < 1e-4
    assert second == pytest.approx(0.3, abs=0.05)


def test_a_long_duet_is_the_blocks_of_its_stream(prior: Prior, block: PairBlock) -> None:
    blocks = list(compose_pair_stream(prior, block, [Segment("two people hug", 9.0)] * 2, seed=3, steps=1))
    duet = compose_pair(prior, block, [Segment("two people hug", 9.0)] * 2, seed=3, steps=1)
    assert len(blocks) > 1
    for motion, pieces in zip(duet, zip(*blocks, strict=True), strict=True):
        np.testing.assert_array_equal(motion.root, np.concatenate([piece.root for piece in pieces]))
        np.testing.assert_array_equal(motion.rotations, np.concatenate([piece.rotations for piece in pieces]))


def test_nothing_is_composed_of_nothing(prior: Prior, block: PairBlock) -> None:
    for segments, message in (([], "no segment"), ([Segment("a :: b :: c", 2)], "around one ::")):
        with pytest.raises(MotionloomError, match=message):
            compose_pair(prior, block, segments)


@pytest.mark.parametrize("share", [-0.1, 8, float("nan")])
def test_nobody_is_kept_together_by_more_than_wholly(prior: Prior, block: PairBlock, share: float) -> None:
    with pytest.raises(MotionloomError, match="pair_guidance must be 0 to 1"):
        compose_pair(prior, block, SEGMENTS, pair_guidance=share)
