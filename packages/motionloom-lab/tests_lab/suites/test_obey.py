"""The obedience run with made-up generators whose obedience is known."""

import json
from collections.abc import Sequence
from pathlib import Path

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from motionloom.core.errors import MotionloomError
from motionloom_lab.metrics.obedience import check
from motionloom_lab.report import files
from motionloom_lab.suites import obey
from motionloom_lab.suites.harness import Run
from tests.kinematics.people import FPS, circling, jumping, moved, spun, standing, walking

FORWARD, STILL = check("walk forward"), check("stand still")


class Walker:
    """Walks forward whatever it is told, but stands on odd seeds; counts its calls."""

    def __init__(self) -> None:
        self.calls: list[tuple[str, int]] = []

    def __call__(self, prompts: Sequence[str], *, seconds: float, seed: int) -> tuple[list[np.ndarray], float]:
        self.calls.append((prompts[0], len(prompts)))
        return [standing(seconds) if (seed + k) % 2 else walking(1.2, seconds) for k in range(len(prompts))], FPS


def test_each_seed_is_judged_by_itself() -> None:
    forward, still = obey.run(Run(), [FORWARD, STILL], generate=Walker(), seeds=4)
    assert [a.obeyed for a in forward.attempts] == [True, False, True, False]
    assert [a.obeyed for a in still.attempts] == [False, True, False, True]
    assert [a.seed for a in forward.attempts] == [0, 1, 2, 3]


def test_a_prompt_counts_when_nine_of_ten_seeds_obey() -> None:
    def nearly(prompts: Sequence[str], *, seconds: float, seed: int) -> tuple[list[np.ndarray], float]:
        return [standing(seconds), *[walking(1.2, seconds)] * (len(prompts) - 1)], FPS

    assert obey.totals(obey.run(Run(), [FORWARD], generate=nearly, seeds=10), [FORWARD])["prompts_obeyed"] == 1
    assert obey.totals(obey.run(Run(), [FORWARD], generate=nearly, seeds=9), [FORWARD])["prompts_obeyed"] == 0


def test_paraphrases_are_tried_and_counted_apart() -> None:
    results = obey.run(Run(), [FORWARD], generate=Walker(), seeds=2, paraphrases=True)
    totals = obey.totals(results, [FORWARD])
    assert len(results[0].attempts) == 2 * (1 + len(FORWARD.paraphrases))
    assert totals["seeds_obeyed_share"] == totals["paraphrases_obeyed_share"] == 0.5
    assert (totals["paraphrases"], totals["paraphrases_obeyed"]) == (len(FORWARD.paraphrases), 0)


def test_a_stopped_run_goes_on_without_doing_anything_twice(tmp_path: Path) -> None:
    class Stops(Walker):
        def __call__(self, prompts, *, seconds, seed):
            if self.calls:
                raise KeyboardInterrupt
            return super().__call__(prompts, seconds=seconds, seed=seed)

    with pytest.raises(KeyboardInterrupt):
        obey.run(Run(folder=tmp_path), [FORWARD, STILL], generate=Stops(), seeds=2)
    second = Walker()
    resumed = obey.run(Run(folder=tmp_path), [FORWARD, STILL], generate=second, seeds=2)
    assert second.calls == [(STILL.prompt, 2)]
    assert obey.summary(resumed, settings={}) == obey.summary(
        obey.run(Run(), [FORWARD, STILL], generate=Walker(), seeds=2), settings={}
    )


def test_results_of_other_settings_are_not_mixed_in(tmp_path: Path) -> None:
    obey.run(Run(folder=tmp_path), [FORWARD], generate=Walker(), seeds=2, settings={"steps": 10})
    with pytest.raises(MotionloomError, match="other settings"):
        obey.run(Run(folder=tmp_path), [FORWARD], generate=Walker(), seeds=2, settings={"steps": 20})


@pytest.mark.parametrize("damage", ["", "{}", "[]", '{"settings": 1', "null"])
def test_a_damaged_result_file_is_one_clear_sentence(tmp_path: Path, damage: str) -> None:
    (tmp_path / "obedience.json").write_text(damage)
    with pytest.raises(MotionloomError, match=r"obedience\.json"):
        obey.run(Run(folder=tmp_path), [FORWARD], generate=Walker(), seeds=1)


