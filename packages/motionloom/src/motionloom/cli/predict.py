"""`motionloom predict` and `motionloom switch`: what may come after a motion, and the way from one to another."""

import json
from argparse import Namespace
from collections.abc import Generator, Iterator, Sequence
from contextlib import closing
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np

from motionloom.cli.futures import Files, Long, targets, write_futures
from motionloom.cli.reading import check_size, crop, load_motion, note_rate, read_clip
from motionloom.cli.sampling import Finished, bar, check_loop_behind, fail, request_of, results, sampling_of
from motionloom.cli.skeletons import Target, read_target
from motionloom.cli.terminal import note, say
from motionloom.cli.writing import at_rate, check_overwriting, check_rate, check_unit
from motionloom.core.models.predictor import Predictor
from motionloom.core.motion import MAX_POSES, Motion
from motionloom.goals import mask_file
from motionloom.goals.hold import FixedJoints, FixedPart
from motionloom.io import check_output
from motionloom.io.layout_places import is_places, read_places
from motionloom.io.stream import check_length, resampled
from motionloom.requests.tasks import Predict, Switch
from motionloom.retarget import retarget
from motionloom.tasks.other_joints import on_joints_of, sees_person
from motionloom.tasks.predict import predict_pieces
from motionloom.tasks.run import Models, Plan

LONG = 30.0
"""Seconds from which on futures are written while they are generated, one after the other."""
LISTED = 40
"""Files named at the end; --json lists all."""
SAME_BONE = 1e-4
"""Metres by which bones of one skeleton may differ from file to file: numbers are rounded when they are written."""


def run_predict(arguments: Namespace) -> int:
    """``motionloom predict PAST``."""
    check_rate(arguments)
    _check(arguments)
    outs = arguments.out or [Path("futures")]
    target = read_target(arguments, [*outs, *(Path(f"future.{one}") for one in arguments.format or ())])
    target.names(["future"])
    own = target.suffix
    formats = arguments.format or [own[1:] if own else "bvh"]
    outputs = targets(outs, arguments.count, formats, pictures=not arguments.no_picture, own=own)
    predictor = Predictor.load(arguments.weights, device=arguments.device)
    past, target, horizon = _read_past(arguments, predictor, target, outputs)
    hold = _hold(arguments, predictor, past, horizon)
    check_loop_behind(arguments, past.seconds, arguments.seconds, "nothing is held there" if hold else "")
    if arguments.seconds > LONG:
        known, frames = (_frames_at(arguments, past, count) for count in (len(past), len(past) + horizon))
        long = Long(outputs, target, known, frames, _caption(arguments))
        return _predict_long(arguments, predictor, past, hold=hold, long=long)
    values = request_of(arguments, Predict, {"motion": past, "root": not arguments.no_root})
    plan = Plan(task="predict", values=values, sampling=values.sampling, people=(past,), hold=hold)
    return _write_all(arguments, plan, predictor, outputs, target)


def _write_all(arguments: Namespace, plan: Plan, predictor: Predictor, outputs: list[Files], target: Target) -> int:
    """Write the futures, all of them at once, and report it; after an interruption those that were finished."""
    models, past = Models(arguments.loop_weights, predictor_weights=predictor, device=arguments.device), plan.people[0]
    if arguments.loop:
        assert models.prior  # loaded before anything is sampled
    paths: list[Path] = []
    known = _frames_at(arguments, past, len(past))

    def write(motions: Sequence[Motion], places: list[list[Path]], first: int) -> None:
        paths.extend(write_futures(outputs, motions, known, target, caption=_caption(arguments)))

    output = Finished(
        [[files.folder] for files in outputs[:1]],
        arguments.count,
        write,
        convert=lambda motions: at_rate(motions, arguments.fps),
        what="futures",
    )
    people = (list(one.people) for one in results("predicting", plan, models))
    interrupted = output.take(people, measured=arguments.json)
    _report(arguments, [str(file) for file in paths], output.count, output.happened)
    if plan.task == "predict":
        _note_span(predictor, past)
    note_rate(arguments, _inputs(arguments))
    return output.ended(interrupted)


def run_switch(arguments: Namespace) -> int:
    """``motionloom switch PAST TARGET``."""
    check_rate(arguments)
    outs = arguments.out or [Path("switch.bvh")]
    put_on = read_target(arguments, outs)
    put_on.names(["switch"])
    own = put_on.suffix
    for out in outs:
        check_output(out, own=own)  # files, and no folder
    outputs = targets(outs, arguments.count, [], pictures=False, own=own)
    predictor = Predictor.load(arguments.weights, device=arguments.device)
    past, put_on, horizon = _read_past(arguments, predictor, put_on, outputs)
    target = _like_past(arguments, predictor, arguments.target, past)
    _check_poses(arguments, (len(past) + len(target) + horizon) * len(past.skeleton))
    check_loop_behind(arguments, past.seconds, arguments.seconds + target.seconds, f"{arguments.target} ends otherwise")
    values = request_of(arguments, Switch, {"motion": past, "target": target})
    plan = Plan(task="switch", values=values, sampling=values.sampling, people=(past,), target=target)
    return _write_all(arguments, plan, predictor, outputs, put_on)


