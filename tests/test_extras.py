"""Each make target and each extra works with what it installs, and nothing else.

An environment is a folder of links to the installed packages that a list of pins or an extra's requirements name, the
only one that its Python sees beside the standard library and the sources.
"""

import json
import re
import subprocess
import sys
from collections.abc import Iterable
from importlib.metadata import Distribution, PackageNotFoundError, distribution
from pathlib import Path

import pytest
from packaging.requirements import Requirement
from packaging.utils import canonicalize_name

from motionloom.io import save
from tests.robots.models import humanoid
from tests.robots.people import marching

ROOT = Path(__file__).parents[1]
SOURCES = ROOT / "packages" / "motionloom" / "src"
PROGRAM = "import sys; sys.path[:0] = sys.argv[1].split(':'); del sys.argv[1]\n"
COMMAND = f"{PROGRAM}from motionloom.cli import main; sys.exit(main(sys.argv[1:]))"


def pinned(name: str) -> set[str]:
    """Names of the packages that a list of pins installs."""
    return set(re.findall(r"^([a-z0-9_.-]+)==", (ROOT / name).read_text(), re.MULTILINE))


def installed(name: str) -> Distribution:
    try:
        return distribution(name)
    except PackageNotFoundError:
        pytest.skip(f"{name} is not installed")


def closure(requirements: Iterable[str]) -> set[str]:
    """Names of all packages that requirements need here, with what those need."""
    names: set[str] = set()
    left = [(Requirement(text), "") for text in requirements]
    seen = set()
    while left:
        requirement, extra = left.pop()
        name = canonicalize_name(requirement.name)
        if requirement.marker and not requirement.marker.evaluate({"extra": extra}):
            continue
        for wanted in ("", *requirement.extras):
            if (name, wanted) not in seen:
                seen.add((name, wanted))
                left += [(Requirement(text), wanted) for text in installed(name).requires or ()]
        names.add(name)
    return names - {"motionloom"}


def environment(folder: Path, names: Iterable[str]) -> str:
    """A path for Python on which only the packages of these names are, and the sources."""
    for name in {*names, "motionloom"}:  # of the last only what says its version
        found = installed(name)
        for top in {path.parts[0] for path in found.files or () if path.parts[0] != ".."}:
            link = folder / top
            if not link.exists() and top != "__pycache__":
                link.symlink_to(Path(str(found.locate_file(top))))
    return f"{SOURCES}:{folder}"


def start(path: str, *words: str, program: str = COMMAND, cwd: Path) -> subprocess.CompletedProcess[str]:
    """Run a program that finds its modules on a path alone, and no programs beside Python."""
    command = [sys.executable, "-I", "-S", "-c", program, path, *words]
    bare = {"PATH": "", "HOME": str(cwd), "OMP_NUM_THREADS": "1"}
    return subprocess.run(command, cwd=cwd, env=bare, capture_output=True, text=True, timeout=300, check=False)


@pytest.fixture
def walk(tmp_path: Path) -> Path:
    return save(marching(), tmp_path / "walk.npz")


@pytest.mark.parametrize(
    ("lists", "extras"),
    [
        (["constraints-runtime.txt"], "film"),
        (["constraints-runtime.txt", "constraints-studio.txt"], "film,studio"),
        (["constraints.txt", "constraints-robots.txt"], "studio,mmcp,mcp,parquet,film,robots"),
    ],
    ids=["demo", "studio", "dev"],
)
def test_a_target_installs_all_that_its_extras_need(lists: list[str], extras: str) -> None:
    """Lists are installed without a look at what their packages need, so they must be whole."""
    assert not closure([f"motionloom[{extras}]"]) - set().union(*map(pinned, lists))


LIVE = """
import json, subprocess
from websockets.sync.client import connect
boot = "import sys; sys.path[:0] = sys.argv[1].split(':'); del sys.argv[1]; from motionloom.cli import main; main()"
command = [sys.executable, "-I", "-S", "-c", boot, ":".join(sys.path[:2]), "serve", "--port", "0", "--project", "here"]
with subprocess.Popen(command, stderr=subprocess.PIPE, text=True) as server:
    try:
        address = server.stderr.readline().split()[1].replace("http", "ws", 1)
        with connect(address + "live") as socket:
            socket.send(json.dumps({"type": "hello", "seed": 1}))
            print(json.loads(socket.recv(60))["type"])
    finally:
        server.terminate()
"""


