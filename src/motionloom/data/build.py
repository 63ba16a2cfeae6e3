"""`motionloom data build`: folders of recordings to one training set of features, captions and splits.

A built set is a folder: ``clips/NAME.safetensors`` (features (frames, 263) float32; the metadata holds captions, split,
source and licence as JSON) and ``set.json`` (counts, mean, std, what was dropped and why). Every clip is written whole
or not at all, so a build that was stopped goes on where it was.
"""

import json
import multiprocessing
import multiprocessing.connection
import os
import re
import signal
import threading
from collections import Counter
from collections.abc import Callable, Iterator, Sequence
from concurrent.futures import ProcessPoolExecutor
from concurrent.futures.process import BrokenProcessPool
from dataclasses import asdict, dataclass, replace
from pathlib import Path

import numpy as np
from safetensors import SafetensorError, safe_open

from motionloom.data import augment
from motionloom.data.actions import ACTIONS, PREFIX, Action, action_of, core, sentences, side_of
from motionloom.data.made import GESTURES, hands_up, lower_arms, perform, words_for
from motionloom.data.sources import Span, Take, find_takes
from motionloom.data.windows import label_clip
from motionloom.data.words import LABELS, mirror_text, sentence
from motionloom.errors import MotionloomError
from motionloom.features import humanml as hml
from motionloom.features.layout import FPS, LAYOUT, WIDTH
from motionloom.io.atomic import atomic_path, finished, sweep
from motionloom.io.tensors import save_tensors
from motionloom.io.text import plain_json
from motionloom.kinematics.physics import Array
from motionloom.skeleton import SMPL22

_DERIVED = re.compile(r"M?(mixed|joined|made)_\d")
_NAME = re.compile(r"\w[\w.+ -]{0,120}")
SHORTEST = 20
LOOPED = 200
BENDS = (0.35, 0.75, 1.0)
"""Radians per second: a wide turn, and circles in 8.4 and 6.3 seconds."""
_MIRROR = list(SMPL22.mirror_pairs())
LONG = 60
"""Frames from which on the part of a described change that matters is looked for."""
POSTURES = ("sit down", "stand up", "sit down and stand up", "lie down", "get up", "kneel", "crouch", "bow", "fall")
"""Actions that end (and begin) in a posture which people keep, though many a recording is cut a moment before."""
SEATED = ("sit down", "stand up", "sit down and stand up")
THEN, MADE = "then", "made "
"""Groups of notes besides those of `data.actions`: one action and then another; gestures of `data.made`."""
STATES = ("walk", "walk slow", "walk fast", "jog", "run", "walk backward", "jog backward", "stand", "dance",
           "circle left", "circle right", "run circle", "balance", "sidestep left", "sidestep right",
          "sit")  # fmt: skip
"""Labels that stay true however long a window of them is: neighbouring windows join."""


@dataclass(frozen=True)
class Note:
    """Frames ``first`` to ``last`` (half-open) of a clip and the words for them."""

    first: int
    last: int
    kind: str
    """``human``, ``index``, ``action:`` and a name of `data.actions`, or the measured label."""
    texts: tuple[str, ...] = ()
    """Sentences or verb phrases; empty for measured labels, whose wordings stand in `data.words`."""
    core: tuple[int, int] | None = None
    """Frames (first, end) of the clip that a training window must hold whole; None: any part shows what is said."""


@dataclass(frozen=True)
class Clip:
    """One entry of a built set."""

    name: str
    source: str
    licence: str
    split: str
    way: str
    """``plain``, ``looped``, ``bent``, ``reversed``, ``held``, ``joined``, ``made`` or ``mixed``; mirrored copies begin
    with M in their name."""
    notes: tuple[Note, ...]
    features: np.ndarray
    """(frames, 263) float32, not standardised."""
    kind: str = "capture"
    """``capture``, ``keyed`` (animated by hand) or ``made`` (arms moved by rule on a recorded body)."""


