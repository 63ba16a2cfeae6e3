"""Requests from strangers: whatever JSON comes is a request or one sentence; timelines come back as they went."""

import json
from pathlib import Path
from typing import Any

import pytest
from hypothesis import HealthCheck, example, given, settings
from hypothesis import strategies as st

pytest.importorskip("starlette", reason="needs the extra 'studio'")

from motionloom.core.errors import MotionloomError
from motionloom.requests.fields import specs
from motionloom.requests.tasks import REQUESTS
from motionloom.server.drawing import batch_key
from motionloom.server.job_request import JobRequest, read_request
from motionloom.server.limits import Limits
from motionloom.server.project import Project
from motionloom.server.refusal import Refusal
from motionloom.server.timelines import timeline_json, timeline_yaml


@pytest.fixture(scope="module")
def project(tmp_path_factory: pytest.TempPathFactory) -> Project:
    return Project(tmp_path_factory.mktemp("project"), Limits())


SCALARS = (
    st.none() | st.booleans() | st.integers() | st.floats(allow_nan=False, allow_infinity=False) | st.text(max_size=8)
)
NAMES = st.sampled_from(
    ["text", "seconds", "path", "points", "joints", "joint", "time", "position", "from", "segments"]
)
JSON = st.recursive(
    SCALARS, lambda inner: st.lists(inner, max_size=3) | st.dictionaries(NAMES | st.text(max_size=5), inner, max_size=3)
)
KNOWN = st.sampled_from(sorted({key for request in REQUESTS.values() for key in specs(request)} | {"levels"}))


@settings(max_examples=150, suppress_health_check=[HealthCheck.function_scoped_fixture, HealthCheck.too_slow])
@given(task=st.sampled_from(sorted(REQUESTS)), more=st.dictionaries(KNOWN, JSON, max_size=5))
def test_any_json_is_a_request_or_one_sentence(project: Project, task: str, more: dict[str, Any]) -> None:
    outcome: JobRequest | MotionloomError | Refusal
    try:
        outcome = read_request({"task": task} | more, project, Limits())
    except (MotionloomError, Refusal) as error:
        outcome = error
    if isinstance(outcome, JobRequest):
        assert 1 <= outcome.count <= Limits().count
    elif isinstance(outcome, Refusal):
        assert 400 <= outcome.status < 500
    else:
        assert "\n" not in str(outcome)


WORDS = st.text(min_size=1, max_size=30).filter(lambda text: text.strip() and text.isprintable())
PARTS = st.fixed_dictionaries({"text": WORDS}, optional={"seconds": st.floats(1, 5), "guidance": st.floats(-3, 7)})
SEGMENTS = st.lists(PARTS, min_size=1, max_size=4)


@settings(max_examples=80, suppress_health_check=[HealthCheck.function_scoped_fixture])
@given(segments=SEGMENTS, seed=st.integers(0, 2**40))
@example(segments=[{"text": "INF"}], seed=0)
def test_a_timeline_comes_back_from_yaml_as_it_went(project: Project, segments: list[Any], seed: int) -> None:
    value = {"segments": segments, "seed": seed}
    assert timeline_json(timeline_yaml(value, project, Limits()), project, Limits()) == value


def test_reading_leaves_no_files(project: Project) -> None:
    with pytest.raises(MotionloomError):
        read_request({"task": "compose", "timeline": {"segments": 3}}, project, Limits())
    assert not list(project.motions.iterdir())


def test_requests_that_keep_their_first_motion_are_sampled_apart(project: Project) -> None:
    """Of one network call either all motions are looked at, and some generated again, or none."""
    body = {"task": "generate", "prompt": "a person walks", "seconds": 2}
    keys = [
        batch_key(read_request(body | more, project, Limits()))
        for more in ({}, {"seed": 3}, {"literal": True}, {"as_one": True})
    ]
    assert keys[0] == keys[1] != keys[2] == keys[3]


def test_a_goal_is_measured_item_by_item(project: Project) -> None:
    wrist = {"joint": "left_wrist", "points": [{"time": 1, "position": [0.3, 1.2, 0.8]}]}
    goals = {"path": {"points": [[0, 0], [0, 2]]}, "joints": [wrist, {**wrist, "joint": "right_wrist"}]}
    request = read_request({"task": "control", "prompt": "a", "seconds": 2, "goals": goals}, project, Limits())
    assert [name for name, _ in request.parts] == ["path", "joints[0]", "joints[1]"]
    counts = [int(goal.mask.any(axis=(0, 2)).sum()) for _, goal in request.parts]
    assert counts == [1, 1, 1]


@pytest.mark.parametrize("is_open", [True, False])
def test_motions_make_room_but_never_those_that_a_project_names(tmp_path: Path, is_open: bool) -> None:
    import numpy as np

    from motionloom import SMPL22, Motion

    small = Project(tmp_path, Limits(motions=3))
    still = Motion(SMPL22, 20.0, np.zeros((2, 3)), np.tile([1.0, 0, 0, 0], (2, 22, 1)))
    first = small.add([still], {})
    named = json.dumps({"id": "film", "takes": [first.id]}).encode()
    small.save_project(named) if is_open else small.shelf.keep("film", named)
    others = [small.add([still, still], {}).id for _ in range(4)]
    assert small.motion(first.id).people
    assert len(small.motion(others[-1]).people) == 2
    with pytest.raises(Refusal):
        small.motion(others[0])
    assert len(list(small.motions.glob("*.json"))) == 3
    assert not list(small.motions.glob(f"{others[0]}*"))
