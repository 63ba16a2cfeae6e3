"""Networks of weight files as PyTorch modules, which training goes on with, and modules as what a weight file holds."""

from collections.abc import Mapping
from typing import Any

import numpy as np
import torch
from torch import Tensor, nn

from motionloom.core.models.adapter import NET
from motionloom.core.models.container import check
from motionloom.core.models.networks.predictor import PredictorSession
from motionloom.core.models.networks.prior import PriorSession
from motionloom.core.models.networks.text.minilm import MiniLM, sizes_of, unpacked
from motionloom.core.models.pair import PairBlock
from motionloom.core.models.predictor import Predictor
from motionloom.core.models.prior import Prior
from motionloom_train.export import predictor_graph, prior_graphs, text_graph
from motionloom_train.nets.pair import PairNet, Talk
from motionloom_train.nets.predictor import TransLinear
from motionloom_train.nets.prior import PriorNet
from motionloom_train.nets.unfilled import unfilled


def prior_module(prior: Prior) -> PriorNet:
    """A prior's network as a module in evaluation mode, without gradients; float32."""
    return _module(PriorNet, prior.net, "the prior")


def prior_session(net: PriorNet) -> PriorSession:
    """A module as what a weight file holds: its weights in float32, and its graphs."""
    weights = {NET + key: value for key, value in arrays(net).items()}
    return PriorSession(net.config, weights, prior_graphs(net.config))


def pair_module(block: PairBlock, prior: Prior) -> PairNet:
    """The network of two people as a module in evaluation mode, without gradients."""
    talk = Talk(block.config, prior.net.config)
    fill(talk, block.tensors, "the block")
    mean, std = torch.from_numpy(prior.mean), torch.from_numpy(prior.std)
    net = PairNet(prior_module(prior), talk, prior.schedule, mean=mean, std=std)
    return net.eval().requires_grad_(False)


def predictor_module(predictor: Predictor) -> TransLinear:
    """A predictor's network as a module in evaluation mode, without gradients."""
    return _module(TransLinear, predictor.net, "the predictor")


def predictor_session(net: TransLinear) -> PredictorSession:
    """A module as what a weight file holds."""
    weights = {NET + key: value for key, value in arrays(net).items()}
    return PredictorSession(net.config, weights, predictor_graph(net.config))


def _module(kind: Any, session: PriorSession | PredictorSession, what: str) -> Any:
    with unfilled():
        module = kind(session.config)
    fill(module, {key.removeprefix(NET): value for key, value in session.weights.items()}, what)
    return module.eval().requires_grad_(False)


def text_encoder(tensors: Mapping[str, np.ndarray]) -> MiniLM:
    """The embedded text encoder from its packed tensors (`runtime.text.minilm.pack`)."""
    sizes = sizes_of(unpacked(tensors))
    return MiniLM.from_tensors(tensors, text_graph(sizes["width"], sizes["hidden"], sizes["layers"]))


def arrays(net: nn.Module) -> dict[str, np.ndarray]:
    """A module's state as float32 arrays of their own."""
    return {key: value.detach().cpu().float().numpy().copy() for key, value in net.state_dict().items()}


def shapes(net: nn.Module) -> dict[str, tuple[int, ...]]:
    """Names and shapes of a network's weights; it may be on the device ``meta`` and hold no memory."""
    return {key: tuple(value.shape) for key, value in net.state_dict().items()}


def fill(net: nn.Module, weights: Mapping[str, "np.ndarray | Tensor"], what: str) -> None:
    """Fill a network with weights after `check`; one on the device ``meta`` takes the tensors themselves.

    what: how the sentence of an error calls the weights, such as a path.
    """
    plain = {key: value.numpy() if isinstance(value, Tensor) else value for key, value in weights.items()}
    check(plain, shapes(net), what)
    tensors = {key: torch.from_numpy(value.astype(np.float32)) for key, value in plain.items()}
    net.load_state_dict(tensors, assign=next(net.parameters(), torch.empty(0)).is_meta)