def at_origin(positions: Array) -> Array:
    """The published canonical start (origin, facing +Z), with the floor left where planted feet say it is."""
    return hml.canonical(positions) + np.array([0.0, positions[..., 1].min(), 0.0])


def clips_of(take: Take) -> Iterator[Clip]:
    """A take as clips: itself, its mirror image, and in training loops and curves of gaits and walks run backwards."""
    read = take.read()
    if not isinstance(read, tuple):  # finished HumanML3D features
        yield from _with_mirror(_clip(take, np.asarray(read, dtype=np.float32), "plain"))
        return
    positions, fps = read
    positions = at_origin(hml.uniform(hml.resample_positions(positions, fps)))
    if len(positions) <= SHORTEST:
        raise MotionloomError(f"only {len(positions) / FPS:.2f} s long; at least {SHORTEST / FPS:.0f} s are needed")
    clip = _clip(take, hml.encode(positions, heading="corrected"), "plain")
    yield from _with_mirror(clip)
    if take.split == "train":
        yield from _more(take, clip, positions)
        for number, longer in enumerate(lengthened(take, clip, positions)):
            yield from _with_mirror(replace(longer, name=f"{longer.name}{number}"))


def _more(take: Take, clip: Clip, positions: Array) -> Iterator[Clip]:
    gait = {"walk", "walk slow", "walk fast", "jog", "run", "circle left", "circle right", "walk left turn",
            "walk right turn", "sidestep left", "sidestep right"}  # fmt: skip
    moves = [note.kind for note in clip.notes if note.kind in gait]
    if not moves:
        return
    longer = augment.loop(clip.features, LOOPED) if len(clip.features) < 160 else clip.features
    if len(clip.features) < 160 and longer is not None:
        yield from _with_mirror(_clip(take, longer, "looped", spans=False))
    if longer is not None and moves[0] in ("walk", "walk slow", "walk fast", "jog", "run"):
        for number, rate in enumerate(BENDS):
            bent = augment.bend(longer[:LOOPED], rate / FPS)
            yield from _with_mirror(replace(_clip(take, bent, "bent", spans=False), name=f"{take.name}_bent{number}"))
    back = hml.encode(augment.reversed_in_time(positions), heading="corrected")
    back = augment.loop(back, LOOPED) if len(back) < 160 else back
    if back is not None:
        yield from _with_mirror(_clip(take, back, "reversed", spans=False))


def _clip(take: Take, features: np.ndarray, way: str, *, spans: bool = True) -> Clip:
    if not np.isfinite(features).all():
        raise MotionloomError("its features are not finite numbers: the recording is degenerate")
    notes = []
    for span in take.spans if spans else ():
        first, last = round(span.start_s * FPS), min(round(min(span.end_s, 1e6) * FPS), len(features))
        if last - first >= SHORTEST and span.texts:
            notes.append(Note(first, last, span.kind, span.texts))
            notes += _action_notes(span, features, first, last)
    said = " | ".join(text for span in take.spans for text in span.texts)
    found = label_clip(hml.decode_positions(features.astype(np.float64)), FPS, said)
    notes += [Note(a, b, label) for a, b, label in join_spans(found)]
    suffix = "" if way == "plain" else f"_{way}"
    return Clip(take.name + suffix, take.source, take.licence, take.split, way, tuple(notes), features, take.kind)


def _action_notes(span: Span, features: np.ndarray, first: int, last: int) -> list[Note]:
    """The note of the action that a described stretch names, if it names one."""
    action = action_of(span.texts)
    texts = sentences(action, span.texts) if action else ()
    if action is None or not texts or last - first < SHORTEST:
        return []
    kept = None
    if action.kind in ("change", "once"):
        kept = (first, last)
        if last - first > LONG:
            begin, end = core(hml.decode_positions(features[first:last].astype(np.float64)), FPS)
            kept = (first + begin, first + end)
    written = span.texts if span.kind == "human" else ()
    if action.name in SEATED and written and hands_up(hml.decode_positions(features[first:last].astype(np.float64))):
        texts = ()  # people take a seat with their hands down: `lengthened` makes that
    return [Note(first, last, PREFIX + action.name, (*written, *texts), kept)]


