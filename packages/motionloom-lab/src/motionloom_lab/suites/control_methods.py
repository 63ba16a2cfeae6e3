"""The rows of the suite `control`: ways to make a motion that meets a goal, each a function of targets and seeds."""

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from functools import cache
from pathlib import Path
from typing import Protocol as Interface

import numpy as np

from motionloom.core.errors import MotionloomError
from motionloom.core.features import humanml
from motionloom.core.methods.blending import control_by_blending
from motionloom.core.methods.edit import Observed
from motionloom.core.methods.walk import Walk
from motionloom.core.models.adapter import Adapter, adapted, adapters
from motionloom.core.models.container import PRIORS
from motionloom.core.models.networks.prior import PriorSession
from motionloom.core.models.prior import Prior
from motionloom.core.motion import Motion
from motionloom.kinematics.physics import Array
from motionloom.requests.sampling import BATCH as ROWS
from motionloom.tasks.text import sample_features, to_motion
from motionloom_lab.suites.control_kinds import Kind, Target
from motionloom_lab.suites.protocol import Drawing

UNCONTROLLED, EXPORTED = "uncontrolled", "uncontrolled, as exported"
INPAINTING, TUNED, BLENDING = "MDM inpainting", "fine-tuned", "DiffusionBlending"
LOOSE, OURS = "ours without exact fit", "ours"
CONTROLS = ("trajectory", "left_wrist", "right_wrist", "left_foot", "right_foot", "head", "any")
"""What a network can be trained to follow."""
ALIASES = {"root_horizontal": "trajectory", "root": "trajectory"}
"""What published checkpoints call it."""
METHODS = (UNCONTROLLED, EXPORTED, INPAINTING, TUNED, BLENDING, LOOSE, OURS)
"""In the order of the table."""
BASE = {
    UNCONTROLLED: UNCONTROLLED,
    INPAINTING: UNCONTROLLED,
    TUNED: UNCONTROLLED,
    BLENDING: UNCONTROLLED,
    EXPORTED: EXPORTED,
    LOOSE: EXPORTED,
    OURS: EXPORTED,
}
"""The uncontrolled row that each is a ratio to: of motions as sampled, or of exported ones."""


@dataclass(frozen=True, eq=False)
class Track:
    """One motion."""

    positions: Array
    """(frames, 22, 3) metres in the goal's world, at 20 frames per second."""
    features: Array
    """(frames, 263) not standardised, for the evaluator."""


class Method(Interface):
    """Motion i of the answer meets target i as well as it can, from seed i alone."""

    def __call__(self, targets: Sequence[Target], *, seeds: Sequence[int]) -> list[Track]: ...


Maker = Callable[[Kind, str], Method]
"""(kind, name out of `METHODS`) to the method; MotionloomError where these weights have none of that name."""


def fits(one: Kind, name: str) -> bool:
    """Whether a method is a row of a kind: one control is fine-tuned, several are blended."""
    return {TUNED: len(one.adapters) == 1, BLENDING: len(one.adapters) > 1}.get(name, True)


def trained_controls(prior: Prior, files: Sequence[str | Path]) -> dict[str, PriorSession]:
    """Networks that were trained for control, by what each was trained for: ``trajectory``, a joint, ``any``.

    Args:
        prior: the weights without control, which each of them is compared with.
        files: adapters of this prior, by file or shipped name, and whole priors that were fine-tuned from it, such as
            imported ones of Shafir et al. 2024 and those of ``train control full=true``. ``CONTROL=FILE`` names the
            control of a file that does not say it.

    Raises:
        MotionloomError: a file that is neither, of other numbers than the prior's, of no known control, or two of one.
    """
    result: dict[str, PriorSession] = {}
    for word in map(str, files):
        named, _, file = word.rpartition("=")
        control, net = _trained_control(prior, file)
        control = ALIASES.get(named or control, named or control)
        if control not in CONTROLS:
            raise MotionloomError(
                f"{file} does not say which control it was trained for ({control!r:.60}); write "
                f"CONTROL={Path(file).name} with one of {', '.join(CONTROLS)}"
            )
        if control in result:
            raise MotionloomError(f"two of the networks were trained for {control}; name one of each control")
        result[control] = net
    return result


def _trained_control(prior: Prior, file: str) -> tuple[str, PriorSession]:
    """What a file was trained for, and its network: an adapter's upon the prior's, or a whole one."""
    path = adapters().get(file) or Path(file)
    if path.is_file() and PRIORS.signed(path):
        whole = Prior.load(path)
        if whole.net.config.features != prior.net.config.features or not (
            np.allclose(whole.mean, prior.mean, atol=1e-4) and np.allclose(whole.std, prior.std, atol=1e-4)
        ):
            raise MotionloomError(f"{file} is of other numbers than the weights; name networks fine-tuned from those")
        known = whole.card.notes.get("control")
        names = (known, whole.card.name, path.stem)
        return next((str(name) for name in names if name in (*CONTROLS, *ALIASES)), path.stem), whole.net
    adapter = Adapter.load(file, prior)
    return adapter.control, adapted(prior.net, adapter)


