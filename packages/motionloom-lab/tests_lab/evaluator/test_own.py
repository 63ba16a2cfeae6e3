"""What is asked of an evaluator: damages of known amount, retrieval of known answers, agreement in closed form."""

from collections.abc import Sequence
from pathlib import Path

import numpy as np
import pytest

from motionloom.core.errors import MotionloomError
from motionloom.core.features import humanml as hml
from motionloom.core.features.representation import HUMANML3D
from motionloom_lab.evaluator import own
from motionloom_lab.evaluator.agreement import Scored, agreement, within_prompts
from motionloom_lab.evaluator.evaluators import Caption, load_evaluator
from motionloom_lab.metrics.obedience import CHECKS
from motionloom_lab.report.report import Value
from motionloom_train.data.clips import Clip, Note, write_clip
from tests.kinematics import people
from tests.recorded import tiny

SHIPPED = own.SHIPPED in own.evaluators()


def features(positions: np.ndarray) -> np.ndarray:
    return hml.encode(hml.canonical(positions), heading="corrected")


class Speedometer:
    """An evaluator that knows nothing but how fast a person goes: captions are numbers of metres per second."""

    name, representation = "speedometer", HUMANML3D
    about: dict[str, str] = {}  # noqa: RUF012

    def motions(self, motions: Sequence[np.ndarray]) -> np.ndarray:
        return self._points([20 * float(m[:, 2].mean()) for m in motions])

    def texts(self, captions: Sequence[Caption]) -> np.ndarray:
        return self._points([float(c.text.split()[-1]) if c.text[-1].isdigit() else 0.0 for c in captions])

    @staticmethod
    def _points(speeds: list[float]) -> np.ndarray:
        angle = np.array(speeds)[:, None] / 3
        return np.concatenate([np.cos(angle), np.sin(angle)], axis=1)