def lengthened(take: Take, clip: Clip, positions: Array) -> Iterator[Clip]:
    """Short examples of an action at the lengths that are asked for: cycles go on, ends that can be held are held."""
    seed = int.from_bytes(take.name.encode(), "little") % 2**32
    for number, note in enumerate(n for n in clip.notes if n.kind.startswith(PREFIX)):
        action, frames = ACTIONS[note.kind.removeprefix(PREFIX)], note.last - note.first
        if frames > LOOPED - 40:
            continue
        if action.kind == "cycle" and frames < 160:
            longer = augment.loop(clip.features[note.first : note.last], LOOPED, limit=0.12)
            if longer is not None:
                yield _derived(clip, longer, "looped", (replace(note, first=0, last=len(longer), core=None),))
                continue
        first, last = note.core or (note.first, note.last)
        cut = positions[first : last + 1]
        for reverse in (False, True)[: 1 + bool(action.reverse)]:
            shown = augment.reversed_in_time(cut) if reverse else cut
            texts = sentences(ACTIONS[action.reverse]) if reverse else note.texts
            name = action.reverse if reverse else action.name
            if name in SEATED and hands_up(shown):
                lowered, said = lower_arms(shown), sentences(ACTIONS[name])
                yield from _held(clip, lowered, PREFIX + name, said, seed=seed + 2 * number + reverse + 7)
                if reverse:
                    continue
            yield from _held(clip, shown, PREFIX + name, texts, seed=seed + 2 * number + reverse)


def _held(clip: Clip, shown: Array, kind: str, texts: tuple[str, ...], *, seed: int) -> Iterator[Clip]:
    posture = kind.removeprefix(PREFIX) in POSTURES
    fastest = 1.2 if posture else 0.45
    start, end = (augment.can_hold(shown, FPS, end=at_end, fastest=fastest) for at_end in (False, True))
    if not (start or end) or len(shown) < SHORTEST:
        return
    rng = np.random.default_rng(seed)
    room = max(150 - len(shown), 30)
    before = int(rng.integers(8, min(55, room))) if start else 0
    after = max(room - before, 25) if end else 0
    longer = augment.held(shown, before, after, fps=FPS, seed=seed)
    features = hml.encode(at_origin(hml.uniform(longer)), heading="corrected")
    whole = (max(before - 3, 0), min(before + len(shown) + 2, len(features)))
    yield _derived(clip, features, "held", (Note(0, len(features), kind, texts, whole),))


def _derived(clip: Clip, features: np.ndarray, way: str, notes: tuple[Note, ...]) -> Clip:
    return replace(clip, name=f"{clip.name}_{way}", way=way, notes=notes, features=features.astype(np.float32))


def laid_down(clips: Sequence[Clip], count: int, seed: int = 0) -> Iterator[Clip]:
    """From standing to lying, out of a crouch and of lying down from one, and the same film backwards: getting up."""
    parts = {
        name: [
            (c, n)
            for c in clips
            for n in c.notes
            if n.kind == PREFIX + name and c.way == "plain" and c.split == "train"
        ]
        for name in ("crouch", "lie down")
    }
    rng, made = np.random.default_rng(seed), 0
    pairs = [(a, b) for a in parts["crouch"] for b in parts["lie down"]]
    for number in rng.permutation(len(pairs)):
        if made >= count:
            return
        first, second = (_core_positions(clip, note, rng) for clip, note in pairs[number])
        first = first[: int(first[:, 0, 1].argmin()) + 1]
        both = augment.joined(first, second, blend=14, limit=0.3)
        if both is None or not 30 <= len(both) <= 180:
            continue
        clip = pairs[number][1][0]
        for name, shown in (("lie down", both), ("get up", augment.reversed_in_time(both))):
            texts = sentences(ACTIONS[name])
            for longer in _held(clip, shown, PREFIX + name, texts, seed=seed * 100_003 + int(number)):
                yield replace(longer, name=f"joined_{seed}_{name.replace(' ', '_')}{made}", way="joined")
        made += 1


