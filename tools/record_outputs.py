"""Record what every command makes of fixed seeds, for tests/outputs; or compare it with what other code makes.

python tools/record_outputs.py                      record anew
python tools/record_outputs.py --compare            how far each command is from what is recorded
python tools/record_outputs.py --compare main       how far from what the code of a commit makes here and now
python tools/record_outputs.py --compare ../other   the same of another checkout

Record anew after a change that is meant to change what is made: new shipped weights, another sampler, a better fit. Say
in the commit why the outputs changed. What moves or renames code changes nothing: compare it with the commit before.
Kinds of processors differ by more than such a change may, so both are run here; where they differ by more than `SAME`
the exit code is 1.
"""

import argparse
import os
import subprocess
import sys
import tempfile
from collections.abc import Iterator, Mapping, Sequence
from contextlib import contextmanager
from pathlib import Path

import numpy as np

sys.path.insert(0, str(Path(__file__).resolve().parents[1] / "packages/motionloom"))

from motionloom.core.files.atomic import atomic_path
from tests.outputs.commands import COMMANDS, RECORDED, ROOT, places, sampled

SAME = 1e-6
"""Metres that two runs of the same code on one machine may differ by."""


def made_here(names: Sequence[str]) -> dict[str, np.ndarray]:
    """What the commands of these names make, (frames, joints, 3) metres; those that cannot be run are left out."""
    made = {}
    for name in names:
        with tempfile.TemporaryDirectory() as folder:
            try:
                made[name] = sampled(places(name, Path(folder)))
            except RuntimeError as error:
                print(f"{name}: {error}", file=sys.stderr)
    return made


def sources(root: Path) -> list[str]:
    """Where the packages of a checkout lie: below `packages`, or in `src` where there was only one."""
    found = [*sorted((root / "packages").glob("*/src")), root / "src"]
    return [str(place) for place in found if place.is_dir()]


@contextmanager
def checkout(place: str) -> Iterator[Path]:
    """The folder of a checkout: one that is there, or a commit of this repository in a folder of its own."""
    if sources(Path(place)):
        yield Path(place).resolve()
        return
    with tempfile.TemporaryDirectory() as folder:
        tree, git = str(Path(folder) / "tree"), ["git", "-C", str(ROOT), "worktree"]
        subprocess.run([*git, "add", "--quiet", "--detach", tree, place], check=True)
        try:
            yield Path(tree)
        finally:
            subprocess.run([*git, "remove", "--force", tree], check=True)


def made_there(place: str, names: Sequence[str]) -> dict[str, np.ndarray]:
    """What the same commands make of the code of another checkout or commit, in a process of its own."""
    with checkout(place) as root, tempfile.TemporaryDirectory() as folder:
        target = Path(folder) / "made.npz"
        environment = {**os.environ, "PYTHONPATH": os.pathsep.join(sources(root))}
        words = [sys.executable, __file__, "--into", str(target), "--only", *names]
        subprocess.run(words, check=True, env=environment, stdout=sys.stderr)
        with np.load(target, allow_pickle=False) as made:
            return dict(made)


def distances(before: Mapping[str, np.ndarray], now: Mapping[str, np.ndarray]) -> dict[str, float]:
    """The largest distance of any number of each command, metres; infinite where only one side made it, or other
    frames."""
    found = {}
    for name in [*now, *(name for name in before if name not in now)]:
        both = name in before and name in now and before[name].shape == now[name].shape
        found[name] = float(np.abs(before[name] - now[name]).max()) if both else np.inf
    return found


def write(place: Path, made: Mapping[str, np.ndarray]) -> None:
    """An .npz file, whole or not at all."""
    with atomic_path(place) as path, path.open("wb") as file:
        np.savez_compressed(file, **made)  # type: ignore[arg-type]


def main() -> int:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--compare", nargs="?", const="", metavar="COMMIT|FOLDER", help="write nothing, compare")
    parser.add_argument("--only", nargs="+", default=list(COMMANDS), choices=list(COMMANDS), metavar="NAME")
    parser.add_argument("--into", type=Path, default=RECORDED, metavar="FILE", help="record into another file")
    arguments = parser.parse_args()
    now = made_here(arguments.only)
    if arguments.compare is None:
        write(arguments.into, now)
        print(f"{arguments.into}: {len(now)} commands, {arguments.into.stat().st_size / 1e3:.0f} kB")
        return 0
    if arguments.compare:
        before = made_there(arguments.compare, arguments.only)
    else:
        with np.load(RECORDED, allow_pickle=False) as recorded:
            before = {name: recorded[name] for name in arguments.only if name in recorded}
    apart = distances(before, now)
    for name, metres in apart.items():
        print(f"{name:24}", f"{metres:.1e} m" if np.isfinite(metres) else "not made by both alike")
    return int(bool(arguments.compare) and max(apart.values()) > SAME)


if __name__ == "__main__":
    sys.exit(main())
