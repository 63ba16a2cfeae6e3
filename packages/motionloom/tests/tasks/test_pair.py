"""Two people with a random prior: exchange, company, what is known, paths, and motions of two bodies in one world."""

from dataclasses import replace

import numpy as np
import pytest

from motionloom.core.diffusion import levels
from motionloom.core.errors import MotionloomError
from motionloom.core.features import humanml
from motionloom.core.features import pair as two
from motionloom.core.features.humanml import positions_at
from motionloom.core.features.pair import PairMotion
from motionloom.core.ground import GroundPose
from motionloom.core.methods.edit import Observed
from motionloom.core.models.networks.pair import PairSession
from motionloom.core.models.pair import PairBlock
from motionloom.core.models.prior import Prior
from motionloom.core.motion import Motion
from motionloom.goals.goal import Goal
from motionloom.kinematics.shared_world import one_world
from motionloom.retarget import to_smpl22
from motionloom.tasks import pair
from motionloom.tasks.duet import react
from motionloom.tasks.pair import (
    PairEdits,
    complete_pair,
    generate_pair,
    pair_features,
    person_seeds,
)
from motionloom.tasks.people import PairPast, known_state
from motionloom.tasks.text import finish, sample_features
from tests.noise import normal
from tests.recorded import tiny
from tests.tasks.test_edit import person as one_person
from tests.tasks.two_people import block as block_of
from tests.tasks.two_people import walkers

FRAMES = 14
PROMPTS = ["a person walks", "a person turns left"]


@pytest.fixture(scope="module")
def prior() -> Prior:
    return tiny.prior()


@pytest.fixture(scope="module")
def block(prior: Prior) -> PairBlock:
    return block_of(prior)


def features(prior: Prior, block: PairBlock, prompts: list[str], seeds: list[int], **options):
    return pair_features(prior, block.net(prior), prompts, FRAMES, seeds=seeds, steps=4, **options)


def both_known(prior: Prior, block: PairBlock, count: int = 5) -> Observed:
    """A state whose first frames and D are known."""
    first = normal((2, count, 263), 3) * prior.std + prior.mean
    poses = np.array([[1.0, 0.0, 0.0, 0.0], [0.6, 0.8, 1.0, 2.0]])
    return known_state(block.net(prior), PairMotion(first[None], poses[None]), FRAMES)


@pytest.mark.parametrize("known", [False, True], ids=["free", "prefix"])
def test_exchanged_people_get_exchanged_motions(prior: Prior, block: PairBlock, known: bool) -> None:
    observed = both_known(prior, block)
    options = {"edits": PairEdits(observed)} if known else {}
    exchanged = replace(observed, values=np.flip(observed.values, 0), mask=np.flip(observed.mask, 0))
    turned = {"edits": PairEdits(exchanged)} if known else {}
    one, poses = features(prior, block, PROMPTS, [1, 2], **options)
    other, exchanged = features(prior, block, PROMPTS[::-1], [2, 1], **turned)
    np.testing.assert_allclose(one[0], np.flip(other[0], 0), rtol=0, atol=1e-4)
    expected = two.relative(exchanged[0, 1], exchanged[0, 0])
    np.testing.assert_allclose(two.relative(poses[0, 0], poses[0, 1]), expected, rtol=0, atol=1e-4)
    assert not np.allclose(one[0, 0], one[0, 1], atol=1e-2)


def test_a_pair_is_the_same_in_any_company(prior: Prior, block: PairBlock) -> None:
    """Nine pairs are more than are denoised at once."""
    seeds = list(range(18))
    many, poses = features(prior, block, PROMPTS * 9, seeds)
    for number in (0, 7, 8):
        alone, there = features(prior, block, PROMPTS, seeds[2 * number : 2 * number + 2])
        np.testing.assert_allclose(many[number], alone[0], rtol=0, atol=1e-3)
        np.testing.assert_allclose(poses[number], there[0], rtol=1e-5, atol=1e-3)


