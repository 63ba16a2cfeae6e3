"""`motionloom train`: models from recipes."""

import argparse
from importlib import import_module
from typing import TYPE_CHECKING

from motionloom.cli.tables import add_family
from motionloom.core.errors import MotionloomError

if TYPE_CHECKING:
    from motionloom_train.loop import Training

LABORATORY = "motionloom_lab"
"""Reads the data sets and protocols that others published; opened where one is needed."""


def add(subparsers) -> None:
    """Register `train prior`, `train evaluator`, `train control`, `train predictor` and `train duet`."""
    add_family(subparsers, __name__)


def train_on_set(arguments: argparse.Namespace) -> None:
    """``motionloom train prior``, ``evaluator`` and ``control``."""
    from motionloom_train.prior import text_encoder

    run = _training(arguments)
    module, function = arguments.trained_by.split(":")
    train = getattr(import_module(module), function)
    print(f"wrote {train(run, arguments.data, text_encoder(arguments.text))}")


def train_on_recordings(arguments: argparse.Namespace) -> None:
    """``motionloom train predictor``."""
    from motionloom_train.predictor import train_predictor

    run = _training(arguments)
    benchmarks = import_module(f"{LABORATORY}.papers.benchmarks")
    protocol = benchmarks.find_protocol(arguments.data, name=arguments.protocol, splits=("train", "val"), say=print)
    print(f"wrote {train_predictor(run, protocol)}")


def train_on_pairs(arguments: argparse.Namespace) -> None:
    """``motionloom train duet``."""
    from motionloom_train.pair import Settings, train_pair

    run = _training(arguments)
    settings = Settings.parse(run.recipe.pair)
    readers = import_module(f"{LABORATORY}.papers.readers")
    pairs = readers.find_pairs(arguments.pairs, captions=settings.prefix + settings.react < 1, say=print)
    print(f"wrote {train_pair(run, pairs)}")


def _training(arguments: argparse.Namespace) -> "Training":
    """The run of the recipe with its changes; checks and applies its options."""
    from motionloom_train.loop import Training
    from motionloom_train.recipe import changes, load_recipe
    from motionloom_train.tensors import set_threads

    for option in ("threads", "stop"):
        if getattr(arguments, option) is not None and getattr(arguments, option) < 1:
            raise MotionloomError(f"--{option} must be 1 or more; got {getattr(arguments, option)}")
    if arguments.threads:
        set_threads(arguments.threads)
    recipe = load_recipe(arguments.recipe, changes(arguments.set))
    return Training(recipe, arguments.out, arguments.device, arguments.stop)