# Futures of any length


def _predict_long(
    arguments: Namespace, predictor: Predictor, past: Motion, *, hold: FixedJoints | None, long: Long
) -> int:
    """One future after the other, in memory that does not grow with their length."""
    if past.translations is not None:
        fail(
            f"the bones of {arguments.past} change length, and such a motion cannot be written piece by piece; predict "
            f"at most {LONG:g} s, or give its bones constant lengths with: motionloom export {arguments.past} "
            "steady.bvh --skeleton smpl22"
        )
    with closing(_pieces(arguments, predictor, past, hold, frames=long.frames)) as makers:
        interrupted = long.write(makers)
    lines = [f"{file}: {s:.2f} s" if s and not arguments.json else str(file) for file, s in long.finished]
    _report(arguments, lines, arguments.count)
    if interrupted:
        total = long.frames / (arguments.fps or past.fps)
        say(f"interrupted; what was finished is in {long.finished_files()} of {total:.2f} s")
        return 130
    _note_span(predictor, past)
    note_rate(arguments, _inputs(arguments))
    return 0


def _pieces(
    arguments: Namespace, predictor: Predictor, past: Motion, hold: FixedJoints | None, *, frames: int
) -> Generator[Iterator[Motion], None, None]:
    """Of each future its pieces, while a bar shows how far they are."""
    with bar("predicting") as move:

        def moved(pieces: Iterator[Motion], count: int) -> Iterator[Motion]:
            for piece in pieces:
                yield piece
                count += len(piece)
                move(count, frames * arguments.count)

        settings: dict[str, Any] = sampling_of(arguments) | {"count": 1}
        for number in range(arguments.count):
            pieces = predict_pieces(
                predictor,
                past,
                seconds=arguments.seconds,
                number=number,
                hold=hold,
                root=not arguments.no_root,
                foot_lock=arguments.foot_lock,
                **settings,
            )
            pieces = pieces if arguments.fps is None else resampled(pieces, arguments.fps)
            yield moved(pieces, number * frames)


# What is read


def _inputs(arguments: Namespace) -> list[Path]:
    other = getattr(arguments, "target", None) or getattr(arguments, "source", None)
    return [arguments.past] if other is None else [arguments.past, other]


def _caption(arguments: Namespace) -> str:
    target = getattr(arguments, "target", None)
    return arguments.past.stem if target is None else f"{arguments.past.stem} to {target.stem}"


def _read_past(
    arguments: Namespace, predictor: Predictor, target: Target, outputs: list[Files]
) -> tuple[Motion, Target, int]:
    """The past, what futures of it become, and the frames that are generated behind it."""
    files = [file for one in outputs for file in one.files]
    check_unit(arguments, files)
    check_overwriting(arguments, files)
    whole, unit, orders = _read_motion(arguments, predictor, arguments.past)
    past = crop(whole, arguments)
    if len(past) < 2:
        fail(f"{arguments.past} has one frame here; a past has at least two, to say where one goes: take a longer one")
    if not sees_person(predictor):
        past, orders = on_joints_of(predictor, past), {}
        _note_joints(arguments, predictor)
    horizon = round(arguments.seconds * past.fps)
    _check_size(arguments, past, horizon, outputs)
    return past, target.like(unit, orders), horizon


def _read_motion(arguments: Namespace, predictor: Predictor, path: Path) -> tuple[Motion, float | None, dict[str, str]]:
    """As `read_clip`; places of the predictor's joints are read too."""
    if not sees_person(predictor) and is_places(path):
        return read_places(path, predictor.layout, arguments.source_fps or predictor.fps), None, {}
    clip = read_clip(arguments, path)
    check_size(arguments, path, clip[0])
    return clip


def _note_joints(arguments: Namespace, predictor: Predictor) -> None:
    layout, where = predictor.layout, "" if predictor.layout.root else ", in place"
    note(
        f"{arguments.weights} sees {layout.joints} joints at {predictor.fps:g} fps{where}: the past is put on them, "
        "and the futures are motions of that skeleton"
    )


def _like_past(arguments: Namespace, predictor: Predictor, path: Path, past: Motion) -> Motion:
    """A second motion, on the past's skeleton and at its rate; read as the past is where it is such a file too."""
    if not sees_person(predictor):
        return on_joints_of(predictor, _read_motion(arguments, predictor, path)[0], skeleton=past.skeleton)
    alike = path.suffix.lower() == arguments.past.suffix.lower()
    motion = read_clip(arguments, path)[0] if alike else load_motion(arguments, path)
    difference = _difference(motion, past)
    if not difference:
        motion = replace(motion, skeleton=past.skeleton)
    elif arguments.retarget:
        motion = retarget(motion, past.skeleton)
    else:
        fail(
            f"{path} has another skeleton than {arguments.past} ({difference}); give --retarget, or put it on that one "
            f"first: motionloom export {path} same.bvh --skeleton {arguments.past}"
        )
    if motion.translations is None and past.translations is not None:
        motion = replace(motion, translations=np.tile(past.skeleton.offsets, (len(motion), 1, 1)))
    if abs(motion.fps - past.fps) < 1e-3 * past.fps:  # the same rate, rounded otherwise
        return replace(motion, fps=past.fps)
    return motion.resample(past.fps)


