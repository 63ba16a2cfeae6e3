"""Data whose best denoiser is known, so that sampling can be tested without training."""

from dataclasses import dataclass

import numpy as np
from scipy.special import softmax

from motionloom.core.diffusion import Denoiser, NoiseSource, Schedule, State


@dataclass(frozen=True)
class Gaussian:
    """Normal data over the last axis, in float64."""

    mean: np.ndarray
    covariance: np.ndarray

    def denoiser(self, schedule: Schedule) -> Denoiser:
        """E[x_0 | x_l] = mean + a C (a² C + b²)^-1 (x - a mean)."""

        def denoise(x: State, level: int) -> State:
            a, b = schedule.at(level)
            gain = a * self.covariance @ np.linalg.inv(self._at(a, b))
            return self.mean + (x - a * self.mean) @ gain.T

        return denoise

    def flow(self, x: State, schedule: Schedule, t: int, s: int) -> State:
        """The exact solution of the probability flow from level t to s: the whitened state stays where it is."""
        (a_t, b_t), (a_s, b_s) = schedule.at(t), schedule.at(s)
        values, axes = np.linalg.eigh(self.covariance)
        stretch = np.sqrt((a_s**2 * values + b_s**2) / (a_t**2 * values + b_t**2))
        return a_s * self.mean + ((x - a_t * self.mean) @ axes * stretch) @ axes.T

    def _at(self, a: float, b: float) -> np.ndarray:
        return a * a * self.covariance + b * b * np.eye(len(self.mean), dtype=np.float64)


TILTED = Gaussian(
    np.array([1.0, -2.0], dtype=np.float64),
    np.array([[0.5, 0.3], [0.3, 0.4]], dtype=np.float64),
)


def points(data: np.ndarray, schedule: Schedule) -> Denoiser:
    """The best denoiser of a finite data set (n, features): its points weighted by their likelihood."""

    def denoise(x: State, level: int) -> State:
        a, b = schedule.at(level)
        distance = ((x[..., None, :] - a * data) ** 2).sum(-1)
        return softmax(-distance / (2 * b * b), axis=-1) @ data

    return denoise


def shared_draw(seed: int) -> NoiseSource:
    """Quick noise for many rows, from one generator."""
    rng = np.random.default_rng(seed)
    return lambda like: rng.standard_normal(like.shape).astype(like.dtype)


def wavy(x: State, level: int) -> State:
    """Some nonlinear denoiser that treats every number alone."""
    return np.tanh(0.8 * x) + 0.1 * np.sin(x + 0.01 * level)