def joined_clips(clips: Sequence[Clip], count: int, seed: int = 0) -> Iterator[Clip]:
    """One action and then another, where the poses in between agree; training clips of one licence."""
    rng = np.random.default_rng(seed)
    pool: dict[str, list[tuple[Clip, Note]]] = {}
    for clip in clips:
        for note in clip.notes:
            if note.kind.startswith(PREFIX) and clip.split == "train" and clip.way in ("plain", "held"):
                pool.setdefault(note.kind.removeprefix(PREFIX), []).append((clip, note))
    names, made = sorted(pool), 0
    for number in range(60 * count if names else 0):
        if made == count:
            return
        pair = [ACTIONS[names[i]] for i in rng.integers(len(names), size=2)]
        if pair[0] is pair[1] or not all(action.says for action in pair):
            continue
        picked = [pool[action.name][rng.integers(len(pool[action.name]))] for action in pair]
        parts = [_core_positions(clip, note, rng) for clip, note in picked]
        both = augment.joined(*parts)
        if both is None or not 40 <= len(both) <= 180:
            continue
        said = [_phrases(action, note) for action, (_, note) in zip(pair, picked)]
        texts = tuple(
            sentence(f"{a} {link} {b}", rng)
            for link in ("and then", "and", "then") for a, b in [(rng.choice(said[0]), rng.choice(said[1]))]
        )  # fmt: skip
        name = f"joined_{seed}_{made:04d}"
        keyed = "keyed" if any(clip.kind == "keyed" for clip, _ in picked) else "capture"
        base = Clip(
            name, picked[0][0].source, picked[0][0].licence, "train", "joined", (), picked[0][0].features, keyed
        )
        for clip in _held(base, both, PREFIX + THEN, texts, seed=seed * 100_003 + number):
            made += 1
            yield replace(clip, name=name, way="joined")


def _phrases(action: Action, note: Note) -> list[str]:
    side = side_of(note.texts)
    return [*action.says, *(phrase.format(side=side) for phrase in action.sided if side)]


def _core_positions(clip: Clip, note: Note, rng: np.random.Generator) -> Array:
    first, last = note.core or (note.first, note.last)
    if note.core is None and last - first > 70:
        first += int(rng.integers(last - first - 60))
        last = first + 60
    return hml.decode_positions(clip.features[first:last].astype(np.float64))


def made_clips(clips: Sequence[Clip], count: int, seed: int = 0) -> Iterator[Clip]:
    """Gestures of the arms (`data.made`) on people who stand, sit or walk; training clips of one licence."""
    rng = np.random.default_rng(seed)
    bodies = _labelled(clips, ("stand", "walk", "sit"))
    leads = {"stand": "", "walk": "walks", "sit": "sits"}
    for number in range(count if bodies.get("stand") else 0):
        gesture = GESTURES[sorted(GESTURES)[number % len(GESTURES)]]
        where = str(rng.choice([k for k in ("stand", "stand", "stand", "walk", "sit") if k in bodies]))
        below, note = bodies[where][rng.integers(len(bodies[where]))]
        length = min(note.last - note.first, int(rng.integers(70, 160)))
        first = note.first + int(rng.integers(note.last - note.first - length + 1))
        side = str(rng.choice(["left", "right"]))
        body = hml.decode_positions(below.features[first : first + length].astype(np.float64))
        positions = perform(body, gesture, side, fps=FPS, rng=rng)
        features = hml.encode(positions, heading="corrected")
        texts = words_for(gesture, side, leads[where], rng)
        if texts:
            group = PREFIX + MADE + gesture.name
            notes = (Note(0, len(features), group, texts, (0, min(30, len(features)))),)
            yield Clip(
                f"made_{seed}_{number:04d}", below.source, below.licence, "train", "made", notes, features, "made"
            )


