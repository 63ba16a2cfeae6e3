"""The npm package `motionloom` (`studio/packages/prior`) as its users have it: in plain Node, typed, and in a page."""

import json
import shutil
import threading
from functools import partial
from http.server import ThreadingHTTPServer
from pathlib import Path

import numpy as np
import pytest

from motionloom import generate, load
from motionloom.core.models.prior import Prior
from motionloom.core.motion import Motion
from motionloom.core.skeleton import SMPL22
from motionloom.goals.goal import start_of
from motionloom.goals.paths import root_path
from motionloom.goals.segment import Segment
from motionloom.kinematics.physics import turn
from motionloom.requests.sampling import Sampling
from motionloom.tasks.control import steered_features
from motionloom.tasks.long import compose, long_features
from motionloom.tasks.text import sample_features, to_motion
from tests.io.rigged import Hero
from tests.studio import started
from tests.tab import made, numbers
from tests.tab.conftest import Quiet

pytestmark = pytest.mark.slow
PACKAGE = made.STUDIO / "packages" / "prior"
TURN = "turn left 90 degrees"


@pytest.fixture(scope="module")
def app(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A folder of a user who has installed the package, and what it needs."""
    folder = tmp_path_factory.mktemp("app")
    place = folder / "node_modules" / "motionloom"
    place.mkdir(parents=True)
    words = ("build", "--config", str(PACKAGE / "vite.config.ts"), "--outDir", str(place / "dist"), "--emptyOutDir")
    found = made.node("vite/bin/vite.js", *words, "--logLevel", "error")
    assert found.returncode == 0, found.stdout + found.stderr
    shutil.copy(PACKAGE / "package.json", place)
    (folder / "node_modules" / "@types").mkdir()
    for name in ("onnxruntime-web", "three", "@types/three"):
        (folder / "node_modules" / name).symlink_to(made.STUDIO / "node_modules" / name)
    return folder


def in_node(app: Path, folder: Path) -> dict:
    script = Path(shutil.copy(Path(__file__).with_name("in_node.mjs"), app))
    found = made.run(str(script), str(folder))
    assert found.returncode == 0, found.stdout + found.stderr
    return json.loads(found.stdout.splitlines()[-1])


def read(folder: Path, name: str, like: np.ndarray) -> np.ndarray:
    return np.fromfile(folder / name, "<f4").reshape(like.shape)


def alike(folder: Path, number: int, features: np.ndarray, motion: Motion, std: np.ndarray) -> None:
    """The features are the same; so are places and turns, but where last bits of 24 calls let a foot stand or not."""
    assert (np.abs(read(folder, f"{number}.features", features) - features) / std).max() < 2e-2
    apart = np.abs(read(folder, f"{number}.positions", motion.positions()) - motion.positions())
    turns = read(folder, f"{number}.rotations", motion.rotations)
    turned = np.degrees(2 * np.arccos(np.abs((turns * motion.rotations).sum(-1)).clip(0, 1)))
    assert np.quantile(apart, 0.9) < 1e-3
    assert apart.max() < 0.05
    assert np.quantile(turned, 0.9) < 0.1


def test_in_node_it_draws_what_python_draws(app: Path, prior: Prior, tmp_path: Path) -> None:
    """A sentence, a chain, a path and a number in words, on the noise of the same seeds; and refusals are sentences."""
    made.EXPORT["export"](prior, "0" * 64, tmp_path, precise=True)
    text, chain = numbers.SENTENCES[1], numbers.CHAINS[0]
    requests = [
        {"words": text, "seconds": 2.5, "seed": 3},
        {"words": [{"text": one, "seconds": seconds} for one, seconds in chain], "seed": 4},
        {"words": "a person walks", "seconds": 5, "seed": 4, "path": numbers.PATH},
        {"words": TURN, "seed": 2},
        {"words": TURN, "seconds": 2.5, "seed": 2, "literal": True},
    ]
    (tmp_path / "requests.json").write_text(json.dumps(requests))
    said = in_node(app, tmp_path)
    assert said["about"]["licence"] == prior.card.licence
    assert "0.5 to 10 seconds; got 11" in said["failed"]["seconds"]
    assert "whole number from 0" in said["failed"]["seed"]
    assert "two points or more" in said["failed"]["path"]
    assert said["failed"]["signal"] == "AbortError"
    assert "prior.json cannot be read" in said["failed"]["folder"]

    std = np.where(prior.std > 0, prior.std, 1.0)
    [features] = sample_features(prior, [text], [50], seeds=[3])
    motion = to_motion(features.astype(np.float64), prior.fps)
    alike(tmp_path, 0, features, motion, std)
    back = load(tmp_path / "0.bvh")
    assert np.abs(back.root - motion.root).max() < 0.05
    segments = [Segment(one, seconds) for one, seconds in chain]
    features = np.concatenate(list(long_features(prior, segments, sampling=Sampling(seed=4))))
    motion = compose(prior, segments, sampling=Sampling(seed=4))
    alike(tmp_path, 1, features, motion, std)
    goal = root_path(numbers.PATH, frames=100)
    [features] = steered_features(prior, ["a person walks"], goal.relative_to(start_of(goal)), seeds=[4])
    assert (np.abs(read(tmp_path, "2.features", features) - features) / std).max() < 1e-2
    pelvis = np.fromfile(tmp_path / "2.positions", "<f4").reshape(-1, 22, 3)[[0, -1], 0]
    assert np.abs(pelvis[:, [0, 2]] - np.array(numbers.PATH)[[0, -1]]).max() < 0.05
    turned = np.fromfile(tmp_path / "3.positions", "<f4").reshape(-1, 22, 3)
    [alone] = generate(prior, TURN, seed=2)
    assert len(turned) == len(alone)
    assert np.degrees(turn(turned)) == pytest.approx(90, abs=10)
    assert said["missed"][3] == []
    [features] = sample_features(prior, [TURN], [50], seeds=[2])
    assert (np.abs(read(tmp_path, "4.features", features) - features) / std).max() < 1e-2


TYPED = """
import { Prior, type Motion } from "motionloom";
import { clipFor } from "motionloom/three";
import { GLTFLoader } from "three/addons/loaders/GLTFLoader.js";
const prior: Prior = await Prior.load("weights", { progress: (bytes: number) => void bytes });
const motion: Motion = await prior.generate([{ text: "a person walks", seconds: 2 }], { path: [[0, 0], [1, 2]] });
export const clip = clipFor(await new GLTFLoader().loadAsync("hero.glb"), motion);
export const text: string = motion.bvh();
"""


def test_its_types_are_those_of_a_program(app: Path) -> None:
    """Without the studio's sources; what is misspelt is found."""
    options = ("--noEmit", "--strict", "--skipLibCheck", "--module", "nodenext", "--target", "es2022")
    for text, fits in ((TYPED, True), (TYPED.replace("path:", "paths:"), False)):
        (app / "typed.mts").write_text(text)
        found = made.node("typescript/bin/tsc", str(app / "typed.mts"), *options, "--ignoreConfig")
        assert (found.returncode == 0) == fits, found.stdout + found.stderr
    assert "'paths' does not exist" in found.stdout


def test_the_example_moves_a_character(app: Path, prior: Prior) -> None:
    """`example.html` as it is, beside the weights and a character; hands and feet go where the motion's go."""
    try:
        started.check(page=False)
    except started.Missing as missing:
        pytest.skip(str(missing))
    (app / "weights").mkdir()
    made.EXPORT["export"](prior, "0" * 64, app / "weights")
    Hero(seed=4).write(app / "hero.glb")
    example = (PACKAGE / "example.html").read_text()
    (app / "index.html").write_text(
        example.replace('document.body.dataset.ready = "true"', "Object.assign(window, { THREE, hero, motion, mixer })")
    )
    server = ThreadingHTTPServer(("127.0.0.1", 0), partial(Quiet, directory=str(app)))
    threading.Thread(target=server.serve_forever, daemon=True).start()
    try:
        with started.browser() as browser:
            page = browser.new_page(viewport={"width": 300, "height": 200})
            faults: list[str] = []
            page.on("pageerror", lambda error: faults.append(str(error)))
            page.goto(f"http://127.0.0.1:{server.server_port}/index.html")
            page.wait_for_function("window.mixer || document.body.dataset.never", timeout=600_000)
            found = page.evaluate(PLACES, list(SMPL22.names))
            page.close()
    finally:
        server.shutdown()
        server.server_close()
    assert not faults
    wanted, there = (np.array(found[name]).reshape(-1, 22, 3) for name in ("wanted", "there"))
    assert np.ptp(wanted[:, 0, 2]) > 1.0, "they walk"
    assert np.abs(wanted - there).max() < 0.03


PLACES = """(names) => {
  const { THREE, hero, motion, mixer } = window;
  const bones = names.map((name) => hero.scene.getObjectByName(name));
  const frames = [0, 20, 41, 60], there = [];
  for (const frame of frames) {
    mixer.setTime(frame / motion.fps);
    hero.scene.updateMatrixWorld(true);
    for (const bone of bones) there.push(...bone.getWorldPosition(new THREE.Vector3()).toArray());
  }
  return { there, wanted: frames.flatMap((frame) => [...motion.positions.slice(frame * 66, frame * 66 + 66)]) };
}"""
