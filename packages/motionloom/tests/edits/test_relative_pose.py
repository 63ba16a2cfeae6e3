"""Two people who stay together: a planted drift goes away, in halves, and nobody who is given is moved."""

from dataclasses import replace
from typing import TypeAlias

import numpy as np
import pytest

from motionloom.core.features import pair as two
from motionloom.core.features.pair import PUBLISHED_CODE, PairMotion
from motionloom.core.ground import relative
from motionloom.core.methods.com_mdm import pair_noise
from motionloom.core.models.networks.pair import PairSession, join
from motionloom.core.models.pair import PairBlock
from motionloom.core.models.prior import Prior
from motionloom.edits import relative_pose as duet_places
from motionloom.edits.relative_pose import Places, relative_pose_guidance
from motionloom.tasks.pair import PairEdits, generate_pair, pair_features
from motionloom.tasks.people import known_state
from tests.noise import normal
from tests.recorded import tiny
from tests.tasks.two_people import block as block_of

FRAMES = 100
PROMPTS = ["a person walks", "a person turns left"]
BESIDE = np.array([[1.0, 0.0, 0.0, 0.0], [-0.8, 0.6, 0.3, 1.0]])


@pytest.fixture(scope="module")
def prior() -> Prior:
    return tiny.prior()


@pytest.fixture(scope="module")
def block(prior: Prior) -> PairBlock:
    return block_of(prior)


