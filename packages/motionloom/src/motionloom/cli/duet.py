"""`motionloom duet`: two people from words, going on from their past, reacting to somebody, or through a timeline."""

from argparse import Namespace
from collections import Counter
from collections.abc import Iterator, Sequence
from pathlib import Path
from typing import Any, NoReturn

from motionloom.cli.reading import crop, note_rate, read_clip
from motionloom.cli.robots import note_on_metres
from motionloom.cli.sampling import (
    Finished,
    check_prompt,
    fail,
    load_prior,
    places,
    report,
    request_of,
    results,
)
from motionloom.cli.skeletons import Target, own_outs, read_target
from motionloom.cli.terminal import note, say
from motionloom.cli.writing import at_rate, check_overwriting, check_rate, check_unit
from motionloom.core.errors import MotionloomError
from motionloom.core.models.pair import PairBlock
from motionloom.core.motion import MAX_POSES, Motion
from motionloom.formats import characters, writable
from motionloom.goals.goal import FPS, Goal
from motionloom.goals.goal_file import read_goal
from motionloom.goals.roles import prompts_of
from motionloom.goals.timeline import Timeline, read_timeline
from motionloom.io.lined_yaml import fail as fail_at
from motionloom.io.lined_yaml import read_lined
from motionloom.io.stream import check_length
from motionloom.kinematics.capsules import DEEP, overlap, trunk_distance, wrist_distance
from motionloom.requests.reading import resolve_sampling
from motionloom.requests.tasks import Duet
from motionloom.retarget import joints22
from motionloom.tasks.remarks import remarks_on_words
from motionloom.tasks.run import Models, Plan
from motionloom.tasks.text import frames_in

MAX_SECONDS = 3600.0
"""Of a timeline."""
SECONDS, ADDED = 6.0, 3.0
"""Length of a duet, and what is added to a past, unless the line says otherwise."""
SINGLE = writable(single=True)
"""Files of one person each."""
REMARKED = 64
"""Segments of a timeline whose words are remarked on."""


def run_duet(arguments: Namespace) -> int:
    """``motionloom duet``."""
    _check(arguments)
    outs, target = check_pair_outs(arguments)
    files = places(outs, arguments.count, target, sheets=False)
    metre = target.metre
    timeline = _timeline(arguments, metre) if arguments.timeline else None
    goals = _goals(arguments, metre)
    if metre != 1.0 and (any(goals) or (timeline is not None and timeline.asks)):
        note(note_on_metres(metre))
    people, targets = _read(arguments, target)
    _check_sizes(arguments, files, people, timeline)
    prior = load_prior(arguments)
    block = PairBlock.load(arguments.pair_weights, prior)
    check_overwriting(arguments, [file for several in files for file in several])
    words = remarks_on_words(prior, _texts(arguments, timeline), block=block)
    remarks = _printed([one.line for one in words])
    caption = _caption(arguments, timeline)

    def write(duets: Sequence[list[Motion]], places: list[list[Path]], first: int) -> None:
        write_pairs(duets, places, targets, caption)

    def convert(duets: Sequence[list[Motion]]) -> list[list[Motion]]:
        return [target.retarget_all(at_rate(duet, arguments.fps)) for duet in duets]

    output = Finished(files, arguments.count, write, convert, what="duets")
    seconds = 0.0
    measures: list[dict[str, float]] = []

    def sample() -> Iterator[list[list[Motion]]]:
        nonlocal seconds
        plan = _plan(arguments, people, timeline, goals)
        for one in results("drawing two people", plan, Models(prior, block)):
            seconds = one.people[0].seconds
            measures.append(_measures(one.people))
            yield [list(one.people)]

    interrupted = output.take(sample(), measured=arguments.json)
    about = _about(arguments, output.count, seconds)
    about |= {
        "measures": measures[: output.count],
        "happened": output.happened,
        "remarks": remarks + _printed(_remarks(measures[: output.count])),
    }
    report(arguments, about, output.paths, output.sampling)
    note_rate(arguments, _inputs(arguments))
    return output.ended(interrupted)


def _plan(
    arguments: Namespace,
    people: list[Motion],
    timeline: Timeline | None,
    goals: tuple[Goal | None, Goal | None],
) -> Plan:
    values = request_of(arguments, Duet, {"prompt": arguments.text, "person": arguments.person - 1})
    usual = ADDED if arguments.past else SECONDS
    return Plan(
        task="duet",
        values=values,
        sampling=resolve_sampling(values, timeline),
        seconds=usual if arguments.seconds is None else arguments.seconds,
        timeline=timeline,
        goals=goals,
        people=tuple(people),
    )


