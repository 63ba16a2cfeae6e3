"""Fields say what is wrong with a value in one sentence that begins with the place."""

import re
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

import motionloom
from motionloom.core import diffusion
from motionloom.core.errors import MotionloomError
from motionloom.requests import sampling
from motionloom.requests.fields import specs
from motionloom.requests.reading import read
from motionloom.requests.tasks import REQUESTS, Generate

SOURCE = Path(motionloom.__file__).parent


@pytest.mark.parametrize(
    ("values", "sentence"),
    [
        ({}, "the task 'generate' has no 'prompt'; it needs prompt"),
        ({"prompt": " "}, "a prompt is empty; say in words what the person does"),
        ({"prompt": "x" * 2_001}, "a prompt has 2,001 characters; say it in at most 2,000"),
        ({"prompt": 3}, "'prompt' must be text; got 3"),
        ({"prompt": "a", "secnds": 1}, "has no 'secnds' (did you mean 'seconds'?); it has prompt, "),
        ({"prompt": "a", "seconds": 0}, "'seconds' must be above 0 and at most 60 seconds; got 0"),
        ({"prompt": "a", "seconds": float("nan")}, "got nan"),
        ({"prompt": "a", "steps": True}, "'steps' must be a whole number; got true"),
        ({"prompt": "a", "steps": 1.5}, "'steps' must be a whole number from 1 to 100,000; got 1.5"),
        ({"prompt": "a", "steps": 10**400}, "got a number beyond all bounds"),
        ({"prompt": "a", "loop": 1}, "'loop' must be true or false; got 1"),
        ({"prompt": "a", "solver": "dppm"}, "'solver' is 'dppm' (did you mean 'ddpm'?); there are ddpm, "),
        ({"prompt": "a", "solver": ["ddpm"]}, "'solver' is a list of 1; there are ddpm, "),
    ],
)
def test_a_mistake_is_one_sentence_that_names_its_key(values: dict[str, Any], sentence: str) -> None:
    with pytest.raises(MotionloomError, match=re.escape(sentence)):
        read(Generate, values, "the task 'generate'")


def test_a_door_may_take_less() -> None:
    with pytest.raises(MotionloomError, match="'count' must be a whole number from 1 to 8; got 9"):
        read(Generate, {"prompt": "a", "count": 9}, "the task", most={"count": 8})
    with pytest.raises(MotionloomError, match="'between'\\[1\\] must be a list of 2 numbers; got a list of 1"):
        read(REQUESTS["edit"], {"motion": "m", "between": [[0, 1], [2]]}, "the task")


def test_values_come_as_the_fields_hold_them() -> None:
    request = read(
        Generate, {"prompt": "a", "seconds": 3, "seed": np.int64(7), "steps": 12.0, "loop": None}, "the task"
    )
    assert (request.seconds, request.sampling.seed, request.sampling.steps, request.loop) == (3.0, 7, 12, False)
    assert (type(request.seconds), type(request.sampling.seed), type(request.sampling.steps)) == (float, int, int)


JSON = (
    st.none() | st.booleans() | st.integers() | st.floats() | st.text(max_size=5) | st.lists(st.integers(), max_size=3)
)


@given(task=st.sampled_from(sorted(REQUESTS)), data=st.data())
def test_any_values_are_a_request_or_one_sentence(task: str, data: st.DataObject) -> None:
    keys = st.sampled_from(list(specs(REQUESTS[task])))
    values = data.draw(st.dictionaries(keys, JSON, max_size=5))
    request: object
    try:
        request = read(REQUESTS[task], values, f"the task {task!r}")
    except MotionloomError as error:
        request = str(error)
    assert isinstance(request, REQUESTS[task]) or (isinstance(request, str) and "\n" not in request)


def test_what_somebody_types_is_read_as_json_is() -> None:
    for name, typed, value in (("seconds", "2.5", 2.5), ("seed", "7", 7), ("solver", "ddim", "ddim")):
        assert specs(Generate)[name].parse(typed, "--x") == value
    with pytest.raises(MotionloomError, match=r"^--seed must be a whole number; got 'seven'$"):
        specs(Generate)["seed"].parse("seven", "--seed")


def test_names_of_solvers_and_spacings_are_those_of_the_sampler() -> None:
    assert set(sampling.SOLVERS) == set(diffusion.SOLVERS)
    assert sampling.SPACINGS == diffusion.SPACINGS


@pytest.mark.parametrize(
    ("settings", "kind"),
    [
        (sampling.Settings, sampling.Sampling),
        (sampling.PredictionSettings, sampling.PredictionSampling),
        (sampling.PairSettings, sampling.PairSampling),
    ],
)
def test_keywords_in_python_are_the_fields(settings: Any, kind: type) -> None:
    named = {**settings.__annotations__}
    for base in getattr(settings, "__orig_bases__", ()):
        named |= getattr(base, "__annotations__", {})
    types = {name: one.type for name, one in kind.__dataclass_fields__.items()}  # type: ignore[attr-defined]
    assert named == types


ONCE = {
    "the largest seed": r"2 ?\*\* ?62",
    "the bounds of the temperature": r"1\.1, low=0, high=2|<= *[\w.]*temperature *<=",
    "the longest motion": r"^LONGEST = 60|^    seconds: float = 60",
    "the bounds of the guidance": r"LARGEST_GUIDANCE = 100|abs\([\w.]*guidance\) <= 100",
}


@pytest.mark.parametrize("what", ONCE)
def test_every_bound_is_written_once(what: str) -> None:
    line = re.compile(f".*(?:{ONCE[what]}).*", re.MULTILINE)
    rooms = [path for path in SOURCE.rglob("*.py") if "lab" not in path.parts]
    matches = [(path.name, one) for path in rooms for one in line.findall(path.read_text())]
    assert len(matches) == 1, matches
