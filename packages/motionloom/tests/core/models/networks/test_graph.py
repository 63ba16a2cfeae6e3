"""Graphs that anybody may have made: what is no graph, or would do more than compute, is refused in one sentence."""

from collections.abc import Callable
from contextlib import suppress

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from motionloom.core.errors import MotionloomError
from motionloom.core.models.networks.graph import outline
from motionloom.core.models.networks.session import Session, check_graph

onnx = pytest.importorskip("onnx", reason="the training package is not installed")
WEIGHTS = {"w": np.array([[1.0, 2.0], [3.0, 5.0]], np.float32)}


def model(change: Callable[..., object] = lambda model: None) -> bytes:
    """x w, two numbers in and two out, with w in the weight file; changed."""
    helper, kind = onnx.helper, onnx.TensorProto.FLOAT
    weight = onnx.TensorProto(name="w", data_type=kind, dims=[2, 2], data_location=onnx.TensorProto.EXTERNAL)
    weight.external_data.add(key="location", value="weights")
    sides = [helper.make_tensor_value_info(name, kind, ["rows", 2]) for name in "xy"]
    node = helper.make_node("MatMul", ["x", "w"], ["y"])
    graph = helper.make_graph([node], "graph", sides[:1], sides[1:], [weight])
    made = helper.make_model(graph, opset_imports=[helper.make_opsetid("", 20)], ir_version=10)
    change(made)
    return made.SerializeToString()


def run(graph: bytes, weights: dict[str, np.ndarray] = WEIGHTS) -> np.ndarray:
    return Session(graph, lambda: weights).run({"x": np.array([[1, 10]], np.float32)})[0]


def test_a_graph_runs_with_the_weights_of_its_file() -> None:
    assert run(model()).tolist() == [[31.0, 52.0]]  # by hand: 1 + 30 and 2 + 50
    names = outline(model())
    assert (names.inputs, names.outputs, names.weights) == (("x",), ("y",), {"w": (2, 2)})


def node(made: "onnx.ModelProto", kind: str, **more: object) -> "onnx.NodeProto":
    made.graph.node.append(onnx.helper.make_node(kind, ["x"], [f"z{len(made.graph.node)}"], **more))
    return made.graph.node[-1]


def constant(made: "onnx.ModelProto", values: list[int]) -> None:
    tensor = onnx.numpy_helper.from_array(np.array(values, np.int64), "shape")
    made.graph.initializer.append(tensor)


def branch(made: "onnx.ModelProto") -> None:
    inner = onnx.helper.make_graph([], "inner", [], [])
    node(made, "If", then_branch=inner, else_branch=inner)


HOSTILE: dict[str, Callable[..., object]] = {
    "a file elsewhere": lambda m: setattr(m.graph.initializer[0].external_data[0], "value", "/etc/passwd"),
    "a file above": lambda m: setattr(m.graph.initializer[0].external_data[0], "value", "../weights"),
    "a place in a file": lambda m: m.graph.initializer[0].external_data.add(key="offset", value="8"),
    "a constant elsewhere": lambda m: node(m, "Constant", value=m.graph.initializer[0]),
    "a domain": lambda m: m.opset_import.add(domain="com.acme", version=1),
    "a domain of ONNX Runtime": lambda m: m.opset_import.add(domain="com.microsoft", version=1),
    "a custom operator": lambda m: node(m, "MatMul", domain="com.acme"),
    "a compiled graph": lambda m: node(m, "EPContext", domain="com.microsoft"),
    "an operator unknown here": lambda m: node(m, "Scan"),
    "a loop": lambda m: node(m, "Loop"),
    "a branch": branch,
    "a function": lambda m: m.functions.add(name="f", domain="x"),
    "training": lambda m: m.training_info.add(),
    "a sparse weight": lambda m: m.graph.sparse_initializer.add(),
    "a giant constant": lambda m: constant(m, [1 << 40]),
    "a giant product": lambda m: constant(m, [60_000, 60_000]),
    "a giant tensor": lambda m: m.graph.initializer.add(name="g", data_type=1, dims=[1 << 20, 1 << 20]),
    "a negative tensor": lambda m: m.graph.initializer.add(name="g", data_type=1, dims=[-5]),
    "many nodes": lambda m: [node(m, "Neg") for _ in range(20_001)],
    "large constants": lambda m: m.graph.initializer.append(
        onnx.numpy_helper.from_array(np.zeros(300_000, np.float32), "large")
    ),
    "a weight that is not there": lambda m: setattr(m.graph.initializer[0], "name", "v"),
    "a weight of another shape": lambda m: m.graph.initializer[0].dims.append(1),
    "a weight of whole numbers": lambda m: setattr(m.graph.initializer[0], "data_type", 7),
    "no graph": lambda m: m.ClearField("graph"),
}


@pytest.mark.parametrize("change", HOSTILE.values(), ids=HOSTILE.keys())
def test_graphs_that_would_do_more_than_compute_are_refused(change: Callable[..., object]) -> None:
    with pytest.raises(MotionloomError, match=r"cannot be run \(.*\); write another by 'motionloom weights convert'"):
        check_graph(model(change), WEIGHTS)
    with pytest.raises(MotionloomError, match="cannot be run"):
        run(model(change))


RAN: dict[str, Callable[..., object]] = {
    "a node without an input": lambda m: m.graph.node[0].input.__setitem__(0, "nothing"),
    "another opset": lambda m: setattr(m.opset_import[0], "version", 99),
    "no output": lambda m: m.graph.node.pop(),
}


@pytest.mark.parametrize("change", RAN.values(), ids=RAN.keys())
def test_graphs_that_onnx_runtime_refuses_give_one_sentence(change: Callable[..., object]) -> None:
    with pytest.raises(MotionloomError, match=r"does not run \(.*\); write another"):
        run(model(change))


def test_the_graph_of_something_else_is_refused() -> None:
    check_graph(model(), WEIGHTS, ["y"])
    with pytest.raises(MotionloomError, match="it answers y, not clean, place"):
        check_graph(model(), WEIGHTS, ["clean", "place"])


def test_a_row_of_another_length_gives_one_sentence() -> None:
    with pytest.raises(MotionloomError, match="does not run"):
        Session(model(), lambda: WEIGHTS).run({"x": np.ones((1, 3), np.float32)})


@pytest.mark.parametrize("content", [b"", b"\0" * 64, b"\xff" * 64, b"PK\3\4", b"graph", b":" * 200])
def test_other_bytes_are_no_graph(content: bytes) -> None:
    with pytest.raises(ValueError, match=r"no ONNX graph|a model with"):
        outline(content)


@settings(max_examples=300, deadline=None)
@given(data=st.data())
def test_changed_bytes_are_a_graph_or_a_value_error(data: st.DataObject) -> None:
    content = bytearray(model())
    for _ in range(data.draw(st.integers(1, 4))):
        content[data.draw(st.integers(0, len(content) - 1))] = data.draw(st.integers(0, 255))
    with suppress(ValueError):
        outline(bytes(content[: data.draw(st.integers(0, len(content)))]))