# What is read


def _inputs(arguments: Namespace) -> list[Path]:
    return list(arguments.past or ([arguments.react_to] if arguments.react_to else []))


def _read(arguments: Namespace, target: Target) -> tuple[list[Motion], list[Target]]:
    """Motions that are read, and what each of the two people becomes."""
    paths = _inputs(arguments)
    if len({path.resolve() for path in paths}) < len(paths):
        fail(f"{paths[0]} is named twice as the past; give the motion of each person")
    motions, targets = [], []
    for path in paths:
        motion, unit, orders = read_clip(arguments, path)
        motions.append(crop(motion, arguments))
        targets.append(target.like(unit, orders))
    return motions, [*targets, target, target][:2]


def _timeline(arguments: Namespace, metre: float) -> Timeline:
    path = arguments.timeline
    timeline = read_timeline(path, metre)

    def wrong(key: str, message: str, number: int | None = None) -> NoReturn:
        top: Any = read_lined(path).value
        fail_at(path, top[key].key_line if number is None else top[key].value[number].line, message)

    if timeline.start is not None:
        wrong("start", "two people do not go on from one 'start'; leave it out, or use --past")
    if timeline.seconds > MAX_SECONDS:
        wrong("segments", f"two people do at most {MAX_SECONDS:g} s; got {timeline.seconds:g}")
    for number, segment in enumerate(timeline.segments):
        try:
            prompts_of(segment.text)
        except MotionloomError as error:
            wrong("segments", str(error), number)
    return timeline


def _goals(arguments: Namespace, metre: float) -> tuple[Goal | None, Goal | None]:
    """The goals of the first and of the second."""
    goals = [_goal(arguments, path, metre) for path in arguments.path or ()]
    if len(goals) == 2:
        return goals[0], goals[1]
    goal = goals[0] if goals else None
    return (goal, None) if arguments.person == 1 else (None, goal)


def _goal(arguments: Namespace, path: Path, metre: float) -> Goal:
    """The goal of one of the two: a goal file, such a mapping in YAML, or the line of a drawing."""
    frames = frames_in(SECONDS if arguments.seconds is None else arguments.seconds, FPS)
    if path.suffix.lower() in (".yaml", ".yml"):
        what = read_lined(path).plain()
        if not isinstance(what, dict):
            fail(f"{path} must be a mapping with 'path', 'joints' or what else a goal file may hold")
        if {"points", "svg", "curve"} & set(what):
            what = {"path": what}
        try:
            return read_goal(what, frames=frames, folder=path.parent, metre=metre)
        except MotionloomError as error:
            fail(f"{path}: {error}")
    if path.suffix.lower() == ".svg":
        drawing = path.resolve() if path.exists() else path  # a link may go anywhere
        what = {"path": {"svg": drawing.name}}
        return read_goal(what, frames=frames, folder=drawing.parent, metre=metre)
    return read_goal(path, frames=frames, folder=path.parent, metre=metre)


# Requests that cannot be met


def _check(arguments: Namespace) -> None:
    kinds = [name for name in ("past", "react-to", "timeline") if getattr(arguments, name.replace("-", "_"))]
    if len(kinds) > 1:
        fail(f"--{kinds[0]} and --{kinds[1]} are different tasks; give one of them")
    if arguments.loop and kinds == ["react-to"]:
        fail("--loop would change the motion that is reacted to; leave it out")
    if arguments.text is not None:
        check_prompt(arguments.text)
    elif not kinds:
        fail("no prompt; say what the two do, such as: motionloom duet 'two people dance salsa together'")
    if kinds == ["timeline"] and (arguments.text is not None or arguments.count != 1):
        fail("a timeline has its own texts and makes one duet; leave out the text and --count")
    if arguments.seconds is not None and kinds in (["timeline"], ["react-to"]):
        fail(f"--seconds does not go with --{kinds[0]}, which says how long it is")
    if arguments.path and kinds:
        fail(f"--path does not go with --{kinds[0]}; give it with a text, or write it into a timeline")
    if len(arguments.path or ()) > 2:
        fail(f"--path is given {len(arguments.path)} times; two people have one each")
    check_rate(arguments)


