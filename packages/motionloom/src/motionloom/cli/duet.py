"""`motionloom duet`: two people from words, going on from their past, reacting to somebody, or through a timeline."""

import argparse
import sys
from collections.abc import Iterator, Sequence
from pathlib import Path
from typing import Any, NoReturn

from motionloom.cli.finished import Finished
from motionloom.cli.reading import crop, note_rate, read_clip
from motionloom.cli.robots import note_on_metres
from motionloom.cli.sampling import (
    check_prompt,
    fail,
    load_prior,
    places,
    report,
    request_of,
    results,
)
from motionloom.cli.skeletons import Target, own_outs, read_target
from motionloom.cli.two_bodies import two_body_measures, two_body_remarks
from motionloom.cli.writing import at_rate, check_overwriting, check_rate, check_unit
from motionloom.errors import MotionloomError
from motionloom.formats import characters, writable
from motionloom.goals.goal import FPS, Goal
from motionloom.goals.goal_file import read_goal
from motionloom.goals.remarks import remarks_on_two
from motionloom.goals.roles import prompts_of
from motionloom.goals.timeline import Timeline, read_timeline
from motionloom.io import save, save_scene
from motionloom.io.bvh_writer import save_bvh
from motionloom.io.lined_yaml import fail as fail_at
from motionloom.io.lined_yaml import read_lined
from motionloom.io.stream import check_length
from motionloom.motion import MAX_POSES, Motion
from motionloom.requests.duet import Duet
from motionloom.requests.reading import resolve_sampling
from motionloom.tasks.run import Models, Plan
from motionloom.tasks.text import frames_in
from motionloom.weights.pair import PairBlock
from motionloom.weights.prior import Prior

MAX_SECONDS = 3600.0
"""Of a timeline."""
SECONDS, ADDED = 6.0, 3.0
"""Length of a duet, and what is added to a past, unless asked otherwise."""
SINGLE = writable(single=True)
"""Files of one person each."""
REMARKED = 64
"""Segments of a timeline whose words are remarked on."""


def run_duet(arguments: argparse.Namespace) -> int:
    """``motionloom duet``."""

    _check(arguments)
    outs, skin = check_pair_outs(arguments)
    files = places(outs, arguments.count, sheets=False, target=skin)
    check_overwriting(arguments, [file for several in files for file in several])
    metre = 1.0 if skin is None else skin.metre
    timeline = _timeline(arguments, metre) if arguments.timeline else None
    goals = _goals(arguments, metre)
    if metre != 1.0 and (any(goals) or (timeline is not None and timeline.asks)):
        print(f"note: {note_on_metres(metre)}", file=sys.stderr)
    given, manners = _read(arguments)
    _check_sizes(arguments, files, given, timeline)
    prior, block = _load(arguments)
    remarks = _remarks_on_words(prior, block, _texts(arguments, timeline))
    caption = _caption(arguments, timeline)

    def write(duets: Sequence[list[Motion]], places: list[list[Path]], first: int) -> None:
        write_pairs(duets, places, manners, caption, skin)

    def put(duets: Sequence[list[Motion]]) -> list[list[Motion]]:
        rated = [at_rate(duet, arguments.fps) for duet in duets]
        return rated if skin is None else [skin.put_together(duet) for duet in rated]

    made = Finished(files, arguments.count, write, put, what="duets")
    seconds = 0.0
    measures: list[dict[str, float]] = []

    def drawn() -> Iterator[list[list[Motion]]]:
        nonlocal seconds
        plan = _plan(arguments, given, timeline, goals)
        for one in results("drawing two people", plan, Models(prior, block)):
            seconds = one.people[0].seconds
            measures.append(two_body_measures(one.people))
            yield [list(one.people)]

    interrupted = made.take(drawn(), measured=arguments.json)
    about = _about(arguments, made.count, seconds)
    about |= {
        "measures": measures[: made.count],
        "happened": made.happened,
        "remarks": remarks + _printed(two_body_remarks(measures[: made.count])),
    }
    report(arguments, about, made.written, made.sampling)
    note_rate(arguments, _inputs(arguments))
    return made.ended(interrupted)


def _plan(
    arguments: argparse.Namespace,
    given: list[Motion],
    timeline: Timeline | None,
    goals: tuple[Goal | None, Goal | None],
) -> Plan:
    """What is asked, with what was read."""

    values = request_of(arguments, Duet, {"prompt": arguments.text, "person": arguments.person - 1})
    usual = ADDED if arguments.past else SECONDS
    return Plan(
        task="duet",
        values=values,
        sampling=resolve_sampling(values, timeline),
        seconds=usual if arguments.seconds is None else arguments.seconds,
        timeline=timeline,
        goals=goals,
        people=tuple(given),
    )


# What is read


def _load(arguments: argparse.Namespace) -> tuple[Prior, PairBlock]:

    prior = load_prior(arguments)
    return prior, PairBlock.load(arguments.pair_weights, prior)


def _inputs(arguments: argparse.Namespace) -> list[Path]:
    return list(arguments.past or ([arguments.react_to] if arguments.react_to else []))


def _read(arguments: argparse.Namespace) -> tuple[list[Motion], list[tuple[float, dict[str, str]]]]:
    """Motions that are given, and how their own files say numbers."""
    paths = _inputs(arguments)
    if len({path.resolve() for path in paths}) < len(paths):
        fail(f"{paths[0]} is named twice as the past; give the motion of each person")
    motions, manners = [], []
    for path in paths:
        motion, unit, orders = read_clip(arguments, path)
        motions.append(crop(motion, arguments))
        manners.append((arguments.out_unit or unit or 1.0, orders))
    if not paths:
        manners = [(arguments.out_unit or 1.0, {})] * 2
    elif len(paths) == 1:
        manners.append((arguments.out_unit or 1.0, {}))
    return motions, manners


