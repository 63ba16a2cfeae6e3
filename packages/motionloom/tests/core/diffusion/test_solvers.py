"""Solvers against closed forms, and against the marginals they must keep."""

import math
from itertools import pairwise

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from motionloom.core.diffusion import SOLVERS, Ddim, DpmSolver2M, cosine, levels, linear, run
from tests.core.diffusion.exact import TILTED, Gaussian, points, shared_draw, wavy


def ours(x, denoise, walk, solver, schedule, noises):
    supply = iter(noises)
    return run(denoise, x, levels=walk, solver=solver, schedule=schedule, noise=lambda like: next(supply))


def noises_of(count, shape, seed=3):
    draw = shared_draw(seed)
    return [draw(np.empty(shape, dtype=np.float64)) for _ in range(count)]


@pytest.fixture(params=[cosine(100), linear(200)], ids=["cosine", "linear"])
def schedule(request):
    return request.param


@given(data=st.data(), eta=st.floats(0, 1))
def test_every_ddim_move_keeps_the_marginal_of_known_data(data, eta):
    schedule = cosine(60)
    t = data.draw(st.integers(1, 60))
    s = data.draw(st.integers(0, t - 1))
    (a_t, b_t), (a_s, b_s) = schedule.at(t), schedule.at(s)
    move = Ddim(eta).move(schedule, t, s)
    assert move.clean + move.state * a_t == pytest.approx(a_s, abs=1e-12)
    assert math.hypot(move.state * b_t, move.noise) == pytest.approx(b_s, abs=1e-12)


@pytest.mark.parametrize("eta", [0.0, 1.0])
def test_a_first_move_of_the_second_order_solver_is_a_ddim_move(eta):
    schedule, (x, clean, noise) = cosine(60), noises_of(3, (2, 4, 3))
    for t, s in [(60, 59), (60, 12), (33, 0), (1, 0)]:
        first, plain = (solver.start(schedule) for solver in (DpmSolver2M(eta), Ddim(eta)))
        moved, expected = (step(x, clean, t, s, lambda like: noise) for step in (first, plain))
        np.testing.assert_allclose(moved, expected, atol=1e-12, rtol=1e-12)


def flow_error(solver, moves):
    """Largest error of a walk between log-SNR -2 and 2 against the exact flow of normal data."""
    schedule = linear(20_000)
    top, low = (
        min(range(1, schedule.steps), key=lambda level: abs(schedule.log_snr(level) - goal)) for goal in (-2.0, 2.0)
    )
    ratios = [schedule.log_snr(level) for level in range(schedule.steps + 1)]
    goals = [ratios[top] + (ratios[low] - ratios[top]) * i / moves for i in range(moves + 1)]
    walk = [min(range(low, top + 1), key=lambda level: abs(ratios[level] - goal)) for goal in goals]
    x = shared_draw(1)(np.empty((500, 1, 2), dtype=np.float64))
    end = run(TILTED.denoiser(schedule), x, levels=walk, solver=solver, schedule=schedule, noise=np.zeros_like)
    return np.abs(end - TILTED.flow(x, schedule, top, low)).max()


@pytest.mark.parametrize(("solver", "order"), [(Ddim(), 1), (DpmSolver2M(), 2)], ids=["ddim", "2m"])
def test_the_error_falls_with_the_solvers_order(solver, order):
    errors = [flow_error(solver, moves) for moves in (8, 16, 32)]
    orders = [math.log2(a / b) for a, b in pairwise(errors)]
    assert orders[-1] == pytest.approx(order, abs=0.2), (errors, orders)
    assert orders[0] > order - 0.75


@pytest.mark.parametrize("scale", [1.0, 0.1], ids=["wide", "narrow"])
@pytest.mark.parametrize(
    ("name", "steps", "spacing", "tolerance"),
    [
        ("ddpm", 500, "index", 0.04),
        ("ddim", 200, "quadratic", 0.04),
        ("dpm2m", 20, "quadratic", 0.06),
        ("dpm2m", 40, "snr", 0.04),
        ("dpm2m-sde", 100, "snr", 0.04),
    ],
)
def test_normal_data_comes_out_with_its_mean_and_covariance(name, steps, spacing, *, tolerance, scale):
    schedule, draw, rows = cosine(500), shared_draw(5), 20_000
    data = Gaussian(TILTED.mean, TILTED.covariance * scale)
    x = draw(np.empty((rows, 1, 2), dtype=np.float64))
    walk = levels(schedule, steps, spacing=spacing)
    made = run(data.denoiser(schedule), x, levels=walk, solver=SOLVERS[name], schedule=schedule, noise=draw)
    made, spread = made.reshape(rows, 2), data.covariance.max().item()
    np.testing.assert_allclose(made.mean(0), data.mean, atol=tolerance * spread**0.5, rtol=0)
    np.testing.assert_allclose(np.cov(made.T), data.covariance, atol=tolerance * spread, rtol=0)


@pytest.mark.parametrize("name", SOLVERS)
def test_a_finite_data_set_comes_back_as_itself(name):
    data = np.array([[-1.0, 0.0], [2.0, 1.0], [0.0, -2.0]], dtype=np.float64)
    schedule, draw = cosine(200), shared_draw(2)
    x = draw(np.empty((3000, 1, 2), dtype=np.float64))
    walk = levels(schedule, 200 if name == "ddpm" else 50)
    made = run(points(data, schedule), x, levels=walk, solver=SOLVERS[name], schedule=schedule, noise=draw)
    distance = np.linalg.norm(made.reshape(-1, 1, 2) - data, axis=-1)
    nearest, which = distance.min(axis=1), distance.argmin(axis=1)
    assert (nearest < 0.05).astype(np.float64).mean() > 0.99
    shares = np.bincount(which, minlength=3) / len(which)
    np.testing.assert_allclose(shares, np.full((3,), 1 / 3), atol=0.05, rtol=0)


@pytest.mark.parametrize("name", SOLVERS)
def test_runs_that_share_a_solver_do_not_meet(name):
    solver, schedule, (x, y, noise) = SOLVERS[name], cosine(30), noises_of(3, (2, 4, 3))
    walk = levels(schedule, 6)

    def alone(state):
        return run(wavy, state, levels=walk, solver=solver, schedule=schedule, noise=lambda like: noise)

    steps, states = [solver.start(schedule), solver.start(schedule)], [x, y]
    for t, s in pairwise(walk):
        states = [step(z, wavy(z, t), t, s, lambda like: noise) for step, z in zip(steps, states)]
    assert np.array_equal(states[0], alone(x))
    assert np.array_equal(states[1], alone(y))


def test_deterministic_solvers_never_draw_and_others_draw_in_every_step():
    schedule, counts = cosine(30), {}
    for name, solver in SOLVERS.items():
        asked = []
        run(
            wavy,
            np.zeros((1, 2, 2), np.float32),
            levels=levels(schedule, 6),
            solver=solver,
            schedule=schedule,
            noise=lambda like, asked=asked: asked.append(1) or np.zeros_like(like),
        )
        counts[name] = len(asked)
    assert counts == {"ddpm": 6, "ddim": 0, "dpm2m": 0, "dpm2m-sde": 6}


@pytest.mark.parametrize("make", [Ddim, DpmSolver2M])
@pytest.mark.parametrize("eta", [-0.1, 1.5, float("nan")])
def test_an_eta_outside_0_to_1_is_refused(make, eta):
    with pytest.raises(ValueError, match="eta"):
        make(eta=eta)


def test_a_move_to_a_noisier_level_is_refused():
    with pytest.raises(ValueError, match="cleaner"):
        Ddim().move(cosine(10), 3, 3)
