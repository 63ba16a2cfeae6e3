"""Training control: which numbers are given, that they have no noise, that only what should learns, exact resume."""

import re
from dataclasses import replace

import numpy as np
import pytest
import torch

from motionloom.cli import main
from motionloom.core.diffusion import cosine
from motionloom.core.errors import MotionloomError
from motionloom.core.features.layout import mask, ric
from motionloom.core.models.adapter import Adapter
from motionloom.core.models.prior import Prior, read_tensors, save_prior
from motionloom.core.skeleton import SMPL22
from motionloom_train.control import CONTROLS, NOTHING, ControlledError, draw_masks, some_frames, train_control
from motionloom_train.data.batches import Batches
from motionloom_train.data.sets import load_set
from motionloom_train.loop import Training
from motionloom_train.low_rank import adapted, show
from motionloom_train.modules import prior_module
from motionloom_train.objectives import WordBank
from motionloom_train.recipe import Recipe
from motionloom_train.tensors import conditions, noised, tensor
from tests.recorded import tiny
from tests_train import runs

PLAN = {"name": "wrist", "control": "left_wrist", "rank": 2, "given_rank": 4, "steps": 8, "save_every": 4, "net": {}}


@pytest.fixture(scope="module")
def data(tmp_path_factory):
    return runs.write_set(tmp_path_factory.mktemp("set"))


@pytest.fixture(scope="module")
def start(tmp_path_factory) -> str:
    """A weight file to begin from."""
    return str(save_prior(tiny.prior(), tmp_path_factory.mktemp("prior") / "tiny.safetensors"))


def trained(data, out, start: str, *, stop: int | None = None, **changes):
    recipe = runs.recipe(**(PLAN | {"start": start} | changes))
    lines: list[str] = []
    return train_control(Training(recipe, out, "cpu", stop, lines.append), data, tiny.text()), lines


@pytest.mark.parametrize("control", CONTROLS)
def test_masks_give_what_the_control_says_and_nothing_else(control):
    """Numbers outside the control and the root's four are never given; about one row in twenty gives nothing."""
    lengths = np.full(400, 60)
    masks = draw_masks(control, lengths, 60, rng=np.random.default_rng(1))
    ever = masks.any(axis=(0, 1))
    target = mask("root_horizontal") if control == "trajectory" else np.ones(263, bool)
    if control not in ("any", "trajectory"):
        target = mask(control) | (np.arange(263) < 4)
    np.testing.assert_array_equal(ever, target)
    empty = float((~masks.any(axis=(1, 2))).mean())
    assert NOTHING / 3 < empty < NOTHING * 3
    frames = masks.any(axis=2).mean(axis=1)
    assert 0.25 < (frames == 1).mean() < 0.95  # dense in many rows, and sparse in many
    assert ((frames > 0) & (frames < 0.3)).mean() > 0.02


def test_a_joint_mostly_comes_with_its_root():
    """A hand in the world is a hand and a root: three in four rows give both."""
    masks = draw_masks("head", np.full(600, 40), 40, rng=np.random.default_rng(2))
    masks = masks[masks.any(axis=(1, 2))]
    assert masks[:, :, ric(15)].any(axis=(1, 2)).all()
    assert 0.68 < masks[:, :, :4].any(axis=(1, 2)).mean() < 0.82


def test_any_gives_every_joint_and_some_whole_poses():
    masks = draw_masks("any", np.full(600, 40), 40, rng=np.random.default_rng(3))
    for joint in range(1, len(SMPL22)):
        assert masks[:, :, ric(joint)].any(axis=(1, 2)).mean() > 0.1
    assert 0.03 < masks.all(axis=2).any(axis=1).mean() < 0.3


def test_chosen_frames_lie_within_the_motion():
    """Sparse frames are never in the padding, and there is at least one."""
    rng = np.random.default_rng(4)
    for length in (1, 2, 5, 30):
        for _ in range(100):
            chosen = some_frames(length, 30, 0.0, rng)
            assert chosen.any()
            assert not chosen[length:].any()


def test_given_numbers_of_a_training_state_have_no_noise(data):
    """Algorithm 1: signal * x_0 where given, noise everywhere else; the network is told both."""
    motions, schedule, calls = load_set(data), cosine(50), []
    batches = Batches(motions, windows=[32], shares=[1.0])
    words = WordBank(tiny.text(), motions.texts, progress=lambda line: None)

    class Spy(torch.nn.Module):
        def forward(self, x, level, cond, known, mask):
            calls.append((x, level, known, mask))
            return x

    objective = ControlledError(Spy(), schedule, batches, words, Recipe(control="left_wrist"))
    first, again, later = (objective.loss(objective.net, 0, step, 16) for step in (1, 1, 2))
    assert first == again != later
    x, level, clean, flags = calls[0]
    signal = tensor(schedule.signal)[level].float()[:, None, None].expand_as(x)
    torch.testing.assert_close(x[flags], (signal * clean)[flags])
    assert float(((x - signal * clean)[~flags] != 0).float().mean()) > 0.999
    rng = np.random.default_rng((0, 1, 2))
    assert torch.equal(flags, torch.from_numpy(draw_masks("left_wrist", np.full(16, 32), 32, rng=rng)))


def test_a_run_makes_an_adapter_of_its_prior_and_leaves_the_prior_alone(data, start, tmp_path):
    place, lines = trained(data, tmp_path, start)
    prior = Prior.load(start)
    adapter = Adapter.load(place, prior)
    assert (adapter.name, adapter.control, adapter.rank, adapter.given_rank) == ("wrist", "left_wrist", 2, 4)
    assert adapter.licence == "free"
    assert adapter.notes["steps"] == 8
    assert np.abs(adapter.tensors["out.up"]).max() > 0
    assert set(read_tensors(tmp_path / "state.safetensors")[0]).isdisjoint({"net.embed.weight", "net.net.embed.weight"})
    assert re.search(r"[\d,]+ trained parameters", lines[1])


