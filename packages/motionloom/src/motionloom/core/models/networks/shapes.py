"""Names and shapes of the weights of each network, as its settings say; what a file holds is checked against them."""

from motionloom.core.models.networks.pair import PLACE, SEEN, PairConfig
from motionloom.core.models.networks.predictor import PredictorConfig
from motionloom.core.models.networks.sizes import NetConfig

Shapes = dict[str, tuple[int, ...]]


def prior_shapes(config: NetConfig) -> Shapes:
    """Of a prior's network, without ``net.``."""
    width, numbers = config.width, config.patch * config.features
    table = {
        **_linear("embed", numbers + config.patch * 4 * config.flags, width),
        **_linear("time1", width, width),
        **_linear("time2", width, width),
        **_linear("text", config.text, width),
        **_linear("out", width, numbers),
    }
    if config.flags:
        table["flag.weight"] = (2, 4)
    if config.variant == "modulated":
        table |= _linear("words", config.text, 2 * width * config.layers)
        table |= _linear("change", width, 6 * width) | _linear("last", width, 2 * width)
        if config.clock:
            table |= _linear("place", width, width) | _linear("clock", width, 2 * width)
    for layer in range(config.layers):
        block = _modulated(width, config.hidden) if config.variant == "modulated" else _encoder(width, config.hidden)
        table |= _inside(f"blocks.{layer}", block)
    return table


def pair_shapes(config: PairConfig, prior: NetConfig) -> Shapes:
    """Of a communication block in such a prior."""
    modulated = prior.variant == "modulated"
    partner = prior.patch * (PLACE + 3 * len(SEEN)) if config.aware else 0
    table = {
        **_linear("places", 2 * PLACE, config.width),
        **_linear("both", 2 * prior.width + partner, config.width),
        **_linear("place", config.width, PLACE),
        **(_linear("out", config.width, prior.width) if modulated else {}),
    }
    for layer in range(config.layers):
        table |= _inside(f"blocks.{layer}", _encoder(config.width, config.hidden))
    return table


def predictor_shapes(config: PredictorConfig) -> Shapes:
    """Of a predictor's network, without ``net.``."""
    width, (rows, channels) = config.width, config.condition_shape
    table = {
        "sequence_embedding": (config.kept, width),
        **_linear("joint_embed", config.channels + config.beside * channels, width),
        **_linear("time_embed.0", width, width),
        **_linear("time_embed.2", width, width),
        **_linear("cond_embed", rows * channels, width),
        **_linear("out", width, config.channels),
    }
    closing = {
        **_linear("emb_layers.1", width, 2 * width),
        **_norm("norm", width),
        **_linear("out_layers.2", width, width),
    }
    attention = {
        **_norm("norm", width),
        **{f"{name}.weight": (width, width) for name in ("query", "key", "value")},
        **_inside("proj_out", closing),
    }
    forward = {
        **_linear("linear1", width, 2 * width),
        **_linear("linear2", 2 * width, width),
        **_inside("proj_out", closing),
    }
    for layer in range(config.layers):
        name = f"temporal_decoder_blocks.{layer}"
        table |= _inside(f"{name}.sa_block", attention) | _inside(f"{name}.ffn", forward)
    return table


def _encoder(width: int, hidden: int) -> Shapes:
    return {
        **_inside("attention", _attention(width)),
        **_linear("linear1", width, hidden),
        **_linear("linear2", hidden, width),
        **_norm("norm1", width),
        **_norm("norm2", width),
    }


def _modulated(width: int, hidden: int) -> Shapes:
    return {
        **_inside("attention", _attention(width)),
        **_linear("query", width, width),
        **_linear("heard", width, width),
        **_norm("norm", width),
        **_linear("linear1", width, hidden),
        **_linear("linear2", hidden, width),
        "table": (6, width),
    }


def _attention(width: int) -> Shapes:
    return {**_linear("project", width, 3 * width), **_linear("out", width, width)}


def _linear(name: str, inner: int, outer: int) -> Shapes:
    return {f"{name}.weight": (outer, inner), f"{name}.bias": (outer,)}


def _norm(name: str, width: int) -> Shapes:
    return {f"{name}.weight": (width,), f"{name}.bias": (width,)}


def _inside(name: str, shapes: Shapes) -> Shapes:
    return {f"{name}.{key}": shape for key, shape in shapes.items()}