def test_people_who_do_not_listen_are_the_priors_own(prior: Prior) -> None:
    how = {"spacing": "index"}  # guided on all levels alike
    pair, _ = features(prior, block_of(prior, fresh=True), PROMPTS, [3, 4], **how)
    alone = sample_features(prior, PROMPTS, [FRAMES] * 2, seeds=[3, 4], steps=4, **how)
    np.testing.assert_allclose(pair[0], np.stack(alone), rtol=0, atol=1e-5)


def test_the_other_persons_words_matter_to_people_who_listen(prior: Prior, block: PairBlock) -> None:
    one, _ = features(prior, block, PROMPTS, [3, 4])
    other, _ = features(prior, block, [PROMPTS[0], "a person jumps"], [3, 4])
    assert np.abs(one[0, 0] - other[0, 0]).max() > 1e-3


def test_what_is_known_is_shown_without_noise_and_comes_back(
    prior: Prior, block: PairBlock, monkeypatch: pytest.MonkeyPatch
) -> None:
    states: list[tuple[np.ndarray, int]] = []
    forward = PairSession.__call__

    def recorded(net: PairSession, x: np.ndarray, level: int, bound) -> np.ndarray:
        states.append((x[:2].copy(), level))
        return forward(net, x, level, bound)

    monkeypatch.setattr(PairSession, "__call__", recorded)
    observed = both_known(prior, block)
    state, mask = observed.values, observed.mask
    pair, _ = features(prior, block, PROMPTS, [1, 2], edits=PairEdits(observed))
    assert [level for _, level in states] == list(levels(prior.schedule, 4, spacing="early"))[:-1]
    for x, level in states:
        np.testing.assert_allclose(x[mask], prior.schedule.at(level)[0] * state[mask], atol=1e-5)
    expected = state[:, 1:6] * prior.std + prior.mean
    np.testing.assert_allclose(pair[0, :, :5], expected, rtol=0, atol=1e-6)
    assert np.abs(pair[0, :, 5:] - prior.mean).max() > 1e-3


def test_a_change_of_guesses_sees_one_persons_frames_and_no_more(prior: Prior, block: PairBlock) -> None:
    observed, frames = both_known(prior, block), []
    state, mask = observed.values, observed.mask

    def change(guess: np.ndarray, level: int) -> np.ndarray:
        frames.append(guess)
        return np.where(mask[1, 1:], guess, 0.5)

    pair, _ = features(prior, block, PROMPTS, [1, 2], edits=PairEdits(observed, [None, change]))
    assert len(frames) == 5
    assert all(np.array_equal(guess[:5], state[1, 1:6]) for guess in frames)
    assert frames[0].shape == (FRAMES, 263)
    np.testing.assert_allclose(
        pair[0, 1, 5:], np.broadcast_to(0.5 * prior.std + prior.mean, (FRAMES - 5, 263)), atol=1e-5
    )
    assert np.abs(pair[0, 0, 5:] - pair[0, 1, 5:]).max() > 1e-2


def test_duets_are_repeated_by_their_seeds(prior: Prior, block: PairBlock) -> None:
    few = {"seconds": 0.6, "steps": 2, "foot_lock": False}
    several = generate_pair(prior, block, PROMPTS[0], count=2, seed=4, **few)
    again = generate_pair(prior, block, PROMPTS[0], count=1, seed=4, **few)
    np.testing.assert_allclose(several[0][1].positions(), again[0][1].positions(), atol=1e-4)
    assert np.abs(several[1][1].positions() - again[0][1].positions()).max() > 1e-2
    [second] = generate_pair(prior, block, PROMPTS[0], count=1, first=1, seed=4, **few)
    np.testing.assert_allclose(several[1][1].positions(), second[1].positions(), atol=1e-4)
    added = {"seed": 4, "seconds": 0.5, "steps": 2, "foot_lock": False}
    for make in (
        lambda **some: complete_pair(prior, block, walkers(1.2), **some, **added),
        lambda **some: react(prior, block, walkers(1.2)[0], **some, seed=4, steps=2, foot_lock=False),
    ):
        np.testing.assert_allclose(make(count=2)[1][1].positions(), make(count=1, first=1)[0][1].positions(), atol=1e-4)
    assert [len(motion) for motion in again[0]] == [12, 12]


