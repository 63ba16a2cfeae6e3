"""Retrieval on clouds whose distances are known, against the count written out, and on ties."""

import tracemalloc

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from motionloom.core.errors import MotionloomError
from motionloom_lab.metrics import retrieval


def cloud(n: int, d: int, seed: int = 0) -> np.ndarray:
    return np.random.default_rng(seed).normal(size=(n, d))


def written_out(texts: np.ndarray, motions: np.ndarray, top: int, batch: int) -> np.ndarray:
    """The published count: sort each row of distances and look for the own number among the first k."""
    hits, used = np.zeros(top), 0
    for start in range(0, len(texts) - batch + 1, batch):
        t, m = texts[start : start + batch], motions[start : start + batch]
        for i in range(batch):
            order = sorted(range(batch), key=lambda j, i=i: float(np.sqrt(sum((t[i] - m[j]) ** 2))))
            hits += [i in order[: k + 1] for k in range(top)]
            used += 1
    return hits / used


@given(st.integers(0, 2**32 - 1), st.integers(1, 9), st.sampled_from([3, 5, 8]))
def test_without_ties_the_shares_are_those_of_sorting(seed: int, d: int, batch: int) -> None:
    """Any cloud, dimension and batch size, partial last batch included."""
    motions, rng = cloud(19, d, seed), np.random.default_rng(seed + 1)
    texts = motions + rng.normal(size=motions.shape)
    assert np.allclose(retrieval.r_precision(texts, motions, batch=batch), written_out(texts, motions, 3, batch))


def test_shares_of_a_known_distance_matrix() -> None:
    """Points on a line: text i is at place[i], and its own motion is the 1st, 2nd, 3rd and 4th nearest."""
    motions = np.array([[0.0], [10.0], [20.0], [30.0]])
    places = np.array([[1.0], [4.0], [-1.0], [-2.0]])  # ranks 1, 2, 3, 4
    assert np.array_equal(retrieval.r_precision(places, motions, top=4, batch=4), [0.25, 0.5, 0.75, 1.0])
    assert np.array_equal(retrieval.r_precision(places, motions, top=2, batch=None), [0.25, 0.5])
    assert retrieval.matching_distance(places, motions) == pytest.approx((1 + 6 + 21 + 32) / 4)


def test_it_is_the_text_that_looks_for_a_motion() -> None:
    """One motion beside every text: the texts find it, the motions' own order is no matter."""
    motions = np.array([[0.0], [5.0], [100.0]])
    texts = np.array([[0.0], [2.0], [3.0]])  # nearest motions 0, 0, 1; a motion's nearest texts 0, 2, 2
    assert np.allclose(retrieval.r_precision(texts, motions, top=2, batch=3), [1 / 3, 2 / 3])


def test_the_last_partial_batch_is_dropped_everywhere() -> None:
    motions = cloud(10, 4)
    texts = motions.copy()
    texts[8:] += 100.0
    assert np.array_equal(retrieval.r_precision(texts, motions, batch=4), [1, 1, 1])
    assert retrieval.matching_distance(texts, motions, batch=4) == 0
    assert retrieval.matching_distance(texts, motions) == pytest.approx(200 * 2 / 10)  # 100 in each of 4 dimensions


def test_batches_are_consecutive_rows() -> None:
    """Two copies of a set far from each other: the own motion is found in its half, texts of the wrong half are not."""
    motions = np.concatenate([np.arange(4.0), np.arange(4.0)])[:, None]
    assert np.array_equal(retrieval.r_precision(motions, motions, batch=4), [1, 1, 1])
    assert np.allclose(retrieval.r_precision(motions, motions, batch=None), [0.5, 1, 1])  # its double ties


@pytest.mark.parametrize("value", [0.0, 0.1, 1e6 / 3])
def test_equal_embeddings_score_chance_and_not_a_hundred_percent(value: float) -> None:
    same = np.full((64, 7), value)
    assert np.allclose(retrieval.r_precision(same, same), [1 / 32, 2 / 32, 3 / 32])
    assert np.allclose(retrieval.r_precision(cloud(64, 7), same), [1 / 32, 2 / 32, 3 / 32])


