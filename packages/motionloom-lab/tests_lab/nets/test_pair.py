"""Two people from two frozen priors: exchange, batches, the silent block, what is trained, and the file."""

import json
from dataclasses import replace

import numpy as np
import pytest
import torch
from hypothesis import given, settings
from hypothesis import strategies as st
from safetensors.numpy import save_file
from torch import Tensor

from motionloom.core.diffusion import DDPM, guide, inpaint, levels, observe, row_noise, run
from motionloom.core.errors import MotionloomError
from motionloom.core.features.pair import PUBLISHED_CODE, PlaceCode, along, compose, decode, from_world, relative
from motionloom.core.models import pair as pair_block
from motionloom.core.models.adapter import fingerprint
from motionloom.core.models.container import PAIRS, graph_tensors
from motionloom.core.models.networks import pair as runtime_pair
from motionloom.core.models.networks.prior_condition import Bound as arrays_of
from motionloom.core.models.pair import PairBlock, blocks
from motionloom_lab.papers.mdm import adds_of, from_published_pair, is_pair
from motionloom_lab.papers.published_priors import import_block
from motionloom_train.export import pair_graph
from motionloom_train.modules import arrays, prior_session
from motionloom_train.nets.pair import PairConfig, PairNet, Talk, fitting, join, other, part
from motionloom_train.nets.prior import Bound, NetConfig, condition
from tests.recorded import tiny
from tests.recorded.tiny import WIDTH as TEXT
from tests_lab.papers.test_mdm import table
from tests_train.nets.modules import pair_session, tiny_net

VARIANTS = {"modulated": tiny.MODULATED, "published": tiny.PUBLISHED}
variants = pytest.mark.parametrize("variant", sorted(VARIANTS))
FRAMES = 18


def talk_of(prior: NetConfig, *, fresh: bool = False, seed: int = 5, **options) -> Talk:
    """A block; unless ``fresh`` it has much to say."""
    config = fitting(
        prior, layers=options.pop("layers", 1), split=options.pop("split", None), aware=options.pop("aware", False)
    )
    torch.manual_seed(seed)
    talk = Talk(config, prior)
    with torch.no_grad():
        for value in () if fresh else talk.parameters():
            value.add_(torch.randn(value.shape) * 0.3)
    return talk.eval()


def net_of(variant: str, **options) -> PairNet:
    prior = tiny.prior(VARIANTS[variant])
    talk = talk_of(VARIANTS[variant], **options)
    mean, std = torch.from_numpy(prior.mean), torch.from_numpy(prior.std)
    return PairNet(tiny_net(VARIANTS[variant]), talk, prior.schedule, mean=mean, std=std).eval()


def bound_of(net: PairNet, rows: int, seed: int = 1, lengths: list[int] | None = None) -> Bound:
    rng = torch.Generator().manual_seed(seed)
    words = torch.randn(rows, 5, TEXT, generator=rng)
    tokens = words if net.config.variant == "modulated" else None
    return net.bind(condition(words.mean(1), tokens=tokens, lengths=lengths))


def state_of(rows: int, seed: int = 2, frames: int = FRAMES) -> Tensor:
    return torch.randn(rows, 1 + frames, 263, generator=torch.Generator().manual_seed(seed))


def chosen(bound: Bound, rows: Tensor) -> Bound:
    return Bound(*(value[rows] for value in bound))


@variants
def test_the_prior_in_three_parts_is_the_prior(variant):
    prior = tiny_net(VARIANTS[variant])
    words = torch.randn(4, 5, TEXT)
    bound = prior.bind(condition(words.mean(1), tokens=words if prior.modulated else None, lengths=[18, 7, 11, -1]))
    x, level = state_of(4)[:, 1:], torch.tensor([3, 9, 20, 50])
    inner = prior.through(prior.enter(x, level, bound), bound, slice(1))
    parts = prior.leave(prior.through(inner, bound, slice(1, None)), FRAMES)
    torch.testing.assert_close(parts, prior(x, level, bound), rtol=0, atol=0)


@variants
@pytest.mark.parametrize("split", [0, 1, 2])
def test_a_fresh_block_leaves_both_priors_exactly_as_they_are(variant, split):
    net = net_of(variant, fresh=True, split=split)
    x, bound = state_of(4), bound_of(net, 4)
    places, motion = part(net(x, 7, bound))
    assert torch.equal(motion, tiny_net(VARIANTS[variant])(x[:, 1:], 7, bound))
    assert not places.any()


