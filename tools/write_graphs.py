"""Write the graphs of all weights that ship into their files, in place: `python tools/write_graphs.py`.

To be done after a network or `motionloom.train.export` has changed; weights and their digests stay as they are.
"""

from motionloom.train.convert import convert
from motionloom.weights.container import PAIRS, PREDICTORS, PRIORS, weights_digest


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
