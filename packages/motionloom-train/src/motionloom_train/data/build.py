"""`motionloom data build`: folders of recordings to one training set of features, captions and splits.

A built set is a folder: ``clips/NAME.safetensors`` (features (frames, 263) float32; the metadata holds captions, split,
source and licence as JSON), ``fidelity/NAME`` (how true the body is, `data.gate`) and ``set.json`` (counts, mean, std,
what was dropped and why). Every clip is written whole
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
from collections.abc import Callable, Iterator, Mapping, Sequence
from concurrent.futures import ProcessPoolExecutor
from concurrent.futures.process import BrokenProcessPool
from dataclasses import dataclass, replace
from pathlib import Path
from types import MappingProxyType
from typing import Any

import numpy as np

from motionloom.core.errors import MotionloomError
from motionloom.core.features import humanml as hml
from motionloom.core.features.layout import FPS
from motionloom.core.files.atomic import atomic_path, finished, sweep
from motionloom.kinematics.physics import Array
from motionloom_train.data import augment, gate
from motionloom_train.data.actions import ACTIONS, PREFIX, action_of, core, sentences, side_of, strike, turned_to
from motionloom_train.data.augment import find_idle
from motionloom_train.data.clips import MEASURED, SHORTEST, Clip, Note, read_clip, write_clip
from motionloom_train.data.corrections import read_corrections
from motionloom_train.data.derived import (
    LOOPED,
    SEATED,
    held_clips,
    joined_clips,
    laid_down,
    looped,
    made_clips,
    mixed_clips,
    posture_clips,
    sat_and_risen,
    there_and_back,
)
from motionloom_train.data.made import hands_up
from motionloom_train.data.mannered import is_handed, mannered_clips
from motionloom_train.data.measured import measured_notes
from motionloom_train.data.person import uniform_person
from motionloom_train.data.progress import Say
from motionloom_train.data.sources import Places, Span, Take, find_takes
from motionloom_train.data.windows import label_clip
from motionloom_train.data.words import STATES, mirror_text

_DERIVED = re.compile(r"M?(held|mixed|joined|made|manner|posture|there)_\d")
_NAME = re.compile(r"\w[\w.+ -]{0,120}")
BENDS = (0.35, 0.75, 1.0)
"""Radians per second: a wide turn, and circles in 8.4 and 6.3 seconds."""
LONG = 60
"""Frames from which on the part of a described change that matters is looked for."""


def clips_of(take: Take, *, check: Callable[[Places, Clip], None] | None = None) -> Iterator[Clip]:
    """A take as clips: itself, its mirror image, and in training loops and curves of gaits and walks run backwards.

    check: called with what was recorded and the first clip, before any is yielded; what it raises ends the take.
    """
    recording = take.read()
    if isinstance(recording, np.ndarray):  # finished HumanML3D features
        yield from _with_mirror(_clip(take, np.asarray(recording, dtype=np.float32), "plain"))
        return
    positions = uniform_person(recording.positions, recording.fps)
    if len(positions) <= SHORTEST:
        raise MotionloomError(f"only {len(positions) / FPS:.2f} s long; at least {SHORTEST / FPS:.0f} s are needed")
    clip = _clip(take, hml.encode(positions, heading="corrected"), "plain")
    if check is not None:
        check(recording, clip)
    yield from _with_mirror(clip)
    if take.split == "train":
        yield from _more(take, clip, positions)
        for number, longer in enumerate(looped(clip)):
            yield from _with_mirror(replace(longer, name=f"{longer.name}{number}"))


def _more(take: Take, clip: Clip, positions: Array) -> Iterator[Clip]:
    gait = {
        "walk",
        "walk slow",
        "walk fast",
        "jog",
        "run",
        "circle left",
        "circle right",
        "walk left turn",
        "walk right turn",
        "sidestep left",
        "sidestep right",
    }
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
            notes += _action_notes(span, features[first:last], first, name=take.name)
    words = " | ".join(text for span in take.spans for text in span.texts)
    positions = hml.decode_positions(features.astype(np.float64))
    windows = label_clip(positions, FPS, words)
    if way == "bent":  # somebody who stands is turned like a statue
        windows = [(a, b, label) for a, b, label in windows if not label.startswith("turn ")]
    done = [(n.first, n.last, n.kind.removeprefix(PREFIX)) for n in notes if n.kind.startswith(PREFIX)]
    notes += [Note(a, b, label) for a, b, label in join_spans(windows)]
    notes += measured_notes(positions, FPS, [*windows, *done])
    suffix = "" if way == "plain" else f"_{way}"
    return Clip(take.name + suffix, take.source, take.licence, take.split, way, tuple(notes), features, take.kind)


def _action_notes(span: Span, features: np.ndarray, first: int, *, name: str) -> list[Note]:
    """The note of the action that a described stretch shows, if its captions or the clip's name have one."""
    action, last = action_of(span.texts, name), first + len(features)
    if action is None or len(features) < SHORTEST:
        return []
    positions = hml.decode_positions(features.astype(np.float64))
    by_name = bool(re.search(action.clips, name))  # its captions may be wrong
    side_word = side_of([*re.findall("left|right", name.lower())]) if by_name else side_of(span.texts)
    side = strike(positions, FPS, action.limb)[1] if action.limb else turned_to(positions) if action.turns else ""
    texts = sentences(action, side=side or side_word)
    if not texts:
        return []
    whole = None
    if action.kind in ("change", "once"):
        whole = (first, last)
        if len(features) > LONG:
            begin, end = core(positions, FPS)
            whole = (first + begin, first + end)
    captions = span.texts if span.kind == "human" and not by_name and not action.turns else ()
    if action.name in SEATED and captions and hands_up(positions):
        texts = ()  # people take a seat with their hands down, as `held_clips` shows them
    return [Note(first, last, PREFIX + action.name, (*captions, *texts), whole)]


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


