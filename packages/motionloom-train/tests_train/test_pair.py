"""Training two people: crops and where they stand, what is given, what the loss sees, what learns, exact resume."""

from dataclasses import replace

import numpy as np
import pytest
import torch
from torch import nn

from motionloom.core.features import humanml as hml
from motionloom.core.features.layout import LAYOUT
from motionloom.core.features.pair import decode, encode
from motionloom.core.models.prior import Prior
from motionloom_train.data.pairs import Pair, mirrored
from motionloom_train.duets import KEEN, NEAR, Duets, Sight
from motionloom_train.modules import prior_module
from motionloom_train.nets.pair import PairNet, Talk, other, part
from motionloom_train.objectives import WEIGHTS
from motionloom_train.pair import BEGUN, Held, PairError, Parts, Sample, Settings, _over_rows, held_out, known_slots
from motionloom_train.tensors import noised, tensor
from tests.kinematics import people
from tests.recorded import tiny
from tests_train import runs

TEXT = "a person walks left"


def walkers(turn: float = 0.4, seconds: float = 3.0) -> np.ndarray:
    """(2, frames, 22, 3): two who turn while they walk, anywhere, the second on a stair of 20 cm."""
    frames = len(people.walking(1.0, seconds))
    a = people.spun(people.walking(0.8, seconds), np.linspace(0, 1.5, frames))
    b = people.spun(people.walking(0.5, seconds), np.linspace(2.5, 2.5 + turn, frames))
    return np.stack([hml.uniform(a) + np.array([2.0, 0.0, -1.0]), hml.uniform(b) + np.array([2.7, 0.2, 0.0])])


def pair(name: str = "walk", split: str = "train", captions: tuple[str, ...] = (TEXT,), **options) -> Pair:
    return Pair(name, split, captions, "own", "free", walkers(**options))


def recipe(**changes):
    plan = {
        "name": "two",
        "steps": 8,
        "batch": 3,
        "windows": [20, 32],
        "shares": [0.5, 0.5],
        "save_every": 4,
        "net": {},
        "amp": "none",
        "displacement": 0.3,
        "warmup": 1,
        "cooldown": 0.0,
    }
    return runs.recipe(**(plan | changes))


def objective(*, fresh: bool = False, settings: Settings | None = None, prior: Prior | None = None, **changes):
    settings = settings or Settings(dropout=0.0)
    prior = prior or tiny.prior()
    torch.manual_seed(4)
    talk = Talk(settings.config(prior), prior.net.config)
    with torch.no_grad():
        for value in () if fresh else talk.parameters():
            value.add_(torch.randn(value.shape) * 0.2)
    mean, std = tensor(prior.mean), tensor(prior.std)
    net = PairNet(prior_module(prior), talk, prior.schedule, mean=mean, std=std)
    return PairError(net, prior, Duets([pair(), pair("b", turn=2.0)]), settings=settings, recipe=recipe(**changes))


class Watch(nn.Module):
    """Keeps the state it is shown."""

    def forward(self, x, level, bound):
        self.state = x
        return x


# What is drawn -------------------------------------------------------------------------------------------------------


def test_a_window_decodes_to_the_recorded_places_above_each_person_s_floor():
    recorded, duets = pair(), Duets([pair()], mirror=False)
    crops = duets.crops(np.array([0, 0]), np.array([0, 17]), 25)
    floor = recorded.positions[..., 1].min(axis=(1, 2))
    above = recorded.positions - floor[:, None, None, None] * [0.0, 1.0, 0.0]
    for row, start in enumerate((0, 17)):
        places = decode(crops.features[row].double(), crops.ground[row].double()).numpy()
        np.testing.assert_allclose(places, above[:, start : start + 25], atol=2e-4)


def test_features_have_the_heading_that_priors_have_seen_also_in_the_first_frame():
    features = encode(walkers()).features
    assert np.abs(np.diff(features[:, :5, 0], axis=1)).max() < 1e-3  # the compatible one turns by a leap there
    for person, row in zip(walkers(), features, strict=True):
        target = hml.encode(hml.canonical(person), heading="corrected")
        np.testing.assert_allclose(row, target, atol=1e-5)


