"""Predictors: their windows, what the network is told, the weight file, hostile files."""

import json
from collections.abc import Callable
from contextlib import suppress
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from safetensors import safe_open
from safetensors.numpy import save_file

from motionloom.core.diffusion import SCHEDULES, Frames
from motionloom.core.errors import MotionloomError
from motionloom.core.models.predictor import Predictor, load_predictor, save_predictor
from motionloom.core.models.prior import save_prior
from tests.recorded import tiny
from tests.recorded.tiny_predictor import predictor

VARIANTS = ["masked", "published"]


def some(*shape: int, seed: int = 0) -> np.ndarray:
    return np.random.default_rng(seed).standard_normal(shape, np.float32)


def near(found: np.ndarray, wanted: np.ndarray, *, atol: float = 1e-5, rtol: float = 1e-5) -> None:
    np.testing.assert_allclose(found, wanted, atol=atol, rtol=rtol)


# Windows and states


@pytest.mark.parametrize("variant", VARIANTS)
def test_motion_that_the_basis_holds_comes_back_from_its_state(variant: str) -> None:
    made, pose = predictor(variant), some(3, predictor(variant).layout.channels, seed=1)
    features = made.basis.to_time(some(3, 8, made.layout.channels))
    near(made.to_features(made.to_state(features, pose), pose), features, atol=1e-5, rtol=1e-5)
    state = some(3, 8, made.layout.channels, seed=2)
    near(made.to_state(made.to_features(state, pose), pose), state, atol=1e-5, rtol=1e-5)


def test_standing_still_in_the_last_pose_is_minus_mean_over_std() -> None:
    made, pose = predictor(), some(2, 12)
    state = made.to_state(np.repeat(pose[:, None], made.frames, axis=1), pose)
    near(state, np.stack([-made.mean / made.std] * 2), atol=1e-5, rtol=1e-5)


def test_a_published_state_is_the_spectrum_in_metres() -> None:
    made, features = predictor("published"), some(2, 20, 9)
    near(made.to_state(features, some(2, 9)), made.basis.matrix.astype(np.float32) @ features)


# What the network is told


def test_published_networks_see_the_spectrum_of_the_padded_observation() -> None:
    made, features = predictor("published"), some(2, 20, 9)
    mask = np.zeros((2, 20, 3), np.float32)
    mask[:, :5] = 1
    padded = np.concatenate([features[:, :5], np.repeat(features[:, 4:5], 15, axis=1)], axis=1)
    near(made.condition(features, mask, features[:, 4]), made.basis.to_spectrum(padded))


def test_ours_sees_what_is_known_where_and_from_which_pose() -> None:
    made, features = predictor(), some(2, 20, 12)
    pose, mask = features[:, 4], np.zeros((2, 20, 4), np.float32)
    mask[:, :5], mask[0, 12:, 2] = 1, 1
    told = made.condition(features, mask, pose)
    assert told.shape == (2, *(made.net.config.condition or ()))
    seen = told[:, :8, :12] * made.std  # known numbers from the pose, zero elsewhere
    offset = features - pose[:, None]
    for part in range(4):
        known = offset[..., 3 * part : 3 * part + 3] * mask[..., part : part + 1]
        near(seen[..., 3 * part : 3 * part + 3], made.basis.to_spectrum(known), atol=1e-5, rtol=1e-5)
    near(told[:, :8, 12:], made.basis.to_spectrum(mask) / 20**0.5)
    near(told[:, 8, :12] * made.pose[1] + made.pose[0], pose, atol=1e-5, rtol=1e-5)
    assert np.array_equal(told[:, 8, 12:], np.zeros((2, 4), np.float32))


def test_all_known_has_a_share_of_one() -> None:
    made = predictor()
    told = made.condition(some(1, 20, 12), np.ones((1, 20, 4), np.float32), some(1, 12))
    assert told[0, :8, 12:].flatten().tolist() == pytest.approx([1.0] * 4 + [0.0] * 28, abs=1e-6)


@pytest.mark.parametrize("variant", VARIANTS)
@pytest.mark.parametrize("fill", [7.0, -3.0])
def test_numbers_that_are_not_known_are_not_told(variant: str, fill: float) -> None:
    made = predictor(variant)
    features, mask = some(2, 20, made.layout.channels), np.zeros((2, 20, made.layout.parts), np.float32)
    mask[:, :5] = 1
    other = features.copy()
    other[:, 5:] = fill
    assert np.array_equal(made.condition(features, mask, features[:, 4]), made.condition(other, mask, features[:, 4]))


