"""Parts of predicted people that are held to another motion."""

from dataclasses import replace
from math import inf
from pathlib import Path

import numpy as np

from motionloom import io
from motionloom.core.files.bvh_writer import save_bvh
from motionloom.core.skeleton import SMPL22
from motionloom.goals.hold import FixedPart
from tests.cli.predict.clips import run
from tests.tasks.test_edit import person


def test_parts_are_held_from_the_line_and_from_a_file(weights, call):
    Path("m.json").write_text('{"hold": [{"joints": ["head"], "frames": [[0, 15]]}, {"joints": ["root"], "to": 0.5}]}')
    words = ["predict", "past.bvh", "--seconds", "1", "--count", "1", "--out", "a.npz", "--from", "kick.bvh"]
    assert run(weights, *words, "--hold", "left_arm,lower_body", "--hold", "neck", "--mask", "m.json") == 0
    head, root, line = call["hold"].parts
    assert [k for k in range(30) if any(a <= (k + 1) / 30 <= b for a, b in head.spans)] == list(range(15))
    assert (root, line) == (FixedPart(("root",), ((0, 0.5),)), FixedPart(("left_arm", "lower_body", "neck")))
    assert (len(call["hold"].source), call["hold"].source.skeleton) == (45, call["past"].skeleton)
    assert run(weights, *words, "--hold", "left_arm", "--from-time", "0.5") == 0
    kick = io.load("kick.bvh")
    np.testing.assert_allclose(call["hold"].source.root, kick.root[15:], atol=1e-9)
    assert run(weights, *words, "--hold", "left_arm", "--seconds", "1.5") == 0  # as long as there is anything


def test_a_source_at_another_rate_or_on_another_body_comes_along_if_that_is_asked(weights, call):
    save_bvh(person(1.5, 60.0), "kick.bvh", unit=0.01)
    words = ["predict", "past.bvh", "--seconds", "1", "--count", "1", "--out", "a.npz", "--hold", "head"]
    assert run(weights, *words, "--from", "kick.bvh") == 0
    assert (call["hold"].source.fps, len(call["hold"].source)) == (call["past"].fps, 45)
    assert run(weights, *words, "--from", "other.bvh", "--retarget") == 0
    assert call["hold"].source.skeleton == call["past"].skeleton


def test_the_last_digits_of_a_file_make_no_other_skeleton(weights, call):
    clip = person(1.5, 30.0)
    nudged = replace(SMPL22, offsets=SMPL22.offsets + 2e-5)
    save_bvh(replace(clip, skeleton=nudged, fps=30.0003), "kick.bvh")
    words = ["predict", "past.bvh", "--seconds", "1", "--count", "1", "--out", "a.npz", "--hold", "head"]
    assert run(weights, *words, "--from", "kick.bvh") == 0
    source = call["hold"].source
    assert (source.skeleton, source.fps, len(source)) == (call["past"].skeleton, call["past"].fps, 45)


def test_inf_is_the_default_end() -> None:
    """The contract with the tasks: a part named on the line is held for good."""
    assert FixedPart(("head",)).spans == ((0.0, inf),)
