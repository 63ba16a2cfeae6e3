"""Human motion from words, with a diffusion model as the prior.

    from motionloom import Prior, generate, save
    [motion] = generate(Prior.load(), "a person walks forward and waves", seed=1)
    save(motion, "walk.bvh")

Values: a `Motion` is a `Skeleton` (`SMPL22` has 22 joints), frames per second, and in each frame the root's place and
the rotation of every joint. Metres, seconds, radians; right-handed, +Y up, a person faces +Z; quaternions (w, x, y, z).

From words, with a `Prior`:
    generate            motions of one sentence or several, as a list; `generate_worded` tells what was read and missed
    compose             one long motion of `Segment`s; `compose_stream` yields it in blocks, for hours
    control             motions that meet a `Goal`: a path, places of hands, poses; each comes as a `Controlled`
    edit                a clip changed by `Redraw`, `Extend` or `Loop`
    Live, LivePair      people who move without end and follow requests meanwhile

Without words, with a `Predictor`:
    predict, switch     what may come after a clip; a transition from one clip to another. `FixedJoints` of
                        `FixedPart`s hold parts of what comes

Two people in one world, with a `PairBlock`:
    generate_pair       both at once; `complete_pair` continues two clips, `react` answers one person's
    compose_pair        one long duet; `compose_pair_stream` yields it in blocks

Files and bodies:
    load, save          .bvh, .glb, .npz, films and others, by the suffix
    retarget            a motion onto another skeleton; `to_smpl22` and `from_smpl22` by way of the 22 joints
    measure_deeds       what a motion does (`Deeds`): steps, turns, waves
    batch, read_batch   motions of many rows into a folder, and what such a folder holds

`Sampling`, `PairSampling` and `PredictionSampling` hold seed, steps, guidance and the like; their fields are keywords
of the functions above too. `save_prior` and `save_predictor` write weight files. What a caller got wrong raises
`MotionloomError` with one sentence. `help(motionloom.generate)` and the like list the arguments.
"""

from importlib import import_module
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from motionloom.bulk.batch import batch
    from motionloom.bulk.metadata import read_batch
    from motionloom.core.errors import MotionloomError
    from motionloom.core.models.pair import PairBlock
    from motionloom.core.models.predictor import Predictor, save_predictor
    from motionloom.core.models.prior import Prior, save_prior
    from motionloom.core.motion import Motion
    from motionloom.core.skeleton import SMPL22, Skeleton
    from motionloom.goals.goal import Goal
    from motionloom.goals.hold import FixedJoints, FixedPart
    from motionloom.goals.segment import Segment
    from motionloom.io import load, save
    from motionloom.kinematics.deeds import Deeds, measure_deeds
    from motionloom.live.live import Live
    from motionloom.live.pair import LivePair
    from motionloom.requests.sampling import PairSampling, PredictionSampling, Sampling
    from motionloom.retarget import from_smpl22, retarget, to_smpl22
    from motionloom.tasks.control import Controlled, control
    from motionloom.tasks.duet import compose_pair, compose_pair_stream, react
    from motionloom.tasks.edit import Extend, Loop, Redraw, edit
    from motionloom.tasks.long import compose, compose_stream
    from motionloom.tasks.pair import complete_pair, generate_pair
    from motionloom.tasks.predict import predict, switch
    from motionloom.tasks.text import generate
    from motionloom.tasks.worded import generate_worded

_NAMES = {
    "bulk.batch": "batch",
    "bulk.metadata": "read_batch",
    "core.errors": "MotionloomError",
    "goals.goal": "Goal",
    "goals.hold": "FixedJoints FixedPart",
    "goals.segment": "Segment",
    "io": "load save",
    "kinematics.deeds": "Deeds measure_deeds",
    "live.live": "Live",
    "live.pair": "LivePair",
    "core.motion": "Motion",
    "requests.sampling": "PairSampling PredictionSampling Sampling",
    "retarget": "from_smpl22 retarget to_smpl22",
    "core.skeleton": "SMPL22 Skeleton",
    "tasks.control": "Controlled control",
    "tasks.duet": "compose_pair compose_pair_stream react",
    "tasks.edit": "Extend Loop Redraw edit",
    "tasks.long": "compose compose_stream",
    "tasks.pair": "complete_pair generate_pair",
    "tasks.predict": "predict switch",
    "tasks.text": "generate",
    "tasks.worded": "generate_worded",
    "core.models.pair": "PairBlock",
    "core.models.predictor": "Predictor save_predictor",
    "core.models.prior": "Prior save_prior",
}
_PLACES = {name: module for module, names in _NAMES.items() for name in names.split()}

__all__ = [
    "SMPL22",
    "Controlled",
    "Deeds",
    "Extend",
    "FixedJoints",
    "FixedPart",
    "Goal",
    "Live",
    "LivePair",
    "Loop",
    "Motion",
    "MotionloomError",
    "PairBlock",
    "PairSampling",
    "PredictionSampling",
    "Predictor",
    "Prior",
    "Redraw",
    "Sampling",
    "Segment",
    "Skeleton",
    "batch",
    "complete_pair",
    "compose",
    "compose_pair",
    "compose_pair_stream",
    "compose_stream",
    "control",
    "edit",
    "from_smpl22",
    "generate",
    "generate_pair",
    "generate_worded",
    "load",
    "measure_deeds",
    "predict",
    "react",
    "read_batch",
    "retarget",
    "save",
    "save_predictor",
    "save_prior",
    "switch",
    "to_smpl22",
]


def __getattr__(name: str) -> Any:
    """Import the public names when they are used: `motionloom --help` needs none of the libraries behind them."""
    if name not in _PLACES:
        raise AttributeError(f"module 'motionloom' has no attribute {name!r}")
    return getattr(import_module(f"motionloom.{_PLACES[name]}"), name)