def join_spans(spans: Sequence[tuple[int, int, str]]) -> list[tuple[int, int, str]]:
    """Overlapping windows of a label that is a state become one span; single events keep their windows."""
    result = [s for s in spans if s[2] not in STATES]
    for label in dict.fromkeys(s[2] for s in spans if s[2] in STATES):
        ordered = sorted((a, b) for a, b, name in spans if name == label)
        joined: list[tuple[int, int]] = []
        for a, b in ordered:
            if joined and a <= joined[-1][1] - 10:
                joined[-1] = (joined[-1][0], max(b, joined[-1][1]))
            else:
                joined.append((a, b))
        result += [(a, b, label) for a, b in joined]
    return result


_OTHER_LABEL = {"sidestep left": "sidestep right", "turn left": "turn right", "walk left turn": "walk right turn",
                "circle left": "circle right"}  # fmt: skip
_OTHER_LABEL |= {b: a for a, b in _OTHER_LABEL.items()}


def _with_mirror(clip: Clip) -> Iterator[Clip]:
    yield clip
    notes = tuple(
        replace(n, kind=_OTHER_LABEL.get(n.kind, n.kind), texts=tuple(mirror_text(t) for t in n.texts))
        for n in clip.notes
    )
    yield replace(clip, name="M" + clip.name, notes=notes, features=hml.mirror(clip.features))


def mixed_clips(clips: Sequence[Clip], count: int, seed: int = 0) -> Iterator[Clip]:
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
        worn = augment.wear_arms(_positions(below, note), _positions(above, gesture_note))
        features = hml.encode(worn, heading="corrected")
        features[:, LAYOUT["root_height"]] = below.features[
            note.first : note.first + len(features), LAYOUT["root_height"]
        ]
        yield Clip(
            f"mixed_{seed}_{number:04d}", below.source, below.licence, "train", "mixed",
            (Note(0, len(features), f"{body_label}+{gesture}"),), features,
        )  # fmt: skip


def _labelled(clips: Sequence[Clip], labels: Sequence[str]) -> dict[str, list[tuple[Clip, Note]]]:
    found: dict[str, list[tuple[Clip, Note]]] = {}
    for clip in clips:
        for note in clip.notes:
            if note.kind in labels and clip.split == "train" and note.last - note.first >= 50:
                found.setdefault(note.kind, []).append((clip, note))
    return found


def _positions(clip: Clip, note: Note) -> Array:
    return hml.decode_positions(clip.features[note.first : note.last].astype(np.float64))


def write_clip(folder: Path, clip: Clip) -> None:
    """One file ``folder/NAME.safetensors``, whole or not at all."""
    about = {k: v for k, v in asdict(clip).items() if k != "features"}
    save_tensors(
        {"features": np.ascontiguousarray(clip.features)},
        folder / f"{clip.name}.safetensors",
        metadata={"clip": json.dumps(about)},
    )


def read_clip(path: Path) -> Clip:
    """The inverse of `write_clip`; raises MotionloomError for a damaged file."""
    try:
        with safe_open(path, framework="numpy") as file:
            about = plain_json(file.metadata()["clip"])
            features = file.get_tensor("features")
        notes = tuple(
            Note(n["first"], n["last"], n["kind"], tuple(n["texts"]), tuple(n["core"]) if n.get("core") else None)
            for n in about.pop("notes")
        )
        clip = Clip(**about, notes=notes, features=features)
        _check_clip(clip)
        return clip
    except (SafetensorError, KeyError, TypeError, ValueError, AttributeError, RecursionError) as error:
        raise MotionloomError(
            f"{path} is not a clip of a built set ({error}); delete it and its name in done/, and build again"
        ) from error


