"""What is handed on is whole: the source distribution, the studio's page in it, and who is named."""

import json
import os
import runpy
import shutil
import subprocess
import sys
import tarfile
import tomllib
from pathlib import Path

import pytest

ROOT = Path(__file__).parents[1]
BUILD = runpy.run_path(str(ROOT / "setup.py"), run_name="setup")
build_page = BUILD["build_page"]
NOT_HANDED_ON = {".ci", ".gitignore"}


def tracked() -> list[str]:
    done = subprocess.run(["git", "ls-files"], cwd=ROOT, capture_output=True, text=True, check=False)
    if done.returncode or not done.stdout:
        pytest.skip("not a git checkout")
    return done.stdout.splitlines()


def test_the_manifest_names_every_tracked_file() -> None:
    """A new folder at the top is in the source distribution too, or left out on purpose."""
    words = (ROOT / "MANIFEST.in").read_text().split()
    always = {"pyproject.toml", "README.md", "setup.py", "MANIFEST.in", "src"}
    tops = {name.split("/")[0] for name in tracked()} - NOT_HANDED_ON - always
    assert not {top for top in tops if top not in words and not top.startswith("constraints")}


def test_a_wheel_has_every_file_of_the_package() -> None:
    """Weights, schemas and tables lie beside the code; each is of a kind that goes with it."""
    package = ROOT / "src" / "motionloom"
    patterns = tomllib.loads((ROOT / "pyproject.toml").read_text())["tool"]["setuptools"]["package-data"]["motionloom"]
    named = {path for pattern in patterns for path in package.glob(pattern)}
    there = {ROOT / name for name in tracked() if name.startswith("src/motionloom/") and not name.endswith(".py")}
    assert not there - named


def test_metadata_says_who_and_for_what() -> None:
    project = tomllib.loads((ROOT / "pyproject.toml").read_text())["project"]
    assert project["authors"] == [{"name": "motionloom contributors"}]
    assert any(line.startswith("Programming Language :: Python :: 3.11") for line in project["classifiers"])


def test_without_node_the_build_says_why_the_page_is_missing(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    page = tmp_path / "page" / "index.html"
    assert build_page(tmp_path, page) == "its sources are not here"
    (tmp_path / "package.json").write_text("{}")
    monkeypatch.setenv("PATH", str(tmp_path))
    assert build_page(tmp_path, page) == "npm was not found"


@pytest.mark.skipif(os.name == "nt", reason="the stand-in for npm is a shell script")
@pytest.mark.parametrize(("fails", "why"), [("", None), ("ci", "'npm ci' failed"), ("run", "'npm run' failed")])
def test_with_node_the_build_makes_the_page(
    fails: str, why: str | None, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    npm = tmp_path / "npm"
    npm.write_text(f'#!/bin/sh\necho "$1" >> calls\ntest "$1" != "{fails}"\n')
    npm.chmod(0o755)
    (tmp_path / "package.json").write_text("{}")
    monkeypatch.setenv("PATH", str(tmp_path))
    page = tmp_path / "index.html"
    assert build_page(tmp_path, page) == why
    assert (tmp_path / "calls").read_text().split() == (["ci"] if fails == "ci" else ["ci", "run"])
    page.write_text("built")
    monkeypatch.setenv("PATH", "")
    assert build_page(tmp_path, page) is None


@pytest.mark.slow
def test_tests_run_out_of_a_source_distribution(tmp_path: Path) -> None:
    """It is built from what git tracks, and its tests find their helpers, their clips and the package."""
    tree = tmp_path / "tree"
    for name in tracked():
        if not name.endswith(".safetensors"):
            (tree / name).parent.mkdir(parents=True, exist_ok=True)
            shutil.copy(ROOT / name, tree / name)
    code = "from setuptools import build_meta; build_meta.build_sdist('dist')"
    subprocess.run([sys.executable, "-c", code], cwd=tree, check=True, capture_output=True, timeout=300)
    with tarfile.open(next((tree / "dist").glob("*.tar.gz"))) as archive:
        archive.extractall(tmp_path, filter="data")
    place = next(tmp_path.glob("motionloom-*"))
    some = ["tests/test_skeleton.py", "tests/io/test_bvh.py", "tests/io/test_gltf.py", "tests/goals"]
    done = subprocess.run(
        [sys.executable, "-m", "pytest", "-q", "-p", "no:cacheprovider", "-n", "0", *some],
        cwd=place,
        env={**os.environ, "PYTHONPATH": str(place / "src"), "OMP_NUM_THREADS": "1"},
        capture_output=True,
        text=True,
        timeout=600,
        check=False,
    )
    assert done.returncode == 0, done.stdout[-3000:]


def test_a_built_page_carries_the_notices_of_what_is_in_it() -> None:
    page = ROOT / "src" / "motionloom" / "server" / "page"
    if not (page / "index.html").is_file():
        pytest.skip("the studio's page is not built here (make page)")
    notices = (page / "third-party-notices.txt").read_text()
    assert "three.js authors" in notices
    assert "Permission is hereby granted" in notices


WEIGHTS = ROOT / "src" / "motionloom" / "weights"
CARDS = {"any": "control", "trajectory": "control", "duet": "pair"}
SOURCES = [
    "CMU",
    "ACCAD",
    "UI-PRMD",
    "AnimatedDrawings",
    "Mesh2Motion",
    "Quaternius",
    "KayKit",
    "Prisbrey",
    "HumanML3D",
    "Bandai",
    "G1 Moves",
    "holosoma",
    "AMASS",
]
"""Names of sources as licences of weights write them; one that is missing here is no less to be named."""


@pytest.mark.parametrize("file", sorted(WEIGHTS.rglob("*.safetensors")), ids=lambda path: path.stem)
def test_every_source_of_a_weight_file_is_named_in_its_card_and_in_the_notice(file: Path) -> None:
    """Whoever trains on a further source names it in both before the file can land."""
    with file.open("rb") as stream:
        header = json.loads(stream.read(int.from_bytes(stream.read(8), "little")))
    [about] = [json.loads(value) for key, value in header["__metadata__"].items() if key.startswith("motionloom")]
    card = about.get("card", about)
    said = f"{card['licence']} {card['data']}".lower()
    named = [source for source in SOURCES if source.lower() in said]
    assert named
    for page in (ROOT / "NOTICE", WEIGHTS / f"{CARDS.get(file.stem, file.stem)}.md"):
        text = page.read_text().lower()
        assert not [source for source in named if source.lower() not in text], f"{page.name} does not name them"
