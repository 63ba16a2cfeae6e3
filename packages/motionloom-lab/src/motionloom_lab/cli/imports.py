"""`motionloom import`: published checkpoints as weight files of ours."""

import argparse
import sys
from pathlib import Path
from typing import TYPE_CHECKING

from motionloom.cli.tables import add_family
from motionloom.cli.writing import check_overwriting
from motionloom.core.errors import MotionloomError

if TYPE_CHECKING:
    import numpy as np

    from motionloom.core.models.pair import PairBlock
    from motionloom.core.models.prior import Prior


def add(subparsers) -> None:
    """Register `import`."""
    add_family(subparsers, __name__)


def run_import(arguments: argparse.Namespace) -> None:
    """``motionloom import CHECKPOINT``."""
    from motionloom.core.files.atomic import check_place
    from motionloom.core.models.prior import save_prior
    from motionloom_lab.papers.mdm import is_pair, read_published
    from motionloom_lab.papers.published_priors import import_published, is_humanmac

    if arguments.out.suffix != ".safetensors":
        raise MotionloomError(f"weights are written as .safetensors; {arguments.out.name} has another suffix")
    check_place(arguments.out)
    check_overwriting(arguments, [arguments.out])
    if not arguments.checkpoint.is_file():
        raise MotionloomError(f"there is no checkpoint {arguments.checkpoint}")
    if arguments.checkpoint.suffix == ".tar":
        _import_evaluator(arguments)
        return
    if arguments.glove or arguments.vip:
        raise MotionloomError("--glove and --vip belong to an evaluator, which is published as finest.tar")
    state = read_published(arguments.checkpoint).state
    if is_humanmac(state):
        _import_predictor(arguments)
        return
    if arguments.mean is None or arguments.std is None:
        raise MotionloomError(
            "the weights work on standardised features and do not hold the statistics: "
            "add --mean Mean.npy --std Std.npy of the data set they were trained on"
        )
    second = check_place(arguments.out.with_name(f"{arguments.out.stem}-pair.safetensors")) if is_pair(state) else None
    prior = import_published(
        arguments.checkpoint,
        mean=_numbers(arguments.mean),
        std=_numbers(arguments.std),
        name=arguments.name,
        licence=arguments.licence,
        warn=lambda line: print(f"motionloom: {line}", file=sys.stderr),
    )
    block = None if second is None else _imported_block(arguments, prior)
    print(f"wrote {save_prior(prior, arguments.out, half=arguments.half)}")
    if block is not None and second is not None:
        print(f"wrote {block.save(second, half=arguments.half)}, what makes two people of it")


def _imported_block(arguments: argparse.Namespace, prior: "Prior") -> "PairBlock":
    from motionloom_lab.papers.published_priors import import_block

    base = prior.card.name
    return import_block(arguments.checkpoint, prior, base=base, name=f"{base}-pair", licence=arguments.licence)


def _import_predictor(arguments: argparse.Namespace) -> None:
    from motionloom.core.models.predictor import save_predictor
    from motionloom_lab.papers.published_priors import import_humanmac

    if arguments.mean or arguments.std:
        raise MotionloomError("HumanMAC works on metres as they are: no --mean and no --std")
    predictor = import_humanmac(arguments.checkpoint, name=arguments.name, licence=arguments.licence)
    print(f"wrote {save_predictor(predictor, arguments.out, half=arguments.half)}")


def _import_evaluator(arguments: argparse.Namespace) -> None:
    from motionloom_lab.papers.guo import read_published, save_guo

    if arguments.half:
        raise MotionloomError("an evaluator is kept as float32, so that its numbers are the published ones: no --half")
    card = {"name": arguments.name, "licence": arguments.licence}
    evaluator = read_published(
        arguments.checkpoint,
        mean=arguments.mean,
        std=arguments.std,
        glove=arguments.glove,
        lists=arguments.vip,
        card={key: value for key, value in card.items() if value},
    )
    print(f"wrote {save_guo(evaluator, arguments.out)}")
    for key, value in evaluator.about.items():
        print(f"  {key:<14} {value}")


def _numbers(path: Path) -> "np.ndarray":
    """A small .npy array of numbers, without pickle."""
    from motionloom.io.npz import read_array

    if not path.is_file():
        raise MotionloomError(f"there is no file {path}; name the Mean.npy and Std.npy published with the data set")
    return read_array(path, max_bytes=1 << 20)
