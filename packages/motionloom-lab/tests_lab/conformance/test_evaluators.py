"""Group `evaluators`: the three published networks, each with weights by rule over its own names."""

import functools

import numpy as np
import pytest
import torch

from motionloom_lab.papers.guo_nets import GuoNets, GuoSizes, from_state_dict, published_order
from tests.conformance.runner import MASK, MOTION, TEXT, Case, case, cases, compare, normal, stream, weights
from tests_lab.papers.test_guo_nets import Naive, table

MODELS = {"movement_encoder": 0, "motion_encoder": 1, "text_encoder": 2}


@functools.cache
def nets(seed: int) -> GuoNets:
    state = {}
    for part, m in MODELS.items():
        listed = case("evaluators", f"state_dict_{part}").lists["keys"]
        state |= {f"{part}.{key}": torch.from_numpy(value) for key, value in weights(listed, seed, m).items()}
    return from_state_dict(state)


@torch.inference_mode()
def embeddings(recorded: Case) -> dict[str, np.ndarray]:
    config = recorded.config
    seed, rows = config["seed"], config["batch"]
    guo = nets(seed)
    frames = torch.from_numpy(normal(stream(seed, MOTION), (rows, config["frames"], config["channels"])))
    words = torch.from_numpy(normal(stream(seed, TEXT), (rows, 22, 300)))
    tags = torch.eye(15)[torch.from_numpy(stream(seed, MASK).integers(0, 15, (rows, 22)))]
    inputs = frames[..., :-4] if config["drop_contacts"] else frames
    order = published_order(config["motion_lengths"])
    return {
        "order": order,
        "movement": guo.movement_encoder(inputs).numpy(),
        "motion_embedding_sorted": guo.motions(inputs, config["motion_lengths"]).numpy()[order],
        "text_embedding_sorted": guo.texts(words, tags, config["caption_lengths"]).numpy()[order],
    }


@pytest.mark.parametrize("recorded", cases("evaluators", kind="evaluator"))
def test_published_encoders_give_the_recorded_embeddings(recorded: Case) -> None:
    points = embeddings(recorded)
    assert points.keys() == recorded.outputs.keys()
    for output, array in points.items():
        compare(recorded, output, array)


@pytest.mark.parametrize("recorded", cases("evaluators", kind="state_dict"))
def test_published_names_and_shapes_are_read_whole(recorded: Case) -> None:
    part = getattr(nets(seed=1), recorded.name.removeprefix("state_dict_"))
    assert {key: list(value.shape) for key, value in part.state_dict().items()} == recorded.lists["keys"]
    assert len(part.state_dict()) == recorded.lists["n_entries"]
    assert sum(p.numel() for p in part.parameters()) == recorded.lists["n_parameters"]


@pytest.mark.parametrize(("seed", "channels", "frames"), [(7, 259, 196), (8, 135, 61)], ids=["HumanML3D", "BABEL"])
@torch.inference_mode()
def test_other_seeds_and_shapes_follow_a_plain_loop_alone_and_in_a_batch(seed: int, channels: int, frames: int) -> None:
    """The published sizes, weights and inputs by the same rules, against loops over time in float64."""
    shapes = table(GuoSizes(channels))
    state = {}
    for part, m in MODELS.items():
        own = {key.removeprefix(f"{part}."): shape for key, shape in shapes.items() if key.startswith(part)}
        state |= {f"{part}.{key}": torch.from_numpy(value) for key, value in weights(own, seed, m).items()}
    guo, naive = from_state_dict(state), Naive(state)
    x = torch.from_numpy(normal(stream(seed, MOTION), (3, frames, channels)))
    words = torch.from_numpy(normal(stream(seed, TEXT), (3, 22, 300)))
    tags = torch.eye(15)[torch.from_numpy(stream(seed, MASK).integers(0, 15, (3, 22)))]
    lengths, counts = [frames, 40, 59], [22, 3, 11]
    moved, sentences = guo.motions(x, lengths), guo.texts(words, tags, counts)
    for row, (length, count) in enumerate(zip(lengths, counts, strict=True)):
        one = slice(row, row + 1)
        np.testing.assert_allclose(moved[row], naive.motion(x[row].double().numpy(), length), atol=1e-4)
        np.testing.assert_allclose(
            sentences[row], naive.text(words[row].double().numpy(), tags[row].double().numpy(), count), atol=1e-4
        )
        np.testing.assert_allclose(moved[row], guo.motions(x[one], [length])[0], atol=1e-5)
        np.testing.assert_allclose(sentences[row], guo.texts(words[one], tags[one], [count])[0], atol=1e-5)
