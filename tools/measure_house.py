"""Measure the house: canonical lines per room, and functions with many parameters, of high complexity, or long.

python tools/measure_house.py [--json]

Canonical lines are those after `ruff format` at 88 columns, as most projects write, without comments that hold lines
together: what is packed into long lines counts in full. `tests/test_house.py` holds a budget for each room.
Parameters: of public functions and methods, without self and cls, over `PARAMETERS`. Complexity: cyclomatic with
boolean operators and comprehensions, over `COMPLEXITY` (ruff's C901 counts neither, and finds nothing over 16).
"""

import ast
import json
import re
import subprocess
import sys
import tempfile
from collections import Counter
from collections.abc import Iterator
from pathlib import Path

ROOT = Path(__file__).resolve().parents[1]
SOURCES = {
    "": ROOT / "packages" / "motionloom" / "src" / "motionloom",
    "train": ROOT / "packages" / "motionloom-train" / "src" / "motionloom_train",
    "lab": ROOT / "packages" / "motionloom-lab" / "src" / "motionloom_lab",
    "blender": ROOT / "blender",
}
"""The packages' folders and the extension's; rooms but those of the product begin with these words."""
PARAMETERS, COMPLEXITY = 8, 20
Function = ast.FunctionDef | ast.AsyncFunctionDef


WIDTH = 88
HOLDS = re.compile(r"[ \t]*# fmt: (?:skip|off|on)\b.*")


def room_of(path: Path) -> str:
    """The room of a file below its package's folder."""
    return "(top)" if len(path.parts) == 1 else path.parts[0]


def canonical(folder: Path) -> dict[str, int]:
    """Canonical lines of every Python file below a folder, by its path there.

    Raises CalledProcessError where ruff cannot read a file, and FileNotFoundError where there is no ruff.
    """
    with tempfile.TemporaryDirectory() as place:
        for path in folder.rglob("*.py"):
            copy = Path(place) / path.relative_to(folder)
            copy.parent.mkdir(parents=True, exist_ok=True)
            copy.write_text(HOLDS.sub("", path.read_text()))
        ruff = Path(sys.executable).with_name("ruff")
        command = [ruff, "format", "-q", "--isolated", "--no-cache", "--line-length", str(WIDTH), place]
        subprocess.run(command, check=True)
        found = sorted(Path(place).rglob("*.py"))
        return {str(path.relative_to(place)): path.read_text().count("\n") for path in found}


def lines() -> dict[str, int]:
    """Canonical lines per room."""
    count: Counter[str] = Counter()
    for package, source in SOURCES.items():
        for name, number in canonical(source).items():
            count["/".join(filter(None, [package, room_of(Path(name))]))] += number
    return dict(count.most_common())


def functions() -> Iterator[tuple[str, Function]]:
    """Every function with its place."""
    for source in SOURCES.values():
        for path in sorted(source.rglob("*.py")):
            for node in ast.walk(ast.parse(path.read_text())):
                if isinstance(node, Function):
                    yield f"{path.relative_to(source.parent)}:{node.lineno} {node.name}", node


def parameters(node: Function) -> int:
    """How many arguments a call may give."""
    given = [*node.args.posonlyargs, *node.args.args, *node.args.kwonlyargs]
    return len([argument for argument in given if argument.arg not in ("self", "cls")])


def complexity(node: Function) -> int:
    """Cyclomatic complexity with boolean operators and comprehensions, inner functions too (as radon counts)."""
    count = 1
    for part in ast.walk(node):
        if isinstance(part, ast.BoolOp):
            count += len(part.values) - 1
        elif isinstance(part, ast.comprehension):
            count += 1 + len(part.ifs)
        elif isinstance(part, ast.For | ast.While):
            count += 1 + bool(part.orelse)
        elif isinstance(part, ast.If | ast.IfExp | ast.ExceptHandler | ast.Assert | ast.Lambda | ast.match_case):
            count += 1
    return count


def measured() -> dict[str, object]:
    """Everything, by name."""
    rooms, every = lines(), list(functions())
    packages = {
        name: sum(count for room, count in rooms.items() if room.startswith(f"{name}/"))
        for name in ("train", "lab", "blender")
    }
    many = [(parameters(node), place) for place, node in every if not node.name.startswith("_")]
    long = [((node.end_lineno or node.lineno) - node.lineno + 1, place) for place, node in every]
    return {
        "canonical lines": rooms,
        "product": sum(rooms.values()) - sum(packages.values()),
        "training": packages["train"],
        "laboratory": packages["lab"],
        "extension": packages["blender"],
        f"public functions with more than {PARAMETERS} parameters": sorted(
            (one for one in many if one[0] > PARAMETERS), reverse=True
        ),
        f"complexity over {COMPLEXITY}": sorted(
            (one for one in ((complexity(node), place) for place, node in every) if one[0] > COMPLEXITY), reverse=True
        ),
        "longest functions": sorted(long, reverse=True)[:5],
    }


def main() -> None:
    """Print what was measured."""
    found = measured()
    if "--json" in sys.argv[1:]:
        print(json.dumps(found, indent=1))
        return
    for name, value in found.items():
        if isinstance(value, dict):
            print(f"{name}:", *(f"  {count:6} {room}" for room, count in value.items()), sep="\n")
        elif isinstance(value, list):
            print(f"{name}: {len(value)}", *(f"  {count:6} {place}" for count, place in value), sep="\n")
        else:
            print(f"{name}: {value}")


if __name__ == "__main__":
    main()
