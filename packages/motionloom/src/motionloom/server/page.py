"""The studio's page: the files that were built into `motionloom/server/page`, known by their names from the start."""

import mimetypes
from pathlib import Path

from starlette.requests import Request
from starlette.responses import FileResponse, HTMLResponse, Response
from starlette.routing import BaseRoute, Route

FOLDER = Path(__file__).with_name("page")
MISSING = (
    "The studio's page is not built into this installation: run 'make studio' in a clone of motionloom, or install "
    "it again ('pip install .') with Node.js 20.19 or later on the PATH. The server itself works; /docs says what it "
    "answers."
)


def files(folder: Path = FOLDER) -> dict[str, Path]:
    """The page's files by their paths in the address; empty where it is not built."""
    if not (folder / "index.html").is_file():
        return {}
    paths = {f"/{path.relative_to(folder).as_posix()}": path for path in folder.rglob("*") if path.is_file()}
    return {"/": folder / "index.html", **paths}


def routes() -> list[BaseRoute]:
    """A route for each file, and one at / that explains it where there is no page."""
    known = files()
    return [Route(path, _file_response(place)) for path, place in known.items()] or [Route("/", _missing)]


def _file_response(place: Path):
    kind = mimetypes.guess_type(place.name)[0] or "application/octet-stream"
    # Only names with a hash of what is in them stay the same for ever.
    caching = "max-age=31536000, immutable" if place.parent.name == "assets" else "no-cache"

    async def give(request: Request) -> Response:
        return FileResponse(place, media_type=kind, headers={"Cache-Control": caching})

    return give


async def _missing(request: Request) -> Response:
    return HTMLResponse(f"<!doctype html><title>motionloom</title><p>{MISSING}</p>", status_code=200)
