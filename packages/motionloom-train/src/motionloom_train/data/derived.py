"""Training clips derived from others: short changes held, actions joined, gestures, arms of one on another's walk."""

from collections.abc import Iterator, Sequence
from dataclasses import replace

import numpy as np

from motionloom.core.features import humanml as hml
from motionloom.core.features.layout import FPS, LAYOUT
from motionloom.kinematics import physics as ph
from motionloom.kinematics.physics import Array
from motionloom_train.data import augment
from motionloom_train.data.actions import ACTIONS, PREFIX, Action, sentences, side_of, turned_to
from motionloom_train.data.augment import Idle
from motionloom_train.data.clips import GESTURE, SHORTEST, THEN, Clip, Note
from motionloom_train.data.made import GESTURES, Gesture, hands_up, lower_arms, perform, words_for
from motionloom_train.data.person import at_origin
from motionloom_train.data.postures import assume, postures
from motionloom_train.data.words import POSTURES, sentence

LOOPED = 200
"""Frames that a cycle is repeated to."""
BRIEFLY = 20
"""Frames for which a pose is held in which nobody stays."""
LYING = 80
"""Frames, at least, for which somebody stays who has lain down."""
GESTURING = 80
"""Least frames of a recording that a gesture is added to."""
SEATED = ("sit down", "stand up", "sit down and stand up")


def looped(clip: Clip) -> Iterator[Clip]:
    """Short cycles and exercises of a recorded clip that go on."""
    for note in _actions(clip):
        if _is_cycle(note):
            longer = augment.loop(clip.features[note.first : note.last], LOOPED, limit=0.12)
            if longer is not None:
                yield _derived(clip, longer, "looped", (replace(note, first=0, last=len(longer), core=None),))


def held_clips(clips: Sequence[Clip], idle: Idle) -> Iterator[Clip]:
    """Short examples of an action at the lengths that people request: somebody stands, or stays, before and after.

    clips: of one licence; of the recorded ones for training. What runs backwards as another action (sitting down as
    standing up) does so too.
    """
    for clip in clips:
        if clip.way != "plain" or clip.split != "train" or clip.name.startswith("M"):
            continue
        positions = clip.positions()
        seed = int.from_bytes(clip.name.encode(), "little") % 2**32
        total = 0
        for number, note in enumerate(_actions(clip)):
            for longer in _held_ways(clip, note, positions, seed=seed + 2 * number, idle=idle):
                yield replace(longer, name=f"held_{total}_{clip.name}")
                total += 1


def _actions(clip: Clip) -> list[Note]:
    return [n for n in clip.notes if n.kind.startswith(PREFIX) and n.last - n.first <= LOOPED - 40]


def _is_cycle(note: Note) -> bool:
    return ACTIONS[note.kind.removeprefix(PREFIX)].kind in ("cycle", "repeats") and note.last - note.first < 160


def _held_ways(clip: Clip, note: Note, positions: Array, *, seed: int, idle: Idle) -> Iterator[Clip]:
    if _is_cycle(note) and augment.loop(clip.features[note.first : note.last], LOOPED, limit=0.12) is not None:
        return
    action = ACTIONS[note.kind.removeprefix(PREFIX)]
    first, last = note.core or (note.first, note.last)
    cut = positions[first : last + 1]
    for reverse in (False, True)[: 1 + bool(action.reverse)]:
        stretch = augment.reversed_in_time(cut) if reverse else cut
        texts = sentences(ACTIONS[action.reverse]) if reverse else note.texts
        name = action.reverse if reverse else action.name
        if name in SEATED and hands_up(stretch):
            stretch, texts = lower_arms(stretch), sentences(ACTIONS[name])
        yield from _held(clip, stretch, PREFIX + name, texts, seed=seed + reverse, idle=idle)


