"""What commands import, which is most of what their start costs; no clocks."""

import subprocess
import sys
from pathlib import Path

import pytest

CLIP = Path(__file__).parents[1] / "examples" / "clips" / "walk.bvh"
HEAVY = {
    "torch",
    "scipy",
    "matplotlib",
    "roma",
    "transformers",
    "pygltflib",
    "yaml",
    "PIL",
    "rich",
    "imageio_ffmpeg",
    "motionloom_lab",
    "motionloom_train",
}
"""What no sentence needs on its way to a BVH."""

COMMAND = """
import sys
from motionloom.cli import main
code = main(sys.argv[1:])
print("LOADED", *sorted(sys.modules))
sys.exit(code)
"""


def loaded(*command: str, code: str = COMMAND) -> set[str]:
    """The modules that a fresh process has imported at the end of a command."""
    done = subprocess.run(
        [sys.executable, "-c", code, *command], capture_output=True, text=True, timeout=600, check=False
    )
    assert done.returncode == 0, done.stderr
    return set(done.stdout.rsplit("LOADED", 1)[1].split())


@pytest.mark.parametrize(
    "words",
    [
        ("info", str(CLIP)),
        ("export", str(CLIP), "{out}.bvh", "--mirror", "--fps", "20"),
        ("export", str(CLIP), "{out}.glb", "--skeleton", "smpl22"),
        ("export", str(CLIP), "{out}.npz", "--start", "0.5"),
        ("export", str(CLIP), "{out}.gif", "--end", "0.1"),
        ("view", str(CLIP), "--out", "{out}.png"),
    ],
    ids=lambda words: " ".join(words[:1] + words[2:]),
)
def test_files_are_read_written_and_drawn_without_torch(words: tuple[str, ...], tmp_path: Path) -> None:
    """`info`, `export` and `view` start as fast as numpy does."""
    found = loaded(*(word.replace("{out}", str(tmp_path / "out")) for word in words))
    assert "motionloom.io" in found
    assert not found & {"torch", "scipy", "matplotlib", "roma", "rich", "tokenizers", "safetensors"}


def test_a_sentence_becomes_a_bvh_without_what_only_others_need(tmp_path: Path) -> None:
    """`generate` imports NumPy, ONNX Runtime, the tokenizer, and nothing large besides."""
    out = tmp_path / "walk.bvh"
    found = loaded("generate", "a person walks", "--seconds", "1", "--steps", "2", "--out", str(out))
    assert out.stat().st_size
    assert {"onnxruntime", "tokenizers"} <= found
    assert not found & (HEAVY | {"torch", "onnx"})


TABLES = {"cli", "core", "core.errors", "core.interruption", "core.reading"}
FILES = TABLES | {
    f"core.{name}" for name in ("arrays", "blending", "files", "ground", "motion", "rotations", "skeleton")
}
FILES |= {"formats", "io", "kinematics", "requests", "retarget", "viz"}
WEIGHTS = FILES - {"kinematics", "viz"} | {"core.defaults", "core.diffusion", "core.features", "core.models", "weights"}
SENTENCE = WEIGHTS | FILES - {"viz"} | {"core.body", "core.methods", "edits", "goals", "tasks"}
NETWORK = {"numpy", "onnxruntime", "safetensors", "tokenizers"}
MAY_LOAD: dict[str, tuple[set[str], set[str]]] = {
    "--help": (TABLES, set()),
    "generate --help": (TABLES | {"core.defaults", "formats", "requests"}, set()),
    f"info {CLIP}": (FILES, {"numpy"}),
    f"export {CLIP} OUT": (FILES, {"numpy"}),
    "weights --json": (WEIGHTS, NETWORK - {"onnxruntime"}),
    "generate walks --seconds 1 --steps 2 --out OUT": (SENTENCE, NETWORK),
}
"""Rooms of the package and libraries that a command may load."""


def room_of(module: str) -> str:
    """The room of a module; of the core also the part."""
    parts = module.split(".")[1:]
    return ".".join(parts[: 2 if parts[0] == "core" else 1])


@pytest.mark.parametrize("command", MAY_LOAD, ids=lambda command: command.replace(str(CLIP), "CLIP"))
def test_a_command_loads_no_more_than_it_needs(command: str, tmp_path: Path) -> None:
    code = "import sys, contextlib\nbefore = set(sys.modules)\nfrom motionloom.cli import main\n"
    code += "with contextlib.suppress(SystemExit): main(sys.argv[1:])\nprint('LOADED', *set(sys.modules) - before)"
    names = loaded(*command.replace("OUT", str(tmp_path / "out.bvh")).split(), code=code)
    rooms, libraries = MAY_LOAD[command]
    assert {room_of(name) for name in names if name.startswith("motionloom.")} <= rooms
    known = {"numpy", "onnxruntime", "safetensors", "tokenizers", "motionloom_lab", "motionloom_train", *HEAVY}
    assert {name.split(".")[0] for name in names} & known <= libraries


def test_importing_the_package_imports_no_library() -> None:
    """`import motionloom` knows its public names and imports what is behind them when they are asked for."""
    found = loaded(code="import sys, motionloom; print('LOADED', *sys.modules)")
    assert not found & {"torch", "numpy", "safetensors", "motionloom.core.motion"}
    found = loaded(code="import sys; from motionloom import Motion, SMPL22, load; print('LOADED', *sys.modules)")
    assert "numpy" in found
    assert "torch" not in found


def test_a_command_sets_up_no_command_behind_it() -> None:
    """`generate --help` reads tables alone; other packages are opened for none but their own commands."""
    code = "import sys, contextlib\nfrom motionloom.cli import main\n"
    code += "with contextlib.suppress(SystemExit): main(sys.argv[1:])\nprint('LOADED', *sys.modules)"
    for words in (["generate", "--help"], ["nothing"]):
        assert not loaded(*words, code=code) & {"motionloom.cli.generate", "motionloom.cli.weights", "numpy"}
    assert "motionloom_lab.cli.evaluate" not in loaded("nothing", code=code)
    alone = loaded("evaluate", "--help", code=code)
    assert "motionloom_lab.cli.evaluate" in alone
    assert "motionloom.cli.weights" not in alone


def test_the_server_answers_before_it_imports_torch() -> None:
    """Only the thread that draws needs torch: the page, its project and its motions are there earlier."""
    pytest.importorskip("uvicorn")
    pytest.importorskip("starlette")
    found = loaded(code="import sys, motionloom.server.serving, motionloom.server.files; print('LOADED', *sys.modules)")
    assert "motionloom.server.app" in found
    assert not found & {"torch", "scipy", "motionloom.live.live", "motionloom.tasks"}
