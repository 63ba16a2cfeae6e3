"""`motionloom generate`: words to motion files."""

import sys
from argparse import Namespace
from collections.abc import Iterator
from dataclasses import asdict, replace
from pathlib import Path
from typing import Any

import numpy as np

from motionloom.cli.newcomers import one_sentence
from motionloom.cli.sampling import (
    bar,
    check_loop,
    check_outs,
    check_prompt,
    fail,
    finished_motions,
    load_prior,
    places,
    report,
    request_of,
    segment_rows,
    unknown_words,
)
from motionloom.cli.skeletons import Target
from motionloom.cli.terminal import note, say
from motionloom.cli.writing import check_overwriting
from motionloom.core.files.text import read_text
from motionloom.core.models.prior import Prior
from motionloom.core.motion import Motion
from motionloom.goals.remarks import numbers_read, parts_read
from motionloom.goals.sequence import usual_seconds
from motionloom.goals.timeline import Timeline
from motionloom.kinematics.gestures import Seat, seats
from motionloom.kinematics.physics import TOES
from motionloom.kinematics.stairs import stairs
from motionloom.requests.sampling import SOLVER
from motionloom.requests.tasks import Generate
from motionloom.tasks.run import Models, Plan, run_each
from motionloom.tasks.worded import Worded

MAX_PROMPTS = 1000
MAX_MOTIONS = 10_000


def run_generate(arguments: Namespace) -> int:
    """``motionloom generate PROMPT``."""
    prompts = _prompts(arguments)
    outs, target = check_outs(arguments)
    if len(prompts) * arguments.count > MAX_MOTIONS:
        fail(f"{len(prompts)} prompts, {arguments.count} of each, are too many; at most {MAX_MOTIONS:,} in one call")
    captions = [prompt for prompt in prompts for _ in range(arguments.count)]
    files = places(outs, len(captions), target)
    prior = load_prior(arguments)
    check_overwriting(arguments, [file for several in files for file in several])
    timelines = {prompt: _timeline(arguments, prior, prompt, target.metre) for prompt in prompts}
    for timeline in timelines.values():
        check_loop(arguments, timeline.seconds)
    heads = not (arguments.literal or arguments.as_one)
    remarks = unknown_words(prior, [part.text for one in timelines.values() for part in one.segments], heads=heads)
    output = finished_motions(files, captions, target, arguments.fps)
    worded: list[Worded] = []
    seated: list[list[Seat]] = []
    requests = [(prompt, timelines[prompt]) for prompt in prompts]

    def sample() -> Iterator[list[Motion]]:
        for motion in _generated(arguments, prior, requests, worded, unknown=remarks):
            seated.append([_moved(seat, target, motion) for seat in seats(motion.positions(), motion.fps)])
            yield [motion]

    interrupted = output.take(sample(), measured=arguments.json)
    motions = [
        {
            "prompt": caption,
            "seed": arguments.seed + i,
            "segments": segment_rows(worded[i].timeline),
            "seats": [asdict(seat) for seat in own],
            "stairs": stairs_under(worded[i].motion),
            "amounts": [asdict(one) for one in worded[i].amounts],
            "missing": worded[i].missing,
            "still_from": worded[i].still_from,
        }
        for i, (caption, own) in enumerate(zip(captions[: output.count], seated))
    ]
    _remark_seats(seated[: output.count])
    for motion, did in zip(motions, output.happened):
        motion["happened"] = did
    for number, motion in enumerate(motions, start=1):
        if under := motion["stairs"]:
            whose = f"motion {number} " if len(motions) > 1 else ""
            say(
                f"{whose}goes over {under['steps']} stairs of {under['rise']:.2f} m, which are not shown; "
                "--json has their places"
            )
    length = usual_seconds(prompts[0]) if arguments.seconds is None else arguments.seconds
    about = {
        "motions": motions,
        "seconds": length,
        "weights": str(arguments.weights),
        "remarks": list(remarks.values()),
    }
    report(arguments, about, output.paths, output.sampling)
    return output.ended(interrupted)


