"""Networks as ONNX graphs without weights; `motionloom.core.models.networks` runs them with those of their file.

A graph is what a module does, traced: its initialisers have the names that the weights have in a weight file, and hold
nothing. What depends on the condition alone is left to the runtime, which computes it once; what is in the loop is
in the graph.
"""

import warnings
from collections.abc import Callable, Iterator, Mapping, Sequence
from contextlib import contextmanager
from functools import lru_cache
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import Any

import onnx
import torch
from torch import Tensor, nn
from torch.onnx import symbolic_helper
from torch.onnx.utils import register_custom_op_symbolic, unregister_custom_op_symbolic  # type: ignore[attr-defined]

from motionloom.core.diffusion import SCHEDULES
from motionloom.core.models.networks.graph import LOCATION
from motionloom.core.models.networks.pair import PairConfig
from motionloom.core.models.networks.predictor import PredictorConfig
from motionloom.core.models.networks.sizes import NetConfig
from motionloom.core.models.networks.text.minilm import HEAD_WIDTH
from motionloom_train.nets.pair import PairNet, Talk
from motionloom_train.nets.predictor import TransLinear
from motionloom_train.nets.prior import Bound, Inner, PriorNet, condition
from motionloom_train.nets.text.bert import Bert

OPSET = 20
SMALL = 65536
"""Bytes of a constant that a graph may contain."""


