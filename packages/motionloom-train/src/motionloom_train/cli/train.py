"""`motionloom train`: models from recipes."""

import argparse
from functools import partial
from importlib import import_module
from pathlib import Path
from typing import TYPE_CHECKING

from motionloom.errors import MotionloomError

if TYPE_CHECKING:
    from motionloom_train.loop import Training

LABORATORY = "motionloom_lab"
"""Reads the data sets and protocols that others published, and has the evaluator; opened where one is asked for."""

ON_SETS = {
    "prior": ("default.toml", "a text-to-motion prior on a built set", "motionloom_train.prior:train_prior"),
    "evaluator": (
        "evaluator.toml",
        "a text-motion evaluator on a built set, by contrast",
        f"{LABORATORY}.evaluator.training:train_evaluator",
    ),
    "control": (
        "control.toml",
        "an adapter (or a whole prior) that obeys what is given",
        "motionloom_train.control:train_control",
    ),
}
"""What is trained on a built set: its recipe, its help, and the function."""


def add(subparsers) -> None:
    """Register `train prior`, `train evaluator`, `train control`, `train predictor` and `train duet`."""
    train = subparsers.add_parser("train", help="train a model from a recipe; continues an interrupted run")
    commands = train.add_subparsers(metavar="MODEL", required=True)
    for name, (recipe, about, _) in ON_SETS.items():
        parser = commands.add_parser(name, help=about)
        _run_options(parser, recipe, "folder made by 'motionloom data build'")
        parser.add_argument(
            "--text", default="default", help="weights whose text encoder is used (default: the shipped ones)"
        )
        parser.set_defaults(run=partial(_on_set, name))
    predictor = commands.add_parser("predictor", help="a model of what people do next, on recordings as they are")
    _run_options(predictor, "predictor.toml", "the mocap pack, a folder of motion files, AMASS, data_3d_h36m.npz ...")
    predictor.add_argument("--protocol", help="cmu, h36m, humaneva, amass or own (default: recognised)")
    predictor.set_defaults(run=_predictor)
    duet = commands.add_parser("duet", help="a block that makes two people out of a prior, from a few pairs")
    pairs = "a folder of NAME_a.bvh, NAME_b.bvh and captions.txt, the mocap pack, or 3DPW"
    _run_options(duet, "duet.toml", pairs, name="--pairs")
    duet.set_defaults(run=_duet)


def _run_options(parser: argparse.ArgumentParser, recipe: str, data: str, *, name: str = "--data") -> None:
    parser.add_argument("--recipe", type=Path, required=True, help=f"a TOML file such as recipes/{recipe}")
    parser.add_argument(name, type=Path, required=True, help=data)
    parser.add_argument("--out", type=Path, required=True, help="folder of the run: state, weights, logs, pictures")
    parser.add_argument("--device", help="cpu, cuda, cuda:1 ... (default: cuda where there is one)")
    parser.add_argument("--threads", type=int, help="CPU threads")
    parser.add_argument("--stop", type=int, help="end early after this many steps")
    parser.add_argument(
        "--set", nargs="+", default=[], metavar="KEY=VALUE", help="replace entries of the recipe (TOML values)"
    )


def _on_set(name: str, arguments: argparse.Namespace) -> None:
    from motionloom_train.prior import text_encoder

    run = _training(arguments)
    module, function = ON_SETS[name][2].split(":")
    train = getattr(import_module(module), function)
    print(f"wrote {train(run, arguments.data, text_encoder(arguments.text))}")


def _predictor(arguments: argparse.Namespace) -> None:
    from motionloom_train.predictor import train_predictor

    run = _training(arguments)
    benchmarks = import_module(f"{LABORATORY}.papers.benchmarks")
    protocol = benchmarks.find_protocol(arguments.data, name=arguments.protocol, splits=("train", "val"), say=print)
    print(f"wrote {train_predictor(run, protocol)}")


def _duet(arguments: argparse.Namespace) -> None:
    from motionloom_train.pair import Settings, train_pair

    run = _training(arguments)
    settings = Settings.parse(run.recipe.pair)
    readers = import_module(f"{LABORATORY}.papers.readers")
    pairs = readers.find_pairs(arguments.pairs, captions=settings.prefix + settings.react < 1, say=print)
    print(f"wrote {train_pair(run, pairs)}")


def _training(arguments: argparse.Namespace) -> "Training":
    """The run of the recipe with its changes; checks and applies what is said about it."""
    from motionloom_train.loop import Training
    from motionloom_train.recipe import changes, load_recipe
    from motionloom_train.threads import set_threads

    for option in ("threads", "stop"):
        if getattr(arguments, option) is not None and getattr(arguments, option) < 1:
            raise MotionloomError(f"--{option} must be 1 or more; got {getattr(arguments, option)}")
    if arguments.threads:
        set_threads(arguments.threads)
    recipe = load_recipe(arguments.recipe, changes(arguments.set))
    return Training(recipe, arguments.out, arguments.device, arguments.stop)
