"""The routes of MMCP: all under ``/mmcp``, and ``POST /generate`` at the root, where its clients call it."""

import json
from importlib.util import find_spec
from typing import Any

from starlette.applications import Starlette
from starlette.routing import BaseRoute, Mount, Route
from starlette.types import Receive, Scope, Send

MISSING = "this server does not speak MMCP: install it with pip install 'motionloom[mmcp]'"


class _Forwarded:
    """Hands a request to the SDK's application, which is created for the first one."""

    async def __call__(self, scope: Scope, receive: Receive, send: Send) -> None:
        inner = application_of(scope["app"])
        if inner is None:
            body = json.dumps({"error": {"code": "model_unavailable", "message": MISSING, "details": {}}}).encode()
            headers = [(b"content-type", b"application/json")]
            await send({"type": "http.response.start", "status": 503, "headers": headers})
            await send({"type": "http.response.body", "body": body})
            return
        await inner(scope, receive, send)


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