def test_seeds_of_people_go_with_them() -> None:
    assert person_seeds((7, 9), 3) == person_seeds((9, 7), 3)[::-1]
    numbers = [s for number in range(50) for s in person_seeds(1, number)]
    assert len(set(numbers)) == 100
    assert all(0 <= s < 2**63 for s in numbers)


def test_files_keep_the_distance_that_was_drawn(prior: Prior, block: PairBlock) -> None:
    few = {"steps": 4, "bodies": False}
    [duet] = generate_pair(prior, block, PROMPTS[0], seconds=0.7, seed=1, foot_lock=False, **few)
    pair, poses = pair_features(prior, block.net(prior), [PROMPTS[0]] * 2, 14, seeds=person_seeds(1, 0), **few)
    alone = np.stack([finish(prior, one, foot_lock=False).positions() for one in pair[0]])
    expected = two.to_world(alone, poses[0].astype(np.float64)[:, None, None])
    np.testing.assert_allclose(np.stack([motion.positions() for motion in duet]), expected, atol=1e-4)


def walk(frames: int) -> Goal:
    """Two metres along a quarter circle that begins in (1, 0, 2) towards +X."""
    goal = Goal.nothing(frames)
    angle = np.linspace(0, np.pi / 2, frames)
    goal.positions[:, 0] = np.stack([1 + 1.3 * np.sin(angle), 0 * angle, 3.3 - 1.3 * np.cos(angle)], axis=-1)
    goal.mask[:, 0] = [True, False, True]
    return replace(goal, start=GroundPose(1.0, 2.0, np.pi / 2))


@pytest.mark.parametrize("person", [0, 1])
def test_a_path_leads_one_of_the_two(prior: Prior, block: PairBlock, person: int) -> None:
    goal = walk(40)
    [duet] = generate_pair(
        prior, block, PROMPTS[0], goals=(goal, None) if person == 0 else (None, goal), steps=4, seed=2, foot_lock=False
    )
    off = [np.linalg.norm((m.root - goal.positions[:, 0])[:, [0, 2]], axis=-1).mean() for m in duet]
    assert off[person] < 0.02 < off[1 - person]
    assert len(duet[0]) == len(duet[1]) == 40


def test_two_people_with_a_goal_each_follow_both(prior: Prior, block: PairBlock) -> None:
    first = walk(40)
    there = GroundPose(2.0, 0.5, 1.0)
    second = first.placed(there)
    [duet] = generate_pair(prior, block, PROMPTS[0], goals=(first, second), steps=4, seed=2, foot_lock=False)
    for motion, goal in zip(duet, (first, second), strict=True):
        assert np.linalg.norm((motion.root - goal.positions[:, 0])[:, [0, 2]], axis=-1).mean() < 0.02
    with pytest.raises(MotionloomError, match="40 and 30 frames"):
        generate_pair(prior, block, PROMPTS[0], goals=(walk(40), walk(30)))


