"""Write the graphs of all weights that ship into their files, in place: `python tools/write_graphs.py`.

To be done after a network or `motionloom_train.export` has changed; weights and their digests stay as they are.
"""

from motionloom.core.models.container import PAIRS, PREDICTORS, PRIORS, weights_digest
from motionloom_train.convert import convert


def main() -> None:
    for kind in (PRIORS, PREDICTORS, PAIRS):
        for path in kind.shipped().values():
            before = weights_digest(path)
            convert(path, path)
            if weights_digest(path) != before:
                raise SystemExit(f"the weights in {path} are others now")
            print(f"{path}: weights {before[:16]}")


if __name__ == "__main__":
    main()
