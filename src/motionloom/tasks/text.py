"""Text to motion: prompts in, motions out.

A prompt becomes word vectors once; noise is drawn per motion from its own seed; the solver walks the noise to clean
features with the guided network as its denoiser; features become positions, positions a person with constant bones.
"""

from collections.abc import Callable, Iterator, Sequence

import numpy as np
import torch
from torch import Tensor

from motionloom.diffusion import SOLVERS, guide, levels, row_draw, sample
from motionloom.errors import MotionloomError
from motionloom.features import babel, humanml
from motionloom.features.layout import LAYOUT, WIDTH
from motionloom.goals.segment import LONGEST
from motionloom.kinematics.feet import clean_feet
from motionloom.kinematics.ik import motion_from_positions
from motionloom.motion import Motion
from motionloom.tasks.watching import reported
from motionloom.weights.prior import Prior

STEPS, SOLVER, SPACING, GUIDANCE = 24, "ddpm", "early", 2.5
"""How motions are sampled unless asked otherwise (docs/decisions/0008)."""
ROWS = 8
"""Motions denoised at once."""

LARGEST_SEED = 2**62

Progress = Callable[[int, int], None]
"""(network calls done, network calls in all)."""


@torch.inference_mode()
def sample_features(
    prior: Prior,
    prompts: Sequence[str],
    frames: Sequence[int],
    *,
    seeds: Sequence[int],
    guidance: float = GUIDANCE,
    steps: int = STEPS,
    solver: str = SOLVER,
    spacing: str = SPACING,
    progress: Progress | None = None,
) -> list[Tensor]:
    """Features (frames, 263 or the prior's), not standardised, one per prompt; row i has its own length and seed.

    The network sees at most `ROWS` motions at once, of equal length, so that memory does not grow with their number.
    """
    made = _sampled(
        prior, prompts, frames, seeds=seeds, guidance=guidance, steps=steps, solver=solver, spacing=spacing,
        progress=progress,
    )  # fmt: skip
    result = dict(made)
    return [result[row] for row in range(len(prompts))]


@torch.inference_mode()
def _sampled(
    prior: Prior,
    prompts: Sequence[str],
    frames: Sequence[int],
    *,
    seeds: Sequence[int],
    guidance: float,
    steps: int,
    solver: str,
    spacing: str = SPACING,
    progress: Progress | None,
) -> Iterator[tuple[int, Tensor]]:
    """`sample_features` row by row, each as soon as it is finished: the row's number and its features."""
    check(prior, prompts, steps=steps, guidance=guidance, solver=solver)
    if not all(0 <= seed < 2 * LARGEST_SEED for seed in seeds):
        raise MotionloomError(f"a seed is a whole number from 0 to below 2**62; got {min(seeds)}")
    way = levels(prior.schedule, steps, spacing=spacing)  # type: ignore[arg-type]
    groups = _groups(frames)
    for number, rows in enumerate(groups):
        cond = prior.condition([prompts[row] for row in rows])
        denoise = guide(prior.net, prior.net.bind(cond), prior.net.bind(cond.null()), guidance)
        draw = row_draw([seeds[row] for row in rows])
        state = draw(torch.empty(len(rows), frames[rows[0]], len(prior.mean), device=prior.mean.device))
        walk = sample(denoise, state, levels=way, solver=SOLVERS[solver], schedule=prior.schedule, draw=draw)
        walk = reported(walk, steps, rows, lambda snapshot: places_of(prior, snapshot.clean)[:, None])
        for done, snapshot in enumerate(walk, start=1):
            state = snapshot.state
            if progress:
                progress(number * steps + done, len(groups) * steps)
        finished = state * prior.std + prior.mean
        if prior.net.config.patch > 1:
            finished = smooth(finished)
        yield from zip(rows, finished.cpu(), strict=True)


def generate(
    prior: Prior,
    prompts: Sequence[str] | str,
    *,
    seconds: float | Sequence[float] = 5.0,
    count: int = 1,
    seed: int = 0,
    guidance: float = GUIDANCE,
    steps: int = STEPS,
    solver: str = SOLVER,
    clean: bool = True,
    progress: Progress | None = None,
) -> list[Motion]:
    """Make ``count`` motions for each prompt, in order; motion i of the answer is drawn from ``seed + i`` alone.

    seconds: length, one for all or one per prompt; at the prior's frame rate (20 per second; BABEL's 30). guidance:
    strength of the text, 0 ignores it. steps, solver: network calls, and how they are joined (`diffusion.SOLVERS`).
    clean: lock planted feet and keep feet above the floor. The person starts near the origin facing +Z, on the 22-joint
    skeleton.
    Raises `MotionloomError` for what cannot be asked. (Tevet et al. 2023; guidance: Ho & Salimans 2022.)
    """
    made = generate_each(
        prior, prompts, seconds=seconds, count=count, seed=seed, guidance=guidance, steps=steps, solver=solver,
        clean=clean, progress=progress,
    )  # fmt: skip
    motions = dict(made)
    return [motions[row] for row in range(len(motions))]


