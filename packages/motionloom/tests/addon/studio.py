"""A server, and Blender with the extension beside it: what runs the scenarios."""

import io
import json
import os
import subprocess
import sys
import zipfile
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

from motionloom.core.skeleton import SMPL22
from tests.io.in_blender import python_with_bpy
from tests.server.serving import PATIENCE, Server

ROOT = Path(__file__).parents[4]
SOURCES = ROOT / "blender"
PERSON = {"names": SMPL22.names, "parents": SMPL22.parents, "places": SMPL22.rest_positions().tolist()}


def archive(folder: Path) -> Path:
    """The extension as `make blender` zips it."""
    path = folder / "motionloom-blender.zip"
    with zipfile.ZipFile(path, "w") as file:
        for source in [*SOURCES.glob("*.py"), SOURCES / "blender_manifest.toml", ROOT / "LICENSE"]:
            file.write(source, source.name)
    return path


@dataclass(frozen=True)
class Studio:
    """A server, and Blender beside it."""

    server: Server
    archive: Path
    folder: Path

    def play(self, name: str, address: str = "", **given: Any) -> dict[str, Any]:
        """What a scenario returns."""
        asked, answer = self.folder / f"{name}.in.json", self.folder / f"{name}.out.json"
        address = address or f"http://127.0.0.1:{self.server.port}"
        asked.write_text(json.dumps({"zip": str(self.archive), "address": address, **PERSON, **given}))
        resources = self.folder / f"{name}.blender"
        resources.mkdir(exist_ok=True)
        program = [python_with_bpy() or sys.executable, str(Path(__file__).with_name("scenarios.py"))]
        environment = {**os.environ, "BLENDER_USER_RESOURCES": str(resources)}
        ended = subprocess.run(
            [*program, name, str(asked), str(answer)],
            check=False,
            capture_output=True,
            text=True,
            timeout=2 * PATIENCE,
            env=environment,
        )
        assert ended.returncode == 0, ended.stderr[-3000:]
        return json.loads(answer.read_text())

    def motion(self, result: dict[str, Any], query: str = "") -> dict[str, np.ndarray]:
        """A result of the server as the arrays of its .npz."""
        status, _, data = self.server.ask("GET", f"/motions/{result['id']}.npz{query}")
        assert status == 200, data
        with np.load(io.BytesIO(data), allow_pickle=False) as held:
            return dict(held)
