"""`motionloom live`: a scripted session with one or two people who are steered, to files or against the clock."""

import argparse
from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Any

from motionloom.cli.duet import check_pair_outs, write_pairs
from motionloom.cli.sampling import add_adapters, check_outs, fail, load_prior
from motionloom.cli.sampling import write as write_files
from motionloom.cli.skeletons import Target, add_skeleton
from motionloom.cli.writing import add_writing, check_overwriting, check_unit

if TYPE_CHECKING:
    from motionloom.live.clock import Health
    from motionloom.live.live import Frame, Stage
    from motionloom.live.script import Script


def add(subparsers) -> None:
    """Register `live`."""
    parser = subparsers.add_parser(
        "live",
        help="steer somebody while he moves, by a script",
        description="Make the motion of a live session whose commands a YAML script says (docs/live.md).",
    )
    parser.add_argument("script", type=Path, metavar="SCRIPT", help="a .yaml file: seconds, seed, commands")
    parser.add_argument(
        "--out",
        type=Path,
        action="append",
        metavar="NAME",
        help="file to write, repeatable; .bvh .glb .npz .mp4 .gif .png (default motion.bvh); of two people a .bvh or "
        ".npz holds one each: give two (default duet.glb)",
    )
    parser.add_argument("--seed", type=int, help="the same seed makes the same motion (default: the script's, else 0)")
    parser.add_argument("--fps", type=float, help="frames per second that are shown (default: the model's 20)")
    parser.add_argument(
        "--start",
        type=Path,
        action="append",
        metavar="FILE",
        help="a motion to go on from, in its place; with two people one for each",
    )
    parser.add_argument("--steps", type=int, default=8, help="network calls per window (default 8)")
    parser.add_argument("--guidance", type=float, default=2.5, help="strength of the words (default 2.5)")
    parser.add_argument(
        "--weights", default="default", metavar="NAME|PATH", help="shipped name or file (default: default)"
    )
    parser.add_argument(
        "--pair-weights", default="duet", metavar="NAME|PATH", help="what makes two of one (default duet)"
    )
    parser.add_argument("--device", default="cpu", help="cpu or cuda (default cpu)")
    parser.add_argument("--clock", action="store_true", help="play it against the time and say how that went")
    parser.add_argument("--check", action="store_true", help="only say what would be made")
    parser.add_argument("--json", action="store_true", help="print what was made as JSON")
    add_adapters(parser)
    add_skeleton(parser)
    add_writing(parser)
    parser.set_defaults(run=_live)


def _live(arguments: argparse.Namespace) -> int:
    from motionloom.live.script import read_script

    script = read_script(arguments.script)
    if arguments.check:
        _report(arguments, script, [], None, {})
        return 0
    outs, target = check_outs(arguments) if script.people == 1 else check_pair_outs(arguments)
    if target is not None and script.people == 1:
        target.names(["live"])
    if arguments.fps is not None and not 1 <= arguments.fps <= 240:
        fail(f"--fps must be 1 to 240; got {arguments.fps:g}")
    check_unit(arguments, outs)
    check_overwriting(arguments, outs)
    if len(arguments.start or ()) not in (0, script.people):
        fail(f"--start is given {len(arguments.start)} times; the script has {script.people} people: give one for each")
    live = _made(arguments, script)
    frames, health = _against_time(script, live) if arguments.clock else (list(script.run(live)), None)
    if script.people == 1:
        written = _written([one for (one,) in frames], live.fps, outs, target, arguments.out_unit)
    else:
        written = _written_pair(frames, live.fps, outs, target, arguments.out_unit)
    _report(arguments, script, written, health, {"calls": live.calls, "frames": len(frames)})
    return 0