@pytest.mark.parametrize("level", [1, 500, 1000])
def test_a_published_guess_is_clean_where_its_noise_is_right(level: int) -> None:
    """x = a clean + b noise, and published networks count levels from 0 and name the noise."""
    made, x = predictor("published"), some(2, 8, 9)
    a, b = made.schedule.at(level)
    noise = made.net(x, np.full(2, level - 1))
    near(a * made.denoiser(None)(x, level) + b * noise, x, atol=1e-5, rtol=1e-5)
    ours, y = predictor(), some(2, 8, 12)
    assert np.array_equal(ours.denoiser(None)(y, level), ours.net(y, np.full(2, level - 1)))


@pytest.mark.parametrize("variant", VARIANTS)
def test_who_is_not_told_is_as_one_who_hears_nothing(variant: str) -> None:
    made, x = predictor(variant), some(3, 8, predictor(variant).layout.channels)
    told = some(3, *made.net.config.condition_shape, seed=1)
    every, nobody = made.denoiser(told)(x, 9), made.denoiser(None)(x, 9)
    assert np.abs(every - nobody).max((1, 2)).min() > 1e-3
    some_of_them = made.denoiser(told, np.array([True, False, True]))(x, 9)
    near(some_of_them, np.stack([every[0], nobody[1], every[2]]), atol=1e-5, rtol=1e-5)


# The weight file


@pytest.mark.parametrize("variant", VARIANTS)
@pytest.mark.parametrize("half", [False, True])
def test_a_saved_predictor_comes_back(tmp_path: Path, variant: str, half: bool) -> None:
    made = predictor(variant)
    back = Predictor.load(save_predictor(made, tmp_path / "a.safetensors", half=half))
    assert (back.layout, back.basis, back.observed, back.fps, back.variant) == (
        made.layout,
        made.basis,
        made.observed,
        made.fps,
        made.variant,
    )
    assert (back.card, back.net.config, back.schedule.name) == (made.card, made.net.config, made.schedule.name)
    x, told = some(2, 8, made.layout.channels), some(2, *made.net.config.condition_shape)
    apart = 2e-2 if half else 0
    near(back.denoiser(told)(x, 9), made.denoiser(told)(x, 9), atol=apart, rtol=apart)
    assert all(np.array_equal(getattr(back, name), getattr(made, name)) for name in ("mean", "std", "pose"))


def test_schedules_and_windows_of_every_kind_come_back(tmp_path: Path) -> None:
    """Another schedule of fewer levels; a window whose tokens are its frames."""
    made = replace(predictor(kept=20), schedule=SCHEDULES["sqrt"](100), basis=Frames(20))
    back = Predictor.load(save_predictor(made, tmp_path / "a.safetensors"))
    assert (back.schedule.name, back.schedule.steps) == ("sqrt", 100)
    assert np.array_equal(back.schedule.alpha_bar, SCHEDULES["sqrt"](100).alpha_bar)
    features, pose = some(2, 20, 12), some(2, 12, seed=1)
    expected = (features - pose[:, None] - made.mean) / made.std
    near(back.to_state(features, pose), expected, atol=1e-6, rtol=1e-5)


def test_predictors_are_written_as_safetensors_only(tmp_path: Path) -> None:
    with pytest.raises(MotionloomError, match="safetensors"):
        save_predictor(predictor(), tmp_path / "a.pt")
    assert not list(tmp_path.iterdir())


def test_files_that_are_missing_or_of_another_kind_are_refused(tmp_path: Path) -> None:
    with pytest.raises(MotionloomError, match="no predictor"):
        Predictor.load(tmp_path / "absent.safetensors")
    with pytest.raises(MotionloomError, match="is a prior, not a predictor"):
        load_predictor(save_prior(tiny.prior(), tmp_path / "prior.safetensors"))
    (tmp_path / "text.safetensors").write_text("no weights")
    with pytest.raises(MotionloomError, match="whole safetensors"):
        load_predictor(tmp_path / "text.safetensors")


Tensors, About = dict[str, np.ndarray], dict


def changed(folder: Path, change: Callable[[Tensors, About], object]) -> Path:
    """A saved predictor with something in it made otherwise."""
    path = save_predictor(predictor(), folder / "whole.safetensors")
    with safe_open(path, framework="np") as file:
        tensors = {key: file.get_tensor(key) for key in file.keys()}  # noqa: SIM118
        about = json.loads(file.metadata()["motionloom-predictor"])
    change(tensors, about)
    save_file(tensors, folder / "changed.safetensors", metadata={"motionloom-predictor": json.dumps(about)})
    return folder / "changed.safetensors"


