"""What is handed on is whole: the source distribution, the studio's page in it, and who is named."""

import json
import os
import runpy
import shutil
import subprocess
import sys
import tarfile
import tomllib
import zipfile
from importlib.metadata import entry_points
from pathlib import Path

import pytest

from motionloom.cli.commands import FAMILIES, GROUP, OTHERS
from motionloom.core.reading import read_table

ROOT = Path(__file__).parents[1]
BUILD = runpy.run_path(str(ROOT / "setup.py"), run_name="setup")
build_page = BUILD["build_page"]
PACKAGES = {"motionloom": ROOT, **{name: ROOT / "packages" / name for name in ("motionloom-train", "motionloom-lab")}}
"""Each package, and the folder of its pyproject.toml."""
NOT_HANDED_ON = {".ci", ".gitignore"}


def tracked() -> list[str]:
    done = subprocess.run(["git", "ls-files"], cwd=ROOT, capture_output=True, text=True, check=False)
    if done.returncode or not done.stdout:
        pytest.skip("not a git checkout")
    return done.stdout.splitlines()


def test_the_manifest_names_every_tracked_file() -> None:
    """A new folder at the top is in the source distribution too, or left out on purpose."""
    words = (ROOT / "MANIFEST.in").read_text().split()
    always = {"pyproject.toml", "README.md", "setup.py", "MANIFEST.in"}
    tops = {name.split("/")[0] for name in tracked()} - NOT_HANDED_ON - always
    assert not {top for top in tops if top not in words and not top.startswith("constraints")}


@pytest.mark.parametrize("name", ["motionloom", "motionloom-train", "motionloom-lab"])
def test_a_wheel_has_every_file_of_the_package(name: str) -> None:
    """Weights, schemas and tables lie beside the code; each is of a kind that goes with it."""
    module = name.replace("-", "_")
    package = ROOT / "packages" / name / "src" / module
    written = tomllib.loads((PACKAGES[name] / "pyproject.toml").read_text())
    patterns = written["tool"]["setuptools"]["package-data"][module]
    named = {path for pattern in patterns for path in package.glob(pattern)}
    there = {ROOT / file for file in tracked() if (ROOT / file).is_relative_to(package) and not file.endswith(".py")}
    assert not there - named


def test_metadata_says_who_and_for_what() -> None:
    project = tomllib.loads((ROOT / "pyproject.toml").read_text())["project"]
    assert project["authors"] == [{"name": "motionloom contributors"}]
    assert any(line.startswith("Programming Language :: Python :: 3.11") for line in project["classifiers"])