class PriorGraph(nn.Module):
    """A prior's network, from and to tokens (rows, tokens, patch * features)."""

    inputs: Mapping[str, Mapping[int, str]] = {
        "state": {0: "rows", 1: "tokens"},
        "shown": {0: "rows", 1: "tokens"},
        "level": {0: "rows"},
        "text": {0: "rows"},
        "keys": {0: "rows", 3: "words"},
        "values": {0: "rows", 3: "words"},
        "words": {0: "rows", 1: "words"},
        "valid": {0: "rows", 1: "tokens"},
    }
    outputs: Mapping[str, Mapping[int, str]] = {"clean": {0: "rows", 1: "tokens"}}

    def __init__(self, net: PriorNet) -> None:
        super().__init__()
        self.net = net

    def forward(self, *tensors: Tensor) -> Tensor:
        """See `motionloom.core.models.networks.prior.PriorSession` for the arguments, which are `inputs` in order."""
        return self.net.end(self.net.through(*self.begin(self.net, *tensors)))

    @staticmethod
    def begin(net: PriorNet, *tensors: Tensor) -> tuple[Inner, Bound]:
        """What the first block sees, and what the blocks attend to, of the eight `inputs`."""
        state, control, level, text, keys, values, words, valid = tensors
        nothing = text.new_zeros(0)
        bound = Bound(text, keys, values, words[:, None, None], nothing, nothing)
        return net.begin(net.embed(state) + control, level, text, token_mask(net, valid)), bound

    def example(self) -> tuple[Tensor, ...]:
        """Arguments of the right kinds; every axis that may vary has a length of its own."""
        config = self.net.config
        rows, tokens, words = 2, 5, 3
        heads = (config.heads, words, config.width // config.heads)
        bound = torch.zeros(rows, config.layers, *heads)
        return (
            torch.zeros(rows, tokens, self.net.embed.in_features),
            torch.zeros(rows, tokens, config.width),
            torch.full((rows,), 7),
            torch.zeros(rows, config.width),
            bound,
            bound,
            torch.ones(rows, words, dtype=torch.bool),
            torch.ones(rows, tokens, dtype=torch.bool),
        )


class BindGraph(nn.Module):
    """What a prior's network computes from a condition alone."""

    def __init__(self, net: PriorNet) -> None:
        super().__init__()
        self.net = net
        names = ("pooled", "tokens") if net.modulated else ("pooled",)
        self.inputs: Mapping[str, Mapping[int, str]] = {
            name: {0: "rows", 1: "words"} if name == "tokens" else {0: "rows"} for name in names
        }
        both = {"keys": {0: "rows", 3: "words"}, "values": {0: "rows", 3: "words"}}
        self.outputs: Mapping[str, Mapping[int, str]] = {"text": {0: "rows"}, **(both if net.modulated else {})}

    def forward(self, pooled: Tensor, tokens: Tensor | None = None) -> Tensor | tuple[Tensor, ...]:
        """See `PriorNet.bind`."""
        if tokens is None:
            return self.net.text(pooled)
        words = pooled.new_ones(tokens.shape[:2])
        bound = self.net.bind(condition(pooled, tokens=tokens, words=words))
        return bound.text, bound.keys, bound.values

    def example(self) -> tuple[Tensor, ...]:
        """Arguments of the right kinds."""
        rows, words, width = 2, 3, self.net.config.text
        both = torch.zeros(rows, width), torch.zeros(rows, words, width)
        return both if self.net.modulated else both[:1]


class PairGraph(nn.Module):
    """Two people: a prior's network and a communication block."""

    inputs: Mapping[str, Mapping[int, str]] = {
        **PriorGraph.inputs,
        "frames": {0: "rows", 1: "frames"},
        "places": {0: "rows"},
        "signal": {0: "rows"},
    }
    outputs: Mapping[str, Mapping[int, str]] = {**PriorGraph.outputs, "place": {0: "rows"}}

    def __init__(self, pair: PairNet) -> None:
        super().__init__()
        base, mean, std, _ = pair._base
        self.net, self.talk, self.pair = base, pair.talk, (pair,)
        self.register_buffer("mean", mean)
        self.register_buffer("std", std)

    def forward(self, *tensors: Tensor) -> tuple[Tensor, Tensor]:
        """See `motionloom.core.models.networks.pair.PairSession` for the arguments, which are `inputs` in order."""
        *one, frames, places, signal = tensors
        inner, bound = PriorGraph.begin(self.net, *one)
        inner, place = self.pair[0].spoken(inner, bound, places, signal, frames, frames.shape[1])
        return self.net.end(inner), place

    def example(self) -> tuple[Tensor, ...]:
        """Arguments of the right kinds."""
        state, *rest = PriorGraph(self.net).example()
        rows, tokens, _ = state.shape
        frames = torch.ones(rows, tokens * self.net.config.patch, dtype=torch.bool)
        return state, *rest, frames, torch.zeros(rows, 4), torch.full((rows,), 0.5)


class PredictorGraph(nn.Module):
    """A predictor's network."""

    inputs: Mapping[str, Mapping[int, str]] = {name: {0: "rows"} for name in ("state", "level", "condition", "keep")}
    outputs: Mapping[str, Mapping[int, str]] = {"answer": {0: "rows"}}

    def __init__(self, net: TransLinear) -> None:
        super().__init__()
        self.net = net

    def forward(self, state: Tensor, level: Tensor, condition: Tensor, keep: Tensor) -> Tensor:
        """See `motionloom.core.models.networks.predictor.PredictorSession` for the arguments."""
        return self.net(state, level, condition, keep)

    def example(self) -> tuple[Tensor, ...]:
        """Arguments of the right kinds."""
        config, rows = self.net.config, 2
        return (
            torch.zeros(rows, config.kept, config.channels),
            torch.full((rows,), 7),
            torch.zeros(rows, *config.condition_shape),
            torch.ones(rows),
        )


class TextGraph(nn.Module):
    """A BERT from embedded word pieces to its last hidden states."""

    inputs: Mapping[str, Mapping[int, str]] = {name: {0: "rows", 1: "words"} for name in ("pieces", "mask")}
    outputs: Mapping[str, Mapping[int, str]] = {"states": {0: "rows", 1: "words"}}

    def __init__(self, net: Bert) -> None:
        super().__init__()
        self.text = net

    def forward(self, pieces: Tensor, mask: Tensor) -> Tensor:
        """See `motionloom.core.models.networks.text` for the arguments."""
        return self.text.layered(pieces, mask[:, None, None, :])

    def example(self) -> tuple[Tensor, ...]:
        """Arguments of the right kinds."""
        rows, words = 2, 3
        width = self.text.norm.weight.shape[0]
        return torch.zeros(rows, words, width), torch.ones(rows, words, dtype=torch.bool)


Exported = PriorGraph | BindGraph | PairGraph | PredictorGraph | TextGraph


def token_mask(net: PriorNet, valid: Tensor) -> Tensor:
    """(rows, 1, 1, tokens) from (rows, tokens), with the condition token where it is one."""
    if not net.modulated:
        valid = torch.cat([torch.ones_like(valid[:, :1]), valid], dim=1)
    return valid[:, None, None]


def graph_bytes(module: Exported, names: Callable[[str], str] = str) -> bytes:
    """The graph of a module, without weights.

    module: its weights are overwritten. names: from a name in the module to that in a weight file.
    """
    module = module.eval().requires_grad_(False)
    generator = torch.Generator().manual_seed(0)
    for value in module.state_dict().values():
        value.normal_(generator=generator)  # the exporter merges equal weights
    axes = {**module.inputs, **module.outputs}
    with TemporaryDirectory() as folder, torch.no_grad(), _symbolics(), warnings.catch_warnings():
        warnings.simplefilter("ignore")  # of what tracing may get wrong: that graphs equal modules is tested
        path = Path(folder) / "graph.onnx"
        torch.onnx.export(
            module,
            module.example(),
            path,
            dynamo=False,
            input_names=list(module.inputs),
            output_names=list(module.outputs),
            dynamic_axes={name: dict(dynamic) for name, dynamic in axes.items()},
            opset_version=OPSET,
            do_constant_folding=True,
        )
        model = onnx.load(path)
    model.producer_name = model.producer_version = ""
    weights = {name: names(name) for name in module.state_dict()}
    _empty(model.graph, weights)
    _shorten(model.graph, {*weights.values(), *axes})
    return model.SerializeToString(deterministic=True)


def _empty(graph: Any, weights: Mapping[str, str]) -> None:
    """Take the numbers out of the initialisers that are weights, and give these their names in a file."""
    for tensor in graph.initializer:
        if tensor.name in weights:
            tensor.name = weights[tensor.name]
            tensor.ClearField("raw_data")
            tensor.data_location = onnx.TensorProto.EXTERNAL
            tensor.external_data.add(key="location", value=LOCATION)
        elif tensor.ByteSize() > SMALL:
            raise ValueError(f"the graph holds {tensor.name}, {tensor.ByteSize()} bytes, which has no name")
    for node in graph.node:
        for place, name in enumerate(node.input):
            node.input[place] = weights.get(name, name)


def _shorten(graph: Any, public: set[str]) -> None:
    """Make equal constants one, and give short names to whatever is not public."""
    numbers: dict[bytes, str] = {}
    names = {name: name for name in (*public, "")}
    nodes = []
    for node in graph.node:
        if node.op_type == "Constant" and node.attribute[0].name == "value":
            value = node.attribute[0].t.SerializeToString(deterministic=True)
            if value not in numbers:
                numbers[value] = f"c{len(numbers)}"
                graph.initializer.add().CopyFrom(node.attribute[0].t)
                graph.initializer[-1].name = node.output[0]
            names[node.output[0]] = numbers[value]
            continue
        node.name = node.doc_string = ""
        node.ClearField("metadata_props")
        nodes.append(node)
    for tensor in graph.initializer:
        tensor.name = names.setdefault(tensor.name, f"v{len(names)}")
    for node in nodes:
        for values in (node.input, node.output):
            for place, name in enumerate(values):
                values[place] = names.setdefault(name, f"v{len(names)}")
    del graph.value_info[:]
    del graph.node[:]
    graph.node.extend(nodes)


# Graphs by the sizes of their networks


@lru_cache(maxsize=64)
def prior_graphs(config: NetConfig) -> Mapping[str, bytes]:
    """The graphs ``prior`` and ``bind`` of priors of these sizes."""
    net = PriorNet(config).eval()
    return {"prior": graph_bytes(PriorGraph(net)), "bind": graph_bytes(BindGraph(net))}


@lru_cache(maxsize=64)
def pair_graph(config: PairConfig, prior: NetConfig) -> bytes:
    """The graph of a communication block of these sizes in priors of those."""
    mean = torch.zeros(prior.features)
    pair = PairNet(PriorNet(prior), Talk(config, prior), SCHEDULES["cosine"](10), mean=mean, std=mean + 1)
    return graph_bytes(PairGraph(pair.eval()), lambda name: name.removeprefix("talk."))


@lru_cache(maxsize=64)
def predictor_graph(config: PredictorConfig) -> bytes:
    """The graph of predictors of these sizes."""
    return graph_bytes(PredictorGraph(TransLinear(config)))


@lru_cache(maxsize=64)
def text_graph(width: int, hidden: int, layers: int) -> bytes:
    """The graph of a `MiniLM` of these sizes."""
    heads = width // HEAD_WIDTH
    net = Bert(vocabulary=1, places=1, width=width, heads=heads, hidden=hidden, layers=layers)
    return graph_bytes(TextGraph(net))


# How some functions are written, where the exporter's own way is slower


@contextmanager
def _symbolics() -> Iterator[None]:
    ways = {"aten::linear": _linear, "aten::scaled_dot_product_attention": _attention}
    for name, way in ways.items():
        register_custom_op_symbolic(name, way, OPSET)
    try:
        yield
    finally:
        for name in ways:
            unregister_custom_op_symbolic(name, OPSET)


@symbolic_helper.parse_args("v", "v", "v")
def _linear(g: Any, x: Any, weight: Any, bias: Any) -> Any:
    """One matrix product with the bias in it and the weight as it lies in the file; of two axes and no more."""
    rank = symbolic_helper._get_tensor_rank(x)
    inner, outer = (symbolic_helper._get_tensor_dim_size(weight, axis) or 0 for axis in (1, 0))
    flat = x if rank == 2 else g.op("Reshape", x, _whole(g, [-1, inner]))
    added = [] if symbolic_helper._is_none(bias) else [bias]
    y = g.op("Gemm", flat, weight, *added, transB_i=1)
    if rank == 2:
        return y
    shape = g.op("Concat", g.op("Shape", x, end_i=-1), _whole(g, [outer]), axis_i=0)
    answer = g.op("Reshape", y, shape)
    if rank is not None:  # the next operations need the number of axes
        answer.setType(x.type().with_sizes([*[None] * (rank - 1), outer]))
    return answer


@symbolic_helper.parse_args("v", "v", "v", "v", "f", "b", "f", "b")
def _attention(
    g: Any,
    query: Any,
    key: Any,
    value: Any,
    mask: Any,
    dropout: float,
    causal: bool,
    scale: float,
    grouped: bool,
) -> Any:
    """softmax(scale q k' + mask) v; masked entries get a large negative number."""
    if dropout or causal or grouped:
        raise ValueError("only plain attention is exported")
    scaled = g.op("Mul", query, _number(g, scale))
    weights = g.op("MatMul", scaled, g.op("Transpose", key, perm_i=[0, 1, 3, 2]))
    if not symbolic_helper._is_none(mask):
        bias = g.op("Where", mask, _number(g, 0.0), _number(g, -1e30))
        weights = g.op("Add", weights, bias)
    return g.op("MatMul", g.op("Softmax", weights, axis_i=-1), value)


def _whole(g: Any, numbers: Sequence[int]) -> Any:
    return g.op("Constant", value_t=torch.tensor(numbers))


def _number(g: Any, number: float) -> Any:
    return g.op("Constant", value_t=torch.tensor(number))