def test_a_stopped_run_goes_on_to_the_same_file(data, start, tmp_path):
    whole, _ = trained(data, tmp_path / "whole", start)
    trained(data, tmp_path / "parts", start, stop=4)
    parts, _ = trained(data, tmp_path / "parts", start)
    assert whole.read_bytes() == parts.read_bytes()


def test_training_brings_the_given_numbers_nearer(data, start, tmp_path):
    """On the windows it is trained on, the told adapter answers the given numbers better than the prior."""
    place, _ = trained(
        data,
        tmp_path,
        start,
        steps=60,
        warmup=5,
        rate=1e-2,
        ema=0.9,
        control="trajectory",
        save_every=60,
        windows=[32],
        shares=[1.0],
        batch=16,
    )
    prior = Prior.load(start)
    motions = load_set(data)
    clean = (motions.features[:64].reshape(2, 32, 263) * motions.std + motions.mean - tensor(prior.mean)) / tensor(
        prior.std
    )
    flags = torch.from_numpy(mask("root_horizontal")).expand_as(clean)
    noise = torch.randn(clean.shape, generator=torch.Generator().manual_seed(1))
    base, level = prior_module(prior), torch.tensor([35, 35])
    x = noised(prior.schedule, clean, level, noise * ~flags)
    bound = base.bind(conditions(prior.condition(["", ""])))

    def error(net) -> float:
        return float((net(x, 35, show(net, bound, clean, flags)) - clean)[flags].square().mean())

    with torch.no_grad():
        assert error(adapted(base, Adapter.load(place, prior))) < 0.7 * error(base)


def test_an_adapter_goes_on_from_another(data, start, tmp_path):
    """The first step's loss is that of the adapter it begins with, and a rank that differs is refused."""
    first, _ = trained(data, tmp_path / "any", start, control="any", name="any")
    second, _ = trained(data, tmp_path / "next", start, adapter=str(first), rate=1e-12, steps=1)
    prior = Prior.load(start)
    before, after = Adapter.load(first, prior), Adapter.load(second, prior)
    for key, value in before.tensors.items():
        np.testing.assert_allclose(after.tensors[key], value, rtol=0, atol=1e-6)
    with pytest.raises(MotionloomError, match="copy them"):
        trained(data, tmp_path / "other", start, adapter=str(first), rank=3)


def test_a_full_fine_tune_is_a_prior_with_other_weights(data, start, tmp_path):
    place, _ = trained(data, tmp_path, start, full=True, steps=2, rate=1e-3)
    tuned, base = Prior.load(place), Prior.load(start)
    assert tuned.card.notes["control"] == "left_wrist"
    assert np.array_equal(tuned.mean, base.mean)
    changed = [k for k, v in tuned.net.weights.items() if not np.array_equal(v, base.net.weights[k])]
    assert len(changed) > 0.9 * len(base.net.weights)


def test_held_out_errors_are_reported_beside_the_base_networks(data, start, tmp_path, monkeypatch):
    """With an untrained adapter (rate next to nothing) both are the same numbers."""
    monkeypatch.setattr("motionloom_train.control.HELD_WINDOW", 30)
    (tmp_path / "set" / "clips").mkdir(parents=True)
    for path in (data / "clips").iterdir():
        (tmp_path / "set" / "clips" / path.name).symlink_to(path)
    (tmp_path / "set" / "set.json").write_text("{}")
    from motionloom_train.data.clips import read_clip, write_clip

    clip = read_clip(next((data / "clips").iterdir()))
    write_clip(tmp_path / "set" / "clips", replace(clip, name="held", split="val"))
    _, lines = trained(tmp_path / "set", tmp_path / "run", start, steps=1, rate=1e-12)
    match = re.search(
        r"given numbers (\S+) \(base network (\S+)\), free numbers (\S+) \(base network (\S+)\)", lines[-1]
    )
    assert match
    known, given0, free, free0 = map(float, match.groups())
    assert known == pytest.approx(given0, abs=1e-3)
    assert free == pytest.approx(free0, abs=1e-3)


MISTAKES = {
    "no control": ({"control": ""}, "which control"),
    "unknown control": ({"control": "tail"}, "no control called"),
    "empty control": ({"control": "pelvis"}, "nothing to train"),
    "both": ({"full": True, "adapter": "any"}, "one of full and adapter"),
    "no adapter": ({"adapter": "nowhere"}, "no adapter"),
}


@pytest.mark.parametrize(("changes", "words"), MISTAKES.values(), ids=MISTAKES)
def test_what_cannot_be_trained_is_refused(data, start, tmp_path, changes, words):
    with pytest.raises(MotionloomError, match=words):
        trained(data, tmp_path, start, **changes)


def test_the_command_trains(data, start, tmp_path, capsys):
    recipe = tmp_path / "r.toml"
    recipe.write_text(
        f'name = "feet"\ncontrol = "left_foot,right_foot"\nstart = "{start}"\nsteps = 1\nbatch = 2\nlevels = 50\n'
        "windows = [20]\nshares = [1.0]\nrank = 1\n"
    )
    words = ["train", "control", "--recipe", str(recipe), "--data", str(data), "--out", str(tmp_path / "run")]
    assert main([*words, "--text", start, "--device", "cpu"]) == 0
    assert "feet.safetensors" in capsys.readouterr().out
    assert (tmp_path / "run" / "feet.safetensors").is_file()
