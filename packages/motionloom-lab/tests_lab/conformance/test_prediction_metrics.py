"""Metrics of stochastic prediction against the recorded numbers of the published code: group `humanmac`, and sums."""

import numpy as np
import pytest

from motionloom_lab.metrics import prediction as pr
from tests.conformance.runner import MOTION, Case, cases, compare, normal, stream
from tests_lab.conformance.test_humanmac import sums, wave


@pytest.mark.parametrize("case", cases("humanmac", kind="hmp_metrics"))
def test_every_recorded_metric_of_the_published_code_comes_out(case: Case) -> None:
    """All outputs of the case, computed window by window as `score_window` and `CmdTally` do."""
    c, rng = case.config, stream(case.config["seed"], MOTION)
    shape, f32 = (c["frames"], c["joints"], 3), np.float32
    base = normal(rng, (1, *shape))
    samples = f32(0.4) * (base + f32(0.8) * normal(rng, (c["samples"], *shape)))
    extra = f32(0.4) * (base + f32(0.6) * normal(rng, (c["extra_futures"], *shape)))
    futures = np.concatenate([f32(0.4) * base, extra])
    limbs = pr.Limbs(tuple(map(tuple, c["limbs"])), tuple(map(tuple, c["limb_angle_chains"])))
    assert limbs == pr.H36M_LIMBS
    numbers = pr.score_window(samples, futures[0], futures, fps=50, limbs=limbs).numbers
    cmd = pr.CmdTally()
    cmd.add("walk", samples)
    values = {
        "apd": numbers["apd"],
        "ade": numbers["ade"],
        "fde": numbers["fde"],
        "mmade": numbers["mmade"],
        "mmfde": numbers["mmfde"],
        "cmd": cmd.result(c["cmd_reference"]),
        "stretch_mean_percent": numbers["stretch"],
        "stretch_rmse_percent": numbers["stretch_rmse"],
        "jitter_mean_percent": numbers["jitter"],
        "jitter_rmse_percent": numbers["jitter_rmse"],
        "angle_error_degrees": numbers["mae"],
    }
    for name, value in values.items():
        compare(case, name, value)


def test_the_reference_metrics_come_out() -> None:
    """Sines over the flat index; numbers of the published code."""
    recorded = sums()["metrics"]
    samples, truth = (
        0.4 * wave(shape, *at) for shape, at in (((5, 10, 16, 3), (0.37, 0.1)), ((10, 16, 3), (0.29, 0.5)))
    )
    futures = np.concatenate([truth[None], 0.4 * wave((2, 10, 16, 3), 0.31, 0.9)])
    limbs = pr.Limbs(tuple(map(tuple, recorded["limbseq_used"])), pr.H36M_LIMBS.chains)
    scores, tally = pr.score_window(samples, truth, futures, fps=50, limbs=limbs), pr.Tally()
    tally.add(scores)
    s = scores.numbers
    found = {
        "APD": s["apd"],
        "ADE": s["ade"],
        "FDE": s["fde"],
        "MMADE": s["mmade"],
        "MMFDE": s["mmfde"],
        "CMD_oneclass_ref0.1": tally.cmd.result(0.1),
        "stretch_mean_x100": s["stretch"],
        "stretch_rmse_x100": s["stretch_rmse"],
        "jitter_mean_x100": s["jitter"],
        "jitter_rmse_x100": s["jitter_rmse"],
        "MAE_deg": s["mae"],
    }
    again = recorded["recomputed"]
    assert recorded.keys() | again.keys() == found.keys() | {"limbseq_used", "recomputed"}
    for numbers in (recorded, again):
        assert {n: numbers[n] for n in numbers.keys() & found.keys()} == pytest.approx(
            {n: found[n] for n in numbers.keys() & found.keys()}, rel=1e-6
        )