def _held(
    clip: Clip, stretch: Array, kind: str, texts: tuple[str, ...], *, seed: int, idle: Idle = augment.NO_IDLE
) -> Iterator[Clip]:
    posture = kind.removeprefix(PREFIX) in POSTURES
    fastest = 1.2 if posture else 0.45
    start, end = (augment.can_hold(stretch, FPS, end=at_end, fastest=fastest) for at_end in (False, True))
    if not (start or end) or len(stretch) < SHORTEST:
        return
    rng = np.random.default_rng(seed)
    room = max(150 - len(stretch), 30)
    before = int(rng.integers(8, min(55, room))) if start else 0
    lies = kind == PREFIX + "lie down"
    after = max(room - before, LYING if lies else 25) if end else 0
    if not posture:  # nobody stays in the middle of a movement
        before = before if augment.stands_on(stretch[0], idle) else min(before, BRIEFLY)
        after = after if augment.stands_on(stretch[-1], idle) else min(after, BRIEFLY)
    longer = augment.with_pauses(stretch, before, after, fps=FPS, seed=seed, idle=idle)
    features = hml.encode(at_origin(hml.uniform(longer)), heading="corrected")
    whole = (max(before - 3, 0), min(before + len(stretch) + 2, len(features)))
    low = {"lie down": stretch[-1], "get up": stretch[0]}.get(kind.removeprefix(PREFIX))
    if low is not None and not faces_up(low):
        texts = tuple(text for text in texts if "the back" not in text) or sentences(ACTIONS[kind.removeprefix(PREFIX)])
    notes = [Note(0, len(features), kind, texts, whole)]
    if lies and len(features) - whole[1] >= SHORTEST and faces_up(stretch[-1]):
        notes.append(Note(whole[1], len(features), PREFIX + "lie", sentences(ACTIONS["lie"])))
    yield _derived(clip, features, "held", tuple(notes))


def faces_up(pose: Array) -> bool:
    """Whether the chest of a pose (22, 3) in metres points up, as on somebody who lies on the back."""
    front = np.cross(pose[16] - pose[17], pose[12] - pose[0])
    return bool(front[1] > 0.6 * np.linalg.norm(front))


def _derived(clip: Clip, features: np.ndarray, way: str, notes: tuple[Note, ...]) -> Clip:
    return replace(clip, name=f"{clip.name}_{way}", way=way, notes=notes, features=features.astype(np.float32))


def laid_down(clips: Sequence[Clip], count: int, seed: int = 0, idle: Idle = augment.NO_IDLE) -> Iterator[Clip]:
    """From standing to lying, out of a crouch and of lying down from one, and the same film backwards: getting up."""
    pool = _by_action(clips)
    crouches, lies = (
        [one for one in pool.get(name, ()) if one[0].way == "plain"] for name in ("crouch", "crouch to lie")
    )
    rng, total = np.random.default_rng(seed), 0
    pairs = [(a, b) for a in crouches for b in lies]
    for number in rng.permutation(len(pairs)):
        if total >= count:
            return
        first, second = (_core_positions(clip, note, rng) for clip, note in pairs[number])
        first = first[: int(first[:, 0, 1].argmin()) + 1]
        both = augment.joined(first, second, blend=14, limit=0.3)
        if both is None or not 30 <= len(both) <= 180:
            continue
        clip = pairs[number][1][0]
        for name, stretch in (("lie down", both), ("get up", augment.reversed_in_time(both))):
            texts = sentences(ACTIONS[name])
            for longer in _held(clip, stretch, PREFIX + name, texts, seed=seed * 100_003 + int(number), idle=idle):
                yield replace(longer, name=f"joined_{seed}_{name.replace(' ', '_')}{total}", way="joined")
        total += 1


