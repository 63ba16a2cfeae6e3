"""Training clips of people who move in a manner (`data.manners`): the same recordings, limping, marching, sneaking."""

import re
from collections.abc import Iterator, Sequence

import numpy as np

from motionloom.core.features import humanml as hml
from motionloom.core.features.layout import FPS
from motionloom.kinematics import physics as ph
from motionloom.kinematics.physics import Array
from motionloom_train.data.actions import PREFIX, side_of
from motionloom_train.data.augment import NO_IDLE, Idle
from motionloom_train.data.clips import MANNER, Clip, Note
from motionloom_train.data.manner_measures import measure
from motionloom_train.data.manners import MANNERS, Manner, put_on
from motionloom_train.data.person import at_origin
from motionloom_train.data.windows import Rule
from motionloom_train.data.words import sentence

BODIES = {"walk": ("walk", "walk slow", "walk fast"), "run": ("jog", "run")}
"""Measured labels of those who walk and run. Those who stand are `augment.Idle`'s."""
STRENGTHS = (0.75, 1.0, 1.3)
SHORTEST, LONGEST, MOST = 60, 160, 200
"""Frames that are taken of a recording, and that a clip has at most."""
STANDS = "somebody"
"""Who it is that stands: stretches of `Idle` have no names."""
_OTHERWISE = re.compile(
    r"skip|hop|leap|box|ball|dribbl|angr|confiden|aggressiv|favor|slid|scrambl|wide|wavy|zombie|crouch|hurt|guard|shoot|hang|drunk|\bold|limp|march|sneak|tired|sad\b|happy|angry|stealth"
    r"|careful|creep|carry|object|uneven|stairs|climb|danc|jump|bow|back|float|levitat|moonwalk|stumbl|sway|swing|strange",
)
"""What a recording has in its name or captions that is in a manner already."""
_JERK = 4000.0
"""Metres per second cubed that no joint of a kept clip exceeds; half of the recordings come to 1,000."""
_SUNK = 0.004
"""Metres by which a kept clip is in the floor at most, on average."""


def person_of(name: str) -> str:
    """Who was recorded in a clip, by its name: CMU's subject number, ACCAD's actor, else the first part of the name."""
    made = re.search(r"_of_(.+?)(_\d+)?$", name)
    if made:
        return made[1]
    name = name.removeprefix("M")
    found = re.match(r"(?:cmu_)?(\d{2,3})_|(accad_[A-Za-z]+\d)_|(acf)_|(ui_m\d+_s\d+)", name)
    return next(part for part in found.groups() if part) if found else name.split("_")[0]


