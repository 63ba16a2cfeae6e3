"""A small painter: a camera, capsules, hulls, a tiled floor. Pillow draws flat polygons; numpy makes them.

Pictures are drawn at twice their size and reduced, which smooths every edge. Metres, +Y up; pixels, y down.
"""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from PIL import Image, ImageDraw, ImageFilter

from motionloom.viz.figure import Figure

Array = NDArray[np.float64]
Colour = tuple[int, int, int]

SMOOTH = 2  # supersampling
PAPER: Colour = (247, 248, 250)
TILE: Colour = (224, 228, 235)
LINE: Colour = (190, 197, 208)
INK: Colour = (40, 46, 58)
QUIET: Colour = (120, 128, 142)
LEFT: Colour = (233, 116, 64)
RIGHT: Colour = (52, 116, 205)
MIDDLE: Colour = (112, 119, 134)
SKIN: Colour = (226, 190, 160)
CONTACT: Colour = (24, 178, 107)
PATH: Colour = (150, 92, 190)
SHADOW: Colour = (96, 104, 122)
TILE_SIZE = 0.5  # metres


@dataclass(frozen=True)
class Camera:
    """A pinhole camera that looks at a point from an azimuth and an elevation."""

    target: Array
    """(3,) metres: what is in the middle of the picture."""
    size: tuple[int, int]
    """Picture in pixels, before smoothing."""
    span: float
    """Metres that fit the picture's height at the target."""
    azimuth: float
    """Radians about +Y; 0 looks at the front of somebody who faces +Z."""
    elevation: float = 0.3
    """Radians above the horizon."""
    corner: tuple[int, int] = (0, 0)
    """Smooth-scale pixels that are cut off at the left and the top."""

    @property
    def distance(self) -> float:
        """Metres from the eye to the target; far enough for little distortion."""
        return 3.2 * self.span

    def axes(self) -> Array:
        """(3, 3): right, up and towards the eye, as rows."""
        ca, sa, ce, se = np.cos(self.azimuth), np.sin(self.azimuth), np.cos(self.elevation), np.sin(self.elevation)
        return np.array([[ca, 0.0, -sa], [-sa * se, ce, -ca * se], [sa * ce, se, ca * ce]])

    def see(self, points: Array) -> tuple[Array, Array, Array]:
        """Points (..., 3) to smooth-scale pixels (..., 2), depths (...) and pixels per metre (...)."""
        view = (points - self.target) @ self.axes().T
        depth = np.maximum(self.distance - view[..., 2], 0.05 * self.distance)
        scale = SMOOTH * self.size[1] / self.span * self.distance / depth
        x = SMOOTH * self.size[0] / 2 - self.corner[0] + view[..., 0] * scale
        y = SMOOTH * self.size[1] / 2 - self.corner[1] - view[..., 1] * scale
        return np.stack([x, y], axis=-1), depth, scale


def mix(a: Colour, b: Colour, amount: float) -> Colour:
    """A colour between a (0) and b (1)."""
    red, green, blue = (round(x + (y - x) * amount) for x, y in zip(a, b))
    return red, green, blue


def shades(tint: Colour) -> dict[int, Colour]:
    """A person's own colour by side: the left (1) lighter, the right (-1) darker."""
    return {0: tint, 1: mix(tint, PAPER, 0.3), -1: mix(tint, INK, 0.25)}


_HALF = np.linspace(-np.pi / 2, np.pi / 2, 9)
_ROUND = np.linspace(0, 2 * np.pi, 20, endpoint=False)


def capsules(a: Array, b: Array, radius_a: Array, radius_b: Array) -> Array:
    """Outlines (count, 18, 2) of the tapered capsules from a to b (count, 2) with radii (count,), pixels."""
    along = b - a
    angle = np.arctan2(along[:, 1], along[:, 0])[:, None]
    far = b[:, None] + radius_b[:, None, None] * np.stack([np.cos(angle + _HALF), np.sin(angle + _HALF)], axis=-1)
    turned = angle + np.pi + _HALF
    near = a[:, None] + radius_a[:, None, None] * np.stack([np.cos(turned), np.sin(turned)], axis=-1)
    return np.concatenate([far, near], axis=1)


def hull(centres: Array, radii: Array) -> list[tuple[float, float]]:
    """Convex outline around discs: centres (count, 2), radii (count,)."""
    ring = np.stack([np.cos(_ROUND), np.sin(_ROUND)], axis=-1)
    points = sorted((x, y) for x, y in (centres[:, None] + radii[:, None, None] * ring).reshape(-1, 2).tolist())

    def half(ordered: list[tuple[float, float]]) -> list[tuple[float, float]]:
        chain: list[tuple[float, float]] = []
        for p in ordered:
            while len(chain) > 1 and _turns_right(chain[-2], chain[-1], p):
                chain.pop()
            chain.append(p)
        return chain[:-1]

    return half(points) + half(points[::-1])


