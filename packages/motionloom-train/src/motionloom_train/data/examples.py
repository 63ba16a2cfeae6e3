"""A user's own few clips with their captions, as examples that an adapter learns from (`motionloom_train.teach`), and
what is wrong with one: too short, floating, wrong unit, nothing moves.

A clip of any skeleton that the readers know becomes features of the uniform person. Clips shorter than what will be
asked for are lengthened: a gait goes on as a loop, anything else is held at both ends.
"""

import re
from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np

from motionloom.core.errors import MotionloomError
from motionloom.core.features import humanml as hml
from motionloom.core.features.layout import FPS
from motionloom.core.motion import Motion
from motionloom.core.reading import read_bytes
from motionloom.formats import readable
from motionloom.kinematics import physics as ph
from motionloom.kinematics.physics import Array
from motionloom.retarget import joints22, to_smpl22
from motionloom.retarget.anatomy import read_body
from motionloom.retarget.fidelity import compare
from motionloom_train.data import augment
from motionloom_train.data.person import uniform_person
from motionloom_train.data.words import mirror_text

MOST_CLIPS = 20
LENGTH = 200
"""Frames at 20 per second that a clip is lengthened to, 10 s: no window of training is longer."""
MOST_FRAMES = 20 * 300
"""Frames that are learned from in one clip."""
MAX_CAPTION, MAX_CAPTIONS = 300, 64
MAX_BYTES = 1 << 20
ONE_SIDED = re.compile(r"\b(salut|violin|guitar|handshak|shak\w+ hands|writ(?:es|ing)|steering)", re.IGNORECASE)
"""What people do with a certain hand although no word says which: not mirrored."""


@dataclass(frozen=True)
class CaptionedClip:
    """A clip's file and its captions."""

    path: Path
    captions: tuple[str, ...]


@dataclass(frozen=True, eq=False)
class Example:
    """A clip as it is learned from."""

    name: str
    captions: tuple[str, ...]
    features: np.ndarray
    """(frames, 263) float32, not standardised."""
    span: tuple[int, int]
    """The frames (half-open) that were recorded; the rest holds the pose. A window shows all of them if it can."""
    looped: bool = False


# Which clips, and what they show


def find_examples(places: Sequence[Path | str], caption: str = "") -> list[CaptionedClip]:
    """The clips among files and folders, in order, with their captions.

    A clip's captions are the first of: ``NAME.txt`` beside it, a caption on each line; lines ``NAME: caption``
    in a ``captions.txt`` in its folder; ``caption``; and, for clips found in a folder that is named, the name of the
    clip's own folder (``a_zombie_walks/01.bvh``). Raises `MotionloomError` for places without clips, for too many of
    them, for clips without captions, and for captions that are none.
    """
    if caption:
        _check_caption(caption, "the caption")
    files: dict[Path, bool] = {}
    for place in map(Path, places):
        if place.is_dir():
            inside = (path for path in sorted(place.rglob("*")) if path.suffix.lower() in readable() and path.is_file())
            files.update(dict.fromkeys(inside, True))
        elif place.is_file() and place.suffix.lower() in readable():
            files.setdefault(place, False)
        elif place.is_file():
            raise MotionloomError(f"{place} is no motion file; give {', '.join(readable())} or folders of them")
        else:
            raise MotionloomError(f"there is no clip {place}; give motion files ({', '.join(readable())}) or folders")
        if len(files) > MOST_CLIPS:
            raise MotionloomError(
                f"more than {MOST_CLIPS} clips are not taught but trained: see 'motionloom train prior'; give 1 to "
                f"{MOST_CLIPS} clips of one action or style"
            )
    if not files:
        raise MotionloomError("there is no clip; give 1 to 20 motion files, or folders of them")
    return [CaptionedClip(path, _captions_of(path, caption, in_folder=named)) for path, named in files.items()]


def _captions_of(path: Path, caption: str, *, in_folder: bool) -> tuple[str, ...]:
    own, shared = path.with_suffix(".txt"), path.parent / "captions.txt"
    if own.is_file() and own != shared:
        lines = [line for line in _lines(own) if line.strip() and not line.lstrip().startswith("#")]
        return tuple(_check_caption(line, str(own)) for line in lines[:MAX_CAPTIONS]) or _none(path)
    if shared.is_file():
        texts = [words for name, words in map(_named, _lines(shared)) if name in (path.name, path.stem)]
        if texts:
            return tuple(_check_caption(words, str(shared)) for words in texts[:MAX_CAPTIONS])
    if caption:
        return (" ".join(caption.split()),)
    if in_folder:
        return (_check_caption(re.sub(r"[_\s]+", " ", path.parent.name), f"the folder {path.parent}"),)
    return _none(path)


