"""The HTTP application: routes, bodies and answers. What they mean is in `docs/server.md`."""

import asyncio
import base64
from collections.abc import AsyncIterator, Callable, Mapping, Sequence
from contextlib import asynccontextmanager
from dataclasses import dataclass, field
from functools import wraps
from importlib.metadata import version
from pathlib import Path
from typing import Any

from starlette.applications import Starlette
from starlette.concurrency import run_in_threadpool
from starlette.exceptions import HTTPException
from starlette.middleware import Middleware
from starlette.requests import Request
from starlette.responses import FileResponse, HTMLResponse, JSONResponse, PlainTextResponse, Response
from starlette.routing import BaseRoute, Route, WebSocketRoute

from motionloom.core.errors import MotionloomError, listed, meant, quoted
from motionloom.core.files.text import parse_json
from motionloom.core.reading import check_text
from motionloom.core.skeleton import SMPL22
from motionloom.requests.export import FORMATS, Export
from motionloom.requests.fields import specs
from motionloom.requests.reading import parse_fields, read
from motionloom.retarget.named import NAMED
from motionloom.server import page as built
from motionloom.server.bodies import body_of, file_of, file_once, session_of
from motionloom.server.films import film
from motionloom.server.guard import Door, Guard
from motionloom.server.job_request import TASKS, read_request
from motionloom.server.jobs import EventStream, Streams
from motionloom.server.limits import Limits
from motionloom.server.mmcp.routes import capabilities_of
from motionloom.server.mmcp.routes import routes as mmcp_routes
from motionloom.server.openapi import as_page, document
from motionloom.server.project import Project, Stored
from motionloom.server.refusal import Refusal, full_disk
from motionloom.server.saved import Saved
from motionloom.server.saved import routes as project_routes
from motionloom.server.timelines import sentence_json, timeline_json, timeline_yaml
from motionloom.server.worker import Worker


@dataclass(eq=False)
class Studio:
    """What the routes share."""

    project: Project
    worker: Worker
    limits: Limits
    saved: Saved = field(init=False)
    """The project's JSON."""
    streams: Streams = field(init=False)
    files: asyncio.Semaphore = field(init=False)
    """Held while a file is read or written: few at a time, and nobody else's answers wait for a thread."""

    def __post_init__(self) -> None:
        self.saved = Saved(self.project)
        self.streams = Streams(self.limits.streams)
        self.files = asyncio.Semaphore(self.limits.exports)


def build(project: Project, worker: Worker, door: Door, *, more: Sequence[BaseRoute] = ()) -> Starlette:
    """The application; the worker runs as long as it does. ``more``: further routes, also WebSockets."""
    studio = Studio(project, worker, worker.limits)

    @asynccontextmanager
    async def lifespan(app: Starlette) -> AsyncIterator[None]:
        worker.start()
        yield
        worker.stop()

    app = Starlette(
        routes=[*more, *routes()],
        lifespan=lifespan,
        middleware=[Middleware(Guard, door=door, limits=studio.limits)],
        exception_handlers={
            Refusal: _refused,
            MotionloomError: _mistaken,
            OSError: _unwritten,
            HTTPException: _no_route,
            Exception: _failed,
        },
    )
    app.state.studio = studio
    return app


QUERIES: Mapping[str, tuple[str, ...]] = {
    "/jobs/{id}/events": ("after",),
    "/motions": ("name", "asf"),
    "/motions/{name}": ("looks", *(name for name in specs(Export) if name not in ("motion", "format", "name"))),
    "/motions/{id}/deeds": ("begin", "end"),
    "/characters": ("name", "joints"),
    "/project": ("over",),
    "/project/open": ("id",),
}
"""What may follow the ``?`` of an address, beside a token; of all others nothing."""


def routes(*, page: bool = True) -> list[BaseRoute]:
    """What is answered; ``page``: with the files of the studio's page."""
    return [
        *map(_with_known_query, _answers()),
        WebSocketRoute("/film", film),
        *mmcp_routes(),
        *(built.routes() if page else ()),
    ]


def _with_known_query(route: Route) -> Route:
    """The route, which refuses what it does not know behind a ``?``."""
    known = (*QUERIES.get(route.path, ()), "token")

    @wraps(route.endpoint)
    async def answer(request: Request) -> Response:
        if unknown := [key for key in request.query_params if key not in known]:
            hint = f"{quoted(unknown[0])}{meant(unknown[0], known)}; it takes {listed(known)}"
            raise Refusal(400, f"{request.url.path[:80]} takes no {hint}")
        return await route.endpoint(request)

    return Route(route.path, answer, methods=sorted(route.methods or ()))


