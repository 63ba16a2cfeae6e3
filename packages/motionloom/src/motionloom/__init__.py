"""motionloom: human motion from words, with a diffusion model as the prior.

from motionloom import Prior, generate, save
motions = generate(Prior.load(), ["a person walks forward"], seconds=5.0, seed=1)
save(motions[0], "walk.bvh")

`compose` makes long motions out of `Segment`s, `control` motions that meet a `Goal`, `edit` changes clips; a
`Predictor` can `predict` what somebody does next, or `switch` from one clip to another. With a `PairBlock` two people
come into one world: `generate_pair`, `complete_pair`, `react`, `compose_pair`. `Live` and `LivePair`
move without end and follow requests meanwhile.
"""

from importlib import import_module
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from motionloom.bulk.batch import batch
    from motionloom.bulk.metadata import read_batch
    from motionloom.errors import MotionloomError
    from motionloom.goals.goal import Goal
    from motionloom.goals.hold import FixedJoints, FixedPart
    from motionloom.goals.segment import Segment
    from motionloom.io import load, save
    from motionloom.kinematics.deeds import Deeds, measure_deeds
    from motionloom.live.live import Live
    from motionloom.live.pair import LivePair
    from motionloom.motion import Motion
    from motionloom.requests.sampling import PairSampling, PredictionSampling, Sampling
    from motionloom.retarget import from_smpl22, retarget, to_smpl22
    from motionloom.skeleton import SMPL22, Skeleton
    from motionloom.tasks.control import Controlled, control
    from motionloom.tasks.duet import compose_pair, compose_pair_stream, react
    from motionloom.tasks.edit import Extend, Loop, Redraw, edit
    from motionloom.tasks.long import compose, compose_stream
    from motionloom.tasks.pair import complete_pair, generate_pair
    from motionloom.tasks.predict import predict, switch
    from motionloom.tasks.text import generate
    from motionloom.tasks.worded import generate_worded
    from motionloom.weights.pair import PairBlock
    from motionloom.weights.predictor import Predictor, save_predictor
    from motionloom.weights.prior import Prior, save_prior

_NAMES = {
    "bulk.batch": "batch",
    "bulk.metadata": "read_batch",
    "errors": "MotionloomError",
    "goals.goal": "Goal",
    "goals.hold": "FixedJoints FixedPart",
    "goals.segment": "Segment",
    "io": "load save",
    "kinematics.deeds": "Deeds measure_deeds",
    "live.live": "Live",
    "live.pair": "LivePair",
    "motion": "Motion",
    "requests.sampling": "PairSampling PredictionSampling Sampling",
    "retarget": "from_smpl22 retarget to_smpl22",
    "skeleton": "SMPL22 Skeleton",
    "tasks.control": "Controlled control",
    "tasks.duet": "compose_pair compose_pair_stream react",
    "tasks.edit": "Extend Loop Redraw edit",
    "tasks.long": "compose compose_stream",
    "tasks.pair": "complete_pair generate_pair",
    "tasks.predict": "predict switch",
    "tasks.text": "generate",
    "tasks.worded": "generate_worded",
    "weights.pair": "PairBlock",
    "weights.predictor": "Predictor save_predictor",
    "weights.prior": "Prior save_prior",
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