@pytest.mark.parametrize("aware", [False, True], ids=["plain", "aware"])
@variants
@settings(max_examples=4, deadline=None)
@given(seed=st.integers(0, 1000), split=st.sampled_from([0, 1, 2]))
def test_exchanged_people_have_exchanged_guesses(variant, aware, seed, split):
    net = net_of(variant, split=split, aware=aware)
    x, bound, level = state_of(6, seed), bound_of(net, 6, seed), torch.tensor([3, 3, 20, 20, 50, 50])
    exchanged = other(torch.arange(6))
    there = net(x[exchanged], level, chosen(bound, exchanged))
    torch.testing.assert_close(there[exchanged], net(x, level, bound), rtol=0, atol=2e-5)


@pytest.mark.parametrize("aware", [False, True], ids=["plain", "aware"])
@variants
def test_a_pair_alone_is_the_pair_in_a_batch_with_padding(variant, aware):
    net = net_of(variant, aware=aware)
    lengths = [18, 18, 10, 10]
    x, bound = state_of(4), bound_of(net, 4, lengths=lengths)
    batch = net(x, 9, bound)
    alone = chosen(bound, torch.tensor([2, 3]))._replace(lengths=torch.tensor([-1, -1]))
    single = net(x[2:, :11], 9, alone)
    torch.testing.assert_close(batch[2:, :11], single, rtol=0, atol=8e-5)


@variants
def test_what_one_person_does_reaches_the_other_and_nobody_else(variant):
    net = net_of(variant)
    x, bound = state_of(4), bound_of(net, 4)
    before = net(x, 9, bound)
    moved = x.clone()
    moved[1, 5] += 1  # b of the first pair
    after = net(moved, 9, bound)
    assert (after - before)[0, 1:].abs().max() > 1e-3
    assert (after - before)[0, 0, :4].abs().max() > 1e-4
    torch.testing.assert_close(after[2:], before[2:], rtol=0, atol=1e-6)


@variants
def test_where_they_stand_reaches_both_and_the_other_numbers_of_that_slot_nobody(variant):
    net = net_of(variant, seed=7)
    x, bound = state_of(2), bound_of(net, 2)
    before = net(x, 9, bound)
    moved = x.clone()
    moved[0, 0, 4:] += 1
    assert torch.equal(net(moved, 9, bound), before)
    moved[0, 0, 2] += 1
    after = net(moved, 9, bound)
    assert all((after - before)[row, 1:].abs().max() > 1e-5 for row in (0, 1))
    assert not before[:, 0, 4:].any()


def test_an_aware_block_sees_where_the_others_head_and_wrists_are():
    """Against the two motions decoded into one world by `features.pair`, each looked at from the other's root."""
    net = net_of("modulated", aware=True)
    bound, x = bound_of(net, 2), state_of(2)
    poses = torch.tensor([[1.0, 0.0, 0.0, 0.0], [-0.6, 0.8, 0.3, 2.0]])
    base, mean, std, _ = net._base
    inner = base.through(base.enter(x[:, 1:], 1, bound), bound, slice(2))
    signal, noise = net.schedule.at(1)
    trust = signal * 0.49 / (0.49 * signal**2 + noise**2)
    places, signals = net.talk.config.places.encode(poses) / trust, torch.full((2,), float(signal))
    partner = net._other_seen(inner, bound, places, signals, None, FRAMES)
    assert partner.shape == (2, 5, 4 * 13)
    partner = partner.reshape(2, 20, 13)
    assert not partner[:, FRAMES:].any()
    guess = base(x[:, 1:], 1, bound) * std + mean
    world, way = decode(guess, poses), compose(poses[:, None], along(guess))
    for me, him in ((0, 1), (1, 0)):
        places = from_world(world[him], way[me][:, None])
        expected = torch.cat([relative(way[me], way[him]), places[:, [15, 20, 21]].flatten(1)], dim=-1)
        torch.testing.assert_close(partner[me, :FRAMES], expected.clamp(-5, 5), rtol=0, atol=1e-4)


@variants
def test_only_the_block_is_trained_and_nothing_is_dropped_in_the_prior(variant):
    config = replace(VARIANTS[variant], dropout=0.5)
    prior = tiny_net(config).requires_grad_(True).train()
    talk = Talk(replace(fitting(config), dropout=0.0), config)
    net = PairNet(prior, talk, tiny.prior().schedule, mean=torch.zeros(263), std=torch.ones(263)).train()
    bound = bound_of(net, 2)
    first, second = (net(state_of(2), 9, bound) for _ in range(2))
    assert torch.equal(first, second)  # no dropout anywhere
    first.square().sum().backward()
    assert all(p.grad is None for p in prior.parameters())
    assert all(name.startswith("talk.") for name, _ in net.named_parameters())
    grown = talk.out.weight.grad if talk.out else talk.blocks[-1].norm2.weight.grad  # type: ignore[union-attr]
    assert grown is not None
    assert grown.abs().max() > 0
    assert set(net.state_dict()) == {f"talk.{key}" for key in talk.state_dict()}


