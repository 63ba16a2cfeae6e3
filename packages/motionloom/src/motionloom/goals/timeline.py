"""Timeline files: what happens when, as YAML that says line by line what is wrong with it.

`docs/compose.md` explains the keys, `motionloom.requests.timeline` lists them, `motionloom compose --schema` prints
them as a JSON Schema.
"""

from collections.abc import Sequence
from dataclasses import dataclass, replace
from itertools import pairwise
from pathlib import Path
from typing import Any

from motionloom.core.errors import MotionloomError
from motionloom.core.files.text import plain_text
from motionloom.core.reading import check_text
from motionloom.formats import readable
from motionloom.goals.adapters import MOST_ADAPTERS, parse_adapter
from motionloom.goals.amounts import (
    CHAINED,
    STROKES,
    Amount,
    goal_for,
    goal_in_place,
    read_amount,
    read_seconds,
    seconds_for,
    single_stroke,
    unread_numbers,
)
from motionloom.goals.fields import Field, LinedFile
from motionloom.goals.goal import FPS, Goal, merged
from motionloom.goals.goal_file import read_goal
from motionloom.goals.seconds import flights
from motionloom.goals.segment import TRANSITION, Segment
from motionloom.goals.sequence import Part, lengths, split_actions, usual_seconds
from motionloom.goals.verbs import in_plainer_words, subject_of
from motionloom.io.lined_yaml import MAX_ITEMS, Lined, line_of, lined_of, parse_lined, read_lined
from motionloom.requests.fields import specs
from motionloom.requests.shared import LONGEST, LONGEST_PROMPT
from motionloom.requests.timeline import SECONDS, SegmentKeys, TimelineKeys

TIMELINE, SEGMENT = specs(TimelineKeys), specs(SegmentKeys)
SHORTEST = SEGMENT["seconds"].low
REST = 1.0
"""Seconds from which on somebody stands still behind repetitions that are over before the time that was said."""
MAX_SEGMENTS = MAX_ITEMS
MAX_GOAL_FRAMES = 1_000_000
"""Frames with targets in one timeline, 0.6 GB of them."""


@dataclass(frozen=True)
class Reading:
    """A number that was read in the words."""

    amount: Amount
    first: int
    end: int
    """Half-open range of the segments that do it."""
    fixed: bool = False
    """Whether these take the seconds that were said, whatever one of them takes."""


@dataclass(frozen=True, eq=False)
class Timeline:
    """A request to `motionloom.tasks.long.compose`, as read from a file."""

    segments: tuple[Segment, ...]
    seed: int | None = None
    guidance: float | None = None
    """Strength of the text where a segment does not say; None: the default."""
    start: Path | None = None
    """A motion file that the motion goes on from; it is there, and not yet read."""
    path: Goal | None = None
    """Targets for the whole motion in the world, one row per frame."""
    readings: tuple[Reading, ...] = ()
    """Numbers in the words of segments, which their goals and lengths come of."""
    unread: tuple[str, ...] = ()
    """Quantities in the words that are not kept: "3 km"."""

    @property
    def begins(self) -> tuple[int, ...]:
        """The frame at which each segment begins, and at last the number of frames; 20 per second."""
        at = [0]
        for segment in self.segments:
            at.append(at[-1] + _frames(segment.seconds))
        return tuple(at)

    @property
    def plainer(self) -> "Timeline":
        """The same with the nearest common verb for each rare one (`verbs.in_plainer_words`)."""
        return replace(self, segments=tuple(replace(one, text=in_plainer_words(one.text)) for one in self.segments))

    @property
    def frames(self) -> int:
        """Length at 20 frames per second."""
        return sum(_frames(segment.seconds) for segment in self.segments)

    @property
    def asks(self) -> bool:
        """Whether there are places to keep to."""
        return self.path is not None or any(one.goal is not None for one in self.segments)

    @property
    def seconds(self) -> float:
        """Length of the whole: the sum of the segments', each a whole number of frames."""
        return self.frames / FPS