def test_half_of_the_windows_are_of_mirrored_pairs_and_half_have_the_people_exchanged():
    duets = Duets([pair()])
    worlds = [pair().positions, mirrored(pair()).positions]
    plain = [encode(positions).features for positions in worlds]
    crops, counts = duets.draw(np.random.default_rng(0), 30, 60), np.zeros((2, 2))
    for window, ground in zip(crops.features.numpy(), crops.ground.numpy(), strict=True):
        for side, features in enumerate(plain):
            for exchanged, first in enumerate(features):
                places = np.lib.stride_tricks.sliding_window_view(first, 30, axis=0).swapaxes(1, 2)
                away = np.abs(places - window[0]).max(axis=(1, 2))
                if away.min() < 1e-5:
                    counts[side, exchanged] += 1
                    root = worlds[side][exchanged, away.argmin(), 0, [0, 2]]
                    np.testing.assert_allclose(ground[0, 2:], root, atol=1e-4)  # the stands went with the people
    assert counts.sum() == 60
    assert counts.min() > 6


def test_recordings_are_drawn_by_the_root_of_their_length_and_windows_begin_anywhere_in_them():
    short, long = pair("short", captions=("a",), seconds=1.0), pair("long", captions=("b",), seconds=4.0)
    duets, window = Duets([short, long], mirror=False), short.frames - 3  # features have a frame less
    crops = duets.draw(np.random.default_rng(0), window, 1500)
    expected = np.sqrt(long.frames - 1) / (np.sqrt(long.frames - 1) + np.sqrt(short.frames - 1))
    assert np.mean([duets.texts[n] == "b" for n in crops.texts]) == pytest.approx(expected, abs=0.05)
    assert (crops.lengths == window).all()
    some = crops.ground[torch.from_numpy(crops.texts == duets.texts.index("a"))].sort(dim=1).values
    assert len(some.unique(dim=0)) == 3


def test_windows_are_as_long_as_often_as_the_recipe_says():
    error = objective(windows=[20, 32], shares=[3.0, 1.0])
    lengths = [error.sample(5, step, 1).clean.shape[1] - 1 for step in range(80)]
    assert set(lengths) == {20, 32}
    assert np.mean([one == 20 for one in lengths]) == pytest.approx(0.75, abs=0.13)


def test_what_is_said_goes_with_the_window_mirrored_where_it_is():
    duets = Duets([pair(), pair("silent", captions=())])
    assert duets.texts == ("", TEXT, "a person walks right")
    crops = duets.crops(np.array([0, 1, 2, 3]), np.zeros(4, int), 20)
    assert [duets.texts[n] for n in crops.texts] == [TEXT, "", "a person walks right", ""]


def test_a_beginning_gives_both_people_and_d_and_a_reaction_one_person_without_d():
    begun = np.array([True] * 300 + [False] * 200)
    react = np.array([False] * 300 + [True] * 100 + [False] * 100)
    lengths = np.array([80] * 400 + [30] * 100)
    known = known_slots(np.random.default_rng(0), begun, react, lengths, 80).reshape(500, 2, 81)
    counts = known[:300].sum(-1)
    assert (counts[:, 0] == counts[:, 1]).all()
    assert known[:300, :, 0].all()
    assert (np.diff(known[:300].astype(int), axis=-1) <= 0).all()  # a beginning and nothing behind it
    assert counts.min() >= 11
    assert counts.max() <= 41
    assert 0.45 < (counts[:, 0] == BEGUN + 1).mean() < 0.65
    assert not known[300:400, :, 0].any()
    assert sorted(set(known[300:400].sum(-1).ravel())) == [0, 80]
    assert (known[300:400].sum((1, 2)) == 80).all()
    assert 20 < known[300:400, 0, 1].sum() < 80
    assert not known[400:].any()
    short = known_slots(np.random.default_rng(0), begun, react, np.full(500, 30), 80).reshape(500, 2, 81)
    assert short[:300].sum(-1).max() == 16
    assert not short[..., 31:].any()