_JSON = st.recursive(
    st.none() | st.booleans() | st.floats() | st.text(max_size=5),
    lambda inner: (
        st.lists(inner, max_size=3)
        | st.dictionaries(
            st.sampled_from(["name", "attempts", "prompt", "seed", "obeyed", "measured", "x"]), inner, max_size=4
        )
    ),
    max_leaves=12,
)


@given(checks=_JSON)
@settings(max_examples=150, deadline=None)
def test_any_json_in_place_of_results_is_read_or_refused(
    tmp_path_factory: pytest.TempPathFactory, checks: object
) -> None:
    path = tmp_path_factory.mktemp("found") / "obedience.json"
    path.write_text(json.dumps({"settings": {"a": 1}, "checks": checks}))
    try:
        results = obey._read(path, {"a": 1})
    except MotionloomError as error:
        message, results = str(error), {}
    else:
        message = str(path)
    assert str(path) in message
    assert all(isinstance(a, obey.Attempt) for attempts in results.values() for a in attempts)


def test_a_changed_bound_changes_the_fingerprint() -> None:
    from dataclasses import replace

    other = replace(FORWARD, limits=(replace(FORWARD.limits[0], low=9.0), *FORWARD.limits[1:]))
    assert obey.fingerprint([FORWARD]) != obey.fingerprint([other])


def test_no_seeds_is_a_mistake() -> None:
    with pytest.raises(MotionloomError, match="seeds"):
        obey.run(Run(), [FORWARD], generate=Walker(), seeds=0)


def test_tables_have_a_row_per_prompt_and_json_is_plain(tmp_path: Path) -> None:
    results = obey.run(Run(folder=tmp_path), [FORWARD, STILL], generate=Walker(), seeds=2)
    rows = obey.table(results, real={"walk forward": {"held_out": "9/10", "all": "90/100"}})
    assert [row[0] for row in rows[1:]] == [FORWARD.prompt, STILL.prompt]
    assert rows[1][1:5] == ["1/2", "", "9/10", "90/100"]
    assert files.markdown(rows).count("\n") == 3
    assert json.loads((tmp_path / "obedience.json").read_text())["totals"]["prompts"] == 2


PEOPLE = {
    "walk forward": walking(1.2),
    "walk backward": spun(walking(1.2), np.full(80, np.pi)),
    "walk sideways": spun(walking(1.0), np.full(80, np.pi / 2)),
    "run": walking(3.0),
    "jump": jumping(0.35),
    "turn left": spun(standing(), np.linspace(0, np.pi / 2, 80)),
    "turn right": spun(standing(), np.linspace(0, -np.pi / 2, 80)),
    "walk in a circle": circling(1.0, 1.0),
    "climb": moved(standing(), np.repeat(np.clip(np.linspace(-0.5, 1.5, 80), 0, 1)[:, None], 3, 1) * [0, 1.0, 0]),
    "stand still": standing(),
}


@pytest.mark.parametrize("action", PEOPLE)
def test_a_made_up_person_obeys_its_own_check_and_no_opposite(action: str) -> None:
    from motionloom_lab.metrics.actions import measure
    from motionloom_lab.metrics.obedience import CHECKS

    allowed = {"run": {"jog"}, "walk in a circle": {"walk forward"}}.get(action, set())
    passed = {c.name for c in CHECKS if c.name in PEOPLE or c.name == "jog"} & {
        c.name for c in CHECKS if c.obeyed(measure(PEOPLE[action], FPS))
    }
    assert passed - allowed == {action}


def test_a_report_with_no_place_is_refused_before_any_motion_is_made(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.chdir(tmp_path)
    (tmp_path / "taken").write_text("")
    with pytest.raises(MotionloomError, match=r"cannot write '?taken"):
        obey.run(Run(folder=Path("taken")), generate=lambda *_, **__: pytest.fail("a motion was made"))