@variants
def test_a_fresh_block_learns_where_people_stand_and_what_they_do(variant):
    net = net_of(variant, fresh=True).train()
    x, bound, goal = state_of(4), bound_of(net, 4), state_of(4, 9) * 0.3
    goal[:, 0, 4:] = 0
    optimizer = torch.optim.Adam(net.parameters(), lr=1e-2)
    losses = []
    for _ in range(60):
        off = (net(x, 9, bound) - goal).square()
        loss, places = off.sum((1, 2)), off[:, 0].sum(-1)
        optimizer.zero_grad()
        (loss.sum() + 100 * places.sum()).backward()
        optimizer.step()
        losses.append((float(loss.sum().detach()), float(places.sum().detach())))
    assert losses[-1][0] < 0.9 * losses[0][0]
    assert losses[-1][1] < 0.1 * losses[0][1]


@variants
def test_guidance_and_known_numbers_compose_in_the_one_loop(variant):
    prior, net = tiny.prior(VARIANTS[variant]), pair_session(net_of(variant))
    known = state_of(4, 4).numpy()
    mask = np.zeros(known.shape, bool)
    mask[:, :9], mask[0::2] = True, True  # the place and 8 frames; all of the first people

    def sample(rows: list[int]) -> np.ndarray:
        cond = prior.condition(["the cat sat"] * 4)
        bound, null = ([part[rows] for part in net.bind(one)] for one in (cond, cond.null()))
        draw = row_noise([[10, 11, 12, 13][row] for row in rows])
        options, held = known[rows], mask[rows]
        hold = observe(options, held, prior.schedule, draw)
        denoise = inpaint(guide(net, arrays_of(*bound), arrays_of(*null), 2.5), options, held)
        way = levels(prior.schedule, 5)
        x = hold(draw(options), 50)
        return run(denoise, x, levels=way, solver=DDPM, schedule=prior.schedule, noise=draw, constrain=hold)

    whole = sample([0, 1, 2, 3])
    np.testing.assert_array_equal(whole[mask], known[mask])
    assert np.isfinite(whole).all()
    np.testing.assert_array_equal(sample([0, 1]), whole[:2])


def test_states_are_put_together_and_taken_apart():
    places, motion = torch.randn(4, 4), torch.randn(4, 9, 263)
    state = join(places, motion)
    assert torch.equal(part(state)[0], places)
    assert torch.equal(part(state)[1], motion)
    assert not state[:, 0, 4:].any()
    plain = runtime_pair.join(places.numpy(), motion.numpy())  # the same without PyTorch
    np.testing.assert_array_equal(plain, state)
    np.testing.assert_array_equal(runtime_pair.part(plain)[0], places)
    for shape in ((3, 9, 263), (2, 1, 263)):
        net = net_of("published")
        with pytest.raises(MotionloomError, match="even number"):
            net(torch.zeros(shape), 3, bound_of(net, shape[0]))


@pytest.mark.parametrize(
    "config",
    [
        PairConfig(width=32, split=3),
        PairConfig(width=64, split=1),
        PairConfig(width=32, split=1, aware=True, places=PUBLISHED_CODE),
    ],
    ids=["split", "width", "aware"],
)
def test_a_block_that_does_not_fit_a_prior_is_refused(config):
    with pytest.raises(MotionloomError):
        Talk(config, tiny.PUBLISHED)


def test_other_blocks_that_do_not_fit():
    with pytest.raises(MotionloomError, match="condition token"):
        Talk(PairConfig(width=32, split=1, adds="condition"), tiny.MODULATED)
    with pytest.raises(MotionloomError, match="flags"):
        Talk(PairConfig(width=32, split=1), NetConfig(width=32, layers=2, flags=True))
    for odd in (
        {"layers": 0},
        {"width": 30},
        {"split": -1},
        {"dropout": 2},
        {"adds": "no"},
        {"aware": 1},
        {"x": 1},
        {"places": {"kind": "no"}},
        {"places": 3},
        {"layers": True},
    ):
        with pytest.raises(MotionloomError):
            PairConfig.parse(odd)


# The file