def stairs_under(motion: Motion) -> dict[str, Any] | None:
    """The steps under a person who climbs: their number and rise, and when and where each foot is on one."""
    places = motion.positions()
    flight = stairs(places, motion.fps)
    if flight is None:
        return None
    holds = []
    for hold, level in zip(flight.holds, flight.levels, strict=True):
        x, _, z = np.median(places[hold.first : hold.end, TOES[hold.side]], axis=0).tolist()
        times = {"begin": hold.first / motion.fps, "end": hold.end / motion.fps}
        holds.append(times | {"x": round(x, 3), "z": round(z, 3), "height": round(level * flight.rise, 3)})
    return {"steps": flight.steps, "rise": flight.rise, "footholds": holds}


def _moved(seat: Seat, target: Target, motion: Motion) -> Seat:
    """A seat as a character of the target's size needs it."""
    x, height, z = target.from_motion(motion).to_world(np.array([seat.x, seat.height, seat.z]) * target.size)
    return replace(seat, height=float(height), x=float(x), z=float(z))


def _remark_seats(seated: list[list[Seat]]) -> None:
    """Note where a seat belongs: nothing is generated but the person."""
    for number, own in enumerate(seated, start=1):
        whose = f"motion {number} " if len(seated) > 1 else ""
        for one in own[:3]:
            say(
                f"{whose}sits from {one.begin:.1f} to {one.end:.1f} s: a seat {one.height:.2f} m high "
                f"belongs at x {one.x:.2f}, z {one.z:.2f} m"
            )


def _timeline(arguments: Namespace, prior: Prior, prompt: str, metre: float) -> Timeline:
    """The timeline of a prompt; notes it where there are several segments. metre: as of `Target.metre`."""
    from motionloom.tasks.worded import read

    timeline = read(
        prior,
        prompt,
        arguments.seconds,
        parted=not arguments.as_one,
        amounts=not (arguments.literal or arguments.as_one),
        metre=metre,
    )
    if remark := numbers_read(timeline):
        say(f"{remark}; --literal leaves them")
    if remark := parts_read(timeline):
        if arguments.solver != SOLVER:
            fail("--solver is for one action at a time; give --as-one to leave the sentence whole")
        say(f"{remark}; --as-one leaves it whole")
    return timeline


LONGEST = 30.0
"""Seconds of one sentence above which a long motion is meant."""


def _prompts(arguments: Namespace) -> list[str]:
    prompts = [*one_sentence(arguments.prompts), *(_lines(arguments.file) if arguments.file else ())]
    if not prompts:
        fail("no prompt; say what the person does, such as: motionloom generate 'a person walks forward'")
    if len(prompts) > MAX_PROMPTS:
        fail(f"{len(prompts)} prompts are too many for one call; give at most {MAX_PROMPTS}")
    for prompt in prompts:
        check_prompt(prompt)
    if arguments.seconds is not None and arguments.seconds > LONGEST:
        note(
            f"{arguments.seconds:g} s are long for one sentence; several that follow each other are made with: "
            "motionloom compose 'a person walks' 'a person sits down'"
        )
    return prompts


def _lines(file: Path) -> list[str]:
    try:
        read = sys.stdin.buffer.read(16_000_000) if str(file) == "-" else read_text(file, max_bytes=16_000_000)
        text = read.decode("utf-8")
    except UnicodeDecodeError:
        fail(f"{file} is not UTF-8 text; save it as UTF-8 with one prompt per line")
    return [line.strip() for line in text.splitlines() if line.strip()]


def _generated(
    arguments: Namespace,
    prior: Prior,
    requests: list[tuple[str, Timeline]],
    worded: list[Worded],
    *,
    unknown: dict[str, str],
) -> Iterator[Motion]:
    """The motions in order, each from its own seed, as they are finished; ``worded`` gets them with what was read."""
    plans = []
    for number, (prompt, timeline) in enumerate(requests):
        values = request_of(arguments, Generate, {"prompt": prompt})
        sampling = replace(values.sampling, seed=arguments.seed + number * arguments.count)
        plans.append(Plan(task="generate", values=values, sampling=sampling, timeline=timeline))
    several = len(requests) * arguments.count > 1
    with bar("generating") as progress:
        for _, result in run_each(plans, Models(prior), progress):
            one = replace(result.about, unknown=unknown)
            worded.append(one)
            for line in (*one.shortfalls, *result.aloft):
                whose = f"motion {len(worded)}: " if several else ""
                say(f"{whose}{line}")
            yield from result.people
