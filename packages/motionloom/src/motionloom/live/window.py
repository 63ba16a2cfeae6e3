"""One window of a live motion: its first frames are known, the rest is sampled in a few steps.

It is sampled as every other motion is (`tasks.sampling`), with what is known observed; the noise belongs to the numbers
of frames: a frame that is sampled again, after a command, has the same noise.
"""

from collections import OrderedDict
from collections.abc import Sequence

import numpy as np

from motionloom.core.diffusion import Denoiser, NoiseSource, generator, guide, row_seed
from motionloom.core.features import humanml
from motionloom.core.methods.edit import Observed
from motionloom.core.models.networks.prior import PriorSession
from motionloom.core.models.networks.prior_condition import Bound
from motionloom.core.models.prior import Prior
from motionloom.edits.boundary import joining
from motionloom.edits.steering import Correction
from motionloom.live.settings import Settings
from motionloom.requests.sampling import Sampling
from motionloom.tasks.long import zero_padded
from motionloom.tasks.sampling import Batch, Rows, sample
from motionloom.tasks.watching import View

TEXTS = 64
"""Prompts whose vectors are kept."""
SETTLING = 0.9
"""The noise of a level below which goals are met exactly, also where the way out of the known frames bent it."""


class Noise:
    """Standard normal numbers for the frames of one person: they depend on the seed and the frame's number alone."""

    def __init__(self, seed: int, moves: int, features: int) -> None:
        self._seed = seed
        self._shape = 2 * moves + 2, features  # each move takes noise, and what is known is shown at noise of its own
        self._noise: dict[int, np.ndarray] = {}

    def of(self, first: int, frames: int) -> NoiseSource:
        """The noise of the frames from ``first`` on, for one walk: its k-th call gets the k-th part."""
        self._noise = {number: noise for number, noise in self._noise.items() if number >= first}
        for number in range(first, first + frames):
            if number not in self._noise:
                own = generator(row_seed(self._seed, number + (1 << 20)))
                self._noise[number] = own.standard_normal(self._shape, np.float32)
        whole = np.stack([self._noise[number] for number in range(first, first + frames)], axis=1)
        calls = iter(range(len(whole)))
        return lambda like: whole[next(calls)][None].astype(like.dtype, copy=False)


class Sampler:
    """Samples windows with one prior; keeps the vectors of the last words."""

    def __init__(self, prior: Prior, settings: Settings) -> None:
        self.prior, self.settings = prior, settings
        self.calls = 0
        """Guided calls of the network so far."""
        self._bound: OrderedDict[str, tuple[PriorSession, Bound, Bound]] = OrderedDict()
        self._sampling = Sampling(steps=settings.steps, solver=settings.solver, spacing=settings.spacing)
        self._levels = self._sampling.levels(prior.schedule)

    def __call__(
        self,
        text: str,
        known: np.ndarray,
        frames: int,
        noise: NoiseSource,
        *,
        edits: Sequence[Correction] = (),
        turns: Sequence[Correction] = (),
    ) -> np.ndarray:
        """(known + frames, 263) float64 features, not standardised, the known ones as they were.

        text: what is done; known: (n, 263) features of the last frames, n may be 0; frames: how many to sample; noise:
        of `Noise.of`, for all frames of the window; edits: what every estimate goes through, one after the other,
        before it leaves the known frames without a jump; turns: the same behind that, for edits that jump
        nowhere.
        """
        prior, count, length = self.prior, len(known), len(known) + frames
        padded = zero_padded(known, length)[None]
        mask = np.zeros(padded.shape, np.bool_)
        mask[:, :count] = True
        change = leaving(prior, known, frames, edits=edits, turns=turns)

        def changed(denoise: Denoiser, batch: Batch) -> Denoiser:
            def estimate(state: np.ndarray, level: int) -> np.ndarray:
                self.calls += 1
                return change(denoise(state, level)[0], level)[None]

            return estimate

        def poses(clean: np.ndarray) -> np.ndarray:
            features = (clean * prior.spread + prior.mean).astype(np.float64)
            return humanml.decode_positions(features[0])[None, None]

        [(_, state)] = sample(
            prior,
            Rows([text], [length], [0], noise=lambda seeds: noise),
            self._sampling,
            guided=self._guided(text, length),
            edits=[changed],
            observed=Observed((padded - prior.mean) / prior.spread, mask),
            view=View(poses),
        )
        return np.where(mask[0], padded[0], state * prior.spread + prior.mean).astype(np.float64)

    def _guided(self, text: str, frames: int) -> Denoiser:
        """The prior's denoised estimate under a text; an empty one is no condition. Guided early.

        A token of the network holds several frames, and between tokens it leaves small steps: the last estimate is the
        average over all ways to divide the frames into tokens (as in `tasks.long`), which are rows of one call.
        """
        if text not in self._bound:
            cond, net = self.prior.condition([text]), self.prior.for_words(text).net
            self._bound[text] = net, net.bind(cond), net.bind(cond.null())
            while len(self._bound) > TEXTS:
                self._bound.popitem(last=False)
        self._bound.move_to_end(text)
        (net, own, null), ways = self._bound[text], self.prior.net.config.patch
        early = [level for level in self._levels if self.prior.schedule.at(level)[1] >= self.settings.guided]
        strong, plain = self.settings.guidance, float(self.settings.guidance != 0)
        guided, late = guide(net, own, null, strong), guide(net, own, null, plain)
        lengths = np.arange(frames, frames - ways, -1)
        own, null = (
            Bound._make(part.repeat(ways, axis=0) for part in one)._replace(lengths=lengths) for one in (own, null)
        )
        last = self._levels[-2]
        shifted = guide(net, own, null, strong if last in early else plain)

        def denoise(state: np.ndarray, level: int) -> np.ndarray:
            if level != last or ways == 1:
                return guided(state, level) if level in early else late(state, level)
            rows = shifted(np.concatenate([zero_padded(state[:, k:], frames) for k in range(ways)]), level)
            total = np.zeros_like(state)
            for k, row in enumerate(rows):
                total[:, k:] += row[: frames - k]
            count = np.arange(1, frames + 1, dtype=state.dtype).clip(max=ways)
            return total / count[:, None]

        return denoise


def leaving(
    prior: Prior, known: np.ndarray, frames: int, *, edits: Sequence[Correction], turns: Sequence[Correction]
) -> Correction:
    """What every estimate of a window goes through: ``edits``, no jump behind what is known, ``edits`` again in the
    late ones, ``turns``.

    known: (n, 263) features, not standardised, of which ``frames`` are behind; the known ones stay as they are.
    """
    spread, padded = prior.spread, zero_padded(known, len(known) + frames)[None]
    mask = np.zeros(padded.shape, np.bool_)
    mask[:, : len(known)] = True
    meet = joining(padded, mask, len(known), len(known) + frames)
    data = (padded - prior.mean) / spread

    def changed(denoised: np.ndarray, level: int) -> np.ndarray:
        for edit in edits:
            denoised = edit(denoised, level)
        denoised = ((meet(denoised[None] * spread + prior.mean) - prior.mean) / spread)[0]
        late = prior.schedule.at(level)[1] < SETTLING
        for turn in (*(edits if late else ()), *turns):  # a heading bent at the border turns all that is behind it
            denoised = turn(denoised, level)
        return np.where(mask[0], data[0], denoised)

    return changed
