"""The scripts of examples/papers, scaled down, on made folders: each ends with a report."""

import os
import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest

from motionloom.core.models.predictor import save_predictor
from tests_lab.data import test_pairs
from tests_lab.data import test_processed_3dpw as processed
from tests_lab.suites.test_prediction_joints import of_h36m, retargeted

PAPERS = Path(__file__).resolve().parents[4] / "examples" / "papers"
SMALL = "--windows 1 --samples 2 --steps 2 --published-steps 2"


def sh(name: str, *words: Path | str, **settings: str) -> None:
    """Run a script with its settings; its last lines are shown where it fails."""
    line = ["sh", str(PAPERS / name), *map(str, words)]
    done = subprocess.run(
        line,
        env=os.environ | settings | {"PATH": f"{Path(sys.executable).parent}:{os.environ['PATH']}"},
        capture_output=True,
        text=True,
        check=False,
    )
    assert done.returncode == 0, (done.stdout + done.stderr)[-2000:]


@pytest.mark.slow
def test_figures_of_humanmac(tmp_path: Path) -> None:
    weights = save_predictor(of_h36m(), tmp_path / "h36m.safetensors")
    past = 0.3 * np.random.default_rng(1).standard_normal((80, 17, 3))
    np.save(tmp_path / "past.npy", past)
    places = [tmp_path / "past.npy"] * 2
    sh("humanmac_figures.sh", weights, *places, retargeted(tmp_path), tmp_path, SAMPLE="--steps 2", MEASURE=SMALL)
    assert (tmp_path / "figure3" / "overview.png").is_file()
    assert (tmp_path / "figure4.bvh").is_file()
    assert (tmp_path / "figure6" / "report.md").is_file()


@pytest.mark.slow
def test_tables_of_humanmac(tmp_path: Path) -> None:
    clip = np.random.default_rng(0).standard_normal((150, 32, 3)).astype(np.float32)
    table = {subject: {"Walking": clip, "Eating": clip + 1} for subject in ("S1", "S5", "S9")}
    np.savez(tmp_path / "data_3d_h36m.npz", positions_3d=np.array(table, dtype=object))
    small = {
        "TRAIN": "steps=2 batch=4 predictor.width=16 predictor.layers=2 predictor.heads=2 predictor.kept=4",
        "SIZES": "--width 16 --layers 2 --heads 2 --kept 4",
        "STUDY": "--train-steps 2 --windows 1 --samples 2",
        "MEASURE": SMALL,
        "KEPT": "3",
        "DEPTH": "2",
        "SCHEDULES": "sqrt",
        "NOISE": "20",
    }
    sh("humanmac_tables.sh", tmp_path / "data_3d_h36m.npz", tmp_path, **small)
    assert (tmp_path / "table1" / "report.md").is_file()
    for number, name in enumerate(("coefficients", "layers", "schedules", "noising", "", "dct"), start=2):
        assert not name or (tmp_path / f"table{number}" / f"{name}.md").is_file()


@pytest.mark.slow
def test_table_3_of_processed_3dpw(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    people = test_pairs.walkers(seconds=6.0)
    monkeypatch.setattr(processed, "walkers", lambda: people)
    folder = processed.write(processed.write(tmp_path / "3dpw"), "arguing", "validation")
    small = {"TRAIN": "steps=2 batch=2 warmup=1 save_every=2", "DEPTHS": "2", "LAYERS": "2", "MRT": "2"}
    sh("table3.sh", folder, tmp_path / "out", **small, MEASURE="--crops 2 --steps 2 --samples 1")
    assert list((tmp_path / "out" / "table3").rglob("report.md"))
