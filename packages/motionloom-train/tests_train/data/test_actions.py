"""Which captions name which action, and which part of a recording shows a change."""

import re

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from motionloom_train.data.actions import ACTIONS, action_of, core, sentences, side_of, strike
from motionloom_train.data.words import mirror_text
from tests.kinematics import people
from tests.work import ends


@pytest.mark.parametrize(
    ("captions", "name"),
    [
        (("a person sits down on a chair", "a standing person takes a seat"), "sit down"),
        (("someone stands up", "a person stands up from a chair"), "stand up"),
        (("a person sits down on a chair and stands up again",), "sit down and stand up"),
        (("a person gets up from lying on the back",), "get up"),
        (("a person lies down on the back",), "lie down"),
        (("a person walks, turns around and walks back",), "walk turn around"),
        (("a person runs and stops",), "stop running"),
        (("a person walks and then stops",), "stop walking"),
        (("a person crawls backwards on hands and knees",), "crawl backward"),
        (("a person crawls forward on hands and knees",), "crawl"),
        (("a person picks up a box from the floor",), "pick up"),
        (("a person walks up to a box and picks it up",), "walk and pick up"),
        (("a person kicks a ball with their right foot.",), "soccer"),
        (("a person kicks with the left leg",), "kick"),
        (("a person does push-ups", "a person lowers the body to the floor and pushes it up again"), "push-up"),
        (("a person kneels on one knee, out of breath", "a person rests on one knee, tired"), "kneeling"),
        (("a person picks something up from the floor",), "pick up"),
        (("a person throws right punches from a boxing stance",), "punch"),
    ],
)
def test_captions_name_the_action_that_people_read_in_them(captions: tuple[str, ...], name: str) -> None:
    action = action_of(captions)
    assert action is not None
    assert action.name == name


@pytest.mark.parametrize(
    "caption",
    ["sitting down and standing up, over and over", "a person waves both arms", "he waves his hands in the air"],
)
def test_what_is_said_of_more_than_one_time_or_hand_is_not_said_of_one(caption: str) -> None:
    assert action_of([caption]) is None


WORDS = [
    "a person",
    "walks",
    "walk",
    "walking",
    "runs",
    "jogs",
    "then",
    "slowly",
    "to",
    "and",
    "stops",
    "stop",
    "sits down",
    "stands up",
    "starts",
    "picks",
    "back",
    "forward",
    "turns around",
    "jumps",
    "left",
    "right",
    "lying",
    "gets up",
    "floor",
    "puts",
    "down",
    "skips",
    "crouches",
    "knee,",
]


@given(st.lists(st.sampled_from(WORDS), max_size=12).map(" ".join))
def test_patterns_mean_what_they_mean_as_expressions(text: str) -> None:
    """What is searched part by part is found where the whole expression is found, and nowhere else."""
    for action in ACTIONS.values():
        plain = any(re.search(pattern, text) for pattern in action.words) and not re.search(action.unless, text)
        assert action.named_by([text]) == plain, action.name


def test_parts_are_joined_outside_of_brackets_only() -> None:
    for action in ACTIONS.values():
        for part in (part for pattern in action.words for part in pattern.split(".*")):
            assert re.compile(part)
            assert not re.search(r"[*+]", part.replace(r"\w*", "*")), part
        assert not re.search(r"[*+]", action.unless), action.unless


@pytest.mark.parametrize("words", ["walks_", "walk ", "run stand start jog walk ", "crawl"])
def test_an_endless_caption_takes_no_endless_time(words: str) -> None:
    assert ends(lambda: action_of([words * (200_000 // len(words))]))


def test_one_caption_among_many_does_not_name_the_action() -> None:
    assert action_of(("a person claps", "a person looks at the wall", "he looks away")) is None


def test_reverse_actions_are_each_others() -> None:
    for action in ACTIONS.values():
        if action.reverse:
            assert ACTIONS[action.reverse].reverse == action.name


def test_sides_are_said_only_where_the_captions_agree_and_mirror_with_them() -> None:
    kick = ACTIONS["kick"]
    assert side_of(("a person kicks with the left leg", "a left kick")) == "left"
    assert side_of(("left then right",)) == ""
    with_side = sentences(kick, ("a person kicks with the left leg",))
    assert any("left" in text for text in with_side)
    assert not any("right" in text for text in with_side)
    assert not any("left" in text or "right" in text for text in sentences(kick))
    assert {mirror_text(text) for text in with_side} == set(sentences(kick, ("a person kicks with the right leg",)))


def test_the_core_of_a_change_is_where_it_changes() -> None:
    high = np.repeat(people.standing(0.1)[:1], 140, axis=0)
    amount = np.clip((np.arange(140) - 60) / 20, 0, 1)[:, None, None]
    positions = high * (1 - 0.4 * amount * [0, 1, 0])
    first, last = core(positions, 20.0)
    assert 45 <= first <= 66
    assert 74 <= last <= 95


def test_the_core_of_somebody_who_never_changes_is_everything() -> None:
    assert core(np.repeat(people.standing(0.1)[:1], 50, axis=0), 20.0) == (0, 50)


def test_kicks_on_the_hands_are_no_kicks() -> None:
    for name in ("cmu_85_05", "cmu_85_06", "cmu_85_07"):
        action = action_of(["kicks"], name)
        assert action is not None
        assert action.name == "breakdance"
    assert action_of(["a person does a twisting jump"], "cmu_85_01") == ACTIONS["twisting jump"]


def test_the_name_of_a_recording_overrules_its_captions() -> None:
    captions = ("a person grabbed something and moved backwards",)
    assert action_of(captions) is None
    action = action_of(captions, "accad_Male2_E10_BodyHookRight")
    assert action is not None
    assert action.name == "hook"
    assert all("right" in text or "left" not in text for text in sentences(action, side="right"))


@pytest.mark.parametrize("hand", [20, 21])
def test_a_strike_is_where_a_hand_is_fastest_and_names_the_side_that_does_it_alone(hand: int) -> None:
    body = people.walking(0.0, 5.0)
    pulse = np.exp(-(((np.arange(len(body)) - 60) / 2.5) ** 2))
    body[:, hand, 2] += 0.5 * pulse
    (first, end), side = strike(body, 20.0, "hand")
    assert first < 60 < end <= 70
    assert side == {20: "left", 21: "right"}[hand]
    body[:, 41 - hand, 2] += 0.45 * pulse
    assert strike(body, 20.0, "hand")[1] == ""


def test_a_punch_is_where_the_fist_of_its_side_goes_forward_not_where_a_hand_is_fastest() -> None:
    body = people.walking(0.0, 5.0)
    frames = np.arange(len(body))
    body[:, [20, 21], 1] = body[:, 9:10, 1]  # fists at the chest
    body[:, [20, 21], 2] = body[:, :1, 2] + 0.2
    body[:, 21, 2] += 0.4 * np.exp(-(((frames - 60) / 2.5) ** 2))
    body[:, 20, 1] -= 0.9 * np.exp(-(((frames - 20) / 2.5) ** 2))  # the other hand drops faster
    (first, end), side = strike(body, 20.0, "hand", side="right")
    assert (first < 58 < end, side) == (True, "right")
    assert strike(body, 20.0, "hand")[0][0] < 20
