"""Write docs/rigs.md: what each command does with every file of a folder of characters and recordings.

python tools/make_rigs_table.py FOLDER          # such as ../shared/rigs

Networks are tiny ones with random weights: what a rig does to a command does not depend on what is drawn.
"""

import contextlib
import io
import sys
import tempfile
import warnings
from pathlib import Path

import numpy as np

sys.path.insert(0, str(Path(__file__).parents[1] / "packages/motionloom"))

from motionloom.cli import main
from motionloom.core.files.bvh_writer import save_bvh
from motionloom.core.models.predictor import save_predictor
from motionloom.core.models.prior import save_prior
from motionloom.core.motion import Motion
from motionloom.core.rotations import IDENTITY
from motionloom.core.skeleton import SMPL22
from motionloom.retarget import to_smpl22
from tests.cli.predict.clips import tiny_predictor
from tests.recorded import tiny
from tests.tasks.two_people import block

ROOT = Path(__file__).parents[1]
SUFFIXES = (".bvh", ".glb", ".gltf", ".vrm", ".vrma")
PRIOR = ("--weights", "{w}/prior.safetensors", "--steps", "2", "--no-foot-lock")
PREDICTOR = ("--weights", "{w}/predictor.safetensors", "--steps", "2", "--no-foot-lock")
ON = ("--skeleton", "{file}", "--out", "{w}/out{own}")
READING = {
    "info": ("info", "{file}"),
    "view": ("view", "{file}", "--out", "{w}/view.png"),
    "export": ("export", "{file}", "{w}/same.bvh"),
    "onto smpl22": ("export", "{file}", "{w}/in.bvh", "--skeleton", "smpl22"),
    "edit": ("edit", "{file}", "waves", "--extend", "0.5", "--out", "{w}/edit.bvh", *PRIOR),
    "predict": ("predict", "{file}", "--count", "1", "--seconds", "0.5", "--out", "{w}/future.bvh", *PREDICTOR),
}
"""Commands that read the file."""
WRITING = {
    "export": ("export", "{w}/walk.bvh", *ON),
    "generate": ("generate", "a person walks", "--seconds", "1", *ON, *PRIOR),
    "compose": ("compose", "walks", "turns", "--seconds", "1.5", *ON, *PRIOR),
    "control": ("control", "walks", "--follow", "head", "--from", "{w}/walk.bvh", *ON, *PRIOR),
    "edit": ("edit", "{w}/walk.bvh", "waves", "--extend", "0.5", *ON, *PRIOR),
    "predict": ("predict", "{w}/walk.bvh", "--count", "1", "--seconds", "0.5", *ON, *PREDICTOR),
    "switch": ("switch", "{w}/walk.bvh", "{w}/walk.bvh", "--seconds", "0.5", *ON, *PREDICTOR),
    "duet": (
        "duet",
        "two people dance",
        "--seconds",
        "1",
        *ON,
        "--out",
        "{w}/other{own}",
        *PRIOR,
        "--pair-weights",
        "{w}/block.safetensors",
    ),
    "fist": ("export", "{w}/walk.bvh", *ON, "--hands", "fist"),
    "usda": ("export", "{w}/walk.bvh", "--skeleton", "{file}", "--out", "{w}/out.usda"),
}
"""Commands that put a motion on the file's skeleton; a character's own file is written."""


class Notes:
    """Sentences that commands said, each under one number."""

    def __init__(self) -> None:
        self.known: dict[str, int] = {}

    def cell(self, code: int, text: str) -> str:
        number = f"<sup>{self.known.setdefault(text, len(self.known) + 1)}</sup>" if text else ""
        return ("works" if code == 0 else "refused") + number


