"""Readers of what programs are told and keep: rows of jobs, folders of batches, projects, requests, live messages."""

import contextlib
import json
import os
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any

from motionloom import io
from motionloom.core.errors import MotionloomError
from motionloom.core.files.text import parse_json
from tests.fuzz.reader import reader
from tests.fuzz.readers_of_motions import motion

# Batches -------------------------------------------------------------------------------------------------------------

ROWS: list[dict[str, Any]] = [
    {"prompt": "a person walks", "seconds": 1.5, "seed": 7},
    {"prompt": "x", "goal": {"path": {"points": [[0, 0], [1, 2]], "times": [0, 2]}}},
    {"task": "duet", "prompt": "a walks :: b waits", "person": 2, "goal": {"path": {"points": [[0, 0], [1, 1]]}}},
    {"timeline": "t.yaml", "seed": 3, "id": "d-3"},
    {"prompt": "a", "skeleton": "s.bvh"},
]
TABLE = 'prompt,seconds,seed,id\n"a person walks, then sits",1.5,7,one\nsomeone waves,2,,two\n'


def job(folder: Path) -> None:
    (folder / "a.jsonl").write_text("".join(json.dumps(row) + "\n" for row in ROWS))
    (folder / "a.csv").write_text(TABLE)
    (folder / "a.txt").write_text("a person walks\nsomeone waves\n")
    (folder / "t.yaml").write_text(
        "segments: [{text: a person walks, seconds: 1}, {text: a person sits, seconds: 1}]\n"
    )
    io.save(motion(), folder / "s.bvh")


def read_job(name: str) -> Callable[[Path], None]:
    """All rows and what they name; the first that is refused is what is answered."""

    def read(folder: Path) -> None:
        from motionloom.bulk.jobs import Jobs
        from motionloom.bulk.row import Sources, parse

        sources, problems = Sources(folder, {}), []
        source = Jobs.of_prompts(folder / name, variants=2) if name.endswith(".txt") else Jobs.of(folder / name)
        for raw in source.read():
            try:
                sources.ask(parse(raw))
            except MotionloomError as error:
                problems.append(error)
        for problem in problems:
            raise problem if type(problem) is MotionloomError else RuntimeError(str(problem))  # the program's own fault

    return read


def batch(kind: str) -> Callable[[Path], None]:
    """The folder of three rows, one shard of two and one of one."""

    def make(folder: Path) -> None:
        from motionloom.bulk.batch import Where, batch
        from motionloom.bulk.maker import Options
        from motionloom.core.models.prior import save_prior
        from tests.recorded import tiny

        weights = save_prior(tiny.prior(), folder / "tiny.safetensors")
        rows = [{"prompt": "a person walks", "seconds": 0.6, "seed": seed} for seed in range(3)]
        options = Options(weights=str(weights), steps=2, format=kind, shard_rows=2)
        list(batch(rows, folder / "out", options=options, where=Where(workers=1)))

    return make


def read_batch(folder: Path) -> list[object]:
    from motionloom.bulk.metadata import read_batch

    return list(read_batch(folder / "out"))


RECORDS = {"out/manifest.json": "json", "out/records/000000.jsonl": "jsonl"}
reader("rows of a job", job, {"a.jsonl": "jsonl", "t.yaml": "text", "s.bvh": "text"}, read_job("a.jsonl"))
reader("table of a job", job, {"a.csv": "text"}, read_job("a.csv"))
reader("prompts of a job", job, {"a.txt": "text"}, read_job("a.txt"), weight=3)
reader("batch", batch("npz"), RECORDS, read_batch, weight=10)
reader("batch of tars", batch("webdataset"), RECORDS | {"out/shard-000000.tar": "raw"}, read_batch, weight=6)


# Servers -------------------------------------------------------------------------------------------------------------

NAME = "0123456789abcdef"
REQUEST = {"task": "generate", "prompt": "a person walks", "seconds": 2.0, "seed": 3, "count": 2, "guidance": 2.5}
CONTROL = {
    "task": "control",
    "prompt": "a person walks",
    "seconds": 2.0,
    "goals": {"path": {"points": [[0, 0], [1, 2]]}},
}
TIMELINE = {
    "task": "compose",
    "seed": 1,
    "timeline": {
        "segments": [{"text": "a person walks", "seconds": 2}, {"text": "sit", "transition": 0.5}],
        "path": {"path": {"points": [[0, 0], [1, 2]]}},
    },
}
EDIT = {"task": "edit", "motion": NAME, "prompt": "a person waves", "keep": ["lower_body"], "between": [[0, 0.1]]}
MESSAGES: list[dict[str, Any]] = [
    {
        "type": "hello",
        "seed": 3,
        "fps": 30,
        "people": 2,
        "session": "",
        "skeleton": {"names": ["a", "b"], "parents": [-1, 0], "offsets": [[0, 1, 0], [0, 0.5, 0]]},
    },
    {"type": "say", "text": "a person walks", "person": 1},
    {"type": "steer", "direction": 90, "speed": 1.4, "facing": -10},
    {"type": "path", "points": [[2, 3], [4, 0]], "speed": 1},
    {"type": "reach", "joint": "left_wrist", "position": [0, 1, 2], "within": 0.5},
    {"type": "ping", "id": "a"},
]