def read_timeline(path: Path | str, metre: float = 1.0) -> Timeline:
    """Read a timeline file.

    Seconds; goals in metres as `motionloom.goals.goal` defines them; metre: as of `goal_file.read_goal`. Files that
    the timeline names lie in its own folder or below. Raises `MotionloomError` with file and line for whatever is
    wrong.
    """
    path = Path(path)
    return _Reader(path, metre).timeline(read_lined(path))


def timeline_of_yaml(text: str, *, folder: Path) -> tuple[Timeline, Any]:
    """The timeline that a file's text holds, and its plain values; mistakes name the line.

    folder: where the files that it names lie, or below.
    """
    document = parse_lined(plain_text(text.encode(errors="replace"), "the timeline"), "the timeline")
    try:
        return _Reader(folder / "the timeline").timeline(document), document.plain()
    except MotionloomError as error:
        raise MotionloomError(str(error).replace(str(folder / "the timeline"), "the timeline")) from None


def timeline_from(value: Any, *, folder: Path) -> Timeline:
    """The timeline of plain values, such as JSON; mistakes name the keys that lead to them.

    folder: where the files that it names lie, or below.
    """
    document, places = lined_of(value)
    return _Reader(folder / "the timeline", places=places).timeline(document)


def plain_timeline(texts: Sequence[str], *, seconds: float = SECONDS, transition: float | None = None) -> Timeline:
    """A timeline of equally long segments; `MotionloomError` for what a file could not ask either."""
    if not texts:
        raise MotionloomError("there is no segment; say what the person does, such as: motionloom compose walk jump")
    if len(texts) > MAX_SEGMENTS:
        raise MotionloomError(f"{len(texts):,} segments are too many; at most {MAX_SEGMENTS:,} are made in one call")
    for number, text in enumerate(texts, start=1):
        if problem := _text_problem(text):
            raise MotionloomError(f"segment {number}: {problem}")
    SEGMENT["seconds"].check(seconds, "a segment's length")
    least = SEGMENT["transition"].low
    if transition is not None and not least <= transition <= seconds / 2 + 1e-9:
        raise MotionloomError(
            f"a transition takes {least:g} s to half of a segment, {seconds / 2:g} s; got {transition:g}"
        )
    shared = min(TRANSITION, seconds / 2) if transition is None else transition
    return Timeline(tuple(Segment(text, seconds, transition=shared) for text in texts))


def single_segment(text: str, seconds: float) -> Timeline:
    """One segment, of any length that one motion may have."""
    return Timeline((Segment(text, seconds),))


def timeline_of(text: str, seconds: float | None = None, *, amounts: bool = False, metre: float = 1.0) -> Timeline:
    """One sentence as segments, one for each action that follows another (`motionloom.goals.sequence`).

    seconds: of the whole, shared out as the actions' own lengths are; None: those lengths. A sentence that says one
    thing, or several at once, is one segment of `usual_seconds`. amounts: numbers with units in the words become
    lengths and goals of their segments (`motionloom.goals.amounts`). metre: as of `goal_file.read_goal`, of metres in
    the words. Raises `MotionloomError` for an impossible request.
    """
    if problem := _text_problem(text):
        raise MotionloomError(problem)
    parts = split_actions(text)
    if amounts:
        return _in_flights(_with_amounts(text, parts, seconds, metre))
    return _in_flights(_timeline_of_parts(text, parts, seconds))


def _with_amounts(text: str, parts: Sequence[Part], seconds: float | None, metre: float) -> Timeline:
    """As long as the numbers in the words need, with their goals; without one as `_timeline_of_parts`."""
    found = (read_amount(part.text, around=len(parts) > 1) for part in parts)
    read = [amount and replace(amount, metre=metre) for amount in found]
    amounts = [one if one is not None and seconds_for(one) <= LONGEST else None for one in read]
    times = [read_seconds(part.text) for part in parts]
    each = zip(parts, amounts, times, strict=True)
    unread = tuple(one for part, amount, time in each for one in unread_numbers(part.text, amount, time))
    own = [time or (one and seconds_for(one)) for time, one in zip(times, amounts, strict=True)]
    if not any(own):
        return replace(_timeline_of_parts(text, parts, seconds), unread=unread)
    natural = [replace(part, seconds=length or part.seconds) for part, length in zip(parts, own, strict=True)]
    fixed = seconds is not None
    if seconds is None and len(parts) == 1:
        seconds = min(natural[0].seconds, LONGEST)
    segments, readings = [], []
    for segment, amount in zip(_timeline_of_parts(text, natural, seconds).segments, amounts, strict=True):
        several = (segment,) if amount is None else with_amount(segment, amount)
        if amount is not None:
            several = in_seconds(several, segment.seconds) if fixed else several
            readings.append(Reading(amount, len(segments), len(segments) + len(several), fixed))
        segments += several
    return Timeline(tuple(segments), readings=tuple(readings), unread=unread)


