"""The project's JSON with its id and revision: what was saved is replaced by nobody who has not seen it.

A page sends with what it saves which project that is (``id``) and which state of it was changed (``revision``). Where
the folder has another one, or another state, that is refused with 409, and the page asks its user. The server counts:
every save is one revision more. It also writes who saved and from which revision on (``written``), so that a client
whose answer was lost is not taken for somebody else. What cannot be read is put aside under another name, never
replaced.
"""

import json
import re
import secrets
import threading
import time
from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

from starlette.concurrency import run_in_threadpool
from starlette.requests import Request
from starlette.responses import JSONResponse, Response
from starlette.routing import Route

from motionloom.core.errors import MotionloomError
from motionloom.core.files.text import parse_json, stored_json
from motionloom.server.bodies import body_of, session_of
from motionloom.server.project import Project
from motionloom.server.refusal import Refusal
from motionloom.server.shelf import row

ID = re.compile(r"[A-Za-z0-9_-]{1,80}")
LARGEST = 2**53
"""Revisions are whole numbers below this, as JavaScript has them."""
ASIDE = "put what is there aside with POST /project/aside: it stays in the folder under another name"
NO_STORE = {"Cache-Control": "no-store"}


@dataclass(frozen=True)
class Stamp:
    """Which project, and which state of it."""

    id: str | None
    """None: JSON of somebody who counts no revisions."""
    revision: int = 0
    client: str = ""
    """Who saved last."""
    base: int = 0
    """All revisions after this one are that client's."""

    def public(self) -> dict[str, Any]:
        """As JSON."""
        return {"id": self.id, "revision": self.revision}

    def follows(self, other: "Stamp") -> bool:
        """Whether what is saved with this stamp was based on all that the other one covers."""
        if self.id != other.id:
            return False
        own = bool(self.client) and self.client == other.client and other.base <= self.revision <= other.revision
        return self.id is None or self.revision == other.revision or own


class Saved:
    """The project's JSON in its folder; safe to use from several threads."""

    def __init__(self, project: Project) -> None:
        self.project, self._lock = project, threading.RLock()
        self._known: tuple[object, Stamp | None] = (None, None)

    def read(self) -> bytes | None:
        """What was saved last, or None; one without an id gets it, and what is no text in it is replaced.

        Raises `Refusal` 422 for what is no JSON.
        """
        with self._lock:
            data = self.project.read_project()
            if data is None or self.stamp() is None:
                return data
            value = _parsed(data)
            if isinstance(value, dict) and "segments" in value and "id" not in value:  # of before there were ids
                self._write(value, Stamp(secrets.token_hex(8)))
                return self.project.read_project()
            return data if data.isascii() and b"\\u" not in data else json.dumps(value).encode()

    def stamp(self) -> Stamp | None:
        """Of what was saved last; None where nothing was. Raises `Refusal` 422 for what is no JSON."""
        with self._lock:
            mark = self.project.saved_version()
            if mark is None:
                return None
            if self._known[0] != mark:
                try:
                    data = self.project.read_project()
                except OSError as error:
                    why = f"project.json in the project folder cannot be read ({error.strerror}); {ASIDE}"
                    raise Refusal(422, why) from None
                self._known = mark, None if data is None else _stamp_of(_parsed(data))
            return self._known[1]

    def save(self, data: bytes, client: str, over: str | None) -> Stamp:
        """Save JSON; its stamp then.

        over: ``ID.REVISION`` of what may be replaced although the JSON does not say that it follows from it.
        Raises `Refusal` 409 where something else is there, 422 where that cannot be read.
        """
        value = parse_json(data, "the project")
        with self._lock:
            there, new = self.stamp(), _stamp_in(value, client)
            if there is None or new.follows(there):
                return self._follow(data, value, new, there)
            if over is None or over != f"{there.id or ''}.{there.revision}":
                raise Refusal(409, _sentence(there, new), more=there.public())
            if new.id == there.id:
                return self._follow(data, value, new, there)
            self._shelve(there)
            stamp = self._follow(data, value, new, None)
            self._taken_off(new)
            return stamp

    def rows(self) -> list[dict[str, Any]]:
        """What a list shows of each project of the folder, the open one first."""
        with self._lock:
            data, there = self.read(), self.stamp()
            others = [one for one in self.project.shelf.rows() if there is None or one["id"] != there.id]
            if data is None or there is None or there.id is None:
                return others
            return [row(_parsed(data), time.time()) | {"open": True}, *others]

    def open(self, name: str) -> Stamp:
        """Open another project of the folder; the one that was open stays in it. Its stamp.

        Raises `Refusal` 404 where the folder has no such project.
        """
        with self._lock:
            there = self.stamp()
            if there is not None and there.id == name:
                return there
            data = self.project.shelf.read(name)
            if data is None:
                raise Refusal(404, "the folder has no such project; GET /projects lists those it has")
            stamp = _stamp_of(_parsed(data))
            if there is not None:
                self._shelve(there)
            self.project.save_project(data)
            self.project.shelf.drop(name)
            return stamp

    def _shelve(self, there: Stamp) -> None:
        """Keep what is open among the folder's other projects; what has no id gets another name."""
        data = self.project.read_project()
        if there.id is None or data is None:
            self.aside()
        else:
            self.project.shelf.keep(there.id, data)

    def _taken_off(self, new: Stamp) -> None:
        """What was kept of a project that is open now is gone, or is a project of its own where nobody has seen it."""
        data = self.project.shelf.read(str(new.id))
        if data is None:
            return
        value = _parsed(data)
        if not new.follows(_stamp_of(value)):
            name = secrets.token_hex(8)
            self.project.shelf.keep(name, json.dumps(value | {"id": name}).encode())
        self.project.shelf.drop(str(new.id))

    def aside(self) -> str:
        """Give what is saved another name, which is returned; raises `Refusal` 404 where nothing is."""
        with self._lock:
            name = self.project.put_aside(time.strftime("project.%Y%m%d-%H%M%S"))
        if name is None:
            raise Refusal(404, "there is no project in the folder yet")
        return name

    def _follow(self, data: bytes, value: Any, new: Stamp, there: Stamp | None) -> Stamp:
        if new.id is None:
            self.project.save_project(data)
            return new
        own = there is not None and new.client == there.client and new.client != ""
        base = there.base if there is not None and own else new.revision if there is None else there.revision
        revision = max(new.revision, there.revision if there is not None else 0) + 1
        return self._write(value, Stamp(new.id, revision, new.client, base))

    def _write(self, value: dict[str, Any], stamp: Stamp) -> Stamp:
        origin = {"by": stamp.client, "from": stamp.base}
        stamped = value | stamp.public() | {"written": origin}
        self.project.save_project(json.dumps(stamped).encode())
        return stamp


