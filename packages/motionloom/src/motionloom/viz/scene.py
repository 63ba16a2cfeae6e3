"""People in one scene: who is where at which moment, and the cameras that keep everybody in the picture.

Metres, +Y up, seconds; all motions lie in one world frame.
"""

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from motionloom.core.motion import Motion
from motionloom.io.stream import joined
from motionloom.viz.draw import PAPER, Array, Camera, Colour, mix
from motionloom.viz.figure import Figure, figure

TRAIL = 4.0
"""Seconds of everybody's way that are drawn on the floor."""


@dataclass(frozen=True)
class Actor:
    """One motion in a scene."""

    motion: Motion
    colour: Colour
    start: float = 0.0
    """Seconds from the scene's beginning to the motion's first frame."""
    opacity: float = 1.0
    label: str = ""
    """For the legend; nothing where empty."""
    stays: bool = True
    """Holds its last pose when it has ended; else it is gone then."""
    marks: tuple[int, ...] = ()
    """Numbers of joints that get a white dot."""


# --- who is where, when -------------------------------------------------------------------------------------------


@dataclass(frozen=True)
class Shot:
    """One pose of one actor."""

    actor: Actor
    shape: Figure
    frame: int
    opacity: float

    def points(self) -> Array:
        """(points, 3): what must be in the picture."""
        return self.shape.places[self.frame, [self.shape.centre, *(child for _, child in self.shape.bones)]]


class Stage:
    """All actors at one rate, on one floor; those of one skeleton are studied together, so that they look alike."""

    def __init__(self, actors: Sequence[Actor], rate: float) -> None:
        self.rate = rate
        sampled = [_sampled(actor, rate) for actor in actors]
        shapes: dict[int, Figure] = {}
        for members in _alike(sampled):
            whole = figure(joined([sampled[i] for i in members]))
            ends = np.cumsum([len(sampled[i]) for i in members])
            shapes |= {i: _part(whole, end - len(sampled[i]), end) for i, end in zip(members, ends.tolist())}
        self.floor = min(shape.floor for shape in shapes.values())
        self.cast = [(a, replace(shapes[i], floor=self.floor), _first(a, rate)) for i, a in enumerate(actors)]
        self.height = max(shape.height for shape in shapes.values())
        self.length = max(first + len(shape) for _, shape, first in self.cast)

    def shots(self, time: int) -> list[Shot]:
        """Everybody who is there at a frame of the scene."""
        shots = []
        for actor, shape, first in self.cast:
            frame = min(time - first, len(shape) - 1) if actor.stays else time - first
            if 0 <= frame < len(shape):
                shots.append(Shot(actor, shape, frame, actor.opacity))
        return shots

    def trails(self, time: int) -> list[tuple[Array, Colour]]:
        """Everybody's way on the floor in the last seconds before a frame of the scene, and its colour."""
        oldest = time - round(TRAIL * self.rate)
        return [
            (
                shape.path[max(0, oldest - first) : time - first + 1],
                mix(PAPER, actor.colour, 0.25 + 0.6 * actor.opacity),
            )
            for actor, shape, first in self.cast
            if time >= first and oldest < first + len(shape)
        ]


def _first(actor: Actor, rate: float) -> int:
    """The scene's frame of an actor's first pose."""
    return int(np.ceil(actor.start * rate - 1e-6))


def _sampled(actor: Actor, rate: float) -> Motion:
    """An actor's poses at the scene's frames, exact in time."""
    motion, first = actor.motion, _first(actor, rate)
    stop = int(np.ceil((actor.start + motion.seconds) * rate - 1e-6))
    times = np.arange(first, max(stop, first + 1)) / rate
    return motion.at(np.maximum((times - actor.start) * motion.fps, 0.0), rate)


def _alike(motions: Sequence[Motion]) -> list[list[int]]:
    """Numbers of the motions, those of one skeleton together."""
    groups: list[list[int]] = []
    for i, motion in enumerate(motions):
        group = next((g for g in groups if motions[g[0]].skeleton == motion.skeleton), None)
        if group is None:
            groups.append([i])
        else:
            group.append(i)
    return groups


def _part(whole: Figure, start: int, stop: int) -> Figure:
    places, forward, gaze, contacts = (v[start:stop] for v in (whole.places, whole.forward, whole.gaze, whole.contacts))
    return replace(whole, places=places, forward=forward, gaze=gaze, contacts=contacts)


# --- cameras ------------------------------------------------------------------------------------------------------


