"""What the commands that write motions share about skeletons: ``--skeleton`` and how a motion is put on it."""

import tempfile
import warnings
from argparse import Namespace
from collections.abc import Callable, Sequence
from dataclasses import dataclass, field, replace
from math import degrees
from pathlib import Path

from motionloom import io
from motionloom.cli.reading import legs_of
from motionloom.cli.terminal import note
from motionloom.cli.writing import fail
from motionloom.core.errors import MotionloomError
from motionloom.core.files.bvh_writer import save_bvh
from motionloom.core.ground import GroundPose
from motionloom.core.motion import Motion, ground_pose
from motionloom.core.skeleton import SMPL22, Skeleton
from motionloom.formats import characters, find, readable
from motionloom.io.asf import load_skeleton
from motionloom.io.bvh import read_bvh
from motionloom.io.character import Character
from motionloom.io.gltf_mesh import read_surfaces
from motionloom.io.gltf_read import open_glb
from motionloom.io.stream import PERSON, Kept, Stream, check_length, open_stream
from motionloom.retarget import RootMode, retarget
from motionloom.retarget.anatomy import HUMAN_LEGS, Body, read_body
from motionloom.retarget.hands import HandPose, check_fingers, pose_hands
from motionloom.retarget.named import NAMED, named_skeleton
from motionloom.retarget.root import place_root
from motionloom.retarget.stand import HERE, moved, shares_world, started, world_of
from motionloom.retarget.toes import bend_toes