def _answers() -> list[Route]:
    return [
        Route("/health", health),
        Route("/capabilities", capabilities),
        Route("/jobs", make_job, methods=["POST"]),
        Route("/jobs/{id}", show_job, methods=["GET", "DELETE"]),
        Route("/jobs/{id}/events", job_events),
        Route("/motions", upload_motion, methods=["POST"]),
        Route("/motions/{name}", motion),
        Route("/motions/{id}/deeds", deeds),
        Route("/characters", upload_character, methods=["POST"]),
        Route("/characters/{id}", character),
        *project_routes(),
        Route("/timeline.yaml", timeline_to_yaml, methods=["POST"]),
        Route("/timeline.json", timeline_to_json, methods=["POST"]),
        Route("/sentence.json", sentence_to_json, methods=["POST"]),
        Route("/openapi.json", openapi),
        Route("/docs", docs),
    ]


def studio_of(request: Request) -> Studio:
    """What the routes share."""
    return request.app.state.studio


# What is there


async def health(request: Request) -> Response:
    worker = studio_of(request).worker
    about = {"ok": worker.problem is None, "version": version("motionloom"), "warm": worker.warm}
    return JSONResponse(about | ({"error": worker.problem} if worker.problem else {}))


async def capabilities(request: Request) -> Response:
    studio = studio_of(request)
    return JSONResponse(
        {
            "fps": 20,
            "joints": list(SMPL22.names),
            "parents": list(SMPL22.parents),
            "offsets": SMPL22.offsets.tolist(),
            "groups": {name: list(at) for name, at in SMPL22.groups.items()},
            "tasks": list(TASKS),
            "limits": studio.limits.public(),
            "formats": list(FORMATS),
            "skeletons": list(NAMED),
            "adapters": sorted(path.name for path in studio.project.adapters.glob("*.safetensors")),
        }
        | await capabilities_of(request.app)
    )


async def openapi(request: Request) -> Response:
    return JSONResponse(document(studio_of(request).limits))


async def docs(request: Request) -> Response:
    return HTMLResponse(as_page(document(studio_of(request).limits)))


# Jobs


async def make_job(request: Request) -> Response:
    studio = studio_of(request)
    body = parse_json(await body_of(request, studio.limits.body_bytes), "the body")
    order = await run_in_threadpool(read_request, body, studio.project, studio.limits)
    job = studio.worker.submit(order, client_of(request))
    return JSONResponse({"id": job.id}, status_code=202, headers={"Location": f"/jobs/{job.id}"})


def client_of(request: Request) -> str:
    """The client: the session that a page names in X-Client, else the address."""
    address, named = request.client.host if request.client else "unknown", session_of(request)
    return f"{address} {named}" if named else address


async def show_job(request: Request) -> Response:
    worker = studio_of(request).worker
    job = worker.job(request.path_params["id"])
    if request.method == "DELETE":
        worker.cancel(job)
    return JSONResponse(job.public())


async def job_events(request: Request) -> Response:
    studio = studio_of(request)
    job = studio.worker.job(request.path_params["id"])
    last = request.headers.get("last-event-id") or request.query_params.get("after") or "0"
    if not (last.isascii() and last.isdecimal() and len(last) < 12):
        raise Refusal(400, "Last-Event-ID is the number of an event of this job")
    return EventStream(job, int(last), studio.streams)


# Motions and characters


async def upload_motion(request: Request) -> Response:
    from motionloom.server import files

    studio = studio_of(request)
    asf = request.query_params.get("asf")
    async with file_of(request, studio.project, (*files.UPLOADS, ".asf"), studio.limits) as (part, name):
        if part.suffix == ".asf":
            about = await _with_file(studio, lambda: files.read_skeleton(studio.project, part, name), part, name)
            return JSONResponse(about, status_code=201)

        def read() -> Stored:
            return files.read_upload(studio.project, part, name, asf=asf, limits=studio.limits)

        stored = await _with_file(studio, read, part, name)
    first = stored.people[0]
    about = {"id": stored.id, "fps": first.fps, "frames": len(first), "people": len(stored.people)}
    return JSONResponse(about | {"seconds": round(first.seconds, 4), "name": name}, status_code=201)


async def motion(request: Request) -> Response:
    from motionloom.server import files

    studio = studio_of(request)
    name, dot, kind = request.path_params["name"].partition(".")
    stored = await run_in_threadpool(studio.project.motion, name)
    if not dot and "application/octet-stream" in request.headers.get("accept", ""):
        seeing = request.query_params.get("looks") == "true"
        places = await run_in_threadpool(files.places, stored, seeing=seeing)
        headers = {"Motion-Fps": f"{stored.people[0].fps:g}", "Motion-People": str(len(stored.people))}
        return Response(places, media_type="application/octet-stream", headers=headers)
    if not dot:
        about = await run_in_threadpool(files.as_json, stored, lambda a: base64.b64encode(files.float32(a)).decode())
        return JSONResponse(about)
    if kind not in FORMATS:
        raise Refusal(404, f"motions are given as {', '.join(FORMATS)}; got {kind[:20]!r}")
    known = {key: value for key, value in request.query_params.items() if key in specs(Export)}
    options = read(Export, parse_fields(Export, known) | {"motion": name, "format": kind}, "a file")
    part = await _with_file(studio, lambda: files.export(studio.project, options))
    return file_once(part, media_type=files.FORMATS[kind], name=f"motion-{name[:8]}{part.suffix}")


