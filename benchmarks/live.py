"""Every figure of a live motion: what it costs, how soon it obeys, how it looks beside `compose`, what it survives.

    python benchmarks/live.py [PART ...] [--seeds 10] [--minutes 10 | --hours 4] [--out benchmarks/live.json]

Parts: words, steering, speed, pair, latency, abuse. `words` and `steering` count frames and look at no clock; the
others must have the machine for themselves. ``--minutes`` is of what is shown in `speed` and `pair`, of the clock in
`latency` and `abuse`; ``--seeds`` counts sessions of `words` and `steering`. Clients of `latency` and `abuse` are in
memory: what they see has gone through all of the server but its sockets.
"""

import argparse
import asyncio
import json
import random
import statistics
import time
from collections.abc import Callable, Iterator, Mapping, Sequence
from pathlib import Path
from typing import Any

import numpy as np

from motionloom.core.body.feet import planted_feet
from motionloom.core.features.layout import FEET, FPS
from motionloom.core.models.networks.session import threads
from motionloom.core.models.pair import PairBlock
from motionloom.core.models.prior import Prior
from motionloom.goals.segment import Segment
from motionloom.kinematics.physics import speed
from motionloom.live.clock import LATE, WAITING
from motionloom.live.commands import Command, Say, Steer, to_json
from motionloom.live.commands import Path as Way
from motionloom.live.live import Live, motion_of
from motionloom.live.pair import LivePair
from motionloom.live.sessions import Session, Sessions
from motionloom.live.socket import live_session
from motionloom.tasks.long import compose
from motionloom_lab.metrics.obedience import check
from motionloom_lab.metrics.skate import slide
from motionloom_lab.metrics.transitions import mean_jerk

WORDS = ("walk forward", "walk backward", "walk sideways", "run", "jog", "turn left", "turn right", "walk in a circle")
"""The locomotion checks of the obedience suite; a circle has 4 of its 8 seconds and must be half as far round."""
SECONDS = 4.0
SETTLED = 0.5
"""Seconds behind a word after which it is judged once more: what somebody who ran did before does not count there."""
NEAR = 20
"""Frames behind a command that count as its change."""


def words(prior: Prior, seeds: int, minutes: float) -> dict[str, Any]:
    """Eight words of 4 s each in random order, said live and composed: obedience, slide, jerk, speeds of joints."""
    found: dict[str, list[tuple[Sequence[str], np.ndarray]]] = {"live": [], "compose": []}
    for seed in range(seeds):
        order = random.Random(seed).sample(WORDS, len(WORDS))
        found["live"].append((order, _said(prior, order, seed)))
        segments = [Segment(check(name).prompt, SECONDS) for name in order]
        motion = compose(prior, segments, seed=1000 * (seed + 1))
        found["compose"].append((order, motion.positions()))
    result: dict[str, Any] = {"seeds": seeds}
    for kind, sessions in found.items():
        result[kind] = {
            "obeyed": {name: sum(_obeyed(name, order, places) for order, places in sessions) for name in WORDS},
            "obeyed_settled": {
                name: sum(_obeyed(name, order, places, SETTLED) for order, places in sessions) for name in WORDS
            },
            "slide_mm_per_frame": statistics.mean(slide(places) for _, places in sessions),
            "planted_slide_mm_per_frame": statistics.mean(_planted_slide(places) for _, places in sessions),
            "jerk_m_per_frame3": mean_jerk(np.stack([places for _, places in sessions])),
            "speed_999_m_per_s": float(np.percentile(np.stack([_speeds(places) for _, places in sessions]), 99.9)),
        }
    changes = np.concatenate([_near(_speeds(places)) for _, places in found["live"]])
    limit = result["compose"]["speed_999_m_per_s"]
    result["ratios"] = {
        "slide": result["live"]["slide_mm_per_frame"] / result["compose"]["slide_mm_per_frame"],
        "jerk": result["live"]["jerk_m_per_frame3"] / result["compose"]["jerk_m_per_frame3"],
        "speed_999_at_changes": float(np.percentile(changes, 99.9)) / limit,
        "share_at_changes_faster_than_compose_999": float((changes > limit).mean()),
    }
    return result


