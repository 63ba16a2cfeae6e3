"""`motionloom control`: words and goals to motion files."""

from argparse import Namespace
from collections.abc import Iterator
from dataclasses import replace
from pathlib import Path

import numpy as np

from motionloom.cli.newcomers import one_sentence
from motionloom.cli.reading import load_motion
from motionloom.cli.robots import note_on_metres
from motionloom.cli.sampling import (
    Finished,
    check_loop,
    check_outs,
    check_prompt,
    fail,
    finished_motions,
    load_prior,
    note_loop,
    places,
    remark_unknown,
    report,
    request_of,
    results,
)
from motionloom.cli.terminal import note, say
from motionloom.cli.writing import check_overwriting
from motionloom.core.errors import quoted
from motionloom.core.models.adapter import Adapter
from motionloom.core.models.prior import Prior
from motionloom.core.motion import Motion
from motionloom.goals.goal import FPS, Goal, merged
from motionloom.goals.goal_file import follow, read_goal
from motionloom.goals.reach import check_reach
from motionloom.requests.tasks import Control
from motionloom.tasks.control import Adapters, Controlled
from motionloom.tasks.run import Models, Plan
from motionloom.tasks.text import frames_in


def run_control(arguments: Namespace) -> int:
    """``motionloom control PROMPT --goal FILE``."""
    outs, target = check_outs(arguments)
    if len(one_sentence(arguments.prompt)) > 1:
        fail(f"one prompt is needed; got {len(arguments.prompt)}: {', '.join(arguments.prompt)[:200]}")
    arguments.prompt = next(iter(one_sentence(arguments.prompt)), None)
    if arguments.prompt is None:
        fail("no prompt; say what the person does, such as: motionloom control 'a person walks' --goal goal.json")
    check_prompt(arguments.prompt)
    files, metre = places(outs, arguments.count, target), target.metre
    goal = _goal(arguments, metre)
    if metre != 1.0:
        note(_note_on_path(goal, metre))
    if arguments.loop:
        check_loop(arguments, len(goal.positions) / FPS)
        note_loop(arguments, "goals there are not kept")
    prior = load_prior(arguments)
    check_overwriting(arguments, [file for several in files for file in several])
    remarks = remark_unknown(prior, [arguments.prompt])
    output = finished_motions(files, [arguments.prompt] * arguments.count, target, arguments.fps)
    values, judged = request_of(arguments, Control, {"goals": goal}), []
    plan = Plan(
        task="control",
        values=values,
        sampling=values.sampling,
        goals=(goal, None),
        adapters=_adapters(arguments.adapters, prior),
    )

    def sample() -> Iterator[list[Motion]]:
        for one in results("controlling", plan, Models(prior)):
            judged.append(one.about)
            yield list(one.people)

    interrupted = output.take(sample(), measured=arguments.json)
    _report(arguments, judged[: output.count], output, metre=metre, remarks=remarks)
    return output.ended(interrupted)


def _note_on_path(goal: Goal, metre: float) -> str:
    """How a path in a robot's metres is walked by the generated person."""
    frames = np.flatnonzero(goal.mask[:, 0, [0, 2]].all(axis=1))
    if len(frames) < 2:
        return note_on_metres(metre)
    way = float(np.linalg.norm(np.diff(goal.positions[frames, 0][:, [0, 2]], axis=0), axis=1).sum())
    pace = way * FPS / (frames[-1] - frames[0])
    gone = f"it goes {metre * way:.2f} m at {metre * pace:.2f} m/s, as a person would at {pace:.2f} m/s"
    return f"goals are in the robot's metres: {gone}"


def _goal(arguments: Namespace, metre: float) -> Goal:
    """All goals of the line as one goal of the generated person, whose metre becomes ``metre``; a clip that
    is followed is the person's anyway."""
    if bool(arguments.follow) != (arguments.clip is not None):
        fail("--follow names joints of the motion that --from names; give both or none")
    if arguments.width is not None and arguments.path is None:
        fail("--width is that of the drawing of --path; give both or none")
    if not (arguments.goal or arguments.follow or arguments.path):
        fail("nothing to keep to; give --goal FILE, --path SVG, or --follow JOINT --from CLIP")
    clip = None if arguments.clip is None else load_motion(arguments, arguments.clip)
    usual = 5.0 if clip is None else (len(clip) - 1) / clip.fps + 1 / FPS
    frames = frames_in(usual if arguments.seconds is None else arguments.seconds, FPS)
    goals = [read_goal(file, frames=frames, folder=file.parent, metre=metre) for file in arguments.goal]
    if arguments.path is not None:
        goals.append(_goal_of_drawing(arguments.path, arguments.width, frames, metre))
    if clip is not None:
        goals.append(follow(clip, arguments.follow, frames=frames))
    whole = goals[0]
    for other in goals[1:]:
        if clip is not None and other is goals[-1] and (whole.start is not None or whole.mask[0, 0].any()):
            other = replace(other, start=None)  # the person starts at the goals' start, not at the clip's
        whole = merged(whole, other)
    try:
        check_reach(whole)
    except ValueError as error:
        fail(f"the goals together {error}")
    return whole


def _goal_of_drawing(path: Path, width: float | None, frames: int, metre: float) -> Goal:
    """The line of an SVG file."""
    if not path.is_file():
        fail(f"--path: there is no file {quoted(str(path))}")
    size = {} if width is None else {"width": width}
    drawing = path.resolve()  # a link may go anywhere
    return read_goal({"path": {"svg": drawing.name, **size}}, frames=frames, folder=drawing.parent, metre=metre)


def _adapters(names: list[str], prior: Prior) -> Adapters:
    """'none', 'fitting' or the adapters of these names."""
    if not names or names == ["none"]:
        return "none"
    if names == ["fitting"]:
        return "fitting"
    if {"fitting", "none"} & set(names):
        fail("--adapters is none, fitting, or names of adapters; not a mix of them")

    return [Adapter.load(name, prior) for name in names]


def _report(
    arguments: Namespace,
    judged: list[Controlled],
    output: Finished[Motion],
    *,
    metre: float,
    remarks: list[str],
) -> None:
    for number, one in enumerate(judged):
        which = f"motion {number} (seed {arguments.seed + number}): " if len(judged) > 1 else ""
        for sentence in one.missed:
            say(f"{which}{sentence}")
    if arguments.json:
        motions = [
            {
                "prompt": arguments.prompt,
                "seed": arguments.seed + number,
                "error_cm": round(100 * metre * one.error, 3),
                "worst_cm": round(100 * metre * one.worst, 3),
                "missed": one.missed,
                "happened": output.happened[number],
            }
            for number, one in enumerate(judged)
        ]
        about = {
            "motions": motions,
            "seconds": len(judged[0].motion) / judged[0].motion.fps,
            "weights": str(arguments.weights),
            "remarks": remarks,
        }
        report(arguments, about, output.paths, output.sampling)
        return
    paths = output.paths
    for several in output.files:
        for number, path in enumerate(file for file in several if file in paths):
            of = judged if len(several) == 1 else [judged[number]]
            mean, worst = sum(one.error for one in of) / len(of), max(one.worst for one in of)
            print(f"wrote {path}: {100 * metre * mean:.1f} cm from its goals, at most {100 * metre * worst:.1f} cm")
