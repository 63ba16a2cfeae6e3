"""Control on features: the published walk written out, blending's algebra, and what is given comes out."""

import math
from dataclasses import replace

import numpy as np
import pytest

from motionloom.core.diffusion import SOLVERS, cosine, guide, levels, row_noise, run
from motionloom.core.errors import MotionloomError
from motionloom.core.features.layout import mask
from motionloom.core.methods.blending import control_by_blending
from motionloom.core.methods.edit import Observed, controlled
from motionloom.core.methods.walk import Walk
from motionloom.core.models.adapter import adapted
from motionloom.edits.steering import corrected
from motionloom_train.modules import prior_module
from tests.noise import normal
from tests.recorded import tiny
from tests_train.test_adapter import adapter_of, trained

PROMPTS, FRAMES = ["a person walks", "a person waves"], 10


@pytest.fixture(scope="module")
def prior():
    return tiny.prior(levels=20)


@pytest.fixture(scope="module")
def other(prior):
    net = prior_module(prior)
    return adapted(prior.net, adapter_of(trained(net), net))


def known_part(names: str = "left_wrist,root_horizontal") -> tuple[np.ndarray, np.ndarray]:
    known = normal((2, FRAMES, 263), 4)
    return known, np.broadcast_to(np.asarray(mask(names)), known.shape)


def draw_of(prior, nets, known, flags, **options):
    observed = Observed(known, flags, options.pop("noise_free", True))
    corrections = options.pop("corrections", None)
    edited = None if corrections is None else lambda denoise: corrected(denoise, corrections)
    walk = Walk(**{name: options.pop(name) for name in ("steps", "solver") if name in options} or {"steps": 6})
    seeds = options.pop("seeds", [5, 6])
    return control_by_blending(prior, nets, PROMPTS, observed, seeds=seeds, edited=edited, walk=walk, **options)


@pytest.mark.parametrize("seed", [0, 1])
@pytest.mark.parametrize("noise_free", [True, False], ids=["algorithm 2", "inpainting"])
def test_the_walk_is_the_published_loop(seed, noise_free):
    """Ancestral sampling as the published code writes it, by alpha bars and betas, on a formula for a network."""
    schedule, steps = cosine(12), 12
    rng = np.random.default_rng(seed)
    known = rng.standard_normal((2, 7, 5), np.float32)
    flags = rng.random((2, 7, 5)) < 0.4
    noises = [rng.standard_normal(known.shape, np.float32) for _ in range(steps + 1)]
    draws = iter(noises)

    def guess(x: np.ndarray, level: int) -> np.ndarray:
        return np.tanh(x) + 0.1 * np.roll(x, 1, 1) + 0.01 * level

    motion = controlled(
        guess,
        Observed(known, flags, noise_free),
        levels=range(steps, -1, -1),
        solver=SOLVERS["ddpm"],
        schedule=schedule,
        noise=lambda like: next(draws),
    )
    bars = [1.0, *np.cumprod(1 - schedule.betas).tolist()]
    free = (~flags).astype(np.float32) if noise_free else np.ones_like(known)
    x = math.sqrt(1 - bars[steps]) * noises[0] * free
    if noise_free:
        x = x + math.sqrt(bars[steps]) * known * flags
    for t in range(steps, 0, -1):
        beta, before = 1 - bars[t] / bars[t - 1], bars[t - 1]
        clean = np.where(flags, known, guess(x, t))
        mean = math.sqrt(before) * beta * clean + math.sqrt(1 - beta) * (1 - before) * x
        x = mean / (1 - bars[t]) + math.sqrt(beta * (1 - before) / (1 - bars[t])) * noises[steps + 1 - t] * free
    np.testing.assert_allclose(motion, x, rtol=1e-4, atol=1e-5)


def test_given_numbers_come_out_exactly_and_are_free_of_noise_on_the_way(prior, other):
    """Every state that the network is shown holds signal * given; the answer holds the given numbers to the bit."""
    known, flags = known_part()
    calls = []

    def watch(row: np.ndarray, level: int) -> np.ndarray:
        return row

    class Spy:
        bind = staticmethod(prior.net.bind)

        def show(self, bound, known_part, mask):
            return bound

        def __call__(self, x, level, bound):
            calls.append((level, x))
            return prior.net(x, level, bound)

    out = draw_of(prior, [Spy()], known, flags, corrections=[watch, None])
    assert np.array_equal(out[flags], known[flags])
    assert [level for level, _ in calls] == levels(prior.schedule, 6, spacing="early")[:-1]
    for level, x in calls:
        target = prior.schedule.at(level)[0] * known
        np.testing.assert_allclose(x[:2][flags], target[flags], atol=1e-5)
        np.testing.assert_allclose(x[2:][flags], target[flags])  # the rows without text see it too
    assert np.array_equal(draw_of(prior, [other], known, flags, noise_free=False)[flags], known[flags])


