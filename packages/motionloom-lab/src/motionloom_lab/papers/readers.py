"""Folders of recordings, foreign data sets among them: BABEL for training sets, 3DPW for two people."""

from collections.abc import Callable, Iterator
from pathlib import Path

from motionloom_lab.papers import babel, threedpw
from motionloom_train.data import pairs, sources
from motionloom_train.data.pairs import Pair
from motionloom_train.data.progress import Say, silent
from motionloom_train.data.sources import Places, Span, Take, places_of


def find_takes(folder: Path | str, *, captions: Path | str | None = None) -> list[Take]:
    """As `data.sources.find_takes`, and the takes of a BABEL folder."""
    folder = Path(folder)
    own = (folder / "manifest.csv").is_file() or (folder / "new_joint_vecs").is_dir()
    if folder.is_dir() and not own and babel.is_babel(folder):
        return list(_babel(folder))
    return sources.find_takes(folder, captions=captions)


def find_pairs(folder: Path | str, *, captions: bool = True, say: Say = silent) -> list[Pair]:
    """As `data.pairs.find_pairs`, and the pairs of a 3DPW folder, as its owners or ComMDM's distribute it."""
    folder = Path(folder)
    if folder.is_dir() and threedpw.is_processed(folder):
        return threedpw.read_processed(folder, say=say)
    if folder.is_dir() and not (folder / "manifest.csv").is_file() and threedpw.is_3dpw(folder):
        return threedpw.read_3dpw(folder, say=say)
    return pairs.find_pairs(folder, captions=captions, say=say)


def _babel(folder: Path) -> Iterator[Take]:
    """BABEL beside AMASS: every labelled stretch keeps its label, in seconds of the recording."""
    for recording in babel.find_recordings(folder):
        spans = [Span(0.0, float("inf"), recording.whole, "human")] if recording.whole else []
        spans += [Span(s.start, s.end, (s.text,), "human") for s in recording.segments if not s.is_transition]
        yield Take(
            recording.name, "babel", babel.LICENCE, recording.split, tuple(spans), _babel_reader(folder, recording)
        )


def _babel_reader(folder: Path, recording: babel.Recording) -> Callable[[], Places]:
    return lambda: places_of(babel.read_amass(babel.find_motion(folder, recording)))