def _parsed(data: bytes) -> Any:
    try:
        return stored_json(data, "project.json in the project folder")
    except MotionloomError as error:
        raise Refusal(422, f"{error}; {ASIDE}") from None


def _stamp_of(value: Any) -> Stamp:
    """The stamp in what was saved; what is no stamp counts as none."""
    try:
        stamp = _stamp_in(value, "")
    except MotionloomError:
        return Stamp(None)
    origin = value.get("written") if isinstance(value, dict) else None
    if isinstance(origin, dict) and isinstance(origin.get("by"), str) and isinstance(origin.get("from"), int):
        return Stamp(stamp.id, stamp.revision, origin["by"], origin["from"])
    return stamp


def _stamp_in(value: Any, client: str) -> Stamp:
    """The stamp in JSON that is to be saved; raises `MotionloomError` for one that cannot be."""
    if not isinstance(value, Mapping) or "id" not in value:
        return Stamp(None)
    name, revision = value["id"], value.get("revision", 0)
    if not isinstance(name, str) or not ID.fullmatch(name):
        raise MotionloomError("the project's 'id' must be 1 to 80 letters, digits, '_' and '-'")
    if not isinstance(revision, int) or isinstance(revision, bool) or not 0 <= revision < LARGEST:
        raise MotionloomError("the project's 'revision' must be a whole number from 0 on, as the server gave it")
    return Stamp(name, revision, client)


def _sentence(there: Stamp, new: Stamp) -> str:
    if there.id != new.id:
        return "the folder holds another project; read it with GET /project before you replace it"
    return (
        f"the project was saved by somebody else meanwhile: its revision is {there.revision}, and this was made from "
        f"{new.revision}; read it with GET /project"
    )


# What is answered


def routes() -> list[Route]:
    """The routes of the project's JSON."""
    return [
        Route("/project", saved_project, methods=["GET", "PUT"]),
        Route("/project/stamp", project_stamp),
        Route("/project/aside", project_aside, methods=["POST"]),
        Route("/project/open", open_project, methods=["POST"]),
        Route("/projects", projects),
    ]


async def saved_project(request: Request) -> Response:
    studio = request.app.state.studio
    if request.method == "GET":
        data = await run_in_threadpool(studio.saved.read)
        return Response(data or b"null", media_type="application/json", headers=NO_STORE)
    data = await body_of(request, studio.limits.project_bytes)
    client, over = session_of(request), request.query_params.get("over")
    stamp = await run_in_threadpool(studio.saved.save, data, client, over)
    return JSONResponse({"saved": len(data), **stamp.public()})


async def project_stamp(request: Request) -> Response:
    stamp = await run_in_threadpool(request.app.state.studio.saved.stamp)
    return JSONResponse(None if stamp is None else stamp.public(), headers=NO_STORE)


async def project_aside(request: Request) -> Response:
    return JSONResponse({"kept": await run_in_threadpool(request.app.state.studio.saved.aside)})


async def projects(request: Request) -> Response:
    rows = await run_in_threadpool(request.app.state.studio.saved.rows)
    return JSONResponse(rows, headers=NO_STORE)


async def open_project(request: Request) -> Response:
    saved, name = request.app.state.studio.saved, request.query_params.get("id", "")
    return JSONResponse((await run_in_threadpool(saved.open, name)).public())
