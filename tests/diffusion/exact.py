"""Data whose best denoiser is known, so that sampling can be tested without training."""

from dataclasses import dataclass

import torch
from torch import Tensor

from motionloom.diffusion import Denoiser, NoiseSource, Schedule, State


@dataclass(frozen=True)
class Gaussian:
    """Normal data over the last axis, in float64."""

    mean: Tensor
    covariance: Tensor

    def denoiser(self, schedule: Schedule) -> Denoiser:
        """E[x_0 | x_l] = mean + a C (a² C + b²)^-1 (x - a mean)."""

        def denoise(x: State, level: int) -> State:
            a, b = schedule.at(level)
            gain = a * self.covariance @ torch.linalg.inv(self._at(a, b))
            return self.mean + (x - a * self.mean) @ gain.T

        return denoise

    def flow(self, x: State, schedule: Schedule, t: int, s: int) -> State:
        """The exact solution of the probability flow from level t to s: the whitened state stays where it is."""
        (a_t, b_t), (a_s, b_s) = schedule.at(t), schedule.at(s)
        values, axes = torch.linalg.eigh(self.covariance)
        stretch = ((a_s**2 * values + b_s**2) / (a_t**2 * values + b_t**2)).sqrt()
        return a_s * self.mean + ((x - a_t * self.mean) @ axes * stretch) @ axes.T

    def _at(self, a: float, b: float) -> Tensor:
        return a * a * self.covariance + b * b * torch.eye(len(self.mean), dtype=torch.float64)


TILTED = Gaussian(
    torch.tensor([1.0, -2.0], dtype=torch.float64),
    torch.tensor([[0.5, 0.3], [0.3, 0.4]], dtype=torch.float64),
)


def points(data: Tensor, schedule: Schedule) -> Denoiser:
    """The best denoiser of a finite data set (n, features): its points weighted by their likelihood."""

    def denoise(x: State, level: int) -> State:
        a, b = schedule.at(level)
        distance = (x.unsqueeze(-2) - a * data).square().sum(-1)
        return torch.softmax(-distance / (2 * b * b), dim=-1) @ data

    return denoise


def shared_draw(seed: int) -> NoiseSource:
    """Quick noise for many rows, from one generator."""
    generator = torch.Generator().manual_seed(seed)
    return lambda like: torch.randn(like.shape, generator=generator, dtype=like.dtype)


def wavy(x: State, level: int) -> State:
    """Some nonlinear denoiser that treats every number alone."""
    return torch.tanh(0.8 * x) + 0.1 * torch.sin(x + 0.01 * level)
