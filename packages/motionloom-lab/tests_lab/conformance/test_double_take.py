"""Group `double_take`: both takes as the published code makes them, on a formula and on the published network."""

from types import SimpleNamespace

import numpy as np
import pytest

from motionloom.core.diffusion import cosine, guide
from motionloom.core.methods.double_take import MODES, Plan, Takes, double_take, flags
from tests.conformance.runner import Case, cases, compare
from tests_lab.conformance.test_sampling import dummy, published_network, recorded_draw, to_motion


def as_sampling(recorded: Case, shape: tuple[int, ...]):
    """The case as the group `sampling` has it: with the shape of what is drawn."""
    return SimpleNamespace(config={**recorded.config, "shape": list(shape)})


def networks(recorded: Case):
    """Denoisers of the first and of the second take."""
    config, rows = recorded.config, len(recorded.config["lengths"])
    nets = {"dummy": dummy, "mdm": published_network}[config["network"]]
    shape = (rows, config["channels"], 1, max(config["lengths"]))
    net, cond, null = nets(as_sampling(recorded, shape))  # type: ignore[arg-type]
    nothing = null[: rows - 1] if isinstance(null, np.ndarray) else type(null)(*(part[: rows - 1] for part in null))
    return guide(net, cond, null, config["guidance"]), guide(net, nothing, nothing, 0.0)


def takes_of(recorded: Case) -> tuple[Takes, int]:
    """The run, and how often noise was drawn."""
    config, count = recorded.config, 0
    noise = as_sampling(recorded, ())

    def draw(like: np.ndarray) -> np.ndarray:
        nonlocal count
        count += 1
        noise.config["shape"] = [like.shape[0], like.shape[2], 1, like.shape[1]]
        return source(like)

    source = recorded_draw(noise)  # type: ignore[arg-type]
    plan = Plan.of(config["lengths"], config["handshake"], config["blend"])
    x = draw(np.empty((len(config["lengths"]), max(config["lengths"]), config["channels"]), np.float32))
    first, second = networks(recorded)
    schedule = cosine(config["steps"])
    assert round(MODES["published"].restart * config["steps"]) == config["steps"] - config["skip"]
    takes = double_take(
        first,
        second,
        x,
        plan,
        mode=MODES["published"],
        way=range(config["steps"], -1, -1),
        schedule=schedule,
        noise=(draw, draw),
        second_take_only=config["second_take_only"],
    )
    return takes, count


@pytest.mark.parametrize("recorded", cases("double_take", kind="double_take"))
def test_both_takes_give_the_published_numbers(recorded):
    takes, count = takes_of(recorded)
    plan = Plan.of(recorded.config["lengths"], recorded.config["handshake"], recorded.config["blend"])
    assert count == recorded.config["noise_draws"]
    compare(recorded, "first_take", to_motion(takes.first))
    compare(recorded, "first_is_transition", flags(plan).astype(np.float32))
    compare(recorded, "sandwich", to_motion(takes.sandwich))
    compare(recorded, "mask", takes.keep)
    compare(recorded, "second_take", to_motion(takes.second))
    compare(recorded, "rebuilt", to_motion(takes.rebuilt))
    compare(recorded, "unfolded", to_motion(takes.unfolded))
