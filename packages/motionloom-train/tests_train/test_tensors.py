"""Functions that take tensors where training has them: the same numbers as of arrays, and gradients."""

import numpy as np
import pytest
import torch

from motionloom.core import blending, ground
from motionloom.core.features import babel, humanml, pair
from tests.core.features.test_humanml import person
from tests.core.features.test_pair import CODES, people


def test_ground_poses() -> None:
    numbers = np.random.default_rng(0).normal(size=(2, 3, 4))
    base, pose = numbers
    points = np.random.default_rng(1).normal(size=(3, 3))
    for function, args in (
        (ground.compose, (base, pose)),
        (ground.relative, (base, pose)),
        (ground.to_world, (points, pose)),
        (ground.from_world, (points, pose)),
        (ground.normalized, (base,)),
        (ground.mirrored, (base,)),
    ):
        result = function(*map(torch.from_numpy, args))
        assert result.numpy() == pytest.approx(function(*args))


@pytest.mark.parametrize("fade", [blending.smoothstep, blending.smootherstep])
def test_fades(fade) -> None:
    assert fade(torch.tensor([0.25])).item() == pytest.approx(fade(np.array([0.25]))[0])


def test_two_people() -> None:
    motion = pair.encode(people(13))
    features, poses = motion.features.astype(np.float64), motion.poses
    there = pair.decode(torch.from_numpy(features), torch.from_numpy(poses))
    np.testing.assert_allclose(there.numpy(), pair.decode(features, poses), atol=1e-12)
    for code in CODES:
        numbers = code.encode(torch.from_numpy(poses))
        np.testing.assert_allclose(numbers.numpy(), code.encode(poses), atol=1e-12)
        np.testing.assert_allclose(code.decode(numbers).numpy(), code.decode(code.encode(poses)), atol=1e-12)


def test_no_direction_at_all_is_ahead() -> None:
    nothing = torch.tensor([0.0, 0.0, 1.0, 2.0])
    assert pair.normalized(nothing).tolist() == [1.0, 0.0, 1.0, 2.0]


def test_places_of_babel() -> None:
    noise = np.random.default_rng(2).normal(size=(2, 3, 7, 135))
    narrow = babel.decode_positions(torch.from_numpy(noise).float())
    assert narrow.dtype == torch.float32
    np.testing.assert_allclose(narrow.numpy(), babel.decode_positions(noise), atol=1e-4)


def test_places_of_babel_have_gradients() -> None:
    noise = torch.randn(1, 3, 135, dtype=torch.float64, generator=torch.Generator().manual_seed(0)).requires_grad_()
    assert torch.autograd.gradcheck(lambda x: babel.decode_positions(x)[..., [0, 15, 20], :], noise, fast_mode=True)


@pytest.mark.parametrize("heading", ["compatible", "corrected"])
def test_displacements(heading: humanml.Heading) -> None:
    features = humanml.encode(person(5), heading=heading).astype(np.float64)
    there = humanml.displacements(torch.from_numpy(features))
    np.testing.assert_allclose(there.numpy(), humanml.displacements(features), atol=1e-12)


def test_decoding_is_differentiable() -> None:
    features = torch.from_numpy(humanml.encode(person(2))[:6]).double()[None].requires_grad_()
    assert torch.autograd.gradcheck(humanml.decode_positions, (features,), fast_mode=True)
    assert torch.autograd.gradcheck(lambda f: humanml.positions_from_rot6d(f), (features,), fast_mode=True)
