"""Where the files of predictions go, and how they are written: futures, pictures of them, and futures of hours."""

from collections.abc import Iterable, Iterator, Sequence
from contextlib import ExitStack
from dataclasses import dataclass, field
from itertools import chain
from pathlib import Path

from motionloom.cli.sampling import fail, numbered, write_pieces
from motionloom.cli.skeletons import Target
from motionloom.core.errors import MotionloomError
from motionloom.core.motion import Motion
from motionloom.formats import writable
from motionloom.io import check_output, check_program
from motionloom.io.folder import atomic_folder, check_folder
from motionloom.io.stream import Stream, joined

OVERLAYS = (".png", ".mp4", ".gif")
PICTURED = 50
"""Futures that pictures show, the first ones."""
BEFORE, BEHIND = 2.0, 10.0
"""Seconds of the past, and of futures of any length, that pictures show."""


@dataclass(frozen=True)
class Files:
    """The files of one ``--out``."""

    folder: Path
    futures: tuple[tuple[str, ...], ...]
    """For each format one name per future."""
    overlays: tuple[str, ...]
    """Pictures of all futures over each other."""

    @property
    def files(self) -> list[Path]:
        """All places, in the order in which they are reported."""
        return [self.folder / name for names in (*self.futures, self.overlays) for name in names]


def targets(
    outs: Sequence[Path], count: int, formats: Sequence[str], *, pictures: bool, own: str | None = None
) -> list[Files]:
    """The files to write; refuses places that cannot be, before any work; ``own`` is a character's own suffix."""
    if len({out.resolve() for out in outs}) != len(outs):
        fail("the same --out is given twice; give each its own name")
    places = [_files(out, count, formats, pictures=pictures, own=own) for out in outs]
    for place in (place for files in places if files.folder.is_dir() for place in files.files):
        check_output(place, own=own)
    return places


def _files(out: Path, count: int, formats: Sequence[str], *, pictures: bool, own: str | None) -> Files:
    suffix = out.suffix.lower()
    if suffix in (*writable(), own) and not out.is_dir():
        check_output(out, own=own)
        if suffix in OVERLAYS:
            return Files(out.parent, (), (out.name,))
        return Files(out.parent, (tuple(place.name for place in numbered(out, count)),), ())
    if suffix and not out.is_dir():
        fail(
            f"cannot write {out}: a file ends in {', '.join(writable())}, "
            f"and a folder's name has no ending; got {suffix}"
        )
    check_folder(out)
    width = max(2, len(str(count - 1)))
    names = tuple(tuple(f"future_{i:0{width}d}.{one}" for i in range(count)) for one in dict.fromkeys(formats))
    for one in formats:
        check_program(f"future.{one}")
    return Files(out, names, ("overview.png", _film()) if pictures else ())


def _film() -> str:
    """Name of a folder's film: a .gif where there is no ffmpeg for an .mp4."""
    try:
        check_program("overlay.mp4")
    except MotionloomError:
        return "overlay.gif"
    return "overlay.mp4"


def write_futures(
    outputs: Sequence[Files], motions: Sequence[Motion], past: int, target: Target, *, caption: str
) -> list[Path]:
    """Motions that begin with ``past`` given frames, into all files at once: they all appear, or none does.

    There may be fewer than names in ``outputs``: then the first of those are written. Gives the files that were.
    """
    motions = [target.retarget(motion) for motion in motions]
    with ExitStack() as stack:
        for files in outputs:
            folder = stack.enter_context(atomic_folder(files.folder))
            for names in files.futures:
                for motion, name in zip(motions, names[: len(motions)], strict=True):
                    target.save(motion, folder / name, caption=Path(name).stem)
            draw_overlays(motions, past, [folder / name for name in files.overlays], caption=caption)
    return [
        files.folder / name
        for files in outputs
        for names in (*(names[: len(motions)] for names in files.futures), files.overlays)
        for name in names
    ]


