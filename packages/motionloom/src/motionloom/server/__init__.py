"""The server: motion over HTTP, with the prior loaded once. `docs/server.md` is its contract.

Needs the extra ``studio`` (Starlette and uvicorn). `serving.serve` starts it, `app.build` gives the ASGI application.
"""
