"""Adapters put into a prior: by file and factor, several at once, segment by segment."""

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from motionloom.core.errors import MotionloomError
from motionloom.core.models.adapter import Adapter, fingerprint, origin
from motionloom.core.models.networks.text.known import known_sentences
from motionloom.core.models.prior import Prior
from motionloom.goals.adapters import MOST_FACTOR, parse_adapter
from motionloom.goals.segment import Segment
from motionloom.requests.sampling import Sampling
from motionloom.tasks.adapting import CACHE_SIZE, adapt, adapted_priors
from motionloom.tasks.long import load_segment_adapters, long_features
from motionloom.tasks.remarks import lines_by_text, remarks_on_words
from motionloom.tasks.text import sample_features
from tests.recorded import tiny
from tests.recorded.tiny import adapter


@pytest.fixture(scope="module")
def prior() -> Prior:
    return tiny.prior()


def weights(prior: Prior) -> np.ndarray:
    return np.concatenate([value.flatten() for value in prior.net.weights.values()])


@pytest.mark.parametrize(
    ("word", "expected"),
    [
        ("a.safetensors", ("a.safetensors", None)),
        ("a.safetensors:0.8", ("a.safetensors", 0.8)),
        ("x/a.safetensors:-1", ("x/a.safetensors", -1.0)),
        ("C:/a.safetensors", ("C:/a.safetensors", None)),
        ("C:/a.safetensors:.5", ("C:/a.safetensors", 0.5)),
        ("a:b", ("a:b", None)),
    ],
)
def test_a_factor_stands_behind_the_last_colon(word: str, expected: tuple[str, float | None]) -> None:
    assert parse_adapter(word) == (Path(expected[0]), expected[1])


@pytest.mark.parametrize("word", ["", ":0.8", "a:1e9", "a:nan", "a:inf", f"a:{MOST_FACTOR + 0.1}"])
def test_factors_that_make_no_sense_are_refused(word: str) -> None:
    with pytest.raises(MotionloomError, match="FILE:FACTOR"):
        parse_adapter(word)


@given(st.text(max_size=12))
def test_every_word_is_read_or_refused(word: str) -> None:
    try:
        _, factor = parse_adapter(word)
    except MotionloomError:
        return
    assert factor is None or abs(factor) <= MOST_FACTOR


def test_adapters_add_up(prior: Prior) -> None:
    """W + 0.5 A + 2 B, in whatever order, and A - A is nothing."""
    one, two = adapter(prior), adapter(prior, seed=2)
    base, a, b = weights(prior), weights(adapt(prior, [(one, 1.0)])), weights(adapt(prior, [(two, 1.0)]))
    both = weights(adapt(prior, [(one, 0.5), (two, 2.0)]))
    np.testing.assert_allclose(both, base + 0.5 * (a - base) + 2 * (b - base), rtol=0, atol=1e-5)
    np.testing.assert_allclose(both, weights(adapt(prior, [(two, 2.0), (one, 0.5)])), rtol=0, atol=1e-5)
    np.testing.assert_allclose(weights(adapt(prior, [(one, 1.0), (one, -1.0)])), base, rtol=0, atol=1e-6)


def test_no_adapter_is_the_prior_itself(prior: Prior) -> None:
    assert adapt(prior, []) is prior


def test_more_adapters_go_onto_an_adapted_prior(prior: Prior) -> None:
    """Files belong to the weights as they were before adapters; so does everything else that names them."""
    once = adapt(prior, [(adapter(prior), 1.0)])
    assert origin(once) == fingerprint(prior.net) != fingerprint(once.net)
    twice = adapt(once, [(adapter(prior, seed=2), 1.0)])
    np.testing.assert_allclose(
        weights(twice), weights(adapt(prior, [(adapter(prior), 1.0), (adapter(prior, seed=2), 1.0)])), rtol=0, atol=1e-5
    )


def test_what_does_not_belong_is_refused(prior: Prior, tmp_path: Path) -> None:
    other = tiny.prior(seed=9)
    with pytest.raises(MotionloomError, match="belongs to the weights 'tiny', and these are others"):
        adapt(prior, [(adapter(other), 1.0)])
    with pytest.raises(MotionloomError, match="is one for control"):
        adapt(prior, [(adapter(prior, control="any"), 1.0)])
    with pytest.raises(MotionloomError, match="no adapter"):
        adapt(prior, [(tmp_path / "none.safetensors", 1.0)])
    with pytest.raises(MotionloomError, match="too many"):
        adapt(prior, [(adapter(prior), 1.0)] * 20)


