"""What every command makes of fixed seeds: the commands, and how they are run and recorded.

The commands are typed as a user types them, so that no move or new name inside the package touches this file.
"""

import contextlib
import io
import json
from dataclasses import replace
from pathlib import Path

import numpy as np

from motionloom import Motion, load, save
from motionloom.cli import main

ROOT = Path(__file__).parents[4]
CLIP = str(ROOT / "examples" / "clips" / "walk.bvh")
GOALS, MASKS = ROOT / "examples" / "goals", ROOT / "examples" / "masks"
RECORDED = Path(__file__).parent / "recorded.npz"
EVERY = 4
"""One frame of so many is recorded."""

WALK = "a person walks forward"
TIMELINES = {
    "goals": {
        "seed": 5,
        "segments": [
            {"text": WALK, "seconds": 1.5},
            {
                "text": "a person raises the left hand",
                "seconds": 1.5,
                "transition": 0.5,
                "guidance": 3,
                "goal": {"joints": [{"joint": "left_wrist", "points": [{"time": 1, "position": [None, 1.7, None]}]}]},
            },
        ],
    },
    "path": {
        "seed": 3,
        "path": {"path": {"points": [[0, 0], [0.5, 1], [0, 3]]}},
        "segments": [{"text": WALK, "seconds": 1.5}, {"text": "a person runs", "seconds": 1.5}],
    },
    "start": {
        "start": "beside.bvh",
        "segments": [{"text": WALK, "seconds": 1.2}, {"text": "a person jumps", "seconds": 1.2}],
    },
    "duet": {
        "seed": 4,
        "segments": [
            {"text": f"{WALK} :: a person waits", "seconds": 1.5},
            {"text": "two people dance", "seconds": 1.5, "transition": 0.6},
        ],
    },
    "live": {
        "seconds": 3,
        "seed": 5,
        "commands": [
            {"at": 0, "say": WALK},
            {"at": 0.8, "steer": {"direction": 60}},
            {"at": 1.6, "steer": {"direction": 0, "speed": 1.4, "facing": 20}},
            {"at": 2.3, "reach": {"joint": "left_wrist", "position": [0.5, 1.2, 3], "within": 0.5}},
        ],
    },
}
"""Written beside the outputs as NAME.yaml (JSON is YAML)."""