def _check_clip(clip: Clip) -> None:
    features = clip.features
    if (
        features.dtype != np.float32
        or features.ndim != 2
        or features.shape[1] != WIDTH
        or not np.isfinite(features).all()
    ):
        raise ValueError(f"its features are not finite float32 numbers of shape (frames, {WIDTH})")
    if not all(isinstance(v, str) for v in (clip.name, clip.source, clip.licence, clip.split, clip.way)):
        raise ValueError("its name, source, licence, split or way is not text")
    for note in clip.notes:
        if not 0 <= note.first < note.last <= len(features):
            raise ValueError(f"a note spans frames {note.first} to {note.last} of {len(features)}")
        written = note.kind in ("human", "index") or note.kind.startswith(PREFIX)
        if note.core and not note.first <= note.core[0] < note.core[1] <= note.last:
            raise ValueError(f"what a window must hold, frames {note.core}, is not within {note.first} to {note.last}")
        if not all(isinstance(t, str) for t in note.texts) or (written and not note.texts):
            raise ValueError(f"a note of kind {note.kind} lacks its texts")
        if not written and not all(label in LABELS for label in note.kind.split("+", 1)):
            raise ValueError(f"there is no label {note.kind!r}")


Finder = Callable[..., list[Take]]
"""As `data.sources.find_takes`; a function of a module, so that worker processes find it too."""
Job = tuple[str, str, str, str, Finder]
"""Folder, captions, name of the take, folder of the built set, what finds the takes of the folder."""

_takes: dict[tuple[str, str], dict[str, Take]] = {}


def _prepare(job: Job) -> tuple[str, str]:
    """In a worker: write the clips of one take. Returns its name and why it was dropped ('' if it was not)."""
    folder, captions, name, out, find = job
    key = (folder, captions)
    if key not in _takes:
        _takes[key] = {take.name: take for take in reversed(find(folder, captions=captions or None))}
    reason = ""
    try:
        for clip in clips_of(_takes[key][name]):
            write_clip(Path(out) / "clips", clip)
    except MotionloomError as error:
        reason = str(error)
    with atomic_path(Path(out) / "done" / name) as temp:
        temp.write_text(reason, encoding="utf-8")
    return name, reason


def build(
    folders: Sequence[Path | str],
    out: Path | str,
    *,
    captions: Path | str | None = None,
    workers: int = 2,
    mixed: int = 700,
    find: Finder = find_takes,
    progress: Callable[[str], None] = print,
) -> Path:
    """Build a training set from folders of recordings; returns ``set.json``. Takes already done are kept.

    find: what finds the takes of a folder.
    """
    out = Path(out)
    if workers < 1 or mixed < 0:
        raise MotionloomError(f"at least 1 worker and 0 mixed clips are needed; got {workers} and {mixed}")
    jobs = list(_jobs(folders, captions, out, find=find, progress=progress))
    for part in ("clips", "done"):
        (out / part).mkdir(parents=True, exist_ok=True)
        sweep(out / part)
    left = [job for job in jobs if not (out / "done" / job[2]).exists()]
    progress(f"{len(left)} takes to do, {len(jobs) - len(left)} already done")
    for number, (name, reason) in enumerate(_run(left, workers), start=1):
        if reason:
            progress(f"dropped {name}: {reason}")
        if number % 100 == 0:
            progress(f"{number} of {len(left)} takes done")
    return _finish(out, mixed, progress)


