"""The papers' methods agree with what is built on them, and with each other where one contains the other."""

import subprocess
import sys
from dataclasses import replace

import numpy as np
import pytest

from motionloom.core.defaults import GUIDANCE, SOLVER, SPACING, STEPS
from motionloom.core.diffusion import row_noise
from motionloom.core.errors import MotionloomError
from motionloom.core.features.layout import mask
from motionloom.core.methods.blending import control_by_blending
from motionloom.core.methods.com_mdm import com_mdm
from motionloom.core.methods.control import control
from motionloom.core.methods.edit import Observed, edit
from motionloom.core.methods.text import text_to_motion, to_motion
from motionloom.core.methods.walk import Walk
from motionloom.core.models.prior import Prior
from motionloom.requests import sampling as requested
from motionloom.tasks.pair import pair_features
from motionloom.tasks.text import sample_features
from tests.noise import normal
from tests.recorded import tiny
from tests.tasks.two_people import block as tiny_block

WALK = Walk(steps=5, spacing="index")
TEXTS, SEEDS = ["a person walks", "a person waves"], [3, 4]


@pytest.fixture(scope="module")
def prior() -> Prior:
    return tiny.prior()


def test_defaults_are_those_of_every_request() -> None:
    expected = (requested.STEPS, requested.SOLVER, requested.SPACING, requested.GUIDANCE)
    assert expected == (STEPS, SOLVER, SPACING, GUIDANCE)


def test_text_to_motion_is_what_the_command_samples(prior: Prior) -> None:
    features = text_to_motion(prior, TEXTS, 12, seeds=SEEDS, walk=WALK)
    same = sample_features(prior, TEXTS, [12, 12], seeds=SEEDS, steps=5, spacing="index")
    np.testing.assert_allclose(features, same, atol=1e-5)
    person = to_motion(features[0].astype(np.float64), prior.fps)
    assert len(person) == 12
    lengths = np.linalg.norm(person.positions()[:, 1] - person.positions()[:, 0], axis=-1)
    np.testing.assert_allclose(lengths, lengths[0], atol=1e-6)


def test_editing_keeps_what_is_known_and_nothing_known_is_text_alone(prior: Prior) -> None:
    known = normal((2, 12, 263), 1)
    between = np.zeros(known.shape, np.bool_)
    between[:, :3], between[:, -3:] = True, True
    motions = edit(prior, TEXTS, Observed(known, between), seeds=SEEDS, walk=WALK)
    assert np.array_equal(motions[between], known[between])
    free = edit(prior, TEXTS, Observed(known, between & False), seeds=SEEDS, walk=WALK)
    np.testing.assert_allclose(
        prior.to_features(free), text_to_motion(prior, TEXTS, 12, seeds=SEEDS, walk=WALK), atol=1e-4
    )


def test_control_by_one_network_is_blending_of_one(prior: Prior) -> None:
    known = normal((2, 12, 263), 2)
    wrist = Observed(known, np.broadcast_to(mask("left_wrist"), known.shape).copy())
    motions = control(prior, prior.net, TEXTS, wrist, seeds=SEEDS, walk=WALK)
    free = replace(wrist, noise_free=True)
    blended = control_by_blending(prior, [prior.net] * 2, TEXTS, free, seeds=SEEDS, weights=(0.3, 0.7), walk=WALK)
    np.testing.assert_allclose(motions, blended, atol=1e-4)
    assert np.array_equal(motions[wrist.mask], known[wrist.mask])


def test_two_people_are_those_of_the_command_without_its_guidance_of_places(prior: Prior) -> None:
    block = tiny_block(prior)
    pairs = com_mdm(prior, block, [("a person walks", "a person waves")], 12, seeds=[(3, 4)], walk=WALK)
    plain = {"steps": 5, "spacing": "index", "pair_guidance": 0.0, "bodies": False}
    same = pair_features(prior, block.net(prior), TEXTS, 12, seeds=SEEDS, **plain)
    np.testing.assert_allclose(pairs.poses, same.poses, atol=0.02)
    assert pairs.features.shape == same.features.shape == (1, 2, 12, 263)


def test_a_prefix_of_two_people_comes_back(prior: Prior) -> None:
    block = tiny_block(prior)
    pairs = com_mdm(prior, block, [("", "")], 12, seeds=[(3, 4)], walk=WALK)
    prefix = pairs._replace(features=pairs.features[:, :, :5])
    longer = com_mdm(prior, block, [("", "")], 16, seeds=[(5, 6)], prefix=prefix, walk=WALK)
    np.testing.assert_allclose(longer.features[:, :, :5], prefix.features, atol=1e-3)
    np.testing.assert_allclose(longer.poses, prefix.poses, atol=1e-5)
    with pytest.raises(MotionloomError, match="prefix"):
        com_mdm(prior, block, [("", "")], 5, seeds=[(5, 6)], prefix=prefix, walk=WALK)


@pytest.mark.parametrize(
    "wrong", [{"steps": 0}, {"steps": 10**6}, {"solver": "euler"}, {"spacing": "none"}, {"guidance": np.nan}]
)
def test_a_walk_that_cannot_be_walked_is_refused_in_a_sentence(wrong: dict, prior: Prior) -> None:
    with pytest.raises(MotionloomError) as caught:
        Walk(**wrong).levels(prior.schedule)
    assert "\n" not in str(caught.value)


@pytest.mark.parametrize(("texts", "seeds"), [([], []), (TEXTS, [1]), (TEXTS, [-1, 2]), (TEXTS, [1, 2**62])])
def test_texts_and_seeds_that_do_not_fit_are_refused(texts: list[str], seeds: list[int], prior: Prior) -> None:
    with pytest.raises(MotionloomError):
        text_to_motion(prior, texts, 12, seeds=seeds, walk=WALK)


def test_the_core_loads_nothing_of_the_house() -> None:
    """A motion is sampled and written, and of this project only `motionloom.core` has been imported."""
    code = (
        "import sys, importlib, pkgutil, motionloom.core as core\n"
        "for module in pkgutil.walk_packages(core.__path__, 'motionloom.core.'): importlib.import_module(module.name)\n"
        "rooms = {name.split('.')[1] for name in sys.modules if name.startswith('motionloom.')}\n"
        "others = {name.split('.')[0] for name in sys.modules} & {'torch', 'rich', 'PIL', 'yaml', 'onnx'}\n"
        "print(sorted(rooms), sorted(others))\n"
    )
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True, timeout=120)
    assert done.stdout == "['core'] []\n"


def test_noise_of_a_row_is_its_own() -> None:
    first, second = (row_noise([seed])(np.empty((1, 4, 2), np.float32)) for seed in SEEDS)
    np.testing.assert_array_equal(row_noise(SEEDS)(np.empty((2, 4, 2), np.float32)), np.concatenate([first, second]))