_OTHER_LABEL = {
    "sidestep left": "sidestep right",
    "turn left": "turn right",
    "walk left turn": "walk right turn",
    "circle left": "circle right",
    "turn around": "turn around right",
    "walk turn back": "walk turn back right",
    "punch left": "punch right",
    "kick left": "kick right",
}
_OTHER_LABEL |= {b: a for a, b in _OTHER_LABEL.items()}


_SIDED = {*_OTHER_LABEL, "kick", "punch", "hop", "wave"}
"""What is shown with the right side, or to the left, where no side is said."""


def _mirrored(note: Note) -> Note:
    """A note of the mirror image; perhaps without texts."""
    start = MEASURED if note.kind.startswith(MEASURED) else ""
    name, texts = note.kind.removeprefix(start), _mirrored_texts(note)
    if start and name in _SIDED:
        texts = tuple(new for new, old in zip(texts, note.texts, strict=True) if new != old)
    return replace(note, kind=start + _OTHER_LABEL.get(name, name), texts=texts)


def _mirrored_texts(note: Note) -> tuple[str, ...]:
    action = ACTIONS.get(note.kind.removeprefix(PREFIX))
    if action and action.turns:  # words for a turn to the left do not fit one to the right
        return sentences(action, side="right" if side_of(note.texts) == "left" else "left")
    return tuple(mirror_text(text) for text in note.texts)


PHASED = {PREFIX + name for name, action in ACTIONS.items() if action.phase}


def _with_mirror(clip: Clip) -> Iterator[Clip]:
    yield clip
    notes = tuple(_mirrored(n) for n in clip.notes if not (n.kind in PHASED and n.core))
    notes = tuple(n for n in notes if n.texts or not n.kind.startswith(MEASURED))
    yield replace(clip, name="M" + clip.name, notes=notes, features=hml.mirror(clip.features))


Finder = Callable[..., list[Take]]
"""As `data.sources.find_takes`; a function of a module, so that worker processes find it too."""


@dataclass(frozen=True)
class Job:
    """One take that becomes clips."""

    folder: str
    captions: str
    name: str
    out: str
    """Folder of the built set."""
    find: Finder
    allowed: str = ""
    """Why the take may come in though its body is not that of the recording."""
    corrections: str = ""
    """File of the table of `data.corrections`; empty: captions stay as they are."""


_takes: dict[tuple[str, str], dict[str, Take]] = {}