FEW = ("--steps", "4")
COMMANDS: dict[str, tuple[str, ...]] = {
    "generate": ("generate", WALK, "a person jumps", "--seconds", "2", "--count", "2", *FEW),
    "generate raw": ("generate", WALK, "--seconds", "2", "--raw", *FEW),
    "generate ddim": ("generate", WALK, "--seconds", "1.5", "--solver", "ddim", "--guidance", "5", *FEW),
    "generate dpm2m": ("generate", WALK, "--seconds", "1.5", "--solver", "dpm2m", "--fps", "30", *FEW),
    "generate dpm2m-sde": ("generate", WALK, "--seconds", "1.5", "--solver", "dpm2m-sde", "--seed", "7", *FEW),
    "compose": ("compose", WALK, "a person jumps", "a person waves", "--seconds", "1.5", "--transition", "0.5", *FEW),
    "compose raw": ("compose", WALK, "a person turns", "--seconds", "1.5", "--raw", *FEW),
    "compose goals": ("compose", "{work}/goals.yaml", *FEW),
    "compose path": ("compose", "{work}/path.yaml", *FEW),
    "compose start": ("compose", "{work}/start.yaml", *FEW),
    "live": ("live", "{work}/live.yaml", *FEW),
    "live start": ("live", "{work}/live.yaml", "--start", CLIP, "--fps", "30", *FEW),
    "control path": ("control", WALK, "--goal", str(GOALS / "s_curve.json"), "--seconds", "2", *FEW),
    "control drawing": ("control", WALK, "--path", str(GOALS / "figure_eight.svg"), "--seconds", "2", *FEW),
    "control stop": ("control", WALK, "--goal", str(GOALS / "stop.json"), "--seconds", "6", *FEW),
    "control joints": ("control", "a person stands", "--goal", str(GOALS / "wrist_every_second.json"), *FEW),
    "control curve": ("control", "a person stands", "--goal", str(GOALS / "letter.json"), "--seconds", "4", *FEW),
    "control heights": ("control", "a person squats", "--goal", str(GOALS / "heights.json"), "--raw", *FEW),
    "control pose": ("control", WALK, "--goal", str(GOALS / "start_pose.json"), *FEW),
    "control loose": ("control", WALK, "--goal", str(GOALS / "s_curve.json"), "--seconds", "2", "--loose", *FEW),
    "control follow": ("control", WALK, "--follow", "left_wrist", "--follow", "head", "--from", CLIP, *FEW),
    "edit text": ("edit", CLIP, "a person waves", "--strength", "0.6", "--count", "2", *FEW),
    "edit keep": ("edit", CLIP, "a person waves", "--keep", "lower_body", *FEW),
    "edit root": ("edit", CLIP, "a person runs", "--keep", "root", "--keep", "left_arm", "--raw", *FEW),
    "edit between": ("edit", CLIP, "a person jumps", "--between", "0.5", "1", "--between", "1.3", "1.6", *FEW),
    "edit extend": ("edit", CLIP, "--extend", "1.5", *FEW),
    "edit loop": ("edit", CLIP, "--loop", "--blend", "0.6", *FEW),
    "edit smpl": ("edit", "{work}/larger.bvh", "a person waves", "--skeleton", "smpl", *FEW),
    "edit larger": ("edit", "{work}/larger.bvh", "a person waves", "--keep", "upper_body", *FEW),
    "predict": ("predict", CLIP, "--count", "2", "--seconds", "2.5", "--no-picture", *FEW),
    "predict raw": ("predict", CLIP, "--count", "1", "--raw", "--temperature", "0.8", "--no-picture", *FEW),
    "predict larger": ("predict", "{work}/larger.bvh", "--count", "1", "--no-picture", *FEW),
    "predict no root": ("predict", CLIP, "--count", "1", "--no-root", "--no-picture", *FEW),
    "predict hold": (
        "predict",
        CLIP,
        "--end",
        "0.6",
        "--count",
        "1",
        "--hold",
        "left_arm",
        "--from",
        CLIP,
        "--from-time",
        "0.6",
        "--seconds",
        "1",
        "--no-picture",
        *FEW,
    ),
    "predict mask": (
        "predict",
        CLIP,
        "--end",
        "0.6",
        "--count",
        "1",
        "--mask",
        str(MASKS / "legs_then_arms.json"),
        "--from",
        CLIP,
        "--seconds",
        "2",
        "--no-picture",
        *FEW,
    ),
    "predict retarget": (
        "predict",
        "{work}/larger.bvh",
        "--end",
        "0.6",
        "--count",
        "1",
        "--hold",
        "upper_body",
        "--from",
        CLIP,
        "--retarget",
        "--seconds",
        "1",
        "--no-picture",
        *FEW,
    ),
    "switch": ("switch", CLIP, "{work}/beside.bvh", "--count", "2", *FEW),
    "switch kept": ("switch", CLIP, "{work}/beside.bvh", "--facing", "kept", "--seconds", "1.8", *FEW),
    "duet": ("duet", "two people dance", "--seconds", "1.5", "--count", "2", *FEW),
    "duet words": ("duet", f"{WALK} :: a person waits", "--seconds", "1.5", "--together", "0", "--raw", *FEW),
    "duet past": ("duet", "two people walk", "--past", CLIP, "{work}/beside.bvh", "--seconds", "1", *FEW),
    "duet given": ("duet", "a person waves", "--given", CLIP, *FEW),
    "duet timeline": ("duet", "--timeline", "{work}/duet.yaml", *FEW),
    "duet path": ("duet", WALK, "--path", str(GOALS / "s_curve.json"), "--person", "2", "--seconds", "2", *FEW),
}
"""Name -> what is typed; {work} is a folder with the files of `write_inputs`."""


def write_inputs(folder: Path) -> None:
    """The files that commands read and that are no examples: timelines, and two more people made of the clip."""
    for name, timeline in TIMELINES.items():
        (folder / f"{name}.yaml").write_text(json.dumps(timeline))
    clip = load(CLIP)
    mirrored = clip.mirror()
    save(replace(mirrored, root=mirrored.root + np.array([1.2, 0.0, 0.3])), folder / "beside.bvh")
    bones = replace(clip.skeleton, offsets=clip.skeleton.offsets * 1.3)
    save(Motion(bones, clip.fps, clip.root * 1.3, clip.rotations).resample(30), folder / "larger.bvh")


def places(name: str, folder: Path) -> np.ndarray:
    """All joint positions that a command makes, (frames, joints, 3) metres, its files one behind the other."""
    write_inputs(folder)
    made = folder / "made"
    made.mkdir()
    words = [word.replace("{work}", str(folder)) for word in COMMANDS[name]]
    files = ["out.npz"] if words[0] != "duet" else ["a.npz", "b.npz"]
    for file in files:
        words += ["--out", str(made / file)]
    said = io.StringIO()
    with contextlib.redirect_stdout(said), contextlib.redirect_stderr(said):
        code = main(words)
    if code:
        raise RuntimeError(f"{' '.join(words)} ended with {code}: {said.getvalue()}")
    return np.concatenate([load(path).positions() for path in sorted(made.glob("*.npz"))])


def sampled(positions: np.ndarray) -> np.ndarray:
    """The frames that are recorded."""
    return positions[::EVERY].astype(np.float64)