def draw_overlays(motions: Sequence[Motion], past: int, files: Sequence[Path], *, caption: str) -> None:
    """Pictures and films of the first futures over each other; the motions begin with ``past`` common frames."""
    if not files:
        return
    from motionloom.viz.overlay import draw_futures

    known = motions[0].frames(0, past)
    futures = [motion.frames(past, len(motion)) for motion in motions[:PICTURED]]
    for file in files:
        draw_futures(known, futures, file, caption=caption, lead=BEFORE)


# Futures of any length, one after the other, on the disk


@dataclass(eq=False)
class Long:
    """Futures that are written while they are generated, and what became of them."""

    outputs: Sequence[Files]
    target: Target
    past: int
    """Frames that are given, at the beginning of each."""
    frames: int
    """Frames of each, the past's among them."""
    caption: str
    finished: list[tuple[Path, float]] = field(default_factory=list)
    """Files that are whole or, after an interruption, valid, and their seconds (0 of pictures)."""

    def write(self, makers: Iterable[Iterable[Motion]]) -> bool:
        """One future after the other, each in pieces; true if that was interrupted after something was finished.

        A failure in between leaves what was finished too, and its message reports that.
        """
        problem: BaseException | None = None
        with ExitStack() as stack:
            folders = [stack.enter_context(atomic_folder(files.folder)) for files in self.outputs]
            try:
                heads = [self._one(number, pieces, folders) for number, pieces in enumerate(makers)]
                self._draw(heads[:PICTURED], folders)
            except (KeyboardInterrupt, MotionloomError) as error:
                if not self.finished:
                    raise
                problem = error
        if isinstance(problem, MotionloomError):
            raise MotionloomError(f"{problem} (what was finished is in {self.finished_files()})") from problem
        return problem is not None

    def finished_files(self) -> str:
        """What was finished, in words."""
        return ", ".join(f"{path}, {seconds:.2f} s" for path, seconds in self.finished if seconds)

    def _one(self, number: int, pieces: Iterable[Motion], folders: Sequence[Path]) -> Motion | None:
        """Write one future to the end; gives what pictures show of it."""
        coming = iter(pieces)
        first = next(coming)
        streams = self._open(number, first, folders)
        head: list[Motion] = []

        def collect() -> Iterator[Motion]:
            at = 0
            for piece in chain([first], coming):
                yield piece
                head.extend(self._head_of(piece, at) if number < PICTURED else [])
                at += len(piece)

        try:
            write_pieces(collect(), [stream for _, stream in streams])
        finally:
            self.finished += [(place, stream.seconds) for place, stream in streams if stream.saved]
        return joined(head) if head else None

    def _open(self, number: int, piece: Motion, folders: Sequence[Path]) -> list[tuple[Path, Stream]]:
        """The files of one future, and where they will be; those that grow on the disk last: they close first."""
        streams = []
        for files, folder in zip(self.outputs, folders, strict=True):
            for name in (names[number] for names in files.futures):
                joints, caption = len(piece.skeleton), Path(name).stem
                stream = self.target.open(
                    folder / name, total=self.frames, fps=piece.fps, joints=joints, caption=caption
                )
                streams.append((files.folder / name, stream))
        return sorted(streams, key=lambda pair: pair[0].suffix.lower() == ".bvh")

    def _head_of(self, piece: Motion, at: int) -> list[Motion]:
        """What pictures show of a piece whose first frame is number ``at``."""
        first = max(self.past - round(BEFORE * piece.fps) - at, 0)
        behind = min(self.past + round(BEHIND * piece.fps) - at, len(piece))
        return [piece.frames(first, behind)] if first < behind else []

    def _draw(self, heads: Sequence[Motion | None], folders: Sequence[Path]) -> None:
        motions = [head for head in heads if head is not None]
        for files, folder in zip(self.outputs, folders, strict=True):
            if not motions:
                continue
            past = min(self.past, round(BEFORE * motions[0].fps))
            draw_overlays(motions, past, [folder / name for name in files.overlays], caption=self.caption)
            self.finished += [(files.folder / name, 0.0) for name in files.overlays]
