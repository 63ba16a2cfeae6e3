"""MCP over standard input and output, so that an assistant can make motion: three tools over the same worker.

Needs the extra ``mcp``. Nothing but the protocol may be written to standard output.
"""

import os
from collections.abc import Sequence
from importlib import import_module
from importlib.metadata import version
from pathlib import Path
from typing import Any

from motionloom.errors import MotionloomError
from motionloom.goals.adapters import Applied
from motionloom.server.asking import read_request
from motionloom.server.limits import Limits
from motionloom.server.project import Project
from motionloom.server.refusal import Refusal
from motionloom.server.worker import Worker

CLIENT = "assistant"
WHAT = (
    "Human motion from plain English, on a skeleton of 22 joints at 20 frames per second. Make motion with "
    "generate_motion (one action) or compose (several, one after the other), then write files with export."
)


class Assistant:
    """The tools, as plain functions; what goes wrong is raised as one sentence."""

    def __init__(self, project: Project, worker: Worker) -> None:
        self.project, self.worker = project, worker

    async def generate_motion(
        self, prompt: str, seconds: float = 5.0, seed: int = 0, count: int = 1
    ) -> list[dict[str, Any]]:
        """Make motions of one person from a sentence such as 'a person walks forward and waves'.

        seconds: length, at most 60. count: takes to make, 1 to 8; take i is drawn from seed + i. Gives an id for each.
        """
        asked = {"task": "generate", "prompt": prompt, "seconds": seconds, "seed": seed, "count": count}
        return await self._drawn(asked)

    async def compose(
        self, segments: list[dict[str, Any]], path: dict[str, Any] | None = None, seed: int = 0
    ) -> list[dict[str, Any]]:
        """Make one long motion of several actions, one after the other, without seams.

        segments: such as {"text": "a person walks", "seconds": 4, "transition": 1}, in their order; text is needed.
        path: where the person goes, such as {"path": {"points": [[0, 0], [1, 2], [0, 4]]}} (x and z, metres).
        """
        timeline = {"segments": segments} | ({} if path is None else {"path": path})
        return await self._drawn({"task": "compose", "timeline": timeline, "seed": seed})

    async def export(
        self, motion: str, format: str = "bvh", skeleton: str | None = None, name: str | None = None
    ) -> dict[str, Any]:
        """Write a motion to a file in the project folder and give its path.

        motion: an id that generate_motion or compose gave. format: bvh, glb, npz, mp4 or png. skeleton: smpl22, mixamo,
        unreal, vrm or rigify. name: of the file, letters, digits, - and _ only; without it the motion's id.
        """
        import anyio

        def write() -> dict[str, Any]:
            from motionloom.server import files

            if format not in files.FORMATS:
                raise MotionloomError(f"motions are written as {', '.join(files.FORMATS)}; got {format[:20]!r}")
            stem = motion if name is None else name
            if not 0 < len(stem) <= 80 or not stem.replace("-", "").replace("_", "").isalnum() or not stem.isascii():
                raise MotionloomError(f"a file's name has letters, digits, - and _ only; got {stem[:40]!r}")
            part = files.export(self.project, self.project.motion(motion), format, skeleton=skeleton, person=None)
            place = self.project.folder / "exports" / f"{stem}.{format}"
            place.parent.mkdir(exist_ok=True)
            os.replace(part, place)
            return {"file": str(place), "bytes": place.stat().st_size}

        return await _said(anyio.to_thread.run_sync(write))

    async def _drawn(self, asked: dict[str, Any]) -> list[dict[str, Any]]:
        import anyio

        def draw() -> list[dict[str, Any]]:
            request = read_request(asked | {"levels": False}, self.project, self.worker.limits)
            job = self.worker.submit(request, CLIENT)
            job.wait()
            if job.state != "done":
                raise MotionloomError(job.error or "the job was cancelled")
            return job.public()["results"]

        return await _said(anyio.to_thread.run_sync(draw))


async def _said(call: Any) -> Any:
    """What a call gives; a refusal as the sentence that it is."""
    try:
        return await call
    except Refusal as refusal:
        sentence = refusal.sentence
    except MotionloomError as error:
        sentence = str(error)
    raise import_module("mcp.server.mcpserver.exceptions").ToolError(sentence)


def run(folder: Path, *, weights: str = "default", device: str = "cpu", adapters: Sequence[Applied] = ()) -> None:
    """Serve the tools until standard input ends; raises MotionloomError where the extra is not installed."""
    try:
        server = import_module("mcp.server.mcpserver").MCPServer(
            "motionloom", instructions=WHAT, version=version("motionloom")
        )
    except ModuleNotFoundError as error:
        raise MotionloomError(f"MCP needs {error.name}: install it with pip install 'motionloom[mcp]'") from None
    limits = Limits()
    worker = Worker(Project(folder, limits), limits, weights=weights, device=device, adapters=adapters)
    tools = Assistant(worker.project, worker)
    for tool in (tools.generate_motion, tools.compose, tools.export):
        server.tool()(tool)
    worker.start()
    try:
        server.run("stdio")
    finally:
        worker.stop()
