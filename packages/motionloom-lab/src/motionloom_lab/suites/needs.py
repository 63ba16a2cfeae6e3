"""Whether data hold what a suite measures, asked before it begins: a suite is skipped where they do not."""

import csv
import re
from collections.abc import Callable
from pathlib import Path

from motionloom.errors import MotionloomError
from motionloom.io.atomic import finished
from motionloom_lab.papers.readers import find_pairs
from motionloom_train.data.pairs import Pair


class NoData(MotionloomError):
    """The kind of data that a suite needs is not there: nothing is wrong, and there is nothing to measure."""


def pairs_of(
    data: Path | str | None, *, captions: bool = True, say: Callable[[str], None] = lambda line: None
) -> list[Pair]:
    """`data.pairs.find_pairs`; raises NoData where a folder has no pairs at all, and as it does for pairs that are
    not right."""
    if data is None:
        raise MotionloomError("two people are compared with real pairs, and none are shipped; name some with --data")
    try:
        return find_pairs(data, captions=captions, say=say)
    except MotionloomError as error:
        if Path(data).is_dir() and not has_pairs(Path(data)):
            raise NoData(str(error)) from None
        raise


def has_pairs(folder: Path) -> bool:
    """Whether anything in a folder says that it belongs to a pair, by the layouts of `find_pairs`."""
    from motionloom_lab.papers.threedpw import is_3dpw

    if (folder / "manifest.csv").is_file():
        try:
            with open(folder / "manifest.csv", newline="", encoding="utf-8") as lines:
                return any(row.get("partner") for row in csv.DictReader(lines))
        except (OSError, ValueError, csv.Error):
            return True  # it cannot be read, which is another matter
    if is_3dpw(folder):
        return True
    beside = any(re.fullmatch(r".+_[ab]", path.stem) for path in finished(folder, "*.bvh"))
    return beside or bool(finished(folder, "*/[ab].bvh"))


def need_pairs(data: Path) -> None:
    """Raises NoData where a folder holds no pairs of people."""
    if not has_pairs(data):
        raise NoData(f"{data} holds no recordings of two people together")


def need_captions(data: Path) -> None:
    """Raises NoData where no held-out clip has a caption; MotionloomError where there are no clips."""
    from motionloom_lab.suites.clips import real_clips

    if (data / "new_joint_vecs").is_dir():  # HumanML3D: a text for each motion
        return
    if not any(clip.held_out and clip.captions for clip in real_clips(data)):
        raise NoData(f"no held-out clip of {data} has a caption")


def need_recordings(data: Path) -> None:
    """Raises NoData where a built set has no clip of CMU's test subjects; other folders are recognised as they are
    read."""
    from motionloom_lab.suites.prediction_trial import CMU_TEST

    clips = data / "clips"
    if clips.is_dir() and not any(path.stem.split("_")[0] in CMU_TEST for path in finished(clips, "*.safetensors")):
        raise NoData(f"{data} has no recordings of the people whose futures are predicted")