def with_goals_read(segments: Sequence[Segment]) -> tuple[Segment, ...]:
    """Blocks with the ways, turns and steps that their words say in numbers as goals, in the time that each has.

    A block with a goal, or whose way nobody runs in its time, stays as it is; so do repetitions.
    """
    result = []
    for one in segments:
        amount = None if one.goal is not None else read_amount(one.text, around=len(segments) > 1)
        fits = amount is not None and amount.kind != "count" and seconds_for(amount) < 2 * one.seconds
        result.append(replace(one, goal=goal_for(amount, one.seconds)) if amount and fits else one)
    return tuple(result)


def with_amount(segment: Segment, amount: Amount, share: float = 1.0) -> tuple[Segment, ...]:
    """A segment with the goal that an amount in its words is; repetitions of slow strokes as a segment each.

    share: of the way of steps, and of the time of a stroke, where another than the usual comes nearer to the number.
    """
    if amount.kind != "count":
        scaled = replace(amount, stride=amount.stride * share)
        return (replace(segment, goal=goal_for(scaled, segment.seconds)),)
    assert amount.of is not None
    text, number = single_stroke(segment.text), int(amount.size)
    stroke, each = STROKES[amount.of] * share, segment.seconds / number
    if STROKES[amount.of] < CHAINED:
        whole = _in_whole_frames(min(segment.seconds, LONGEST) * share)
        return (replace(segment, text=text, seconds=whole, goal=goal_in_place(whole) if amount.in_place else None),)
    stroke = _in_whole_frames(min(stroke, each * share))
    between = min(TRANSITION, segment.transition, stroke / 2)
    goal = goal_in_place(stroke) if amount.in_place else None
    return (replace(segment, text=text, seconds=stroke, transition=between, goal=goal),) * number


def in_seconds(segments: Sequence[Segment], seconds: float) -> tuple[Segment, ...]:
    """Segments in so many seconds: shorter ones, or the last one longer, or somebody who then stands still."""
    left = seconds - sum(one.seconds for one in segments)
    if not round(left * FPS):
        return tuple(segments)
    if left < 0:
        each = seconds / len(segments)
        return tuple(_lasting(one, each) for one in segments)
    *before, last = segments
    if left < REST:
        return (*before, _lasting(last, last.seconds + left))
    standing = f"{subject_of(last.text) or 'a person'} stands still"
    return (*segments, Segment(standing, left, transition=min(TRANSITION, last.seconds / 2, left / 2)))


def _lasting(stroke: Segment, seconds: float) -> Segment:
    """A stroke of so many seconds."""
    goal = None if stroke.goal is None else goal_in_place(seconds)
    return replace(stroke, seconds=seconds, transition=min(stroke.transition, seconds / 2), goal=goal)


def _timeline_of_parts(text: str, parts: Sequence[Part], seconds: float | None) -> Timeline:
    if len(parts) == 1:
        return plain_timeline([text], seconds=usual_seconds(text) if seconds is None else seconds)
    if seconds is not None and not SHORTEST * len(parts) <= seconds <= LONGEST:
        raise MotionloomError(
            f"{len(parts)} actions one after the other take {SHORTEST * len(parts):g} to {LONGEST:g} seconds; got "
            f"{seconds:g}"
        )
    shares = lengths(parts, seconds, fps=FPS)
    shared = [min(TRANSITION, one / 2, other / 2) for one, other in zip(shares, [*shares[1:], shares[-1]], strict=True)]
    return Timeline(
        tuple(
            Segment(part.text, share, transition=overlap)
            for part, share, overlap in zip(parts, shares, shared, strict=True)
        )
    )


