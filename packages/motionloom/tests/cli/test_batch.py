"""batch, as somebody types it, on a tiny prior with random weights."""

import json
import socket
import sys
from pathlib import Path
from types import ModuleType

import numpy as np
import pytest

from motionloom import io
from motionloom.cli import main
from motionloom.core.files.atomic import finished
from motionloom.core.files.bvh_writer import save_bvh
from motionloom.core.models.prior import Prior
from motionloom.io.bvh import read_bvh
from motionloom.tasks.adapting import adapt
from motionloom.tasks.text import generate
from tests.bulk.rows import rows, write_jobs
from tests.cli.said import complaint
from tests.io.motions import largest_distance
from tests.recorded.tiny import adapter
from tests.retarget.test_hands import handed, still


@pytest.fixture(autouse=True)
def folder(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    """Each test runs in an empty folder of its own, with a job of four rows in it."""
    monkeypatch.chdir(tmp_path)
    for name in ("SLURM_ARRAY_TASK_ID", "SLURM_ARRAY_TASK_COUNT"):
        monkeypatch.delenv(name, raising=False)
    write_jobs(tmp_path / "jobs.jsonl", rows(4))
    (tmp_path / "prompts.txt").write_text("a person walks\na person turns\n")
    return tmp_path


def command(weights: str, *words: str) -> int:
    return main(["batch", *words, "--out", "out", "--weights", weights, "--steps", "2", "--workers", "1"])


def test_variants_of_prompts_are_made_once(weights: str, capsys: pytest.CaptureFixture[str]) -> None:
    words = ("--prompts", "prompts.txt", "--variants", "2", "--seconds", "0.5", "--json")
    assert command(weights, *words) == 0
    assert json.loads(capsys.readouterr().out) == {"folder": "out", "tried": 4, "made": 4}
    names = sorted(path.name for path in Path("out").rglob("*.npz"))
    assert len(names) == 4
    assert command(weights, *words) == 0
    assert json.loads(capsys.readouterr().out) == {"folder": "out", "tried": 0, "made": 4}
    assert sorted(path.name for path in Path("out").rglob("*.npz")) == names


def test_hands_and_unit_are_in_the_files(weights: str, capsys: pytest.CaptureFixture[str]) -> None:
    """Files in centimetres hold a hundred times the numbers; a fist closes, and has no fingers to close on smpl22."""
    save_bvh(still(handed()), "hands.bvh")
    words = ("--prompts", "prompts.txt", "--seconds", "0.5", "--format", "bvh", "--skeleton", "hands.bvh")
    motions = {}
    for name, more in (("open", ()), ("fist", ("--hands", "fist", "--out-unit", "cm"))):
        assert (
            main(["batch", *words, *more, "--out", name, "--weights", weights, "--steps", "2", "--workers", "1"]) == 0
        )
        (path, *_) = sorted(Path(name).rglob("*.bvh"))
        motions[name] = read_bvh(path)
    assert (motions["open"].unit, motions["fist"].unit) == (1.0, 0.01)
    tip, wrist = (motions["fist"].motion.skeleton.index(name) for name in ("leftHandMiddle4", "left_wrist"))
    far = {
        k: np.linalg.norm(np.diff(f.motion.positions()[:, [tip, wrist]], axis=1), axis=-1) for k, f in motions.items()
    }
    assert far["fist"].max() < 0.8 * far["open"].min()
    capsys.readouterr()
    assert command(weights, *words[:4], "--hands", "fist") == 1
    assert "no fingers" in capsys.readouterr().err
    assert main(["batch", *words[:4], "--out-unit", "cm", "--out", "other", "--weights", weights]) == 2
    assert "--out-unit is for BVH" in complaint(capsys)


def test_what_was_taught_is_in_the_motions_and_in_their_names(weights: str, capsys: pytest.CaptureFixture[str]) -> None:
    """Motions with an adapter are those of `generate` with it; without it the folder is another batch's."""
    prior = Prior.load(weights)
    for seed, name in ((1, "a"), (2, "b")):
        adapter(prior, seed=seed).save(f"{name}.safetensors")
    words = ("--prompts", "prompts.txt", "--seconds", "0.5", "--seed", "3")
    assert command(weights, *words, "--adapter", "a.safetensors:0.5") == 0
    motions = {path.name: io.load(path) for path in finished(Path("out"), "**/*.npz")}
    (motion,) = generate(
        adapt(prior, [(Path("a.safetensors"), 0.5)]), "a person walks", seconds=0.5, seed=3, steps=2, literal=True
    )
    assert min(largest_distance(motion, one) for one in motions.values()) < 3e-6
    for other in ((), ("--adapter", "b.safetensors:0.5"), ("--adapter", "a.safetensors")):
        assert command(weights, *words, *other) == 2
        assert "other settings" in capsys.readouterr().err
    assert command(weights, *words, "--adapter", "none.safetensors") == 2
    assert "there is no adapter none.safetensors" in capsys.readouterr().err


def test_rows_of_a_shard_can_be_chosen_once(weights: str, capsys: pytest.CaptureFixture[str]) -> None:
    assert command(weights, "jobs.jsonl", "--shard-rows", "3") == 0
    assert sorted(len(list(place.iterdir())) for place in Path("out").glob("shard-*")) == [1, 3]
    capsys.readouterr()
    assert command(weights, "jobs.jsonl", "--shard-rows", "2") == 2
    assert "shards of 3 rows, not 2" in complaint(capsys)


def test_failed_rows_are_reported_and_the_exit_code_says_so(weights: str, capsys: pytest.CaptureFixture[str]) -> None:
    write_jobs(Path("jobs.jsonl"), [*rows(2), {"prompt": "a", "seconds": 99}])
    assert command(weights, "jobs.jsonl", "--filter", "travel < 0") == 1
    output = capsys.readouterr()
    assert output.err == "motionloom: row 2: 'seconds' must be above 0 and at most 60 seconds; got 99\n"
    assert "2 were dropped by the filter, 1 failed" in output.out


def test_a_dry_run_says_how_much_and_writes_nothing(weights: str, capsys: pytest.CaptureFixture[str]) -> None:
    assert command(weights, "jobs.jsonl", "--dry-run", "--json", "--filter", "travel >= 0") == 0
    estimate = json.loads(capsys.readouterr().out)
    assert (estimate["rows"], estimate["sampled"], estimate["usable"], estimate["workers"]) == (4, 4, 1.0, 1)
    assert estimate["hours"] == pytest.approx(4 * estimate["seconds_each"] / 3600)
    assert 3e-6 < estimate["gigabytes"] < 1e-3  # some ten kB each
    assert not Path("out").exists()
    assert command(weights, "jobs.jsonl", "--dry-run", "--shard", "0/4") == 0
    assert capsys.readouterr().out.startswith("4 motions: ")


@pytest.mark.parametrize(
    "words",
    [
        [],
        ["jobs.jsonl", "--prompts", "prompts.txt"],
        ["absent.jsonl"],
        ["prompts.txt"],
        ["--prompts", "absent.txt"],
        ["--prompts", "jobs.jsonl"],
        ["jobs.jsonl", "--variants", "2"],
        ["--prompts", "prompts.txt", "--variants", "0"],
        ["jobs.jsonl", "--filter", "speedy < 2"],
        ["jobs.jsonl", "--filter", "open('x')"],
        ["jobs.jsonl", "--shard", "2/2"],
        ["jobs.jsonl", "--shard-rows", "0"],
        ["jobs.jsonl", "--pair-guidance", "2"],
        ["jobs.jsonl", "--pair-weights", "absent"],
        ["jobs.jsonl", "--shard", "x"],
        ["jobs.jsonl", "--shard", "0/2", "--ray"],
        ["jobs.jsonl", "--workers", "0"],
        ["jobs.jsonl", "--seed", "-1"],
        ["jobs.jsonl", "--fps", "0"],
        ["jobs.jsonl", "--skeleton", "absent.bvh"],
        ["jobs.jsonl", "--weights", "absent"],
    ],
    ids=lambda words: " ".join(words) or "nothing",
)
def test_mistakes_are_one_sentence_and_nothing_is_written(
    weights: str, words: list[str], capsys: pytest.CaptureFixture[str]
) -> None:
    line = ["batch", "--out", "out", *([] if "--weights" in words else ["--weights", weights]), *words]
    assert main(line) == 2
    complaint(capsys)
    assert not Path("out").exists()


def test_a_column_that_is_none_is_reported_before_the_work(weights: str, capsys: pytest.CaptureFixture[str]) -> None:
    write_jobs(Path("jobs.jsonl"), [{"prompt": "a", "sead": 3}])
    assert command(weights, "jobs.jsonl") == 2
    line = complaint(capsys)
    assert "the row has no 'sead' (did you mean 'seed'?); it has robot, " in line
    assert " task, prompt, seconds, seed, " in line
    assert not Path("out").exists()


def test_parquet_without_pyarrow_says_what_to_install(
    weights: str, capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setitem(sys.modules, "pyarrow.parquet", None)
    assert command(weights, "jobs.jsonl", "--format", "parquet") == 2
    assert "pip install 'motionloom[parquet]'" in complaint(capsys)


def test_ray_that_is_not_installed_says_what_to_install(
    weights: str, capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setitem(sys.modules, "ray", None)
    assert command(weights, "jobs.jsonl", "--ray") == 2
    assert "pip install 'motionloom[ray]'" in complaint(capsys)


@pytest.mark.parametrize("address", ["127.0.0.1:{port}", "ray://127.0.0.1:{port}", "127.0.0.1:99999999"])
def test_a_ray_cluster_that_is_not_there_is_missed_at_once(
    weights: str, address: str, capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setitem(sys.modules, "ray", ModuleType("ray"))
    with socket.create_server(("127.0.0.1", 0)) as free:
        port = free.getsockname()[1]
    assert command(weights, "jobs.jsonl", "--ray", address.format(port=port)) == 2
    assert "there is no Ray cluster at" in complaint(capsys)