@dataclass(frozen=True)
class Target:
    """A skeleton for motions, with the conventions of its own file; or none: motions keep their own."""

    name: str = ""
    skeleton: Skeleton | None = None
    unit: float | None = None
    """Metres per unit of a BVH; None: those of the file that was read, else 1."""
    orders: dict[str, str] = field(default_factory=dict)
    character: Character | None = None
    at: str | None = None
    """Where motions start: character or origin; None: where the character is, if that is not the origin."""
    root: RootMode = "motion"
    hands: HandPose = "as-is"
    joint_map: Path | None = None
    clip_names: tuple[str, ...] = ()
    """Of the animations that are written: none, one for all, or one for each."""
    replace: bool = False
    one_file: bool = False
    """Whether several motions become animations of one file."""

    def like(self, unit: float | None, orders: dict[str, str]) -> "Target":
        """The target of a motion whose own BVH has this unit and these orders, which it keeps with its skeleton."""
        return self if self.skeleton else replace(self, unit=self.unit or unit, orders=orders)

    def retarget(self, motion: Motion, *, source: str = "the motion", source_map: Path | None = None) -> Motion:
        """The motion on this skeleton, where the character is; ``source`` names it in an error."""
        if self.skeleton is None:
            return motion
        place = self.place
        if place is None or (self.at is None and shares_world(motion, self.skeleton)):
            return self._retarget(motion, lambda own, body: own, source, source_map)
        return self._retarget(motion, lambda own, body: started(own, body, place), source, source_map)

    def retarget_all(self, motions: Sequence[Motion]) -> list[Motion]:
        """Motions of one world, each on this skeleton, the world's origin where the character is."""
        if self.skeleton is None:
            return list(motions)
        world = self.place or HERE
        return [
            self._retarget(motion, lambda own, body: own if world == HERE else moved(own, body, world))
            for motion in motions
        ]

    def _retarget(
        self,
        motion: Motion,
        move: Callable[[Motion, Body], Motion],
        source: str = "the motion",
        source_map: Path | None = None,
    ) -> Motion:
        assert self.skeleton is not None
        try:
            own = retarget(motion, self.skeleton, source_map=source_map, target_map=self.joint_map)
        except MotionloomError as error:
            hint = "--source-map or --target-map"
            raise MotionloomError(f"{source} onto {self.name}: {error} ({hint})") from None
        body = self.body
        return pose_hands(place_root(move(bend_toes(own, body), body), body, self.root), self.hands, self.joint_map)

    @property
    def body(self) -> Body:
        """The parts of the skeleton."""
        assert self.skeleton is not None
        return read_body(self.skeleton, self.joint_map)

    @property
    def place(self) -> GroundPose | None:
        """Where motions are to start; None: where they do."""
        if self.character is None:
            return None
        if self.at == "origin":
            return HERE
        own = self.character.stand
        return own if self.at == "character" or own != HERE else None

    def from_motion(self, motion: Motion) -> GroundPose:
        """Where the world of a uniform person's motion, at this size, is in the world of what `retarget` returns."""
        place = self.place
        return HERE if place is None else world_of(ground_pose(motion.thinned(1).positions()[0] * self.size), place)

    @property
    def metre(self) -> float:
        """Metres of goals that one of the uniform person's becomes: goals are the person's, but for a robot."""
        return 1.0

    @property
    def size(self) -> float:
        """How long its legs are, in those of the uniform person: a walk goes so much further on it."""
        return self.body.leg / read_body(SMPL22).leg if self.skeleton else 1.0

    @property
    def suffix(self) -> str | None:
        """How the character's own file ends."""
        return Path(self.name).suffix.lower() if self.character else None

    @property
    def suffixes(self) -> tuple[str, ...]:
        """How files may end that are the character's own with one more animation."""
        return () if self.character is None else (*self.character.suffixes, ".fbx")

    def writes(self, path: Path) -> bool:
        """Whether a file of this name is the character's own with one more animation."""
        return path.suffix.lower() in self.suffixes

    def holds_all(self, path: Path) -> bool:
        """Whether one file of this name gets several motions as animations."""
        return self.one_file and self.writes(path)

    def names(self, captions: Sequence[str]) -> list[str]:
        """What motions of these captions are called in the character's file; refuses names of another count."""
        if len(self.clip_names) not in (0, 1, len(captions)):
            needed = (
                "one motion needs one --clip-name"
                if len(captions) == 1
                else (f"{len(captions)} motions need one --clip-name or {len(captions)}")
            )
            fail(f"{needed}; got {len(self.clip_names)}")
        several = self.clip_names * len(captions) if len(self.clip_names) == 1 else self.clip_names
        return list(several or captions)

    def save(self, motion: Motion, path: Path, *, caption: str | None = None) -> Path:
        """Write a motion that is on the skeleton; the suffix picks the format.

        ``caption`` labels a picture, and is the animation's name where the line gives none.
        """
        if self.character is not None and self.writes(path):
            name = self.clip_names[0] if len(self.clip_names) == 1 else caption
            return self._save_own(self.character, [(motion, name)], path)
        if self.character is not None and path.suffix.lower() == ".usda":
            from motionloom.io.usda import save_usda

            surfaces = read_surfaces(self.character, remark=True)
            return save_usda([motion], path, surfaces=surfaces or None)
        if self.plays_in(path):
            return self._save_page([(caption or "", [motion])], path)
        if path.suffix.lower() == ".bvh":
            return save_bvh(motion, path, order=self.orders, unit=self.unit or 1.0)
        return io.save(motion, path, captions=None if caption is None else [caption])

    def save_all(self, motions: Sequence[Motion], files: Sequence[Path], captions: Sequence[str]) -> list[Path]:
        """Write motions that are on the skeleton into the files of one ``--out``, one each or one for all."""
        if self.holds_all(files[0]):
            return [self.save_clips(motions, files[0], self.names(captions))]
        if len(files) == len(motions):
            return [self.save(one, file, caption=caption) for one, file, caption in zip(motions, files, captions)]
        if self.plays_in(files[0]):
            return [
                self._save_page([(caption, [one]) for caption, one in zip(captions, motions, strict=True)], files[0])
            ]
        return [io.save(list(motions), files[0], captions=captions)]

    def save_together(self, people: Sequence[Motion], path: Path, caption: str) -> Path:
        """Write two people who were `retarget_all` into one file."""
        if self.plays_in(path):
            return self._save_page([(caption, people)], path)
        return io.save_scene(people, path, names=["first", "second"], captions=[caption] * 2)

    def open(self, path: Path, *, total: int, fps: float, joints: int = PERSON, caption: str = "") -> Stream:
        """A file for ``total`` frames that come in pieces; they are put on the skeleton when all of them are there."""
        if self.skeleton is None:
            unit = self.unit or 1.0
            return open_stream(path, total=total, fps=fps, caption=caption, joints=joints, order=self.orders, unit=unit)
        check_length(path, total=total, fps=fps, joints=len(self.skeleton))
        self.names([caption])
        return Kept(path, lambda whole: self.save(self.retarget(whole), path, caption=caption))

    def motion_for(self, motion: Motion, path: Path) -> Motion:
        """A motion that is on the skeleton, as a file of poses gets it."""
        return motion

    def summary(self) -> str:
        """What the file that was written last holds, where that is not the motion itself; else empty."""
        return ""

    def plays_in(self, path: Path) -> bool:
        """Whether a file of this name is a page in which the character plays."""
        return self.character is not None and path.suffix.lower() == ".html"

    def _save_page(self, takes: Sequence[tuple[str, Sequence[Motion]]], path: Path) -> Path:
        """Takes, names and people, as a page in which the character plays."""
        from motionloom.viz.page import Take, write_page

        return write_page([Take(name, people) for name, people in takes], path, character=self.character)

    def save_clips(self, motions: Sequence[Motion], path: Path, names: Sequence[str]) -> Path:
        """Write motions that are on the skeleton as animations of the character's own file."""
        assert self.character is not None
        return self._save_own(self.character, list(zip(motions, names, strict=True)), path)

    def _save_own(self, character: Character, clips: Sequence[tuple[Motion, str | None]], path: Path) -> Path:
        """The character's own file with more animations; as FBX by way of a GLB."""
        if path.suffix.lower() != ".fbx":
            return character.save_clips(clips, path, replace=self.replace)

        from motionloom.io.blender import glb_to_fbx

        if ".glb" not in character.suffixes:
            fail(f"a {character.path.suffix} character is not written as {path}; give it as a .glb")
        with tempfile.TemporaryDirectory() as folder:
            glb = character.save_clips(clips, Path(folder) / "moving.glb", replace=self.replace)
            try:
                return glb_to_fbx(glb, path, fps=clips[0][0].fps)
            except MotionloomError as error:
                raise MotionloomError(str(error).replace(str(glb), str(character.path))) from None


