"""Every figure of a live motion: what it costs, how soon it obeys, how it looks beside `compose`, what it survives.

    python benchmarks/live.py [PART ...] [--seeds 10] [--minutes 10] [--out benchmarks/live.json]

Parts: words, steering, speed, latency, abuse. `words` and `steering` count frames and look at no clock; the others must
have the machine for themselves.
"""

import argparse
import asyncio
import json
import random
import resource
import statistics
import time
from collections.abc import Callable, Mapping
from pathlib import Path
from typing import Any

import numpy as np
import torch

from motionloom.errors import MotionloomError
from motionloom.features.layout import FEET, FPS
from motionloom.goals.segment import Segment
from motionloom.kinematics.feet import planted_feet
from motionloom.kinematics.physics import speed
from motionloom.lab.metrics.obedience import check
from motionloom.lab.metrics.skate import slide
from motionloom.lab.metrics.transitions import mean_jerk
from motionloom.live.clock import LATE, Pace, Player
from motionloom.live.commands import Command, Say, Steer
from motionloom.live.commands import Path as Way
from motionloom.live.live import Live, motion_of
from motionloom.live.sessions import Sessions
from motionloom.live.socket import live_session
from motionloom.tasks.long import compose
from motionloom.weights.prior import Prior

WORDS = ("walk forward", "walk backward", "walk sideways", "run", "jog", "turn left", "turn right", "walk in a circle")
"""The locomotion checks of the obedience suite; a circle has 4 of its 8 seconds and must be half as far round."""
SECONDS = 4.0
NEAR = 20
"""Frames behind a command that count as its change."""