def mannered_clips(clips: Sequence[Clip], count: int, seed: int = 0, idle: Idle = NO_IDLE) -> Iterator[Clip]:
    """People in every manner, at three strengths; training clips of one licence. About a fifteenth of ``count`` each.

    The people take turns, so that a manner is that of many. A clip that does not measure as its manner must is dropped.
    """
    bodies = {on: _bodies(clips, labels) for on, labels in BODIES.items()}
    for order, manner in enumerate(MANNERS.values()):
        rng = np.random.default_rng((seed, order))
        wanted, total = round(count / 15), 0
        for number in range(2 * wanted):
            on = _body_kind(manner, number)
            found = _standing(clips, idle, rng) if on == "stand" else _moving(bodies[on], number + order, rng)
            if total == wanted or found is None:
                continue
            clip, body, person = found
            side = ("right", "left")[number // 2 % 2] if manner.sided and on == "walk" else "right"
            strength = STRENGTHS[int(rng.integers(len(STRENGTHS)))]
            places = put_on(body, manner, fps=FPS, rng=rng, strength=strength, side=side)
            if not shows(manner, places, on):
                continue
            features = hml.encode(at_origin(places[:MOST]), heading="corrected").astype(np.float32)
            notes = (Note(0, len(features), PREFIX + MANNER + manner.name, words_of(manner, on, side, rng)),)
            name = f"manner_{seed}_{manner.name.replace(' ', '_')}_{total:03d}_of_{person}"
            yield Clip(name, clip.source, clip.licence, "train", "made", notes, features, "made")
            total += 1


def _body_kind(manner: Manner, number: int) -> str:
    """What the body does of the clip of this number: mostly what comes first, every fourth what else there is."""
    others = manner.on[1:]
    return others[number // 4 % len(others)] if others and number % 4 == 3 else manner.on[0]


def _bodies(clips: Sequence[Clip], labels: Sequence[str]) -> dict[str, list[tuple[Clip, Note]]]:
    """Recordings in no manner, by person."""
    people: dict[str, list[tuple[Clip, Note]]] = {}
    otherwise = {clip.name for clip in clips if not is_plain(clip)}  # looped ones have no captions
    for clip in clips:
        if clip.split != "train" or clip.way not in ("plain", "looped") or clip.kind == "keyed" or clip.name[0] == "M":
            continue
        if clip.name.split("_looped")[0] in otherwise:
            continue
        for note in clip.notes:
            if note.kind in labels and note.last - note.first >= SHORTEST:
                people.setdefault(person_of(clip.name), []).append((clip, note))
    return people


def is_plain(clip: Clip) -> bool:
    """Whether neither the name nor the captions of a recording say that somebody moves in a manner or does more."""
    return not _OTHERWISE.search(" ".join([clip.name, *(text for note in clip.notes for text in note.texts)]).lower())


def _moving(
    people: dict[str, list[tuple[Clip, Note]]], turn: int, rng: np.random.Generator
) -> tuple[Clip, Array, str] | None:
    """A recording of the person whose turn it is, (frames, 22, 3) metres of it, and the person."""
    if not people:
        return None
    person = sorted(people)[turn % len(people)]
    clip, note = people[person][int(rng.integers(len(people[person])))]
    length = min(note.last - note.first, LONGEST)
    first = note.first + int(rng.integers(note.last - note.first - length + 1))
    return clip, at_origin(clip.positions(first, first + length)), person


def _standing(clips: Sequence[Clip], idle: Idle, rng: np.random.Generator) -> tuple[Clip, Array, str] | None:
    """Somebody who stands and is alive."""
    body = idle.body(int(rng.integers(80, LONGEST)), rng)
    recorded = next((clip for clip in clips if clip.kind == "capture"), None)
    return None if body is None or recorded is None else (recorded, at_origin(body), STANDS)


def is_handed(clip: Clip) -> bool:
    """Whether each hand has a part in the clip's manner that its words do not name: it is not mirrored then."""
    for note in clip.notes:
        manner = MANNERS.get(note.kind.removeprefix(PREFIX + MANNER))
        if manner and (manner.handed or (manner.sided and not side_of(note.texts))):
            return True
    return False


def shows(manner: Manner, places: Array, on: str) -> bool:
    """Whether (frames, 22, 3) metres measure as the manner of who does ``on`` must, and stand on the floor."""
    if len(places) < SHORTEST / 2 or not np.isfinite(places).all() or ph.penetration(places) > _SUNK:
        return False
    if ph.jerk(places, FPS).peak > _JERK:
        return False
    return on != manner.on[0] or Rule("", manner.measures).holds(measure(places, FPS), "")


def words_of(manner: Manner, on: str, side: str, rng: np.random.Generator) -> tuple[str, ...]:
    """Some twenty-five sentences for the manner; of the left leg or hand only what names it, as in `data.sets`."""
    phrases = list(manner.says[on])
    named = [phrase.format(side=side) for phrase in manner.sided] if on == "walk" else []
    if manner.sided and side == "left":
        phrases = named
    texts = [_sentence(phrase, rng) for phrase in [*phrases, *named]]
    if on == manner.on[0] and not (manner.sided and side == "left"):
        texts += manner.lines
    return tuple(dict.fromkeys(texts))


def _sentence(phrase: str, rng: np.random.Generator) -> str:
    """A subject before the phrase, or another form of it where its verb has one: nobody "is being sad"."""
    first = phrase.split()[0].rstrip(",")
    if first.endswith("s") and first != "is":
        return sentence(phrase, rng)
    return f"{('a person', 'a man', 'a woman', 'someone', 'he', 'she')[int(rng.integers(6))]} {phrase}"
