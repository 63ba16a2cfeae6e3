"""Channels of a glTF animation: reading their keys, finding their frame rate, sampling them on a common clock."""

from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from motionloom.core import rotations as rot
from motionloom.core.blending import hermite
from motionloom.core.files.text import shown
from motionloom.io.glb import Document

Array = NDArray[np.float64]
FREE_POSES = 2_000_000
"""Frames times joints that any file may ask for; more only as far as the file itself holds as many keys."""
FPS_LIMIT = 1000.0
FALLBACK_FPS = 30.0


@dataclass(frozen=True)
class Curve:
    """One channel: key times (keys,) and values (keys, width), with tangents around them where cubic."""

    times: Array
    values: Array
    mode: str
    arriving: Array | None = None
    leaving: Array | None = None


Curves = dict[tuple[int, str], Curve]


def unit_quaternions(document: Document, xyzw: Array, what: str) -> Array:
    """(..., 4) x, y, z, w of about unit length to w, x, y, z."""
    length = np.linalg.norm(xyzw, axis=-1)
    if not ((length > 0.1) & (length < 10)).all():
        raise document.bad(f"{what} is not a unit quaternion")
    return rot.normalize(np.roll(xyzw, 1, axis=-1))


def channels_of(document: Document, nodes: int) -> list[dict[tuple[int, str], dict[str, Any]]]:
    """For each animation its samplers by (node, path)."""
    result = []
    for animation in document.items("animations"):
        samplers = document.items("samplers", animation)
        channels: dict[tuple[int, str], dict[str, Any]] = {}
        for channel in document.items("channels", animation):
            target = channel.get("target")
            if not isinstance(target, dict) or target.get("path") not in ("translation", "rotation", "scale"):
                continue
            if target.get("node") is None:
                continue
            node = document.index(target["node"], nodes, "nodes")
            number = document.index(channel.get("sampler"), len(samplers), "animation samplers")
            channels[node, target["path"]] = samplers[number]
        result.append(channels)
    return result


def read_curves(document: Document, samplers: dict[tuple[int, str], dict[str, Any]]) -> Curves:
    """Read the samplers by (node, path); raises `MotionloomError` for keys that are no keys."""
    clocks: dict[int, Array] = {}  # channels share their key times
    curves: Curves = {}
    held, most = 0, 1_000_000 + sum(len(b) for b in document.buffers)  # entries may share bytes, within reason
    for (node, path), sampler in samplers.items():
        key = document.index(sampler.get("input"), len(document.items("accessors")), "accessors")
        if key not in clocks:
            times = clocks[key] = document.accessor(key, "SCALAR", "an animation's key times")[:, 0]
            if not (np.diff(times) > 0).all() or np.abs(times).max() > 1e7:
                raise document.bad("an animation's key times do not rise")
            held += times.size
        curve = curves[node, path] = _curve(document, sampler, clocks[key], f"the {path} of node {node}")
        held += curve.values.size
        if held > most:
            raise document.bad("its animation claims more numbers than the file holds")
    return curves


def _curve(document: Document, sampler: dict[str, Any], times: Array, what: str) -> Curve:
    mode = sampler.get("interpolation", "LINEAR")
    if mode not in ("LINEAR", "STEP", "CUBICSPLINE"):
        raise document.bad(f"{what} has the unknown interpolation {shown(str(mode))}")
    turn = what.startswith("the rotation")
    values = document.accessor(sampler.get("output"), "VEC4" if turn else "VEC3", what)
    each = 3 if mode == "CUBICSPLINE" else 1
    if len(values) != each * len(times):
        raise document.bad(f"{what} has {len(values)} values for {len(times)} key times")
    if np.abs(values).max() > 1e9:
        raise document.bad(f"{what} holds absurdly large numbers")
    if each == 1:
        return Curve(times, unit_quaternions(document, values, what) if turn else values, mode)
    arriving, values, leaving = (values[k::3] for k in range(3))
    if turn:
        unit_quaternions(document, values, what)
        arriving, values, leaving = (np.roll(v, 1, axis=-1) for v in (arriving, values, leaving))
    return Curve(times, values, mode, arriving, leaving)


