"""Training predictors: windows, what is told, the loss at the start, exact resume, the weight file that comes out."""

import numpy as np
import pytest
import torch

from motionloom.core.errors import MotionloomError
from motionloom.core.features.positions import SMPL_LAYOUT
from motionloom.core.models.predictor import load_predictor
from motionloom_lab.papers.benchmark_layouts import H36M_LAYOUT
from motionloom_train.data.prediction import Protocol, Recording
from motionloom_train.loop import Training
from motionloom_train.modules import predictor_module
from motionloom_train.predictor import KINDS, Completion, Settings, Windows, new_predictor, train_predictor
from motionloom_train.recipe import Recipe
from tests.kinematics import people

SMALL = {"kept": 6, "layers": 2, "width": 32, "heads": 2, "dropout": 0.1}


def protocol(layout=SMPL_LAYOUT, *, seconds: float = 3.0) -> Protocol:
    walks = [people.walking(speed, seconds)[:, : layout.joints] for speed in (0.8, 1.2, 1.6)]
    recordings = tuple(
        Recording(f"w{i}", str(i), "walk", split, walk.astype(np.float32))
        for i, (walk, split) in enumerate(zip(walks, ("train", "train", "val"), strict=True))
    )
    return Protocol("tiny", 20.0, 8, 12, layout, recordings, "free")


def recipe(**changes) -> Recipe:
    values = {
        "name": "tiny",
        "steps": 12,
        "batch": 8,
        "warmup": 2,
        "rate": 3e-3,
        "levels": 40,
        "save_every": 4,
        "amp": "none",
        "predictor": SMALL,
        "seed": 5,
    }
    return Recipe(**(values | changes))


def test_a_window_is_seen_from_where_its_last_observed_pose_stands_and_faces():
    sample = Windows(protocol().split("train"), protocol(), variant="masked").draw(1, 2, 64)
    feet = sample.features.reshape(64, -1, 22, 3)
    for row, mask in enumerate(sample.mask):
        past = int(mask.all(-1).astype(int).cumprod(0).sum())
        last = feet[row, past - 1] if past < 20 else None
        pose = sample.pose[row].reshape(22, 3)
        assert np.abs(pose[0, [0, 2]]).max() < 1e-5
        across = pose[1] - pose[2] + pose[16] - pose[17]
        assert abs(float(across[2])) < 1e-4 < float(across[0])  # the left side at +X: facing +Z
        assert last is None or np.abs(last - pose).max() < 1e-6 or mask.sum() > past * 22


def test_masks_of_all_kinds_are_drawn_and_always_begin_with_a_past():
    masks = Windows(protocol().split("train"), protocol(), variant="masked").draw(0, 0, 400).mask
    assert masks[:, :2].all()
    future = masks[:, 8:]
    only_past = (future.sum((1, 2)) == 0).astype(np.float32).mean()
    with_end = (future[:, -1, 1:].all(-1) & ~future[:, 0, 1:].any(-1)).astype(np.float32).mean()
    assert KINDS["past"] - 0.1 < only_past < KINDS["past"] + 0.15
    assert with_end > KINDS["end"] / 3
    assert (future[:, :, 0].all(-1) & ~future[:, :, 1:].any((1, 2))).any()  # the way alone


def test_the_same_seed_and_step_draw_the_same_windows_and_others_draw_others():
    windows = Windows(protocol().split("train"), protocol(), variant="masked")
    a, b, c = windows.draw(1, 2, 8), windows.draw(1, 2, 8), windows.draw(1, 3, 8)
    assert np.array_equal(a.features, b.features)
    assert np.array_equal(a.mask, b.mask)
    assert not np.array_equal(a.features, c.features)


def test_half_of_the_windows_are_mirror_images():
    still = people.walking(1.0, 3.0)
    still[:, 20] += np.array([0, 0.5, 0])  # the left wrist is high
    one = Protocol(
        "one", 20.0, 8, 12, SMPL_LAYOUT, (Recording("a", "a", "a", "train", still.astype(np.float32)),), "free"
    )
    places = Windows(one.recordings, one, variant="masked").draw(0, 0, 200).features.reshape(200, -1, 22, 3)
    higher = (places[:, :, 20, 1] > places[:, :, 21, 1]).astype(np.float32).mean()
    assert 0.4 < higher < 0.6


def test_a_smoothed_past_is_the_condition_and_the_recorded_one_is_predicted():
    data = protocol()
    plain = Windows(data.split("train"), data, variant="masked").draw(1, 1, 40)
    smooth = Windows(data.split("train"), data, variant="masked", smoothed=1.0).draw(1, 1, 40)
    assert np.array_equal(plain.features, plain.context)
    assert np.array_equal(plain.mask, smooth.mask)
    rough, context = smooth.features[:, :2], smooth.context[:, :2]
    assert np.median(np.abs(rough - context).max((1, 2))) > 1e-6  # but for those of two frames, which are straight
    assert np.abs(rough - context).max() < 0.15  # and nearly the same
    assert np.allclose(smooth.features[:, 8:], smooth.context[:, 8:], atol=1e-5)


