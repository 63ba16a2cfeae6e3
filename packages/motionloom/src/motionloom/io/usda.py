"""USD as text (`.usda`), out: a skeleton, its animation and a skinned mesh, as UsdSkel describes them.

Conventions are ours: metres (``metersPerUnit = 1``), +Y up, one time code per frame. Matrices are written as USD has
them, row vectors on the left. Every person is a ``SkelRoot`` that refers to nothing outside.
"""

from collections.abc import Iterator, Sequence
from pathlib import Path
from typing import IO

import numpy as np
from numpy.typing import NDArray

from motionloom.core import rotations as rot
from motionloom.core.errors import MotionloomError
from motionloom.core.files.atomic import atomic_path
from motionloom.core.files.text import unique_names
from motionloom.core.motion import Motion
from motionloom.core.skeleton import Skeleton
from motionloom.io.body import MATERIALS, body, check_people
from motionloom.io.gltf_mesh import Surface

Array = NDArray[np.float64]
MAX_PATH = 10_000


def save_usda(
    motions: Sequence[Motion],
    path: str | Path,
    *,
    names: Sequence[str] | None = None,
    surfaces: Sequence[Surface] | None = None,
) -> Path:
    """Write motions of one frame rate as one USD scene; gives the path back.

    ``surfaces`` are the meshes of everybody's skeleton, at rest (None: a simple body for each). ``names``, one per
    motion, name the people. Raises `MotionloomError` for no motions, names of another count, rates that differ, or a
    path that cannot be written.
    """
    check_people(motions, names)
    rates = {motion.fps for motion in motions}
    if len(rates) > 1:
        raise MotionloomError(f"{path}: a USD scene has one frame rate; got {sorted(rates)}; resample the motions")
    tail = [""] if len(motions) == 1 else [f"_{k + 1}" for k in range(len(motions))]
    titles = unique_names([f"person{t}" for t in tail] if names is None else [_identifier(name) for name in names])
    with atomic_path(path) as temporary, temporary.open("w", encoding="utf-8", newline="\n") as file:
        file.write(_head(motions))
        file.write('def Xform "motion"\n{\n')
        for motion, title in zip(motions, titles, strict=True):
            _write_person(file, motion, title, _simple(motion) if surfaces is None else surfaces)
        file.write("}\n")
    return Path(path)


def _head(motions: Sequence[Motion]) -> str:
    last = max(len(motion) for motion in motions) - 1
    rate = f"{motions[0].fps:.12g}"
    return (
        '#usda 1.0\n(\n    defaultPrim = "motion"\n    doc = "made by motionloom"\n    metersPerUnit = 1\n'
        f'    upAxis = "Y"\n    startTimeCode = 0\n    endTimeCode = {last}\n    timeCodesPerSecond = {rate}\n'
        f"    framesPerSecond = {rate}\n)\n\n"
    )


def _write_person(file: IO[str], motion: Motion, title: str, surfaces: Sequence[Surface]) -> None:
    skeleton, place = motion.skeleton, f"/motion/{title}"
    paths = joint_paths(skeleton)
    rest = skeleton.rest_positions()
    file.write(f'    def SkelRoot "{title}" (\n        prepend apiSchemas = ["SkelBindingAPI"]\n    )\n    {{\n')
    around = motion.positions().reshape(-1, 3)
    low, high = around.min(axis=0) - 0.3, around.max(axis=0) + 0.3  # room for a body
    file.write(f"        float3[] extent = [{_tuple(low)}, {_tuple(high)}]\n")
    file.write('        def Skeleton "skeleton" (\n            prepend apiSchemas = ["SkelBindingAPI"]\n        )\n')
    file.write(f"        {{\n            uniform token[] joints = {_words(paths)}\n")
    file.write(f"            uniform token[] jointNames = {_words(skeleton.names)}\n")
    file.write(f"            uniform matrix4d[] bindTransforms = [{', '.join(map(_shift, rest))}]\n")
    file.write(f"            uniform matrix4d[] restTransforms = [{', '.join(map(_shift, skeleton.offsets))}]\n")
    file.write(f"            rel skel:animationSource = <{place}/skeleton/animation>\n\n")
    _write_animation(file, motion, paths)
    file.write("        }\n")
    _write_materials(file, surfaces, place)
    for number, surface in enumerate(surfaces):
        _write_surface(file, surface, number, place, _colours(surfaces).index(surface.colour))
    file.write("    }\n")


def _write_animation(file: IO[str], motion: Motion, paths: Sequence[str]) -> None:
    turns = rot.unroll(rot.normalize(motion.rotations))
    file.write('            def SkelAnimation "animation"\n            {\n')
    file.write(f"                uniform token[] joints = {_words(paths)}\n")
    ones = ", ".join(["(1, 1, 1)"] * len(paths))
    file.write(f"                half3[] scales = [{ones}]\n                quatf[] rotations.timeSamples = {{\n")
    for frame, row in enumerate(turns):
        file.write(f"                    {frame}: [{', '.join(map(_tuple, row))}],\n")
    file.write("                }\n                float3[] translations.timeSamples = {\n")
    for frame in range(len(motion)):
        offsets = motion.skeleton.offsets if motion.translations is None else motion.translations[frame]
        row = [motion.root[frame], *offsets[1:]]
        file.write(f"                    {frame}: [{', '.join(map(_tuple, row))}],\n")
    file.write("                }\n            }\n")


# --- meshes -------------------------------------------------------------------------------------------------------