def test_weights_one_and_zero_are_the_first_network_and_two_equal_networks_are_one(prior, other):
    known, flags = known_part()
    first, second = (draw_of(prior, [net], known, flags) for net in (prior.net, other))
    np.testing.assert_allclose(draw_of(prior, [prior.net, other], known, flags, weights=(1.0, 0.0)), first, atol=1e-5)
    np.testing.assert_allclose(draw_of(prior, [prior.net, other], known, flags, weights=(0.0, 1.0)), second, atol=1e-5)
    np.testing.assert_allclose(draw_of(prior, [other, other], known, flags), second, rtol=1e-4, atol=1e-5)
    assert float(np.abs(first - second).max()) > 0.01


def test_weights_may_depend_on_level_frame_and_number(prior, other):
    """In one step the blend can be read off: every number follows the network that its weight names."""
    known, flags = known_part()
    chosen = np.zeros((FRAMES, 263), np.float32)
    chosen[:4, 100:] = 1.0
    levels = []

    def rest(level: int) -> np.ndarray:
        levels.append(level)
        return 1 - chosen

    first, second, both = (
        draw_of(prior, nets, known, flags, steps=1, weights=weights)
        for nets, weights in (([prior.net], None), ([other], None), ([prior.net, other], [chosen, rest]))
    )
    np.testing.assert_allclose(both, np.where(chosen.astype(bool), first, second), atol=1e-5)
    assert levels == [prior.schedule.steps]


def test_an_empty_mask_is_plain_sampling(prior):
    """The same noise, no control: the motion that the text alone gives."""
    known, flags = known_part()
    cond = prior.condition(PROMPTS)
    draw = row_noise([5, 6])
    plain = run(
        guide(prior.net, prior.net.bind(cond), prior.net.bind(cond.null()), 2.5),
        draw(known),
        levels=levels(prior.schedule, 6, spacing="early"),
        solver=SOLVERS["ddpm"],
        schedule=prior.schedule,
        noise=draw,
    )
    for noise_free in (True, False):
        empty = draw_of(prior, [prior.net], np.full_like(known, np.nan), flags & False, noise_free=noise_free)
        np.testing.assert_allclose(empty, plain, rtol=1e-4, atol=1e-4)


def test_rows_do_not_depend_on_each_other_and_nothing_leaks_from_what_is_not_given(prior, other):
    known, flags = known_part()
    both = draw_of(prior, [other], known, flags)
    alone = control_by_blending(
        prior, [other], PROMPTS[1:], Observed(known[1:], flags[1:], True), seeds=[6], walk=Walk(steps=6)
    )
    np.testing.assert_allclose(both[1:], alone, rtol=1e-4, atol=1e-5)
    hidden = np.where(flags, known, 1e6)
    assert np.array_equal(draw_of(prior, [other], hidden, flags), both)


def test_networks_see_what_is_given_only_without_noise(prior, other):
    """MDM's inpainting tells no network what is given; algorithm 2 tells those that can be told."""
    known, flags = known_part()
    net = prior_module(prior)
    full = adapter_of(trained(net), net)
    tensors = {k: v for k, v in full.tensors.items() if not k.startswith("given.")}
    deaf = adapted(prior.net, replace(full, tensors=tensors))

    def apart(noise_free: bool) -> float:
        told, untold = (draw_of(prior, [net], known, flags, noise_free=noise_free) for net in (other, deaf))
        return float(np.abs(told - untold).max())

    assert apart(False) < 1e-4 < 1e-3 < apart(True)


def test_corrections_change_the_guess_and_given_numbers_have_the_last_word(prior):
    known, flags = known_part()
    out = draw_of(prior, [prior.net], known, flags, corrections=[lambda row, level: np.full_like(row, 0.25), None])
    np.testing.assert_allclose(out[0], np.where(flags[0], known[0], 0.25), atol=1e-5)
    np.testing.assert_allclose(out[1], draw_of(prior, [prior.net], known, flags)[1], atol=1e-5)


MISTAKES = {
    "no network": lambda k, m: {"nets": []},
    "weights": lambda k, m: {"weights": [0.5, 0.5]},
    "seeds": lambda k, m: {"seeds": [1]},
    "mask of numbers": lambda k, m: {"mask": m.astype(np.float32)},
    "mask of another shape": lambda k, m: {"mask": m[:, 1:]},
    "not finite": lambda k, m: {"known": k * np.inf},
    "steps": lambda k, m: {"steps": 0},
    "solver": lambda k, m: {"solver": "none"},
}


@pytest.mark.parametrize("mistake", MISTAKES.values(), ids=MISTAKES)
def test_what_does_not_fit_together_is_refused_in_a_sentence(prior, mistake):
    known, flags = known_part()
    options = {"nets": [prior.net], "known": known, "mask": flags, "seeds": [1, 2]} | mistake(known, flags)
    observed = Observed(options.pop("known"), options.pop("mask"), noise_free=True)
    with pytest.raises(MotionloomError) as caught:
        draw_of(prior, options.pop("nets"), observed.values, observed.mask, **options)
    assert "\n" not in str(caught.value)
