"""Commands about motion files: export, view, info."""

import json
from argparse import Namespace
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
from motionloom.cli.terminal import note
from motionloom.cli.writing import at_rate, check_overwriting, check_rate, fail
from motionloom.core.motion import Motion
from motionloom.formats import find
from motionloom.io import GLTF
from motionloom.io.bvh import save_bvh, unit_that_reads_back
from motionloom.io.gltf_read import open_glb
from motionloom.io.info import describe
from motionloom.kinematics.deeds import measure_deeds


def run_export(arguments: Namespace) -> int:
    """``motionloom export IN OUT``."""
    if arguments.check:
        return check_inputs(arguments)
    arguments.inputs, out = _files(arguments)
    target = read_target(arguments, [out])
    io.check_output(out, own=target.suffix)
    if len(arguments.inputs) > 1 and not target.writes(out):
        fail(
            f"{len(arguments.inputs)} motions go into one file as animations of a character: --skeleton hero.glb "
            "--out moving.glb; else export one at a time"
        )
    clips = [_exported(arguments, path, target) for path in arguments.inputs]
    check_overwriting(arguments, [out])
    if arguments.source_map and target.skeleton is None:
        fail("--source-map says which joints are which for a --skeleton; name one")
    _write(arguments, out, clips)
    held = target.summary() or "; ".join(_summary(motion) for motion, _ in clips)
    print(f"wrote {out}: {held}")
    note_rate(arguments, arguments.inputs)
    return 0


def _write(arguments: Namespace, out: Path, clips: list[tuple[Motion, Target]]) -> None:
    """Write what was read; several motions into a character's own file."""
    motion, target = clips[0]
    names = target.names([path.stem for path in arguments.inputs])
    if out.suffix.lower() != ".bvh" and (arguments.out_unit or arguments.order):
        fail(f"--out-unit and --order are for BVH files; {out} is none")
    if target.writes(out):
        target.save_clips([motion for motion, _ in clips], out, names)
    elif out.suffix.lower() == ".bvh":
        motion = target.motion_for(motion, out)
        own = target.unit if target.skeleton is not None else None  # a character's file keeps its unit
        chosen = arguments.out_unit or own or unit_that_reads_back(motion, target.unit or 1.0)
        if unit_that_reads_back(motion, chosen) != chosen:
            note(f"give --unit {chosen:g} to read {out} at this size: bones do not show it")
        save_bvh(motion, out, order=arguments.order or target.orders, unit=chosen)
    else:
        target.save(motion, out)


def _exported(arguments: Namespace, path: Path, target: Target) -> tuple[Motion, Target]:
    """A motion as it is to be written, and its target."""
    motion, unit, orders = read_clip(arguments, path)
    if target.skeleton is None:
        check_size(arguments, path, motion)
    motion = crop(motion, arguments)
    if arguments.mirror:
        motion = motion.mirror()
    motion = target.retarget(motion, source=str(path), source_map=arguments.source_map)
    return motion if arguments.fps is None else motion.resample(arguments.fps), target.like(unit, orders)


def run_view(arguments: Namespace) -> None:
    """``motionloom view FILE ...``."""
    target = arguments.out or Path(f"{arguments.inputs[0].stem}.png")
    if target.suffix.lower() not in (".png", ".mp4", ".gif", ".html"):
        fail(f"a picture ends in .png, a film in .mp4 or .gif and a page in .html; got {target}")
    if arguments.skeleton and target.suffix.lower() != ".html":
        fail(f"--skeleton is for a page, an .html; got {target}")
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


def _write_page(arguments: Namespace, out: Path) -> None:
    """A take for each file, with everybody in it, on the character that the line names."""
    from motionloom.viz.page import MAX_BYTES, Take, write_page

    character, target = None, Target()
    if arguments.skeleton is not None:
        character = io.open_character(arguments.skeleton)
        target = Target(arguments.skeleton, character.skeleton, character=character)
    takes = []
    for path in arguments.inputs:
        everybody = find(path).people and arguments.animation is None and arguments.unit is None
        people = io.load_scene(path) if everybody else [read_clip(arguments, path)[0]]
        motions = at_rate((crop(motion, arguments) for motion in people), arguments.fps)
        alone = len(motions) == 1
        motions = [target.retarget(motions[0], source=str(path))] if alone else target.retarget_all(motions)
        takes.append(Take(path.stem, motions))
    write_page(takes, out, character=character)
    size = out.stat().st_size
    if size > MAX_BYTES:
        note(
            f"{out} is {size / 1e6:.1f} MB, more than {MAX_BYTES / 1e6:g}, with {arguments.skeleton}, "
            "its pictures and its motion in it; smaller pictures or a shorter motion make it smaller"
        )


def run_info(arguments: Namespace) -> None:
    """``motionloom info FILE``."""
    motion, unit, _ = read_clip(arguments, arguments.input)
    clips = open_glb(arguments.input).lengths if arguments.input.suffix.lower() in GLTF else []
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


def _summary(motion: Motion) -> str:
    frames = "1 frame" if len(motion) == 1 else f"{len(motion)} frames"
    return f"{frames}, {motion.seconds:.2f} s at {motion.fps:g} frames per second, {len(motion.skeleton)} joints"


def _files(arguments: Namespace) -> tuple[list[Path], Path]:
    """What is read, and where to write, whether that is named as OUT or with ``--out``."""
    if arguments.out is not None:
        return arguments.inputs, arguments.out
    if len(arguments.inputs) < 2:
        fail("one file to write is needed, such as: motionloom export IN OUT; got none")
    return arguments.inputs[:-1], arguments.inputs[-1]
