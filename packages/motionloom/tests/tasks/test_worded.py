"""Sentences with numbers: drawn again until the count is right, the same from Python as from the command line."""

from dataclasses import replace

import numpy as np
import pytest

from motionloom.core.errors import MotionloomError
from motionloom.core.models.prior import Prior
from motionloom.core.motion import Motion
from motionloom.kinematics.gaze import looks
from motionloom.requests.sampling import Sampling
from motionloom.tasks import reattempts, worded
from motionloom.tasks.text import generate
from motionloom.tasks.watching import watching
from tests.recorded import tiny


@pytest.fixture(scope="module")
def prior() -> Prior:
    return tiny.prior()


def test_it_is_drawn_again_until_the_number_is_right(prior: Prior, monkeypatch: pytest.MonkeyPatch) -> None:
    """The first drawing that has it is kept; the strokes get shorter where there were too many; the seeds differ."""
    counts, timelines = iter([4, 3, 2, 9]), []

    def draw_one(_: Prior, timeline, sampling: Sampling, __: bool) -> Motion:
        timelines.append((timeline.seconds, sampling.seed))
        return generate(prior, "a person stands", seconds=1.0, steps=1)[0]

    monkeypatch.setattr(worded, "_sample_timeline", draw_one)
    monkeypatch.setattr(worded, "measured", lambda *_: next(counts))
    spoken = worded.read(prior, "a person jumps twice")
    (result,) = worded.generate_timelines(prior, [spoken], seeds=[5])
    assert [one.measured for one in result.amounts] == [2]
    assert result.amounts[0].kept
    assert not result.amounts[0].problem
    assert len({seed for _, seed in timelines}) == 3
    assert timelines[0][1] == 5
    assert timelines[0][0] > timelines[1][0] > timelines[2][0]


def test_the_nearest_is_kept_and_told(prior: Prior, monkeypatch: pytest.MonkeyPatch) -> None:
    counts = iter([7, 1, 4, 4, 5, 6])
    still = generate(prior, "a person stands", seconds=1.0, steps=1)[0]
    monkeypatch.setattr(worded, "_sample_timeline", lambda *_: still)
    monkeypatch.setattr(worded, "measured", lambda *_: next(counts))
    (result,) = worded.generate_timelines(prior, [worded.read(prior, "a person jumps three times")], seeds=[0])
    assert result.amounts[0].measured == 4
    assert result.amounts[0].problem == "3 jumps asked; 4 jumps drawn"


def test_python_reads_numbers_and_can_leave_them(prior: Prior) -> None:
    few = Sampling(steps=2, seed=3)
    turn, plain = generate(prior, ["turn left 90 degrees", "a person walks"], sampling=few)
    (result,) = worded.generate_worded(prior, "turn left 90 degrees", sampling=few)
    assert np.array_equal(turn.rotations, result.motion.rotations)
    assert [one.read for one in result.amounts] == ["a turn of 90 degrees to the left"]
    assert turn.seconds == pytest.approx(2.5)
    assert plain.seconds == pytest.approx(5.0)
    (literal,) = generate(prior, "turn left 90 degrees", literal=True, sampling=few)
    assert literal.seconds == pytest.approx(3.0)
    (way,) = worded.generate_worded(prior, "a person walks 2 meters, then waves", sampling=few)
    assert [segment.text for segment in way.timeline.segments] == ["a person walks 2 meters", "a person waves"]
    two, whole = (
        worded.generate_worded(prior, "a person walks, then waves", as_one=one, sampling=few)[0]
        for one in (False, True)
    )
    assert [segment.text for segment in two.timeline.segments] == ["a person walks", "a person waves"]
    assert len(whole.timeline.segments) == 1


ACTIONS = ["a person waves", "a person walks", "a person jumps"]


def attempts_of(prior: Prior, monkeypatch: pytest.MonkeyPatch, shown: dict[int, int], **how) -> tuple[list, list]:
    """Three actions, each found ``shown`` attempts after the first; what is missing before is one thing less each time.

    The motions, and the seeds of all attempts.
    """
    seeds: list[int] = []
    attempts: dict[str, int] = dict.fromkeys(ACTIONS, 0)
    each = worded.generate_each

    def sampled(*args, seeds: list[int], **more):
        seen.extend(seeds)
        yield from each(*args, seeds=seeds, **more)

    seen = seeds

    def missing(text: str, *_) -> list[str]:
        attempts[text] += 1
        return ["a wave"] * max(shown[ACTIONS.index(text)] + 1 - attempts[text], 0)

    monkeypatch.setattr(worded, "generate_each", sampled)
    monkeypatch.setattr(worded, "missing", missing)
    motions = worded.generate_worded(prior, ACTIONS, seconds=1.0, steps=2, seed=7, **how)
    return motions, seeds