def block_of(variant: str, **options) -> tuple[PairBlock, object]:
    prior = tiny.prior(VARIANTS[variant])
    talk = talk_of(VARIANTS[variant], **options)
    graph = pair_graph(talk.config, prior.net.config)
    about = ("tiny", fingerprint(prior.net), "free", "two people", {"n": 1})
    return PairBlock("dance", talk.config, arrays(talk), *about, graph=graph), prior


@variants
def test_a_block_comes_back_from_its_file(variant, tmp_path):
    block, prior = block_of(variant, aware=True, layers=2)
    back = PairBlock.load(block.save(tmp_path / "a.safetensors", half=False), prior)  # type: ignore[arg-type]
    assert (back.name, back.config, back.licence, back.notes) == ("dance", block.config, "free", {"n": 1})
    x, net = state_of(2).numpy(), back.net(prior)  # type: ignore[arg-type]
    bound = net.bind(prior.condition(["a person walks", ""]))  # type: ignore[attr-defined]
    np.testing.assert_array_equal(net(x, 5, bound), block.net(prior)(x, 5, bound))  # type: ignore[arg-type]
    small = PairBlock.load(block.save(tmp_path / "b.safetensors"), prior)  # type: ignore[arg-type]
    np.testing.assert_allclose(small.net(prior)(x, 5, bound), net(x, 5, bound), rtol=0, atol=0.05)  # type: ignore[arg-type]
    sizes = [(tmp_path / name).stat().st_size - len(block.graph) for name in ("a.safetensors", "b.safetensors")]
    assert sizes[1] < 0.6 * sizes[0]


def test_a_block_of_the_default_prior_is_a_few_megabytes():
    default = NetConfig(variant="modulated", width=320, layers=6, heads=5, hidden=1024, text=384, patch=4, dropout=0.02)
    with torch.device("meta"):
        talk = Talk(fitting(default, aware=True), default)
    assert 2 * sum(p.numel() for p in talk.parameters()) < 4e6


def test_another_priors_block_is_refused(tmp_path):
    block, _ = block_of("modulated")
    path = block.save(tmp_path / "a.safetensors")
    with pytest.raises(MotionloomError, match="belongs to the weights 'tiny'"):
        PairBlock.load(path, tiny.prior(seed=3))


def test_hostile_files_are_refused(tmp_path, monkeypatch):
    block, prior = block_of("modulated")
    path = block.save(tmp_path / "a.safetensors")
    assert path.is_file()
    about = {"format": 1, "name": "a", "base": "b", "fingerprint": block.fingerprint, "licence": "c", "data": "d"}
    sizes = {"width": 32, "heads": 2, "hidden": 48, "split": 2}
    good = {k: v.copy() for k, v in block.tensors.items()}
    graph = graph_tensors({"pair": block.graph})
    first = sorted(good)[0]
    cases = {
        "nothing": (None, good),
        "list": ([1], good),
        "newer": (about | {"format": 2, "config": sizes}, good),
        "no sizes": (about, good),
        "odd sizes": (about | {"config": sizes | {"width": -1}}, good),
        "huge": (about | {"config": sizes | {"width": 8192, "heads": 4}}, good),
        "number for text": (about | {"config": sizes, "licence": 3}, good),
        "missing": (about | {"config": sizes}, {k: v for k, v in good.items() if k != first}),
        "more": (about | {"config": sizes}, good | {"x": np.zeros(1, np.float32)}),
        "shape": (about | {"config": sizes}, good | {first: np.zeros(1, np.float32)}),
        "nan": (about | {"config": sizes}, good | {first: good[first] * np.float32(np.nan)}),
        "whole numbers": (about | {"config": sizes}, good | {first: good[first].astype(np.int64)}),
        "no graph": (about | {"config": sizes}, good),
        "another graph": (about | {"config": sizes}, good | graph_tensors({"pair": prior.net.graphs["bind"]})),
        "bytes": (about | {"config": sizes}, good | graph_tensors({"pair": b"no graph"})),
    }
    for number, (said, tensors) in enumerate(cases.values()):
        bad = tmp_path / f"{number}.safetensors"
        save_file(tensors, bad, metadata={} if said is None else {PAIRS.key: json.dumps(said)})
        with pytest.raises(MotionloomError) as caught:
            PairBlock.load(bad, prior)  # type: ignore[arg-type]
        assert str(caught.value).count("\n") == 0
    save_file(good | graph, tmp_path / "good.safetensors", metadata={PAIRS.key: json.dumps(about | {"config": sizes})})
    PairBlock.load(tmp_path / "good.safetensors", prior)  # type: ignore[arg-type]
    (tmp_path / "cut.safetensors").write_bytes(path.read_bytes()[:-5])
    for name in ("cut.safetensors", "no-such-file"):
        with pytest.raises(MotionloomError):
            PairBlock.load(tmp_path / name, prior)  # type: ignore[arg-type]
    monkeypatch.setattr(pair_block, "PAIRS", replace(pair_block.PAIRS, max_bytes=1000))
    with pytest.raises(MotionloomError, match="larger"):
        PairBlock.load(path, prior)  # type: ignore[arg-type]
    with pytest.raises(MotionloomError, match="suffix"):
        block.save(tmp_path / "a.pt")
    assert all(name.isidentifier() for name in blocks())


