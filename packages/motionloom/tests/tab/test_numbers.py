"""The prior in TypeScript draws what Python draws (`studio/tests/prior.test.ts` compares)."""

import json
from pathlib import Path

import pytest

from motionloom.core.models.container import weights_digest
from motionloom.core.models.prior import Prior, find_weights
from tests.tab import made, numbers

pytestmark = pytest.mark.slow


def compare(folder: Path) -> None:
    found = made.node(
        "vitest/vitest.mjs", "run", "tests/prior.test.ts", "--reporter=json", MOTIONLOOM_TAB=str(folder), NO_COLOR="1"
    )
    assert found.stdout.lstrip().startswith("{"), found.stdout + found.stderr
    said = json.loads(found.stdout)
    assert said["success"], found.stdout + found.stderr
    assert said["numPassedTests"] >= 7


@pytest.mark.filterwarnings("ignore:The text has more than")
def test_the_page_draws_what_python_draws(prior: Prior, tmp_path: Path):
    """Tokens, noise, denoised states, ten sentences and a chain; weights as they are."""
    made.EXPORT["export"](prior, "0" * 64, tmp_path, precise=True)
    numbers.write(prior, tmp_path, precise=True)
    compare(tmp_path)


@pytest.mark.filterwarnings("ignore:The text has more than")
def test_weights_in_eight_bits_are_read_as_python_rounds_them(prior: Prior, tmp_path: Path):
    """And all of it takes less than 30 MB."""
    made.EXPORT["export"](prior, "0" * 64, tmp_path)
    assert (tmp_path / "prior.bin").stat().st_size < 30e6
    numbers.write(prior, tmp_path, precise=False, weights=made.EXPORT["rounded"](prior))
    compare(tmp_path)


def test_the_manifest_names_the_weights(prior: Prior, tmp_path: Path):
    digest = weights_digest(find_weights("default"))
    made.EXPORT["export"](prior, digest, tmp_path)
    said = json.loads((tmp_path / "prior.json").read_text())
    assert (said["weights"], said["licence"]) == (digest, prior.card.licence)
    assert said["bytes"] == (tmp_path / "prior.bin").stat().st_size


def test_a_folder_without_the_page_is_refused(tmp_path: Path, monkeypatch, capsys):
    monkeypatch.setattr("sys.argv", ["export_tab.py", str(tmp_path)])
    assert made.EXPORT["main"]() == 2
    assert "build it by 'make tab'" in capsys.readouterr().err
    assert not list(tmp_path.iterdir())


def test_the_weights_alone_go_into_a_new_folder(tmp_path: Path, monkeypatch, capsys):
    folder = tmp_path / "a" / "weights"
    monkeypatch.setattr("sys.argv", ["export_tab.py", str(folder), "--alone"])
    assert made.EXPORT["main"]() == 0
    assert {path.name for path in folder.iterdir()} == {"prior.bin", "prior.json"}
    assert made.EXPORT["main"]() == 2
    assert "name a new folder" in capsys.readouterr().err