def _difference(motion: Motion, past: Motion) -> str:
    """Why two motions are not of one skeleton, in words; nothing if they are, but for the last digits of a file."""
    one, other = motion.skeleton, past.skeleton
    if one.names != other.names or one.parents != other.parents:
        return f"{len(one)} joints against {len(other)}" if len(one) != len(other) else "other joints"
    if np.abs(one.offsets[1:] - other.offsets[1:]).max(initial=0.0) >= SAME_BONE:
        return "other bones"
    return "bones that change length" if motion.translations is not None and past.translations is None else ""


def _hold(arguments: Namespace, predictor: Predictor, past: Motion, horizon: int) -> FixedJoints | None:
    """What is held, if anything is."""
    if not (arguments.hold or arguments.mask):
        if arguments.source is not None:
            fail("--from says what held parts move as, and none is held; give --hold PART or --mask FILE")
        return None
    if arguments.source is None:
        fail("--hold and --mask name parts that move as in another motion; say which one with --from MOTION")
    parts = mask_file.read_mask(arguments.mask, fps=past.fps) if arguments.mask else ()
    if arguments.hold:
        names = [name.strip() for part in arguments.hold for name in part.split(",") if name.strip()]
        parts = (*parts, FixedPart(mask_file.check_names(names)))
    seconds = horizon / past.fps
    late = min(min(begin for begin, _ in part.spans) for part in parts)
    if late >= seconds:
        fail(f"nothing is held before {late:g} s, and the prediction ends at {seconds:g} s; give a longer --seconds")
    if mask_file.fixes_everything(parts, seconds):
        fail("all joints are held all of the time, so that nothing is left to predict; hold fewer")
    source = _like_past(arguments, predictor, arguments.source, past)
    skipped = round(arguments.from_time * past.fps)
    last = max(min(end, seconds) for part in parts for begin, end in part.spans if begin < seconds)
    if len(source) - skipped < round(last * past.fps):
        fail(
            f"{arguments.source} has {max(len(source) - skipped, 0) / past.fps:.2f} s from {arguments.from_time:g} s "
            f"on, and parts are held for {last:.2f} s; give a longer motion, a shorter --seconds, or hold them for "
            "less with 'to' in a --mask"
        )
    return FixedJoints(source.frames(skipped, len(source)), parts)


# Requests that cannot be met


def _check(arguments: Namespace) -> None:
    if arguments.loop and arguments.seconds > LONG:
        fail(f"more than {LONG:g} s are written before --loop could draw the end; use: motionloom edit FILE --loop")
    if arguments.loop and arguments.no_root:
        fail("--loop draws the way through the world, which --no-root leaves out; give one of them")
    if arguments.robot is None and "csv" in (arguments.format or ()):
        fail("--format csv is for a robot's joint angles; name its model with --robot")


def _check_size(arguments: Namespace, past: Motion, horizon: int, outputs: list[Files]) -> None:
    """Refuse what no file or memory holds, and less than a frame."""
    if horizon < 1:
        fail(f"{arguments.seconds:g} s are less than a frame of {arguments.past} ({1 / past.fps:.3g} s); give more")
    joints, frames = len(past.skeleton), _frames_at(arguments, past, len(past) + horizon)
    for file in (files.folder / names[0] for files in outputs for names in files.futures):
        check_length(file, total=frames, fps=arguments.fps or past.fps, joints=joints)
    if arguments.seconds <= LONG:
        _check_poses(arguments, frames * joints)


def _frames_at(arguments: Namespace, past: Motion, count: int) -> int:
    """How many frames so many of the past's rate become at ``--fps``, as `Motion.resample` has them."""
    return count if arguments.fps is None else int((count - 1) / past.fps * arguments.fps + 1e-6) + 1


def _check_poses(arguments: Namespace, each: int) -> None:
    if each * arguments.count > MAX_POSES:
        fail(
            f"{arguments.count} motions of {each:,} poses of joints each do not fit into memory, at most "
            f"{MAX_POSES:,} in all do; lower --count, or take less of the past with --start"
        )


# What is reported


def _note_span(predictor: Predictor, past: Motion) -> None:
    span, there = predictor.observed / predictor.fps, past.seconds
    if there > span + 1 / past.fps:
        note(f"of the {there:.2f} s of the past the predictor sees the last {span:.2f}")


def _report(arguments: Namespace, lines: list[str], count: int, happened: Sequence[Any] = ()) -> None:
    if arguments.json:
        about = {
            "past": str(arguments.past),
            "seconds": arguments.seconds,
            "count": count,
            "seed": arguments.seed,
            "weights": str(arguments.weights),
            "files": lines,
            "happened": list(happened),
        }
        print(json.dumps(about, indent=1))
        return
    for line in lines[:LISTED]:
        print(f"wrote {line}")
    if len(lines) > LISTED:
        print(f"... and {len(lines) - LISTED:,} more; --json lists all")