def features(prior: Prior, segments: list[Segment], **more) -> list[np.ndarray]:
    return list(long_features(prior, segments, **({"steps": 3} | more)))


WALK = Segment("a person walks", 2.0)


def test_one_segment_of_a_timeline_is_drawn_as_the_adapted_prior_draws_it(prior: Prior) -> None:
    one = adapter(prior)
    (alone,) = features(prior, [replace(WALK, adapters=((one, 0.7),))])
    (whole,) = features(adapt(prior, [(one, 0.7)]), [WALK])
    np.testing.assert_allclose(alone, whole, rtol=0, atol=1e-5)
    assert np.abs(alone - features(prior, [WALK])[0]).max() > 0.01


def test_an_adapter_of_one_segment_leaves_far_ones_alone(prior: Prior) -> None:
    """In three steps a change reaches three rows far, and the first of seven is further away."""
    plain = [replace(WALK, text=f"a person walks {i}") for i in range(7)]
    changed = [*plain[:6], replace(plain[6], adapters=((adapter(prior), 1.0),))]
    before, after = features(prior, plain), features(prior, changed)
    np.testing.assert_allclose(before[0], after[0], rtol=0, atol=1e-5)
    assert np.abs(before[6] - after[6]).max() > 0.01


def test_how_many_rows_go_together_changes_nothing(prior: Prior) -> None:
    segments = [replace(WALK, adapters=((adapter(prior, seed=i % 3), 1.0),) if i % 3 else ()) for i in range(5)]
    together, apart = (np.concatenate(features(prior, segments, batch_size=count)) for count in (8, 1))
    np.testing.assert_allclose(together, apart, rtol=0, atol=2e-4)


def test_words_that_an_adapter_was_taught_are_guided_less(prior: Prior) -> None:
    """The estimate without words does not know them; other words, and those of half an adapter, are guided as ever."""
    taught = replace(adapter(prior), notes={"captions": ["a person turns the left wrist", "somebody nods"]})
    prompts = ["a person turns the left wrist", "he nods", "a person walks"]
    shares = adapt(prior, [(taught, 1.0)]).guided_shares(prompts)
    assert shares.tolist() == pytest.approx([0.1, 0.1, 1.0])
    assert adapt(prior, [(taught, 0.7)]).guided_shares(prompts).tolist() == [1.0, 1.0, 1.0]
    assert prior.guided_shares(prompts).tolist() == [1.0, 1.0, 1.0]
    words, whole, plain = prompts[0], adapt(prior, [(taught, 1.0)]), adapt(prior, [(replace(taught, notes={}), 1.0)])

    def sampled(prior: Prior, *texts: str, guidance: float = 2.5) -> np.ndarray:
        how = Sampling(guidance=guidance, steps=3, spacing="index")
        return np.stack(sample_features(prior, list(texts), [40] * len(texts), seeds=range(len(texts)), sampling=how))

    eased = sampled(whole, words)
    np.testing.assert_allclose(eased, sampled(plain, words, guidance=1.15), rtol=0, atol=1e-4)
    assert np.abs(eased - sampled(plain, words)).max() > 1e-3
    np.testing.assert_allclose(sampled(whole, words, prompts[2])[0], eased[0], rtol=0, atol=2e-4)
    segments = [replace(WALK, text=words)]
    assert np.abs(features(whole, segments)[0] - features(plain, segments)[0]).max() > 1e-3


WALKS, TURNS, JUMPS = "a person walks", "walk un left", "a person jumps"
"""Words that are far from each other to the random encoder."""


@pytest.fixture
def knowing(prior: Prior, monkeypatch: pytest.MonkeyPatch) -> Prior:
    """A prior that knows how to walk, to whose random encoder every other sentence is something else."""
    monkeypatch.setattr("motionloom.core.models.prior.OWN_WORDS", 0.0)
    return replace(prior, known=known_sentences([WALKS], {"walk": 9.0}, prior.text))


def taught(prior: Prior, *captions: str, seed: int = 1) -> Adapter:
    return replace(adapter(prior, seed=seed), name=captions[0], notes={"captions": list(captions)})


