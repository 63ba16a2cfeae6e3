"""Runs that train two people: exact resume, the best step, what is learned, what is refused."""

from dataclasses import replace

import numpy as np
import pytest

from motionloom.cli import main
from motionloom.core.errors import MotionloomError
from motionloom.core.models.adapter import fingerprint
from motionloom.core.models.pair import PairBlock
from motionloom.core.models.prior import Prior, read_tensors, save_prior
from motionloom_train.data.pairs import Pair
from motionloom_train.loop import Training
from motionloom_train.modules import pair_module
from motionloom_train.pair import held_out, train_pair
from tests.recorded import tiny
from tests_lab.data.test_pairs import write_pair
from tests_train.test_pair import TEXT, objective, pair, recipe, walkers


@pytest.fixture(scope="module")
def start(tmp_path_factory) -> str:
    return str(save_prior(tiny.prior(), tmp_path_factory.mktemp("prior") / "tiny.safetensors"))


def trained(out, start: str, *, stop: int | None = None, pairs=None, **changes):
    lines: list[str] = []
    pairs = pairs or [pair(), pair("b", turn=2.0), pair("c", "val", turn=1.0)]
    return train_pair(Training(recipe(start=start, **changes), out, "cpu", stop, lines.append), pairs), lines


def test_a_stopped_run_goes_on_exactly_and_its_file_is_a_block_for_the_prior(start, tmp_path):
    whole, lines = trained(tmp_path / "whole", start)
    trained(tmp_path / "parts", start, stop=4)
    parts, _ = trained(tmp_path / "parts", start)
    for a, b in ((whole, parts), (whole.with_name("last.safetensors"), parts.with_name("last.safetensors"))):
        assert a.read_bytes() == b.read_bytes()
    one, two = (read_tensors(place.with_name("state.safetensors"))[0] for place in (whole, parts))
    assert one.keys() == two.keys()
    assert all(np.array_equal(one[key], two[key]) for key in one)
    assert all("talk." in key for key in one if key.startswith("net."))
    prior = Prior.load(start)
    block = PairBlock.load(whole, prior)
    assert block.fingerprint == fingerprint(prior.net)
    assert block.data == "free"
    assert block.notes["pairs"] == ["walk", "b"]
    assert sum("held-out" in line for line in lines) == 2


def test_the_file_holds_the_step_that_did_best_on_the_held_out_pair(start, tmp_path):
    place, _ = trained(tmp_path, start, rate=2e-3)
    prior = Prior.load(start)
    good = PairBlock.load(place, prior)
    place, lines = trained(tmp_path, start, steps=12, rate=5.0, ema=0.0)  # going on, and all is lost
    best, last = PairBlock.load(place, prior), PairBlock.load(place.with_name("last.safetensors"), prior)
    assert best.notes == good.notes
    assert last.notes["steps"] == 12
    assert last.notes["held_out"]["loss"] > best.notes["held_out"]["loss"]
    assert "best" not in lines[-1]
    assert "going on with another recipe" in " ".join(lines)
    held = held_out(objective(prior=prior), [pair("c", "val", turn=1.0)])
    assert held is not None
    assert held.report(pair_module(best, prior)).loss == pytest.approx(best.notes["held_out"]["loss"], rel=0.02)


def test_without_held_out_pairs_the_last_step_is_the_result(start, tmp_path):
    place, lines = trained(tmp_path, start, pairs=[pair()])
    assert PairBlock.load(place, Prior.load(start)).notes["steps"] == 8
    assert not any("held-out" in line for line in lines)


def test_training_teaches_a_made_up_pair(start, tmp_path):
    """After 300 steps it is known better where the two of a pair stand, who always stand alike."""
    rows = np.repeat(walkers()[:, :1], 60, axis=1) + np.zeros((2, 60, 1, 1))
    still = [Pair(str(split), split, (TEXT,), "own", "free", rows) for split in ("train", "val")]
    place, _ = trained(tmp_path, start, pairs=still, steps=300, save_every=300, rate=5e-3, ema=0.97)
    block = PairBlock.load(place, Prior.load(start))
    assert block.notes["held_out"]["place"] < 0.8 * block.notes["fresh"]["place"]


BAD = {
    "short": (lambda: [replace(pair(), positions=walkers()[:, :20])], {}, "longest pair to train on has 20 frames"),
    "no training": (lambda: [pair(split="test")], {}, "no pair is for training"),
    "nothing said": (lambda: [pair(captions=())], {}, "no pair says what its people do"),
    "unknown": (lambda: [pair()], {"prefixes": 0.1}, "no setting 'prefixes'"),
    "kind": (lambda: [pair()], {"layers": 1.5}, "layers must be of kind int"),
    "shares": (lambda: [pair()], {"prefix": 0.8, "react": 0.4}, "are shares"),
    "split": (lambda: [pair()], {"split": 7}, "after layer 7"),
}


@pytest.mark.parametrize("case", sorted(BAD))
def test_what_cannot_be_trained_is_said_in_one_sentence_and_nothing_is_written(case, start, tmp_path):
    pairs, table, message = BAD[case]
    with pytest.raises(MotionloomError, match=message) as caught:
        trained(tmp_path / "run", start, pairs=pairs(), pair=table)
    assert "\n" not in str(caught.value)
    assert not (tmp_path / "run").exists()


def test_completion_alone_needs_no_words(start, tmp_path):
    place, _ = trained(tmp_path, start, pairs=[pair(captions=())], pair={"prefix": 1.0, "react": 0.0}, steps=2)
    assert place.is_file()


def test_the_command_trains_on_a_user_s_folder_and_refuses_one_without_captions(start, tmp_path, capsys):
    write_pair(tmp_path / "own", "walk", walkers())
    plan = tmp_path / "plan.toml"
    plan.write_text(f'name = "two"\nstart = "{start}"\nsteps = 2\nbatch = 2\nwindows = [20]\nshares = [1.0]\n')
    command = ["train", "duet", "--pairs", str(tmp_path / "own"), "--recipe", str(plan), "--out", str(tmp_path / "run")]
    assert main(command) == 2
    assert "captions.txt" in capsys.readouterr().err
    assert not (tmp_path / "run").exists()
    (tmp_path / "own" / "captions.txt").write_text("walk: a person walks\n")
    assert main([*command, "--device", "cpu"]) == 0
    assert (tmp_path / "run" / "two.safetensors").is_file()