def _turns_right(a: tuple[float, float], b: tuple[float, float], c: tuple[float, float]) -> bool:
    return (b[0] - a[0]) * (c[1] - a[1]) - (b[1] - a[1]) * (c[0] - a[0]) <= 0


def tile_step(span: float) -> float:
    """Side of a floor tile in metres: half a metre, doubled for wide views."""
    return TILE_SIZE * max(1, 2 ** int(np.ceil(np.log2(max(span / 4.5, 1e-6)))))


def paint_floor(pen: ImageDraw.ImageDraw, camera: Camera, floor: float, *, step: float | None = None) -> None:
    """Tiles that stay in the world and fade into the paper; ``step`` is their side (None: as `tile_step` says)."""
    reach = camera.span * max(1.0, 0.62 * camera.size[0] / camera.size[1]) * 1.45
    step = tile_step(camera.span) if step is None else step
    count = int(np.ceil(reach / step)) + 1
    middle = np.floor(camera.target[[0, 2]] / step).astype(int)
    i, j = np.meshgrid(*(np.arange(m - count, m + count + 1) for m in middle), indexing="ij")
    i, j = (v[(i + j) % 2 == 0] for v in (i, j))
    away = np.hypot((i + 0.5) * step - camera.target[0], (j + 0.5) * step - camera.target[2]) / reach
    keep = away < 1
    i, j, away = i[keep], j[keep], away[keep]
    corners = np.array([[0, 0], [1, 0], [1, 1], [0, 1]])
    flat = (np.stack([i, j], axis=-1)[:, None] + corners) * step
    ground = np.stack([flat[..., 0], np.full(flat.shape[:2], floor), flat[..., 1]], axis=-1)
    places, _, _ = camera.see(ground)
    for outline, far in zip(places.reshape(len(places), 8).tolist(), away.tolist()):
        pen.polygon(outline, fill=mix(TILE, PAPER, far**2))


def paint_path(pen: ImageDraw.ImageDraw, camera: Camera, path: Array, colour: Colour, width: float) -> None:
    """A line on the floor through (frames, 3) points; width in metres."""
    if len(path) < 2:
        return
    places, _, scale = camera.see(path)
    thick = max(2, round(float(np.median(scale)) * width))
    pen.line([tuple(p) for p in places.tolist()], fill=colour, width=thick, joint="curve")


