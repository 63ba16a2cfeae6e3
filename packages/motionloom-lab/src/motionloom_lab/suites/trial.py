"""The everyday checks tried on real people: clips that show the action should pass, all others should fail.

Which clips show what is found by their names and captions (``trial_clips.toml``). A few actions were never
recorded on their own; for those, examples are derived from real clips: a part of a clip, one played backwards, or two
joined. Clips that show something so close that either answer is right count neither way. Simple deceivers are tried
beside them: somebody who stands and somebody who walks ahead.
"""

import re
from collections.abc import Iterable, Iterator, Mapping, Sequence
from dataclasses import asdict, dataclass, field
from typing import Any

import numpy as np

from motionloom.core.blending import crossfade, shares
from motionloom.core.features.layout import FPS
from motionloom.core.reading import read_table
from motionloom.core.skeleton import SMPL22
from motionloom.kinematics import physics as ph
from motionloom.kinematics.physics import Array
from motionloom_lab.metrics.everyday.body import Body
from motionloom_lab.metrics.obedience import Check
from motionloom_lab.suites.items import RealClip
from motionloom_train.data.progress import Say, silent

NOTHING = r"(?!)"
LONGEST = round(10 * FPS)
"""Frames of a clip of another action that are judged: as long as the longest motion that is generated at once."""
JOINS = 12
"""Joined examples of one check at the most."""
CAUGHT, WRONG = 0.6, 0.05
"""A sound check passes this share of its examples or more, and this share of other clips or less."""
STANDING, WALKING = r"^(acf_stand|accad_male\d_a1_stand)@", r"^35_\d+@"


@dataclass(frozen=True)
class Examples:
    """How to find, among real clips, examples for one check. Patterns look at ``NAME | caption | caption``, lower
    case."""

    shows: str = NOTHING
    """Clips that show the action from beginning to end."""
    unless: str = NOTHING
    """But not these; they count neither way."""
    like: str = NOTHING
    """Clips that may rightly pass as well; they count neither way."""
    sided: bool = False
    """The action has a side: with left and right exchanged in ``shows``, clips show the opposite, and mirrored they are
    examples."""
    cut: tuple[float, float] | None = None
    """Shares of the time between which an example is judged."""
    backwards: str = NOTHING
    """Clips that show the action when they are played backwards."""
    joined: tuple[str, ...] = ()
    """Clips that show it when one of each pattern follow one another."""


@dataclass
class CheckTally:
    """Passes of one check, ``(passed, tried)`` each."""

    shown: tuple[int, int] = (0, 0)
    """Real clips that show the action; of a sided action also mirrored ones of the other side."""
    made: tuple[int, int] = (0, 0)
    """Examples derived from real clips: backwards or joined."""
    opposite: tuple[int, int] = (0, 0)
    """Clips of a sided action, done on the other side."""
    others: tuple[int, int] = (0, 0)
    """Clips of other actions."""
    stands: bool = False
    """Somebody who stands passes."""
    walks: bool = False
    """Somebody who walks ahead passes."""
    missed: list[str] = field(default_factory=list)
    """Examples that fail, with the limits they break."""
    slipped: list[str] = field(default_factory=list)
    """Clips of other actions that pass."""

    @property
    def caught(self) -> float:
        """Share of all examples that pass."""
        passed, tried = (sum(pair) for pair in zip(self.shown, self.made, strict=True))
        return passed / max(1, tried)

    @property
    def wrong(self) -> float:
        """Share of the clips of other actions that pass."""
        return self.others[0] / max(1, self.others[1])

    def doubts(self) -> list[str]:
        """Why this check should not be trusted, in a few words each; empty where it may be.

        It should pass on 60 % of the examples, on at most 5 % of other actions, on no clip of the other side, and on
        nobody who stands or walks; a check without any example, or without other clips that fail, is none.
        """
        passed, tried = (a + b for a, b in zip(self.shown, self.made, strict=True))
        why = ["no example"] if not tried else []
        why += [f"misses {tried - passed} of {tried} examples"] if tried and self.caught < CAUGHT else []
        why += ["nothing to fail on"] if self.others[0] == self.others[1] else []
        why += [f"{self.wrong:.1%} of other clips pass"] if self.wrong > WRONG else []
        why += [f"{self.opposite[0]} of the other side pass"] if self.opposite[0] else []
        return [*why, *(["standing passes"] if self.stands else []), *(["walking passes"] if self.walks else [])]