def check_pair_outs(arguments: Namespace) -> tuple[list[Path], Target]:
    """The files to write, those of one person in twos of a kind, first that of the first person; and their target."""
    outs = arguments.out or [Path("duet.glb")]
    if not arguments.out and Path(arguments.skeleton or "").suffix.lower() in characters():
        outs = [out for name in ("duet_a", "duet_b") for out in own_outs(arguments, name)]
    target = read_target(arguments, outs)
    target.names(["first", "second"])
    if len({out.resolve() for out in outs}) != len(outs):
        fail("the same --out is given twice; give each file its own name")
    check_unit(arguments, outs)
    for suffix in _single(target):
        own = [out for out in outs if out.suffix.lower() == suffix]
        if len(own) not in (0, 2):
            fail(f"a {suffix} file holds one person: give two, such as --out a{suffix} --out b{suffix}; got {len(own)}")
    return outs, target


def _single(target: Target) -> tuple[str, ...]:
    """The suffixes of files that hold one person; a character's own file does."""
    return tuple(dict.fromkeys((*SINGLE, *target.suffixes)))


def _check_sizes(
    arguments: Namespace, files: list[list[Path]], people: list[Motion], timeline: Timeline | None
) -> None:
    """Refuse what no file or memory holds, before any work."""
    if timeline is None and not people:
        return
    added = ADDED if arguments.seconds is None else arguments.seconds
    seconds = timeline.seconds if timeline else people[0].seconds + (added if arguments.past else 0.0)
    rate = arguments.fps or (people[0].fps if people else 20.0)
    joints = [len(motion.skeleton) for motion in people] or [22]
    for place in (place for several in files for place in several):
        check_length(place, total=round(seconds * rate), fps=rate, joints=max(joints))
    if 2 * max(joints) * seconds * rate * arguments.count > MAX_POSES:
        fail(f"{arguments.count} duets of {seconds:g} s do not fit into memory; lower --count, or use --start")


# What is written and reported


def _texts(arguments: Namespace, timeline: Timeline | None) -> list[str]:
    """The words for the two."""
    texts = [arguments.text or ""] if timeline is None else [segment.text for segment in timeline.segments[:REMARKED]]
    return [text for text in dict.fromkeys(texts) if text.strip()]


def _printed(lines: list[str]) -> list[str]:
    for line in lines:
        say(line)
    return lines


def _caption(arguments: Namespace, timeline: Timeline | None) -> str:
    if timeline is not None:
        return "; ".join(" ".join(segment.text.split()) for segment in timeline.segments[:20])
    return arguments.text or " and ".join(path.stem for path in _inputs(arguments))


def write_pairs(
    duets: Sequence[list[Motion]],
    files: list[list[Path]],
    targets: Sequence[Target],
    caption: str,
) -> list[Path]:
    """All files, duet by duet; a person whose motion came from a BVH file keeps its unit and orders."""
    paths, names, single = [], targets[0].names([caption] * 2), _single(targets[0])
    for number, duet in enumerate(duets):
        counts: Counter[str] = Counter()
        for out in (several[number] for several in files):
            suffix = out.suffix.lower()
            if suffix not in single:
                paths.append(targets[0].save_together(duet, out, caption))
                continue
            person = counts[suffix]
            counts[suffix] += 1
            paths.append(targets[person].save(duet[person], out, caption=names[person]))
    return paths


def _about(arguments: Namespace, count: int, seconds: float) -> dict[str, Any]:
    return {
        "prompt": arguments.text,
        "past": [str(path) for path in arguments.past or ()],
        "given": None if arguments.react_to is None else str(arguments.react_to),
        "timeline": None if arguments.timeline is None else str(arguments.timeline),
        "duets": count,
        "seconds": seconds,
        "seed": arguments.seed,
        "weights": str(arguments.weights),
        "block": str(arguments.pair_weights),
    }


def _measures(duet: Sequence[Motion]) -> dict[str, float]:
    """How near the two bodies and their hands come, and how deep and in how many frames they are in each other."""
    first, second = (joints22(person) for person in duet)
    apart, depth = trunk_distance(first, second), overlap(first, second)
    hands = wrist_distance(first, second)
    return {
        "least_trunk_distance": round(float(apart.min()), 4),
        "trunk_distance": round(float(sorted(apart)[len(apart) // 2]), 4),
        "deepest_overlap": round(float(depth.max()), 4),
        "overlapping_frames": int((depth > DEEP).sum()),
        "least_wrist_distance": round(float(hands.min()), 4),
        "least_wrist_distance_at": round(float(hands.argmin()) / duet[0].fps, 3),
    }


def _remarks(measures: Sequence[dict[str, float]]) -> list[str]:
    """A sentence for each duet whose bodies are in each other."""
    return [
        f"{f'duet {number}: ' if len(measures) > 1 else ''}the two bodies overlap by up to "
        f"{100 * one['deepest_overlap']:.0f} cm; frames: {one['overlapping_frames']}"
        for number, one in enumerate(measures, 1)
        if one["overlapping_frames"]
    ]
