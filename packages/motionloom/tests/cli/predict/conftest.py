"""What the tests of predict and switch share: the files they run beside, and quick makers in the network's place."""

from dataclasses import replace
from pathlib import Path

import pytest

from motionloom.core.files.bvh_writer import save_bvh
from motionloom.core.models.predictor import save_predictor
from motionloom.core.motion import Motion
from motionloom.io import stream
from motionloom.tasks import predict as task
from tests.cli.predict.clips import future, larger, tiny_predictor
from tests.tasks.test_edit import person


@pytest.fixture(scope="module")
def weights(tmp_path_factory: pytest.TempPathFactory) -> str:
    return str(save_predictor(tiny_predictor(), tmp_path_factory.mktemp("weights") / "tiny.safetensors"))


@pytest.fixture(autouse=True)
def folder(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    """Each test runs beside two clips in centimetres with angles in another order, one of which is on another body."""
    monkeypatch.chdir(tmp_path)
    save_bvh(person(1.0, 30.0), "past.bvh", order="XYZ", unit=0.01)
    save_bvh(person(1.5, 30.0), "kick.bvh", order="XYZ", unit=0.01)
    other = person(1.0, 30.0)
    save_bvh(Motion(larger(), 30.0, other.root, other.rotations), "other.bvh")
    return tmp_path


@pytest.fixture
def call(monkeypatch: pytest.MonkeyPatch) -> dict:
    """What the commands asked of the tasks, which make simple motions and stop where they are told."""
    record: dict = {"stop": None, "problem": KeyboardInterrupt}

    def predict(predictor, past, *, sampling, seconds, hold, root, foot_lock, progress):
        record.update(past=past, count=sampling.count, seconds=seconds, seed=sampling.seed, hold=hold, root=root)
        walk = {"steps": sampling.steps, "temperature": sampling.temperature}
        record.update(foot_lock=foot_lock, walk=walk, guidance=sampling.guidance)
        progress(1, 1)
        return [stream.joined([past, future(past, seconds, i)]) for i in sampling.numbers()]

    def predict_pieces(
        predictor, past, *, seconds, number, count, seed, hold, guidance, best_of, root, foot_lock, **walk
    ):
        record.update(past=past, seconds=seconds, seed=seed, hold=hold, root=root, foot_lock=foot_lock, walk=walk)
        if (number, -1) == record["stop"]:
            raise record["problem"]
        yield past
        whole = future(past, seconds, number)
        for piece, at in enumerate(range(0, len(whole), 300)):
            if (number, piece) == record["stop"]:
                raise record["problem"]
            yield whole.frames(at, at + 300)

    def switch(predictor, past, target, *, sampling, seconds, facing, foot_lock):
        record.update(past=past, target=target, count=sampling.count, seconds=seconds, facing=facing)
        record["walk"] = {"temperature": sampling.temperature}
        still = [replace(one, translations=None) for one in (past, target)]
        return [stream.joined([still[0], future(past, seconds, i), still[1]]) for i in sampling.numbers()]

    for task_function in (predict, predict_pieces, switch):
        monkeypatch.setattr(task, task_function.__name__, task_function)
    monkeypatch.setattr("motionloom.cli.predict.predict_pieces", predict_pieces)  # opened at its top
    return record


@pytest.fixture
def overlays(monkeypatch: pytest.MonkeyPatch) -> list:
    """What was drawn over each other, instead of the slow drawing."""
    from motionloom.viz import overlay

    record: list = []

    def draw_futures(past, futures, path, *, caption, lead):
        record.append((past, futures, path.name, caption))
        path.write_bytes(b"drawn")
        return path

    monkeypatch.setattr(overlay, "draw_futures", draw_futures)
    return record