def _timeline(arguments: argparse.Namespace, metre: float) -> Timeline:

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


def _goals(arguments: argparse.Namespace, metre: float) -> tuple[Goal | None, Goal | None]:
    """What the first and what the second is asked."""
    asked = [_goal(arguments, path, metre) for path in arguments.path or ()]
    if len(asked) == 2:
        return asked[0], asked[1]
    goal = asked[0] if asked else None
    return (goal, None) if arguments.person == 1 else (None, goal)


def _goal(arguments: argparse.Namespace, path: Path, metre: float) -> Goal:
    """What somebody is asked: a goal file, such a mapping in YAML, or a drawn line."""

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
        drawing = path.resolve() if path.exists() else path  # a link may lead anywhere
        what = {"path": {"svg": drawing.name}}
        return read_goal(what, frames=frames, folder=drawing.parent, metre=metre)
    return read_goal(path, frames=frames, folder=path.parent, metre=metre)


# What cannot be asked


def _check(arguments: argparse.Namespace) -> None:
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


def check_pair_outs(arguments: argparse.Namespace) -> tuple[list[Path], Target | None]:
    """The files to write, those of one person in twos of a kind, first that of the first person; and the skeleton."""
    outs = arguments.out or [Path("duet.glb")]
    if not arguments.out and Path(arguments.skeleton or "").suffix.lower() in characters():
        outs = [out for name in ("duet_a", "duet_b") for out in own_outs(arguments, name)]
    skin = read_target(arguments, outs)
    if skin is not None:
        skin.names(["first", "second"])
    if len({out.resolve() for out in outs}) != len(outs):
        fail("the same --out is given twice; give each file its own name")
    check_unit(arguments, outs)
    for suffix in _single(skin):
        own = [out for out in outs if out.suffix.lower() == suffix]
        if len(own) not in (0, 2):
            fail(f"a {suffix} file holds one person: give two, such as --out a{suffix} --out b{suffix}; got {len(own)}")
    return outs, skin


def _single(skin: Target | None) -> tuple[str, ...]:
    """The suffixes of files that hold one person; a character's own file does."""
    return SINGLE if skin is None else tuple(dict.fromkeys((*SINGLE, *skin.suffixes)))


def _check_sizes(
    arguments: argparse.Namespace, files: list[list[Path]], given: list[Motion], timeline: Timeline | None
) -> None:
    """Refuse what no file or memory holds, before any work."""

    if timeline is None and not given:
        return
    added = ADDED if arguments.seconds is None else arguments.seconds
    seconds = timeline.seconds if timeline else given[0].seconds + (added if arguments.past else 0.0)
    rate = arguments.fps or (given[0].fps if given else 20.0)
    joints = [len(motion.skeleton) for motion in given] or [22]
    for place in (place for several in files for place in several):
        check_length(place, total=round(seconds * rate), fps=rate, joints=max(joints))
    if 2 * max(joints) * seconds * rate * arguments.count > MAX_POSES:
        fail(f"{arguments.count} duets of {seconds:g} s do not fit into memory; lower --count, or use --start")


# What is written and reported


def _texts(arguments: argparse.Namespace, timeline: Timeline | None) -> list[str]:
    """What the two are asked in words."""
    said = [arguments.text or ""] if timeline is None else [segment.text for segment in timeline.segments[:REMARKED]]
    return [text for text in dict.fromkeys(said) if text.strip()]


def _remarks_on_words(prior: Prior, block: PairBlock, texts: list[str]) -> list[str]:
    """Say how the words were read, and which of them neither the prior nor the block has learned; and give the lines.

    Of a block whose file has no table of what it knows nothing is said.
    """

    return _printed([one.line for one in remarks_on_two(texts, block.known, prior.known, prior.text)])


def _printed(lines: list[str]) -> list[str]:
    for line in lines:
        print(f"motionloom: {line}", file=sys.stderr)
    return lines


def _caption(arguments: argparse.Namespace, timeline: Timeline | None) -> str:
    if timeline is not None:
        return "; ".join(" ".join(segment.text.split()) for segment in timeline.segments[:20])
    return arguments.text or " and ".join(path.stem for path in _inputs(arguments))


def write_pairs(
    duets: Sequence[list[Motion]],
    files: list[list[Path]],
    manners: list[tuple[float, dict[str, str]]],
    caption: str,
    skin: Target | None,
) -> list[Path]:
    """All files, duet by duet; a person whose motion came from a BVH file keeps its unit and orders."""

    written = []
    for number, duet in enumerate(duets):
        seen: dict[str, int] = {}
        for out in (several[number] for several in files):
            suffix = out.suffix.lower()
            if skin is not None and skin.plays_in(out):
                written.append(skin.save_page([(caption, duet)], out))
                continue
            if suffix not in _single(skin):
                written.append(save_scene(duet, out, names=["first", "second"], captions=[caption] * 2))
                continue
            person = seen.setdefault(suffix, 0)
            seen[suffix] += 1
            if skin is not None:
                written.append(skin.save(duet[person], out, caption=skin.names([caption] * 2)[person]))
            elif suffix == ".bvh":
                unit, orders = manners[person]
                written.append(save_bvh(duet[person], out, order=orders, unit=unit))
            else:
                written.append(save(duet[person], out))
    return written


def _about(arguments: argparse.Namespace, count: int, seconds: float) -> dict[str, Any]:
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
