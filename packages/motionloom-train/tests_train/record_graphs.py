"""Write the graphs of the tiny networks that tests run: `python -m tests_train.record_graphs`.

To be done after a network, `motionloom_train.export` or `tests.recorded.graphs` has changed.
"""

import numpy as np
from safetensors.numpy import save_file

from motionloom_train.export import pair_graph, predictor_graph, prior_graphs, text_graph
from tests.recorded.graphs import BLOCKS, FILE, PREDICTORS, PRIORS, TEXT, label


def record() -> dict[str, bytes]:
    """The graph of each network, by its name in the file."""
    graphs = {label("text"): text_graph(**TEXT)}
    for config in PRIORS.values():
        graphs |= {label(name, config): graph for name, graph in prior_graphs(config).items()}
    for block, prior in BLOCKS.values():
        graphs[label("pair", block, prior)] = pair_graph(block, prior)
    for config in PREDICTORS.values():
        graphs[label("predictor", config)] = predictor_graph(config)
    return graphs


def main() -> None:
    save_file({name: np.frombuffer(graph, np.uint8) for name, graph in record().items()}, FILE)
    print(f"{FILE}: {FILE.stat().st_size:,} bytes")


if __name__ == "__main__":
    main()
