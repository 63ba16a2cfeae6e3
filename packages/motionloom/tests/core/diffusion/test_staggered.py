"""A chain of rows walked a few at a time, against one batch of all rows with the published handshake."""

import weakref
from collections.abc import Iterator, Sequence
from itertools import islice, pairwise, repeat

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from motionloom.core.diffusion import SOLVERS, Link, RowsDenoiser, cosine, handshake, levels, row_noise, run, staggered

SCHEDULE, FEATURES = cosine(40), 3
KINDS = ["ddpm", "ddim", "dpm2m"]


def near(rows: np.ndarray, level: int) -> np.ndarray:
    """(rows, frames, features) to estimates that mix neighbouring frames, and differ between first and last frames."""
    mixed = rows + 0.5 * np.roll(rows, 1, -2) - 0.3 * np.roll(rows, -2, -2)
    return np.tanh(mixed) + 0.1 * np.sin(np.arange(rows.shape[-2]) + 0.01 * level)[:, None]


def alone(numbers: Sequence[int], states: Sequence[np.ndarray], at: Sequence[int]) -> list[np.ndarray]:
    """Guesses that know their row's number."""
    return [near(s[None], level)[0] + 0.05 * number for number, s, level in zip(numbers, states, at, strict=True)]


def walk(links, *, denoise: RowsDenoiser = alone, kind: str = "ddpm", steps: int = 6, together: int = 16, **more):
    way = levels(SCHEDULE, steps)
    return staggered(
        links,
        denoise,
        levels=way,
        solver=SOLVERS[kind],
        schedule=SCHEDULE,
        features=FEATURES,
        batch_size=together,
        **more,
    )


@pytest.mark.parametrize("kind", KINDS)
def test_it_is_one_batch_with_handshakes_and_shared_noise(kind: str) -> None:
    """Four equal rows; the batch's noise is that of the rows alone, then copied from each row's end to the next."""
    rows, length, overlap = 4, 11, 4
    own = row_noise(range(rows))

    def draw(like: np.ndarray) -> np.ndarray:
        noise = own(like)
        fresh = noise.copy()
        for row in range(1, rows):
            noise[row, :overlap] = fresh[row - 1, -overlap:]
        return noise

    def denoise(state: np.ndarray, level: int) -> np.ndarray:
        return near(state, level) + 0.05 * np.arange(rows)[:, None, None]

    expected = run(
        denoise,
        draw(np.empty((rows, length, FEATURES), np.float32)),
        levels=levels(SCHEDULE, 6),
        solver=SOLVERS[kind],
        schedule=SCHEDULE,
        noise=draw,
        constrain=handshake([length] * rows, overlap),
    )
    for together in (2, rows):
        made = list(walk([Link(length, overlap, seed) for seed in range(rows)], kind=kind, together=together))
        np.testing.assert_allclose(np.stack(made), expected, atol=1e-5, rtol=1e-5)


@pytest.mark.parametrize("kind", KINDS)
def test_one_row_is_plain_sampling(kind: str) -> None:
    draw = row_noise([7])
    expected = run(
        near,
        draw(np.empty((1, 9, FEATURES), np.float32)),
        levels=levels(SCHEDULE, 5),
        solver=SOLVERS[kind],
        schedule=SCHEDULE,
        noise=draw,
    )
    denoise: RowsDenoiser = lambda numbers, states, at: [near(states[0][None], at[0])[0]]  # noqa: E731
    made = list(walk([Link(9, 400, 7)], denoise=denoise, kind=kind, steps=5))
    assert len(made) == 1
    np.testing.assert_allclose(made[0], expected[0], atol=1e-5)


@st.composite
def chains(draw: st.DrawFn) -> list[Link]:
    """1 to 12 rows; overlaps that touch, that are nothing, and all between."""
    overlaps = draw(st.lists(st.integers(0, 5), min_size=1, max_size=12))
    spare = draw(st.lists(st.integers(0, 4), min_size=len(overlaps), max_size=len(overlaps)))
    before = [0, *overlaps]
    return [Link(max(b + a + s, 1), a, 100 + i) for i, (b, a, s) in enumerate(zip(before, overlaps, spare))]


@settings(max_examples=12, deadline=None)
@given(chains(), st.sampled_from(KINDS))
def test_who_walks_together_changes_nothing(links: list[Link], kind: str) -> None:
    """And the two copies of every overlap are equal to the bit."""
    first, *others = [list(walk(links, kind=kind, steps=4, together=n)) for n in (1, 2, 3, 16)]
    assert [len(row) for row in first] == [link.length for link in links]
    for other in others:
        assert all(np.array_equal(a, b) for a, b in zip(first, other, strict=True))
    for link, (a, b) in zip(links, pairwise(first)):
        assert np.array_equal(a[len(a) - link.overlap :], b[: link.overlap])


def test_neighbours_without_an_overlap_know_nothing_of_each_other() -> None:
    links = [Link(5, 0, 1), Link(6, 0, 2), Link(7, 0, 3)]
    together = list(walk(links, denoise=lambda n, s, at: alone([0] * len(n), s, at)))
    for link, row in zip(links, together, strict=True):
        assert np.array_equal(row, next(walk([link], denoise=lambda n, s, at: alone([0], s, at))))


