"""Text to motion: prompts in, motions out.

A prompt becomes word vectors once; noise is sampled per motion from its own seed; the solver walks the noise to clean
features with the guided network as its denoiser; features become positions, positions a person with constant bones.
"""

from collections.abc import Callable, Iterator, Sequence
from typing import Unpack

import numpy as np

from motionloom.core.body.feet import clean_feet
from motionloom.core.errors import MotionloomError
from motionloom.core.features import babel, humanml
from motionloom.core.features.layout import FPS, WIDTH
from motionloom.core.features.placed import PlacedMotion
from motionloom.core.ground import GroundPose
from motionloom.core.methods.text import to_motion as to_motion
from motionloom.core.models.prior import Prior
from motionloom.core.motion import Motion
from motionloom.goals.goal import Goal
from motionloom.requests.fields import specs
from motionloom.requests.sampling import GUIDANCE as GUIDANCE
from motionloom.requests.sampling import LARGEST_SEED, Sampling, Settings
from motionloom.requests.sampling import SOLVER as SOLVER
from motionloom.requests.sampling import SPACING as SPACING
from motionloom.requests.sampling import STEPS as STEPS
from motionloom.requests.shared import LONGEST
from motionloom.tasks.choosing import best_in_words
from motionloom.tasks.sampling import Progress, Rows, sample
from motionloom.tasks.supported import add_support
from motionloom.tasks.watching import View


def sample_features(
    prior: Prior,
    prompts: Sequence[str],
    frames: Sequence[int],
    *,
    seeds: Sequence[int],
    padded: bool = False,
    sampling: Sampling | None = None,
    progress: Progress | None = None,
    **settings: Unpack[Settings],
) -> list[np.ndarray]:
    """Features (frames, 263 or the prior's) float32, not standardised, one per prompt.

    Args:
        prompts: one per row; an empty one is refused.
        frames: length of each row.
        seeds: one per row; a row depends on its own prompt, length and seed alone.
        padded: rows of nearly one length share network calls.
        sampling: or single settings of it as keywords.
        progress: called after each network call.

    Raises:
        MotionloomError: for an impossible request.
    """
    rows = Rows(prompts, frames, seeds, patch=prior.net.config.patch if padded else 1)
    states = dict(_sample_motions(prior, rows, Sampling.of(sampling, settings), progress))
    return [states[row] for row in range(len(prompts))]


def _sample_motions(
    prior: Prior, rows: Rows, sampling: Sampling, progress: Progress | None
) -> Iterator[tuple[int, np.ndarray]]:
    """`sample_features` row by row, each as soon as it is finished: the row's number and its features."""
    check_prompts(rows.prompts)
    if not all(0 <= seed < 2 * LARGEST_SEED for seed in rows.seeds):
        raise MotionloomError(f"seed must be {specs(Sampling)['seed'].range}; got {min(rows.seeds)}")
    for row, state in sample(
        prior, rows, sampling, progress=progress, view=single_person_view(prior), choose=best_in_words
    ):
        yield row, prior.to_features(state)


def generate(
    prior: Prior,
    prompts: Sequence[str] | str,
    *,
    seconds: float | Sequence[float] | None = None,
    literal: bool = False,
    as_one: bool = False,
    foot_lock: bool = True,
    sampling: Sampling | None = None,
    progress: Progress | None = None,
    **settings: Unpack[Settings],
) -> list[Motion]:
    """Make motions for each prompt, in order (Tevet et al. 2023; guidance: Ho & Salimans 2022).

    Args:
        prior: the weights, from `Prior.load`.
        prompts: what the person does, one text or several.
        seconds: length, one for all or one per prompt, at the prior's frame rate (20 per second; BABEL's 30); None:
            what numbers in the words need, or as long as the actions take people (`goals.sequence.usual_seconds`).
        literal: the words as they are. Otherwise numbers in them ("3 meters", "turns left 90 degrees", "jumps twice")
            are kept, and what they say plainly (a turn to the left, a wave) is looked for in the motion: where it is
            missing, up to three more are generated from seeds that depend on the motion's own, and the best is kept.
            `tasks.worded.generate_worded` returns what was read, measured and missing too.
        as_one: literal, and one motion of the whole sentence. Otherwise "A, then B" is generated one after the other.
        foot_lock: keep planted feet still, and feet above the floor.
        sampling: how it is sampled; single settings of it may be given as keywords: ``count=2, seed=3, steps=12``.
            Motion i of the answer is sampled from ``seed + i`` alone, or with ``best_of`` (2 to 16) from the best of so
            many seeds, which are sampled half way (`tasks.best`); 4 take two to three times as long.
        progress: called after each network call with the calls done and the calls in all.

    Returns:
        Motions of the 22-joint person, who starts near the origin facing +Z.

    Raises:
        MotionloomError: for an impossible request.
    """
    from motionloom.tasks.worded import generate_worded  # which imports this module

    results = generate_worded(
        prior,
        prompts,
        seconds=seconds,
        literal=literal,
        as_one=as_one,
        foot_lock=foot_lock,
        sampling=sampling,
        progress=progress,
        **settings,
    )
    return [one.motion for one in results]