@pytest.mark.slow
def test_what_make_studio_installs_steers_a_person(tmp_path: Path) -> None:
    (tmp_path / "site").mkdir()
    path = environment(tmp_path / "site", pinned("constraints-runtime.txt") | pinned("constraints-studio.txt"))
    done = start(path, program=PROGRAM + LIVE, cwd=tmp_path)
    assert done.stdout == "welcome\n", done.stderr


@pytest.mark.slow
def test_what_make_demo_installs_writes_what_make_demo_writes(tmp_path: Path, walk: Path) -> None:
    """A film too, where the machine has no encoder of its own."""
    (tmp_path / "site").mkdir()
    path = environment(tmp_path / "site", pinned("constraints-runtime.txt"))
    for suffix in ("bvh", "glb", "mp4", "png"):
        done = start(path, "export", str(walk), f"walk.{suffix}", cwd=tmp_path)
        assert done.returncode == 0, done.stderr
        assert (tmp_path / f"walk.{suffix}").stat().st_size > 1000


TABLE = """
import pyarrow, pyarrow.parquet
row = {"id": ["walk"], "prompt": ["a person walks"], "seed": [1], "seconds": [2.0]}
pyarrow.parquet.write_table(pyarrow.table(row), "jobs.parquet")
from motionloom.cli import main
sys.exit(main(["batch", "jobs.parquet", "--out", "walks"]))
"""
GREET = '{"jsonrpc":"2.0","id":1,"method":"initialize","params":{"protocolVersion":"2025-06-18","capabilities":{},'
GREET += '"clientInfo":{"name":"test","version":"1"}}}\n'
SPEAK = """
from starlette.applications import Starlette
from motionloom.server.mmcp import routes
print(len(routes.routes()))
routes.application_of
import motionloom.server.mmcp.backbone, motionloom.server.mmcp.drawing
"""


@pytest.mark.slow
def test_the_extra_robots_writes_joint_angles(tmp_path: Path, walk: Path) -> None:
    (tmp_path / "site").mkdir()
    (tmp_path / "tin.xml").write_text(humanoid())
    path = environment(tmp_path / "site", closure(["motionloom[robots]"]))
    done = start(path, "export", str(walk), "walk.csv", "--robot", "tin.xml", cwd=tmp_path)
    assert done.returncode == 0, done.stderr
    assert len((tmp_path / "walk.csv").read_text().splitlines()) > 10


@pytest.mark.slow
@pytest.mark.parametrize("extra", ["mcp", "mmcp"])
def test_the_extras_for_programs_start(extra: str, tmp_path: Path) -> None:
    """An assistant's first message is answered; MMCP's routes are those of the whole protocol."""
    (tmp_path / "site").mkdir()
    path = environment(tmp_path / "site", closure([f"motionloom[{extra}]"]))
    if extra == "mcp":
        command = [sys.executable, "-I", "-S", "-c", COMMAND, path, "mcp", "--project", str(tmp_path / "project")]
        with subprocess.Popen(command, stdin=subprocess.PIPE, stdout=subprocess.PIPE, text=True) as assistant:
            assert assistant.stdin is not None
            assert assistant.stdout is not None
            assistant.stdin.write(GREET)
            assistant.stdin.flush()
            answer = json.loads(assistant.stdout.readline())
            assistant.stdin.close()
        assert answer["result"]["serverInfo"]["name"] == "motionloom"
    else:
        done = start(path, program=PROGRAM + SPEAK, cwd=tmp_path)
        assert done.returncode == 0, done.stderr
        assert int(done.stdout) > 0


@pytest.mark.slow
def test_the_extra_parquet_reads_and_writes_tables(tmp_path: Path) -> None:
    (tmp_path / "site").mkdir()
    done = start(
        environment(tmp_path / "site", closure(["motionloom[parquet]"])), program=PROGRAM + TABLE, cwd=tmp_path
    )
    assert done.returncode == 0, done.stderr
    assert (tmp_path / "walks" / "metadata.parquet").is_file()