def paint_shadow(picture: Image.Image, camera: Camera, shape: Figure, frame: int, *, strength: float = 0.36) -> None:
    """A soft blot on the floor straight below the body; ``strength`` is its opacity."""
    if not shape.bones:
        return
    places = shape.places[frame].copy()
    places[:, 1] = shape.floor
    xy, _, scale = camera.see(places)
    a, b = (np.array([bone[k] for bone in shape.bones]) for k in (0, 1))
    reach = 1.25 * shape.radii.max(axis=1) + 0.008 * shape.height
    outlines = capsules(xy[a], xy[b], reach * scale[a], reach * scale[b])
    squash = np.sin(camera.elevation) + 0.15
    if shape.hips:
        seat = xy[shape.centre] + 0.07 * shape.height * scale[shape.centre] * np.stack(
            [np.cos(_ROUND), squash * np.sin(_ROUND)], axis=-1
        )
        outlines = [*outlines, seat]
    flat = np.concatenate(list(outlines))
    margin = 16
    low = np.maximum(np.floor(flat.min(axis=0)).astype(int) - margin, 0)
    high = np.minimum(np.ceil(flat.max(axis=0)).astype(int) + margin, picture.size)
    if (high <= low).any():
        return
    shrink = 4
    wide, tall = (high - low).tolist()
    mask = Image.new("L", (max(wide // shrink, 1), max(tall // shrink, 1)))
    pen = ImageDraw.Draw(mask)
    for outline in outlines:
        pen.polygon(((outline - low) / shrink).ravel().tolist(), fill=round(255 * strength))
    mask = mask.filter(ImageFilter.BoxBlur(2)).resize((wide, tall), Image.Resampling.BILINEAR)
    picture.paste(SHADOW, (int(low[0]), int(low[1])), mask)


def paint_body(
    pen: ImageDraw.ImageDraw,
    camera: Camera,
    shape: Figure,
    frame: int,
    *,
    trunk: Colour = MIDDLE,
    tinted: bool = False,
) -> None:
    """The person, far parts first; a body without bones is a ball.

    ``tinted``: all of the body in shades of ``trunk``, the left side lighter and the right darker, floor contacts
    unmarked; else the sides and contacts have the colours of this module.
    """
    skin = mix(trunk, PAPER, 0.55) if tinted else SKIN
    colours = shades(trunk) if tinted else {0: trunk, 1: LEFT, -1: RIGHT}
    if not shape.bones:
        at, _, scale = camera.see(shape.places[frame, :1])
        pen.polygon(hull(at, 0.06 * shape.height * scale), fill=trunk)
        return
    places = shape.places[frame]
    xy, depth, scale = camera.see(places)
    parts: list[tuple[float, list[float], list[float], Colour]] = []
    a, b = (np.array([bone[k] for bone in shape.bones], dtype=int) for k in (0, 1))
    radius_a, radius_b = shape.radii[:, 0] * scale[a], shape.radii[:, 1] * scale[b]
    edge = max(1.0, 0.0052 * shape.height * float(scale[shape.centre]))
    outer = capsules(xy[a], xy[b], radius_a + edge, radius_b + edge).reshape(len(a), -1).tolist()
    inner = capsules(xy[a], xy[b], radius_a, radius_b).reshape(len(a), -1).tolist()
    inside = np.array([shape.sides[child] == 0 for _, child in shape.bones], dtype=bool)  # the neck starts in the chest
    middles = ((depth[a] + depth[b]) / 2 + 0.08 * shape.height * inside).tolist()
    for i, (parent, child) in enumerate(shape.bones):
        if child not in shape.trunk:
            planted = not tinted and _is_on_floor(shape, frame, parent, child)
            parts.append((middles[i], outer[i], inner[i], CONTACT if planted else colours[shape.sides[child]]))
    for joints, radius in ((shape.chest, 0.047), (shape.hips, 0.056)):
        if joints:
            at, r = xy[list(joints)], radius * shape.height * scale[list(joints)]
            mean = float(depth[list(joints)].mean())
            parts.append((mean, _flat(hull(at, r + edge)), _flat(hull(at, r)), trunk))
    if shape.chest and shape.hips:
        parts.append((*_waist(xy, depth, scale, shape, edge), trunk))
    parts += _head_parts(camera, shape, frame, edge, skin=skin)
    for _, outside, inside, colour in sorted(parts, key=lambda part: -part[0]):
        pen.polygon(outside, fill=mix(colour, INK, 0.55))
        pen.polygon(inside, fill=colour)


def _flat(points: list[tuple[float, float]]) -> list[float]:
    return [v for p in points for v in p]


def _is_on_floor(shape: Figure, frame: int, parent: int, child: int) -> bool:
    low = shape.places[frame, parent, 1] < shape.floor + 0.09 * shape.height
    return bool(low and shape.contacts[frame, child])


def _waist(xy: Array, depth: Array, scale: Array, shape: Figure, edge: float) -> tuple[float, list[float], list[float]]:
    """The belly between pelvis and chest."""
    a, b = [shape.centre], [shape.chest[-1]]
    radii = [0.062 * shape.height * scale[j] for j in (a, b)]
    outer = capsules(xy[a], xy[b], radii[0] + edge, radii[1] + edge)[0].ravel().tolist()
    inner = capsules(xy[a], xy[b], *radii)[0].ravel().tolist()
    return float(depth[a[0]] + depth[b[0]]) / 2 + 1e-3, outer, inner


def _head_parts(
    camera: Camera, shape: Figure, frame: int, edge: float, *, skin: Colour
) -> list[tuple[float, list[float], list[float], Colour]]:
    """A ball and a nose that shows where the person looks."""
    if shape.head is None:
        return []
    below, joint = (shape.places[frame, j] for j in shape.head)
    radius = 0.063 * shape.height
    up = (joint - below) / max(float(np.linalg.norm(joint - below)), 1e-9)
    middle = joint - 0.6 * radius * up if shape.head_is_tip else joint + 0.9 * radius * up
    gaze = shape.gaze[frame]
    nose = middle + radius * 0.98 * gaze
    parts: list[tuple[float, list[float], list[float], Colour]] = []
    nose_colour = mix(SKIN, LEFT, 0.45) if skin == SKIN else mix(skin, INK, 0.35)
    for point, r, colour in ((middle, radius, skin), (nose, 0.3 * radius, nose_colour)):
        xy, depth, scale = camera.see(point[None])
        outer, inner = (_flat(hull(xy, np.array([r * scale[0] + e]))) for e in (edge, 0.0))
        parts.append((float(depth[0]), outer, inner, colour))
    return parts
