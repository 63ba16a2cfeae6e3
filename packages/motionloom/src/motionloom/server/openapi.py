"""What the server answers, as an OpenAPI document and as a plain page made from it; both work without a network.

`tests/server/test_documents.py` holds it to the routes that there are, `tests/server/test_client.py` makes a client of
it.
"""

import html
import json
from importlib.metadata import version
from typing import Any

from motionloom.requests.export import Export
from motionloom.requests.fields import specs
from motionloom.requests.schema import schema
from motionloom.server.components import ANYTHING, FILE, ID, TEXT, WHOLE, components, ref
from motionloom.server.limits import Limits

STYLE = "body{font:16px sans-serif;max-width:50em;margin:2em auto;padding:0 1em}pre{overflow:auto}h2{font-size:1em}"
"""Of the plain page; `policy` lets it in by its hash."""
BYTES, JSON = "application/octet-stream", "application/json"


def _asked(of: dict[str, Any], kind: str = JSON) -> dict[str, Any]:
    return {"requestBody": {"required": True, "content": {kind: {"schema": of}}}}


def _answered(text: str, of: dict[str, Any], *, status: int = 200, kind: str = JSON) -> dict[str, Any]:
    right = {"description": text, "content": {kind: {"schema": of}}}
    wrong = {"description": "one sentence", "content": {JSON: {"schema": ref("Error")}}}
    return {"responses": {str(status): right, "default": wrong}}


def _with(name: str, text: str, of: dict[str, Any] = TEXT, *, place: str = "query") -> dict[str, Any]:
    return {"name": name, "in": place, "required": place == "path", "description": text, "schema": of}


def _paths() -> dict[str, dict[str, dict[str, Any]]]:
    """Path to method to operation; its operationId is what a client calls it."""
    return _about_jobs() | _about_motions() | _about_the_rest()


def _operation(
    name: str, summary: str, *parts: dict[str, Any], parameters: tuple[dict[str, Any], ...] = ()
) -> dict[str, Any]:
    found: dict[str, Any] = {"operationId": name, "summary": summary, "parameters": list(parameters)}
    for part in parts:
        found |= part
    return found


def _about_jobs() -> dict[str, dict[str, dict[str, Any]]]:
    one = _with("id", "of the job", ID, place="path")
    made = _answered("the job's id", ref("NewJob"), status=202)
    found = _answered("the job", ref("Job"))
    after = (
        _with("Last-Event-ID", "go on behind this event", WHOLE, place="header"),
        _with("after", "the same", WHOLE),
    )
    events = _answered("progress, level, then done, failed or cancelled", TEXT, kind="text/event-stream")
    return {
        "/jobs": {"post": _operation("create_job", "Ask for motion", _asked(ref("JobRequest")), made)},
        "/jobs/{id}": {
            "get": _operation("get_job", "How far a job is", found, parameters=(one,)),
            "delete": _operation("cancel_job", "Cancel a job", found, parameters=(one,)),
        },
        "/jobs/{id}/events": {
            "get": _operation(
                "follow_job", "What happens to a job, and every pose on the way", events, parameters=(one, *after)
            )
        },
    }


def _about_motions() -> dict[str, dict[str, dict[str, Any]]]:
    name, asf = _with("name", "the file's name; only its ending counts"), _with("asf", "id of the ASF of an AMC", ID)
    required = name | {"required": True}
    named = _with("joints", "JSON of joints by their meaning, where the file's names do not say it")
    one, character = _with("id", "of the motion", ID, place="path"), _with("id", "of the character", ID, place="path")
    kind = _with("format", "of the file", ref("MotionFormat"), place="path")
    stretch = tuple(_with(name, "seconds", {"type": "number"}) for name in ("begin", "end"))
    options = [
        _with(name, spec.help, ref(name.title()) if spec.words else schema(spec, {}))
        for name, spec in specs(Export).items()
        if name not in ("motion", "format", "name")
    ]
    file, body = _answered("the file; its own media type is in the answer", FILE, kind=BYTES), _asked(FILE, BYTES)
    motion, sent = _answered("the motion", ref("Motion")), _answered("its id", ref("SentMotion"), status=201)
    known = _answered("id, joints; of an .asf without them", ref("SentCharacter"), status=201)
    return {
        "/motions": {
            "post": _operation(
                "upload_motion", "Send a BVH, AMC, ASF, GLB, VRM or NPZ file", body, sent, parameters=(required, asf)
            )
        },
        "/motions/{id}": {
            "get": _operation(
                "get_motion",
                "Places, rotations and root, as base64 of little-endian float32; "
                "with 'Accept: application/octet-stream' the places alone, as bytes (docs/server.md)",
                motion,
                parameters=(one,),
            )
        },
        "/motions/{id}/deeds": {
            "get": _operation(
                "get_deeds",
                "What everybody does in a stretch of a motion",
                _answered("measured on the joints; null for less than a quarter of a second", ref("Happened")),
                parameters=(one, *stretch),
            )
        },
        "/motions/{id}.{format}": {
            "get": _operation(
                "export_motion", "A motion as bvh, glb, npz, mp4, png or html", file, parameters=(one, kind, *options)
            )
        },
        "/characters": {
            "post": _operation(
                "upload_character", "Send a GLB, VRM, glTF or BVH character", body, known, parameters=(required, named)
            )
        },
        "/characters/{id}": {"get": _operation("get_character", "The character's file", file, parameters=(character,))},
    }


