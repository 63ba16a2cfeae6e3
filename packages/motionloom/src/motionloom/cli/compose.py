"""`motionloom compose`: a long motion from a timeline file or from several prompts."""

import json
import os
from argparse import Namespace
from collections.abc import Generator, Iterable, Sequence
from contextlib import closing
from dataclasses import replace
from pathlib import Path
from typing import Any

from motionloom.cli.reading import load_motion
from motionloom.cli.robots import note_on_metres
from motionloom.cli.sampling import (
    check_loop,
    check_outs,
    fail,
    load_prior,
    remark_unknown,
    request_of,
    results,
    segment_rows,
    write_pieces,
)
from motionloom.cli.skeletons import Target
from motionloom.cli.terminal import note, say
from motionloom.cli.writing import check_overwriting
from motionloom.core.errors import MotionloomError
from motionloom.core.methods.double_take import double_take_features, rows_of
from motionloom.core.models.prior import Prior
from motionloom.core.motion import Motion
from motionloom.goals.timeline import Timeline
from motionloom.io.stream import Stream, resampled
from motionloom.kinematics.deeds import LONGEST, happened
from motionloom.requests.reading import resolve_sampling
from motionloom.requests.sampling import Sampling
from motionloom.requests.tasks import Compose
from motionloom.tasks import reattempts
from motionloom.tasks.long import load_segment_adapters
from motionloom.tasks.run import Models, Plan
from motionloom.tasks.splice import concatenate
from motionloom.tasks.text import finish

REMARKED = 200
"""Segments whose texts are looked up among what the weights know."""
LISTED = 40
"""Segments listed at the end; --json lists all."""


def run_compose(arguments: Namespace) -> int:
    """``motionloom compose PROMPT PROMPT``."""
    outs, target = ([], Target()) if arguments.check else check_outs(arguments)
    timeline = _timeline(arguments, target.metre)
    if target.metre != 1.0 and timeline.asks:
        note(note_on_metres(target.metre))
    if arguments.check:
        _report(arguments, timeline, seconds=timeline.seconds, streams=[])
        return 0

    check_loop(arguments, timeline.seconds)
    prior = load_prior(arguments)
    check_overwriting(arguments, outs, also=() if timeline.start is None else (Path(timeline.start),))
    remarks = remark_unknown(prior, [segment.text for segment in timeline.segments[:REMARKED]])
    timeline = replace(timeline, segments=load_segment_adapters(prior, timeline.segments))
    streams = _open(arguments, outs, timeline, target, prior.fps)
    record: list[Motion] = []
    missed: list[str] = []
    interrupted = _make(arguments, prior, timeline, streams, record, missed)
    for line in missed:
        say(line)
    seconds = max(stream.seconds for stream in streams) if interrupted else timeline.seconds
    did = happened([concatenate(*record)] if record else [])
    _report(arguments, timeline, seconds=seconds, streams=_saved(streams), remarks=[*remarks, *missed], happened=did)
    if interrupted:
        say(f"interrupted; {_finished_files(streams)} of {timeline.seconds:.2f} s")
        return 130
    return 0


def _timeline(arguments: Namespace, metre: float) -> Timeline:
    """The timeline of a file or of the command line. metre: as of `Target.metre`."""
    from motionloom.goals import timeline

    words: list[str] = arguments.segments
    files = [word for word in words if word.lower().endswith((".yaml", ".yml"))]
    if not files:
        for word in words:
            if ("/" in word or "." in word) and not word.isspace() and os.path.lexists(word):
                fail(f"{word} is a file and no words; a timeline file's name ends in .yaml")
        seconds = timeline.SECONDS if arguments.seconds is None else arguments.seconds
        return timeline.plain_timeline(words, seconds=seconds, transition=arguments.transition)
    if len(words) > 1:
        fail(f"give either one timeline file or prompts; got {files[0]} and {len(words) - 1} more")
    if arguments.seconds is not None or arguments.transition is not None:
        fail(f"--seconds and --transition go with prompts; write them into {files[0]}")
    return timeline.read_timeline(files[0], metre)


def _open(arguments: Namespace, outs: Sequence[Path], timeline: Timeline, target: Target, own: float) -> list[Stream]:
    """The files, those that grow on the disk last: they are closed first, and that is quick. own: the weights' rate."""
    rate = arguments.fps or own
    frames = sum(round(segment.seconds * own) for segment in timeline.segments)
    total = int((frames - 1) / own * rate + 1e-6) + 1
    caption = "; ".join(" ".join(segment.text.split()) for segment in timeline.segments[:20])
    streams = [target.open(out, total=total, fps=rate, caption=caption) for out in outs]
    return sorted(streams, key=lambda stream: target.skeleton is None and stream.path.suffix.lower() == ".bvh")