def test_given_slots_have_no_noise_and_both_people_one_level_and_own_noise():
    error, watch = objective(settings=Settings(prefix=0.5, react=0.5)), Watch()
    sample = error.sample(1, 2, 8)
    error.denoised(watch, sample)
    signal = tensor(error.schedule.signal)[sample.level].float()
    still = watch.state - signal[:, None, None] * sample.clean
    assert still[sample.known].abs().max() < 1e-6 < 0.01 < still[~sample.known].abs().mean()
    assert torch.equal(sample.level[0::2], sample.level[1::2])
    assert (sample.noise[0::2] - sample.noise[1::2]).abs().mean() > 0.5
    again, later = error.sample(1, 2, 8), error.sample(1, 3, 8)
    assert torch.equal(again.noise, sample.noise)
    assert not torch.equal(later.level, sample.level)


def test_texts_are_dropped_for_both_people_alike_and_early_levels_are_noisy():
    error = objective(settings=Settings(prefix=0.4, react=0.1, silent=0.5, early=1.0), windows=[20], shares=[1.0])
    sample = error.sample(0, 0, 300)
    silent = sample.cond.pooled.abs().sum(-1) == 0
    assert torch.equal(silent[0::2], silent[1::2])
    known = sample.known.any(1)[0::2] | sample.known.any(1)[1::2]
    assert 0.4 < silent[0::2][known].float().mean() < 0.6
    assert 0.03 < silent[0::2][~known].float().mean() < 0.2
    assert sample.level.min() >= 1
    assert sample.level.max() == 50
    assert (sample.level > 37).float().mean() == pytest.approx(0.5, abs=0.09)  # 1 - sqrt(1/4) of them
    even = objective(settings=Settings(early=0.0)).sample(0, 0, 300)
    assert (even.level > 37).float().mean() == pytest.approx(0.25, abs=0.09)


# What is learned -----------------------------------------------------------------------------------------------------


def test_a_fresh_block_costs_what_the_prior_alone_costs_and_the_square_of_d():
    made = objective(fresh=True, settings=Settings(prefix=0.0, react=0.0))
    sample = made.sample(3, 4, 4)
    parts = made.parts(made.denoised(made.net.eval(), sample), sample)
    prior, motion = tiny.prior(), sample.clean[:, 1:]
    state = noised(prior.schedule, motion, sample.level, sample.noise[:, 1:])
    base = prior_module(prior)
    alone = base(state, sample.level, base.bind(sample.cond))
    error = ((alone - motion) ** 2 * made.scale).mean()
    torch.testing.assert_close(parts.motion, error)
    torch.testing.assert_close(parts.place, (sample.clean[:, 0, :4] ** 2).mean())
    assert made.scale.mean() == pytest.approx(1.0)


@pytest.mark.parametrize("said", [Settings(dropout=0.0), Settings(dropout=0.0, aware=True)], ids=["plain", "aware"])
def test_exchanged_people_cost_the_same(said):
    error = objective(settings=said)
    sample = error.sample(3, 4, 4)
    exchanged = Sample(*(other(x) for x in sample[:4]), sample.cond, sample.lengths)
    assert not torch.equal(exchanged.clean, sample.clean)
    before, after = (error.parts(error.denoised(error.net.eval(), d), d) for d in (sample, exchanged))
    for a, b in zip(before, after, strict=True):
        torch.testing.assert_close(a, b)


def test_what_is_given_and_what_lies_behind_the_end_costs_nothing():
    error = objective(settings=Settings(prefix=1.0, react=0.0), windows=[80], shares=[1.0])
    sample = error.sample(0, 0, 3)
    assert (sample.lengths < 80).all()
    denoised = error.denoised(error.net.eval(), sample)
    wrong = denoised.clone()
    wrong[sample.known] += 7.0
    wrong[:, 1 + int(sample.lengths.max()) :] += 7.0
    for a, b in zip(error.parts(denoised, sample), error.parts(wrong, sample), strict=True):
        torch.testing.assert_close(a, b)
    wrong[:, int(sample.lengths.max())] += 700.0  # the last valid frame
    assert error.parts(wrong, sample).motion > error.parts(denoised, sample).motion + 0.1
    seam = denoised.clone()
    seam[torch.arange(6), sample.known.sum(1)] += 700.0  # the first frame that is not given
    assert error.parts(seam, sample).motion > error.parts(denoised, sample).motion + 0.1
    assert error.parts(denoised, sample).place == 0


