"""Captions: left becomes right, third person becomes command, index text becomes verb phrases."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from motionloom_train.data.words import LABELS, describe_index, gerund, imperative, mirror_text, phrases, sentence

SIDES = st.sampled_from(["left", "right", "Left", "Right", "clockwise", "counterclockwise", "leftwards", "rightmost"])
OTHER = st.sampled_from(
    ["a", "person", "turns", "bright", "cleft", "copyright", "hand,", "and", "left-handed", "(right)"]
)


@given(st.lists(SIDES | OTHER, max_size=12))
def test_mirrored_twice_is_the_same_text(words: list[str]) -> None:
    text = " ".join(words)
    assert mirror_text(mirror_text(text)) == text


@given(st.text(st.sampled_from("leftrighanciokws- LRC."), max_size=60))
def test_other_spellings_settle_after_one_mirroring(text: str) -> None:
    """'anti-clockwise' comes back as 'counterclockwise'; from then on two mirrorings change nothing."""
    once = mirror_text(text)
    assert mirror_text(mirror_text(once)) == once


@pytest.mark.parametrize(
    ("text", "mirrored"),
    [
        ("turns Left, then right", "turns Right, then left"),
        ("moves leftwards", "moves rightwards"),
        ("anti-clockwise circle", "clockwise circle"),
        ("a counter clockwise turn", "a clockwise turn"),
        ("a bright cleft copyright", "a bright cleft copyright"),
        ("with the left-hand", "with the right-hand"),
    ],
)
def test_sides_change_and_nothing_else(text: str, mirrored: str) -> None:
    assert mirror_text(text) == mirrored


@pytest.mark.parametrize(
    ("phrase", "command"),
    [
        ("walks forward", "walk forward"),
        ("crouches down", "crouch down"),
        ("does a cartwheel", "do a cartwheel"),
        ("bends down and stretches the arms", "bend down and stretch the arms"),
        ("stands up then waves", "stand up then wave"),
        ("boxes", "box"),
        ("s", "s"),
        ("walks and s", "walk and s"),
    ],
)
def test_commands_are_bare_verbs(phrase: str, command: str) -> None:
    assert imperative(phrase) == command


@pytest.mark.parametrize(
    ("phrase", "fragment"),
    [
        ("walks forward", "walking forward"),
        ("sits down and stands up again", "sitting down and standing up again"),
        ("walks, turns around and walks back", "walking, turning around and walking back"),
        ("stands there, hands on the hips", "standing there, hands on the hips"),
        ("is lying flat", "lying flat"),
        ("is on hands and knees", "being on hands and knees"),
        ("lies down", "lying down"),
        ("carries a box", "carrying a box"),
        ("begins to walk", "beginning to walk"),
        ("s", "s"),
        ("walks, s, and ,", "walking, s, and ,"),
    ],
)
def test_gerunds_of_verb_phrases(phrase: str, fragment: str) -> None:
    assert gerund(phrase) == fragment


def test_a_sentence_has_a_subject_or_is_a_command_or_a_fragment() -> None:
    rng = np.random.default_rng(0)
    sentences = {sentence("walks forward", rng) for _ in range(300)}
    assert {"walk forward", "walking forward"} < sentences
    rest = sentences - {"walk forward", "walking forward"}
    assert all(text.endswith((" walks forward", " is walking forward")) for text in rest)
    assert len(rest) > 5


@pytest.mark.parametrize(
    ("description", "words"),
    [
        ("forward jump", {"jump", "forward"}),
        ("walk, veer left", {"left"}),
        ("punch/strike", {"punches"}),
        ("Walk", {"walks"}),
        ("salsa", {"dances"}),
    ],
)
def test_index_descriptions_become_phrases(description: str, words: set[str]) -> None:
    text = " ".join(describe_index(description))
    assert text
    assert any(word in text for word in words)


def test_unknown_descriptions_say_nothing_and_styles_are_added() -> None:
    assert describe_index("zzz") == ()
    assert describe_index("") == ()
    plain, styled = describe_index("walk"), describe_index("walk (angry)")
    assert set(plain) < set(styled)
    assert any(phrase.endswith("angrily") for phrase in styled)


def test_every_label_has_wordings_and_two_may_be_joined() -> None:
    assert all(len(phrases(label)) >= 2 for label in LABELS)
    assert "walks forward and waves" in phrases("walk+wave")
