"""Group `diffusion`: schedules, noising, the posterior, single ancestral steps. Published index t is level t + 1."""

import numpy as np
import pytest

from motionloom.core.diffusion import DDPM, Schedule, cosine, linear, masked_noise
from tests.conformance.runner import KNOWN, MASK, MOTION, NOISE, Case, cases, compare, normal, stream

SCHEDULES = {"cosine": cosine, "linear": linear}


def schedule_of(case: Case) -> Schedule:
    return SCHEDULES[case.config["schedule"]](case.config["steps"])


@pytest.mark.parametrize("case", cases("diffusion", kind="schedule"))
def test_schedule_and_posterior_tables_are_the_published_ones(case):
    schedule = schedule_of(case)
    moves = [DDPM.move(schedule, level, level - 1) for level in range(1, schedule.steps + 1)]
    variance = np.array([move.noise**2 for move in moves])
    tables = {
        "beta": schedule.betas,
        "alpha_bar": schedule.alpha_bar[1:],
        "posterior_variance": variance,
        "posterior_log_variance_clipped": np.log(np.append(variance[1], variance[1:])),
        "coef_x0": np.array([move.clean for move in moves]),
        "coef_xt": np.array([move.state for move in moves]),
    }
    wanted = slice(None) if case.config["indices"] == "all" else case.config["indices"]
    assert set(case.outputs) == set(tables)
    for name, table in tables.items():
        compare(case, name, table[wanted])


@pytest.mark.parametrize("case", cases("diffusion", kind="single_steps"))
def test_one_step_of_noising_and_of_sampling_is_the_published_one(case):
    schedule, seed, shape = schedule_of(case), case.config["seed"], case.config["shape"]
    clean, state, noise = (np.asarray(normal(stream(seed, k), shape)) for k in (KNOWN, MOTION, NOISE))

    def draw(like):
        return noise

    if case.config.get("mask") == "soft":
        mask = np.asarray(stream(seed, MASK).random(tuple(shape), dtype=np.float32))
        draw = masked_noise(draw, mask)
    step, done = DDPM.start(schedule), set()
    for t in case.config["t"]:
        results = {
            f"q_sample_t{t}": schedule.noised(clean, t + 1, draw(clean)),
            f"post_mean_t{t}": step(state, clean, t + 1, t, np.zeros_like),
            f"p_sample_t{t}": step(state, clean, t + 1, t, draw),
        }
        for name in results.keys() & case.outputs.keys():
            compare(case, name, results[name])
            done.add(name)
    assert done == set(case.outputs)