def test_what_is_not_shown_is_generated_again(prior: Prior, monkeypatch: pytest.MonkeyPatch) -> None:
    motions, seeds = attempts_of(prior, monkeypatch, {0: 0, 1: 2, 2: 9})
    assert len(set(seeds)) == len(seeds) == 3 + 2 + 2 + 1
    assert seeds[:3] == [7, 8, 9]
    assert [one.timeline.segments[0].text for one in motions] == ACTIONS
    assert [bool(one.missing) for one in motions] == [False, False, True]
    [line] = [one for one in motions[2].shortfalls if "attempts" in one]
    assert line.startswith("not shown in 4 attempts: a wave")
    (third,) = generate(prior, ACTIONS[1], seconds=1.0, steps=2, seed=seeds[5], as_one=True)
    np.testing.assert_allclose(motions[1].motion.positions(), third.positions(), atol=1e-5)


def test_the_mirror_image_is_looked_at_where_words_name_a_side(prior: Prior, monkeypatch: pytest.MonkeyPatch) -> None:
    """What raises the other arm is mirrored, and sampled once; words without a side are not."""
    sampled: list[Motion] = []
    each = worded.generate_each

    def keeping(*args, **more):
        for place, motion in each(*args, **more):
            sampled.append(motion)
            yield place, motion

    def missing(text: str, positions: np.ndarray, _) -> list[str]:
        return ["a raised arm"] if np.array_equal(positions, sampled[-1].positions()) else []

    monkeypatch.setattr(worded, "generate_each", keeping)
    monkeypatch.setattr(worded, "missing", missing)
    (one,) = worded.generate_worded(prior, "a person raises the left arm", seconds=1.0, steps=2, seed=7)
    assert len(sampled) == 1
    np.testing.assert_array_equal(one.motion.positions(), sampled[0].mirror().positions())
    assert one.missing == []
    worded.generate_worded(prior, "a person raises an arm", seconds=1.0, steps=2, seed=7)
    assert len(sampled) == 1 + worded.ATTEMPTS
    (kept,) = worded.generate_worded(prior, "a person raises the left arm", seconds=1.0, steps=2, seed=7, literal=True)
    np.testing.assert_array_equal(kept.motion.positions(), sampled[-1].positions())


def test_later_attempts_have_common_verbs_for_rare_ones(prior: Prior, monkeypatch: pytest.MonkeyPatch) -> None:
    looked: list[str] = []

    def missing(text: str, *_) -> list[str]:
        looked.append(text)
        return ["a way"] if len(looked) < 3 else []

    monkeypatch.setattr(worded, "missing", missing)
    (one,) = worded.generate_worded(prior, "a soldier saunters home", seconds=1.0, steps=2, seed=7)
    assert looked == ["a soldier saunters home"] * 3
    assert one.timeline.segments[0].text == "a soldier walks home"
    assert "the manner of 'saunters' is not shown" in one.shortfalls
    (kept,) = worded.generate_worded(prior, "a soldier saunters home", seconds=1.0, steps=2, seed=7)
    assert not kept.replaced
    assert kept.timeline.segments[0].text == "a soldier saunters home"
    looked.clear()

    def first_two(text: str, *_) -> list[str]:
        looked.append(text)
        return ["a way"] if "saunters" in text and len(looked) < 9 else []

    monkeypatch.setattr(worded, "missing", first_two)
    monkeypatch.setattr(reattempts, "missing", first_two)
    (several,) = worded.generate_worded(prior, "a man saunters in, then waves", seconds=3.0, steps=2)
    assert several.replaced == "the manner of 'saunters' is not shown"
    assert several.timeline.segments[1].text == "a man waves"