def clock(document: Document, curves: Curves, joints: int, declared: float | None) -> tuple[float, Array]:
    """Frame rate and times (frames,) of the samples, from the channel with the most keys and what is `declared_fps`."""
    if not curves:
        return FALLBACK_FPS, np.zeros(1)
    start = min(float(c.times[0]) for c in curves.values())
    end = max(float(c.times[-1]) for c in curves.values())
    fps = _rate(max((c.times for c in curves.values()), key=len), declared)
    frames = (end - start) * fps
    if frames * joints > FREE_POSES + 4 * sum(c.values.size for c in curves.values()):
        raise document.bad(f"its animation of {end - start:.6g} s with {joints} joints at {fps:.6g} fps is too large")
    return fps, start + np.arange(int(np.floor(frames + 0.1)) + 1) / fps


def declared_fps(animation: dict[str, Any]) -> float | None:
    """The frame rate that an animation of our own states; None for others'."""
    extras = animation.get("extras")
    fps = extras.get("fps") if isinstance(extras, dict) else None
    if isinstance(fps, int | float) and not isinstance(fps, bool) and 0 < fps <= 1e5:
        return float(fps)
    return None


def _rate(times: Array, declared: float | None) -> float:
    """Frames per second of evenly spaced keys; `FALLBACK_FPS` for keys placed by hand or very far apart."""
    if len(times) < 2:
        return declared or FALLBACK_FPS
    steps = np.diff(times)
    step = float(times[-1] - times[0]) / len(steps)
    slack = 2e-7 * float(np.abs(times).max()) + 1e-3 * step  # times are stored in single precision
    if declared is not None:
        ticks = (times - times[0]) * declared
        if np.abs(ticks - np.round(ticks)).max() < 0.02 + slack * declared:
            return declared
    if np.abs(steps - step).max() > 2 * slack:
        step = float(np.median(steps))  # a few keys were dropped, or it is hand work
        whole = np.round(steps / step)
        if np.abs(steps - whole * step).max() > 0.05 * step or (whole < 1).any():
            return FALLBACK_FPS
    fps = 1 / step
    if not 10 * 0.99 < fps < FPS_LIMIT * 1.01:
        return FALLBACK_FPS
    rates = (24000 / 1001, 30000 / 1001, 60000 / 1001, round(fps))
    common = [c for c in rates if abs(fps / c - 1) < 3e-4]
    return float(min(common, key=lambda c: abs(fps - c))) if common else fps


def sample(curve: Curve, times: Array, fps: float, *, turn: bool) -> Array:
    """Values (frames, width) at the given times; the ends are held."""
    keys, values = curve.times, curve.values
    near = 1e-3 / fps + 2e-7 * float(np.abs(times).max())
    if curve.mode != "CUBICSPLINE" and len(keys) == len(times) and np.abs(keys - times).max() < near:
        return values
    end = len(keys) - 1
    low = np.clip(np.searchsorted(keys, times + near, side="right") - 1, 0, end)
    high = np.minimum(low + 1, end)
    gap = keys[high] - keys[low]
    amount = np.clip((times - keys[low]) / np.where(gap > 0, gap, 1.0), 0.0, 1.0) * (gap > 0)
    a, b, s = values[low], values[high], amount[:, None]
    if curve.mode == "STEP":
        return a
    if curve.mode == "LINEAR":
        return rot.slerp(a, b, amount) if turn else a * (1 - s) + b * s
    assert curve.arriving is not None
    assert curve.leaving is not None
    wide = gap[:, None]
    first, leaving, last, arriving = hermite(s)
    result = first * a + leaving * wide * curve.leaving[low]
    result += last * b + arriving * wide * curve.arriving[high]
    return rot.normalize(result) if turn else result