def own_outs(arguments: Namespace, name: str) -> list[Path]:
    """The files to write where the line names none: ``name`` as a BVH, or as the character is."""
    if arguments.robot is not None:
        return [Path(name + ".csv")]
    own = Path(arguments.skeleton or "").suffix.lower()
    return [Path(name + (own if own in characters() else ".bvh"))]


OF_SKELETON = ("root", "hands", "at", "clip_name", "replace", "one_file", "target_map")
"""Options of how motions are put on a skeleton."""


def refuse(arguments: Namespace, names: Sequence[str], why: str) -> None:
    """Refuse options that the line has although they do not go with the rest of it."""
    for name in names:
        if getattr(arguments, name, None):
            fail(f"--{name.replace('_', '-')} {why}")


def read_target(arguments: Namespace, outs: Sequence[Path]) -> Target:
    """The skeleton of the line for motions; refuses options and files that do not go with it."""
    if arguments.robot is not None:
        from motionloom.cli.robots import read_robot_target

        return read_robot_target(arguments)
    own = ("robot_map", "max_speed", "avoid_collisions", "no_header", "figures")
    refuse(arguments, own, "goes with a --robot; name its model")
    if arguments.skeleton is None:
        refuse(arguments, OF_SKELETON, "goes with a --skeleton; name one")
        _note_mannequin(arguments, outs)
        return Target(unit=arguments.out_unit)
    target = _find(arguments)
    if arguments.out_unit is not None:
        target = replace(target, unit=arguments.out_unit)
    _check_humanoid(target)
    if target.character is not None:
        path = Path(target.name)
        own = arguments.clip_name or arguments.replace or target.one_file
        if own and not any(target.writes(out) or not out.suffix for out in outs):
            fail(f"--clip-name, --replace and --one-file are for the character's own file, a {path.suffix}")
        for out in outs:
            if out.suffix.lower() == ".glb" and not target.writes(out):
                fail(f"{out} cannot contain the character; give a name that ends in {path.suffix}")
            if out.exists() and out.resolve() == path.resolve():
                fail(f"{out} is the character itself; give the moving one another name with --out")
        _note_place(target)
    elif arguments.clip_name or arguments.replace or arguments.at or target.one_file:
        fail(f"--clip-name, --replace, --one-file and --at are for .glb, .gltf and .vrm characters; got {target.name}")
    return target


