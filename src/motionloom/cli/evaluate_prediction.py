"""`motionloom evaluate prediction` and `evaluate study`: how good futures are, and what makes them so."""

import argparse
from pathlib import Path

from motionloom.cli.measuring import prepared, set_threads

SINGLES = ("all", "skip", "skip-multimodal")
ROWS = ("real", "zero", "constant", "ours", "ours-many", "published")
STUDIES = (
    "coefficients",
    "layers",
    "schedules",
    "noising",
    "dct",
    "steps",
    "horizon",
    "hold",
    "switch",
)
"""As in `motionloom.lab.suites.prediction_studies`, which takes its time to import."""
DATA = ("cmu", "h36m", "humaneva", "amass", "own")


def add(commands) -> None:
    """Register `evaluate prediction` and `evaluate study`."""
    prediction = commands.add_parser(
        "prediction", help="many futures of a past: APD, ADE, FDE, MMADE, MMFDE, limbs, jerk, seam beside baselines"
    )
    _shared(prediction)
    prediction.add_argument("--samples", type=int, help="futures of each past (default 50)")
    prediction.add_argument("--steps", type=int, help="sampler steps (default: as predict)")
    prediction.add_argument("--guidance", type=float, metavar="W", help="how strictly the past is heeded (default 1)")
    prediction.add_argument(
        "--singles",
        choices=SINGLES,
        default="all",
        help="windows with a single future: count them (default), skip them, or skip them for MMADE, MMFDE and APDE",
    )
    prediction.add_argument(
        "--published-steps", type=int, metavar="N", help="steps of the published sampler, and of ours with many (100)"
    )
    prediction.add_argument("--replications", type=int, help="runs with other seeds, for intervals (default 1)")
    prediction.add_argument("--row", action="append", choices=ROWS, help="only this row (repeatable)")
    prediction.add_argument("--rows-without-published", action="store_true", help="leave out what others published")
    prediction.add_argument(
        "--out", type=Path, metavar="FOLDER", help="folder for report.md, report.json and plots; a stopped run goes on"
    )
    prediction.add_argument("--quick", action="store_true", help="six windows, six futures, few steps")
    prediction.add_argument("--json", action="store_true", help="print JSON instead of tables")
    prediction.set_defaults(run=_prediction)
    _add_study(commands)


def _add_study(commands) -> None:
    study = commands.add_parser("study", help="one of the studies of prediction: a table and a picture in a folder")
    study.add_argument("name", choices=STUDIES, metavar="NAME", help=", ".join(STUDIES))
    _shared(study)
    study.add_argument("--samples", type=int, help="futures of each past (default: of the study)")
    study.add_argument(
        "--train-steps", type=int, metavar="N", help="training steps of each small network (default 1000)"
    )
    study.add_argument(
        "--out", type=Path, metavar="FOLDER", required=True, help="folder of NAME.md, NAME.png, NAME.json"
    )
    study.add_argument("--keep", type=Path, metavar="FOLDER", help="folder of trained networks (default OUT/networks)")
    study.add_argument("--quick", action="store_true", help="a network trained for a moment, few windows")
    study.set_defaults(run=_study)


def _shared(parser: argparse.ArgumentParser) -> None:
    parser.add_argument("--data", type=Path, required=True, metavar="DIR", help="recordings: mocap pack, folder, .npz")
    parser.add_argument("--protocol", choices=DATA, help="which data set that is (default: seen from its files)")
    parser.add_argument("--weights", default="predictor", help="shipped name or file (default: predictor)")
    parser.add_argument("--windows", type=int, metavar="N", help="evenly chosen test windows")
    parser.add_argument("--seed", type=int, default=0, help="first seed (default 0)")
    parser.add_argument("--device", default="cpu", help="cpu or cuda (default cpu)")
    parser.add_argument("--threads", type=int, metavar="N", help="CPU threads (default: all)")


def _prediction(arguments: argparse.Namespace) -> None:
    import json

    from motionloom.lab.report import report
    from motionloom.lab.suites import prediction

    how = _how(arguments)
    set_threads(arguments)
    found = prediction.run(
        prepared(arguments, _command(arguments, "prediction"), arguments.out),
        name=arguments.protocol,
        how=how,
        kinds=arguments.row or prediction.KINDS,
        with_published=not arguments.rows_without_published,
    )
    if arguments.out:
        report.write(found, arguments.out)
    print(json.dumps(report.encode(found), indent=1) if arguments.json else prediction.printed(found))


def _how(arguments: argparse.Namespace):
    """The defaults, of a quick run or a full one, with what was said."""
    from dataclasses import replace

    from motionloom.lab.suites.prediction import QUICK, How

    names = ("samples", "windows", "steps", "guidance", "published_steps", "replications", "seed")
    said = {name: value for name in names if (value := getattr(arguments, name)) is not None}
    return replace(QUICK if arguments.quick else How(), singles=arguments.singles.replace("-", "_"), **said)


def _study(arguments: argparse.Namespace) -> None:
    from motionloom.lab.report import report
    from motionloom.lab.suites import prediction_studies as studies

    set_threads(arguments)
    budget = studies.budget(
        arguments.name,
        quick=arguments.quick,
        windows=arguments.windows,
        samples=arguments.samples,
        train_steps=arguments.train_steps,
        seed=arguments.seed,
    )
    found = studies.run(
        arguments.name,
        prepared(arguments, _command(arguments, "study"), arguments.out),
        protocol=arguments.protocol,
        keep=arguments.keep or arguments.out / "networks",
        budget=budget,
    )
    print(report.plain(found))
    print(f"\nwritten: {arguments.out / arguments.name}.md, .json, .png")


def _command(arguments: argparse.Namespace, kind: str) -> str:
    """What to type to measure the same again; where data lie differs between machines, so they are called DIR."""
    import shlex

    from motionloom.weights.predictor import shipped_predictors

    words = ["motionloom", "evaluate", kind, *([arguments.name] if kind == "study" else []), "--data", "DIR"]
    weights = arguments.weights if arguments.weights in shipped_predictors() else Path(arguments.weights).name
    words += ["--weights", weights] if arguments.weights != "predictor" else []
    said = ("protocol", "windows", "samples", "steps", "guidance", "published_steps", "replications", "train_steps")
    for name in said:
        value = getattr(arguments, name, None)
        words += [f"--{name.replace('_', '-')}", str(value)] if value is not None else []
    words += ["--seed", str(arguments.seed)] if arguments.seed else []
    words += ["--singles", arguments.singles] if getattr(arguments, "singles", "all") != "all" else []
    for row in getattr(arguments, "row", None) or []:
        words += ["--row", row]
    if kind == "study":
        words += ["--out", "FOLDER"]
    return shlex.join([*words, *(["--quick"] if arguments.quick else [])])
