"""The routes of MMCP: all under ``/mmcp``, and ``POST /generate`` at the root, where its clients call it."""

import json
from importlib.util import find_spec
from typing import Any

from starlette.applications import Starlette
from starlette.requests import Request
from starlette.routing import BaseRoute, Mount, Route
from starlette.types import Message, Receive, Scope, Send

from motionloom.core.errors import MotionloomError
from motionloom.core.files.text import parse_json
from motionloom.server.bodies import body_of
from motionloom.server.refusal import Refusal

MISSING = "this server does not speak MMCP: install it with pip install 'motionloom[mmcp]'"


class _Forwarded:
    """Hands a request to the SDK's application, which is created for the first one."""

    async def __call__(self, scope: Scope, receive: Receive, send: Send) -> None:
        inner = application_of(scope["app"])
        if inner is None:
            return await _answer(send, 503, "model_unavailable", MISSING)
        try:
            receive = await _checked(scope, receive)
        except (MotionloomError, Refusal) as error:
            status = error.status if isinstance(error, Refusal) else 400
            code = "payload_too_large" if status == 413 else "schema_validation"
            return await _answer(send, status, code, str(error))
        await inner(scope, receive, send)


async def _checked(scope: Scope, receive: Receive) -> Receive:
    """A body that is JSON as `parse_json` takes it, to be received again; raises `MotionloomError` and `Refusal`."""
    if scope["method"] != "POST":
        return receive
    body = await body_of(Request(scope, receive), scope["app"].state.studio.limits.body_bytes)
    parse_json(body, "the request")
    messages = iter([{"type": "http.request", "body": body}])

    async def again() -> Message:
        return next(messages, None) or await receive()

    return again


async def _answer(send: Send, status: int, code: str, message: str) -> None:
    body = json.dumps({"error": {"code": code, "message": message, "details": {}}}).encode()
    headers = [(b"content-type", b"application/json"), (b"connection", b"close")]
    await send({"type": "http.response.start", "status": status, "headers": headers})
    await send({"type": "http.response.body", "body": body})


def routes() -> list[BaseRoute]:
    """Routes for the server's application."""
    return [Route("/generate", _Forwarded(), methods=["POST"]), Mount("/mmcp", _Forwarded())]


def application_of(app: Starlette) -> Any:
    """The SDK's application for a server; None where it is not installed."""
    if any(find_spec(name) is None for name in ("motionmcp", "fastapi", "pydantic")):
        return None
    if getattr(app.state, "mmcp", None) is None:
        from motionloom.server.mmcp.backbone import application

        app.state.mmcp = application(app.state.studio.worker)
    return app.state.mmcp


async def capabilities_of(app: Starlette) -> dict[str, Any]:
    """What MMCP answers at ``/capabilities``; nothing where it is not installed."""
    inner = application_of(app)
    if inner is None:
        return {}
    endpoint = next(route.endpoint for route in inner.routes if getattr(route, "path", "") == "/capabilities")
    return await endpoint()