def text_of(clip: RealClip) -> str:
    """What patterns look at: the clip's name and its captions."""
    return " | ".join((clip.name, *clip.captions)).lower()


def exchanged(pattern: str) -> str:
    """A pattern with left and right, and their short forms at the end of names, exchanged."""
    return re.sub(r"left|right", lambda m: "right" if m[0] == "left" else "left", pattern)


def mirrored(positions: Array) -> Array:
    """The person with left and right exchanged: (frames, 22, 3)."""
    return positions[:, list(SMPL22.mirror_pairs())] * [-1.0, 1.0, 1.0]


def on_the_floor(positions: Array) -> Array:
    """A real clip with its floor at y = 0 where it lies too low: recordings and retargeted people are up to 17 cm off.

    So that nobody sinks in is not tried on real clips; that nobody floats is.
    """
    low = float(np.percentile(np.asarray(positions)[..., 1].min(axis=1), 25))
    return positions - np.array([0.0, min(low, 0.0), 0.0])


def joined(parts: Sequence[Array], *, blend: int = 6) -> Array:
    """Clips one after the other, each from where the last one ends and faces, the poses between blended over frames."""
    whole = np.asarray(parts[0], dtype=np.float64)
    for part in parts[1:]:
        turn = float(ph.heading(whole)[-1] - ph.heading(part)[0])
        here = ph.turned(part - part[0, 0] * [1.0, 0.0, 1.0], -turn)
        here = here + whole[-1, 0] * [1.0, 0.0, 1.0]
        bridge = crossfade(whole[-1], here[0], shares(blend)[:, None, None])
        whole = np.concatenate([whole, bridge, here])
    return whole


def examples(trial: Examples, clips: Sequence[RealClip]) -> Iterator[tuple[str, str, Array]]:
    """``(kind, name, positions)``: kinds are ``shown``, ``made`` and ``opposite``."""
    away = exchanged(trial.shows) if trial.sided else NOTHING
    for clip in clips:
        text, whole = text_of(clip), on_the_floor(clip.positions)
        if re.search(trial.unless, text):
            continue
        shows, opposes = (bool(re.search(pattern, text)) for pattern in (trial.shows, away))
        if trial.sided and shows and opposes:
            continue
        part = _cut(whole, trial.cut)
        if shows:
            yield "shown", clip.name, part
            if trial.sided:
                yield "opposite", f"{clip.name}, mirrored", mirrored(part)
        if opposes:
            yield "shown", f"{clip.name}, mirrored", mirrored(part)
            yield "opposite", clip.name, part
        if re.search(trial.backwards, text):
            yield "made", f"{clip.name}, backwards", whole[::-1]
    yield from _joins(trial, clips)


def _joins(trial: Examples, clips: Sequence[RealClip]) -> Iterator[tuple[str, str, Array]]:
    if not trial.joined:
        return
    rows = [[c for c in clips if re.search(pattern, text_of(c))] for pattern in trial.joined]
    for k in range(min(JOINS, max(map(len, rows))) if all(rows) else 0):
        # odd strides, so that more than the first few of a long list are seen
        chosen = [row[(k * (7 * i + 5)) % len(row)] for i, row in enumerate(rows)]
        name = " + ".join(c.name for c in chosen)
        yield "made", name, joined([on_the_floor(c.positions)[: round(6 * FPS)] for c in chosen])


def _cut(positions: Array, cut: tuple[float, float] | None) -> Array:
    if cut is None:
        return positions
    first, last = (round(share * len(positions)) for share in cut)
    return positions[first:last]


def others(trial: Examples, clips: Iterable[RealClip]) -> Iterator[RealClip]:
    """Clips of other actions."""
    away = exchanged(trial.shows) if trial.sided else NOTHING
    near = f"(?:{trial.shows})|(?:{away})|(?:{trial.unless})|(?:{trial.like})|(?:{trial.backwards})"
    for clip in clips:
        if clip.captions and not re.search(near, text_of(clip)):
            yield clip


