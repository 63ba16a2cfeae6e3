"""One process of `motionloom.bulk.crew`: reads tasks as JSON lines and reports on its output what became of them.

Started as ``python -m motionloom.bulk.worker``. It ends when its input does, and so never outlives who started it.
"""

import json
import os
import queue
import signal
import sys
import threading
import warnings
from dataclasses import asdict
from typing import Any, TextIO

from motionloom.core.errors import MotionloomError


def main() -> int:
    """Generate shards until the input ends."""
    signal.signal(signal.SIGINT, signal.SIG_IGN)  # Ctrl-C is for who started it
    output = os.fdopen(os.dup(1), "w", encoding="utf-8")
    os.dup2(2, 1)  # what libraries print is no message
    lines: queue.Queue[str] = queue.Queue()
    threading.Thread(target=_listen, args=(lines,), daemon=True).start()

    def say(message: dict[str, Any]) -> None:
        output.write(json.dumps(message) + "\n")
        output.flush()

    warnings.showwarning = lambda message, *_: say({"warning": " ".join(str(message).split())})  # type: ignore[assignment]
    try:
        _work(lines, say)
    except MotionloomError as error:
        say({"fatal": str(error)})
    except Exception as error:  # of no row: whoever comes after this process would end alike
        import traceback

        traceback.print_exc()
        say({"fatal": f"a process that makes motions failed ({type(error).__name__}: {error})"})
    return 0


def _listen(lines: "queue.Queue[str]", source: TextIO = sys.stdin) -> None:
    for line in source:
        lines.put(line)
    os._exit(0)  # nobody is there any more


def _work(lines: "queue.Queue[str]", say: Any) -> None:
    from motionloom.bulk.shard import Batch, Task, make_shard
    from motionloom.core.models.networks import set_threads

    set_threads(1)  # there is a process for each core
    batch = Batch.from_json(lines.get())
    maker = batch.maker()
    say({"ready": True})
    while True:
        message = json.loads(lines.get())
        task = Task(message["shard"], message["first"], [row.encode("latin-1") for row in message["rows"]])
        report = make_shard(task, batch, maker, lambda rows: say({"moved": rows}))
        say({"report": asdict(report)})


if __name__ == "__main__":
    sys.exit(main())