def _said(prior: Prior, order: Sequence[str], seed: int) -> np.ndarray:
    live, frames = Live(prior, seed=seed), []
    for name in order:
        live.say(check(name).prompt)
        frames += [next(live) for _ in range(round(SECONDS * FPS))]
    return motion_of(frames, FPS).positions()


def _obeyed(name: str, order: Sequence[str], places: np.ndarray, settled: float = 0.0) -> bool:
    """Whether a word is obeyed in its seconds but the first ``settled`` ones; a circle is judged by its pace."""
    count, skipped = round(SECONDS * FPS), round(settled * FPS)
    begin = order.index(name) * count
    asked = check(name)
    measured = asked.measured(places[begin + skipped : begin + count], FPS)
    if name == "walk in a circle":
        measured = {**measured, "winding": measured["winding"] * asked.seconds / (SECONDS - settled)}
    return asked.obeyed(measured)


def _speeds(places: np.ndarray) -> np.ndarray:
    """(frames - 1, 22) m/s."""
    return np.linalg.norm(np.diff(places, axis=0), axis=-1) * FPS


def _near(speeds: np.ndarray) -> np.ndarray:
    count = round(SECONDS * FPS)
    return np.concatenate([speeds[at - 1 : at + NEAR] for at in range(count, len(speeds), count)])


def _planted(places: np.ndarray) -> np.ndarray:
    """(frames - 1, 2) mm that a planted foot moves over the floor in a frame, NaN where it is not (`kinematics.feet`).

    A foot turns about what is planted of it: that are its toes where they are, else its ankle.
    """
    planted = planted_feet(places, FPS).reshape(-1, 2, 2)
    both = planted[1:] & planted[:-1]
    feet = places[:, list(FEET)][..., [0, 2]].reshape(-1, 2, 2, 2)
    steps = 1000 * np.linalg.norm(np.diff(feet, axis=0), axis=-1)
    return np.where(both[..., 1], steps[..., 1], np.where(both[..., 0], steps[..., 0], np.nan))


def _planted_slide(places: np.ndarray) -> float:
    return float(np.nanmean(_planted(places)))


def steering(prior: Prior, seeds: int, minutes: float) -> dict[str, Any]:
    """Frames from a word to running, from a steer to the new way; how a foot that is planted slides meanwhile."""
    running, turns, slides, plain, stood = [], [], [], [], []
    for seed in range(seeds):
        live = Live(prior, seed=seed)
        live.say("a person walks forward")
        before = live.take(50)
        plain.append(_planted_slide(before.positions()))
        live.say("a person runs")
        pace = speed(live.take(60).positions(), FPS)
        running.append(next((k / FPS for k in range(60) if pace[k] > 2.0), float("inf")))
        for pace_asked in (None, 1.3):
            live = Live(prior, seed=seed)
            live.say("a person walks forward")
            live.take(50)
            turn = random.Random(seed).uniform(-np.pi, np.pi)
            live.steer(turn, pace_asked)
            places = live.take(60).positions()
            turns.append(_turned(places, turn))
            slides.append(_planted(places))
            stood.append(_stood(places))
    return {
        "to_running_s": {"median": statistics.median(running), "worst": max(running)},
        "to_the_new_way_s": {"median": statistics.median(turns), "worst": max(turns)},
        "planted_slide_mm_per_frame": {
            "steered": float(np.nanmean(np.concatenate(slides))),
            "walking": statistics.mean(plain),
            "steered_worst": float(np.nanmax(np.concatenate(slides))),
        },
        "standing_foot_moved_mm": {"mean": statistics.mean(stood), "worst": max(stood)},
    }