@pytest.fixture(scope="module")
def data(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Thirty-three held-out walks of different speeds, captioned with them."""
    folder = tmp_path_factory.mktemp("set")
    (folder / "clips").mkdir()
    for number in range(33):
        speed = 0.3 + 0.06 * number
        walk = features(people.walking(speed, 2.2))
        notes = (Note(0, len(walk), "human", (f"a person walks forward or left at {speed:.2f}",)),)
        if number < 2:
            notes += (Note(0, len(walk), "walk left turn"),)
        write_clip(folder / "clips", Clip(f"c{number:02d}", "cmu", "free", "val", "plain", notes, walk))
    (folder / "set.json").write_text("{}")
    return folder


def test_damages_are_of_the_amount_they_say() -> None:
    """No noise and normal speed give the motion back; double speed halves it; frozen ends do not move."""
    walk, rng = features(people.walking(1.2, 4.0)), np.random.default_rng(0)
    assert own.noise(0.0)(walk, rng)[:, :67] == pytest.approx(walk[:-1, :67], abs=1e-4)
    shaken = hml.decode_positions(own.noise(0.02)(walk, rng).astype(np.float64))
    spread = np.linalg.norm(np.diff(shaken[:, 15] - shaken[:, 0], axis=0), axis=-1)
    assert np.sqrt((spread**2).mean()) == pytest.approx(0.02 * np.sqrt(3 * 4), rel=0.2)  # four draws, three axes
    fast = own.playback(2.0)(walk, rng)
    assert len(fast) == pytest.approx(len(walk) / 2, abs=1)
    assert fast[:, 2].mean() == pytest.approx(2 * walk[:, 2].mean(), rel=0.02)
    half = own.frozen(0.5)(walk, rng)
    still = len(walk) // 2
    assert np.abs(half[still:, 193:259]).max() < 1e-5
    assert half[: still - 2, :67] == pytest.approx(walk[: still - 2, :67], abs=1e-4)
    assert np.abs(own.frozen(1.0)(walk, rng)[:, 193:259]).max() < 1e-5


def test_the_rank_is_that_of_a_text_among_motions() -> None:
    """Five equal texts at 0 and motions at 0, 1, 2, 3, 4: the places are 1 to 5, their median 3."""
    line = np.arange(5.0)[:, None]
    assert own.median_rank(np.zeros((5, 1)), line) == 3.0
    assert own.median_rank(line, np.zeros((5, 1))) == 1.0


def test_captions_are_handed_on_for_the_share_that_is_asked() -> None:
    """None at 0, each at 1, ten of forty at a quarter; the captions stay the same ones."""
    rng = np.random.default_rng(0)
    for share, moved in ((0.0, 0), (0.25, 10), (1.0, 40)):
        order = own._handed_on(np.arange(40), share, rng)
        assert (order != np.arange(40)).sum() == moved
        assert sorted(order) == list(range(40))


def test_a_response_is_monotone_within_its_intervals() -> None:
    """Steps the wrong way count where they exceed both intervals, and the whole must go the right way."""
    assert own.monotone([Value(0.0), Value(1.0), Value(2.0)], 1)
    assert not own.monotone([Value(0.0), Value(2.0), Value(1.0)], 1)
    assert own.monotone([Value(3.0, 0.1), Value(3.15, 0.1), Value(1.0, 0.1)], -1)
    assert not own.monotone([Value(3.0, 0.1), Value(3.15, 0.1)], -1)


def test_an_evaluator_that_reads_speeds_is_seen_through(data: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """Right captions always found, shuffled ones never; speed noticed, mirroring not."""
    for name, amounts in (("NOISE", (0.01,)), ("SHARES", (0.5, 1.0)), ("SPEEDS", (1.41, 2.0))):
        monkeypatch.setattr(own, name, amounts)
    report = own.validate(Speedometer(), data, repeats=3)
    rows = {row.name: row.values for row in report.rows}
    assert rows["real"]["top1"].mean == 1.0
    assert rows["real"]["rank"].mean == 1.0
    assert rows["real"]["distance"].mean == pytest.approx(0.0, abs=0.02)
    assert rows["captions shuffled, 100%"]["top1"].mean < 0.05
    assert rows["captions shuffled, 50%"]["top1"].mean == pytest.approx(0.5, abs=0.1)
    assert rows["chance"]["top3"].mean == 3 / 32
    assert rows["played 2 times as fast"]["noticed"] == Value(1.0, count=33)
    assert rows["played 2 times as fast"]["fid"].mean > rows["played 1.41 times as fast"]["fid"].mean > 0.01
    assert rows["re-encoded, undamaged"]["fid"].mean == pytest.approx(0.0, abs=1e-4)
    assert rows["reversed in time"]["top1"].mean < 0.1
    assert rows["mirrored, captions with a side"]["top1"].mean == 1.0
    assert rows["mirrored, measured turns to a side"]["noticed"].count == 2
    assert "faster: fid is monotone in the amount, within intervals." in report.notes


def test_too_few_motions_are_refused(data: Path, tmp_path: Path) -> None:
    """A rank among 32 needs 32."""
    (tmp_path / "clips").mkdir()
    (tmp_path / "set.json").write_text("{}")
    for path in sorted((data / "clips").iterdir())[:31]:
        (tmp_path / "clips" / path.name).write_bytes(path.read_bytes())
    with pytest.raises(MotionloomError, match="31 captioned"):
        own.validate(Speedometer(), tmp_path)


def test_the_chance_of_a_right_order_is_counted_within_prompts() -> None:
    """By hand: prompt 0 wins both of its pairs, prompt 1 ties (half), prompt 2 has no pair; AUC (2 + 0.5) / 3."""
    own_distance = [0.5, 0.6, 0.9, 0.7, 0.7, 0.1]
    prompts, obeyed = np.array([0, 0, 0, 1, 1, 2]), np.array([True, False, False, True, False, True])
    far = np.full((6, 3), 5.0)
    far[np.arange(6), prompts] = own_distance
    chance = within_prompts([Scored(prompts, obeyed, far)])
    assert chance.mean == pytest.approx(2.5 / 3)
    assert chance.count == 2
    assert np.isnan(within_prompts([Scored(prompts[:1], obeyed[:1], far[:1])]).mean)


class Blind(Speedometer):
    """Reads the words' length where the speedometer reads a number."""

    def texts(self, captions: Sequence[Caption]) -> np.ndarray:
        return self._points([len(c.text) / 10 for c in captions])


def test_generated_motions_are_judged_by_physics_and_evaluator() -> None:
    """A prior of random weights: every way to sample gets its row, shares count all motions."""
    ways = {"as generate": {"steps": 2}, "guidance 0": {"steps": 2, "guidance": 0.0}}
    report = agreement(Blind(), tiny.prior(), seeds=2, checks=CHECKS[:3], settings=ways)
    assert [row.name for row in report.rows] == ["as generate", "guidance 0", "all ways together"]
    assert report.rows[0].values["obeyed"].count == 6
    assert 0 <= report.rows[0].values["top1"].mean <= 1
    with pytest.raises(MotionloomError, match="seeds"):
        agreement(Blind(), tiny.prior(), seeds=0)


def test_what_is_no_evaluator_is_refused(tmp_path: Path) -> None:
    """A name nobody has, and a file of another kind."""
    with pytest.raises(MotionloomError, match="own"):
        load_evaluator("no such thing")
    (tmp_path / "a.safetensors").write_bytes(b"x" * 40)
    with pytest.raises(MotionloomError, match=r"a\.safetensors"):
        load_evaluator(str(tmp_path / "a.safetensors"))


@pytest.mark.skipif(not SHIPPED, reason="no evaluator ships")
def test_the_shipped_evaluator_is_small_and_says_what_it_is() -> None:
    """Under 20 MB, with a licence."""
    assert own.evaluators()[own.SHIPPED].stat().st_size < 20e6
    evaluator = load_evaluator("own")
    assert evaluator.name == "evaluator"
    assert "commercial" in evaluator.about["licence"]


@pytest.mark.skipif(not SHIPPED, reason="no evaluator ships")
def test_the_shipped_evaluator_knows_made_up_people() -> None:
    """Walking ahead, standing, and a circle to the left lie nearest to their own words; so does the film run back."""
    walk, stand = features(people.walking(1.2, 5.0)), features(people.standing(5.0))
    shown = [walk, stand, own.reverse(walk, np.random.default_rng(0))]
    sentences = ["a person walks forward", "a person stands still", "a person walks backward"]
    evaluator = load_evaluator("own")
    texts, motions = evaluator.texts([Caption(text) for text in sentences]), evaluator.motions(shown)
    assert np.linalg.norm(texts[:, None] - motions[None], axis=-1).argmin(1).tolist() == [0, 1, 2]
    assert np.linalg.norm(motions, axis=1) == pytest.approx(1.0, abs=1e-5)


def test_turns_are_measured_and_not_named_by_captions() -> None:
    """Actions that name a side have no wordings of their own."""
    turn = features(people.walking(1.0, 5.0))
    notes = (Note(0, 80, "action:walk turn right", ("she turns right",)), Note(0, 60, "turn left"), Note(0, 60, "walk"))
    held = own.held_out([Clip("one", "cmu", "free", "val", "plain", notes, turn)])
    assert len(held.turns) == 1
    assert "left" in held.turns[0][1]
