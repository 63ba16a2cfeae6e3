"""Commands about motion files: export, view, info."""

import argparse
from pathlib import Path
from typing import TYPE_CHECKING

from motionloom.cli.reading import RATE_ASSUMED, add_reading, as_rate, as_unit, crop, note_rate, rate_assumed, read_clip

if TYPE_CHECKING:
    from motionloom.motion import Motion
    from motionloom.skeleton import Skeleton


def add(subparsers: "argparse._SubParsersAction[argparse.ArgumentParser]") -> None:
    """Register ``export``, ``view`` and ``info``."""
    export = subparsers.add_parser(
        "export",
        help="turn a motion file into another format",
        description="Turn a motion (.bvh, .amc with its .asf, .glb, .npz) into .bvh, .glb, .npz, .mp4, .gif or .png; "
        "the name of OUT picks the format.",
    )
    export.add_argument("input", metavar="IN", type=Path)
    export.add_argument("output", metavar="OUT", type=Path)
    add_reading(export)
    export.add_argument("--fps", type=as_rate, metavar="N", help="resample to this frame rate")
    export.add_argument("--skeleton", metavar="FILE|smpl22", help="put the motion on this skeleton")
    for side, whose in (("source", "of IN"), ("target", "of the --skeleton")):
        export.add_argument(f"--{side}-map", type=Path, metavar="JSON", help=f"which joints are which, {whose}")
    export.add_argument("--mirror", action="store_true", help="exchange left and right")
    export.add_argument("--out-unit", type=as_unit, metavar="UNIT", help="unit of a BVH written (as read, else m)")
    export.add_argument("--order", metavar="XYZ", help="order of rotations of a BVH written (as read, else ZXY)")
    export.set_defaults(run=run_export)

    view = subparsers.add_parser(
        "view", help="draw a motion file", description="Draw motions as a contact sheet (.png) or a film (.mp4, .gif)."
    )
    view.add_argument("inputs", metavar="FILE", type=Path, nargs="+")
    add_reading(view)
    view.add_argument("--out", metavar="PICTURE", type=Path, help="(default: FILE's name with .png, in this folder)")
    view.set_defaults(run=run_view)

    info = subparsers.add_parser(
        "info", help="say what a motion file holds", description="Say what a motion file holds and what looks wrong."
    )
    info.add_argument("input", metavar="FILE", type=Path)
    add_reading(info)
    info.add_argument("--json", action="store_true", help="print JSON, with all joint names")
    info.set_defaults(run=run_info)


def run_export(arguments: argparse.Namespace) -> None:
    """``motionloom export IN OUT``."""
    from motionloom import io
    from motionloom.errors import MotionloomError

    target = io.check_output(arguments.output)
    motion, unit, orders = read_clip(arguments, arguments.input)
    motion = crop(motion, arguments)
    if arguments.mirror:
        motion = motion.mirror()
    if (arguments.source_map or arguments.target_map) and not arguments.skeleton:
        raise MotionloomError("--source-map and --target-map say which joints are which for a --skeleton; name one")
    if arguments.skeleton:
        skeleton, unit, orders = _skeleton(arguments.skeleton)
        motion = _put_on(motion, skeleton, arguments)
    if arguments.fps:
        motion = motion.resample(arguments.fps)
    if target.suffix.lower() == ".bvh":
        from motionloom.io.bvh import save_bvh

        save_bvh(motion, target, order=arguments.order or orders, unit=arguments.out_unit or unit or 1.0)
    else:
        _only_bvh(arguments)
        io.save(motion, target)
    print(f"wrote {target}: {_summary(motion)}")
    note_rate(arguments, [arguments.input])


def run_view(arguments: argparse.Namespace) -> None:
    """``motionloom view FILE ...``."""
    from motionloom import io
    from motionloom.errors import MotionloomError

    target = arguments.out or Path(f"{arguments.inputs[0].stem}.png")
    if target.suffix.lower() not in (".png", ".mp4", ".gif"):
        raise MotionloomError(f"a picture ends in .png and a film in .mp4 or .gif; got {target}")
    io.check_output(target)
    motions = [crop(read_clip(arguments, path)[0], arguments) for path in arguments.inputs]
    io.save(motions, target, captions=[path.stem for path in arguments.inputs])
    print(f"wrote {target}")
    note_rate(arguments, arguments.inputs)


def run_info(arguments: argparse.Namespace) -> None:
    """``motionloom info FILE``."""
    import json
    from dataclasses import asdict

    from motionloom.io.info import describe

    motion, unit, _ = read_clip(arguments, arguments.input)
    info = describe(crop(motion, arguments))
    problems = [*info.problems, *([RATE_ASSUMED] if rate_assumed(arguments, [arguments.input]) else [])]
    if arguments.json:
        print(json.dumps({"file": str(arguments.input), "unit": unit, **asdict(info), "problems": problems}, indent=2))
        return
    low, high = info.lowest, info.highest
    box = " x ".join(f"{h - l:.2f}" for l, h in zip(low, high))
    print(f"{arguments.input}")
    print(f"  skeleton  {info.skeleton}, {info.joints} joints, {info.ends} of them bone ends")
    print(f"  time      {info.frames} frames, {info.seconds:.2f} s at {info.fps:g} frames per second")
    print(f"  body      {info.height:.2f} m tall; the feet are at {info.floor:+.2f} m")
    print(f"  way       {info.path:.2f} m along the floor, ends {info.travel:.2f} m from the start")
    print(f"  space     {box} m (x, y up, z)")
    if unit is not None:
        print(f"  unit      {unit:g} m in the file{'' if arguments.unit else ', by the length of its bones'}")
    for problem in problems:
        print(f"  problem   {problem}")


def _summary(motion: "Motion") -> str:
    frames = "1 frame" if len(motion) == 1 else f"{len(motion)} frames"
    return f"{frames}, {motion.seconds:.2f} s at {motion.fps:g} frames per second, {len(motion.skeleton)} joints"


def _skeleton(name: str) -> "tuple[Skeleton, float, dict[str, str]]":
    """A skeleton to put motions on, with the unit and orders of its file."""
    from motionloom import io
    from motionloom.errors import MotionloomError
    from motionloom.skeleton import SMPL22

    path = Path(name)
    if name.lower() == "smpl22":
        return SMPL22, 1.0, {}
    if path.suffix.lower() == ".bvh":
        from motionloom.io.bvh import read_bvh

        file = read_bvh(path)
        return file.motion.skeleton, file.unit, dict(file.orders)
    if path.suffix.lower() == ".asf":
        from motionloom.io.asf import load_skeleton

        return load_skeleton(path), 1.0, {}
    if path.suffix.lower() not in io.READS:
        raise MotionloomError(f"--skeleton needs smpl22 or a file (.asf, {', '.join(io.READS)}); got {name!r}")
    return io.load(path).skeleton, 1.0, {}


def _put_on(motion: "Motion", skeleton: "Skeleton", arguments: argparse.Namespace) -> "Motion":
    from motionloom.errors import MotionloomError
    from motionloom.retarget import retarget

    try:
        return retarget(motion, skeleton, source_map=arguments.source_map, target_map=arguments.target_map)
    except MotionloomError as error:
        hint = "--source-map or --target-map"
        raise MotionloomError(f"{arguments.input} onto {arguments.skeleton}: {error} ({hint})") from None


def _only_bvh(arguments: argparse.Namespace) -> None:
    from motionloom.errors import MotionloomError

    if arguments.out_unit or arguments.order:
        raise MotionloomError(f"--out-unit and --order are for BVH files; {arguments.output} is none")
