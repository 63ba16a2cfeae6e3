"""The tiny networks of `tests.recorded.tiny` as modules, and modules and sessions that only tests need."""

from motionloom.core.models.networks.pair import PairSession
from motionloom.core.models.networks.text.minilm import HEAD_WIDTH, WORDS, MiniLM, sizes_of, unpacked
from motionloom.core.models.networks.text.quantise import dequantise
from motionloom_train.export import pair_graph
from motionloom_train.modules import arrays, fill, prior_session
from motionloom_train.nets.pair import PairNet
from motionloom_train.nets.prior import NetConfig, PriorNet
from motionloom_train.nets.text.bert import Bert
from motionloom_train.nets.unfilled import unfilled
from tests.recorded import tiny


def tiny_net(config: NetConfig = tiny.MODULATED, seed: int = 0) -> PriorNet:
    """A prior's network whose every weight matters; of any sizes."""
    net = PriorNet(config)
    fill(net, tiny.weights(config, seed), "a tiny network")
    return net.eval().requires_grad_(False)


def pair_session(net: PairNet) -> PairSession:
    """A module as a session."""
    base, mean, std, _ = net._base
    config, prior = net.talk.config, prior_session(base)
    graph = pair_graph(config, prior.config)
    numbers = mean.cpu().numpy(), std.cpu().numpy()
    return PairSession(config, arrays(net.talk), graph, prior, net.schedule, *numbers)


def text_module(text: MiniLM) -> Bert:
    """The embedded text encoder's network as a module."""
    tensors = text.to_tensors()
    weights = unpacked(tensors)
    sizes = sizes_of(weights)
    weights[WORDS] = dequantise(tensors[WORDS], tensors[f"{WORDS}.scale"])
    heads = sizes["width"] // HEAD_WIDTH
    with unfilled():
        module = Bert(vocabulary=len(text.vocabulary), heads=heads, **sizes)
    fill(module, weights, "the text encoder")
    return module.eval().requires_grad_(False)