def generate_each(
    prior: Prior,
    prompts: Sequence[str],
    seconds: Sequence[float],
    *,
    seeds: Sequence[int],
    foot_lock: bool = True,
    sampling: Sampling,
    progress: Progress | None = None,
) -> Iterator[tuple[int, Motion]]:
    """Motions of the words as they are, each with its number as soon as it is finished; else as of `generate`.

    Those of equal length come in order, a batch at a time. seconds, seeds: one per prompt.
    """
    check_features(prior)
    frames = [frames_in(length, prior.fps) for length in seconds]
    for row, features in _sample_motions(prior, Rows(prompts, frames, seeds), sampling, progress):
        yield row, finish(prior, features, foot_lock=foot_lock)


def single_person_view(prior: Prior) -> View:
    """One person to a row, as the network predicted them."""
    return View(lambda states: joint_positions(prior, states)[:, None])


def joint_positions(prior: Prior, states: np.ndarray) -> np.ndarray:
    """(rows, frames, 22, 3) metres of standardised states (rows, frames, numbers); bones may breathe."""
    features = prior.to_features(states)
    if features.shape[-1] == WIDTH:
        return humanml.decode_positions(features)
    return np.stack([finish(prior, row, foot_lock=False).positions() for row in features])


def placed_positions(prior: Prior, features: np.ndarray, place: GroundPose) -> np.ndarray:
    """(frames, 22, 3) metres of features (frames, numbers), not standardised; HumanML3D's begin at ``place``."""
    if features.shape[1] == WIDTH:
        return PlacedMotion(features, place).positions
    return finish(prior, features, foot_lock=False).positions()


def check_features(prior: Prior) -> None:
    """Raise MotionloomError where nothing here makes a motion of the numbers that these weights make (`finish`)."""
    if len(prior.mean) not in _DECODED:
        raise MotionloomError(
            f"these weights make {len(prior.mean)} numbers per frame, and only HumanML3D's {WIDTH} and BABEL's "
            f"{babel.WIDTH} can be turned into a motion; use other weights"
        )


def check_humanml(prior: Prior, subject: str) -> None:
    """Raise MotionloomError unless the weights make HumanML3D's numbers; ``subject``: who needs them, "edits need"."""
    if len(prior.mean) != WIDTH or prior.fps != FPS:
        raise MotionloomError(f"these weights make {len(prior.mean)} numbers a frame; {subject} {WIDTH} at {FPS:g} fps")


def check_goal_length(goal: Goal, fps: float) -> None:
    """Raise MotionloomError for a goal of fewer than 4 frames or of more than `LONGEST` seconds."""
    longest = round(LONGEST * fps)
    if not 4 <= len(goal) <= longest:
        raise MotionloomError(f"a goal of {len(goal)} frames cannot be followed; one of 4 to {longest} can")


def finish(prior: Prior, features: np.ndarray, *, foot_lock: bool = True) -> Motion:
    """Features (frames, numbers) of this prior, not standardised, to a motion at its frame rate.

    With ``foot_lock`` the planted feet hold still: as the features say (263), else by height and speed (135); and who
    climbs (263) has steps of one height under the feet, or stays on the floor (`motionloom.tasks.supported`).
    Frame 0 stands over the origin; the person starts facing +Z. Raises MotionloomError as `check_features` does.
    """
    check_features(prior)
    return _DECODED[len(prior.mean)](features.astype(np.float64), prior.fps, foot_lock)


def _from_humanml(features: np.ndarray, fps: float, foot_lock: bool) -> Motion:
    motion = to_motion(features, fps, foot_lock=foot_lock)
    return add_support(motion) if foot_lock else motion


def _from_babel(features: np.ndarray, fps: float, foot_lock: bool) -> Motion:
    motion = babel.forward(babel.decode(features, fps))
    return clean_feet(motion) if foot_lock else motion


_DECODED: dict[int, Callable[[np.ndarray, float, bool], Motion]] = {WIDTH: _from_humanml, babel.WIDTH: _from_babel}
"""How the numbers of a frame become a motion, by their count."""


def frames_in(seconds: float, fps: float) -> int:
    """Frames of a motion of so many seconds; MotionloomError beyond `LONGEST`."""
    if not (np.isfinite(seconds) and 0 < seconds <= LONGEST):
        raise MotionloomError(
            f"a motion of {seconds:g} seconds cannot be made; ask for more than 0 and at most {LONGEST:g}"
        )
    return max(round(seconds * fps), 4)


def check(prior: Prior, prompts: Sequence[str], *, steps: int, guidance: float, solver: str) -> None:
    """Raise MotionloomError for settings and prompts that nothing can be sampled with."""
    Sampling(steps=steps, guidance=guidance, solver=solver).levels(prior.schedule)
    check_prompts(prompts)


def check_prompts(prompts: Sequence[str]) -> None:
    """Raise MotionloomError for a prompt without words."""
    if not all(prompt.strip() for prompt in prompts):
        raise MotionloomError("a prompt is empty; say in words what the person does")
