"""Steer one person, or two, over the network for ten seconds and say where they go (`pip install websockets`).

python examples/live/client.py ws://127.0.0.1:8765/live [2]
"""

import json
import sys
import time
from collections.abc import Iterator
from contextlib import suppress
from typing import Any

from websockets.exceptions import ConnectionClosed
from websockets.sync.client import ClientConnection, connect


class LiveClient:
    """One live session; who loses the connection goes on with the same one."""

    socket: ClientConnection

    def __init__(self, url: str, **hello: Any) -> None:
        self.url, self.hello = url, hello

    def ask(self, type: str, **fields: Any) -> None:
        """Such as ask("steer", direction=90, speed=1.3, person=2): degrees, metres per second; while frames come."""
        self.socket.send(json.dumps({"type": type, **fields}))

    def frames(self) -> Iterator[dict[str, Any]]:
        """Poses at their times, for ever; comes back where the connection is lost."""
        while True:
            with connect(self.url, max_size=1 << 20) as self.socket:
                self.ask("hello", **self.hello)
                with suppress(ConnectionClosed):
                    yield from self._heard()
            time.sleep(1.0)

    def _heard(self) -> Iterator[dict[str, Any]]:
        for text in self.socket:
            said = json.loads(text)
            if said["type"] == "frame":
                yield said
            elif said["type"] == "welcome":
                self.welcome, self.hello = said, {"session": said["session"]}
            elif said["type"] == "error" or said.get("problem"):
                print(said.get("message") or said["problem"], file=sys.stderr)


if __name__ == "__main__":
    url = sys.argv[1] if len(sys.argv) > 1 else "ws://127.0.0.1:8765/live"
    people = 2 if sys.argv[2:] == ["2"] else 1
    live = LiveClient(url, seed=1, people=people)
    script = {
        0: ("say", {"text": "a person walks forward"}),
        60: ("steer", {"direction": 90, "person": people}),
        120: ("path", {"points": [[0, 0]]}),
    }
    for pose in live.frames():
        if pose["frame"] in script:
            kind, fields = script[pose["frame"]]
            live.ask(kind, **fields)
        if pose["frame"] % 20 == 0:
            for x, _, z, words in ((*one["root"], one["words"]) for one in pose.get("people", [pose])):
                print(f"{pose['time']:5.1f} s  x {x:5.2f}  z {z:5.2f}  {words}")
        if pose["frame"] >= 200:
            live.ask("bye")
            break