def generate_each(
    prior: Prior,
    prompts: Sequence[str] | str,
    *,
    seconds: float | Sequence[float] = 5.0,
    count: int = 1,
    seed: int = 0,
    guidance: float = GUIDANCE,
    steps: int = STEPS,
    solver: str = SOLVER,
    clean: bool = True,
    progress: Progress | None = None,
) -> Iterator[tuple[int, Motion]]:
    """The motions of `generate`, each with its number as soon as it is finished; arguments and errors as there.

    Those of equal length come in order, `ROWS` of them at a time.
    """
    check_features(prior)
    said = [prompts] if isinstance(prompts, str) else list(prompts)
    lengths = [float(s) for s in np.atleast_1d(np.asarray(seconds, dtype=np.float64))]
    if np.ndim(seconds) == 0:
        lengths *= len(said)
    if len(lengths) != len(said):
        raise MotionloomError(f"there are {len(lengths)} lengths for {len(said)} prompts; give one, or one per prompt")
    if not said or count < 1:
        raise MotionloomError(
            f"nothing to make: {len(said)} prompts, {count} of each; give at least one prompt and count 1"
        )
    said = [prompt for prompt in said for _ in range(count)]
    frames = [frames_in(length, prior.fps) for length in lengths for _ in range(count)]
    if not 0 <= seed < LARGEST_SEED:
        raise MotionloomError(f"a seed is a whole number from 0 to below 2**62; got {seed}")
    made = _sampled(
        prior, said, frames, seeds=[seed + i for i in range(len(said))],
        guidance=guidance, steps=steps, solver=solver, progress=progress,
    )  # fmt: skip
    for row, features in made:
        yield row, finish(prior, features, clean=clean)


def smooth(features: Tensor) -> Tensor:
    """(..., frames, numbers) weighted 1/6, 2/3, 1/6 along time, ends repeated.

    A network whose tokens hold several frames draws each token smoothly and leaves small steps between them.
    """
    before = torch.cat([features[..., :1, :], features[..., :-1, :]], dim=-2)
    after = torch.cat([features[..., 1:, :], features[..., -1:, :]], dim=-2)
    return (before + 4 * features + after) / 6


def places_of(prior: Prior, clean: Tensor) -> np.ndarray:
    """(rows, frames, 22, 3) metres of standardised features (rows, frames, numbers): as the network drew them."""
    features = clean * prior.std + prior.mean
    features = (smooth(features) if prior.net.config.patch > 1 else features).cpu()
    if features.shape[-1] == WIDTH:
        return humanml.decode_positions(features).numpy()
    return np.stack([finish(prior, row, clean=False).positions() for row in features])


def to_motion(features: np.ndarray, fps: float, *, clean: bool = True) -> Motion:
    """Features (frames, 263) to a person with constant bones; with ``clean`` the planted feet hold still."""
    motion = motion_from_positions(humanml.decode_positions(features), fps)
    return clean_feet(motion, contacts=features[:, LAYOUT["contacts"]]) if clean else motion


def check_features(prior: Prior) -> None:
    """Raise MotionloomError where nothing here makes a motion of the numbers that these weights make (`finish`)."""
    if len(prior.mean) not in _DECODED:
        raise MotionloomError(
            f"these weights make {len(prior.mean)} numbers per frame, and only HumanML3D's {WIDTH} and BABEL's "
            f"{babel.WIDTH} can be turned into a motion; use other weights"
        )


def finish(prior: Prior, features: Tensor | np.ndarray, *, clean: bool = True) -> Motion:
    """Features (frames, numbers) of this prior, not standardised, to a motion at its frame rate.

    With ``clean`` the planted feet hold still: as the features say where they do (263), else by height and speed (135).
    Frame 0 stands over the origin; the person starts facing +Z. Raises MotionloomError as `check_features` does.
    """
    check_features(prior)
    numbers = features.cpu().numpy() if isinstance(features, Tensor) else features
    return _DECODED[len(prior.mean)](numbers.astype(np.float64), prior.fps, clean)


def _from_humanml(features: np.ndarray, fps: float, clean: bool) -> Motion:
    return to_motion(features, fps, clean=clean)


def _from_babel(features: np.ndarray, fps: float, clean: bool) -> Motion:
    motion = babel.forward(babel.decode(features, fps))
    return clean_feet(motion) if clean else motion


_DECODED: dict[int, Callable[[np.ndarray, float, bool], Motion]] = {WIDTH: _from_humanml, babel.WIDTH: _from_babel}
"""How the numbers of a frame become a motion, by their count."""


def frames_in(seconds: float, fps: float) -> int:
    """Frames of a motion of so many seconds; MotionloomError beyond `LONGEST`."""
    if not (np.isfinite(seconds) and 0 < seconds <= LONGEST):
        raise MotionloomError(
            f"a motion of {seconds:g} seconds cannot be made; ask for more than 0 and at most {LONGEST:g}"
        )
    return max(round(seconds * fps), 4)


def _groups(frames: Sequence[int]) -> list[list[int]]:
    """Rows of equal length, at most `ROWS` together."""
    by_length: dict[int, list[int]] = {}
    for row, count in enumerate(frames):
        by_length.setdefault(count, []).append(row)
    return [rows[i : i + ROWS] for rows in by_length.values() for i in range(0, len(rows), ROWS)]


def check(prior: Prior, prompts: Sequence[str], *, steps: int, guidance: float, solver: str) -> None:
    """Raise MotionloomError for settings and prompts that nothing can be drawn with."""
    if solver not in SOLVERS:
        raise MotionloomError(f"no solver {solver!r}; there are {', '.join(SOLVERS)}")
    if not isinstance(steps, int) or not 1 <= steps <= prior.schedule.steps:
        raise MotionloomError(f"{steps} steps cannot be taken; these weights take 1 to {prior.schedule.steps}")
    if not np.isfinite(guidance) or abs(guidance) > 100:
        raise MotionloomError(f"a guidance of {guidance:g} makes no motion; usual values are 1 to 7")
    for prompt in prompts:
        if not prompt.strip():
            raise MotionloomError("a prompt is empty; say in words what the person does")