def _note_place(target: Target) -> None:
    """Note where motions start, where the line does not name it and it is not the origin."""
    if target.at is None and target.place is not None:
        place = target.place
        note(
            f"{target.name} stands at x {place.x:.2f}, z {place.z:.2f} m and faces {degrees(place.facing):.0f} "
            "degrees to the left of +Z; its motions start there (--at origin: at the origin, facing +Z)"
        )


def _note_mannequin(arguments: Namespace, outs: Sequence[Path]) -> None:
    """Note that a character whose motion is read does not come out itself."""
    source = next((getattr(arguments, name) for name in ("inputs", "clip", "past") if hasattr(arguments, name)), None)
    source = source[0] if isinstance(source, list) else source
    bodies = [out for out in outs if out.suffix.lower() in (".glb", ".usda", ".fbx")]
    if not isinstance(source, Path) or source.suffix.lower() not in characters(alone=True) or not bodies:
        return

    gltf = open_glb(source).document.json
    if gltf.get("meshes") and gltf.get("asset", {}).get("generator") != "motionloom":
        note(f"{bodies[0]} gets a simple body; --skeleton {source} writes that character with one more animation")


def _check_humanoid(target: Target) -> None:
    """Refuse a skeleton that is no person, or has no fingers for ``--hands``, before anything is sampled."""
    try:
        body = target.body
    except MotionloomError as error:
        raise MotionloomError(f"--skeleton {target.name}: {error} (--target-map)") from None
    if body.upright and body.up[1] < 0.9:
        warnings.warn(
            f"--skeleton {target.name} does not stand along +Y at rest (it lies, or was made with another axis up); "
            "its motions do",
            stacklevel=2,
        )
    if target.hands != "as-is":
        check_fingers(body)


def _find(arguments: Namespace) -> Target:
    name, path = arguments.skeleton, Path(arguments.skeleton)
    suffix = path.suffix.lower()
    options = {
        "root": arguments.root or "motion",
        "at": arguments.at,
        "hands": arguments.hands or "as-is",
        "joint_map": arguments.target_map,
        "clip_names": tuple(arguments.clip_name or ()),
        "replace": arguments.replace,
        "one_file": getattr(arguments, "one_file", False),
    }
    if name.lower() in NAMED and not path.exists():
        return Target(name, named_skeleton(name.lower()), **options)
    if suffix == ".bvh":
        file = read_bvh(path)
        leg, unit = legs_of(file.motion.skeleton), getattr(arguments, "unit", None)
        if leg and unit and HUMAN_LEGS[0] <= leg * unit / file.unit <= HUMAN_LEGS[1]:
            file = read_bvh(path, unit=unit)  # with other legs it is the unit of the motion that is read
        return Target(name, file.motion.skeleton, unit=file.unit, orders=dict(file.orders), **options)
    if suffix == ".asf":
        return Target(name, load_skeleton(path), **options)
    if find(path).character:
        character = io.open_character(path, joint_map=arguments.target_map)
        return Target(name, character.skeleton, character=character, **options)
    if suffix not in readable():
        fail(f"--skeleton needs {', '.join(NAMED)} or a file (.asf, {', '.join(readable())}); got {name!r}")
    return Target(name, io.load(path).skeleton, **options)
