"""Sessions of the shipped weights: a row's answer is its own, bit for bit, whatever is computed beside it."""

from collections.abc import Iterator
from concurrent.futures import ThreadPoolExecutor

import numpy as np
import pytest

from motionloom.core.errors import MotionloomError
from motionloom.core.models.adapter import Adapter, adapted
from motionloom.core.models.networks.prior import PriorSession, patches, valid_frames
from motionloom.core.models.networks.prior_condition import Bound
from motionloom.core.models.networks.session import find_device, set_threads, threads
from motionloom.core.models.pair import PairBlock
from motionloom.core.models.predictor import Predictor
from motionloom.core.models.prior import Prior

FRAMES = 41
PROMPTS = ["a person walks", "someone turns around slowly and then sits down on a chair", "", "jumps", "he waves"]


@pytest.fixture(scope="module")
def prior() -> Prior:
    return Prior.load()


@pytest.fixture(autouse=True)
def usual_threads() -> Iterator[None]:
    yield
    set_threads(None)


def noise(*shape: int) -> np.ndarray:
    return np.random.default_rng(0).standard_normal(shape, np.float32)


def chosen(bound: Bound, rows: list[int]) -> Bound:
    return Bound(*(part[rows] for part in bound))


def test_rows_have_the_same_bits_alone_and_together(prior: Prior) -> None:
    """So have their conditions, whose words are padded to those of the longest text."""
    x, levels = noise(len(PROMPTS), FRAMES, 263), np.array([999, 500, 3, 999, 1])
    bound = prior.net.bind(prior.condition(PROMPTS))
    together = prior.net(x, levels, bound)
    for row, prompt in enumerate(PROMPTS):
        own = prior.net.bind(prior.condition([prompt]))
        np.testing.assert_array_equal(own.text, bound.text[[row]])
        np.testing.assert_array_equal(own.keys, bound.keys[[row], :, :, : own.keys.shape[3]])
        alone = prior.net(x[[row]], int(levels[row]), own)
        np.testing.assert_array_equal(alone, together[[row]])


def test_threads_that_run_one_session_do_not_mix_their_answers(prior: Prior) -> None:
    """As two live sessions of a server do. With buffers in common answers were mixed up, or there was a crash."""
    bounds = [prior.net.bind(prior.condition([prompt])) for prompt in PROMPTS[:3]]
    states = [noise(1, FRAMES + 8 * row, 263) for row in range(3)]
    alone = [prior.net(x, 500, bound) for x, bound in zip(states, bounds, strict=True)]

    def often(row: int) -> bool:
        return all(np.array_equal(prior.net(states[row], 500, bounds[row]), alone[row]) for _ in range(40))

    with ThreadPoolExecutor(3) as threads:
        assert all(threads.map(often, range(3)))


def test_padding_changes_no_bit(prior: Prior) -> None:
    x = noise(2, FRAMES, 263)
    cond = prior.condition(PROMPTS[:2])
    alone = prior.net(x, 500, prior.net.bind(cond))
    longer = np.concatenate([x, 7 * noise(2, 22, 263)], axis=1)
    padded = prior.net(longer, 500, prior.net.bind(cond._replace(lengths=np.array([FRAMES, FRAMES]))))
    np.testing.assert_array_equal(padded[:, :FRAMES], alone)


def test_threads_change_no_bit(prior: Prior) -> None:
    x, cond = noise(3, FRAMES, 263), prior.condition(PROMPTS[:3])
    answers = []
    for count in (1, 2, 3):
        set_threads(count)
        net = PriorSession(prior.net.config, prior.net.weights, prior.net.graphs)
        answers.append(net(x, 400, net.bind(cond)))
    np.testing.assert_array_equal(answers[0], answers[1])
    np.testing.assert_array_equal(answers[0], answers[2])


def test_answers_are_arrays_of_their_own_and_conditions_are_not_mixed_up(prior: Prior) -> None:
    """Buffers are kept from call to call; one that is read again must not hold what was there before."""
    x = noise(1, FRAMES, 263)
    walk, wave = (prior.net.bind(prior.condition([text])) for text in ("walks", "waves"))
    first = prior.net(x, 500, walk)
    before = first.copy()
    other = prior.net(x, 500, wave)
    assert np.abs(other - first).max() > 0.01
    np.testing.assert_array_equal(prior.net(x, 500, walk), before)
    first[:] = 0
    np.testing.assert_array_equal(prior.net(x, 500, walk), before)
    np.testing.assert_array_equal(prior.net(x[:, :20], 500, walk).shape, (1, 20, 263))