def test_the_other_one_stands_as_drawn_beside_who_follows_a_path(
    prior: Prior, block: PairBlock, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Whoever starts at the goal's place, the other is seen from him as the drawn stands say."""
    pairs = []
    real = pair.pair_features
    monkeypatch.setattr(pair, "pair_features", lambda *a, **k: pairs.append(real(*a, **k)) or pairs[-1])
    numbers = humanml.motion_to_features(one_person(2.0))
    human = replace(prior, mean=numbers.mean(0), std=np.full(263, 0.02, np.float32))  # whom a body can be fitted to
    [duet] = generate_pair(human, block, PROMPTS[0], goals=(None, walk(40)), steps=3, foot_lock=False, bodies=False)
    poses = pairs[0][1][0].astype(np.float64)
    there = np.array([np.cos(np.pi / 2), np.sin(np.pi / 2), 1.0, 2.0])
    other = GroundPose.of_numbers(two.compose(there, two.relative(poses[1], poses[0])))
    np.testing.assert_allclose(duet[0].root[0, [0, 2]], [other.x, other.z], atol=0.05)


# Going on


def test_one_ground_for_two_bodies_is_undone(prior: Prior) -> None:
    pasts = PairPast.of(walkers(1.2))
    alone = [to_smpl22(motion).positions() for motion in pasts.motions]
    common = one_world(alone, pasts.legs)
    for i in (0, 1):
        np.testing.assert_allclose(pasts.to_own_scale(i, common[i]), alone[i], atol=1e-9)
    assert np.abs(common[0] - alone[0]).max() > 0.01


def test_pasts_stay_bit_for_bit_and_go_on_without_a_jump(prior: Prior, block: PairBlock) -> None:
    past = walkers(1.2)
    [duet] = complete_pair(prior, block, past, steps=3, seconds=0.5)
    for person, old in zip(duet, past, strict=True):
        assert len(person) == len(old) + round(0.5 * old.fps)
        assert person.skeleton == old.skeleton
        assert np.array_equal(person.root[: len(old)], old.root)
        assert np.array_equal(person.rotations[: len(old)], old.rotations)
        steps = np.linalg.norm(np.diff(person.positions(), axis=0), axis=-1).max(axis=1)
        assert steps[len(old) - 1] < 1.5 * steps[len(old) - 4 : len(old) - 1].max() + 0.02


def test_a_true_future_comes_back_onto_both_bodies_in_place(
    prior: Prior, block: PairBlock, monkeypatch: pytest.MonkeyPatch
) -> None:
    """In place of the sampler, the features of what the two (one a fifth larger) really did next."""
    whole = walkers(1.75)
    count = round(1.2 * whole[0].fps)
    past = tuple(motion.frames(0, count) for motion in whole)

    def true(prior, net, prompts, frames, **_):
        legs = PairPast.of(whole).legs
        frames_seen = PairPast.of((past[0], past[1])).known.features.shape[1]
        at = count - 1 + (np.arange(frames + 1) - (frames_seen - 1)) / 20 * whole[0].fps
        uniform = one_world([to_smpl22(motion).positions() for motion in whole], legs)
        encoded = two.encode(np.stack([positions_at(person, at) for person in uniform]))
        return PairMotion.stack([encoded])

    monkeypatch.setattr(pair, "pair_features", true)
    [duet] = complete_pair(prior, block, (past[0], past[1]), seconds=0.5)
    for whole_person, old in zip(duet, whole, strict=True):
        apart = np.linalg.norm(whole_person.positions() - old.positions()[: len(whole_person)], axis=-1)
        assert apart[count:].mean() < 0.012, apart[count:].mean(axis=1)


def test_whose_guesses_are_changed_is_still_unless_said_otherwise(
    prior: Prior, block: PairBlock, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Nine pairs, of which eight are denoised at once; the last but one row is changed."""
    calls: list[dict] = []
    states: list[np.ndarray] = []

    def guidance(prior: Prior, net: PairSession, bound: object, **how):
        calls.append(how)

        def lead(state: np.ndarray, guess: np.ndarray, level: int) -> np.ndarray:
            states.append(guess)
            return guess

        return lead

    monkeypatch.setattr(pair, "relative_pose_guidance", guidance)
    change = [None] * 16 + [lambda guess, level: np.full_like(guess, 7.0), None]
    known = np.zeros((18, 1 + FRAMES, 263), dtype=np.bool_)
    known[17, 1:5] = True
    observed = Observed(np.zeros(known.shape, np.float32), known, noise_free=True)
    how = {"seeds": list(range(18)), "steps": 1, "pair_guidance": 0.5}
    for frozen, expected in ((None, [True, False]), ([False] * 17 + [True], [False, True])):
        states.clear()
        calls.clear()
        pair_features(prior, block.net(prior), PROMPTS * 9, FRAMES, edits=PairEdits(observed, change, frozen), **how)
        first, second = calls
        assert (first["frozen"], second["frozen"]) == ([False] * 16, expected)
        assert (first["seeds"], second["seeds"]) == (list(range(16)), [16, 17])
        assert (first["weight"], second["weight"]) == (0.5, 0.5)
        assert (int(first["mask"].sum()), int(second["mask"].sum())) == (0, 4 * 263)
        assert [(one[:, 1:] == 7.0).all((1, 2)).tolist() for one in states] == [[False] * 16, [True, False]]
    with pytest.raises(MotionloomError):
        pair_features(prior, block.net(prior), PROMPTS * 9, FRAMES, edits=PairEdits(frozen=[False]), **how)
    monkeypatch.undo()
    with pytest.raises(MotionloomError, match="pair_guidance must be 0 to 1"):
        pair_features(prior, block.net(prior), PROMPTS * 9, FRAMES, **how | {"pair_guidance": 1.5})


def test_who_goes_on_is_led_to_the_other(prior: Prior, block: PairBlock) -> None:
    past = walkers(1.2)
    apart, led = (
        complete_pair(prior, block, past, seconds=6.0, steps=2, pair_guidance=share)[0] for share in (0.0, 1.0)
    )
    for one, other in zip(apart, led, strict=True):
        off = np.abs(one.root - other.root)[:, [0, 2]].max(axis=1)
        assert off[: len(past[0])].max() == 0
        assert off.max() > 0.05


def test_a_single_frame_can_be_added(prior: Prior, block: PairBlock) -> None:
    past = walkers(1.2)
    [duet] = complete_pair(prior, block, past, steps=1, seconds=0.01)
    assert [len(motion) for motion in duet] == [len(motion) + 1 for motion in past]


def shifted(motion: Motion, by: float) -> Motion:
    return replace(motion, root=motion.root + np.array([by, 0.0, 0.0]))


def test_pasts_of_no_pair_are_refused_in_a_sentence(prior: Prior, block: PairBlock) -> None:
    first, second = walkers(1.2)
    wrong = {
        "lengths differ, 24 and 20": (first, second.frames(0, 20)),
        "rates differ": (first, replace(second, fps=2 * second.fps)),
        "same motion": (first, shifted(first, 1.0)),
        "never nearer": (first, shifted(second, 50.0)),
        "at least 1 s": (first.frames(0, 8), second.frames(0, 8)),
    }
    for message, past in wrong.items():
        with pytest.raises(MotionloomError, match=message):
            complete_pair(prior, block, past, steps=2)
    for seconds in (0.0, float("nan"), float("inf"), 61.0, -1.0):
        with pytest.raises(MotionloomError, match="cannot go on for"):
            complete_pair(prior, block, (first, second), seconds=seconds, steps=2)


def test_what_nothing_can_be_made_of_is_refused(prior: Prior, block: PairBlock) -> None:
    wrong = [
        ({"seconds": 0.0}, "cannot be made"),
        ({"seconds": float("nan")}, "cannot be made"),
        ({"count": 0}, "count must be a whole number from 1"),
        ({"count": 10_000}, "10000 duets"),
        ({"seed": -1}, "seed"),
        ({"seed": (1, 2**62)}, "seed"),
        ({"steps": 0}, "steps"),
        ({"guidance": float("nan")}, "guidance"),
        ({"goals": (Goal.nothing(3), None)}, "goal of 3"),
    ]
    for options, message in wrong:
        with pytest.raises(MotionloomError, match=message):
            generate_pair(prior, block, "a person walks", **options)
    for prompt in ("", "  ", ("a person walks", "")):
        with pytest.raises(MotionloomError, match="prompt is empty"):
            generate_pair(prior, block, prompt)
