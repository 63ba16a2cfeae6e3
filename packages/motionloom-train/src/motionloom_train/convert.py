"""Weight files of the kind without graphs, written again with them; everything else in them stays as it is."""

from pathlib import Path

import numpy as np

from motionloom.core.errors import MotionloomError
from motionloom.core.files.tensors import save_tensors
from motionloom.core.models.container import (
    KINDS,
    PAIRS,
    PREDICTORS,
    PRIORS,
    Container,
    graph_tensors,
    read_tensors,
    split_graphs,
)
from motionloom.core.models.networks.pair import PairConfig
from motionloom.core.models.networks.predictor import PredictorConfig
from motionloom.core.models.networks.session import check_graph
from motionloom.core.models.networks.sizes import NetConfig
from motionloom.core.models.networks.text.minilm import sizes_of, unpacked
from motionloom_train.export import pair_graph, predictor_graph, prior_graphs, text_graph

TEXT = "text."


def convert(old: Path, new: Path, *, prior: Path | None = None) -> Path:
    """Write a weight file with the graphs of its networks and give its path back.

    Args:
        old: a prior, a predictor or a two-person block, with or without graphs.
        new: the file to write, which may be the same.
        prior: of a block, the weights that it belongs to; None: those that ship.

    Raises:
        MotionloomError: the file is none of these, is damaged, or needs no graphs (an adapter).
    """
    tensors, head = read_tensors(old)
    kind = next((kind for kind in KINDS if kind.key in head), None)
    if kind not in (PRIORS, PREDICTORS, PAIRS):
        what = "is an adapter, which has no network of its own" if kind else "is no weight file of motionloom"
        raise MotionloomError(f"{old} {what}; convert a prior, a predictor or a two-person block")
    weights, _ = split_graphs(tensors)
    graphs = _graphs(kind, old, head, weights, prior)
    return save_tensors(weights | graph_tensors(graphs), new, metadata=head)


def _graphs(
    kind: Container, path: Path, head: dict[str, str], weights: dict[str, np.ndarray], prior: Path | None
) -> dict[str, bytes]:
    about = kind.describe(path, head)
    with kind.parsing(path):
        if kind is PREDICTORS:
            graphs = {"predictor": predictor_graph(PredictorConfig.parse(about["net"]))}
        elif kind is PAIRS:
            return {"pair": pair_graph(PairConfig.parse(about["config"]), _prior_config(prior))}
        else:
            graphs = dict(prior_graphs(NetConfig.parse(about["net"])))
    for graph in graphs.values():
        check_graph(graph, weights)
    if kind is PRIORS and about["text"] == "minilm":
        packed = {key[len(TEXT) :]: value for key, value in weights.items() if key.startswith(TEXT)}
        try:
            sizes = sizes_of(unpacked(packed))
        except (KeyError, ValueError, IndexError) as error:
            raise MotionloomError(f"the text encoder in {path} is damaged ({error}); fetch the weights again") from None
        graphs["text"] = text_graph(sizes["width"], sizes["hidden"], sizes["layers"])
    return graphs


def _prior_config(prior: Path | None) -> NetConfig:
    path = PRIORS.find(prior or "default")
    _, head = read_tensors(path)
    with PRIORS.parsing(path):
        return NetConfig.parse(PRIORS.describe(path, head)["net"])