def test_two_people_have_the_same_bits_beside_others(prior: Prior) -> None:
    net = PairBlock.load("duet", prior).net(prior)
    state = noise(4, 1 + FRAMES, 263)
    bound = net.bind(prior.condition(["two people dance"] * 4))
    together = net(state, 600, bound)
    np.testing.assert_array_equal(net(state[2:], 600, chosen(bound, [2, 3])), together[2:])
    assert not together[:, 0, 4:].any()
    with pytest.raises(MotionloomError, match="even number of rows"):
        net(state[:3], 600, chosen(bound, [0, 1, 2]))


def test_predictions_have_the_same_bits_beside_others() -> None:
    net = Predictor.load().net
    state, condition = noise(5, 24, 66), noise(5, 25, 88)
    levels = np.array([9, 400, 0, 999, 9])
    together = net(state, levels, condition)
    for row in range(5):
        np.testing.assert_array_equal(net(state[[row]], levels[[row]], condition[[row]]), together[[row]])
    none = net(state, levels)
    np.testing.assert_array_equal(net(state, levels, condition, np.zeros(5, bool)), none)


def test_texts_have_the_same_bits_beside_others(prior: Prior) -> None:
    together = prior.condition(PROMPTS)
    again = Prior.load()
    for row, prompt in enumerate(PROMPTS):
        alone = again.condition([prompt])
        np.testing.assert_array_equal(alone.pooled, together.pooled[[row]])
        np.testing.assert_array_equal(alone.tokens, together.tokens[[row], : alone.tokens.shape[1]])


def test_what_is_shown_is_what_the_first_layer_would_add(prior: Prior) -> None:
    """Embedding of [given, mask] through the adapter's two thin matrices, frame by frame of each token."""
    adapter = Adapter.load("any", prior)
    net = adapted(prior.net, adapter)
    bound = net.bind(prior.condition(["a person walks"]))
    given, mask = noise(1, 10, 263), noise(1, 10, 263) > 0.5
    shown = net.show(bound, given, mask).shown
    frames = np.zeros((12, 2 * 263), np.float32)
    frames[:10] = np.concatenate([np.where(mask, given, 0), mask], axis=-1)[0]
    token = frames[4:8].reshape(-1)
    expected = adapter.tensors["given.up"] @ (adapter.tensors["given.down"] @ token)
    np.testing.assert_allclose(shown[0, 1], expected, atol=1e-4)
    assert shown.shape == (1, 3, 320)
    assert prior.net.show(bound, given, mask) is bound  # a plain network is shown nothing
    x = noise(1, 10, 263)
    assert np.abs(net(x, 500, net.show(bound, given, mask)) - net(x, 500, bound)).max() > 0.01


def test_patches_are_frames_side_by_side() -> None:
    values = np.arange(10, dtype=np.float32).reshape(1, 5, 2)
    expected = [[[0, 1, 2, 3], [4, 5, 6, 7], [8, 9, 0, 0]]]
    assert patches(values, 2).tolist() == expected
    assert valid_frames(np.array([2, -1]), 3).tolist() == [[True, True, False], [True, True, True]]


@pytest.mark.parametrize("name", ["toaster", "cpu:1", "cuda:x", ""])
def test_devices_that_are_not_there_are_refused(name: str) -> None:
    with pytest.raises(MotionloomError, match="cannot be used"):
        find_device(name)


def test_threads_are_a_setting(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv("MOTIONLOOM_THREADS", "3")
    assert threads() == 3
    set_threads(2)
    assert threads() == 2
    set_threads(None)
    monkeypatch.setenv("MOTIONLOOM_THREADS", "many")
    with pytest.raises(MotionloomError, match="MOTIONLOOM_THREADS is a number"):
        threads()
    with pytest.raises(MotionloomError, match="1 thread or more"):
        set_threads(0)