def test_what_they_see_of_each_other_is_that_of_the_world_and_counts_by_how_little_noise_there_is():
    duets = Duets([pair()], mirror=False)
    crops = duets.crops(np.array([0]), np.array([5]), 20)
    error = objective()
    code, features = error.net.talk.config.places, crops.features[0].double()
    places, sight = code.encode(crops.ground[0].double()), Sight(code)
    world = decode(features, crops.ground[0].double())[:, :, list(KEEN)].numpy()
    counts = sight.joints(places, features)
    for person in (0, 1):
        target = np.linalg.norm(world[1 - person][:, None, :] - world[person][:, :, None], axis=-1)
        np.testing.assert_allclose(counts[person].norm(dim=-1).numpy(), target, atol=1e-5)
    first = world[0, 0, :, None] - world[1, 0, None, :]  # at frame 0 the own heading is the stand's
    cos, sin = crops.ground[0, 1, :2].double().numpy()
    np.testing.assert_allclose(counts[1, 0, :, :, 0].numpy().T, cos * first[..., 0] - sin * first[..., 2], atol=1e-5)
    moved = places + torch.tensor([0.0, 0.0, 0.3, 0.0])
    away = sight.error(moved, features, places, features)
    near = np.exp(-0.5 * (counts**2).sum(-1).numpy() / NEAR**2)
    np.testing.assert_allclose(away.numpy(), 0.09 * (1 + 4 * near).mean((-1, -2)), rtol=1e-6)
    sample = error.sample(0, 1, 2)
    denoised, low = error.denoised(error.net.eval(), sample), sample._replace(level=torch.ones_like(sample.level))
    high = sample._replace(level=torch.full_like(sample.level, 50))
    faint = error.settings.faint  # what is left of it near pure noise
    with torch.no_grad():
        far, near_clean = (float(error.parts(denoised, one).sight) for one in (high, low))
    assert far == pytest.approx(faint * near_clean, rel=0.02)


def test_a_mean_is_over_rows_that_have_something_to_guess():
    error = torch.tensor([[1.0, 3.0], [9.0, 9.0], [5.0, 9.0]])
    free = torch.tensor([[True, True], [False, False], [True, False]])
    assert float(_over_rows(error, free)) == 3.5  # of 2 and 5
    assert float(_over_rows(error, torch.zeros_like(free))) == 0


def test_the_numbers_of_a_frame_count_as_in_training_one_person():
    scale = objective().scale
    for name, block in LAYOUT.items():
        torch.testing.assert_close(
            scale[block], (scale[0] * WEIGHTS[name] / WEIGHTS["yaw_velocity"]).expand(len(scale[block]))
        )
    assert len(set(WEIGHTS.values())) > 1


def test_being_wrong_by_one_everywhere_costs_one_however_much_is_given():
    error = objective(settings=Settings(prefix=0.5, react=0.5))
    sample = error.sample(3, 4, 8)
    assert error.parts(sample.clean, sample).displacement < 1e-9
    parts = error.parts(sample.clean + 1.0, sample)
    assert float(parts.motion) == pytest.approx(1.0, abs=1e-4)
    assert float(parts.place) == pytest.approx(1.0, abs=1e-4)
    assert parts.displacement > 0.1


def test_windows_near_the_end_are_shorter_and_held_out_ones_are_spread_over_pairs_for_validation():
    duets = Duets([pair()], mirror=False)
    crops = duets.crops(np.array([0, 0]), np.array([3, 50]), 20)
    assert crops.lengths.tolist() == [20, pair().frames - 1 - 50]
    assert not crops.features[1, :, int(crops.lengths[1]) :].any()
    error = objective()
    assert held_out(error, [pair(split="test")]) is None
    held = held_out(error, [pair("c", "val", seconds=6.0), pair("t", "test")])
    assert held is not None
    assert held.sample.clean.shape[:2] == (24, 81)
    assert len(held.sample.clean[::2, 40].unique(dim=0)) == 12


