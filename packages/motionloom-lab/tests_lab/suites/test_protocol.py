"""The settings of an evaluation: what can be asked, what is said about it, and that seeds never meet."""

import json
import math
from dataclasses import replace

import pytest
from hypothesis import given
from hypothesis import strategies as st

from motionloom.core.errors import MotionloomError
from motionloom_lab.suites.protocol import Protocol, Selection, Transitions, quick


@pytest.mark.parametrize(
    ("change", "word"),
    [
        ({"lengths": "guessed"}, "lengths"),
        ({"caption_length": "22"}, "caption length"),
        ({"steps": ()}, "steps"),
        ({"steps": (5, 5)}, "steps"),
        ({"steps": (0,)}, "steps"),
        ({"steps": tuple(range(1, 99))}, "steps"),
        ({"replications": 0}, "replications"),
        ({"batch": 3}, "batch"),
        ({"count": 31}, "batch of 32"),
        ({"count": 3, "batch": None}, "count"),
        ({"multimodality": (1, 1)}, "multimodality"),
        ({"multimodality": (0, 5)}, "multimodality"),
        ({"solver": "magic"}, "solver"),
        ({"guidance": math.nan}, "guidance"),
        ({"seed": -1}, "seed"),
        ({"seed": 2**62}, "seed"),
    ],
)
def test_what_cannot_be_asked_is_one_sentence(change: dict, word: str) -> None:
    with pytest.raises(MotionloomError, match=word) as caught:
        replace(Protocol(), **change)
    assert "\n" not in str(caught.value)


@pytest.mark.parametrize("change", [{"splits": ()}, {"splits": ("all",)}, {"shortest": 200}, {"unit": 0}])
def test_a_selection_of_nothing_is_a_mistake(change: dict) -> None:
    with pytest.raises(MotionloomError):
        replace(Selection(), **change)


@given(seed=st.integers(0, 2**40), replications=st.integers(2, 6), rows=st.integers(1, 50), more=st.integers(1, 50))
def test_no_seed_is_drawn_twice_in_a_run(seed: int, replications: int, rows: int, more: int) -> None:
    one = Protocol(seed=seed, replications=replications)
    seeds = [s for r in range(replications) for s in (*one.seeds(r, rows), *one.seeds(r, more, after=rows))]
    assert len(set(seeds)) == len(seeds)
    assert min(seeds) == seed


def test_described_says_whatever_changes_a_number() -> None:
    """Two protocols that differ in anything but how long they run differ in print, as plain JSON."""
    changes = {
        "lengths": "padded",
        "caption_length": "published",
        "batch": None,
        "replications": 3,
        "seed": 1,
        "multimodality": (2, 2),
        "multimodal_replications": 1,
        "steps": (7,),
        "solver": "ddim",
        "guidance": 1.0,
        "spacing": "logsnr",
    }

    def description(protocol: Protocol, selection: Selection) -> str:
        return json.dumps(protocol.described(selection, data="made up", items=40, evaluator="judge"))

    plain = description(Protocol(), Selection())
    assert all(description(replace(Protocol(), **{k: v}), Selection()) != plain for k, v in changes.items())
    others = {
        "splits": ("val",),
        "sources": (),
        "mirrored": False,
        "shortest": 60,
        "longest": 100,
        "unit": 1,
        "shorter_third": True,
    }
    assert all(description(Protocol(), replace(Selection(), **{k: v})) != plain for k, v in others.items())


def test_what_a_resumed_run_must_agree_in_leaves_out_only_how_long_it_runs() -> None:
    """A run of more replications or step counts goes on from a shorter one."""
    assert Protocol().sampling().keys() ^ Protocol.__dataclass_fields__.keys() == {"steps", "replications"}


def test_a_quick_run_is_one_batch_twice() -> None:
    short = quick(Protocol())
    assert (short.count, short.replications, short.steps) == (32, 2, (5, 12))
    assert quick(Protocol(steps=(50,))).steps == (50,)
    assert quick(Protocol(batch=None)).count == 32


def test_windows_of_transitions_are_those_of_the_paper() -> None:
    """60 frames for HumanML3D, 70 and 30 for BABEL (Shafir et al. 2023)."""
    assert Transitions().window == 60
    assert Transitions(handshake=30).window == 70
    assert Transitions(handshake=30, margin=0).window == 30
    with pytest.raises(MotionloomError):
        Transitions(handshake=0)