def _prepare(job: Job) -> tuple[str, str]:
    """In a worker: write the clips of one take. Returns its name and why it was dropped ('' if it was not)."""
    key, out, reason = (job.folder, job.captions), Path(job.out), ""
    if key not in _takes:
        _takes[key] = {take.name: take for take in reversed(job.find(job.folder, captions=job.captions or None))}

    def check(places: Places, clip: Clip) -> None:
        gate.admit(out, job.name, places, clip, allowed=job.allowed)

    try:
        take = _takes[key][job.name]
        take = read_corrections(job.corrections).take(take) if job.corrections else take
        for clip in clips_of(take, check=check):
            write_clip(out / "clips", clip)
    except MotionloomError as error:
        reason = str(error)
    with atomic_path(out / "done" / job.name) as temp:
        temp.write_text(reason, encoding="utf-8")
    return job.name, reason


def build(
    folders: Sequence[Path | str],
    out: Path | str,
    *,
    captions: Path | str | None = None,
    workers: int = 2,
    mixed: int = 700,
    exclude: Sequence[str] = (),
    allow: Mapping[str, str] = MappingProxyType({}),
    corrections: Path | str | None = None,
    find: Finder = find_takes,
    progress: Say = print,
) -> Path:
    """Build a training set from folders of recordings; returns ``set.json``. Takes already done are kept.

    A take whose clip does not show its recording (`data.gate`) is dropped.

    exclude: takes whose names begin with one of these are left out, and so are all clips derived from them.
    allow: beginnings of names of takes that come in all the same, and why.
    corrections: a table of what captions become (`data.corrections`).
    find: what finds the takes of a folder.
    """
    out = Path(out)
    if corrections is not None:
        read_corrections(corrections)  # before any work is done
    if workers < 1 or mixed < 0:
        raise MotionloomError(f"at least 1 worker and 0 mixed clips are needed; got {workers} and {mixed}")
    jobs = list(_jobs(folders, captions, out, find=find, progress=progress))
    jobs = [replace(job, corrections=str(corrections or "")) for job in _allowing(_without(jobs, exclude), allow)]
    if (out / "done").exists() and not (out / gate.FOLDER).exists():
        raise MotionloomError(f"{out} is of a version that did not look at bodies; build into another folder")
    for part in ("clips", gate.FOLDER, "done"):
        (out / part).mkdir(parents=True, exist_ok=True)
        sweep(out / part)
    rest = [job for job in jobs if not _is_done(job)]
    progress(f"{len(rest)} takes to do, {len(jobs) - len(rest)} already done")
    for number, (name, reason) in enumerate(_run(rest, workers), start=1):
        if reason:
            progress(f"dropped {name}: {reason}")
        if number % 100 == 0:
            progress(f"{number} of {len(rest)} takes done")
    return _finish(out, mixed, progress)


def _is_done(job: Job) -> bool:
    """Whether an earlier build finished the take; what it refused and is allowed now is done again."""
    complete = (Path(job.out) / "done" / job.name).exists()
    return complete and not (job.allowed and gate.refused(Path(job.out), job.name))


def _without(jobs: list[Job], exclude: Sequence[str]) -> list[Job]:
    """The jobs whose takes' names begin with none of ``exclude``."""
    for prefix in exclude:
        left_out = [job for job in jobs if prefix and job.name.startswith(prefix)]
        if not left_out:
            raise MotionloomError(f"no take's name begins with {prefix!r}, which was to be left out; see the manifests")
        for job in left_out:
            if (Path(job.out) / "done" / job.name).exists():
                raise MotionloomError(
                    f"{job.out} already holds {job.name}, which is to be left out; build into another folder"
                )
    return [job for job in jobs if not job.name.startswith(tuple(exclude))]


def _allowing(jobs: list[Job], allow: Mapping[str, str]) -> list[Job]:
    """The jobs, with the reason of those whose takes' names begin as one of ``allow`` does."""
    for prefix in allow:
        if not prefix or not any(job.name.startswith(prefix) for job in jobs):
            raise MotionloomError(f"no take's name begins with {prefix!r}, which was to be allowed; see the manifests")
    reasons = {prefix: reason.strip() or gate.NO_REASON for prefix, reason in allow.items()}
    why = (next((r for prefix, r in reasons.items() if job.name.startswith(prefix)), "") for job in jobs)
    return [replace(job, allowed=reason) for job, reason in zip(jobs, why, strict=True)]