def test_a_straight_way_is_as_it_was_when_smoothed():
    data = protocol()
    windows = Windows(data.split("train"), data, variant="masked", smoothed=1.0)
    ramp = np.arange(20.0)[None, :, None, None] * np.array([0.1, 0.02, -0.3]) + np.zeros((3, 20, 22, 3))
    past = np.array([8, 5, 2])
    places = windows._smoothed(np.random.default_rng(0), ramp, past)
    assert np.allclose(places, ramp, atol=1e-9)


def test_published_windows_drop_the_way_and_are_seen_from_anywhere():
    published = protocol(H36M_LAYOUT)
    sample = Windows(published.split("train"), published, variant="published").draw(0, 0, 100)
    assert sample.features.shape == (100, 20, 48)
    assert bool((sample.mask.sum((1, 2)) == 8 * 16).all())
    facing = np.arctan2(sample.pose[:, 1], sample.pose[:, 0])  # x and y of the right hip, +Z up
    assert len(np.unique((facing * 10).round())) > 20


def test_the_first_loss_of_the_published_training_is_that_of_guessing_no_noise():
    data = protocol(H36M_LAYOUT)
    windows = Windows(data.split("train"), data, variant="published")
    settings = Settings.parse(SMALL | {"variant": "published"})
    predictor = new_predictor(data, settings, windows, schedule="cosine", levels=1000)
    net = predictor_module(predictor)
    with torch.no_grad():
        loss = float(Completion(net, predictor, windows, condition_dropout=0.2).loss(net, 0, 0, 512))
    assert loss == pytest.approx(1.0, abs=0.03)


def test_states_of_the_other_manner_are_standardised():
    data = protocol()
    windows = Windows(data.split("train"), data, variant="masked")
    predictor = new_predictor(data, Settings.parse(SMALL), windows, schedule="cosine", levels=1000)
    sample = windows.draw(9, 9, 2000)
    state = predictor.to_state(sample.features, sample.pose)
    moving = predictor.std > 1e-3
    assert (np.abs(state.mean(0)[moving]) < 0.15).all()
    assert (abs(state.std(0)[moving] - 1) < 0.15).all()


def test_a_short_training_learns(tmp_path):
    lines: list[str] = []
    train_predictor(Training(recipe(steps=120, save_every=60), tmp_path, "cpu", say=lines.append), protocol())
    losses = [float(line.rsplit(" ", 1)[1]) for line in lines if "held-out" in line]
    assert losses[-1] < 0.8 * losses[0]


def test_a_run_that_was_stopped_goes_on_to_the_same_weights(tmp_path):
    whole = train_predictor(Training(recipe(), tmp_path / "whole", "cpu", say=lambda line: None), protocol())
    train_predictor(Training(recipe(), tmp_path / "parts", "cpu", stop=4, say=lambda line: None), protocol())
    parts = train_predictor(Training(recipe(), tmp_path / "parts", "cpu", say=lambda line: None), protocol())
    a, b = load_predictor(whole), load_predictor(parts)
    assert all(np.array_equal(x, y) for x, y in zip(a.net.weights.values(), b.net.weights.values(), strict=True))
    assert (a.card.notes["steps"], a.card.data, a.observed, a.frames) == (12, "free", 8, 20)


def test_training_goes_on_from_another_file_and_refuses_other_windows(tmp_path):
    first = train_predictor(Training(recipe(), tmp_path / "a", "cpu", say=lambda line: None), protocol())
    more = train_predictor(
        Training(recipe(start=str(first), name="more"), tmp_path / "b", "cpu", say=lambda line: None), protocol()
    )
    assert load_predictor(more).card.notes["from"] == "tiny"
    other = protocol()
    shorter = Protocol("s", 20.0, 8, 10, other.layout, other.recordings, "free")
    with pytest.raises(MotionloomError, match="other joints or windows"):
        train_predictor(Training(recipe(start=str(first)), tmp_path / "c", "cpu", say=lambda line: None), shorter)


@pytest.mark.parametrize(
    ("values", "says"),
    [
        ({"wdith": 3}, "no setting"),
        ({"width": "wide"}, "kind int"),
        ({"width": True}, "kind int"),
        ({"variant": "best"}, "published"),
        ({"condition_dropout": 1}, "shares"),
        ({"smoothed": 2}, "shares"),
        ({"dct": 1}, "kind bool"),
    ],
)
def test_settings_that_cannot_be_are_refused_in_one_sentence(values, says):
    with pytest.raises(MotionloomError, match=says):
        Settings.parse(values)


def test_recordings_shorter_than_a_window_are_refused():
    with pytest.raises(MotionloomError, match="20 frames"):
        Windows(protocol(seconds=0.5).recordings, protocol(), variant="masked")