def _stood(places: np.ndarray) -> float:
    """mm that a foot goes, of those that are planted in the first frames behind a command, until it is lifted."""
    steps, gone = _planted(places), [0.0]
    for foot in steps.T:
        lifted = np.flatnonzero(np.isnan(foot))
        gone.append(float(foot[: lifted[0] if len(lifted) else None].sum()))
    return max(gone)


def _turned(places: np.ndarray, turn: float) -> float:
    """Seconds until the way over 6 frames is within 15 degrees of what is asked."""
    way = places[6:, 0] - places[:-6, 0]
    off = np.abs((np.arctan2(way[:, 0], way[:, 2]) - turn + np.pi) % (2 * np.pi) - np.pi)
    return next((float(k + 3) / FPS for k in range(len(off)) if off[k] < np.radians(15)), float("inf"))


def _random(dice: random.Random) -> Command:
    kind = dice.randrange(4)
    if kind == 0:
        return Say(check(dice.choice(WORDS)).prompt)
    if kind == 1:
        return Steer(dice.uniform(-3.1, 3.1), dice.choice([None, 0.0, 1.2, 2.5]))
    if kind == 2:
        return Way(tuple((dice.uniform(-5, 5), dice.uniform(-5, 5)) for _ in range(3)))
    return Say("")


def _memory() -> float:
    """MB that the process holds now."""
    pages = int(Path("/proc/self/statm").read_text(encoding="ascii").split()[1])
    return pages * 4096 / 1e6


def speed_(prior: Prior, seeds: int, minutes: float) -> dict[str, Any]:
    """Minutes of random commands, one in two seconds, as fast as frames can be made: how much faster than shown."""
    return _made(Live(prior, seed=1), minutes)


def pair(prior: Prior, seeds: int, minutes: float) -> dict[str, Any]:
    """The same with two people, who are asked in turn or both."""
    return _made(LivePair(prior, PairBlock.load("duet", prior), seed=1), minutes)