# Published checkpoints


def published(layers: int = 2, split: int = 3, width: int = 16) -> dict[str, Tensor]:
    """A checkpoint of two people of the published form, but narrow."""
    whole = table(263, width=width, layers=5, hidden=24)
    start, end = "seqTransEncoder_start.layers.", "seqTransEncoder_end.layers."
    shapes: dict[str, tuple[int, ...]] = {}
    for key, shape in whole.items():
        stack, _, rest = key.partition(".layers.")
        number, _, leaf = rest.partition(".")
        if stack != "seqTransEncoder":
            shapes[key] = shape
        else:
            n = int(number)
            shapes[f"{start}{n}.{leaf}" if n < split else f"{end}{n - split}.{leaf}"] = shape
            if n < layers:
                shapes[f"multi_person.model.layers.{n}.{leaf}"] = shape
    shapes |= {
        "multi_person.canon_agg.weight": (width, 8),
        "multi_person.canon_agg.bias": (width,),
        "multi_person.canon_out.weight": (4, width),
        "multi_person.canon_out.bias": (4,),
        "multi_person.aggregation.weight": (width, 2 * width),
        "multi_person.aggregation.bias": (width,),
    }
    rng = torch.Generator().manual_seed(0)
    return {key: torch.randn(shape, generator=rng) * 0.2 for key, shape in shapes.items()}


def test_a_published_checkpoint_comes_apart_where_its_block_sits(tmp_path):
    state = published()
    assert is_pair(state)
    prior, talk = from_published_pair(state)
    assert (talk.config.split, talk.config.layers, prior.config.layers) == (3, 2, 5)
    assert talk.config.places == PUBLISHED_CODE
    assert torch.equal(prior.state_dict()["blocks.4.norm2.bias"], state["seqTransEncoder_end.layers.1.norm2.bias"])
    torch.save(state, tmp_path / "model000100000.pt")
    (tmp_path / "args.json").write_text(json.dumps({"multi_func": "in_both_out_cond"}))
    whole = tiny.prior()
    block = import_block(tmp_path / "model000100000.pt", replace(whole, net=prior_session(prior)), base="pw3d")
    assert block.config.adds == "condition"
    assert block.name == "model000100000"
    np.testing.assert_array_equal(block.tensors["place.weight"], state["multi_person.canon_out.weight"])
    with pytest.raises(MotionloomError, match="same file"):
        import_block(tmp_path / "model000100000.pt", whole, base="tiny")


def test_published_checkpoints_that_do_not_fit_are_refused():
    good = published()
    one = "multi_person.canon_out.weight"
    for change in (
        {one: torch.zeros(5, 16)},
        {one: torch.full((4, 16), float("nan"))},
        {"multi_person.else.weight": torch.zeros(1)},
        {"seqTransEncoder_end.layers.x.norm1.bias": torch.zeros(16)},
        {"multi_person.model.layers.7.norm1.bias": torch.zeros(16)},
    ):
        with pytest.raises(MotionloomError):
            from_published_pair(good | change)
    for gone in (one, "multi_person.model.layers.0.linear1.weight", "seqTransEncoder_start.layers.1.norm1.bias"):
        with pytest.raises(MotionloomError):
            from_published_pair({k: v for k, v in good.items() if k != gone})
    with pytest.raises(MotionloomError, match="multi_func"):
        adds_of({"multi_func": "in_both_out_direct"})


def test_the_condition_alone_is_corrected_where_that_is_said():
    _prior, talk = from_published_pair(published(), adds="condition")
    tokens = torch.randn(2, 7, 16)
    change, _ = talk(tokens, torch.randn(2, 4), None, None)
    assert change[:, 0].abs().max() > 0
    assert not change[:, 1:].any()


def test_codes_of_places_live_in_the_file(tmp_path):
    block, prior = block_of("published")
    moved = replace(block, config=replace(block.config, places=PlaceCode("world", 0.1, 0.1)))
    assert PairBlock.load(moved.save(tmp_path / "a.safetensors"), prior).config.places == PUBLISHED_CODE  # type: ignore[arg-type]