def _make(
    arguments: Namespace,
    prior: Prior,
    timeline: Timeline,
    streams: Sequence[Stream],
    record: list[Motion],
    missed: list[str],
) -> bool:
    """Write the motion; true if it was interrupted after something was finished.

    ``record`` gets its pieces where what happened is reported: of a motion that is not too long for that; ``missed``
    sentences about what it does not show.
    """
    described = arguments.json and timeline.seconds <= LONGEST

    try:
        pieces = _pieces(arguments, prior, timeline, missed)
        with closing(pieces):  # the bar is gone before anything is printed
            pieces = _recorded(record, pieces) if described else pieces
            write_pieces(pieces if arguments.fps is None else resampled(pieces, arguments.fps), streams)
    except KeyboardInterrupt:
        if not _saved(streams):
            raise
        return True
    except MotionloomError as error:
        if not _saved(streams):
            raise
        raise MotionloomError(f"{error} ({_finished_files(streams)})") from error
    if not _saved(streams):
        fail("no motion was made; this is a fault of the program")
    return False


def _recorded(record: list[Motion], pieces: Iterable[Motion]) -> Generator[Motion, None, None]:
    for piece in pieces:
        yield piece
        record.append(piece)


def _pieces(arguments: Namespace, prior: Prior, timeline: Timeline, missed: list[str]) -> Generator[Motion, None, None]:
    values = request_of(arguments, Compose, {"timeline": timeline})
    if arguments.method:
        yield _double_take(arguments, prior, timeline, resolve_sampling(values, timeline))
        return
    whole = arguments.loop or not (values.literal or timeline.seconds > reattempts.LONGEST)
    plan = Plan(
        task="compose",
        values=values,
        sampling=resolve_sampling(values, timeline),
        timeline=timeline,
        start=None if timeline.start is None else load_motion(arguments, timeline.start),
        in_pieces=not whole,
    )
    for result in results("composing", plan, Models(prior)):
        missed += result.remarks
        yield from result.people


def _double_take(arguments: Namespace, prior: Prior, timeline: Timeline, sampling: Sampling) -> Motion:
    """The timeline's prompts by DoubleTake; each row is longer by what it shares, so that seams are the segments'."""
    if timeline.asks or timeline.start is not None or arguments.loop or any(s.adapters for s in timeline.segments):
        fail("--method doubletake makes prompts alone: no goals, path, start, adapters or --loop")
    names = ("ramp", "soft", "hard", "restart")
    settings = {name: getattr(arguments, name) for name in names if getattr(arguments, name) is not None}
    handshake = round(prior.fps) if arguments.handshake is None else arguments.handshake
    features, _ = double_take_features(
        prior,
        [segment.text for segment in timeline.segments],
        rows_of([round(segment.seconds * prior.fps) for segment in timeline.segments], handshake),
        mode="published" if arguments.method.endswith("published") else "paper",
        handshake=handshake,
        seed=sampling.seeds(1)[0],
        steps=sampling.steps,
        guidance=sampling.guidance,
        **settings,
    )
    return finish(prior, features, foot_lock=arguments.foot_lock)


def _saved(streams: Sequence[Stream]) -> list[Stream]:
    return [stream for stream in streams if stream.saved]


def _finished_files(streams: Sequence[Stream]) -> str:
    return "what was finished is in " + ", ".join(f"{s.path}, {s.seconds:.2f} s" for s in _saved(streams))


def _report(
    arguments: Namespace,
    timeline: Timeline,
    *,
    seconds: float,
    streams: Sequence[Stream],
    remarks: Sequence[str] = (),
    happened: Sequence[Any] = (),
) -> None:
    """Print the files and where each segment is in the motion, as far as that was generated."""
    rows = [row | {"end": min(row["end"], seconds)} for row in segment_rows(timeline) if row["begin"] < seconds]
    if arguments.json:
        files = [str(stream.path) for stream in streams]
        about = {"seconds": seconds, "of": timeline.seconds, "files": files, "segments": rows}
        about |= {"remarks": list(remarks), "happened": list(happened)}
        print(json.dumps(about, indent=1))
        return
    for stream in streams:
        frames = "" if arguments.robot else f", {stream.frames} frames"  # a robot's file has its own rate
        print(f"wrote {stream.path}: {seconds:.2f} s{frames}")
    if not streams:
        print(f"{len(rows):,} segments, {seconds:.2f} s in all; nothing was made")
    for row in rows[:LISTED]:
        print(f"{row['begin']:9.2f}  {_shortened(row['text'])}")
    if len(rows) > LISTED:
        print(f"           ... and {len(rows) - LISTED:,} more; --json lists all")


def _shortened(text: str) -> str:
    """A prompt as one line of a table."""
    line = " ".join(text.split())
    return line if len(line) < 80 else line[:77] + "..."
