"""Many at once: jobs of 20 clients, slow readers, and memory that stays flat.

Each client asks for 2 jobs; ``LOAD=10`` asks for more, 200 in all.
"""

import os
import socket
import threading
from collections import Counter

import pytest

from tests.server.serving import Server

EACH = int(os.environ.get("LOAD", "2"))
"""Jobs of each client."""


@pytest.mark.slow
def test_the_jobs_of_20_clients_are_all_done_and_memory_stays_flat(server: Server) -> None:
    def batch() -> Counter[str]:
        states: Counter[str] = Counter()
        lock = threading.Lock()

        def client(number: int) -> None:
            jobs = [
                server.submit(
                    f"client {number}", task="generate", prompt="a person walks", seconds=1.0, steps=2, seed=i
                )
                for i in range(EACH)
            ]
            ended = [server.wait(job)["state"] for job in jobs]
            with lock:
                states.update(ended)

        threads = [threading.Thread(target=client, args=(number,)) for number in range(20)]
        for thread in threads:
            thread.start()
        for thread in threads:
            thread.join()
        return states

    assert batch() == {"done": 20 * EACH}
    before = server.memory()
    assert batch() == {"done": 20 * EACH}
    assert server.memory() - before < 40 << 20


@pytest.mark.slow
def test_one_greedy_client_does_not_keep_others_waiting(server: Server) -> None:
    greedy = [
        server.submit("greedy", task="compose", timeline={"segments": ["a person walks"]}, steps=3) for _ in range(20)
    ]
    modest = server.submit("modest", task="compose", timeline={"segments": ["a person jumps"]}, steps=3)
    assert server.wait(modest)["state"] == "done"
    unfinished = [job for job in greedy if server.json("GET", f"/jobs/{job}")[1]["state"] == "queued"]
    for job in greedy:
        server.json("DELETE", f"/jobs/{job}")
    assert len(unfinished) >= 15


@pytest.mark.slow
def test_readers_who_do_not_read_hold_nobody_up(server: Server) -> None:
    job = server.submit(task="generate", prompt="a person walks", seconds=10.0, count=8, steps=12)
    sleepers = []
    for _ in range(20):
        connection = socket.create_connection(("127.0.0.1", server.port), timeout=60)
        connection.sendall(f"GET /jobs/{job}/events HTTP/1.1\r\nHost: localhost\r\n\r\n".encode())
        sleepers.append(connection)
    before = server.memory()
    assert server.wait(job)["state"] == "done"
    assert server.memory() - before < 200 << 20
    assert server.draw(task="generate", prompt="a person jumps", seconds=1.0, steps=1)["state"] == "done"
    for connection in sleepers:
        connection.close()
    assert server.json("GET", "/health")[0] == 200
