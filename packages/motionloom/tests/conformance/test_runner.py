"""The runner itself: its streams are the recorded ones, its rules are R2's, and it can fail."""

import dataclasses

import numpy as np
import pytest

from tests.conformance import runner
from tests.conformance.runner import MASK, MOTION, WEIGHTS, case, cases, compare, normal, stream, weights


def test_streams_begin_with_the_recorded_numbers():
    np.testing.assert_allclose(normal(stream(1101, MOTION), (4,)), [-0.4238152, -0.7224357, 1.231433, -1.453046], 1e-6)
    np.testing.assert_allclose(normal(stream(1101, WEIGHTS), (3,)), [0.3779657, 2.154579, 0.4343695], 1e-6)
    uniform = stream(1308, MASK).random(3, dtype=np.float32)
    np.testing.assert_allclose(uniform, [0.4657214, 0.09056932, 0.656902], 1e-6)
    assert stream(1801, MASK).integers(0, 15, 6).tolist() == [5, 6, 2, 11, 1, 2]


def test_weights_follow_plain_string_order_and_leave_out_tables():
    shapes = {"b.norm1.weight": (2,), "a.bias": (3,), "a.10.weight": (2, 2), "x.pe": (5,), "hidden": (2,)}
    filled, rng = weights(shapes, 7), stream(7, WEIGHTS)
    small = np.float32(0.05)
    assert list(filled) == ["a.10.weight", "a.bias", "b.norm1.weight", "hidden"]
    np.testing.assert_array_equal(filled["a.10.weight"], normal(rng, (2, 2)) * small)
    np.testing.assert_array_equal(filled["a.bias"], normal(rng, (3,)) * small)
    np.testing.assert_array_equal(filled["b.norm1.weight"], normal(rng, (2,)) * small + np.float32(1))
    np.testing.assert_array_equal(filled["hidden"], normal(rng, (2,)))


@pytest.mark.parametrize("name", [param.id for param in cases("sampling", kind="sampling")])
def test_a_wrong_number_is_caught_at_every_stored_element_and_in_the_sums(name):
    recorded = case("sampling", name)
    if recorded.outputs["sample"]["stride"] > 1:
        pytest.skip("only whole arrays can be handed back")
    right = recorded.expected("sample").reshape(recorded.outputs["sample"]["shape"])
    compare(recorded, "sample", right)
    wrong = right.copy()
    wrong.flat[-1] += 1e-3
    with pytest.raises(AssertionError):
        compare(recorded, "sample", wrong)
    with pytest.raises(AssertionError, match="shape"):
        compare(recorded, "sample", right[:1])
    outputs = {"sample": {**recorded.outputs["sample"], "abs_sum": recorded.outputs["sample"]["abs_sum"] * 1.01}}
    with pytest.raises(AssertionError, match="abs_sum"):
        compare(dataclasses.replace(recorded, outputs=outputs), "sample", right)


def test_what_a_test_left_aside_of_its_case_is_listed():
    recorded = case("sampling", "dummy_plain")
    assert {"output sample", "config seed", "config guidance"} <= set(recorded.left())
    assert "config kind" not in recorded.left()
    assert recorded.config["seed"] > 0
    assert recorded.config.get("guidance") is None
    compare(recorded, "sample", recorded.expected("sample").reshape(recorded.outputs["sample"]["shape"]))
    assert not {"output sample", "config seed", "config guidance"} & set(recorded.left())
    assert set(recorded.config.unread()) < set(dict(recorded.config))
    assert not recorded.left()


def test_a_case_is_found_by_name_and_lists_what_it_recorded():
    assert case("control_masks", "root_horizontal").lists["dims"][:2] == [0, 1]


def test_a_group_of_another_folder_may_be_absent_with_a_reason_and_no_group_of_our_own(monkeypatch, tmp_path):
    with pytest.raises(FileNotFoundError):
        cases("no_such_group")
    monkeypatch.setattr(runner, "FOLDER", tmp_path)
    (only,) = cases("sampling")
    assert str(tmp_path) in only.marks[0].kwargs["reason"]