def sat_and_risen(clips: Sequence[Clip], count: int, seed: int = 0, idle: Idle = augment.NO_IDLE) -> Iterator[Clip]:
    """A seat taken and left again: sitting down, a moment on the seat, and the same film backwards.

    Recordings hold several of them in a row. At most ``count``; training clips of one licence.
    """
    rng, total = np.random.default_rng(seed), 0
    for number, (clip, note) in enumerate(_by_action(clips).get("sit down", [])):
        if total >= count or clip.way != "plain":
            continue
        first, last = note.core or (note.first, note.last)
        stretch = clip.positions(first, last)
        stretch = lower_arms(stretch) if hands_up(stretch) else stretch
        if not (28 <= len(stretch) <= 60 and augment.can_hold(stretch, FPS, end=True, fastest=1.2)):
            continue
        sat = augment.with_pauses(stretch, 0, int(rng.integers(12, 24)), fps=FPS, seed=seed * 100_003 + number)
        both = augment.joined(sat, augment.reversed_in_time(stretch), limit=0.3)
        if both is None:
            continue
        texts = sentences(ACTIONS["sit down and stand up"])
        kind = PREFIX + "sit down and stand up"
        for longer in _held(clip, both, kind, texts, seed=seed * 100_003 + number, idle=idle):
            yield replace(longer, name=f"joined_{seed}_sat{total}", way="joined")
            total += 1


def joined_clips(clips: Sequence[Clip], count: int, seed: int = 0, idle: Idle = augment.NO_IDLE) -> Iterator[Clip]:
    """One action and then another, where the poses in between agree; training clips of one licence."""
    rng = np.random.default_rng(seed)
    pool = _by_action(clips)
    names, total = sorted(pool), 0
    for number in range(60 * count if names else 0):
        if total == count:
            return
        pair = [ACTIONS[names[i]] for i in rng.integers(len(names), size=2)]
        if number % 6 == 0 and {"kick", "punch"} <= pool.keys():  # fighters do both; their guards agree
            pair = [ACTIONS[name] for name in rng.permutation(["kick", "punch"])]
        if pair[0] is pair[1] or not all(action.says for action in pair):
            continue
        picked = [pool[action.name][rng.integers(len(pool[action.name]))] for action in pair]
        parts = [_core_positions(clip, note, rng) for clip, note in picked]
        both = augment.joined(*parts)
        if both is None or not 40 <= len(both) <= 180:
            continue
        first, second = (_phrases(action, note) for action, (_, note) in zip(pair, picked))
        texts = _linked(first, second, rng)
        name = f"joined_{seed}_{total:04d}"
        keyed = "keyed" if any(clip.kind == "keyed" for clip, _ in picked) else "capture"
        base = Clip(
            name, picked[0][0].source, picked[0][0].licence, "train", "joined", (), picked[0][0].features, keyed
        )
        for clip in _held(base, both, PREFIX + THEN, texts, seed=seed * 100_003 + number, idle=idle):
            total += 1
            yield replace(clip, name=name, way="joined")


def _by_action(clips: Sequence[Clip]) -> dict[str, list[tuple[Clip, Note]]]:
    """Training clips and their notes, by the name of the note's action."""
    pool: dict[str, list[tuple[Clip, Note]]] = {}
    for clip in clips:
        for note in clip.notes:
            if note.kind.startswith(PREFIX) and clip.split == "train" and clip.way in ("plain", "held"):
                pool.setdefault(note.kind.removeprefix(PREFIX), []).append((clip, note))
    return pool


def _linked(first: Sequence[str], second: Sequence[str], rng: np.random.Generator) -> tuple[str, ...]:
    """Sentences of one action and then another, each with new random phrases."""
    texts = []
    for link in ("and then", "and", "then"):
        a, b = rng.choice(first), rng.choice(second)
        texts.append(sentence(f"{a} {link} {b}", rng))
    return tuple(texts)


def _phrases(action: Action, note: Note) -> list[str]:
    side = side_of(note.texts)
    return [*action.says, *(phrase.format(side=side) for phrase in action.sided if side)]


def _core_positions(clip: Clip, note: Note, rng: np.random.Generator) -> Array:
    first, last = note.core or (note.first, note.last)
    if note.core is None and last - first > 70:
        first += int(rng.integers(last - first - 60))
        last = first + 60
    return clip.positions(first, last)


