"""The checks as data: complete, consistent, and reading captions as people mean them."""

import numpy as np
import pytest

from motionloom.bulk.measures import find_judge
from motionloom.core.errors import MotionloomError
from motionloom.core.models.networks.text.known import nearest
from motionloom.core.models.prior import Prior
from motionloom.core.motion import Motion
from motionloom.core.skeleton import SMPL22
from motionloom_lab.metrics.actions import MEANING
from motionloom_lab.metrics.obedience import CHECKS, Bound, check


def test_there_are_twenty_checks_with_different_names_and_prompts() -> None:
    assert len(CHECKS) == len({c.name for c in CHECKS}) == len({c.prompt for c in CHECKS}) == 20


@pytest.mark.parametrize("one", CHECKS, ids=lambda c: c.name)
def test_every_bound_is_of_a_known_number_with_a_reason(one) -> None:
    assert one.bounds
    assert all(b.measure in MEANING and len(b.why) > 10 and b.low < b.high for b in one.bounds)
    assert all(b.low != float("-inf") or b.high != float("inf") for b in one.bounds)
    assert 2 <= one.seconds <= 9.8
    assert len({one.prompt, *one.paraphrases}) == 1 + len(one.paraphrases) >= 3


def test_bounds_include_their_ends_and_say_what_they_want() -> None:
    both = Bound("turn", 45.0, 300.0, "a reason in words")
    assert both.holds({"turn": 45.0})
    assert both.holds({"turn": 300.0})
    assert not both.holds({"turn": 44.9})
    assert not both.holds({"turn": float("nan")})
    assert both.text() == "turn >= 45 and <= 300"
    assert Bound("turn", high=3.0).text() == "turn <= 3"


@pytest.mark.parametrize(
    ("name", "captions", "role"),
    [
        ("walk forward", ["a person walks forward."], "example"),
        ("walk forward", ["a person walks backward."], "related"),
        ("walk forward", ["a person punches"], "other"),
        ("walk backward", ["walks backward", "walks backwards", "steps back"], "example"),
        ("turn left", ["walks and turns left"], "example"),
        ("turn left", ["walks and turns right"], "related"),
        ("turn right", ["a man makes a right turn"], "example"),
        ("hop", ["hopping on the left foot"], "example"),
        ("hop", ["a person hops forward"], "related"),
        ("sit down", ["someone sits on a stool"], "example"),
        ("walk in a circle", ["a person walks in a counter-clockwise circle"], "example"),
        ("walk in a circle", ["walks in a half circle"], "related"),
        ("kick", ["a person kicks a ball", "the figure plays", "nothing", "else"], "related"),
        ("dance", [], "other"),
    ],
)
def test_captions_make_a_clip_an_example_or_not(name: str, captions: list[str], role: str) -> None:
    assert check(name).role(captions) == role


def test_an_unknown_check_is_answered_with_the_list() -> None:
    with pytest.raises(MotionloomError, match="walk forward, walk backward"):
        check("fly")


def test_the_judge_of_prompts_knows_some_and_says_so_of_others() -> None:
    judge = find_judge("motionloom_lab.metrics.obedience:obeys")
    turns = np.tile([1.0, 0, 0, 0], (80, 22, 1))
    still = Motion(SMPL22, 20.0, np.tile([0.0, 0.95, 0.0], (80, 1)), turns).positions()
    assert judge("a person stands still", still, 20.0) is True
    assert judge("A person walks forward.", still, 20.0) is False
    assert judge("a person plays the violin", still, 20.0) is None


def test_the_weights_that_ship_know_most_of_the_prompts() -> None:
    """docs/words.md has the shares."""
    prior = Prior.load("default")
    assert prior.known is not None
    prompts = [check.prompt for check in CHECKS]
    assert sum(match.near for match in nearest(prior.known, prompts, prior.text)) >= 0.9 * len(prompts)