def _none(path: Path) -> tuple[str, ...]:
    raise MotionloomError(
        f"nothing is said of {path}; give one caption for all clips first, such as 'a zombie walks', or write it into "
        f"{path.with_suffix('.txt').name} beside it"
    )


def _named(line: str) -> tuple[str, str]:
    name, _, words = line.partition("\t") if "\t" in line else line.partition(":")
    return name.strip(), words


def _lines(path: Path) -> list[str]:
    try:
        return read_bytes(path, max_bytes=MAX_BYTES, empty=True).decode("utf-8-sig").splitlines()
    except UnicodeDecodeError as error:
        raise MotionloomError(f"{path} is not text in UTF-8 ({type(error).__name__}); save it again as text") from None


def _check_caption(words: str, place: str) -> str:
    caption = " ".join(words.split())
    if not caption or len(caption) > MAX_CAPTION or not caption.isprintable() or not any(c.isalpha() for c in caption):
        raise MotionloomError(
            f"{place} says {caption[:60]!r}, which is no caption; write a sentence of at most {MAX_CAPTION} letters"
        )
    return caption


# A clip as features


def make_examples(motion: Motion, captioned: CaptionedClip, *, mirror: bool = True) -> list[Example]:
    """A clip as one example, or as two with its mirror image.

    motion: anybody's, on a humanoid skeleton, in metres. The mirror image is left out where ``mirror`` is False or a
    caption names what is done with a certain hand; left and right change places in its captions. Raises
    `MotionloomError` for a skeleton that is no person's.
    """
    plain = _example(motion, captioned)
    if not mirror or any(ONE_SIDED.search(caption) for caption in captioned.captions):
        return [plain]
    captions = tuple(mirror_text(caption) for caption in captioned.captions)
    mirrored = replace(plain, name="M" + plain.name, captions=captions)
    return [plain, replace(mirrored, features=hml.mirror(plain.features))]


def uniform_positions(motion: Motion) -> Array:
    """Joints (frames, 22, 3) of the uniform person who does what ``motion`` does: at 20 per second, from the origin,
    facing +Z, the lowest point at y = 0."""
    person = to_smpl22(motion)
    return uniform_person(person.positions(), person.fps)


def _example(motion: Motion, captioned: CaptionedClip) -> Example:
    positions = uniform_positions(motion)[: MOST_FRAMES + 1]
    name = captioned.path.stem
    count = len(positions) - 1
    features = hml.encode(positions, heading="corrected")
    if count >= LENGTH:
        return Example(name, captioned.captions, features, (0, count))
    looped = augment.loop(features, LENGTH) if _goes_on(positions) else None
    if looped is not None:
        return Example(name, captioned.captions, looped, (0, len(looped)), looped=True)
    more = LENGTH - count
    longer = augment.with_pauses(positions, more, more, fps=FPS, seed=0)
    return Example(name, captioned.captions, hml.encode(longer, heading="corrected"), (more, more + count))