def _made(live: Live | LivePair, minutes: float) -> dict[str, Any]:
    dice, windows, drawn = random.Random(1), 0, live.window
    count = max(20, round(minutes * 60 * FPS))
    marks: list[float] = []
    begun, busy = time.monotonic(), time.process_time()
    for number in range(count):
        if dice.random() < 1 / (2 * FPS):
            whom = dice.choice([None, 0, 1]) if len(live.people) > 1 else None
            live.ask(_random(dice), whom)
        next(live)
        windows, drawn = windows + (live.window != drawn), live.window
        if (number + 1) % (count // 10) == 0:
            marks.append(round(_memory(), 1))
    return {
        "times_faster": count / FPS / (time.monotonic() - begun),
        "minutes": minutes,
        "commands": len(live.taken),
        "windows": windows,
        "processor_s_per_window": (time.process_time() - busy) / windows,
        "network_calls_per_second_shown": live.calls / (count / FPS),
        "memory_mb_at_each_tenth": marks,
    }


class _Client:
    """The far end of a connection, in memory. It says what ``says`` gives: a text, None for nothing yet, or "GONE"."""

    def __init__(self, says: Callable[[], str | None], *, takes: float = 0.0) -> None:
        """takes: seconds for which it keeps the server waiting with every message."""
        self.says, self.takes = says, takes
        self.numbers: list[int] = []
        self.arrived: list[float] = []
        self.welcome: dict[str, Any] = {}
        self.others: dict[str, int] = {}

    async def accept(self) -> None: ...

    async def receive(self) -> Mapping[str, Any]:
        while (text := self.says()) is None:
            await asyncio.sleep(0.005)
        await asyncio.sleep(0)
        return {"type": "websocket.disconnect"} if text == "GONE" else {"type": "websocket.receive", "text": text}

    async def send_text(self, data: str) -> None:
        await asyncio.sleep(self.takes)
        said = json.loads(data)
        if said["type"] == "frame":
            self.numbers.append(said["frame"])
            self.arrived.append(time.monotonic())
        elif said["type"] == "welcome":
            self.welcome = said
        self.others[said["type"]] = self.others.get(said["type"], 0) + 1

    async def close(self, code: int = 1000, reason: str | None = None) -> None: ...

    def late(self) -> list[float]:
        """Seconds that each frame came after its time by the client's own clock, which waits for a late one."""
        waits, shift = [], self.arrived[0] if self.arrived else 0.0
        for k, arrived in enumerate(self.arrived):
            late = max(0.0, arrived - shift - k / FPS)
            shift += late if late > LATE else 0.0
            waits.append(late)
        return waits

    def whole(self) -> bool:
        """Whether no frame was left out and none came twice."""
        return self.numbers == list(range(self.numbers[0], self.numbers[0] + len(self.numbers)))


def _counted(client: _Client) -> dict[str, Any]:
    late = client.late()
    return {
        "frames": len(late),
        "nothing_lost": client.whole(),
        "late": sum(wait > LATE for wait in late),
        "worst_s": max(late, default=0.0),
        "late_means_s": LATE,
    }


def latency(prior: Prior, seeds: int, minutes: float) -> dict[str, Any]:
    """As a client sees it: late frames, and seconds from a command to the first frame that it changed."""
    sessions, dice = Sessions(lambda: prior), random.Random(2)
    asked: list[float] = []

    def words() -> Iterator[str | None]:
        yield json.dumps({"type": "hello", "seed": 2})
        pause, answered = 40, 0
        while not client.numbers:
            yield None
        end = time.monotonic() + 60 * minutes
        while time.monotonic() < end:
            taken = [one.frame for session in sessions._open.values() for one in session.player.taken]
            if len(taken) == len(asked) and (not taken or len(client.numbers) > taken[-1]):
                answered = answered or len(client.numbers)
                if len(client.numbers) >= answered + pause:
                    pause, answered = dice.randrange(4, 24), 0
                    asked.append(time.monotonic())
                    yield json.dumps(to_json(_random(dice)))
            yield None
        yield "GONE"

    said = words()
    client = _Client(lambda: next(said, "GONE"))
    asyncio.run(live_session(client, sessions))
    (session,) = sessions._open.values()
    first = client.numbers[0]
    taken = [one.frame for one in session.player.taken]
    at = [client.arrived[frame - first] for frame in taken if frame - first < len(client.arrived)]
    waits = sorted(came - when for when, came in zip(asked, at, strict=False))
    health = session.player.health
    sessions.close()
    if not waits:
        raise SystemExit("no command was answered in this time; give more --minutes")
    return {
        "median_s": statistics.median(waits),
        "p99_s": waits[min(len(waits) - 1, int(0.99 * len(waits)))],
        "commands": len(waits),
        **_counted(client),
        "ahead_s": health.ahead,
        "times_faster": health.times,
        "problem": health.problem,
    }


BEHAVIOUR = ("flood", "rubbish", "slow", "silent", "comes back")


def _bad(kind: str, end: float, hello: dict[str, Any], dice: random.Random) -> Iterator[str | None]:
    """What a client says that behaves badly, until ``end``: commands as fast as they are read, rubbish, nothing."""
    if kind == "silent":
        while time.monotonic() < end:
            yield None
        return
    yield json.dumps(hello)
    while time.monotonic() < end:
        if kind == "flood":
            yield json.dumps({"type": "steer", "direction": dice.randrange(360)})
        elif kind == "rubbish":
            yield dice.choice(["\x00{", "[]", '{"type":"fly"}', '{"type":"say"}', '{"type":"path","points":"x"}'])
        else:
            yield None


def abuse(prior: Prior, seeds: int, minutes: float) -> dict[str, Any]:
    """One client who behaves, and one who floods, says rubbish, takes nothing, says nothing, goes and comes back."""
    Live(prior).take(1)  # what is made once is made before the clock runs
    sessions, end, dice = Sessions(lambda: prior), time.monotonic() + 60 * minutes, random.Random(3)
    said = iter(['{"type":"hello","seed":1}', '{"type":"say","text":"a person walks forward"}'])
    good = _Client(lambda: "GONE" if time.monotonic() > end else next(said, None))
    seen: dict[str, int] = dict.fromkeys(BEHAVIOUR, 0)
    lost, queue, memory, read = 0, [0], [], [0, 0.0]

    async def bad() -> None:
        nonlocal lost
        hello: dict[str, Any] = {"type": "hello", "seed": 2}
        number = -1
        for turn in range(1 << 30):
            if time.monotonic() > end:
                return
            kind = BEHAVIOUR[turn % len(BEHAVIOUR)]
            begun = time.monotonic()
            words = _bad(kind, min(end, begun + dice.uniform(2, 6)), hello, dice)

            def says(words: Iterator[str | None] = words, kind: str = kind) -> str | None:
                text = next(words, "GONE")
                read[0] += kind == "flood" and text not in (None, "GONE")
                return text

            client = _Client(says, takes=0.5 if kind == "slow" else 0.0)
            await live_session(client, sessions)
            read[1] += time.monotonic() - begun if kind == "flood" else 0.0
            seen[kind] += 1
            if client.numbers:  # nothing lost: the session goes on with the next frame
                lost += bool(number >= 0 and hello.get("session") and client.numbers[0] > number + 1)
                lost += not client.whole()
                number = client.numbers[-1]
            if client.welcome:
                hello = {"type": "hello", "session": client.welcome["session"]}
            if kind == "rubbish":  # sent away; the session is kept for it all the same
                await asyncio.sleep(0.2)

    async def look() -> None:
        while time.monotonic() < end:
            open_now: list[Session] = list(sessions._open.values())
            queue[0] = max([queue[0], *(len(session.player._inbox) for session in open_now)])
            memory.append(_memory())
            await asyncio.sleep(max(0.2, 0.6 * minutes))

    async def everybody() -> None:
        await asyncio.gather(live_session(good, sessions), bad(), look())

    asyncio.run(everybody())
    left = len(sessions)
    sessions.close()
    return {
        "minutes": minutes,
        "good": _counted(good),
        "bad_connections": seen,
        "frames_lost_by_the_bad_one": lost,
        "flood_read_per_second": read[0] / max(read[1], 1e-9),
        "longest_queue": queue[0],
        "queue_limit": WAITING,
        "sessions_left": left,
        "memory_mb": [round(mb, 1) for mb in memory[:: max(1, len(memory) // 10)]],
    }


PARTS = {"words": words, "steering": steering, "speed": speed_, "pair": pair, "latency": latency, "abuse": abuse}


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("parts", nargs="*", choices=[*PARTS, []], metavar="PART", help=", ".join(PARTS))
    parser.add_argument("--seeds", type=int, default=10)
    parser.add_argument("--minutes", type=float, default=10.0)
    parser.add_argument("--hours", type=float, help="instead of --minutes, as for a long `abuse`")
    parser.add_argument("--weights", default="default")
    parser.add_argument("--out", type=Path)
    arguments = parser.parse_args()
    minutes = arguments.minutes if arguments.hours is None else 60 * arguments.hours
    prior = Prior.load(arguments.weights)
    result: dict[str, Any] = {"threads": threads()}
    for part in arguments.parts or PARTS:
        result[part] = PARTS[part](prior, arguments.seeds, minutes)
        print(json.dumps({part: result[part]}, indent=1), flush=True)
        if arguments.out:
            arguments.out.write_text(json.dumps(result, indent=1) + "\n", encoding="utf-8")


if __name__ == "__main__":
    main()