def test_the_unchanged_copy_is_read(tmp_path: Path) -> None:
    load_predictor(changed(tmp_path, lambda tensors, about: None))


@pytest.mark.parametrize(
    "key", ["format", "net", "schedule", "layout", "frames", "observed", "dct", "fps", "variant", "card"]
)
@pytest.mark.parametrize(
    "value", [None, [], {}, "x", -1, 0, 1e300, float("nan"), 10**30, [[[]]], {"name": []}], ids=str
)
def test_descriptions_that_make_no_sense_are_refused(tmp_path: Path, key: str, value: object) -> None:
    with pytest.raises(MotionloomError) as caught:
        load_predictor(changed(tmp_path, lambda tensors, about: about.update({key: value})))
    assert "\n" not in str(caught.value)


@pytest.mark.parametrize(
    ("part", "key", "value"),
    [
        ("net", "layers", 4),
        ("net", "width", 8192),
        ("net", "channels", 8190),
        ("net", "kept", 7),
        ("net", "condition", None),
        ("net", "beside", False),
        ("net", "extra", 1),
        ("schedule", "steps", 10**9),
        ("schedule", "steps", 0),
        ("schedule", "name", "x"),
        ("schedule", "name", []),
        ("layout", "parents", [-1, 0, 0, 5]),
        ("layout", "parents", [-1, 1, 0, 0]),
        ("layout", "names", ["a"] * 300),
        ("layout", "pairs", [0, 1, 2, 9]),
        ("layout", "root", False),
        ("layout", "across", [[1, 9]]),
        ("layout", "z_up", True),
        ("card", "name", 3),
        ("card", "licence", None),
        ("card", "notes", 3),
        ("card", "extra", 3),
    ],
    ids=lambda value: str(value)[:20],
)
def test_descriptions_that_do_not_fit_the_weights_are_refused(
    tmp_path: Path, part: str, key: str, value: object
) -> None:
    with pytest.raises(MotionloomError) as caught:
        load_predictor(changed(tmp_path, lambda tensors, about: about[part].update({key: value})))
    assert "\n" not in str(caught.value)


def test_sizes_that_are_only_claimed_take_no_memory(tmp_path: Path) -> None:
    """8 layers of width 8192 would take some 20 GB."""

    def claim(tensors: Tensors, about: About) -> None:
        about["net"].update(layers=8, width=8192)

    with pytest.raises(MotionloomError, match="does not hold"):
        load_predictor(changed(tmp_path, claim))


@pytest.mark.parametrize("name", ["mean", "std", "pose", "net.out.weight", "net.sequence_embedding"])
@pytest.mark.parametrize("how", ["missing", "nan", "infinite", "longer", "scalar", "empty", "turned"])
def test_tensors_that_are_wrong_are_refused(tmp_path: Path, name: str, how: str) -> None:
    def change(tensors: Tensors, about: About) -> None:
        value = tensors.pop(name).copy()
        if how in ("nan", "infinite"):
            value.reshape(-1)[0] = float("nan" if how == "nan" else "inf")
        shapes = {"longer": np.concatenate([value, value]), "scalar": np.array(1, value.dtype), "empty": value[:0]}
        made = shapes.get(how, np.ascontiguousarray(value.T) if how == "turned" else value)
        tensors.update({} if how == "missing" else {name: made})

    with pytest.raises(MotionloomError) as caught:
        load_predictor(changed(tmp_path, change))
    assert "\n" not in str(caught.value)


@pytest.mark.parametrize("name", ["std", "pose"])
@pytest.mark.parametrize("value", [0.0, -1.0])
def test_spreads_that_are_not_positive_are_refused(tmp_path: Path, name: str, value: float) -> None:
    def change(tensors: Tensors, about: About) -> None:
        tensors[name][1, 2] = value

    with pytest.raises(MotionloomError, match="statistics"):
        load_predictor(changed(tmp_path, change))


@settings(max_examples=40)
@given(data=st.data())
def test_mutated_files_give_one_kind_of_error_or_are_read(
    tmp_path_factory: pytest.TempPathFactory, data: st.DataObject
) -> None:
    path = save_predictor(predictor(), tmp_path_factory.mktemp("mutated") / "a.safetensors")
    content = bytearray(path.read_bytes())
    for _ in range(data.draw(st.integers(1, 4))):
        content[data.draw(st.integers(0, min(4000, len(content) - 1)))] = data.draw(st.integers(0, 255))
    path.write_bytes(content[: data.draw(st.sampled_from([len(content), len(content) // 2]))])
    with suppress(MotionloomError):
        load_predictor(path)
