"""predict and switch with a tiny network."""

import numpy as np

from motionloom import io
from motionloom.core.files.bvh_writer import save_bvh
from motionloom.core.motion import Motion
from motionloom.core.skeleton import Skeleton
from tests.cli.predict.clips import file_names, run
from tests.tasks.test_edit import person, rig


def test_a_tiny_network_predicts_on_the_users_own_skeleton(weights, capsys):
    """At the past's rate and length; the past comes back, and held joints are those of the other motion."""
    clip = person(1.0, 24.0)
    still = np.tile([1.0, 0, 0, 0], (24, 1, 1))
    turned = np.concatenate([still, clip.rotations, still], axis=1)  # a root on the floor, and a finger
    own = Motion(rig(), 24.0, clip.root * [1, 0, 1], turned)
    save_bvh(own, "own.bvh", unit=0.01)
    words = ["predict", "own.bvh", "--seconds", "0.5", "--count", "2", "--steps", "2", "--no-picture"]
    assert run(weights, *words, "--hold", "left_arm", "--from", "own.bvh") == 0
    past, motion = io.load("own.bvh"), io.load("futures/future_01.bvh")
    assert (len(motion), motion.fps, motion.skeleton) == (36, past.fps, past.skeleton)
    np.testing.assert_allclose(motion.positions()[:24], past.positions(), atol=1e-5)
    elbow = past.skeleton.index("l_elbow")
    same = np.abs((motion.rotations[24:, elbow] * past.rotations[:12, elbow]).sum(-1))
    np.testing.assert_allclose(same, 1, atol=1e-6)


def test_a_past_of_nobody_is_one_sentence(weights, capsys):
    stick = Skeleton(("a", "b", "c"), (-1, 0, 1), np.array([[0, 0, 0], [0, 1, 0], [0, 1, 0]]))
    save_bvh(Motion(stick, 30.0, np.zeros((20, 3)), np.tile([1.0, 0, 0, 0], (20, 3, 1))), "stick.bvh")
    assert run(weights, "predict", "stick.bvh") == 2
    assert capsys.readouterr().err.count("\n") == 1
    assert file_names() == {"stick.bvh"}


def test_a_tiny_network_goes_on_and_on_and_switches(weights):
    assert run(weights, "predict", "past.bvh", "--horizon", "31", "--count", "1", "--steps", "1", "--out", "a.bvh") == 0
    assert len(io.load("a.bvh")) == 960
    assert run(weights, "switch", "past.bvh", "kick.bvh", "--steps", "1", "--out", "s.npz") == 0
    whole, past, kick = io.load("s.npz"), io.load("past.bvh"), io.load("kick.bvh")
    assert len(whole) == 30 + 30 + 45
    np.testing.assert_allclose(whole.positions()[:30], past.positions(), atol=1e-6)
    for motion in (whole, kick):
        assert motion.skeleton == past.skeleton
    np.testing.assert_allclose(np.abs((whole.rotations[60:, 1:] * kick.rotations[:, 1:]).sum(-1)), 1, atol=1e-6)
