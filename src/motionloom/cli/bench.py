"""`motionloom bench`: speed and memory, as ratios within one run."""

import argparse
from pathlib import Path


def add(subparsers) -> None:
    """Register `bench`."""
    parser = subparsers.add_parser("bench", help="measure speed and memory on this machine")
    parser.add_argument("--weights", default="default", help="shipped name or file (default: default)")
    parser.add_argument(
        "--long", action="store_true", help="measure long motion instead: 1 to 10 minutes of it; takes some minutes"
    )
    parser.add_argument(
        "--quick", action="store_true", help="fewer repeats and sizes; with --long 10 to 40 s of motion"
    )
    parser.add_argument("--device", default="cpu", help="cpu or cuda for the network's part (default cpu)")
    parser.add_argument("--json", type=Path, metavar="FILE", help="write the numbers to this file as well")
    parser.set_defaults(run=_bench)


def _bench(arguments: argparse.Namespace) -> None:
    import sys

    from motionloom.bench import bench, defaults, table
    from motionloom.checkpoint import Prior
    from motionloom.evaluation.obey import check_report, plain, write_json
    from motionloom.tasks.long import compose
    from motionloom.tasks.text import generate

    if arguments.json:
        check_report(arguments.json)
    prior = Prior.load(arguments.weights, device=arguments.device)
    found = bench(
        prior, defaults(compose if arguments.long else generate), what="long" if arguments.long else "short",
        quick=arguments.quick, weights=arguments.weights,
        progress=lambda line: print(line, file=sys.stderr, flush=True),
    )  # fmt: skip
    if arguments.json:
        write_json(arguments.json, found)
    on = found["machine"]
    print(f"{on['device']}, {on['cores']} cores, {on['threads']} threads, torch {on['torch']}, {on['type']}")
    print(plain(table(found)))
    if on["load"] > 0.5:
        print(f"\nthe machine was busy when this began (load {on['load']}): run it again when nothing else does")