def project(folder: Path) -> None:
    from motionloom.core.files.npz_writer import save_npz

    (folder / "motions").mkdir()
    (folder / "characters").mkdir()
    save_npz(motion(), folder / "motions" / f"{NAME}.npz")
    about = {"task": "generate", "people": 1, "prompt": "a person walks", "seed": 3, "seconds": 0.15}
    (folder / "motions" / f"{NAME}.json").write_text(json.dumps(about))
    (folder / "characters" / f"{NAME}.json").write_text(json.dumps({"name": "hero.glb", "suffix": ".glb"}))
    (folder / "characters" / f"{NAME}.glb").write_bytes(b"glTF")
    (folder / "project.json").write_text(json.dumps({"version": 1, "takes": [NAME], "name": "mine"}))
    for name, request in (("request", REQUEST), ("control", CONTROL), ("timeline", TIMELINE), ("edit", EDIT)):
        (folder / f"{name}.json").write_text(json.dumps(request))
    (folder / "timeline.yaml").write_text("seed: 3\nsegments:\n- {text: a person walks, seconds: 2}\n- sit\n")


@contextlib.contextmanager
def opened(folder: Path) -> Iterator[Any]:
    """The project; what the server refuses is one sentence too."""
    from motionloom.server.project import Limits, Project
    from motionloom.server.refusal import Refusal

    found = Project(folder, Limits())
    try:
        yield found
    except Refusal as refusal:
        raise MotionloomError(refusal.sentence) from None
    finally:
        if found._owned is not None:
            os.close(found._owned)  # else every file of a run would keep one open


def read_project(folder: Path) -> None:
    with opened(folder) as found:
        found.read_project()
        found.character(NAME)
        json.dumps(found.motion(NAME).about)


def read_request(name: str) -> Callable[[Path], None]:
    def read(folder: Path) -> None:
        from motionloom.server.job_request import read_request
        from motionloom.server.project import Limits

        body = parse_json((folder / name).read_bytes(), "the request")
        with opened(folder) as found:
            read_request(body, found, Limits())

    return read


def read_timeline_text(folder: Path) -> None:
    from motionloom.server.project import Limits
    from motionloom.server.timelines import timeline_json

    with opened(folder) as found:
        timeline_json((folder / "timeline.yaml").read_bytes().decode("utf-8", "replace"), found, Limits())


def messages(folder: Path) -> None:
    (folder / "a.jsonl").write_text("".join(json.dumps(one) + "\n" for one in MESSAGES))


def read_messages(folder: Path) -> None:
    """Each line as a message; the first that is refused is what is answered."""
    from motionloom.live import messages
    from motionloom.live.commands import from_json, person_of

    problems = []
    for line in (folder / "a.jsonl").read_bytes().split(b"\n")[:100]:  # who says more that is wrong is sent away
        try:
            said = messages.read(line)
            if said["type"] == "hello":
                json.dumps(messages.welcome(messages.hello(said), "key", 0))
            elif said["type"] not in ("ping", "bye", "record"):
                from_json(said)
                person_of(said)
        except MotionloomError as error:
            problems.append(error)
    if len(problems) > 1:  # the last line is empty
        raise problems[0]


PROJECT = {
    "project.json": "json",
    f"motions/{NAME}.json": "json",
    f"characters/{NAME}.json": "json",
    f"motions/{NAME}.npz": "npz",
}
reader("project", project, PROJECT, read_project, weight=10)
reader("request", project, {"request.json": "json"}, read_request("request.json"), weight=10)
reader("request of a goal", project, {"control.json": "json"}, read_request("control.json"), weight=10)
reader("request of a timeline", project, {"timeline.json": "json"}, read_request("timeline.json"), weight=10)
reader("request of an edit", project, {"edit.json": "json"}, read_request("edit.json"), weight=6)
reader("timeline of a page", project, {"timeline.yaml": "text"}, read_timeline_text, weight=6)
reader("live messages", messages, {"a.jsonl": "jsonl"}, read_messages)