class Recorder:
    """A network that always says that two people stand to each other as in `BESIDE`."""

    def __init__(self, net: PairSession) -> None:
        self.places, self.silent = net.places, net.silent
        self.shown: list[tuple[np.ndarray, np.ndarray]] = []

    def __call__(self, x: np.ndarray, level: int, bound) -> np.ndarray:
        self.shown.append((x, bound.lengths))
        places = np.tile(self.places.encode(BESIDE), (len(x) // 2, 1))
        return join(places, x[:, 1:])


def drifting(prior: Prior) -> np.ndarray:
    """Features (2, frames, 263) of people who turn and go their own ways."""
    features = normal((2, FRAMES, 263), 1) * 0.01
    features[0, :, :3] += np.array([0.004, 0.01, 0.02])
    features[1, :, :3] += np.array([-0.006, -0.01, 0.015])
    return features * (prior.std > 0) + np.where(prior.std > 0, 0.0, prior.mean)


def led(prior: Prior, block: PairBlock, places: Places, weight: float = 1.0) -> tuple[np.ndarray, np.ndarray, Recorder]:
    """Ways (2, frames, 4) in the world before and after."""
    net, spread = block.net(prior), np.where(prior.std > 0, prior.std, np.float32(1))
    recorder, code, before = Recorder(net), net.places, drifting(prior)
    denoised = join(code.encode(BESIDE), (before - prior.mean) / spread)
    moved = places.guided(
        prior,
        recorder,
        net.bind(prior.condition(PROMPTS)),
        state=denoised,
        denoised=denoised,
        level=25,
        weight=weight,  # type: ignore
    )
    assert np.array_equal(moved[:, 0], denoised[:, 0])
    after = moved[:, 1:] * spread + prior.mean
    np.testing.assert_allclose(after[..., 3:], before[..., 3:], rtol=0, atol=1e-5)
    ways = [two.compose(BESIDE[:, None], two.along(one)) for one in (before, after)]
    return ways[0], ways[1], recorder


@pytest.mark.parametrize("weight", [1.0, 0.0], ids=["led", "free"])
def test_a_drift_is_gone_at_the_anchors(prior: Prior, block: PairBlock, weight: float) -> None:
    before, after, _ = led(prior, block, Places.of([1, 2], FRAMES, [0], [False] * 2), weight)
    expected = relative(BESIDE[0], BESIDE[1])
    for knot in (40, 80):
        away = np.abs(relative(before[0, knot], before[1, knot]) - expected).max()
        error = np.abs(relative(after[0, knot], after[1, knot]) - expected).max()
        assert away > 0.3
        assert (error < 1e-4) if weight else np.abs(error - away) < 1e-4
    np.testing.assert_allclose(after[:, 0], before[:, 0], atol=1e-5)


def test_half_led_is_half_of_the_way(prior: Prior, block: PairBlock) -> None:
    """At the anchors, from one to the other on the ground and in how they face."""
    places = Places.of([1, 2], FRAMES, [0], [False] * 2)
    free, half, whole = (led(prior, block, places, weight)[1][:, [40, 80]] for weight in (0.0, 0.5, 1.0))
    way = [(one[1] - one[0])[:, 2:] for one in (free, half, whole)]
    assert np.linalg.norm(way[2] - way[0], axis=-1).min() > 0.2
    np.testing.assert_allclose(way[1], (way[0] + way[2]) / 2, rtol=0, atol=1e-4)
    for person in (0, 1):
        np.testing.assert_allclose(
            relative(free[person], half[person])[:, :2],
            relative(half[person], whole[person])[:, :2],
            rtol=0,
            atol=1e-4,
        )


def test_each_goes_half_of_the_way(prior: Prior, block: PairBlock) -> None:
    before, after, _ = led(prior, block, Places.of([1, 2], FRAMES, [0], [False] * 2))
    moved = (after - before)[..., 2:]
    assert np.abs(moved).max() > 0.2
    np.testing.assert_allclose(moved[0], -moved[1], rtol=0, atol=1e-4)
    turned = [relative(before[i], after[i])[:, 1] for i in (0, 1)]
    assert np.abs(turned[0]).max() > 0.2
    np.testing.assert_allclose(turned[0], -turned[1], rtol=0, atol=1e-4)


@pytest.mark.parametrize("person", [0, 1])
def test_nobody_given_is_moved_and_the_other_goes_the_whole_way(prior: Prior, block: PairBlock, person: int) -> None:
    before, after, _ = led(prior, block, Places.of([1, 2], FRAMES, [0], [person == 0, person == 1]))
    np.testing.assert_allclose(after[person], before[person], rtol=0, atol=1e-5)
    expected = relative(BESIDE[0], BESIDE[1])
    np.testing.assert_allclose(relative(after[0, 80], after[1, 80])[:2], expected[:2], rtol=0, atol=1e-4)
    assert np.linalg.norm((after[1 - person] - before[1 - person])[80, 2:]) > 0.3


def test_frames_before_the_beginning_stay(prior: Prior, block: PairBlock) -> None:
    before, after, _ = led(prior, block, Places.of([1, 2], FRAMES, [30], [False] * 2))
    np.testing.assert_allclose(after[:, :31], before[:, :31], rtol=0, atol=1e-4)
    np.testing.assert_allclose(relative(after[0, 80], after[1, 80]), relative(BESIDE[0], BESIDE[1]), rtol=0, atol=1e-4)


def test_the_network_is_shown_crops_that_begin_at_the_anchors(prior: Prior, block: PairBlock) -> None:
    _, _, recorder = led(prior, block, Places.of([1, 2], FRAMES, [0], [False] * 2))
    [(x, lengths)] = recorder.shown
    motion = (drifting(prior) - prior.mean) / np.where(prior.std > 0, prior.std, np.float32(1))
    assert lengths.tolist() == [60, 60, 20, 20]
    np.testing.assert_allclose(x[:2, 1:], motion[:, 40:100], atol=1e-5)
    np.testing.assert_allclose(x[2:, 1:21], motion[:, 80:], atol=1e-5)


def test_what_a_change_costs_is_spread_without_jumps() -> None:
    spread = duet_places._spread([10, 50, 90], 101)
    np.testing.assert_allclose(spread[[5, 10, 50, 90, 100]], [[0, 0], [0, 0], [1, 0], [0, 1], [0, 1]], atol=1e-6)
    assert np.abs(np.diff(spread[11:90], axis=0)).max() < 2 / duet_places.SPACING
    assert np.abs(np.diff(spread[11:90], 2, axis=0)).max() < 0.2 / duet_places.SPACING  # nor a bend, as of lines


def test_no_more_than_sixty_frames_are_shown() -> None:
    motion = np.tile(np.arange(100.0), (2, 1))[..., None]
    crops, lengths = duet_places._crops(motion, [0, 1, 1], [0, 39, 50])
    assert (crops.shape, lengths.tolist()) == ((3, 60, 1), [60, 60, 50])
    assert crops[:, 0, 0].tolist() == [0, 39, 50]
    assert not crops[2, 50:].any()


def test_what_places_are_asked_with_is_not_what_the_duet_begins_as() -> None:
    noise = Places.of([1, 2], 200, [0], [False] * 2).noise
    assert noise.shape == (10, 4)
    assert not np.isin(noise, pair_noise([1, 2])(np.zeros((2, 201, 263), np.float32))).any()


def test_exchanged_people_stay_together_exchanged(prior: Prior, block: PairBlock) -> None:
    net, shared = block.net(prior), {"steps": 3, "bodies": False}
    one, _ = pair_features(prior, net, PROMPTS, 70, seeds=[1, 2], **shared)
    other, _ = pair_features(prior, net, PROMPTS[::-1], 70, seeds=[2, 1], **shared)
    free, _ = pair_features(prior, net, PROMPTS, 70, seeds=[1, 2], pair_guidance=0.0, **shared)
    np.testing.assert_allclose(one[0], np.flip(other[0], 0), rtol=0, atol=1e-3)
    assert np.abs(one - free).max() > 1e-3
    many, _ = pair_features(prior, net, PROMPTS * 2, 70, seeds=[1, 2, 3, 4], **shared)
    np.testing.assert_allclose(many[0], one[0], rtol=0, atol=1e-3)


def test_what_is_known_stays_known(prior: Prior, block: PairBlock) -> None:
    net, first = block.net(prior), drifting(prior)[:, :20]
    observed = known_state(net, PairMotion(first[None], BESIDE[None]), 90)
    pair, _ = pair_features(prior, net, PROMPTS, 90, seeds=[1, 2], edits=PairEdits(observed), steps=2)
    np.testing.assert_allclose(pair[0, :, :20], first, rtol=0, atol=1e-5)


def test_a_fresh_block_leads_nobody(prior: Prior) -> None:
    fresh = block_of(prior, fresh=True)
    pairs = [
        generate_pair(prior, fresh, PROMPTS[0], seconds=4, steps=2, foot_lock=False, pair_guidance=w)[0]
        for w in (0.0, 1.0)
    ]
    for free, held in zip(*pairs, strict=True):
        assert np.array_equal(free.positions(), held.positions())


# What is asked, and who is led


class Questioner(Recorder):
    """Keeps everything that it is shown."""

    def __call__(self, x: np.ndarray, level, bound) -> np.ndarray:
        self.state, self.level, self.bound = x, level, bound
        return super().__call__(x, level, bound)


def test_every_question_is_of_its_own_pair_at_its_own_level_and_given_the_noised_estimate(
    prior: Prior, block: PairBlock
) -> None:
    """Two pairs, with anchors at frames 40 and 80, and at 80."""
    net, prompts = block.net(prior), [*PROMPTS, "a person jumps", "a person sits down"]
    bound, recorder = net.bind(prior.condition(prompts)), Questioner(net)
    drift, spread = drifting(prior), np.where(prior.std > 0, prior.std, np.float32(1))
    denoised = join(net.places.encode(BESIDE)[[0, 1, 0, 1]], ((drift - prior.mean) / spread)[[0, 1, 0, 1]])
    state = normal(denoised.shape, 2)
    places = Places.of([1, 2, 3, 4], FRAMES, [0, 40], [False] * 4)
    level = np.array([7, 7, 30, 30])
    moved = places.guided(prior, recorder, bound, state=state, denoised=denoised, level=level, weight=1.0)  # type: ignore
    questions = [(row, frame) for frame in (40, 80) for row in (0, 1)] + [(2, 80), (3, 80)]
    assert np.asarray(recorder.level).tolist() == [7, 7, 7, 7, 30, 30]
    assert recorder.bound.lengths.tolist() == [min(60, FRAMES - frame) for _, frame in questions]
    ways = two.compose(BESIDE[:, None], two.along(drift))
    for number, (row, frame) in enumerate(questions):
        length, own = min(60, FRAMES - frame), int(level[row])
        np.testing.assert_allclose(
            recorder.state[number, 1 : 1 + length], state[row, 1 + frame : 1 + frame + length], atol=1e-5
        )
        assert np.array_equal(recorder.bound.text[number], bound.text[row])
        there = relative(ways[row % 2, frame], ways[1 - row % 2, frame])  # the other, as seen from there
        signal, noise = prior.schedule.at(own)
        np.testing.assert_allclose(
            recorder.state[number, 0, :4], signal * there + noise * places.noise[number], atol=1e-5
        )
    # what is asked of the one pair changes nothing of the other
    for pair, (begin, share) in enumerate(((0, slice(0, 4)), (40, slice(4, 6)))):
        rows = slice(2 * pair, 2 * pair + 2)
        alone = Places.of([[1, 2], [3, 4]][pair], FRAMES, [begin], [False] * 2)
        assert np.array_equal(alone.noise, places.noise[share])
        one = alone.guided(
            prior,
            Recorder(net),
            net.bind(prior.condition(prompts[rows])),
            state=state[rows],
            denoised=denoised[rows],  # type: ignore
            level=level[rows],
            weight=1.0,
        )
        np.testing.assert_allclose(moved[rows], one, rtol=0, atol=1e-5)
    assert np.unique(places.noise).size == places.noise.size  # nothing is drawn twice


def test_who_is_moved_differs_from_pair_to_pair(prior: Prior, block: PairBlock) -> None:
    net = block.net(prior)
    drift, spread = drifting(prior), np.where(prior.std > 0, prior.std, np.float32(1))
    denoised = join(net.places.encode(BESIDE)[[0, 1, 0, 1]], ((drift - prior.mean) / spread)[[0, 1, 0, 1]])
    places = Places.of([1, 2, 3, 4], FRAMES, [0, 0], [True, False, False, True])
    guided = places.guided(
        prior,
        Recorder(net),
        net.bind(prior.condition(PROMPTS * 2)),
        state=denoised,
        denoised=denoised,
        level=25,
        weight=1.0,  # type: ignore
    )
    moved = np.abs(guided - denoised).max((1, 2))
    assert moved[[0, 3]].max() < 1e-5
    assert moved[[1, 2]].min() > 0.1


@pytest.mark.parametrize(
    ("begin", "frames", "anchors"),
    [
        (0, 39, ()),
        (0, 40, (20,)),
        (0, 60, (40,)),
        (0, 61, (20, 41)),
        (0, 100, (40, 80)),
        (10, 100, (45, 80)),
        (0, 120, (33, 67, 100)),
        (10, 110, (50, 90)),
        (60, 99, ()),
        (60, 100, (80,)),
    ],
)
def test_anchors_stand_evenly_up_to_twenty_frames_before_the_end(
    begin: int, frames: int, anchors: tuple[int, ...]
) -> None:
    assert Places.of([1, 2], frames, [begin], [False] * 2).anchors == (anchors,)


def leads(
    prior: Prior, block: PairBlock, mask: np.ndarray, frozen=(False, False)
) -> tuple[np.ndarray, np.ndarray, Recorder]:
    """An estimate before and after the guidance, where ``mask`` (2, 1 + frames) says what is known."""
    net, spread = block.net(prior), np.where(prior.std > 0, prior.std, np.float32(1))
    recorder = Recorder(net)
    denoised = join(net.places.encode(BESIDE), (drifting(prior) - prior.mean) / spread)
    known = np.broadcast_to(mask[..., None], (denoised.shape))
    lead = relative_pose_guidance(
        prior, recorder, net.bind(prior.condition(PROMPTS)), seeds=[1, 2], mask=known, frozen=frozen
    )  # type: ignore
    return denoised, lead(denoised, denoised, 25), recorder


Spans: TypeAlias = tuple[tuple[int, int], ...]
KNOWN: dict[str, tuple[tuple[Spans, Spans], list[int] | None, list[bool]]] = {
    "nothing": (((), ()), [60, 60, 20, 20], [True, True]),
    "a beginning of both": ((((0, 21),), ((0, 21),)), [20, 20], [True, True]),
    "too long a beginning": ((((0, 23),), ((0, 23),)), None, [False, False]),
    "beginnings of two lengths": ((((0, 31),), ((0, 11),)), [20, 20], [True, True]),
    "a beginning and an end": ((((0, 11), (90, 101)), ((0, 11), (90, 101))), [20, 20], [True, True]),
    "the first": ((((0, 101),), ()), [60, 60, 20, 20], [False, True]),
    "the second": (((), ((1, 101),)), [60, 60, 20, 20], [True, False]),
    "both": ((((0, 101),), ((0, 101),)), None, [False, False]),
}
"""Slots that are known of both people (slot 0 is D), frames shown from each knot on, and who is moved. 100 frames: from
0 on anchors are at 40 and 80, 40 frames behind 20 or 10 known ones there is one at 80, behind 22 there is none."""


@pytest.mark.parametrize("case", list(KNOWN))
def test_anchors_begin_two_seconds_behind_the_common_beginning_and_known_numbers_stay(
    case: str, prior: Prior, block: PairBlock
) -> None:
    spans, lengths, moves = KNOWN[case]
    mask = np.zeros((2, FRAMES + 1), dtype=np.bool_)
    for row, some in enumerate(spans):
        for first, last in some:
            mask[row, first:last] = True
    before, after, recorder = leads(prior, block, mask)
    assert [one.tolist() for _, one in recorder.shown] == ([lengths] if lengths else [])
    assert np.array_equal(after[mask], before[mask])
    assert [bool((row > 0.01).any()) for row in np.abs(after - before)] == moves


@pytest.mark.parametrize("away", [0, 1])
def test_whom_others_move_is_not_led(prior: Prior, block: PairBlock, away: int) -> None:
    nothing = np.zeros((2, FRAMES + 1), dtype=np.bool_)
    before, after, _ = leads(prior, block, nothing, frozen=(away == 0, away == 1))
    off = np.abs(after - before).max((1, 2))
    assert off[away] < 1e-5
    assert off[1 - away] > 0.1


def test_places_of_the_world_lead_nobody(prior: Prior, block: PairBlock) -> None:
    of_world = replace(block, config=replace(block.config, places=PUBLISHED_CODE))
    before, after, recorder = leads(prior, of_world, np.zeros((2, FRAMES + 1), dtype=np.bool_))
    assert np.array_equal(before, after)
    assert not recorder.shown