def made_clips(clips: Sequence[Clip], count: int, seed: int = 0, idle: Idle = augment.NO_IDLE) -> Iterator[Clip]:
    """Gestures of the arms (`data.made`) on people who stand, sit, walk or have just stopped walking; training clips of
    one licence."""
    rng = np.random.default_rng(seed)
    bodies = _labelled(clips, ("stand", "walk", "sit"))
    bodies["walk"] = [(clip, note) for clip, note in bodies.get("walk", []) if note.last - note.first >= GESTURING]
    bodies["stop"] = [(clip, note) for clip, note in _by_action(clips).get("stop walking", []) if note.core]
    usual = [k for k in ("stand", "stand", "stand", "stand", "walk", "walk", "sit", "stop") if bodies.get(k)]
    for number in range(count if bodies.get("stand") else 0):
        gesture = GESTURES[sorted(GESTURES)[number % len(GESTURES)]]
        where = str(rng.choice(usual))
        where = "stand" if gesture.times else gesture.on if bodies.get(gesture.on) else where
        if where == "stop":  # what people walk up for
            gesture = GESTURES[str(rng.choice(GREETINGS))]
        below, note = bodies[where][rng.integers(len(bodies[where]))]
        side = str(rng.choice(["left", "right"]))
        body, begin = _gesturing(below, note, gesture, where, seed=seed * 100_003 + number, idle=idle, rng=rng)
        positions = perform(body, gesture, side, fps=FPS, begin=begin, rng=rng)
        features = hml.encode(positions, heading="corrected")
        texts = words_for(gesture, side, "" if gesture.on == where else LEADS[where], rng)
        if where == "stop":  # of the left hand only what names it, as in `data.sets`
            texts = tuple(t for t in texts if gesture.hands == "both" or side == "right" or "left" in t)
        if texts:
            first = max(0, round(FPS * begin))
            end = min(first + 30 * max(1, gesture.times), len(features))
            core, group = (first, end), PREFIX + GESTURE + gesture.name
            if gesture.on == where:
                core = (0, min(60, len(features)))
            elif where == "stop":
                core, group = (max(0, first - 25), end), PREFIX + GESTURE + STOPPED
            notes = (Note(0, len(features), group, texts, core),)
            yield Clip(
                f"made_{seed}_{number:04d}", below.source, below.licence, "train", "made", notes, features, "made"
            )


LEADS = {"stand": "", "walk": "walks", "sit": "sits", "stop": "walks up, stops"}
"""Words for the body before the gesture."""
GREETINGS = ("wave", "wave", "wave", "wave both", "point", "salute", "clap")
STOPPED = "behind a walk"
"""The group of gestures of people who have just stopped."""


def _gesturing(
    below: Clip, note: Note, gesture: Gesture, where: str, *, seed: int, idle: Idle, rng: np.random.Generator
) -> tuple[Array, float]:
    """The body (frames, 22, 3) metres to which a gesture is added, and the second at which it begins."""
    frames = int(rng.integers(GESTURING, 160))
    length = min(note.last - note.first, frames)
    first = note.first + int(rng.integers(note.last - note.first - length + 1))
    begin = -1.0 if gesture.on == where else float(rng.uniform(0.8, 1.0))
    if where == "stop":
        assert note.core
        first = max(note.first, note.core[1] - 70)
        length = min(note.core[1] + 25, note.last) - first
        begin = (note.core[1] - first) / FPS
    alive = idle.body(frames, rng) if where == "stand" else None
    body = below.positions(first, first + length)
    body = at_origin(body if alive is None else alive)
    if where == "stand" and alive is None and rng.random() < 0.7:
        body = lower_arms(body)
    needed = max(round(FPS * (begin + 1.5 * gesture.times)), 0 if where == "walk" else GESTURING)
    needed = max(needed, round(FPS * begin) + 60) if where == "stop" else needed
    if needed > len(body):
        body = augment.with_pauses(body, 0, needed - len(body), fps=FPS, seed=seed, idle=idle)
    return body, begin


