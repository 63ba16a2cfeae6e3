"""`motionloom train`: models from recipes."""

import argparse
from pathlib import Path


def add(subparsers) -> None:
    """Register `train prior`."""
    train = subparsers.add_parser("train", help="train a model from a recipe; goes on where it was stopped")
    commands = train.add_subparsers(metavar="MODEL", required=True)
    prior = commands.add_parser("prior", help="a text-to-motion prior on a built set")
    prior.add_argument("--recipe", type=Path, required=True, help="a TOML file such as recipes/default.toml")
    prior.add_argument("--data", type=Path, required=True, help="folder made by 'motionloom data build'")
    prior.add_argument("--out", type=Path, required=True, help="folder of the run: state, weights, logs, pictures")
    prior.add_argument(
        "--text", default="default", help="weights whose text encoder is used (default: the shipped ones)"
    )
    prior.add_argument("--device", help="cpu, cuda, cuda:1 ... (default: cuda where there is one)")
    prior.add_argument("--threads", type=int, help="CPU threads")
    prior.add_argument("--stop", type=int, help="end early after this many steps")
    prior.add_argument(
        "--set", nargs="+", default=[], metavar="KEY=VALUE", help="replace entries of the recipe (TOML values)"
    )
    prior.set_defaults(run=_prior)


def _prior(arguments: argparse.Namespace) -> None:
    import torch

    from motionloom.errors import MotionloomError
    from motionloom.train.prior import text_encoder, train_prior
    from motionloom.train.recipe import changes, load_recipe

    for option in ("threads", "stop"):
        if getattr(arguments, option) is not None and getattr(arguments, option) < 1:
            raise MotionloomError(f"--{option} must be 1 or more; got {getattr(arguments, option)}")
    if arguments.threads:
        torch.set_num_threads(arguments.threads)
    recipe = load_recipe(arguments.recipe, changes(arguments.set))
    place = train_prior(
        recipe, arguments.data, arguments.out,
        text=text_encoder(arguments.text), device=arguments.device, stop=arguments.stop,
    )  # fmt: skip
    print(f"wrote {place}")