def _jobs(
    folders: Sequence[Path | str],
    captions: Path | str | None,
    out: Path,
    *,
    find: Finder,
    progress: Callable[[str], None],
) -> Iterator[Job]:
    seen: dict[str, str] = {}
    for folder in folders:
        for take in find(folder, captions=captions):
            if not _NAME.fullmatch(take.name):
                raise MotionloomError(
                    f"{folder}: {take.name!r} cannot be the name of a clip; use letters, digits, _ - ."
                )
            if take.name in seen:
                progress(f"dropped a second {take.name} in {folder}: the one in {seen[take.name]} is used")
                continue
            seen[take.name] = str(folder)
            yield str(folder), str(captions or ""), take.name, str(out), find


def _begin_worker() -> None:
    """A worker leaves interruptions to the process that started it, and does not outlive that one."""
    for name in ("SIGINT", "SIGHUP"):
        if hasattr(signal, name):
            signal.signal(getattr(signal, name), signal.SIG_IGN)
    signal.signal(signal.SIGTERM, signal.SIG_DFL)
    parent = multiprocessing.parent_process()
    if parent is not None:
        threading.Thread(target=_end_with, args=(parent.sentinel,), daemon=True).start()


def _end_with(sentinel: int) -> None:
    multiprocessing.connection.wait([sentinel])
    os._exit(1)


def _run(jobs: Sequence[Job], workers: int) -> Iterator[tuple[str, str]]:
    if workers == 1 or len(jobs) < 2:
        yield from map(_prepare, jobs)
        return
    try:
        with ProcessPoolExecutor(max_workers=workers, initializer=_begin_worker) as pool:
            yield from pool.map(_prepare, jobs, chunksize=4)
    except BrokenProcessPool:
        raise MotionloomError(
            "a worker process died, perhaps for lack of memory; give the same command again with fewer --workers: "
            "finished takes are kept"
        ) from None


def _finish(out: Path, mixed: int, progress: Callable[[str], None]) -> Path:
    clips = [read_clip(path) for path in finished(out / "clips", "*.safetensors") if not _DERIVED.match(path.stem)]
    frames = sum(len(clip.features) for clip in clips)
    for seed, licence in enumerate(sorted({clip.licence for clip in clips})):
        same = [c for c in clips if c.licence == licence]
        share = sum(len(clip.features) for clip in same) / frames
        for derive in (mixed_clips, laid_down, joined_clips, made_clips):
            for clip in derive(same, round(mixed * share), seed):
                for both in _with_mirror(clip) if derive is not mixed_clips else (clip,):
                    write_clip(out / "clips", both)
                    clips.append(both)
    derived = {path.stem for path in finished(out / "clips", "*.safetensors") if _DERIVED.match(path.stem)}
    for old in derived - {clip.name for clip in clips}:
        (out / "clips" / f"{old}.safetensors").unlink()  # of a build that was asked for more of them
    if not clips:
        raise MotionloomError(f"no take could be used; the reasons stand in {out / 'done'}")
    dropped = {p.name: text for p in finished(out / "done", "*") if (text := p.read_text(encoding="utf-8"))}
    frames = np.concatenate([c.features for c in clips if c.split == "train"] or [np.zeros((1, 263), np.float32)])
    counts = Counter(f"{c.source}/{c.split}/{c.way}" for c in clips)
    labels = Counter(n.kind for c in clips for n in c.notes if c.split == "train")
    about = {
        "clips": dict(sorted(counts.items())),
        "minutes": round(sum(len(c.features) for c in clips) / FPS / 60, 1),
        "notes": dict(labels.most_common()),
        "licences": sorted({c.licence for c in clips}),
        "dropped": dropped,
        "mean": [round(float(v), 6) for v in frames.mean(0, dtype=np.float64)],
        "std": [round(float(v), 6) for v in frames.std(0, dtype=np.float64)],
    }
    with atomic_path(out / "set.json") as temp:
        Path(temp).write_text(json.dumps(about, indent=1), encoding="utf-8")
    progress(f"{len(clips)} clips, {about['minutes']} minutes, {len(dropped)} takes dropped: {out / 'set.json'}")
    return out / "set.json"
