"""Readers of weights that commands run."""

from functools import cache
from pathlib import Path
from typing import Any

from tests.fuzz.reader import reader

# Weights -------------------------------------------------------------------------------------------------------------


@cache
def tiny_prior() -> Any:
    from tests.recorded import tiny

    return tiny.prior()


def prior(folder: Path) -> None:
    from motionloom.core.models.prior import save_prior

    save_prior(tiny_prior(), folder / "a.safetensors")


def read_prior(folder: Path) -> object:
    from motionloom.core.models.prior import Prior

    made = Prior.load(folder / "a.safetensors")
    return made.text.encode(["a person walks"])


def adapter(folder: Path) -> None:
    from tests.recorded import tiny

    tiny.adapter(tiny_prior(), control="any", given_rank=3).save(folder / "a.safetensors")


def read_adapter(folder: Path) -> object:
    from motionloom.core.models.adapter import Adapter

    return Adapter.load(folder / "a.safetensors", tiny_prior())


def block(folder: Path) -> None:
    from tests.tasks.two_people import block

    block(tiny_prior()).save(folder / "a.safetensors")


def read_block(folder: Path) -> object:
    from motionloom.core.models.pair import PairBlock

    return PairBlock.load(folder / "a.safetensors", tiny_prior())


def predictor(folder: Path) -> None:
    from motionloom.core.models.predictor import save_predictor
    from tests.recorded import tiny_predictor

    save_predictor(tiny_predictor.predictor(), folder / "a.safetensors")


def read_predictor(folder: Path) -> object:
    from motionloom.core.models.predictor import load_predictor

    return load_predictor(folder / "a.safetensors")


reader("prior", prior, {"a.safetensors": "safetensors"}, read_prior, weight=3)
reader("adapter", adapter, {"a.safetensors": "safetensors"}, read_adapter, weight=6)
reader("block of two people", block, {"a.safetensors": "safetensors"}, read_block, weight=6)
reader("predictor", predictor, {"a.safetensors": "safetensors"}, read_predictor, weight=3)