def _simple(motion: Motion) -> list[Surface]:
    """The body that a motion without a mesh of its own is shown with."""
    rest = motion.skeleton.rest_positions()
    surfaces = []
    for piece in body(motion):
        count = len(piece.points)
        surfaces.append(
            Surface(
                f"body_{motion.skeleton.names[piece.joint]}",
                piece.points + rest[piece.joint],
                piece.normals,
                None,
                piece.triangles,
                np.full((count, 1), piece.joint),
                np.ones((count, 1)),
                MATERIALS[piece.side][1],
            )
        )
    return surfaces


def _colours(surfaces: Sequence[Surface]) -> list[tuple[float, ...]]:
    return list(dict.fromkeys(surface.colour for surface in surfaces))


def _write_materials(file: IO[str], surfaces: Sequence[Surface], place: str) -> None:
    if not surfaces:
        return
    file.write('        def Scope "materials"\n        {\n')
    for number, colour in enumerate(_colours(surfaces)):
        file.write(f'            def Material "colour_{number}"\n            {{\n')
        shader = f"{place}/materials/colour_{number}/shader"
        file.write(f"                token outputs:surface.connect = <{shader}.outputs:surface>\n")
        file.write('                def Shader "shader"\n                {\n')
        file.write('                    uniform token info:id = "UsdPreviewSurface"\n')
        file.write(f"                    color3f inputs:diffuseColor = {_tuple(colour)}\n")
        file.write("                    float inputs:roughness = 0.75\n                    token outputs:surface\n")
        file.write("                }\n            }\n")
    file.write("        }\n")


def _write_surface(file: IO[str], surface: Surface, number: int, place: str, colour: int) -> None:
    tab, width = " " * 12, surface.joints.shape[1]
    low, high = surface.points.min(axis=0), surface.points.max(axis=0)
    name, vertex = f"{_identifier(surface.name)}_{number}", 'interpolation = "vertex"'
    file.write(f'        def Mesh "{name}" (\n            prepend apiSchemas = ')
    file.write('["SkelBindingAPI", "MaterialBindingAPI"]\n        )\n        {\n')
    file.write(f"{tab}float3[] extent = [{_tuple(low)}, {_tuple(high)}]\n")
    file.write(f"{tab}int[] faceVertexCounts = [{', '.join(['3'] * len(surface.triangles))}]\n")
    _write_list(file, f"{tab}int[] faceVertexIndices", map(str, surface.triangles.ravel().tolist()))
    _write_list(file, f"{tab}point3f[] points", map(_tuple, surface.points))
    if surface.normals is not None:
        _write_list(file, f"{tab}normal3f[] normals", map(_tuple, surface.normals), vertex)
    if surface.texture is not None:
        st = surface.texture * [1.0, -1.0] + [0.0, 1.0]  # USD's begin in the lower left
        _write_list(file, f"{tab}texCoord2f[] primvars:st", map(_tuple, st), vertex)
    pairs = f"elementSize = {width}\n{tab}    {vertex}"
    joints, weights = surface.joints.ravel().tolist(), surface.weights.ravel().tolist()
    _write_list(file, f"{tab}int[] primvars:skel:jointIndices", map(str, joints), pairs)
    _write_list(file, f"{tab}float[] primvars:skel:jointWeights", map(_number, weights), pairs)
    file.write(f"{tab}matrix4d primvars:skel:geomBindTransform = {_shift(np.zeros(3))}\n")
    file.write(f"{tab}color3f[] primvars:displayColor = [{_tuple(surface.colour)}]\n")
    file.write(f"{tab}rel material:binding = <{place}/materials/colour_{colour}>\n")
    file.write(f"{tab}rel skel:skeleton = <{place}/skeleton>\n")
    file.write(f'{tab}uniform token subdivisionScheme = "none"\n{tab}uniform token orientation = "rightHanded"\n')
    file.write("        }\n")


def _write_list(file: IO[str], what: str, values: Iterator[str], more: str = "") -> None:
    file.write(f"{what} = [{', '.join(values)}]")
    indent = " " * 16
    file.write(f" (\n{indent}{more}\n            )\n" if more else "\n")


# --- words and numbers --------------------------------------------------------------------------------------------


def joint_paths(skeleton: Skeleton) -> list[str]:
    """The joints as USD names them, ``hips/spine/chest``: letters, digits and underscores, unique, parents first.

    Raises `MotionloomError` for a chain of joints so long that their paths fill the memory.
    """
    words = unique_names([_identifier(name) for name in skeleton.names])
    paths: list[str] = []
    for word, parent in zip(words, skeleton.parents, strict=True):
        paths.append(word if parent < 0 else f"{paths[parent]}/{word}")
        if len(paths[-1]) > MAX_PATH:
            raise MotionloomError(f"a USD path of {len(paths[-1]):,} characters is too long; shorten the joints' names")
    return paths


def _identifier(name: str) -> str:
    """A prim's name: letters of the English alphabet, digits and underscores, with no digit in front."""
    plain = "".join(c if c.isascii() and (c.isalnum() or c == "_") else "_" for c in name) or "_"
    return f"_{plain}" if plain[0].isdigit() else plain


def _words(names: Sequence[str]) -> str:
    escaped = [name.replace("\\", "\\\\").replace('"', '\\"') for name in names]
    plain = ("".join(c if c.isprintable() else "?" for c in name) for name in escaped)
    return "[" + ", ".join(f'"{name}"' for name in plain) + "]"


def _number(value: float) -> str:
    return f"{value:.9g}" if value else "0"


def _tuple(values: Array | Sequence[float]) -> str:
    return "(" + ", ".join(_number(float(v)) for v in values) + ")"


def _shift(place: Array) -> str:
    """A matrix that moves and does not turn."""
    x, y, z = (_number(float(v)) for v in place)
    return f"((1, 0, 0, 0), (0, 1, 0, 0), (0, 0, 1, 0), ({x}, {y}, {z}, 1))"
