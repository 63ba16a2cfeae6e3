"""Whole sentences of actions, gestures and labels: entries name something, sides are said where they belong."""

import re

import pytest

from motionloom_lab.metrics.obedience import SETS
from motionloom_train.data.actions import ACTIONS
from motionloom_train.data.clips import Note
from motionloom_train.data.made import GESTURES
from motionloom_train.data.sets import sayings, table
from motionloom_train.data.words import LABELS


def test_every_entry_is_of_an_action_a_gesture_or_a_label() -> None:
    known = {f"action:{a}" for a in ACTIONS} | {f"gesture:{g}" for g in GESTURES} | {f"label:{name}" for name in LABELS}
    assert not set(table()) - known
    for key, entry in table().items():
        assert len(entry["says"]) == len(set(entry["says"])) >= 20, key
        assert all("{side}" in text for text in entry.get("sided", [])), key
        assert not any("{" in text for text in entry["says"]), key


def test_no_prompt_of_the_suites_is_among_them() -> None:
    """What the prior is judged by must not be what it was taught, word for word."""
    prompts = {text.lower() for check in SETS["all"] for text in (check.prompt, *check.paraphrases)}
    assert not prompts & {text for entry in table().values() for text in entry["says"]}


def test_sides_are_said_only_where_the_note_names_one() -> None:
    plain = sayings(Note(0, 40, "action:kick", ("a person kicks",)))
    left = sayings(Note(0, 40, "action:kick", ("a person kicks with the left leg",)))
    assert plain
    assert not any(re.search(r"\b(left|right)\b", text) for text in plain)
    assert set(plain) < set(left)
    assert all("left" in text for text in set(left) - set(plain))


def test_a_turn_round_to_the_right_is_said_with_its_side() -> None:
    right = sayings(Note(0, 90, "action:walk turn around", ("walks there, turns right around and comes back",)))
    assert right
    assert all("right" in text for text in right)


@pytest.mark.parametrize(("text", "said"), [("a person claps", True), ("a person walks and claps", False)])
def test_gestures_of_people_who_walk_get_no_sentence_of_those_who_stand(text: str, *, said: bool) -> None:
    assert bool(sayings(Note(0, 60, "action:made clap", (text,)))) == said


def test_captions_get_none() -> None:
    assert sayings(Note(0, 60, "human", ("a person walks",))) == ()
