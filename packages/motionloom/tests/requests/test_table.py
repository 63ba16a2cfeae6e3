"""Task by door by option: the best of several, adapters, skeletons with their roots, and what happened, everywhere.

| option | command line | server, assistants | batch | live |
|---|---|---|---|---|
| best of several | every task | every task | every task that samples | no: frames are shown as they come |
| adapters | all but predict, switch | of the whole server, of every job | of the whole job | yes |
| skeleton, root | every task | when a motion is exported | yes | yes |
| what happened | `--json` | every result | measures of every motion | `--json` |

An adapter belongs to the prior; a predictor has none.
"""

import argparse
import inspect
import json
from collections.abc import Sequence
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from motionloom import io
from motionloom.bulk.batch import batch
from motionloom.bulk.metadata import read_batch
from motionloom.cli import main, parser
from motionloom.cli.options import option
from motionloom.core.errors import MotionloomError
from motionloom.core.models.predictor import save_predictor
from motionloom.core.models.prior import save_prior
from motionloom.core.motion import Motion
from motionloom.requests.batch import Batch, RowKeys
from motionloom.requests.export import Export
from motionloom.requests.fields import specs
from motionloom.requests.sampling import PredictionSampling, Sampling
from motionloom.requests.tasks import REQUESTS
from motionloom.tasks.best import candidate_seeds
from motionloom.tasks.control import control
from motionloom.tasks.duet import compose_pair
from motionloom.tasks.edit import edit
from motionloom.tasks.long import compose
from motionloom.tasks.pair import generate_pair, person_seeds
from motionloom.tasks.predict import predict, switch
from motionloom.tasks.text import generate
from tests.bulk.rows import options, write_jobs
from tests.cli.predict.clips import tiny_predictor
from tests.recorded import tiny
from tests.tasks.two_people import CLIP, block

GOAL = {"path": {"points": [[0, 0], [0, 1.5]]}}
TIMELINE = {"segments": [{"text": "a person walks", "seconds": 1.5}, {"text": "a person turns", "seconds": 1.5}]}
LINES: dict[str, tuple[str, ...]] = {
    "generate": ("generate", "a person walks", "--seconds", "1"),
    "generate with numbers": ("generate", "a person turns left 90 degrees", "--seconds", "1.5"),
    "compose": ("compose", "timeline.yaml"),
    "control": ("control", "a person walks", "--goal", "goal.json", "--seconds", "1"),
    "edit": ("edit", str(CLIP), "a person waves", "--strength", "0.5"),
    "predict": ("predict", str(CLIP), "--count", "1", "--seconds", "1", "--no-picture"),
    "switch": ("switch", str(CLIP), str(CLIP)),
    "duet": ("duet", "two people dance", "--seconds", "1"),
    "duet of a timeline": ("duet", "--timeline", "timeline.yaml"),
}
WALK = "a person walks"
OWN_ROOT = "in-place"


