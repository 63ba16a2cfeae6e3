"""Readers of what others published: evaluators, checkpoints, word vectors."""

import json
from collections.abc import Callable
from functools import cache
from pathlib import Path
from typing import Any

import numpy as np
import torch

from tests.fuzz.reader import reader


@cache
def tiny_embedder() -> Any:
    from tests_lab.evaluator.test_net import embedder

    return embedder()


def evaluator(folder: Path) -> None:
    from motionloom_lab.evaluator.net import save_embedder

    save_embedder(tiny_embedder(), folder / "a.safetensors")


def read_evaluator(folder: Path) -> object:
    from motionloom_lab.evaluator.net import load_embedder

    return load_embedder(folder / "a.safetensors", tiny_embedder().text)


def mrt(folder: Path) -> None:
    from motionloom_lab.papers.mrt import MrtFile
    from tests_lab.papers.test_mrt import net_of

    MrtFile(net_of(), "free", "none", {"a": 1}).save(folder / "a.safetensors")


def read_mrt(folder: Path) -> object:
    from motionloom_lab.papers.mrt import MrtFile

    return MrtFile.load(folder / "a.safetensors")


def published(folder: Path) -> None:
    from tests_lab.papers.test_mdm import state as weights

    options = {"noise_schedule": "cosine", "diffusion_steps": 50, "arch": "trans_enc", "layers": 2, "latent_dim": 32}
    torch.save({"model": weights(), "iteration": 3}, folder / "model.pt")
    torch.save(weights(), folder / "old.pt", _use_new_zipfile_serialization=False)
    (folder / "args.json").write_text(json.dumps(options))


def read_checkpoint(name: str) -> Callable[[Path], object]:
    def read(folder: Path) -> object:
        from motionloom_lab.papers.published_priors import import_published

        return import_published(folder / name, mean=np.zeros(263), std=np.ones(263))

    return read


def humanmac(folder: Path) -> None:
    from motionloom.core.models.networks.predictor import PredictorConfig
    from motionloom_train.nets.predictor import TransLinear

    net = TransLinear(PredictorConfig(channels=48, kept=20, layers=2, width=16, heads=2))
    torch.save(net.state_dict(), folder / "a.pt")


def read_humanmac(folder: Path) -> object:
    from motionloom_lab.papers.published_priors import import_humanmac

    return import_humanmac(folder / "a.pt")


def guo(folder: Path) -> None:
    from tests_lab.papers.test_guo_nets import checkpoint

    torch.save(checkpoint(), folder / "finest.tar")


def read_guo(folder: Path) -> object:
    from motionloom_lab.papers.guo_nets import from_state_dict, read_guo

    return from_state_dict(read_guo(folder / "finest.tar"))


def hub(folder: Path) -> None:
    torch.save({"a.weight": torch.arange(6.0), "b": torch.ones(2, 2).half()}, folder / "pytorch_model.bin")


def read_hub(folder: Path) -> object:
    from motionloom_lab.papers.text_model import convert

    return convert(folder)


def words(folder: Path) -> None:
    from tests_lab.papers.test_guo_words import published as make

    make(folder)
    (folder / "glove.txt").write_text("walk 0.1 0.2 0.3\nunk 0 0 1\nsos 1 0 0\neos 0 1 0\n")
    (folder / "special.json").write_text(json.dumps({"Loc_VIP": ["left"], "Act_VIP": ["wave", "run"]}))


def read_words(folder: Path) -> object:
    from motionloom_lab.papers.guo_words import read_words

    return read_words(folder, lists=folder / "word_vectorizer.py"), read_words(folder, lists=folder / "special.json")


def read_glove(folder: Path) -> object:
    from motionloom_lab.papers.guo_words import read_words

    return read_words(folder / "glove.txt")


reader("evaluator", evaluator, {"a.safetensors": "safetensors"}, read_evaluator, weight=3)
reader("multi-range transformer", mrt, {"a.safetensors": "safetensors"}, read_mrt, weight=3)
reader(
    "published checkpoint", published, {"model.pt": "torch", "args.json": "json"}, read_checkpoint("model.pt"), weight=6
)
reader("old checkpoint", published, {"old.pt": "old torch"}, read_checkpoint("old.pt"), weight=6)
reader("humanmac", humanmac, {"a.pt": "torch"}, read_humanmac, weight=3)
reader("guo's evaluators", guo, {"finest.tar": "torch"}, read_guo, weight=3)
reader("text model", hub, {"pytorch_model.bin": "torch"}, read_hub, weight=6)
reader(
    "guo's words",
    words,
    {
        "our_vab_data.npy": "npy",
        "our_vab_words.pkl": "pickle",
        "our_vab_idx.pkl": "pickle",
        "word_vectorizer.py": "text",
        "special.json": "json",
    },
    read_words,
)
reader("glove", words, {"glove.txt": "text"}, read_glove)