def azimuth_of(stage: Stage) -> float:
    """The horizontal direction from which the scene is widest; from the front right of people who stay in place."""
    times = np.unique(np.linspace(0, stage.length - 1, 80).round().astype(int))
    crowds = [shots for t in times.tolist() if (shots := stage.shots(t))]
    middles = np.array([np.mean([s.shape.path[s.frame] for s in shots], axis=0) for shots in crowds])
    scatter = _scatter(middles)
    for shots in crowds:
        places = np.array([s.shape.path[s.frame] for s in shots])
        bodies = sum((_scatter(s.points()) for s in shots), np.zeros((2, 2))) / len(shots)
        scatter = scatter + (3 * _scatter(places) + bodies) / len(crowds)
    sizes, axes = np.linalg.eigh(scatter)
    facing = sum((s.shape.forward[s.frame] for shots in crowds for s in shots), np.zeros(3))
    if sizes[1] < max((0.22 * stage.height) ** 2, 1.5 * sizes[0]):
        return float(np.arctan2(facing[0], facing[2])) - 0.75
    along = axes[:, 1]
    way = (middles[-1] - middles[0])[[0, 2]]
    if np.linalg.norm(way) > 0.3 * stage.height and abs(along @ way) > 1e-9:
        along = along * np.sign(along @ way)
    side = float(np.arctan2(-along[1], along[0]))
    turns = {turn: float(facing @ [np.sin(side + turn), 0.0, np.cos(side + turn)]) for turn in (0.0, 0.3, -0.3)}
    best = max(turns, key=lambda turn: turns[turn])
    return side + (best if turns[best] > turns[0.0] + 0.1 * float(np.linalg.norm(facing)) else 0.0)


def _scatter(points: Array) -> Array:
    """(2, 2) mean square spread on the ground."""
    flat = points[:, [0, 2]] - points[:, [0, 2]].mean(axis=0)
    return flat.T @ flat / len(flat)


def extent(shots: Sequence[Shot], axes: Array) -> tuple[Array, Array]:
    """Lowest and highest coordinates of people along a camera's axes, (3,) metres each."""
    view = np.concatenate([s.points() for s in shots]) @ axes.T
    return view.min(axis=0), view.max(axis=0)


def span_of(shots: Sequence[Shot], axes: Array, middle: Array, *, fill: tuple[float, float], margin: float) -> float:
    """The span that shows people whole around a point ``middle`` (3,) of the camera's axes.

    A point x beside and z before the target is seen at x d / (d - z) for an eye at d = 3.2 spans; it is within
    ``fill`` (width and height of what may be used, in picture heights) where span >= 2 x / fill + z / 3.2.
    """
    view = np.concatenate([s.points() for s in shots]) @ axes.T - middle
    beside = np.maximum(*(2 * (np.abs(view[:, k]) + margin) / fill[k] for k in (0, 1)))
    return float((beside + np.maximum(view[:, 2], 0.0) / 3.2).max())


def follow(stage: Stage, count: int, size: tuple[int, int]) -> list[Camera]:
    """Cameras, one per frame, that glide after the people and draw back for those who drift apart."""
    azimuth = azimuth_of(stage)
    axes = Camera(np.zeros(3), size, 1.0, azimuth).axes()
    crowds = [stage.shots(t) for t in range(count)]
    last = next(c for c in crowds if c)
    crowds = [last := crowd or last for crowd in crowds]
    middles = np.array([np.mean(extent(crowd, axes), axis=0) for crowd in crowds])
    width = 0.5 * stage.rate
    middles = smoothed(middles, width)
    fill = (size[0] / size[1] - 0.04, max(0.5, 1 - 2 * 46 / size[1]))
    margin = 0.1 * stage.height
    spans = [span_of(c, axes, m, fill=fill, margin=margin) for c, m in zip(crowds, middles)]
    reach = int(np.ceil(2.5 * width))
    padded = np.pad(np.array(spans), reach, mode="edge")
    widest = np.lib.stride_tricks.sliding_window_view(padded, 2 * reach + 1).max(axis=1)
    spans = np.maximum(smoothed(widest[:, None], width)[:, 0], 1.25 * stage.height)
    return [Camera(m @ axes, size, s, azimuth) for m, s in zip(middles, spans.tolist())]


def smoothed(values: Array, width: float) -> Array:
    """Gaussian smoothing along axis 0 of (frames, channels), ``width`` in frames; the ends are held."""
    reach = int(np.ceil(2.5 * width))
    kernel = np.exp(-0.5 * (np.arange(-reach, reach + 1) / max(width, 1e-6)) ** 2)
    padded = np.pad(values, ((reach, reach), (0, 0)), mode="edge")
    return np.stack([np.convolve(column, kernel / kernel.sum(), "valid") for column in padded.T], axis=-1)