def mixed_clips(clips: Sequence[Clip], count: int, seed: int = 0, idle: Idle = augment.NO_IDLE) -> Iterator[Clip]:
    """Arms of a gesture on the body of a gait, both from training clips of one licence."""
    rng = np.random.default_rng(seed)
    bodies = _labelled(
        clips,
        ("walk", "walk slow", "jog", "walk backward", "circle left", "circle right", "sidestep left", "sidestep right"),
    )
    arms = _labelled(clips, ("wave", "arms up", "punch"))
    for number in range(count if bodies and arms else 0):
        body_label, gesture = rng.choice(sorted(bodies)), rng.choice(sorted(arms))
        below, note = bodies[body_label][rng.integers(len(bodies[body_label]))]
        above, gesture_note = arms[gesture][rng.integers(len(arms[gesture]))]
        if below.licence != above.licence:
            continue
        worn = augment.wear_arms(
            below.positions(note.first, note.last), above.positions(gesture_note.first, gesture_note.last)
        )
        features = hml.encode(worn, heading="corrected")
        features[:, LAYOUT["root_height"]] = below.features[
            note.first : note.first + len(features), LAYOUT["root_height"]
        ]
        yield Clip(
            f"mixed_{seed}_{number:04d}",
            below.source,
            below.licence,
            "train",
            "mixed",
            (Note(0, len(features), f"{body_label}+{gesture}"),),
            features,
        )


def _labelled(clips: Sequence[Clip], labels: Sequence[str]) -> dict[str, list[tuple[Clip, Note]]]:
    pool: dict[str, list[tuple[Clip, Note]]] = {}
    for clip in clips:
        for note in clip.notes:
            if note.kind in labels and clip.split == "train" and note.last - note.first >= 50:
                pool.setdefault(note.kind, []).append((clip, note))
    return pool


def posture_clips(clips: Sequence[Clip], count: int, seed: int = 0, idle: Idle = augment.NO_IDLE) -> Iterator[Clip]:
    """Changes of the whole body (`data.postures`) on people who stand with hanging arms; training clips of one licence.

    A tenth of ``count`` of each posture.
    """
    rng = np.random.default_rng(seed)
    bodies = [pair for pair in _labelled(clips, ("stand",)).get("stand", []) if _stands_plainly(*pair)]
    for number in range(round(count / 10) if bodies else 0):
        below, note = bodies[rng.integers(len(bodies))]
        body = idle.body(LOOPED, rng)
        if body is None:
            body = below.positions(note.first, note.first + 60)
            if rng.random() < 0.7:
                body = lower_arms(body)
        body = augment.with_pauses(
            body, 0, max(0, LOOPED - len(body)), fps=FPS, seed=seed * 100_003 + number, idle=idle
        )
        for kind, posture in enumerate(postures(body, rng)):
            begin = float(rng.uniform(0.8, 1.0))
            frames = min(len(body), round(FPS * (begin + posture.seconds(stay=float(rng.uniform(1.5, 4.0))))))
            stretch = assume(body[:frames], posture, fps=FPS, begin=begin)
            if posture.arms_out:
                stretch = perform(stretch, GESTURES["arms out"], "", fps=FPS, begin=begin, rng=rng)
            features = hml.encode(at_origin(stretch), heading="corrected")
            action = ACTIONS[posture.action]
            texts = sentences(action, side=posture.side)
            lasts = 2.0 if action.kind == "cycle" else posture.seconds(stay=0.5)
            start, end = round(FPS * begin), min(round(FPS * (begin + lasts)), len(features))
            whole = None if action.kind == "repeats" else (start, end)
            notes = (Note(0, len(features), PREFIX + action.name, texts, whole),)
            name = f"posture_{seed}_{number:03d}{kind}"
            yield Clip(name, below.source, below.licence, "train", "made", notes, features.astype(np.float32), "made")