def _in_flights(timeline: Timeline) -> Timeline:
    """The same, who goes up stairs for long in several segments of the same words (`flights`)."""
    segments: list[Segment] = []
    for one in timeline.segments:
        count = 1 if timeline.readings else flights(one.text, one.seconds)
        marks = [_frames(one.seconds) * part // count for part in range(count + 1)]
        each = [(end - begin) / FPS for begin, end in pairwise(marks)] if count > 1 else [one.seconds]
        shared = min(one.transition, each[0] / 2)
        segments += [replace(one, seconds=seconds, transition=shared) for seconds in each]
    return timeline if len(segments) == len(timeline.segments) else replace(timeline, segments=tuple(segments))


def _in_whole_frames(seconds: float) -> float:
    """Seconds in whole frames."""
    return max(1, _frames(seconds)) / FPS


def _frames(seconds: float) -> int:
    return round(seconds * FPS)


def _text_problem(text: str) -> str:
    if not text.strip():
        return "the text is empty; say in words what the person does"
    if len(text) > LONGEST_PROMPT:
        return f"the text has {len(text):,} characters; say it in at most {LONGEST_PROMPT:,}"
    try:
        check_text(text, "the text")
    except MotionloomError as error:
        return str(error)
    return ""


@dataclass(frozen=True)
class _Row:
    """A segment as written; None where nothing is."""

    line: int
    text: str
    seconds: float = SECONDS
    guidance: float | None = None
    transition: float | None = None
    transition_line: int = 0
    goals: tuple[Lined, ...] = ()
    adapters: tuple[tuple[Path, float], ...] = ()


@dataclass(frozen=True)
class _Reader(LinedFile):
    metre: float = 1.0

    def timeline(self, document: Lined) -> Timeline:
        top = self.mapping(document, tuple(TIMELINE), "a timeline")
        if "segments" not in top:
            self.fail(document.line, "there are no 'segments'; list what the person does, one after the other")
        rows = [self.row(item) for item in self.items(top["segments"], "segments", of="segment")]
        shared = self.field(top, TIMELINE, "transition")
        transitions = self.transitions(rows, shared)
        total = sum(_frames(row.seconds) for row in rows)
        targets = sum(_frames(row.seconds) for row in rows if row.goals) + (total if "path" in top else 0)
        if targets > MAX_GOAL_FRAMES:
            self.fail(
                document.line, f"goals for {targets:,} frames are too many; at most {MAX_GOAL_FRAMES:,} in one file"
            )
        return Timeline(
            self.segments(rows, transitions),
            self.field(top, TIMELINE, "seed"),
            self.field(top, TIMELINE, "guidance"),
            self.start(top.get("start")),
            self.goal(top["path"], "path", total) if "path" in top else None,
        )

    def row(self, item: Lined) -> _Row:
        if isinstance(item.value, str):
            return _Row(item.line, self.text(item))
        entries = self.mapping(item, tuple(SEGMENT), "a segment")
        if "text" not in entries:
            self.fail(item.line, "a segment has no 'text'; say in words what the person does")
        if "goal" in entries and "goals" in entries:
            self.fail(entries["goals"].key_line, "a segment has either 'goal' or 'goals'; put them all into 'goals'")
        seconds = self.field(entries, SEGMENT, "seconds")
        transition = entries.get("transition")
        goals = (entries["goal"],) if "goal" in entries else ()
        if "goals" in entries:
            goals = tuple(self.items(entries["goals"], "goals", of="goal"))
        return _Row(
            item.line,
            self.text(entries["text"]),
            SECONDS if seconds is None else seconds,
            self.field(entries, SEGMENT, "guidance"),
            self.field(entries, SEGMENT, "transition"),
            transition.line if transition else 0,
            goals,
            self.adapters(entries.get("adapters")),
        )

    def adapters(self, node: Lined | None) -> tuple[tuple[Path, float], ...]:
        """``FILE`` or ``FILE:FACTOR``, one or a list of them; the files lie in the timeline's folder."""
        if node is None:
            return ()
        items = [node] if isinstance(node.value, str) else self.items(node, "adapters", of="adapter")
        if len(items) > MOST_ADAPTERS:
            self.fail(node.line, f"{len(items)} adapters at once are too many; at most {MOST_ADAPTERS}")
        result = []
        for one in items:
            if not isinstance(one.value, str):
                self.fail(one.line, f"an adapter is written FILE or FILE:FACTOR; got {self.kind(one)}")
            try:
                name, factor = parse_adapter(one.value)
                result.append((Field(str(name), "adapters").file(self.path.parent), 1.0 if factor is None else factor))
            except MotionloomError as error:
                self.fail(one.line, str(error))
        return tuple(result)

    def transitions(self, rows: list[_Row], shared: float | None) -> list[float]:
        """Each segment's transition to the next; one that is not requested is shortened to what fits."""
        result = []
        for row, following in zip(rows, [*rows[1:], None], strict=True):
            length = shared if row.transition is None and following else row.transition
            following = following or row
            most = min(row.seconds, following.seconds) / 2
            if length is not None and length > most + 1e-9:
                short = row if row.seconds <= following.seconds else following
                self.fail(
                    row.transition_line or row.line,
                    f"the transition takes {length:g} s and the segment of {self.at(short.line)} {short.seconds:g} s; "
                    f"it may take at most half of that, {most:g} s",
                )
            result.append(min(TRANSITION, most) if length is None else length)
        return result

    def segments(self, rows: list[_Row], transitions: list[float]) -> tuple[Segment, ...]:
        def segment(row: _Row, transition: float) -> Segment:
            goal = self.merged(row.goals, _frames(row.seconds))
            return Segment(row.text, row.seconds, row.guidance, transition, goal, row.adapters)

        return tuple(map(segment, rows, transitions))

    def merged(self, goals: tuple[Lined, ...], frames: int) -> Goal | None:
        if not goals:
            return None
        whole = self.goal(goals[0], "goal", frames)
        for other in goals[1:]:
            try:
                whole = merged(whole, self.goal(other, "goal", frames))
            except MotionloomError as error:
                self.fail(other.line, str(error))
        return whole

    def goal(self, node: Lined, name: str, frames: int) -> Goal:
        what: Any = node.value
        if isinstance(what, str):
            what = self.file(node, name)
        elif isinstance(what, dict):
            for key in ("points", "svg", "curve"):
                if name == "path" and key in what:
                    self.fail(what[key].key_line, f"'path' holds a goal; write it as path: {{path: {{{key}: ...}}}}")
            what = node.plain()
        else:
            self.fail(node.line, f"'{name}' must be a mapping or the name of a goal file; got {self.kind(node)}")
        try:
            return read_goal(what, frames=frames, fps=FPS, folder=self.path.parent, metre=self.metre)
        except MotionloomError as error:
            self.fail(line_of(node, str(error)), f"{name}: {error}")

    def start(self, node: Lined | None) -> Path | None:
        if node is None:
            return None
        place = self.file(node, "start")
        if place.suffix.lower() not in readable():
            self.fail(node.line, f"'start' must name a motion, one of {', '.join(readable())}; got {self.kind(node)}")
        return place

    def file(self, node: Lined, name: str) -> Path:
        """A file in the timeline's folder or below it; a timeline from an untrusted source reads nothing else."""
        try:
            return Field(node.value, name).file(self.path.parent)
        except MotionloomError as error:
            self.fail(node.line, str(error))

    def text(self, node: Lined) -> str:
        if not isinstance(node.value, str):
            self.fail(node.line, f"the text must be words; got {self.kind(node)} (put quotes around it if it is one)")
        if problem := _text_problem(node.value):
            self.fail(node.line, problem)
        return node.value

    def kind(self, node: Lined) -> str:
        return "an empty list" if node.value == [] else node.kind