def test_partners_held_out_are_off_by_metres_where_nothing_is_given(monkeypatch):
    """Who is told sees the other 0.6 m beside where he is, who is not 0.3 m."""
    error = objective(settings=Settings(prefix=0.0, react=1.0))
    sample = error.sample(3, 4, 3)
    sample = sample._replace(lengths=torch.full_like(sample.lengths, sample.clean.shape[1] - 1))
    known = sample.known[:, 1]
    assert known.sum() == 3
    sample.known[known, 1:] = True
    wrong = sample.clean.clone()
    wrong[:, 0, 2] += torch.where(known, 0.6, 0.3) / error.net.talk.config.places.ground
    monkeypatch.setattr(error, "denoised", lambda net, sample: wrong)
    assert Held(error, sample).report(error.net).root == pytest.approx(0.3, abs=1e-3)


def test_parts_of_the_loss_have_their_weights():
    error = objective(settings=Settings(place=3.0, sight=5.0))
    parts = Parts(*(torch.tensor(x) for x in (1.0, 10.0, 100.0, 1000.0)))
    assert float(error.total(parts)) == pytest.approx(1 + 30 + 500 + 0.3 * 1000)


def test_a_wrong_guess_of_where_they_stand_is_seen_by_both_even_by_whom_nothing_is_left_to_guess():
    """One person is given; the other sees, and is seen, elsewhere."""
    error = objective(settings=Settings(prefix=0.0, react=1.0))
    sample = error.sample(3, 4, 2)._replace(level=torch.full((4,), 1))
    assert error.parts(sample.clean, sample).sight < 1e-9
    wrong = sample.clean.clone()
    wrong[:, 0, 2] += torch.tensor([0.1, 0.2, 0.4, 0.8]) / error.net.talk.config.places.ground
    parts = error.parts(wrong, sample)
    assert parts.motion == 0
    (d0, x0), x1 = part(sample.clean), wrong[:, 1:]
    away = error.sight.error(wrong[:, 0, :4], x1 * error.std + error.mean, d0, x0 * error.std + error.mean)
    valid = torch.arange(away.shape[1]) < sample.lengths[:, None]
    places = [row[there].mean() for row, there in zip(away, valid, strict=True)]  # of all four people
    torch.testing.assert_close(parts.sight, torch.stack(places).mean() * error.shares[1])


def test_texts_are_dropped_of_who_reacts_too_and_of_whom_nobody_described():
    error = objective(settings=Settings(prefix=0.0, react=1.0, silent=1.0), windows=[20], shares=[1.0])
    assert error.sample(0, 0, 20).cond.pooled.abs().sum() == 0
    undescribed = PairError(
        error.net,
        tiny.prior(),
        Duets([pair(captions=()), pair("b", turn=2.0)]),
        settings=Settings(prefix=0, react=0),
        recipe=recipe(drop_text=0.0),
    )
    crops = undescribed.duets.crops(np.array([0, 1]), np.zeros(2, int), 20)
    sample = undescribed.noised(np.random.default_rng(0), crops)
    silent = sample.cond.pooled.abs().sum(-1) == 0
    assert silent.tolist() == [True, True, False, False]


def test_only_the_block_has_gradients_and_the_frozen_network_no_dropout():
    prior = tiny.prior(replace(tiny.MODULATED, dropout=0.5))
    error = objective(settings=Settings(split=1, dropout=0.0), prior=prior)
    error.net.train()
    loss = error.loss(error.net, 1, 2, 3)
    loss.backward()
    assert float(loss.detach()) == float(error.loss(error.net, 1, 2, 3).detach())
    assert all(name.startswith("talk.") and p.grad is not None for name, p in error.net.named_parameters())
    base = error.net._base[0]
    assert not base.training
    assert all(p.grad is None and not p.requires_grad for p in base.parameters())