def _stands_plainly(clip: Clip, note: Note) -> bool:
    """Both feet side by side and both hands down."""
    if clip.way not in ("plain", "held"):
        return False
    p = ph.in_body(clip.positions(note.first, note.first + 60))
    step = np.abs(p[:, 7, 2] - p[:, 8, 2]).max()
    return bool(step < 0.12 and p[:, [20, 21], 1].max() < p[:, 6, 1].min() and p[..., 1].min() > -0.02)


def there_and_back(clips: Sequence[Clip], count: int, seed: int = 0, idle: Idle = augment.NO_IDLE) -> Iterator[Clip]:
    """Walks that turn right round and come back: a walk, somebody's turn, another walk; training clips of one licence.

    Recordings hold only a few. A tenth of ``count``.
    """
    rng = np.random.default_rng(seed)
    walks = _labelled(clips, ("walk",)).get("walk", [])
    walks = [(clip, note) for clip, note in walks if clip.way in ("plain", "looped")]
    turns = [turn for clip in clips for turn in _half_turns(clip)]
    action, total = ACTIONS["walk turn around"], 0
    for _ in range(4 * count if walks and turns else 0):
        if total == round(count / 10):
            return
        base, turn = turns[rng.integers(len(turns))]
        ends = [_walk(*walks[rng.integers(len(walks))], rng) for _ in range(2)]
        cut = _alike(ends[0], turn[0], 45, len(ends[0]))
        whole = _between(ends[0][:cut], turn, ends[1])
        if whole is None or not 80 <= len(whole) <= 196 or np.ptp(whole[:, 0, 1]) > 0.15:
            continue
        features = hml.encode(at_origin(whole), heading="corrected").astype(np.float32)
        turns_at = (max(0, cut - 32), len(features))  # about 2.4 s into every window
        texts = sentences(action, side=turned_to(whole))
        notes = (Note(0, len(features), PREFIX + action.name, texts, turns_at),)
        yield replace(base, name=f"there_{seed}_{total:03d}", way="joined", notes=notes, features=features)
        total += 1


def _walk(clip: Clip, note: Note, rng: np.random.Generator) -> Array:
    length = min(note.last - note.first, 80)
    first = note.first + int(rng.integers(note.last - note.first - length + 1))
    return clip.positions(first, first + length)


def _half_turns(clip: Clip) -> Iterator[tuple[Clip, Array]]:
    """Stretches of a training recording within which somebody who walks turns right round and walks on."""
    if clip.split != "train" or clip.way != "plain" or not any(n.kind.startswith("walk turn back") for n in clip.notes):
        return
    p = clip.positions()
    heading = np.degrees(ph.smooth(np.unwrap(ph.heading(p)), 21))
    for length in (30, 40, 50, 60):
        for first in range(15, len(p) - length - 15, 8):
            end = first + length
            turned = heading[end] - heading[first]
            aside = max(abs(heading[first] - heading[first - 15]), abs(heading[end + 14] - heading[end]))
            upright = p[first:end, 0, 1].min() > 0.75
            paces = (ph.speed(p[a : a + 15], FPS).mean() for a in (first - 15, end))
            if 160 < abs(turned) < 200 and aside < 20 and upright and min(paces) > 0.5:
                yield clip, p[first - 8 : end + 8]
                return


def _between(first: Array, middle: Array, last: Array) -> Array | None:
    """``middle`` behind ``first``, and ``last`` from where its pose is most like the end of ``middle``."""
    both = augment.joined(first, middle)
    if both is None:
        return None
    return augment.joined(both, last[_alike(last, middle[-1], 0, len(last) - 25) :])


def _alike(p: Array, pose: Array, low: int, high: int) -> int:
    """The frame of ``p`` from ``low`` to before ``high`` whose pose is most like ``pose`` (22, 3), seen from itself."""
    own = ph.in_body(p)
    other = ph.in_body(np.stack([pose, pose]))[0]
    gap = np.sqrt(((own - other) ** 2).sum(-1).mean(-1))[low : max(high, low + 1)]
    return low + int(gap.argmin())