@pytest.mark.parametrize("together", [1, 4, 16])
def test_a_long_chain_takes_no_more_memory_than_a_short_one(together: int) -> None:
    """500 rows: of all states ever seen, few live; each row makes each move once, and rows are read in time."""
    steps, read, said = 3, 0, []
    seen: list[weakref.ref[np.ndarray]] = []
    most = ahead = 0

    def links() -> Iterator[Link]:
        nonlocal read
        for read in range(1, 501):
            yield Link(6, 2, read)

    def denoise(numbers: Sequence[int], states: Sequence[np.ndarray], at: Sequence[int]) -> list[np.ndarray]:
        nonlocal most
        assert 0 < len(numbers) <= together
        for state in states:
            if not any(one() is state for one in seen):
                seen.append(weakref.ref(state))
        seen[:] = [one for one in seen if one() is not None]
        most = max(most, len(seen))
        return alone(numbers, states, at)

    for number, _ in enumerate(walk(links(), denoise=denoise, steps=steps, together=together, moved=said.append)):
        ahead = max(ahead, read - number)
    assert number == 499
    assert sum(said) == 500 * steps
    assert max(most, ahead) <= 2 * steps + together + 2


def test_an_endless_chain_begins_at_once_and_stops_when_it_is_left() -> None:
    seen = []

    def links() -> Iterator[Link]:
        try:
            for seed in range(10**9):
                seen.append(seed)
                yield Link(6, 2, seed)
        finally:
            seen.append("closed")

    made = walk(links(), together=3)
    assert not seen
    few = list(islice(made, 4))
    assert len(seen) < 30
    del made
    assert seen[-1] == "closed"
    whole = list(islice(walk((Link(6, 2, seed) for seed in range(40)), together=3), 4))
    assert all(np.array_equal(a, b) for a, b in zip(few, whole, strict=True))


def test_no_rows_make_nothing() -> None:
    assert list(walk([])) == []


@pytest.mark.parametrize(
    ("links", "row"),
    [
        ([Link(5, 6, 1), Link(9, 0, 2)], 0),
        ([Link(9, 3, 1), Link(8, 6, 2), Link(9, 0, 3)], 1),
        ([Link(9, 3, 1), Link(2, 0, 2)], 0),
        ([Link(9, -1, 1), Link(9, 0, 2)], 0),
        ([*repeat(Link(9, 4, 1), 20), Link(7, 4, 1), Link(9, 4, 1)], 20),
    ],
    ids=["first", "both sides", "last", "negative", "late"],
)
def test_overlaps_that_do_not_fit_are_reported(links: list[Link], row: int) -> None:
    with pytest.raises(ValueError, match=f"row {row} of {links[row].length} frames"):
        list(walk(links, together=2))
    assert len(list(walk([Link(5, 2, 1), Link(5, 3, 2), Link(3, 99, 3)]))) == 3


@pytest.mark.parametrize(("way", "together"), [([40], 4), ([], 4), ([20, 20, 0], 4), ([40, 0], 0)], ids=str)
def test_a_walk_that_would_never_end_is_refused(way: list[int], together: int) -> None:
    with pytest.raises(ValueError, match="a walk needs falling levels"):
        staggered(
            repeat(Link(6, 2, 1)),
            alone,
            levels=way,
            solver=SOLVERS["ddpm"],
            schedule=SCHEDULE,
            features=FEATURES,
            batch_size=together,
        )


def test_noise_keeps_its_spread_in_the_middle_of_an_overlap() -> None:
    """Normal data of spread 1, of which the best estimate is signal * state: the spread is the same everywhere.

    Averages of independent noise would have 0.7 of it in the middle.
    """
    spreads = []

    def denoise(numbers: Sequence[int], states: Sequence[np.ndarray], at: Sequence[int]) -> list[np.ndarray]:
        spreads.extend(float(state[-100:].std()) for state in states)
        return [SCHEDULE.at(level)[0] * state for state, level in zip(states, at)]

    made = list(walk([Link(300, 100, 1), Link(300, 100, 2), Link(300, 0, 3)], denoise=denoise, steps=20))
    middle, own = np.concatenate([row[35:65] for row in made[1:]]), np.concatenate([row[100:200] for row in made])
    assert abs(float(middle.std() / own.std()) - 1) < 0.1
    assert all(abs(spread - 1) < 0.2 for spread in spreads)


def test_overlaps_go_from_the_row_before_to_the_row_behind() -> None:
    """Estimates 0, 1 and 5 of three rows: at the end an overlap of four holds 0, 1/4, 1/2, 3/4 of the way."""
    value = {0: 0.0, 1: 1.0, 2: 5.0}
    denoise: RowsDenoiser = lambda n, s, at: [np.full_like(x, value[i]) for i, x in zip(n, s)]  # noqa: E731
    a, b, c = walk([Link(6, 4, 1), Link(9, 4, 2), Link(6, 0, 3)], denoise=denoise, kind="ddim")
    assert a[:, 0].tolist() == pytest.approx([0, 0, 0, 0.25, 0.5, 0.75], abs=1e-5)
    assert b[:, 0].tolist() == pytest.approx([0, 0.25, 0.5, 0.75, 1, 1, 2, 3, 4], abs=1e-5)
    assert c[:, 0].tolist() == pytest.approx([1, 2, 3, 4, 5, 5], abs=1e-5)
