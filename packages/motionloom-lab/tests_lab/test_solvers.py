"""Solvers against those of diffusers."""

import numpy as np
import pytest

from motionloom.core.diffusion import DDPM, SPACINGS, Ddim, DpmSolver2M, levels, run
from tests.core.diffusion.exact import shared_draw, wavy
from tests.core.diffusion.test_solvers import noises_of, ours, schedule

__all__ = ["schedule"]


def walk_with(scheduler, x, denoise, noises, **options):
    """A run of a diffusers scheduler, with the noise it would draw given."""
    for t, noise in zip(scheduler.timesteps, noises):
        if noise is not None:
            options["variance_noise"] = torch_of(noise)
        x = stepped(scheduler, denoise(x, int(t) + 1), int(t), x, **options)
    return x


def torch_of(array):
    """A tensor of it: diffusers takes no arrays, and brings torch along."""
    import torch

    return torch.from_numpy(np.asarray(array))


def stepped(scheduler, clean, t, x, **options):
    return scheduler.step(torch_of(clean), t, torch_of(x), **options).prev_sample.numpy()


@pytest.mark.parametrize("eta", [0.0, 0.4, 1.0])
def test_ddim_agrees_with_diffusers(schedule, eta):
    diffusers = pytest.importorskip("diffusers")
    scheduler = diffusers.DDIMScheduler(
        num_train_timesteps=schedule.steps,
        trained_betas=schedule.betas,
        prediction_type="sample",
        clip_sample=False,
        timestep_spacing="trailing",
    )
    scheduler.alphas_cumprod = torch_of(schedule.alpha_bar[1:])
    scheduler.set_timesteps(20)
    x, *noises = noises_of(21, (2, 5, 3))
    theirs = walk_with(scheduler, x, wavy, noises, eta=eta)
    mine = ours(x, wavy, levels(schedule, 20), Ddim(eta), schedule, noises)
    np.testing.assert_allclose(mine, theirs, atol=1e-9, rtol=1e-9)


def test_ancestral_sampling_agrees_with_diffusers(schedule):
    diffusers = pytest.importorskip("diffusers")
    scheduler = diffusers.DDPMScheduler(
        num_train_timesteps=schedule.steps,
        trained_betas=schedule.betas,
        prediction_type="sample",
        clip_sample=False,
    )
    scheduler.alphas_cumprod = torch_of(schedule.alpha_bar[1:])
    start = shared_draw(0)(np.empty((2, 5, 3), dtype=np.float64))
    generator, noises, x = torch_generator(7), torch_generator(7), start
    for t in range(schedule.steps - 1, -1, -1):
        x = stepped(scheduler, wavy(x, t + 1), t, x, generator=generator)
    walk = range(schedule.steps, -1, -1)
    mine = run(wavy, start, levels=walk, solver=DDPM, schedule=schedule, noise=drawn_by(noises))
    np.testing.assert_allclose(mine, x, atol=1e-9, rtol=1e-9)


def torch_generator(seed):
    import torch

    return torch.Generator().manual_seed(seed)


def drawn_by(generator):
    """The noise that diffusers draws with a torch generator."""
    import torch

    return lambda like: torch.randn(like.shape, generator=generator, dtype=torch.float64).numpy()


@pytest.mark.parametrize("eta", [0.0, 1.0])
@pytest.mark.parametrize("spacing", SPACINGS)
def test_dpm_solver_agrees_with_diffusers(schedule, eta, spacing):
    diffusers = pytest.importorskip("diffusers")
    scheduler = diffusers.DPMSolverMultistepScheduler(
        num_train_timesteps=schedule.steps,
        trained_betas=schedule.betas,
        prediction_type="sample",
        algorithm_type="sde-dpmsolver++" if eta else "dpmsolver++",
    )
    scheduler.alphas_cumprod = torch_of(schedule.alpha_bar[1:])
    walk = levels(schedule, 20, spacing=spacing)
    scheduler.set_timesteps(timesteps=[level - 1 for level in walk[:-1]])
    x, *noises = noises_of(21, (2, 5, 3))
    theirs = walk_with(scheduler, x, wavy, noises if eta else [None] * 20)
    mine = ours(x, wavy, walk, DpmSolver2M(eta), schedule, noises)
    np.testing.assert_allclose(mine, theirs, atol=1e-5, rtol=1e-5)