def test_a_head_does_what_the_words_say_in_their_own_time(prior: Prior) -> None:
    words = "a person walks, then looks to the left"
    (plain,), (one,) = (
        worded.generate_worded(prior, words, seconds=4.0, steps=2, literal=literal) for literal in (True, False)
    )
    apart = np.degrees(np.arccos(np.clip((looks(plain.motion) * looks(one.motion)).sum(axis=1), -1, 1)))
    _, begins, ends = one.timeline.begins
    assert apart[:begins].max() < 0.1
    assert apart[(begins + ends) // 2] > 10
    (still,), (nods,) = (
        worded.generate_worded(prior, "a person nods", seconds=2.0, steps=2, literal=literal)
        for literal in (True, False)
    )
    assert np.ptp(looks(nods.motion)[:, 1] - looks(still.motion)[:, 1]) > 0.1
    assert not nods.stillness(of=0.1)


def test_who_watches_sees_the_first_attempts_and_goes_on_watching(
    prior: Prior, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Also between two motions that are read: a generator shares its reader's context."""
    seen: list[int] = []
    monkeypatch.setattr(worded, "missing", lambda *_: ["a wave"])
    timelines = [worded.read(prior, text, 1.0) for text in ACTIONS]
    with watching(lambda denoised: seen.append(denoised.move)):
        motions = worded.generate_timelines(prior, timelines, seeds=[0, 1, 2], sampling=Sampling(steps=2))
        next(motions)
        assert seen == [1, 2]
        generate(prior, "a person sits", seconds=1.0, steps=2, literal=True)
        assert seen == [1, 2, 1, 2]
        assert len(list(motions)) == 2
    assert seen == [1, 2, 1, 2]


def test_a_sentence_as_one_keeps_the_first_motion(prior: Prior, monkeypatch: pytest.MonkeyPatch) -> None:
    _, seeds = attempts_of(prior, monkeypatch, {0: 9, 1: 9, 2: 9}, as_one=True)
    assert seeds == [7, 8, 9]


def test_progress_stays_at_its_end_and_may_cancel(prior: Prior, monkeypatch: pytest.MonkeyPatch) -> None:
    calls: list[tuple[int, int]] = []
    attempts_of(prior, monkeypatch, {0: 0, 1: 1, 2: 0}, progress=lambda done, of: calls.append((done, of)))
    assert calls[:2] == [(1, 2), (2, 2)]
    assert set(calls[2:]) == {(2, 2)}
    assert len(calls) == 4


def test_actions_one_after_the_other_are_looked_for_in_their_own_time(
    prior: Prior, monkeypatch: pytest.MonkeyPatch
) -> None:
    seen: list[tuple[str, int]] = []
    monkeypatch.setattr(worded, "missing", lambda text, p, fps: seen.append((text, len(p))) or [])
    (one,) = worded.generate_worded(prior, "a person walks, then waves", seconds=3.0, steps=2)
    assert not one.missing
    begins = one.timeline.begins
    assert seen[:2] == [("a person walks", begins[1]), ("a person waves", begins[2] - begins[1])]


def test_parts_of_the_same_words_are_looked_at_as_one(prior: Prior, monkeypatch: pytest.MonkeyPatch) -> None:
    seen: list[tuple[str, int]] = []
    monkeypatch.setattr(worded, "missing", lambda text, p, fps: seen.append((text, len(p))) or [])
    (one,) = worded.generate_worded(prior, "a person walks upstairs", seconds=5.0, steps=2)
    assert len(one.timeline.segments) == 2
    assert not one.missing
    assert set(seen) == {("a person walks upstairs", 100)}


def test_another_solver_draws_one_action(prior: Prior) -> None:
    with pytest.raises(MotionloomError, match="solver ddpm"):
        generate(prior, "a person does three squats", solver="ddim", steps=2)


@pytest.mark.parametrize(("text", "still"), [("a person vacuums", True), ("a person sits and waits", False)])
def test_who_ends_standing_still_is_told(prior: Prior, text: str, still: bool) -> None:
    """Unless the words ask for it."""
    moving = generate(prior, "a person walks", seconds=2.0, steps=1)[0]
    held = replace(
        moving,
        root=np.concatenate([moving.root, np.repeat(moving.root[-1:], 60, axis=0)]),
        rotations=np.concatenate([moving.rotations, np.repeat(moving.rotations[-1:], 60, axis=0)]),
    )
    one = worded.Worded(held, worded.read(prior, text), ())
    assert one.still_from == pytest.approx(2.0, abs=0.2)
    assert bool(one.stillness(of=0.3)) == still
    assert not one.stillness(of=0.8)


def test_python_gets_the_remarks_of_the_command_line(prior: Prior) -> None:
    few = Sampling(steps=2, seed=3)
    turn, foreign = worded.generate_worded(
        prior, ["turn left 90 degrees", "eine Person geht vorwärts"], seconds=1.0, sampling=few
    )
    assert turn.remarks[0].startswith("read as: a turn of 90 degrees to the left, ")
    assert not turn.unknown
    assert "does not look like English" in foreign.remarks[0]
    assert list(foreign.unknown) == ["eine Person geht vorwärts"]
    assert set(foreign.shortfalls) <= set(foreign.remarks)
