"""`motionloom bench`: speed and memory, as ratios within one run."""

import argparse
from typing import Any

from motionloom.cli.tables import add_family
from motionloom.cli.writing import check_overwriting, fail


def add(subparsers) -> None:
    """Register `bench`."""
    add_family(subparsers, __name__)


def run_bench(arguments: argparse.Namespace) -> None:
    """``motionloom bench``."""
    from motionloom_lab.bench import table
    from motionloom_lab.report.files import check_report, plain, write_json

    if arguments.json:
        check_report(arguments.json)
        check_overwriting(arguments, [arguments.json])
    if arguments.long and arguments.prediction:
        fail("--long and --prediction are two measurements; ask for one")
    results = _predicted(arguments) if arguments.prediction else _generated(arguments)
    if arguments.json:
        write_json(arguments.json, results)
    on = results["machine"]
    print(
        f"{on['device']}, {on['cores']} cores, {on['threads']} threads, ONNX Runtime {on['onnxruntime']}, {on['type']}"
    )
    print(plain(table(results)))
    if on["load"] > 0.5:
        print(f"\nthe machine was busy when this began (load {on['load']}): run it again when nothing else does")
    print(f"\nWeights: {_weights(arguments)}")


def _weights(arguments: argparse.Namespace) -> str:
    """Name and hash of what was measured, by which pages that show the table are held against what ships."""
    from motionloom.core.models.predictor import find_predictor
    from motionloom.core.models.prior import find_weights
    from motionloom_lab.suites.harness import weight_marks

    if arguments.prediction:
        path = find_predictor(arguments.weights or "predictor")
    else:
        path = find_weights(arguments.weights or "default")
    [(name, mark)] = weight_marks([path]).items()
    return f"{name} {mark}"


def _generated(arguments: argparse.Namespace) -> dict[str, Any]:
    from motionloom.core.models.prior import Prior
    from motionloom_lab.bench import Sampling, bench
    from motionloom_lab.suites.harness import say

    weights = arguments.weights or "default"
    return bench(
        Prior.load(weights, device=arguments.device),
        Sampling(),
        what="long" if arguments.long else "short",
        quick=arguments.quick,
        weights=weights,
        progress=say,
    )


def _predicted(arguments: argparse.Namespace) -> dict[str, Any]:
    from motionloom.core.models.predictor import Predictor
    from motionloom_lab.bench import bench_prediction
    from motionloom_lab.suites.harness import say

    predictor = Predictor.load(arguments.weights or "predictor", device=arguments.device)
    return bench_prediction(predictor, quick=arguments.quick, progress=say)
