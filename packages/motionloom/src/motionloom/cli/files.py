"""Commands about motion files: export, view, info."""

import argparse
import json
import sys
from dataclasses import asdict
from pathlib import Path

from motionloom import io
from motionloom.cli.reading import (
    RATE_ASSUMED,
    check_size,
    crop,
    note_rate,
    rate_assumed,
    read_clip,
)
from motionloom.cli.robots import check_inputs
from motionloom.cli.skeletons import Target, read_target
from motionloom.cli.writing import at_rate, check_overwriting, check_rate
from motionloom.errors import MotionloomError
from motionloom.formats import find
from motionloom.io import GLTF
from motionloom.io.bvh import save_bvh, unit_that_reads_back
from motionloom.io.gltf_read import open_glb
from motionloom.io.info import describe
from motionloom.kinematics.deeds import measure_deeds
from motionloom.motion import Motion


def run_export(arguments: argparse.Namespace) -> int:
    """``motionloom export IN OUT``."""

    if arguments.check:
        return check_inputs(arguments)
    arguments.inputs, target = _files(arguments)
    skin = read_target(arguments, [target])
    io.check_output(target, own=skin and skin.suffix)
    if len(arguments.inputs) > 1 and (skin is None or not skin.writes(target)):
        raise MotionloomError(
            f"{len(arguments.inputs)} motions go into one file as animations of a character: --skeleton hero.glb "
            "--out moving.glb; else export one at a time"
        )
    read = [_exported(arguments, path, skin) for path in arguments.inputs]
    check_overwriting(arguments, [target])
    if arguments.source_map and not skin:
        raise MotionloomError("--source-map says which joints are which for a --skeleton; name one")
    _write(arguments, target, skin, read)
    held = (skin and skin.summary()) or "; ".join(_summary(motion) for motion, _, _ in read)
    print(f"wrote {target}: {held}")
    note_rate(arguments, arguments.inputs)
    return 0


def _write(
    arguments: argparse.Namespace,
    target: Path,
    skin: Target | None,
    read: list[tuple[Motion, float | None, dict[str, str]]],
) -> None:
    """Write what was read; several motions into a character's own file."""

    names = None if skin is None else skin.names([path.stem for path in arguments.inputs])
    motions = [motion for motion, _, _ in read]
    motion, unit, orders = read[0]
    if skin and names and skin.writes(target):
        _only_bvh(arguments, target)
        skin.save_clips(motions, target, names)
    elif target.suffix.lower() == ".bvh":
        motion = motion if skin is None else skin.shown(motion, target)
        chosen = arguments.out_unit or unit_that_reads_back(motion, unit or 1.0)
        if unit_that_reads_back(motion, chosen) != chosen:
            print(f"note: give --unit {chosen:g} to read {target} at this size: bones do not show it", file=sys.stderr)
        save_bvh(motion, target, order=arguments.order or orders, unit=chosen)
    else:
        _only_bvh(arguments, target)
        (io.save if skin is None else skin.save)(motion, target)


def _exported(
    arguments: argparse.Namespace, path: Path, skin: Target | None
) -> tuple[Motion, float | None, dict[str, str]]:
    """A motion as it is to be written, and the unit and the orders of rotations of a BVH."""
    motion, unit, orders = read_clip(arguments, path)
    if skin is None:
        check_size(arguments, path, motion)
    motion = crop(motion, arguments)
    if arguments.mirror:
        motion = motion.mirror()
    if skin:
        unit, orders = skin.unit, skin.orders
        motion = skin.put(motion, source=str(path), source_map=arguments.source_map)
    return motion if arguments.fps is None else motion.resample(arguments.fps), unit, orders


def run_view(arguments: argparse.Namespace) -> None:
    """``motionloom view FILE ...``."""

    target = arguments.out or Path(f"{arguments.inputs[0].stem}.png")
    if target.suffix.lower() not in (".png", ".mp4", ".gif", ".html"):
        raise MotionloomError(f"a picture ends in .png, a film in .mp4 or .gif and a page in .html; got {target}")
    if arguments.skeleton and target.suffix.lower() != ".html":
        raise MotionloomError(f"--skeleton is for a page, an .html; got {target}")
    io.check_output(target)
    check_rate(arguments)
    check_overwriting(arguments, [target])
    if target.suffix.lower() == ".html":
        _write_page(arguments, target)
    else:
        motions = [crop(read_clip(arguments, path)[0], arguments) for path in arguments.inputs]
        io.save(at_rate(motions, arguments.fps), target, captions=[path.stem for path in arguments.inputs])
    print(f"wrote {target}")
    note_rate(arguments, arguments.inputs)