def test_a_tie_counts_its_chance_of_coming_first() -> None:
    """One nearer, the own and two as near: nothing in the first, a third in the second, all in the fourth."""
    motions = np.array([[1.0], [-1.0], [1.0], [0.5]])
    texts = np.zeros((4, 1))
    shares = retrieval.r_precision(texts, motions, top=4, batch=4)
    assert np.allclose(shares, [0.25, (3 * 1 / 3 + 1) / 4, (3 * 2 / 3 + 1) / 4, 1.0])


def test_a_far_away_cloud_ranks_as_it_does_at_home() -> None:
    """Distances do not depend on the origin, and cancellation must not make them."""
    motions = cloud(64, 8)
    texts = motions + cloud(64, 8, 1)
    here, there = retrieval.r_precision(texts, motions), retrieval.r_precision(texts + 1e7, motions + 1e7)
    assert np.array_equal(here, there)


def test_lengths_of_texts_and_motions_are_their_own() -> None:
    """Where all else is alike, a long embedding is far: text 0 is nearest to the short motion that is not its own."""
    motions = np.array([[3.0, 0.0], [1.0, 0.0], [0.0, 9.0]])
    texts = np.array([[0.0, 0.0], [2.1, 0.0], [0.0, 400.0]])  # ranks 2, 2, 1
    assert np.allclose(retrieval.r_precision(texts, motions, top=2, batch=3), [1 / 3, 1])


def test_ties_are_seen_through_rounding() -> None:
    """Sixteen motions on a circle are as near to its centre, though hardly two distances come out the same."""
    angles = np.arange(16) * np.pi / 8 + 0.1
    motions = np.stack([np.cos(angles), np.sin(angles)], axis=-1) * 5 / 3 + 0.7
    for centred in range(16):  # that text is at the centre, the others at their own motions
        texts = motions.copy()
        texts[centred] = 0.7
        shares = retrieval.r_precision(texts, motions, batch=16)
        assert np.allclose(shares, (15 + np.array([1, 2, 3]) / 16) / 16)


def test_the_whole_set_in_chunks_is_the_whole_set(monkeypatch: pytest.MonkeyPatch) -> None:
    motions = cloud(50, 4)
    texts = motions + cloud(50, 4, 1)
    whole = retrieval.r_precision(texts, motions, batch=None)
    monkeypatch.setattr(retrieval, "_CELLS", 7 * 50 + 1)
    assert np.array_equal(retrieval.r_precision(texts, motions, batch=None), whole)
    assert np.allclose(whole, written_out(texts, motions, 3, 50))


def test_a_large_set_never_holds_all_its_distances() -> None:
    """6,000 by 6,000 distances are 288 MB; the chunks stay far below."""
    motions = cloud(6000, 2)
    tracemalloc.start()
    retrieval.r_precision(motions, motions, batch=None)
    peak = tracemalloc.get_traced_memory()[1]
    tracemalloc.stop()
    assert peak < 200e6


def test_diversity_of_a_known_cloud() -> None:
    """Pairs named by hand on a 3-4-5 triangle."""
    m = np.array([[0.0, 0.0], [3.0, 0.0], [3.0, 4.0]])
    assert retrieval.diversity_of(m, [0, 1, 0], [1, 2, 2]) == pytest.approx((3 + 4 + 5) / 3)


def test_diversity_of_random_pairs_is_that_of_the_cloud() -> None:
    """Half the rows at 0 and half at distance 5: pairs meet at 0 or 5, half of them each, and no row comes twice."""
    m = np.zeros((1000, 3))
    m[::2] = [3.0, 0.0, 4.0]
    assert retrieval.diversity(m) == pytest.approx(2.5, abs=0.4)  # a deviation of 0.14 over 300 pairs
    assert retrieval.diversity(m, seed=1) != retrieval.diversity(m, seed=2)
    assert retrieval.diversity(m, seed=3) == retrieval.diversity(m, seed=3)


def test_pairs_are_drawn_without_repetition(monkeypatch: pytest.MonkeyPatch) -> None:
    """With as many pairs as rows every row is drawn once on either side, and the sides are drawn apart."""
    draws: list[tuple[np.ndarray, np.ndarray]] = []
    monkeypatch.setattr(retrieval, "diversity_of", lambda m, a, b: draws.append((a, b)) or 0.0)
    retrieval.diversity(cloud(300, 2))
    ((first, second),) = draws
    assert np.array_equal(np.sort(first), np.arange(300))
    assert np.array_equal(np.sort(second), np.arange(300))
    # met about once by chance: one side is not the other one moved along
    assert max(np.sum(first == np.roll(second, by)) for by in range(-3, 4)) < 10


