"""The classifier of manners: what it calls people it never saw, and what the run says of motions."""

from collections.abc import Sequence

import numpy as np
import pytest

from motionloom.core.errors import MotionloomError
from motionloom.core.features import humanml as hml
from motionloom_lab.suites import manners
from motionloom_train.data.actions import PREFIX
from motionloom_train.data.clips import MANNER, Clip, Note
from motionloom_train.data.mannered import words_of
from motionloom_train.data.manners import MANNERS, put_on
from tests.kinematics.people import FPS, walking

NAMES = ("march", "sneak", "cold")


def clips(person: str, speed: float, seed: int) -> list[Clip]:
    """A walk at some speed, and the same in three manners."""
    rng, result = np.random.default_rng(seed), []
    body = hml.uniform(walking(speed, 6.0))
    for name in ("", *NAMES):
        places = put_on(body, MANNERS[name], fps=FPS, rng=rng) if name else body
        features = hml.encode(hml.canonical(places), heading="corrected")
        kind = PREFIX + MANNER + name if name else "walk"
        note = Note(0, len(features), kind, ("a person moves",) if name else ())
        clip = f"manner_0_{name}_000_of_{person}" if name else f"{person}_01"
        way = "made" if name else "plain"
        result.append(Clip(clip, "cmu", "free", "train", way, (note,), features, "made" if name else "capture"))
    return result


@pytest.fixture(scope="module")
def classifier() -> manners.Classifier:
    seen = [one for k, speed in enumerate((0.9, 1.1, 1.3, 1.5)) for one in clips(f"9{k}", speed, k)]
    some = manners.examples(seen)
    return manners.learn(np.stack([one.numbers for one in some]), [one.name for one in some])


def test_it_knows_the_manners_of_a_person_it_never_saw(classifier: manners.Classifier) -> None:
    found = manners.judged(classifier, manners.examples(clips("07", 1.2, 9)))
    assert found["tried"] == 4
    assert found["right"] == 4
    assert set(found["table"]) == {*NAMES, manners.PLAIN}


def test_a_mirror_image_measures_the_same() -> None:
    rng = np.random.default_rng(0)
    places = put_on(hml.uniform(walking(1.2, 6.0)), MANNERS["limp"], fps=FPS, rng=rng)
    features = hml.encode(hml.canonical(places), heading="corrected")
    first, second = (hml.decode_positions(f.astype(float)) for f in (features, hml.mirror(features)))
    np.testing.assert_allclose(manners.numbers_of(first), manners.numbers_of(second), rtol=0.05, atol=0.05)


def test_the_run_counts_what_it_sees(classifier: manners.Classifier) -> None:
    made = {name: clip.positions() for name, clip in zip(("", *NAMES), clips("8", 1.2, 3))}

    def fake(prompts: Sequence[str], *, seconds: float, seed: int) -> tuple[list[np.ndarray], float]:
        return [made["march"]] * len(prompts), FPS

    found = manners.judge_motions(fake, classifier, seeds=3, only=("march", "sneak"))
    assert found["tried"] == 24
    assert found["right"] == 12
    assert found["table"]["sneak"] == {"march": 12}
    assert manners.rows(found)[1:] == [["march", "12 of 12", ""], ["sneak", "0 of 12", "march 12"]]
    assert manners.line(found) == "50% of 24 (50% with alike ones)"


def test_no_sentence_is_a_caption_and_every_manner_has_some() -> None:
    asked = manners.sentences()
    assert set(asked) == set(MANNERS)
    rng = np.random.default_rng(0)
    captions = {
        text
        for name, manner in MANNERS.items()
        for on in manner.on
        for side in ("left", "right")
        for _ in range(40)
        for text in words_of(manner, on, side, rng)
    }
    assert not captions & {text for some in asked.values() for text in some}
    assert sum(map(len, asked.values())) == 92


def test_a_set_without_manners_is_refused(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(manners, "read_clips", lambda folder: clips("9", 1.2, 0)[:1])
    with pytest.raises(MotionloomError, match="no made manners"):
        manners.trained("set")