def maker(prior: Prior, how: Drawing, controls: Mapping[str, PriorSession] | None = None) -> Maker:
    """The methods of a prior and of networks trained for control (`trained_controls`; None: its shipped adapters); a
    control that has none of its own takes ``any``."""
    shipped = adapters()

    @cache
    def net(name: str) -> PriorSession:
        if controls is None:
            return adapted(prior.net, Adapter.load(name if name in shipped else "any", prior))
        chosen = name if name in controls else "any"
        if chosen not in controls:
            raise MotionloomError(f"none of the networks was trained for {name}; there are {', '.join(controls)}")
        return controls[chosen]

    def make(one: Kind, name: str) -> Method:
        if name in (UNCONTROLLED, EXPORTED):
            return uncontrolled(prior, how, exported=name == EXPORTED)
        if name == INPAINTING:
            return published(prior, how, [prior.net], noise_free=False)
        if name in (TUNED, BLENDING):
            return published(prior, how, [net(part) for part in one.adapters], noise_free=True)
        if name in (LOOSE, OURS):
            return ours(prior, how, exact=name == OURS)
        raise MotionloomError(f"there is no way of control {name!r}; there are {', '.join(METHODS)}")

    return make


def uncontrolled(prior: Prior, how: Drawing, *, exported: bool) -> Method:
    """Goals are ignored: motions from the words alone, as the network samples them or as they are exported."""

    def draw(targets: Sequence[Target], *, seeds: Sequence[int]) -> list[Track]:
        motions = sample_features(
            prior, [target.prompt for target in targets], [len(target) for target in targets], seeds=seeds, **how
        )
        features = [one.astype(np.float64) for one in motions]
        return [of_motion(to_motion(one, prior.fps)) if exported else of_features(one) for one in features]

    return draw


def published(prior: Prior, how: Drawing, nets: Sequence[PriorSession], *, noise_free: bool) -> Method:
    """Control in the representation: the fixed numbers are written into every estimate (`core.methods.blending`)."""

    def draw(targets: Sequence[Target], *, seeds: Sequence[int]) -> list[Track]:
        result: dict[int, Track] = {}
        for rows in groups([len(target) for target in targets]):
            some = [targets[row] for row in rows]
            mask = np.stack([target.mask for target in some])
            real = np.stack([target.known for target in some]).astype(np.float32)
            known = Observed((real - prior.mean) / prior.std, mask, noise_free)
            prompts, own = [target.prompt for target in some], [seeds[row] for row in rows]
            features = prior.to_features(control_by_blending(prior, nets, prompts, known, seeds=own, walk=Walk(**how)))
            fixed = np.where(mask, real, features).astype(np.float64)
            result |= {row: of_features(one) for row, one in zip(rows, fixed, strict=True)}
        return [result[row] for row in range(len(targets))]

    return draw


def ours(prior: Prior, how: Drawing, *, exact: bool) -> Method:
    """`tasks.control.control` as it is by default, with or without its exact fit; as exported."""

    def draw(targets: Sequence[Target], *, seeds: Sequence[int]) -> list[Track]:
        from motionloom.tasks.control import control

        tracks = []
        for target, seed in zip(targets, seeds, strict=True):
            (one,) = control(
                prior, target.prompt, target.goal, seed=seed, guidance=how["guidance"], steps=how["steps"], fit=exact
            )
            tracks.append(of_motion(one.motion))
        return tracks

    return draw


def of_features(features: np.ndarray) -> Track:
    """A motion as it is sampled; it starts at the origin facing +Z, as the real one does."""
    return Track(humanml.decode_positions(features), features)


def of_motion(motion: Motion) -> Track:
    """A motion as it is exported, on 22 joints at 20 frames per second; the last frame's numbers are there twice."""
    positions = motion.positions()
    features = humanml.positions_to_features(positions, motion.fps).astype(np.float64)
    return Track(positions, np.concatenate([features, features[-1:]]))  # a frame has a step only to the next one


def groups(lengths: Sequence[int]) -> list[list[int]]:
    """Rows of equal length, at most `ROWS` together."""
    by_length: dict[int, list[int]] = {}
    for row, length in enumerate(lengths):
        by_length.setdefault(length, []).append(row)
    return [rows[at : at + ROWS] for rows in by_length.values() for at in range(0, len(rows), ROWS)]


def checked(tracks: Sequence[Track], targets: Sequence[Target]) -> list[Track]:
    """The motions, if they have the lengths of the targets; ValueError otherwise, since a number would be a lie."""
    for one, target in zip(tracks, targets, strict=True):
        if one.positions.shape != target.goal.positions.shape or len(one.features) != len(target):
            raise ValueError(f"a motion of {one.positions.shape} for a goal of {target.goal.positions.shape}")
        if not np.isfinite(one.positions).all():
            raise ValueError("a motion has numbers that are not finite")
    return list(tracks)