def _write_page(arguments: argparse.Namespace, target: Path) -> None:
    """A take for each file, with everybody in it, on the character that the line names."""
    from motionloom.viz.page import MAX_BYTES, Take, write_page

    character, put = None, None
    if arguments.skeleton is not None:
        character = io.open_character(arguments.skeleton)
        put = Target(arguments.skeleton, character.skeleton, character=character)
    takes = []
    for path in arguments.inputs:
        motions = at_rate((crop(motion, arguments) for motion in _people(arguments, path)), arguments.fps)
        if put is not None:
            motions = [put.put(motions[0], source=str(path))] if len(motions) == 1 else put.put_together(motions)
        takes.append(Take(path.stem, motions))
    write_page(takes, target, character=character)
    size = target.stat().st_size
    if size > MAX_BYTES:
        print(
            f"note: {target} is {size / 1e6:.1f} MB, more than {MAX_BYTES / 1e6:g}, with {arguments.skeleton}, "
            "its pictures and its motion in it; smaller pictures or a shorter motion make it smaller",
            file=sys.stderr,
        )


def _people(arguments: argparse.Namespace, path: Path) -> list[Motion]:
    """Everybody in a file, or the one motion that the line picks of it."""

    if find(path).people and arguments.animation is None and arguments.unit is None:
        return io.load_scene(path)
    return [read_clip(arguments, path)[0]]


def run_info(arguments: argparse.Namespace) -> None:
    """``motionloom info FILE``."""

    motion, unit, _ = read_clip(arguments, arguments.input)
    clips = _clips(arguments.input)
    motion = crop(motion, arguments)
    info, did = describe(motion), measure_deeds(motion)
    problems = [*info.problems, *([RATE_ASSUMED] if rate_assumed(arguments, [arguments.input]) else [])]
    if arguments.json:
        about = {"file": str(arguments.input), "unit": unit, "clips": clips}
        happened = did and did.public()
        print(json.dumps({**about, **asdict(info), "happened": happened, "problems": problems}, indent=2))
        return
    low, high = info.lowest, info.highest
    box = " x ".join(f"{h - l:.2f}" for l, h in zip(low, high))
    print(f"{arguments.input}")
    print(f"  skeleton  {info.skeleton}, {info.joints} joints, {info.ends} of them bone ends")
    print(f"  time      {info.frames} frames, {info.seconds:.2f} s at {info.fps:g} frames per second")
    print(f"  body      {info.height:.2f} m tall; the feet are at {info.floor:+.2f} m")
    print(f"  way       {info.path:.2f} m along the floor, ends {info.travel:.2f} m from the start")
    print(f"  space     {box} m (x, y up, z)")
    if did is not None:
        print(f"  happens   {did.sentence}")
    if unit is not None:
        print(f"  unit      {unit:g} m in the file{'' if arguments.unit else ', by the length of its bones'}")
    for number, (name, seconds) in enumerate(clips, start=1):
        print(f"  {'clips' if number == 1 else '':9} {number:3}  {name or '(without a name)'}, {seconds:.2f} s")
    for problem in problems:
        print(f"  problem   {problem}")


def _clips(path: Path) -> list[tuple[str, float]]:
    """Name and seconds of each animation of a glTF file."""

    return open_glb(path).lengths if path.suffix.lower() in GLTF else []


def _summary(motion: Motion) -> str:
    frames = "1 frame" if len(motion) == 1 else f"{len(motion)} frames"
    return f"{frames}, {motion.seconds:.2f} s at {motion.fps:g} frames per second, {len(motion.skeleton)} joints"


def _files(arguments: argparse.Namespace) -> tuple[list[Path], Path]:
    """What is read, and where to write, whether that is named as OUT or with ``--out``."""

    if arguments.out is not None:
        return arguments.inputs, arguments.out
    if len(arguments.inputs) < 2:
        raise MotionloomError("one file to write is needed, such as: motionloom export IN OUT; got none")
    return arguments.inputs[:-1], arguments.inputs[-1]


def _only_bvh(arguments: argparse.Namespace, target: Path) -> None:

    if arguments.out_unit or arguments.order:
        raise MotionloomError(f"--out-unit and --order are for BVH files; {target} is none")