def said(words: list[str], folders: dict[str, str]) -> tuple[int, str]:
    """The exit code, and what was remarked or why it was refused, without names of folders."""
    errors = io.StringIO()
    with contextlib.redirect_stderr(errors), contextlib.redirect_stdout(io.StringIO()), warnings.catch_warnings():
        warnings.simplefilter("always")
        code = main(words)
    lines = [line.removeprefix("motionloom: ") for line in errors.getvalue().splitlines()]
    drawn = (" away from its goal", "note: give --unit", "sees the last")  # what random weights and a short walk make
    text = " ".join("; ".join(line for line in lines if not any(word in line for word in drawn)).split())
    for name, short in folders.items():
        text = text.replace(name + "/", "").replace(name, short)
    text = text.replace("|", "/")
    return code, text if len(text) < 400 else f"{text[:230]} ... {text[-160:]}"  # what to do is said at the end


def prepare(folder: Path) -> None:
    """A walk and tiny weights."""
    turns = np.tile(IDENTITY, (30, 22, 1))
    turns[:, 1, 0], turns[:, 1, 1] = np.cos(0.2), np.sin(0.2)
    walk = Motion(SMPL22, 30.0, SMPL22.offsets[0] + np.linspace(0, 1, 30)[:, None] * [0, 0, 1.0], turns)
    save_bvh(to_smpl22(walk), folder / "walk.bvh")
    prior = tiny.prior()
    save_prior(prior, folder / "prior.safetensors", half=False)
    save_predictor(tiny_predictor(), folder / "predictor.safetensors")
    block(prior).save(folder / "block.safetensors", half=False)


def table(files: list[Path], commands: dict[str, tuple[str, ...]], notes: Notes, made: str) -> str:
    """The rows of one table."""
    lines = ["| file | " + " | ".join(commands) + " |", "|---" * (len(commands) + 1) + "|"]
    for path in files:
        own = path.suffix if path.suffix.lower() in (".glb", ".gltf", ".vrm") else ".bvh"
        cells = []
        for words in commands.values():
            filled = [word.format(file=path, w=made, own=own) for word in words]
            force = ["--force"] if filled[0] != "info" else []
            code, text = said([*filled, *force], {str(path): "FILE", made: ""})
            cells.append(notes.cell(code, text.replace(path.name, "FILE")))
        lines.append(f"| {path.name} | " + " | ".join(cells) + " |")
        print(lines[-1], flush=True)
    return "\n".join(lines)


def measured() -> str:
    """What benchmarks/characters.py found, where it was run."""
    place = ROOT / "benchmarks" / "characters.txt"
    if not place.is_file():
        return ""
    return f"""
## How near clips come back

Each clip read, put on the uniform person and back onto its character; percent of the character's height between skinned
vertices, and degrees of twist of limb bones. Targets are 4 over all, 6 for head, hands and feet, 20 degrees; a star
misses one. In `Robot_Death` the animator lets the head fly off the neck, which a person of constant bones cannot carry.
Made by `python benchmarks/characters.py FOLDER --out benchmarks/characters.txt`.

```
{place.read_text(encoding="utf-8").rstrip()}
```
"""


def document(folder: Path) -> str:
    """The whole page."""
    files = sorted(p for p in folder.iterdir() if p.suffix.lower() in SUFFIXES)
    notes = Notes()
    with tempfile.TemporaryDirectory() as made:
        prepare(Path(made))
        reading = table(files, READING, notes, made)
        writing = table(files, WRITING, notes, made)
    sentences = "\n".join(f"{number}. {text}" for text, number in notes.known.items())
    return f"""# Rigs that were tried

Every file of a folder of other people's characters and recordings in every command that reads a motion or takes
`--skeleton`. Made by `python tools/make_rigs_table.py FOLDER`; numbers are sentences below.

## Read as a motion

{reading}

## As `--skeleton`

`fist` is `export --hands fist`, `usda` writes a `.usda` with the character's mesh.

{writing}

## What was said

{sentences}
{measured()}"""


if __name__ == "__main__":
    page = document(Path(sys.argv[1]))
    (ROOT / "docs" / "rigs.md").write_text(page, encoding="utf-8")