def test_without_node_the_build_says_why_the_page_is_missing(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    page = tmp_path / "page" / "index.html"
    assert build_page(tmp_path, [page]) == "its sources are not here"
    (tmp_path / "package.json").write_text("{}")
    monkeypatch.setenv("PATH", str(tmp_path))
    assert build_page(tmp_path, [page]) == "npm was not found"


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
    pages = [tmp_path / "index.html", tmp_path / "viewer.html"]
    pages[0].write_text("built")
    assert build_page(tmp_path, pages) == why
    assert (tmp_path / "calls").read_text().split() == (["ci"] if fails == "ci" else ["ci", "run"])
    pages[1].write_text("built")
    monkeypatch.setenv("PATH", "")
    assert build_page(tmp_path, pages) is None


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
    names = ("test_skeleton.py", "io/test_bvh.py", "io/test_gltf.py", "goals/test_timeline.py", "goals/test_paths.py")
    some = [f"packages/motionloom/tests/{name}" for name in names]
    done = subprocess.run(
        [sys.executable, "-m", "pytest", "-q", "-p", "no:cacheprovider", "-n", "0", *some],
        cwd=place,
        env={**os.environ, "PYTHONPATH": str(place / "packages" / "motionloom" / "src"), "OMP_NUM_THREADS": "1"},
        capture_output=True,
        text=True,
        timeout=600,
        check=False,
    )
    assert done.returncode == 0, done.stdout[-3000:]


def project(name: str) -> dict:
    return tomllib.loads((PACKAGES[name] / "pyproject.toml").read_text())["project"]


def test_the_packages_have_one_version_and_one_licence() -> None:
    """They need each other as they were released together."""
    version = project("motionloom")["version"]
    for name, needs in (("motionloom-train", {"motionloom"}), ("motionloom-lab", {"motionloom", "motionloom-train"})):
        assert project(name)["version"] == version
        ours = {one for one in project(name)["dependencies"] if one.startswith("motionloom")}
        assert ours == {f"{other}=={version}" for other in needs}
        for file in ("LICENSE", "NOTICE"):
            assert (PACKAGES[name] / file).read_bytes() == (ROOT / file).read_bytes()


def test_packages_register_the_commands_that_help_names() -> None:
    """The table of the command line and the entry points of the packages say the same."""
    written = {}
    for name in ("motionloom-train", "motionloom-lab"):
        written |= project(name)["entry-points"][GROUP]
    assert written == {name: f"{other.module}:add" for name, other in OTHERS.items()}
    installed = {point.name: point.value for point in entry_points(group=GROUP)}
    assert not installed or installed.items() >= written.items()


def build(name: str, folder: Path) -> Path:
    """A wheel of a package in ``folder``, built of a copy: building in the checkout would leave a build/ there."""
    tree = folder / f"tree-{name}"
    source = f"packages/{name}/src"
    ignore = shutil.ignore_patterns("__pycache__", "*.egg-info")
    shutil.copytree(ROOT / source, tree / ("packages/motionloom/src" if name == "motionloom" else "src"), ignore=ignore)
    for file in ("pyproject.toml", "setup.py", "MANIFEST.in", "README.md", "LICENSE", "NOTICE"):
        if (PACKAGES[name] / file).is_file():
            shutil.copy(PACKAGES[name] / file, tree)
    if name == "motionloom":
        shutil.copytree(ROOT / "LICENSES", tree / "LICENSES")
    words = ["-m", "pip", "wheel", "-q", "--no-deps", "--no-build-isolation", "-w", str(folder), str(tree)]
    done = subprocess.run([sys.executable, *words], capture_output=True, text=True, check=False)
    assert done.returncode == 0, done.stderr
    return next(folder.glob(f"{name.replace('-', '_')}-[0-9]*.whl"))


@pytest.fixture(scope="module")
def wheels(tmp_path_factory: pytest.TempPathFactory) -> dict[str, Path]:
    folder = tmp_path_factory.mktemp("wheels")
    return {name: build(name, folder) for name in PACKAGES}


@pytest.mark.slow
@pytest.mark.parametrize("name", PACKAGES)
def test_a_wheel_carries_every_file_of_its_package(name: str, wheels: dict[str, Path]) -> None:
    """The code, the weights and other data, the type marker and the licences."""
    source = ROOT / "packages" / name / "src"
    files = {path.relative_to(source).as_posix() for path in source.rglob("*") if path.is_file()}
    kept = {file for file in files if "__pycache__" not in file and ".egg-info/" not in file}
    with zipfile.ZipFile(wheels[name]) as wheel:
        names = set(wheel.namelist())
    assert not kept - names
    texts = {"LICENSE", "NOTICE"} | ({"Apache-2.0.txt"} if name == "motionloom" else set())
    assert {one.rsplit("/", 1)[-1] for one in names if "dist-info" in one} >= texts


def use(folder: Path, *words: str, without: str = "") -> subprocess.CompletedProcess[str]:
    """A command of the packages that are installed in ``folder``, of no others, and without a module."""
    code = (
        "import sys\n"
        f"sys.path[:0] = [{str(folder)!r}]\n"
        f"sys.modules.update(dict.fromkeys({without.split()!r}))\n"
        "import motionloom\n"
        f"assert motionloom.__file__.startswith({str(folder)!r}), motionloom.__file__\n"
        "from motionloom.cli import main\n"
        "sys.exit(main(sys.argv[1:]))\n"
    )
    environment = {name: value for name, value in os.environ.items() if name != "PYTHONPATH"}
    command = [sys.executable, "-P", "-c", code, *words]
    return subprocess.run(command, cwd=folder, env=environment, capture_output=True, text=True, check=False)


def install(folder: Path, *wheels: Path) -> Path:
    for wheel in wheels:
        with zipfile.ZipFile(wheel) as archive:
            archive.extractall(folder)
    return folder


@pytest.mark.slow
def test_the_product_alone_makes_motion_and_names_what_is_missing(wheels: dict[str, Path], tmp_path: Path) -> None:
    folder = install(tmp_path / "site", wheels["motionloom"])
    others = "torch motionloom_train motionloom_lab"
    done = use(folder, "generate", "a person walks", "--seconds", "1", "--steps", "2", "--out", "a.bvh", without=others)
    assert done.returncode == 0, done.stderr
    assert (folder / "a.bvh").stat().st_size
    assert "teach" in use(folder, "--help", without=others).stdout
    for command, package in (("teach", "motionloom-train"), ("evaluate", "motionloom-lab")):
        helped = use(folder, command, "--help", without=others)
        assert helped.returncode == 0
        assert package in helped.stdout
        refused = use(folder, command, "a person walks", "walk.bvh", without=others)
        assert refused.returncode == 2
        assert f"pip install 'packages/{package}'" in refused.stderr
        assert refused.stderr.count("\n") == 1


@pytest.mark.slow
def test_the_three_wheels_work_together(wheels: dict[str, Path], tmp_path: Path) -> None:
    folder = install(tmp_path / "site", *wheels.values())
    for command in OTHERS:
        done = use(folder, command, "--help")
        assert done.returncode == 0, done.stderr
        assert done.stdout.startswith(f"usage: motionloom {command}")
    shutil.copy(ROOT / "examples" / "clips" / "walk.bvh", folder)
    done = use(folder, "teach", "a person walks", "walk.bvh", "--check")
    assert "walk.bvh" in done.stdout + done.stderr
    assert "Traceback" not in done.stderr


def test_a_built_page_carries_the_notices_of_what_is_in_it() -> None:
    page = ROOT / "packages" / "motionloom" / "src" / "motionloom" / "server" / "page"
    if not (page / "index.html").is_file():
        pytest.skip("the studio's page is not built here (make page)")
    notices = (page / "third-party-notices.txt").read_text()
    assert "three.js authors" in notices
    assert "Permission is hereby granted" in notices
    viewer = page.parents[1] / "viz" / "viewer.html"
    assert "three.js authors" in viewer.read_text(), "make page"


WEIGHTS = ROOT / "packages" / "motionloom" / "src" / "motionloom" / "weights"
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


@pytest.mark.parametrize("family", FAMILIES)
def test_families_name_the_commands_of_their_tables(family: str) -> None:
    """So that only the table is read that has the command of the line."""
    assert list(read_table("motionloom.cli", f"{family}.toml")) == list(FAMILIES[family])


@pytest.mark.parametrize("name", PACKAGES)
def test_tables_are_in_the_wheels(name: str) -> None:
    """Every file of data beside the modules is one that setuptools is asked to take along."""
    asked = tomllib.loads((PACKAGES[name] / "pyproject.toml").read_text())["tool"]["setuptools"]["package-data"]
    [(package, patterns)] = asked.items()
    source = ROOT / "packages" / name / "src" / package
    taken = {path for pattern in patterns for path in source.glob(pattern)}
    data = {path for kind in ("toml", "yaml", "json") for path in source.rglob(f"*.{kind}")}
    assert not {str(path.relative_to(source)) for path in data - taken if "page" not in path.parts}