def standing_and_walking(clips: Sequence[RealClip], seconds: float) -> tuple[Array | None, Array | None]:
    """Two deceivers out of real clips: the first frame of somebody who stands, held; a walk ahead of middling pace."""
    frames = round(seconds * FPS)
    still = next((c for c in clips if re.search(STANDING, text_of(c))), None)
    walkers = sorted(
        (c for c in clips if re.search(WALKING, text_of(c))), key=lambda c: ph.speed(c.positions, FPS).mean()
    )
    walks = walkers[len(walkers) // 2] if walkers else None
    return (
        None if still is None else np.repeat(still.positions[:1], frames, axis=0),
        None if walks is None else walks.positions[:frames],
    )


def tried(
    checks: Sequence[Check],
    trials: Mapping[str, Examples],
    clips: Sequence[RealClip],
    *,
    progress: Say = silent,
) -> dict[str, CheckTally]:
    """Every check on all clips.

    Args:
        checks: the checks; each needs its trial.
        trials: how to find examples, by the name of the check.
        clips: real clips at 20 frames per second on the uniform person.
        progress: called with a line now and then.
    """
    bodies = {id(clip): Body(on_the_floor(clip.positions[:LONGEST]), FPS) for clip in clips}
    tallies: dict[str, CheckTally] = {}
    for check in checks:
        trial = trials[check.name]
        tally = tallies[check.name] = CheckTally()
        for kind, name, positions in examples(trial, clips):
            numbers = check.measured(positions, FPS)
            ok = check.obeyed(numbers)
            passed, count = getattr(tally, kind)
            setattr(tally, kind, (passed + ok, count + 1))
            if not ok and kind != "opposite":
                broken = (f"{bound.measure} {numbers[bound.measure]:g}" for bound in check.failed(numbers))
                tally.missed.append(f"{name}: {', '.join(broken)}")
            if ok and kind == "opposite":
                tally.slipped.append(f"{name} (the other side)")
        wrong = [(c, check.obeyed(check.of(bodies[id(c)]))) for c in others(trial, clips)]
        tally.others = (sum(ok for _, ok in wrong), len(wrong))
        tally.slipped += [clip.name for clip, ok in wrong if ok]
        still, walks = standing_and_walking(clips, check.seconds)
        tally.stands = still is not None and check.obeyed(check.measured(still, FPS))
        tally.walks = walks is not None and check.obeyed(check.measured(walks, FPS))
        progress(f"{check.name}: {tally.shown} shown, {tally.made} made, {tally.others} others")
    return tallies


def table(tallies: Mapping[str, CheckTally]) -> list[list[str]]:
    """Rows of text, the heading first: check, passes of each kind as ``passed/tried``, and what is to be doubted."""
    rows = [["check", "real", "made of real", "other side", "other actions", "wrong", "doubts"]]
    for name, tally in tallies.items():
        pairs = (tally.shown, tally.made, tally.opposite, tally.others)
        counts = [f"{passed}/{tried}" if tried else "" for passed, tried in pairs]
        rows.append([name, *counts, f"{tally.wrong:.1%}", "; ".join(tally.doubts())])
    return rows


def summary(tallies: Mapping[str, CheckTally]) -> dict[str, Any]:
    """Everything as plain data for JSON, with the names of the clips that were judged wrongly."""
    return {
        name: {
            **asdict(tally),
            "caught": round(tally.caught, 3),
            "wrong": round(tally.wrong, 4),
            "doubts": tally.doubts(),
        }
        for name, tally in tallies.items()
    }


def trials() -> dict[str, Examples]:
    """How to find examples, by the name of the check."""
    rows = read_table("motionloom_lab.suites", "trial_clips.toml")
    words = {f"@{name}": "|".join(items) for name, items in rows.pop("words").items()}
    return {name: _trial(entry, words) for name, entry in rows.items()}


def _trial(entry: dict[str, Any], words: dict[str, str]) -> Examples:
    def pattern(items: list[str]) -> str:
        return "|".join(words.get(item, item) for item in items) or NOTHING

    cut = entry.get("cut")
    return Examples(
        **{name: pattern(entry.get(name, [])) for name in ("shows", "unless", "like", "backwards")},
        sided=entry.get("sided", False),
        cut=None if cut is None else (cut[0], cut[1]),
        joined=tuple(pattern(item.split(" or ")) for item in entry.get("joined", [])),
    )
