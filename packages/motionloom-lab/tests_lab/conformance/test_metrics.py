"""Group `metrics`: FID, retrieval, diversity, multimodality and jerk on made-up embeddings and joints."""

import numpy as np
import pytest

from motionloom_lab.metrics import retrieval, transitions
from tests.conformance.runner import MOTION, Case, cases, compare, normal, stream


def embeddings(case: Case, noise: float = 0.0) -> tuple[np.ndarray, ...]:
    """Real, generated and text embeddings of a case, float64 of float32 numbers."""
    rng, (n, d) = stream(case.config["seed"], MOTION), (case.config["n"], case.config["dim"])
    mix = normal(rng, (d, d)) * np.float32(1 / np.sqrt(d))
    a, b, c = (normal(rng, (n, d)) for _ in range(3))
    generated = (np.float32(0.9) * b) @ mix + np.float32(0.35)
    sets = a @ mix + np.float32(0.3), generated, generated + np.float32(noise) * c
    return tuple(s.astype(np.float64) for s in sets)


def picked(rule: str, count: int, modulus: int) -> np.ndarray:
    """The row numbers of a rule such as ``(7*i+3) mod n`` for i = 0 .. count - 1."""
    factor, _, offset = rule[1 : rule.index(")")].partition("*i")
    return (int(factor) * np.arange(count) + int(offset or 0)) % modulus


@pytest.mark.parametrize("case", cases("metrics", kind="fid"))
def test_fid_is_the_published_one(case):
    real, generated, _ = embeddings(case)
    compare(case, "fid", retrieval.fid(real, generated))


@pytest.mark.parametrize("case", cases("metrics", kind="matching"))
def test_retrieval_and_matching_distance_are_the_published_ones(case):
    _, generated, text = embeddings(case, case.config["text_noise"])
    batch = case.config["batch"]
    compare(case, "r_precision", retrieval.r_precision(text, generated, batch=batch))
    compare(case, "matching_score", retrieval.matching_distance(text, generated, batch=batch))


@pytest.mark.parametrize("case", cases("metrics", kind="diversity"))
def test_diversity_is_the_published_one(case):
    _, generated, _ = embeddings(case)
    first, second = (picked(case.config[k], case.config["pairs"], case.config["n"]) for k in ("first", "second"))
    compare(case, "diversity", retrieval.diversity_of(generated, first, second))


@pytest.mark.parametrize("case", cases("metrics", kind="multimodality"))
def test_multimodality_is_the_published_one(case):
    c = case.config
    motions = normal(stream(c["seed"], MOTION), (c["captions"], c["samples"], c["dim"]))
    first, second = (picked(c[k], c["pairs"], c["samples"]) for k in ("first", "second"))
    compare(case, "multimodality", retrieval.multimodality_of(motions, first, second))


@pytest.mark.parametrize("case", cases("metrics", kind="jerk"))
def test_jerk_of_transitions_is_the_published_one(case):
    c = case.config
    positions = normal(stream(c["seed"], MOTION), (c["batch"], c["frames"], 22, 3)).astype(np.float64)
    joints = (0.01 * np.cumsum(np.cumsum(0.2 * positions, axis=1), axis=1)).astype(np.float32)
    curve = transitions.jerk_curve(joints, c["lengths"])
    compare(case, "per_sequence", transitions.sequence_jerk(joints, c["lengths"]))
    compare(case, "curve", curve)
    compare(case, "peak_jerk", transitions.peak_jerk(curve))
    compare(case, "auj", transitions.area_under_jerk(curve, c["reference_jerk"]))
