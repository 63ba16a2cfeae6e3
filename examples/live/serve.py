"""The page of this folder and a live session behind it, without the rest of a server, on this machine only.

pip install starlette uvicorn websockets
python examples/live/serve.py            then open http://127.0.0.1:8765
"""

import sys
from pathlib import Path

import uvicorn
from starlette.applications import Starlette
from starlette.routing import Mount, WebSocketRoute
from starlette.staticfiles import StaticFiles
from starlette.websockets import WebSocket

from motionloom import Prior
from motionloom.live.sessions import Sessions
from motionloom.live.socket import live_session

HERE = Path(__file__).parent
PORT = int(sys.argv[1]) if len(sys.argv) > 1 else 8765
OWN = {f"http://127.0.0.1:{PORT}", f"http://localhost:{PORT}"}
prior = Prior.load()
sessions = Sessions(lambda: prior)


async def live(websocket: WebSocket) -> None:
    """Pages of other sites must not steer anybody here."""
    if websocket.headers.get("origin") in {None, *OWN}:
        await live_session(websocket, sessions)
    else:
        await websocket.close(1008)


app = Starlette(routes=[WebSocketRoute("/live", live), Mount("/", StaticFiles(directory=HERE, html=True))])

if __name__ == "__main__":
    uvicorn.run(app, host="127.0.0.1", port=PORT, ws_max_size=1 << 18, ws_max_queue=16, log_level="warning")