def words(prior: Prior, seeds: int, minutes: float) -> dict[str, Any]:
    """Eight words of 4 s each in random order, said live and composed: obedience, slide, jerk, speeds of joints."""
    found: dict[str, list[tuple[list[str], np.ndarray]]] = {"live": [], "compose": []}
    for seed in range(seeds):
        order = random.Random(seed).sample(WORDS, len(WORDS))
        found["live"].append((order, _said(prior, order, seed)))
        segments = [Segment(check(name).prompt, SECONDS) for name in order]
        blocks = compose(prior, segments, seed=1000 * (seed + 1))
        found["compose"].append((order, np.concatenate([block.positions() for block in blocks])))
    result: dict[str, Any] = {"seeds": seeds}
    for kind, sessions in found.items():
        result[kind] = {
            "obeyed": {name: sum(_obeyed(name, order, places) for order, places in sessions) for name in WORDS},
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


def _said(prior: Prior, order: list[str], seed: int) -> np.ndarray:
    live, frames = Live(prior, seed=seed), []
    for name in order:
        live.say(check(name).prompt)
        frames += [next(live) for _ in range(round(SECONDS * FPS))]
    return motion_of(frames, FPS).positions()


def _obeyed(name: str, order: list[str], places: np.ndarray) -> bool:
    count = round(SECONDS * FPS)
    begin = order.index(name) * count
    asked = check(name)
    measured = asked.measured(places[begin : begin + count], FPS)
    if name == "walk in a circle":
        measured = {**measured, "winding": measured["winding"] * asked.seconds / SECONDS}
    return asked.obeyed(measured)


def _speeds(places: np.ndarray) -> np.ndarray:
    """(frames - 1, 22) m/s."""
    return np.linalg.norm(np.diff(places, axis=0), axis=-1) * FPS


def _near(speeds: np.ndarray) -> np.ndarray:
    count = round(SECONDS * FPS)
    return np.concatenate([speeds[at - 1 : at + NEAR] for at in range(count, len(speeds), count)])


def _planted_slide(places: np.ndarray) -> float:
    """mm per frame that a foot moves over the floor while it is planted (`kinematics.feet`)."""
    planted = planted_feet(places, FPS)
    steps = 1000 * np.linalg.norm(np.diff(places[:, list(FEET)][..., [0, 2]], axis=0), axis=-1)
    both = planted[1:] & planted[:-1]
    return float(steps[both].mean())


def steering(prior: Prior, seeds: int, minutes: float) -> dict[str, Any]:
    """Frames from a word to running, from a steer to the new way; how a foot that is planted slides meanwhile."""
    running, turns, slides, plain = [], [], [], []
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
            slides.append(_planted_slide(places))
    return {
        "to_running_s": {"median": statistics.median(running), "worst": max(running)},
        "to_the_new_way_s": {"median": statistics.median(turns), "worst": max(turns)},
        "planted_slide_mm_per_frame": {"steered": statistics.mean(slides), "walking": statistics.mean(plain)},
    }


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


def speed_(prior: Prior, seeds: int, minutes: float) -> dict[str, Any]:
    """Minutes of random commands, one in two seconds, as fast as frames can be made: how much faster than shown."""
    live, dice = Live(prior, seed=1), random.Random(1)
    begun, marks, calls = time.monotonic(), [], 0
    count = round(minutes * 60 * FPS)
    for number in range(count):
        if dice.random() < 1 / (2 * FPS):
            live.ask(_random(dice))
        next(live)
        if number % (count // 5) == count // 10:
            marks.append(resource.getrusage(resource.RUSAGE_SELF).ru_maxrss / 1024)
    calls = live.calls
    return {
        "times_faster": count / FPS / (time.monotonic() - begun),
        "minutes": minutes,
        "network_calls_per_second_shown": calls / (count / FPS),
        "memory_mb": marks,
    }


def latency(prior: Prior, seeds: int, minutes: float) -> dict[str, Any]:
    """Against the clock: late frames, and seconds from a command to the first frame that it changed."""
    live, dice = Live(prior, seed=2), random.Random(2)
    waits, asked, health = [], {}, None
    with Player(live) as player:
        pace, count = Pace(time.monotonic), round(minutes * 60 * FPS)
        next_at, known = 40, 0
        for number in range(count):
            frame = player.take()
            if frame is None:
                raise MotionloomError("the player ended before the benchmark")
            time.sleep(pace.until(frame))
            player.shown(pace.late(frame))
            taken = player.taken
            for at, command in taken[known:]:
                asked[at] = command
            known = len(taken)
            if frame.number in asked and waits and waits[-1] < 0:
                waits[-1] += time.monotonic()
            if number >= next_at:
                next_at = number + dice.randrange(30, 60)
                if not waits or waits[-1] >= 0:
                    waits.append(-time.monotonic())
                    player.ask(_random(dice))
        health = player.health
    done = sorted(wait for wait in waits if wait >= 0)
    return {
        "median_s": statistics.median(done), "p99_s": done[min(len(done) - 1, int(0.99 * len(done)))],
        "commands": len(done), "frames": health.shown, "late": health.late, "worst_s": health.worst,
        "late_means_s": LATE, "ahead_s": health.ahead,
    }  # fmt: skip


class _Pipe:
    """A WebSocket in memory whose client says what a generator gives."""

    def __init__(self, said: Callable[[], str | None]) -> None:
        self.said, self.sent, self.times = said, 0, []

    async def accept(self) -> None: ...

    async def receive(self) -> Mapping[str, Any]:
        text = self.said()
        while text is None:
            await asyncio.sleep(0.05)
            text = self.said()
        return {"type": "websocket.disconnect"} if text == "GONE" else {"type": "websocket.receive", "text": text}

    async def send_text(self, data: str) -> None:
        said = json.loads(data)
        if said["type"] == "frame":
            self.times.append((said["frame"], said["late"]))

    async def close(self, code: int = 1000, reason: str | None = None) -> None: ...


def abuse(prior: Prior, seeds: int, minutes: float) -> dict[str, Any]:
    """One client who behaves, one who floods with 10,000 commands a second, says rubbish, goes and comes back."""
    sessions, end = Sessions(lambda: prior), time.monotonic() + 60 * minutes
    good_said = iter(['{"type":"hello","seed":1}', '{"type":"say","text":"a person walks forward"}'])
    good = _Pipe(lambda: "GONE" if time.monotonic() > end else next(good_said, None))
    came_back = 0

    async def bad() -> None:
        nonlocal came_back
        dice = random.Random(3)
        while time.monotonic() < end:
            stop, first = time.monotonic() + dice.uniform(2, 10), iter(['{"type":"hello","seed":2}'])
            rubbish = dice.random() < 0.5

            def said(stop: float = stop, first: Any = first, rubbish: bool = rubbish) -> str:
                if (hello := next(first, None)) is not None:
                    return hello
                if time.monotonic() > min(stop, end):
                    return "GONE"
                return "\x00{" if rubbish else json.dumps({"type": "steer", "direction": dice.randrange(360)})

            await live_session(_Pipe(said), sessions)
            came_back += 1
            await asyncio.sleep(0.2)

    async def both() -> None:
        await asyncio.gather(live_session(good, sessions), bad())

    asyncio.run(both())
    late = [wait for _, wait in good.times]
    whole = [number for number, _ in good.times] == list(range(len(good.times)))
    most = max(len(session.player._inbox) for session in sessions._open.values()) if len(sessions) else 0
    sessions.close()
    return {
        "minutes": minutes, "frames": len(late), "nothing_lost": whole, "late": sum(wait > LATE for wait in late),
        "worst_s": max(late, default=0.0), "came_back": came_back, "longest_queue": most,
        "memory_mb": resource.getrusage(resource.RUSAGE_SELF).ru_maxrss / 1024,
    }  # fmt: skip


PARTS = {"words": words, "steering": steering, "speed": speed_, "latency": latency, "abuse": abuse}


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("parts", nargs="*", choices=[*PARTS, []], metavar="PART", help=", ".join(PARTS))
    parser.add_argument("--seeds", type=int, default=10)
    parser.add_argument("--minutes", type=float, default=10.0)
    parser.add_argument("--weights", default="default")
    parser.add_argument("--out", type=Path)
    arguments = parser.parse_args()
    prior = Prior.load(arguments.weights)
    result: dict[str, Any] = {"threads": torch.get_num_threads()}
    for part in arguments.parts or PARTS:
        result[part] = PARTS[part](prior, arguments.seeds, arguments.minutes)
        print(json.dumps({part: result[part]}, indent=1), flush=True)
        if arguments.out:
            arguments.out.write_text(json.dumps(result, indent=1) + "\n", encoding="utf-8")


if __name__ == "__main__":
    main()