async def deeds(request: Request) -> Response:
    from motionloom.server import files

    stored = await run_in_threadpool(studio_of(request).project.motion, request.path_params["id"])
    query = request.query_params
    report = await run_in_threadpool(files.deeds_between, stored, query.get("begin"), query.get("end"))
    return JSONResponse({"happened": report})


async def upload_character(request: Request) -> Response:
    from motionloom.server.characters import SUFFIXES, read_character

    studio, joints = studio_of(request), request.query_params.get("joints")
    async with file_of(request, studio.project, SUFFIXES, studio.limits) as (part, name):
        about = await _with_file(studio, lambda: read_character(studio.project, part, name, joints), part, name)
    return JSONResponse(about, status_code=201)


async def character(request: Request) -> Response:
    path, name = studio_of(request).project.character(request.path_params["id"])
    kinds = {".bvh": "text/plain; charset=utf-8", ".asf": "text/plain; charset=utf-8", ".gltf": "model/gltf+json"}
    return FileResponse(path, media_type=kinds.get(path.suffix, "model/gltf-binary"), filename=name)


async def _with_file(studio: Studio, call: Callable[[], Any], part: Path | None = None, name: str = "") -> Any:
    """Read or write a file in a thread, few at a time; ``part`` is called ``name`` in what goes wrong."""
    async with studio.files:
        try:
            return await run_in_threadpool(call)
        except MotionloomError as error:
            raise MotionloomError(str(error).replace(str(part), name) if part else str(error)) from error


# Timelines


async def timeline_to_yaml(request: Request) -> Response:
    studio = studio_of(request)
    value = parse_json(await body_of(request, studio.limits.body_bytes), "the body")
    text = await run_in_threadpool(timeline_yaml, value, studio.project, studio.limits)
    return PlainTextResponse(text, media_type="text/yaml")


async def timeline_to_json(request: Request) -> Response:
    studio = studio_of(request)
    text = await _text_of(request, "timeline")
    return JSONResponse(await run_in_threadpool(timeline_json, text, studio.project, studio.limits))


async def sentence_to_json(request: Request) -> Response:
    text = await _text_of(request, "sentence")
    return JSONResponse(await run_in_threadpool(sentence_json, text, studio_of(request).limits))


async def _text_of(request: Request, what: str) -> str:
    body = await body_of(request, studio_of(request).limits.body_bytes)
    try:
        return check_text(body.decode("utf-8"), f"the {what}")
    except UnicodeDecodeError:
        raise MotionloomError(f"the {what} is not UTF-8 text; save it as UTF-8") from None


# What goes wrong


def _answer(
    status: int, sentence: str, headers: Mapping[str, str] | None = None, *, more: Mapping[str, Any] | None = None
) -> Response:
    return JSONResponse({"error": sentence, **(more or {})}, status_code=status, headers=headers)


async def _refused(request: Request, error: Exception) -> Response:
    assert isinstance(error, Refusal)
    return _answer(error.status, error.sentence, error.headers, more=error.more)


async def _unwritten(request: Request, error: Exception) -> Response:
    """A full disk is reported to the client; any other error of the operating system is one of the program."""
    if (refusal := full_disk(error)) is None:
        raise error
    return await _refused(request, refusal)


async def _mistaken(request: Request, error: Exception) -> Response:
    if (refusal := full_disk(error)) is not None:
        return await _refused(request, refusal)
    sentence = studio_of(request).project.without_paths(str(error))
    where = getattr(error, "where", "")
    return _answer(400, sentence, more={"where": where} if where else {})


async def _no_route(request: Request, error: Exception) -> Response:
    assert isinstance(error, HTTPException)
    if error.status_code == 405:
        return _answer(405, f"{request.method} does not go with {request.url.path[:80]}; see /docs", error.headers)
    return _answer(error.status_code, f"there is nothing at {request.url.path[:80]}; see /docs for what there is")


async def _failed(request: Request, error: Exception) -> Response:
    return _answer(500, f"the server failed ({type(error).__name__}); this is a fault of the program, see its log")


__all__ = ["Studio", "build", "studio_of"]
