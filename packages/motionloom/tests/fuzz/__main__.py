"""``python -m tests.fuzz``: mutated files for every reader, for so many seconds or files."""

import argparse
import sys
from pathlib import Path

from tests.fuzz.machine import fuzz


def main() -> int:
    parser = argparse.ArgumentParser(prog="python -m tests.fuzz", description=__doc__)
    parser.add_argument("--seconds", type=float, default=60.0, help="how long (default 60)")
    parser.add_argument("--files", type=int, default=10**9, help="at most so many files")
    parser.add_argument("--seed", type=int, default=0, help="the same seed tries the same files")
    parser.add_argument("--number", type=int, help="only the file of this number, as a failure is reported")
    parser.add_argument("--only", default="", help="readers whose name begins so")
    parser.add_argument("--keep", type=Path, default=Path("out/fuzz"), help="folder for files that fail")
    given = parser.parse_args()
    first, files = (0, given.files) if given.number is None else (given.number, 1)
    result = fuzz(
        seconds=given.seconds, files=files, first=first, seed=given.seed, only=given.only, keep=given.keep.absolute()
    )
    print(result.report())
    return 1 if result.failures else 0


if __name__ == "__main__":
    sys.exit(main())
