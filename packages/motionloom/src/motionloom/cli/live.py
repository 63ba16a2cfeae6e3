"""`motionloom live`: a scripted session with one or two people who are steered, to files or against the clock."""

import json
from argparse import Namespace
from collections.abc import Sequence
from dataclasses import asdict
from itertools import groupby
from pathlib import Path
from typing import Any

from motionloom.cli.duet import check_pair_outs, write_pairs
from motionloom.cli.reading import load_motion
from motionloom.cli.robots import note_on_metres
from motionloom.cli.sampling import check_loop, check_outs, fail, load_prior, looped
from motionloom.cli.skeletons import Target
from motionloom.cli.terminal import note
from motionloom.cli.writing import check_overwriting, check_unit
from motionloom.core.models.networks import set_threads
from motionloom.core.models.pair import PairBlock
from motionloom.core.models.prior import Prior
from motionloom.core.motion import Motion
from motionloom.kinematics.deeds import happened
from motionloom.live.clock import Health, Player
from motionloom.live.commands import scaled
from motionloom.live.live import Frame, Live, Stage, motion_of
from motionloom.live.pair import LivePair
from motionloom.live.script import Script, read_script
from motionloom.live.settings import Settings


def run_live(arguments: Namespace) -> int:
    """``motionloom live SCRIPT``."""
    script = read_script(arguments.script)
    check_loop(arguments, script.seconds)
    if arguments.check:
        _report(arguments, script, [], None, {})
        return 0
    outs, target = check_outs(arguments) if script.people == 1 else check_pair_outs(arguments)
    if script.people == 1:
        target.names(["live"])
    check_unit(arguments, outs)
    check_overwriting(arguments, outs)
    if len(arguments.start or ()) not in (0, script.people):
        fail(f"--start is given {len(arguments.start)} times; the script has {script.people} people: give one for each")
    set_threads(1)  # a window's matrices are small: two threads would wait for each other at every layer
    prior = load_prior(arguments)
    seed = script.seed if arguments.seed is None else arguments.seed
    metre = target.metre
    if metre != 1.0 and any(scaled(one.command, 1 / metre) != one.command for one in script.commands):
        note(note_on_metres(metre))
    live = _stage(arguments, script, prior, seed, metre=metre)
    frames, health = _against_time(script, live) if arguments.clock else (list(script.run(live)), None)
    words = [[one.words for one in frame] for frame in frames]
    motions = [motion_of([frame[i] for frame in frames], live.fps) for i in range(script.people)]
    motions = [looped(arguments, prior, one, text, seed=seed) for one, text in zip(motions, words[-1], strict=True)]
    write = _write if script.people == 1 else _write_pair
    paths = write(motions, words, outs, target)
    did = happened(motions) if arguments.json else []
    _report(arguments, script, paths, health, {"calls": live.calls, "frames": len(frames), "happened": did})
    return 0


def _stage(arguments: Namespace, script: Script, prior: Prior, seed: int, *, metre: float) -> Stage:
    settings = Settings(steps=arguments.steps, guidance=arguments.guidance)
    starts = [load_motion(arguments, path) for path in arguments.start or ()]
    shared: dict[str, Any] = {"seed": seed, "fps": arguments.fps or 20.0, "settings": settings, "metre": metre}
    if script.people == 1:
        return Live(prior, start=starts[0] if starts else None, **shared)
    block = PairBlock.load(arguments.pair_weights, prior)
    return LivePair(prior, block, start=(starts[0], starts[1]) if starts else None, **shared)


def _against_time(script: Script, live: Stage) -> tuple[list[tuple[Frame, ...]], Health]:
    """The session as a client would see it that sends commands at the script's times."""
    waiting = list(script.commands)[::-1]
    frames: list[tuple[Frame, ...]] = []
    with Player(live) as player:
        for frame in player.frames():
            frames.append((frame,) if isinstance(frame, Frame) else frame)
            while waiting and waiting[-1].at <= frames[-1][0].time + 1e-6:
                _, command, person = waiting.pop()
                player.ask(command, person)
            if len(frames) >= script.seconds * live.fps - 1e-6:
                break
        return frames, player.health


def _write(
    motions: Sequence[Motion], words: Sequence[Sequence[str]], outs: Sequence[Path], target: Target
) -> list[Path]:
    """The files of one person, with the words of each frame; a picture shows each stretch of the same in a row."""
    (whole,) = motions
    stretches: list[tuple[str, Motion]] = []
    begin = 0
    for text, part in groupby(one for (one,) in words):
        begin, first = begin + len(list(part)), begin
        stretches.append((text, whole.frames(first, begin)))
    caption = "; ".join(one for one, _ in stretches[:20])
    files: list[Path] = []
    for out in outs:
        pieces = stretches[:50] if out.suffix.lower() == ".png" and target.skeleton is None else [(caption, whole)]
        files += target.save_all([target.retarget(motion) for _, motion in pieces], [out], [one for one, _ in pieces])
    return files


def _write_pair(
    motions: Sequence[Motion], words: Sequence[Sequence[str]], outs: Sequence[Path], target: Target
) -> list[Path]:
    """The files of two people; those that hold one person each come in twos."""
    texts = dict.fromkeys(" :: ".join(both) for both in words)
    return write_pairs([target.retarget_all(motions)], [[out] for out in outs], [target] * 2, "; ".join([*texts][:20]))


def _report(
    arguments: Namespace,
    script: Script,
    paths: Sequence[Path],
    health: Health | None,
    figures: dict[str, Any],
) -> None:
    if arguments.json:
        about = {"seconds": script.seconds, "commands": len(script.commands), "files": [str(path) for path in paths]}
        print(json.dumps({**about, **figures, **({"clock": asdict(health)} if health else {})}, indent=1))
        return
    for path in paths:
        frames = "" if arguments.robot else f", {figures['frames']} frames"  # a robot's file has its own rate
        print(f"wrote {path}: {script.seconds:.2f} s{frames}, {figures['calls']} network calls")
    if not paths:
        print(f"{len(script.commands)} commands in {script.seconds:.2f} s; nothing was made")
    if health:
        print(
            f"{health.late} of {health.shown} frames late, the worst by {1000 * health.worst:.0f} ms; made "
            f"{health.times:.1f} times faster than shown; commands wait {1000 * health.ahead:.0f} ms"
        )
        if health.problem:
            print(health.problem)