@pytest.fixture(scope="module")
def files(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A folder with tiny weights of every kind, a goal and a timeline."""
    folder, prior = tmp_path_factory.mktemp("files"), tiny.prior()
    save_prior(prior, folder / "prior.safetensors", half=False)
    block(prior).save(folder / "block.safetensors", half=False)
    save_predictor(tiny_predictor(), folder / "predictor.safetensors")
    (folder / "goal.json").write_text(json.dumps(GOAL))
    (folder / "timeline.yaml").write_text(json.dumps(TIMELINE))
    return folder


@pytest.mark.parametrize("name", LINES)
def test_every_command_has_them_all(
    name: str, files: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    """What it writes is on the skeleton and stays in its place; what happened is measured of everybody."""
    monkeypatch.chdir(files)
    words, outs = list(LINES[name]), ["out.npz"]
    if words[0] in ("predict", "switch"):
        words += ["--weights", "predictor.safetensors"]
    else:
        words += ["--weights", "prior.safetensors"]
    if words[0] == "duet":
        words, outs = [*words, "--pair-weights", "block.safetensors"], ["a.npz", "b.npz"]
    words += [word for out in outs for word in ("--out", out)]
    words += ["--best-of", "2", "--steps", "2", "--skeleton", "mixamo", "--root", OWN_ROOT, "--json", "--force"]
    assert main(words) == 0
    report = json.loads(capsys.readouterr().out)
    happened = report["happened"] if "happened" in report else report["motions"][0]["happened"]
    people = np.ravel(np.array(happened, dtype=object)).tolist()
    assert len(people) == len(outs)
    assert all("sentence" in one for one in people)
    for out in outs:
        motion = io.load(out)
        hips = motion.positions()[:, motion.skeleton.names.index("mixamorig:Hips")]
        assert np.ptp(hips[:, [0, 2]], axis=0).max() < 1e-6


def test_commands_that_sample_a_prior_take_adapters(files: Path, monkeypatch: pytest.MonkeyPatch, capsys) -> None:
    monkeypatch.chdir(files)
    commands = next(one.choices for one in parser()._actions if isinstance(one, argparse._SubParsersAction))
    having = {name for name, one in commands.items() if "--adapter" in one._option_string_actions}
    assert having >= set(REQUESTS) - {"predict", "switch"} | {"batch", "live", "serve", "studio", "mcp"}
    for name in ("generate", "compose", "control", "edit", "duet"):
        pair = ["--pair-weights", "block.safetensors"] if name == "duet" else []
        line = [*LINES[name], *pair, "--weights", "prior.safetensors", "--adapter", "none.safetensors", "--force"]
        assert main(line) == 2
        assert "no adapter 'none.safetensors'" in capsys.readouterr().err


def test_live_has_what_has_sense_there() -> None:
    commands = next(one.choices for one in parser()._actions if isinstance(one, argparse._SubParsersAction))
    known = set(commands["live"]._option_string_actions)
    assert {"--adapter", "--skeleton", "--root", "--json"} <= known
    assert "--best-of" not in known


@pytest.mark.parametrize("task", REQUESTS)
def test_every_request_has_the_best_of_several(task: str) -> None:
    assert specs(REQUESTS[task])["best_of"].help == specs(Sampling)["best_of"].help
    assert option("best_of", specs(REQUESTS[task])["best_of"]) == "--best-of"


def body_of(task: str, files: Path, project: Any) -> dict[str, Any]:
    clip = project.add([io.load(CLIP)], {}).id
    about: dict[str, dict[str, Any]] = {
        "generate": {"prompt": "a person walks", "seconds": 1.0},
        "compose": {"timeline": TIMELINE},
        "control": {"prompt": "a person walks", "goals": GOAL, "seconds": 1.0},
        "edit": {"motion": clip, "prompt": "a person waves"},
        "predict": {"motion": clip, "count": 1, "seconds": 1.0},
        "switch": {"motion": clip, "target": clip},
        "duet": {"prompt": "two people dance", "seconds": 1.0},
    }
    return {"task": task, "steps": 2, "best_of": 2, **about[task]}


@pytest.mark.parametrize("task", REQUESTS)
def test_the_server_and_assistants_have_them_too(task: str, files: Path, tmp_path: Path) -> None:
    pytest.importorskip("starlette", reason="needs the extra 'studio'")
    from motionloom.server.drawing import Models
    from motionloom.server.files import export
    from motionloom.server.job_request import read_request
    from motionloom.server.jobs import Job
    from motionloom.server.limits import Limits
    from motionloom.server.project import Project
    from motionloom.server.worker import Worker

    limits = Limits()
    project = Project(tmp_path, limits)
    worker = Worker(project, limits)
    request = read_request(body_of(task, files, project), project, limits)
    assert request.sampling.best_of == 2
    job, prior = Job(request, "test", limits.level_bytes_per_job), tiny.prior()
    worker._draw(Models(prior, block(prior), tiny_predictor()), [job])
    assert job.error is None
    for one in job.public()["results"]:
        assert all(did["sentence"] for did in one["happened"])
        motion = io.load(
            export(project, Export(motion=one["id"], format="npz", skeleton="mixamo", person=0, root=OWN_ROOT))
        )
        hips = motion.positions()[:, motion.skeleton.names.index("mixamorig:Hips")]
        assert np.ptp(hips[:, [0, 2]], axis=0).max() < 1e-6


@pytest.mark.parametrize("task", sorted(set(REQUESTS) - {"predict", "switch"}))
def test_a_job_of_the_server_has_adapters_of_its_own(task: str, files: Path, tmp_path: Path) -> None:
    """Those in the project's folder; others have none of it."""
    pytest.importorskip("starlette", reason="needs the extra 'studio'")
    from motionloom.server.drawing import Models, draw
    from motionloom.server.job_request import read_request
    from motionloom.server.limits import Limits
    from motionloom.server.project import Project

    prior, limits, project = tiny.prior(), Limits(), Project(tmp_path, Limits())
    tiny.adapter(prior).save(project.adapters / "zombie.safetensors")
    models, plain = Models(prior, block(prior)), body_of(task, files, project) | {"best_of": 1}
    with pytest.raises(MotionloomError, match=r"'adapter' names 'none\.safetensors', and there is no such file"):
        read_request(plain | {"adapter": ["none.safetensors"]}, project, limits)

    def positions(*adapters: str) -> np.ndarray:
        request = read_request(plain | {"adapter": list(adapters)}, project, limits)
        [result] = draw(models, request, lambda calls, of: None)
        return np.stack([one.positions() for one in result.people])

    before, taught = positions(), positions("zombie.safetensors:0.5")
    assert np.abs(taught - before).max() > 1e-4
    assert np.array_equal(positions(), before)


def test_assistants_can_say_it_and_export_on_skeletons(tmp_path: Path) -> None:
    pytest.importorskip("mcp", reason="needs the extra 'mcp'", exc_type=ImportError)
    from motionloom.server.assistant import Assistant
    from motionloom.server.limits import Limits
    from motionloom.server.project import Project
    from motionloom.server.worker import Worker

    limits = Limits()
    project = Project(tmp_path, limits)
    tools = Assistant(project, Worker(project, limits))
    assert all("best_of" in inspect.signature(tools.tool(task)).parameters for task in REQUESTS)
    assert {"skeleton", "root"} <= set(inspect.signature(tools.export).parameters)


def test_rows_of_a_batch_have_them(files: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """Rows of every task that samples; the skeleton and its root are the job's."""
    assert {"best_of"} <= set(specs(RowKeys)) & set(specs(Batch))
    monkeypatch.chdir(tmp_path)
    io.save(replace(io.load(CLIP).frames(0, 2)), "rest.bvh")
    (tmp_path / "timeline.yaml").write_text(json.dumps(TIMELINE))
    rows = [
        {"prompt": "a person walks", "seconds": 1.0},
        {"prompt": "a person walks", "seconds": 1.0, "goal": GOAL},
        {"timeline": "timeline.yaml"},
        {"task": "duet", "prompt": "two people dance", "seconds": 1.0},
        {"task": "duet", "timeline": "timeline.yaml"},
    ]
    job = write_jobs(tmp_path / "jobs.jsonl", [row | {"best_of": 2} for row in rows])
    how = options(
        str(files / "prior.safetensors"),
        pair_weights=str(files / "block.safetensors"),
        skeleton=str(tmp_path / "rest.bvh"),
        root=OWN_ROOT,
    )
    results = list(batch(job, "out", options=how))
    assert [one.why for one in results if one.state != "made"] == []
    people = [motion for one in read_batch(tmp_path / "out") for motion in one.people]
    assert len(people) == 7
    assert max(np.ptp(motion.positions()[:, 0, [0, 2]], axis=0).max() for motion in people) < 1e-4


# What the best of several is: the second seed of each motion, where that is chosen


def second(*_: Any, **__: Any) -> int:
    return 1


@pytest.fixture
def second_chosen(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr("motionloom.tasks.best.index_of_smallest", second)
    monkeypatch.setattr("motionloom.tasks.completion.index_of_smallest", second)


def the_same(motions: Sequence[Motion], expected: Sequence[Motion]) -> None:
    for one, other in zip(motions, expected, strict=True):
        np.testing.assert_allclose(one.positions(), other.positions(), atol=2e-4)


SEED = next(
    seed for seed in range(100) if candidate_seeds(seed, 2)[1] < 2**62 and candidate_seeds(seed + 1, 2)[1] < 2**62
)


@pytest.mark.usefixtures("second_chosen")
def test_of_words_goals_and_clips_the_seed_that_is_chosen_makes_the_motion() -> None:
    from motionloom.goals.goal_file import read_goal

    prior, other = tiny.prior(), candidate_seeds(SEED, 2)[1]
    goal = read_goal(GOAL, frames=20, folder=Path())
    clip = io.load(CLIP)

    def generated(**how: Any) -> list[Motion]:
        how |= {"steps": 4}
        controlled = control(prior, WALK, goal, **how)[0].motion
        return [*generate(prior, WALK, seconds=1.0, **how), controlled, *edit(prior, clip, "a person waves", **how)]

    the_same(generated(seed=SEED, best_of=2), generated(seed=other))


@pytest.mark.usefixtures("second_chosen")
def test_of_two_people_both_have_the_seeds_that_are_chosen(monkeypatch: pytest.MonkeyPatch) -> None:
    prior = tiny.prior()
    pair, words = block(prior), "two people hug"
    [duet] = generate_pair(prior, pair, words, seconds=1.0, seed=SEED, best_of=2, steps=4)
    chosen = [candidate_seeds(seed, 2)[1] for seed in person_seeds(SEED, 0)]
    monkeypatch.setattr("motionloom.tasks.pair.pair_seeds", lambda sampling: chosen)
    [expected] = generate_pair(prior, pair, words, seconds=1.0, seed=SEED, steps=4)
    the_same(duet, expected)


@pytest.mark.usefixtures("second_chosen")
def test_rows_of_a_chain_are_chosen_one_by_one(monkeypatch: pytest.MonkeyPatch) -> None:
    """And candidates leave nothing behind in the rows, of which those of two people remember much."""
    from motionloom.goals.timeline import plain_timeline

    prior = tiny.prior()
    pair = block(prior)
    segments = plain_timeline(["two people hug", "two people shake hands"], seconds=1.5).segments

    def both(best_of: int) -> list[Motion]:
        one = compose(prior, segments, seed=SEED, steps=4, best_of=best_of)
        return [one, *compose_pair(prior, pair, segments, seed=SEED, steps=4, best_of=best_of)]

    several = both(2)
    monkeypatch.setattr("motionloom.tasks.sampling.candidate_seeds", lambda seed, count: [candidate_seeds(seed, 2)[1]])
    the_same(several, both(1))


@pytest.mark.usefixtures("second_chosen")
def test_of_futures_each_window_is_chosen() -> None:
    predictor, clip = tiny_predictor(), io.load(CLIP)
    how = PredictionSampling(count=2, steps=4, seed=3)
    for task in (predict, lambda *places, **more: switch(*places[:2], clip, **more)):
        plain = task(predictor, clip, seconds=1.0, sampling=how)
        chosen = task(predictor, clip, seconds=1.0, sampling=replace(how, best_of=3))
        assert all(np.abs(a.positions() - b.positions()).max() > 1e-4 for a, b in zip(plain, chosen, strict=True))


def test_a_future_that_moves_comes_before_one_that_stands() -> None:
    from motionloom.tasks.best import index_of_smallest, liveliness_ranks

    moving = io.load(CLIP).positions()
    still = np.repeat(moving[:1], len(moving), axis=0)
    ranks = liveliness_ranks(np.stack([still, moving, moving]))
    assert index_of_smallest(ranks) == 1
