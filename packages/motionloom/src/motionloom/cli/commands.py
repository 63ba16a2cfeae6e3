"""Which commands there are: those of this package, and how those of others are found."""

import argparse
from collections.abc import Callable, Iterator
from dataclasses import dataclass
from importlib import import_module
from importlib.util import find_spec

Commands = argparse._SubParsersAction
Add = Callable[[Commands], None]

FAMILIES = {
    "generate": ("generate",),
    "compose": ("compose",),
    "live": ("live",),
    "control": ("control",),
    "edit": ("edit",),
    "predict": ("predict", "switch"),
    "duet": ("duet",),
    "batch": ("batch",),
    "serve": ("serve", "studio", "mcp"),
    "files": ("export", "view", "info"),
    "robots": ("robot-check",),
    "weights": ("weights",),
    "completion": ("completion",),
}
"""Modules beside this one, and the commands that each registers; one that is run imports no other."""
GROUP = "motionloom.commands"
"""Entry points by which an installed package adds a command: its name, and the function that registers it."""


@dataclass(frozen=True)
class Other:
    """A command that another package of ours brings."""

    help: str
    """Its line in `--help`, which is printed without looking for the package."""
    module: str
    """The module that registers it."""


OTHERS = {
    "data": Other("turn recordings into a training set", "motionloom_train.cli.data"),
    "teach": Other("teach the shipped weights an action or a style from a few clips", "motionloom_train.cli.teach"),
    "train": Other("train a model from a recipe; continues an interrupted run", "motionloom_train.cli.train"),
    "evaluate": Other(
        "measure weights: obedience, realism, text metrics; compare runs",
        "motionloom_lab.cli.evaluate",
    ),
    "bench": Other("measure speed and memory on this machine", "motionloom_lab.cli.bench"),
    "import": Other(
        "published weights to a file: an MDM, PriorMDM or HumanMAC network, or Guo's evaluator",
        "motionloom_lab.cli.imports",
    ),
}
BROUGHT_BY = {
    "torch": "packages/motionloom-train",
    "onnx": "packages/motionloom-train",
    "motionloom_train": "packages/motionloom-train",
    "matplotlib": "packages/motionloom-lab",
    **dict.fromkeys(("mujoco", "mink", "qpsolvers", "daqp"), "motionloom[robots]"),
    "motionloom_lab": "packages/motionloom-lab",
}
"""What this package does without, and what installs each."""


def add_commands(commands: Commands, command: str | None) -> None:
    """Register no more than is needed to know ``command``; where nothing here knows it, all names there are.

    None, or ``completion`` which lists options: all of all, with those of other packages where these are installed.
    Raises ModuleNotFoundError where ``command`` belongs to a package that is not.
    """
    if command in OTHERS:
        _registered(command)(commands)
        return
    owner = next((family for family, names in FAMILIES.items() if command in names), None)
    for family in FAMILIES if owner in (None, "completion") else [owner]:
        import_module(f"motionloom.cli.{family}").add(commands)
    if owner not in (None, "completion"):
        return
    for name, other in OTHERS.items():
        if command in (None, "completion") and find_spec(other.module.partition(".")[0]):
            _registered(name)(commands)
        else:
            commands.add_parser(name, help=other.help, add_help=False)
    if command is not None and command not in commands.choices and not command.startswith("-"):
        for add in _installed(command):
            add(commands)


def _registered(name: str) -> Add:
    return next(_installed(name), None) or import_module(OTHERS[name].module).add


def _installed(name: str) -> Iterator[Add]:
    """What registers a command, as the entry points of installed packages say."""
    from importlib.metadata import entry_points

    for found in entry_points(group=GROUP, name=name):
        yield found.load()


def absence(error: ModuleNotFoundError) -> str | None:
    """What to install for a module that a command needs; None for one that should have been there."""
    for name, package in BROUGHT_BY.items():
        if f"{error.name}.".startswith(f"{name}."):
            return (
                f"this command needs {name}, which is not installed; pip install '{package}', or 'make dev' in a "
                "clone, brings it"
            )
    return None