def _about_the_rest() -> dict[str, dict[str, dict[str, Any]]]:
    health, known = _answered("ok, version, warm", ref("Health")), _answered("what there is", ref("Capabilities"))
    project = _answered("any JSON; null before the first", ANYTHING)
    aside = _answered("the name it has now", ANYTHING)
    saved, gltf = _answered("saved", ref("Saved")), _answered("glTF", ref("Gltf"), kind="model/gltf+json")
    text, timeline = _answered("YAML", TEXT, kind="text/yaml"), _answered("JSON", ref("Timeline"))
    return {
        "/health": {"get": _operation("get_health", "Whether the server is there, and warm", health)},
        "/capabilities": {"get": _operation("get_capabilities", "Joints, tasks, limits, formats", known)},
        "/generate": {
            "post": _operation(
                "generate_mmcp", "What an MMCP request asks, with the extra mmcp", _asked(ref("MmcpRequest")), gltf
            )
        },
        "/project": {
            "get": _operation("get_project", "The project as it was saved last", project),
            "put": _operation(
                "save_project",
                "Save the project; 409 where its id and revision are not those of what is there",
                _asked(ANYTHING),
                saved,
                parameters=(_with("over", "ID.REVISION of what it may replace all the same"),),
            ),
        },
        "/project/stamp": {
            "get": _operation("get_project_stamp", "Id and revision of what was saved last; null before it", project)
        },
        "/project/aside": {
            "post": _operation("set_project_aside", "Give what was saved another name in the folder", aside)
        },
        "/project/open": {
            "post": _operation(
                "open_project",
                "Open another project of the folder; the one that was open stays in it",
                _answered("its id and revision", ANYTHING),
                parameters=(_with("id", "of the project, as /projects lists it"),),
            )
        },
        "/projects": {
            "get": _operation(
                "list_projects", "The projects of the folder, the open one first", _answered("rows", ANYTHING)
            )
        },
        "/timeline.yaml": {
            "post": _operation("timeline_to_yaml", "A timeline's JSON to its YAML", _asked(ref("Timeline")), text)
        },
        "/timeline.json": {
            "post": _operation(
                "timeline_to_json", "A timeline's YAML, in UTF-8, to its JSON", _asked(FILE, BYTES), timeline
            )
        },
        "/sentence.json": {
            "post": _operation(
                "sentence_to_json", "A sentence to a timeline, a segment for each action", _asked(FILE, BYTES), timeline
            )
        },
    }


def document(limits: Limits) -> dict[str, Any]:
    """The OpenAPI document of a server with these limits."""
    return {
        "openapi": "3.1.0",
        "info": {"title": "motionloom", "version": version("motionloom"), "description": "See docs/server.md."},
        "paths": _paths(),
        "components": {
            "schemas": components(limits),
            "securitySchemes": {"token": {"type": "http", "scheme": "bearer"}},
        },
        "security": [{}, {"token": []}],
    }


def as_page(found: dict[str, Any]) -> str:
    """The document as one page of HTML that needs nothing else."""
    rows = [
        f"<h2><code>{method.upper()} {html.escape(path)}</code></h2><p>{html.escape(about['summary'])}</p>"
        f"<details><summary>in detail</summary><pre>{html.escape(json.dumps(about, indent=1))}</pre></details>"
        for path, methods in found["paths"].items()
        for method, about in methods.items()
    ]
    schemas = html.escape(json.dumps(found["components"]["schemas"], indent=1))
    return (
        f"<!doctype html><html lang=en><meta charset=utf-8><title>motionloom: the server</title><style>{STYLE}</style>"
        f"<h1>motionloom {html.escape(found['info']['version'])}</h1><p>The same as JSON: "
        f"<a href=openapi.json>openapi.json</a></p>{''.join(rows)}<h2>Schemas</h2><pre>{schemas}</pre></html>"
    )