def test_multimodality_compares_samples_of_one_caption_only() -> None:
    """Captions 1,000 apart and samples 2 apart: 2."""
    m = 1000.0 * np.arange(5)[:, None, None] + 2.0 * np.arange(4)[None, :, None] * [1.0, 0.0]
    assert retrieval.multimodality_of(m, [0, 1, 2], [1, 2, 3]) == pytest.approx(2)
    assert retrieval.multimodality_of(m, [0], [3]) == pytest.approx(6)
    assert 0 < retrieval.multimodality(m, pairs=4) < 7


@given(st.integers(0, 2**32 - 1))
def test_multimodality_is_the_mean_written_out(seed: int) -> None:
    m = np.random.default_rng(seed).normal(size=(3, 6, 4))
    pairs = [(0, 5), (2, 2), (4, 1)]
    mean = np.mean([np.sqrt(np.sum((row[a] - row[b]) ** 2)) for row in m for a, b in pairs])
    assert retrieval.multimodality_of(m, [a for a, _ in pairs], [b for _, b in pairs]) == pytest.approx(mean)


def test_draws_of_multimodality_reach_every_sample() -> None:
    """Random pairs over 30 samples of independent Gaussians: distances near sqrt(2 d), a few of 0."""
    m = np.random.default_rng(0).normal(size=(100, 30, 200))
    assert retrieval.multimodality(m) == pytest.approx(20, rel=0.25)
    assert retrieval.multimodality(m, seed=1) != retrieval.multimodality(m, seed=2)


BAD = np.array([[1.0, np.nan], [0.0, 0.0]])


@pytest.mark.parametrize(
    ("call", "words"),
    [
        (lambda: retrieval.r_precision(cloud(31, 2), cloud(31, 2)), "31 rows where at least 32"),
        (lambda: retrieval.r_precision(cloud(40, 2), cloud(40, 3)), "same dimensions"),
        (lambda: retrieval.r_precision(cloud(40, 2), cloud(41, 2)), "one row each"),
        (lambda: retrieval.r_precision(cloud(40, 2), cloud(40, 2), top=33), "top 33 of 32"),
        (lambda: retrieval.r_precision(cloud(40, 2), cloud(40, 2), top=0), "top 0"),
        (lambda: retrieval.r_precision(cloud(40, 2), cloud(40, 2), batch=0), "at least one row"),
        (lambda: retrieval.r_precision(BAD, BAD, batch=2, top=1), "not finite"),
        (lambda: retrieval.r_precision(np.full((2, 2), 1e200), cloud(2, 2), batch=2), "beyond"),
        (lambda: retrieval.matching_distance(cloud(4, 2)[0], cloud(4, 2)[0]), "rows, dimensions"),
        (lambda: retrieval.matching_distance(np.array([["a"]]), np.array([["b"]])), "numbers"),
        (lambda: retrieval.matching_distance(cloud(0, 2), cloud(0, 2)), "0 rows"),
        (lambda: retrieval.diversity(cloud(299, 2)), "299 rows where at least 300"),
        (lambda: retrieval.diversity(cloud(10, 2), pairs=0), "one pair"),
        (lambda: retrieval.diversity_of(cloud(10, 2), [0], [10]), "0 to 9"),
        (lambda: retrieval.diversity_of(cloud(10, 2), [-1], [1]), "-1"),
        (lambda: retrieval.diversity_of(cloud(10, 2), [0, 1], [1]), "equally long"),
        (lambda: retrieval.diversity_of(cloud(10, 2), [], []), "equally long"),
        (lambda: retrieval.multimodality(np.zeros((2, 5, 3))), "10 pairs of 5 samples"),
        (lambda: retrieval.multimodality(cloud(5, 2)), "captions, samples"),
        (lambda: retrieval.multimodality_of(np.full((2, 5, 3), np.inf), [0], [1]), "not finite"),
    ],
)
def test_what_cannot_be_measured_is_one_sentence(call, words: str) -> None:
    with pytest.raises(MotionloomError, match=words):
        call()
