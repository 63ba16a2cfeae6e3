"""Numbers in the words of `generate`: what was read of them, and whether a motion does it."""

import sys
from collections.abc import Iterator, Mapping, Sequence
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from motionloom.goals.amounts import Amount
    from motionloom.goals.segment import Segment
    from motionloom.goals.timeline import Timeline
    from motionloom.motion import Motion
    from motionloom.weights.prior import Prior


def read_amounts(timeline: "Timeline") -> "list[tuple[Segment, Amount]]":
    """The segments that got a goal from a number in their words, with what was read."""
    from motionloom.goals.amounts import read_amount

    found = [(one, read_amount(one.text)) for one in timeline.segments if one.goal is not None]
    return [(segment, amount) for segment, amount in found if amount is not None]


def controlled(prior: "Prior", segment: "Segment", *, seed: int, options: Mapping[str, Any]) -> "Motion":
    """The motion of one segment with a goal, from one seed; ``options`` are those of `control`."""
    from motionloom.tasks.control import control

    assert segment.goal is not None
    (made,) = control(prior, segment.text, segment.goal, seed=seed, **options)
    return made.motion


def measuring_amounts(
    results: list[list[dict[str, object]]], motions: "Iterator[Motion]", timelines: "Sequence[Timeline]"
) -> "Iterator[Motion]":
    """The motions as they come; ``results`` gets what was read and what is drawn, stderr what was missed."""
    from motionloom.goals.amount_goal import measured, missed

    for number, (motion, timeline) in enumerate(zip(motions, timelines, strict=False), start=1):
        own: list[dict[str, object]] = []
        spans = zip(timeline.begins, timeline.begins[1:], timeline.segments, strict=False)
        amounts = {id(segment): amount for segment, amount in read_amounts(timeline)}
        for begin, end, segment in spans:
            if (amount := amounts.get(id(segment))) is None:
                continue
            part = motion.positions()[begin:end]
            unit = "degrees" if amount.kind in ("turn", "arc") else "m"
            size = amount.size if unit == "degrees" else amount.metres
            read: dict[str, object] = {
                "read": str(amount),
                "asked": round(size, 3),
                "measured": round(measured(amount, part), 3),
                "unit": unit,
            }
            own.append(read)
            if problem := missed(amount, part):
                whose = f"motion {number}: " if len(timelines) > 1 else ""
                print(f"motionloom: {whose}{problem}", file=sys.stderr)
        results.append(own)
        yield motion