def _made(arguments: argparse.Namespace, script: "Script") -> "Stage":
    from motionloom.io import load
    from motionloom.live.live import Live
    from motionloom.live.pair import LivePair
    from motionloom.live.settings import Settings
    from motionloom.runtime import set_threads
    from motionloom.weights.pair import PairBlock

    settings = Settings(steps=arguments.steps, guidance=arguments.guidance)
    starts = [load(path) for path in arguments.start or ()]
    seed = script.seed if arguments.seed is None else arguments.seed
    shared: dict[str, Any] = {"seed": seed, "fps": arguments.fps or 20.0, "settings": settings}
    set_threads(1)  # a window's matrices are small: two threads would wait for each other at every layer
    prior = load_prior(arguments)
    if script.people == 1:
        return Live(prior, start=starts[0] if starts else None, **shared)
    block = PairBlock.load(arguments.pair_weights, prior)
    return LivePair(prior, block, start=(starts[0], starts[1]) if starts else None, **shared)


def _against_time(script: "Script", live: "Stage") -> tuple[list[tuple["Frame", ...]], "Health"]:
    """The session as somebody would see it who asks at the script's times."""
    from motionloom.live.clock import Player
    from motionloom.live.live import Frame

    waiting = list(script.commands)[::-1]
    frames: list[tuple[Frame, ...]] = []
    with Player(live) as player:
        for shown in player.frames():
            frames.append((shown,) if isinstance(shown, Frame) else shown)
            while waiting and waiting[-1].at <= frames[-1][0].time + 1e-6:
                _, command, person = waiting.pop()
                player.ask(command, person)
            if len(frames) >= script.seconds * live.fps - 1e-6:
                break
        return frames, player.health


def _written(
    frames: Sequence["Frame"], fps: float, outs: Sequence[Path], target: Target | None, unit: float | None
) -> list[Path]:
    """The files; a picture shows each stretch of the same words in a row of its own."""
    from itertools import groupby

    from motionloom.live.live import motion_of

    whole = motion_of(frames, fps)
    stretches = [(words, motion_of(list(part), fps)) for words, part in groupby(frames, key=lambda frame: frame.words)]
    said = "; ".join(words for words, _ in stretches[:20])
    files: list[Path] = []
    for out in outs:
        pieces = stretches[:50] if out.suffix.lower() == ".png" and target is None else [(said, whole)]
        motions = [motion if target is None else target.put(motion) for _, motion in pieces]
        files += write_files(motions, [out], [words for words, _ in pieces], target, unit=unit)
    return files


def _written_pair(
    frames: Sequence[tuple["Frame", ...]], fps: float, outs: Sequence[Path], target: Target | None, unit: float | None
) -> list[Path]:
    """The files of two people; those that hold one person each come in twos."""
    from motionloom.live.live import motion_of

    people = [motion_of([both[i] for both in frames], fps) for i in (0, 1)]
    duet = people if target is None else target.put_together(people)
    said = dict.fromkeys(" :: ".join(one.words for one in both) for both in frames)
    return write_pairs([duet], [[out] for out in outs], [(unit or 1.0, {})] * 2, "; ".join([*said][:20]), target)


def _report(
    arguments: argparse.Namespace,
    script: "Script",
    written: Sequence[Path],
    health: "Health | None",
    made: dict[str, Any],
) -> None:
    from dataclasses import asdict

    if arguments.json:
        import json

        about = {"seconds": script.seconds, "commands": len(script.commands), "files": [str(path) for path in written]}
        print(json.dumps({**about, **made, **({"clock": asdict(health)} if health else {})}, indent=1))
        return
    for path in written:
        print(f"wrote {path}: {script.seconds:.2f} s, {made['frames']} frames, {made['calls']} network calls")
    if not written:
        print(f"{len(script.commands)} commands in {script.seconds:.2f} s; nothing was made")
    if health:
        print(
            f"{health.late} of {health.shown} frames late, the worst by {1000 * health.worst:.0f} ms; made "
            f"{health.times:.1f} times faster than shown; commands wait {1000 * health.ahead:.0f} ms"
        )
        if health.problem:
            print(health.problem)