def _goes_on(positions: Array) -> bool:
    """Whether somebody goes somewhere all the time, or does the same again and again, so that a loop is true."""
    way = np.linalg.norm(np.diff(positions[:, 0][:, [0, 2]], axis=0), axis=-1) * FPS
    third = max(1, len(way) // 3)
    return bool(min(way[:third].mean(), way[-third:].mean()) > 0.25)


SHORTEST = 0.7
"""Seconds of the shortest clip that shows an action."""
LEGS = (0.4, 1.4)
"""Metres of thigh and shin: children to giants."""
FACTORS = (0.01, 0.001, 0.1, 0.0254, 100.0, 1000.0, 10.0, 39.37)
"""By which a unit is commonly wrong."""
STILL = 0.06
"""Metres: if no joint ever gets further from where it was than this, nothing happens."""
OVER_FLOOR, SHARE_IN_AIR = 0.12, 0.4
"""Metres over the lowest point of the clip, and the share of frames, beyond which somebody floats."""
FAR_FROM_FLOOR = 0.25
"""Metres between the lowest point of a clip and y = 0 that are worth a word."""
LEAP = 15.0
"""Metres per second of the pelvis: faster than anybody runs."""
SLIDES = 0.35
"""`FootSkate.ratio` beyond which feet slide: recorded walks have less than a tenth."""


@dataclass(frozen=True)
class Finding:
    """One thing that is wrong with a clip."""

    sentence: str
    fatal: bool
    """True where nothing sensible can be learned; else it is a thing to look at."""


def check_clip(motion: Motion) -> list[Finding]:
    """What is wrong with a clip, the fatal first; empty for a good one.

    motion: as read, in metres. Sizes and places are judged on the clip's own joints, movement on the uniform person.
    Raises `MotionloomError` for a skeleton that is no person's.
    """
    leg = read_body(motion.skeleton).leg
    own = joints22(motion)
    findings = [*_of_size(leg, motion.seconds)]
    if not findings:
        uniform = uniform_positions(motion)
        findings = [*_of_movement(uniform, own / max(leg, 1e-9) * 0.85, motion.fps), *_of_floor(own)]
        if faults := compare(hml.resample_positions(own, motion.fps)[: len(uniform)], uniform).faults():
            text = f"its body does not do what was recorded: {', '.join(faults[:4])}"
            findings.append(Finding(text, fatal=False))
    return sorted(findings, key=lambda one: not one.fatal)


def check_file(motion_or_error: Motion | MotionloomError) -> list[Finding]:
    """`check_clip` of what a reader gave; what could not be read is a finding too."""
    if isinstance(motion_or_error, MotionloomError):
        return [Finding(str(motion_or_error), fatal=True)]
    try:
        return check_clip(motion_or_error)
    except MotionloomError as error:
        return [Finding(str(error), fatal=True)]


def _of_size(leg: float, seconds: float) -> Iterator[Finding]:
    """Unit and length, without which nothing else can be judged."""
    if not LEGS[0] <= leg <= LEGS[1]:
        near = next((factor for factor in FACTORS if LEGS[0] <= leg * factor <= LEGS[1]), None)
        advice = (
            "" if near is None else f"; in a unit {near:g} times as large they would be {leg * near:.2f} m (--unit)"
        )
        yield Finding(f"its legs are {leg:.3g} m long, so the unit of length is wrong{advice}", fatal=True)
    if seconds < SHORTEST:
        yield Finding(f"it is {seconds:.2f} s short; at least {SHORTEST:g} s show an action", fatal=True)


def _of_movement(uniform: Array, own: Array, fps: float) -> Iterator[Finding]:
    """uniform: joints of the uniform person; own: those of the clip on legs of the person's length."""
    if np.linalg.norm(uniform - np.median(uniform, axis=0), axis=-1).max() < STILL:
        yield Finding(f"nothing moves: no joint gets {100 * STILL:.0f} cm away from its place", fatal=True)
    speed = np.linalg.norm(np.diff(own[:, 0], axis=0), axis=-1) * fps
    if len(speed) and speed.max() > LEAP:
        leap, second = speed.max() / fps, int(speed.argmax()) / fps
        text = f"the body leaps {leap:.2f} m from one frame to the next at {second:.2f} s; cut the clip there"
        yield Finding(text, fatal=True)
    trunk = uniform[:, 12] - uniform[:, 0]
    rise = trunk[:, 1] / np.maximum(np.linalg.norm(trunk, axis=-1), 1e-9)
    if np.percentile(rise, 90) <= 0.3:
        text = "the body lies or hangs all the time; if it should stand, the file has another axis up (--up z)"
        yield Finding(text, fatal=False)
    lowest = uniform[..., 1].min(axis=1)
    share = float((lowest - np.percentile(lowest, 1) > OVER_FLOOR).mean())
    if share > SHARE_IN_AIR:
        text = f"it floats: for {100 * share:.0f} % of the time no part of the body is within {100 * OVER_FLOOR:.0f} cm"
        text += " of the floor; the floor is not level, or what is climbed on is missing"
        yield Finding(text, fatal=False)
    skate = ph.foot_skate(uniform, FPS, floor=ph.floor_height(uniform))
    if skate.ratio > SLIDES:
        often = f"{100 * skate.ratio:.0f} % of the frames"
        text = f"feet slide on the floor in {often}, and that is learned too; lock them first"
        yield Finding(text, fatal=False)


def _of_floor(own: Array) -> Iterator[Finding]:
    height = float(np.percentile(own[..., 1].min(axis=1), 2))
    if abs(height) > FAR_FROM_FLOOR:
        where = "above" if height > 0 else "below"
        yield Finding(f"its floor is {abs(height):.2f} m {where} y = 0; it is put onto the floor", fatal=False)