def _jobs(
    folders: Sequence[Path | str],
    captions: Path | str | None,
    out: Path,
    *,
    find: Finder,
    progress: Say,
) -> Iterator[Job]:
    origins: dict[str, str] = {}
    for folder in folders:
        for take in find(folder, captions=captions):
            if not _NAME.fullmatch(take.name):
                raise MotionloomError(
                    f"{folder}: {take.name!r} cannot be the name of a clip; use letters, digits, _ - ."
                )
            if take.name in origins:
                progress(f"dropped a second {take.name} in {folder}: the one in {origins[take.name]} is used")
                continue
            origins[take.name] = str(folder)
            yield Job(str(folder), str(captions or ""), take.name, str(out), find)


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


def _finish(out: Path, mixed: int, progress: Say) -> Path:
    clips = [read_clip(path) for path in finished(out / "clips", "*.safetensors") if not _DERIVED.match(path.stem)]
    for clip in _derived(list(clips), mixed):
        write_clip(out / "clips", clip)
        clips.append(clip)
    derived = {path.stem for path in finished(out / "clips", "*.safetensors") if _DERIVED.match(path.stem)}
    for old in derived - {clip.name for clip in clips}:
        (out / "clips" / f"{old}.safetensors").unlink()  # of a build with more of them
    if not clips:
        raise MotionloomError(f"no take could be used; the reasons stand in {out / 'done'}")
    dropped = {p.name: text for p in finished(out / "done", "*") if (text := p.read_text(encoding="utf-8"))}
    compared = gate.read_compared(out)
    about = _summary(clips, dropped, compared)
    with atomic_path(out / "set.json") as temp:
        Path(temp).write_text(json.dumps(about, indent=1), encoding="utf-8")
    for line in gate.lines_of(about["fidelity"]):
        progress(line)
    progress(f"{len(clips)} clips, {about['minutes']} minutes, {len(dropped)} takes dropped: {out / 'set.json'}")
    return out / "set.json"


def _derived(clips: Sequence[Clip], mixed: int) -> Iterator[Clip]:
    """Clips derived from those of the same licence, by its share of all frames; most with their mirror image."""
    frames = sum(len(clip.features) for clip in clips)
    for seed, licence in enumerate(sorted({clip.licence for clip in clips})):
        same = [clip for clip in clips if clip.licence == licence]
        share, idle = sum(len(clip.features) for clip in same) / frames, find_idle(same)
        longer = [held for clip in held_clips(same, idle) for held in _with_mirror(clip)]
        yield from longer
        same += longer
        ways = (mixed_clips, laid_down, sat_and_risen, joined_clips, made_clips, posture_clips, there_and_back)
        for derive in (*ways, mannered_clips):
            for clip in derive(same, round(mixed * share), seed, idle):
                yield from (clip,) if derive is mixed_clips or is_handed(clip) else _with_mirror(clip)


def _summary(clips: Sequence[Clip], dropped: dict[str, str], compared: Mapping[str, gate.Compared]) -> dict[str, Any]:
    """What a set holds: counts, minutes, licences, how true its bodies are, and statistics of its training clips."""
    frames = np.concatenate([c.features for c in clips if c.split == "train"] or [np.zeros((1, 263), np.float32)])
    counts = Counter(f"{c.source}/{c.split}/{c.way}" for c in clips)
    labels = Counter(n.kind for c in clips for n in c.notes if c.split == "train")
    return {
        "clips": dict(sorted(counts.items())),
        "minutes": round(sum(len(c.features) for c in clips) / FPS / 60, 1),
        "notes": dict(labels.most_common()),
        "licences": sorted({c.licence for c in clips}),
        "dropped": dropped,
        "allowed": {
            name: {"reason": one.allowed, "faults": list(one.faults)} for name, one in compared.items() if one.allowed
        },
        "fidelity": gate.summary(compared),
        "mean": [round(float(v), 6) for v in frames.mean(0, dtype=np.float64)],
        "std": [round(float(v), 6) for v in frames.std(0, dtype=np.float64)],
    }
