"""Timelines as JSON and as the YAML files of the command line; files that they name are motions of the project."""

import re
from collections.abc import Mapping
from typing import Any

import yaml

from motionloom.core.errors import MotionloomError
from motionloom.goals.timeline import Timeline, timeline_from, timeline_of, timeline_of_yaml
from motionloom.server.limits import Limits
from motionloom.server.project import Project


class _Quoting(yaml.SafeDumper):
    """Writes in quotes what is not plain words: other readers of YAML know other numbers ("0o7", "INF")."""


def _quoted(dumper: yaml.SafeDumper, text: str) -> yaml.ScalarNode:
    plain = re.fullmatch(r"(?!(?i:inf|nan|infinity)$)[^\W\d_][^\W\d_]*(?:[ _][^\W\d_]+)*", text)
    style = None if plain else '"'
    return dumper.represent_scalar("tag:yaml.org,2002:str", text, style=style)


_Quoting.add_representer(str, _quoted)


def timeline_from_json(value: Any, project: Project, limits: Limits) -> Timeline:
    """A timeline's JSON; a mistake is reported with its keys."""
    if not isinstance(value, Mapping):
        raise MotionloomError("a timeline is a mapping with 'segments', as its YAML file is")
    return _checked(timeline_from(value, folder=project.motions), limits)


def timeline_yaml(value: Any, project: Project, limits: Limits) -> str:
    """A timeline's JSON, once it has been read as a timeline, as the text of its YAML file."""
    timeline_from_json(value, project, limits)
    return yaml.dump(value, Dumper=_Quoting, sort_keys=False, allow_unicode=True, width=120)


def timeline_json(text: str, project: Project, limits: Limits) -> Any:
    """A timeline file's text, once it has been read as a timeline, as the JSON that `timeline_yaml` takes."""
    timeline, plain = timeline_of_yaml(text, folder=project.motions)
    _checked(timeline, limits)
    return plain


def sentence_json(text: str, limits: Limits) -> Any:
    """A sentence as the JSON of a timeline: a segment for each action that it has, as long as such actions take."""
    if not text.strip() or len(text) > limits.prompt:
        raise MotionloomError(f"a sentence has 1 to {limits.prompt} characters; got {len(text.strip())}")
    timeline = _checked(timeline_of(" ".join(text.split()), amounts=True), limits)
    return {"segments": [{"text": one.text, "seconds": round(one.seconds, 2)} for one in timeline.segments]}


def _checked(timeline: Timeline, limits: Limits) -> Timeline:
    if timeline.seconds > limits.total_seconds:
        raise MotionloomError(
            f"the timeline takes {timeline.seconds:g} s; at most {limits.total_seconds:g} s are made in one job"
        )
    if any(segment.adapters for segment in timeline.segments):
        raise MotionloomError("a timeline of the server has no 'adapters'; run it with motionloom compose")
    return timeline
