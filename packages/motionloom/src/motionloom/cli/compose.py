"""`motionloom compose`: a long motion from a timeline file or from several prompts."""

import argparse
import json
import sys
from collections.abc import Generator, Iterable, Sequence
from contextlib import ExitStack, closing
from dataclasses import replace
from pathlib import Path
from typing import Any

from motionloom.cli.looping import check_loop
from motionloom.cli.reading import load_motion
from motionloom.cli.robots import note_on_metres
from motionloom.cli.sampling import check_outs, fail, load_prior, remark_unknown, request_of, results
from motionloom.cli.skeletons import Target, open_target
from motionloom.cli.writing import check_overwriting
from motionloom.errors import MotionloomError
from motionloom.goals.timeline import Timeline
from motionloom.interruption import held_back
from motionloom.io.stream import Stream, check_length, open_stream, resampled
from motionloom.kinematics.deeds import LONGEST
from motionloom.motion import Motion
from motionloom.requests.compose import Compose
from motionloom.requests.reading import resolve_sampling
from motionloom.tasks.long import load_segment_adapters
from motionloom.tasks.run import Models, Plan
from motionloom.tasks.splice import concatenate
from motionloom.weights.prior import Prior

REMARKED = 200
"""Segments whose texts are looked up among what the weights know."""
SHOWN = 40
"""Segments listed at the end; --json lists all."""


def run_compose(arguments: argparse.Namespace) -> int:
    """``motionloom compose PROMPT PROMPT``."""
    outs, target = ([], None) if arguments.check else check_outs(arguments)
    metre = 1.0 if target is None else target.metre
    timeline = _timeline(arguments, metre)
    if metre != 1.0 and timeline.asks:
        print(f"note: {note_on_metres(metre)}", file=sys.stderr)
    if arguments.check:
        _report(arguments, timeline, seconds=timeline.seconds, streams=[])
        return 0

    check_loop(arguments, timeline.seconds)
    check_overwriting(arguments, outs, also=() if timeline.start is None else (Path(timeline.start),))
    prior = load_prior(arguments)
    remarks = remark_unknown(prior, [segment.text for segment in timeline.segments[:REMARKED]])
    timeline = replace(timeline, segments=load_segment_adapters(prior, timeline.segments))
    streams = _open(arguments, outs, timeline, target)
    shown: list[Motion] = []
    interrupted = _make(arguments, prior, timeline, streams, shown)
    seconds = max(stream.seconds for stream in streams) if interrupted else timeline.seconds
    _report(arguments, timeline, seconds=seconds, streams=_saved(streams), remarks=remarks, happened=_happened(shown))
    if interrupted:
        print(f"motionloom: interrupted; {_finished_files(streams)} of {timeline.seconds:.2f} s", file=sys.stderr)
        return 130
    return 0


def _timeline(arguments: argparse.Namespace, metre: float) -> Timeline:
    """What is asked, whether in a file or on the command line. metre: as of `Target.metre`."""
    from motionloom.goals import timeline

    given: list[str] = arguments.segments
    files = [word for word in given if word.lower().endswith((".yaml", ".yml"))]
    if not files:
        seconds = timeline.SECONDS if arguments.seconds is None else arguments.seconds
        return timeline.plain_timeline(given, seconds=seconds, transition=arguments.transition)
    if len(given) > 1:
        fail(f"give either one timeline file or prompts; got {files[0]} and {len(given) - 1} more")
    if arguments.seconds is not None or arguments.transition is not None:
        fail(f"--seconds and --transition go with prompts; write them into {files[0]}")
    return timeline.read_timeline(files[0], metre)


def _open(
    arguments: argparse.Namespace, outs: Sequence[Path], timeline: Timeline, target: Target | None
) -> list[Stream]:
    """The files, those that grow on the disk last: they are closed first, and that is quick."""

    rate, unit = arguments.fps or 20.0, arguments.out_unit or 1.0
    total = int((timeline.frames - 1) / 20 * rate + 1e-6) + 1
    said = "; ".join(" ".join(segment.text.split()) for segment in timeline.segments[:20])
    if target is not None:
        for out in outs:
            check_length(out, total=total, fps=rate, joints=len(target.skeleton))
        return [open_target(target, out, caption=said) for out in outs]
    streams = [open_stream(out, total=total, fps=rate, caption=said, unit=unit) for out in outs]
    return sorted(streams, key=lambda stream: stream.path.suffix.lower() == ".bvh")


def _happened(pieces: Sequence[Motion]) -> list[Any]:
    """What the person of these pieces did, if there are any."""
    from motionloom.kinematics.deeds import happened

    return happened([concatenate(*pieces)] if pieces else [])


def _make(
    arguments: argparse.Namespace,
    prior: Prior,
    timeline: Timeline,
    streams: Sequence[Stream],
    shown: list[Motion],
) -> bool:
    """Write the motion; true if it was interrupted after something was finished.

    ``shown`` gets its pieces where what happened is told: of a motion that is not too long for that.
    """

    told = arguments.json and timeline.seconds <= LONGEST

    try:
        with closing(_pieces(arguments, prior, timeline)) as pieces:  # the bar is gone before anything is said
            _write(_kept_in(shown, pieces) if told else pieces, streams, arguments.fps)
    except KeyboardInterrupt:
        with held_back():  # it may have come just before they were closed
            for stream in streams:
                stream.close()
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


def _kept_in(shown: list[Motion], pieces: Iterable[Motion]) -> Generator[Motion, None, None]:
    for piece in pieces:
        yield piece
        shown.append(piece)


def _write(pieces: Iterable[Motion], streams: Sequence[Stream], fps: float | None) -> None:

    with ExitStack() as stack:
        for stream in streams:
            stack.enter_context(stream)
        for piece in pieces if fps is None else resampled(pieces, fps):
            with held_back():  # all files end with the same piece
                for stream in streams:
                    stream.write(piece)


def _pieces(arguments: argparse.Namespace, prior: Prior, timeline: Timeline) -> Generator[Motion, None, None]:

    values = request_of(arguments, Compose, {"timeline": timeline})
    plan = Plan(
        task="compose",
        values=values,
        sampling=resolve_sampling(values, timeline),
        timeline=timeline,
        start=None if timeline.start is None else load_motion(arguments, timeline.start),
        in_pieces=not arguments.loop,
    )
    for result in results("composing", plan, Models(prior)):
        yield from result.people


def _saved(streams: Sequence[Stream]) -> list[Stream]:
    return [stream for stream in streams if stream.saved]


def _finished_files(streams: Sequence[Stream]) -> str:
    return "what was finished is in " + ", ".join(f"{s.path}, {s.seconds:.2f} s" for s in _saved(streams))


def _report(
    arguments: argparse.Namespace,
    timeline: Timeline,
    *,
    seconds: float,
    streams: Sequence[Stream],
    remarks: Sequence[str] = (),
    happened: Sequence[Any] = (),
) -> None:
    """Print what was made and where each segment lies in it, as far as it was made."""
    begins = [frame / 20 for frame in timeline.begins]
    rows = [
        {"begin": begin, "end": min(end, seconds), "text": segment.text}
        for begin, end, segment in zip(begins, begins[1:], timeline.segments, strict=False)
        if begin < seconds
    ]
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
    for row in rows[:SHOWN]:
        print(f"{row['begin']:9.2f}  {_shortened(row['text'])}")
    if len(rows) > SHOWN:
        print(f"           ... and {len(rows) - SHOWN:,} more; --json lists all")


def _shortened(text: str) -> str:
    """A prompt as one line of a table."""
    line = " ".join(text.split())
    return line if len(line) < 80 else line[:77] + "..."
