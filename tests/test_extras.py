"""Commands that need what only an extra installs say so in one sentence."""

import subprocess
import sys
from pathlib import Path

import pytest

ROOT = Path(__file__).parents[1]
WITHOUT = "import sys; sys.modules['torch'] = None; from motionloom.cli import main; sys.exit(main(sys.argv[1:]))"
CLIP = "examples/clips/walk.bvh"


@pytest.mark.parametrize(
    "words",
    [
        ("train", "prior", "--recipe", "recipes/default.toml", "--data", "nowhere", "--out", "{out}"),
        ("evaluate", "obedience", "--seeds", "1", "--out", "{out}"),
        ("teach", "a person flips", CLIP, "--out", "{out}/a.safetensors"),
        ("weights", "convert", "{out}/a.safetensors", "{out}/b.safetensors"),
        ("bench",),
        ("import", "model.pt", "--out", "{out}/a.safetensors"),
    ],
    ids=lambda words: words[0],
)
def test_without_pytorch_one_sentence_says_what_brings_it(words: tuple[str, ...], tmp_path: Path) -> None:
    if words[0] == "weights":
        (tmp_path / "a.safetensors").write_bytes(b"\x02\0\0\0\0\0\0\0{}")
    line = [word.format(out=tmp_path) for word in words]
    done = subprocess.run([sys.executable, "-c", WITHOUT, *line], cwd=ROOT, capture_output=True, text=True, check=False)
    assert done.returncode == 2, done.stderr
    said = done.stderr.strip().splitlines()
    assert len(said) == 1, done.stderr
    assert "packages/motionloom-train" in said[0]
    assert done.stdout == "", "nothing is read or made before"