def test_an_adapter_without_a_factor_leaves_words_alone_that_are_known_better(knowing: Prior) -> None:
    jump, turn = taught(knowing, JUMPS), taught(knowing, TURNS, seed=2)
    both = adapt(knowing, [(jump, None), (turn, None)])
    texts = [WALKS, JUMPS, TURNS, WALKS]

    def rows(prior: Prior) -> list[np.ndarray]:
        return sample_features(prior, texts, [40] * 4, seeds=range(4), steps=3)

    expected = [rows(knowing)[0], rows(adapt(knowing, [(jump, 1.0)]))[1], rows(adapt(knowing, [(turn, 1.0)]))[2]]
    for one, other in zip(rows(both), [*expected, rows(knowing)[3]], strict=True):
        np.testing.assert_allclose(one, other, rtol=0, atol=2e-4)
    assert np.abs(rows(both)[1] - rows(knowing)[1]).max() > 1e-3
    assert both.for_words(WALKS).net is knowing.net
    assert both.for_words("") is both.for_words(WALKS)
    assert [one.name for one in both.left_out(WALKS)] == [JUMPS, TURNS]
    assert both.left_out(JUMPS, TURNS) == []
    assert both.for_words(JUMPS, TURNS) is both
    moved = both.to("cpu")
    assert moved.base is not None
    assert moved.base is not both.base
    assert moved.for_words(WALKS).net is moved.base.net


def test_it_does_so_in_timelines_and_beside_adapters_with_a_factor(knowing: Prior) -> None:
    jump, turn = taught(knowing, JUMPS), taught(knowing, TURNS, seed=2)
    both = adapt(adapt(knowing, [(jump, None)]), [(turn, 0.5)])
    turned = adapt(knowing, [(turn, 0.5)])
    for text, other in ((WALKS, turned), (JUMPS, adapt(knowing, [(jump, 1.0), (turn, 0.5)]))):
        segments = [replace(WALK, text=text)] * 2
        for one, two in zip(features(both, segments), features(other, segments), strict=True):
            np.testing.assert_allclose(one, two, rtol=0, atol=1e-4)
    assert origin(both) == origin(both.for_words(WALKS)) == fingerprint(knowing.net)


def test_adapters_and_weights_that_do_not_say_what_they_know_are_used_for_all_words(knowing: Prior) -> None:
    silent = adapt(knowing, [(replace(adapter(knowing), notes={}), None)])
    assert silent.for_words(WALKS) is silent
    unknowing = adapt(replace(knowing, known=None), [(taught(knowing, JUMPS), None)])
    assert unknowing.for_words(WALKS) is unknowing


def test_a_remark_says_which_adapter_is_left_out(knowing: Prior) -> None:
    prior = adapt(knowing, [(taught(knowing, JUMPS), None)])
    [remark] = [one for one in remarks_on_words(prior, [WALKS, JUMPS, WALKS]) if "adapter" in one.line]
    assert remark.line == (
        "'a person walks' is generated without the adapter 'a person jumps', which was taught 'a person jumps'; "
        "write FILE:1 to use it for all words"
    )
    both = [replace(remark, line="one"), replace(remark, line="two"), replace(remark, text="else", line="three")]
    assert lines_by_text(both) == {WALKS: "one; two", "else": "three"}


def test_files_of_segments_are_read_beforehand(prior: Prior, tmp_path: Path) -> None:
    one = adapter(prior)
    place = one.save(tmp_path / "a.safetensors")
    (segment,) = load_segment_adapters(prior, [replace(WALK, adapters=((place, 0.5),))])
    ((read, factor),) = segment.adapters
    assert isinstance(read, Adapter)
    assert (read.name, factor) == ("a1", 0.5)
    (tmp_path / "b.safetensors").write_bytes(b"x" * 100)
    with pytest.raises(MotionloomError, match="not a whole safetensors file"):
        load_segment_adapters(prior, [replace(WALK, adapters=((tmp_path / "b.safetensors", 0.5),))])


def test_merged_networks_are_kept_but_not_without_end(prior: Prior) -> None:
    adapted = adapted_priors(prior)
    one = adapter(prior)
    first = adapted(((one, 1.0),))
    assert adapted(((one, 1.0),)) is first
    assert adapted(()) is prior
    for number in range(CACHE_SIZE):
        adapted(((one, number / 10),))
    assert adapted(((one, 1.0),)) is not first


def test_the_same_seed_and_adapters_draw_the_same(prior: Prior) -> None:
    one = adapter(prior)
    first, again = (
        sample_features(adapt(prior, [(one, 0.8)]), ["a person walks"], [40], seeds=[3], steps=3)[0] for _ in range(2)
    )
    assert np.array_equal(first, again)
