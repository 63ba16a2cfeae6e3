"""The queue's rules, without drawing: turns, bounds, batches."""

import json
from typing import Any

import numpy as np
import pytest

pytest.importorskip("starlette", reason="needs the extra 'studio'")

from motionloom.requests.sampling import Sampling
from motionloom.server.job_request import JobRequest
from motionloom.server.jobs import Event, Job
from motionloom.server.limits import Limits
from motionloom.server.queue import Queue
from motionloom.server.refusal import Refusal


def job(client: str, *, count: int = 1, key: str | None = None) -> Job:
    return Job(JobRequest("generate", key, Sampling(count=count)), client, 1 << 20)


def key(one: Job) -> str | None:
    return one.request.values


def test_clients_take_turns_however_many_jobs_they_have() -> None:
    queue = Queue(Limits())
    for client, count in (("a", 5), ("b", 2), ("c", 1)):
        for _ in range(count):
            queue.put(job(client))
    order = [queue.take(key, 8)[0].client for _ in range(8)]
    assert order == ["a", "b", "c", "a", "b", "a", "a", "a"]


def test_jobs_of_one_kind_are_drawn_together_up_to_the_rows() -> None:
    queue = Queue(Limits())
    for client in "abcd":
        queue.put(job(client, count=3, key="same"))
    assert [one.client for one in queue.take(key, 8)] == ["a", "b"]
    assert [one.client for one in queue.take(key, 8)] == ["c", "d"]


def test_a_job_of_another_kind_is_not_passed_over_in_its_own_line() -> None:
    queue = Queue(Limits())
    queue.put(job("a", key="x"))
    queue.put(job("b", key="y"))
    queue.put(job("b", key="x"))
    assert [(one.client, key(one)) for one in queue.take(key, 8)] == [("a", "x")]
    assert [(one.client, key(one)) for one in queue.take(key, 8)] == [("b", "y")]


def test_jobs_without_a_kind_are_drawn_alone() -> None:
    queue = Queue(Limits())
    queue.put(job("a"))
    queue.put(job("b"))
    assert len(queue.take(key, 8)) == 1


def test_a_full_queue_says_so_and_when_to_come_again() -> None:
    queue = Queue(Limits(queue=3, queue_per_client=2, clients=2))
    queue.put(job("a"))
    queue.put(job("a"))
    with pytest.raises(Refusal) as own:
        queue.put(job("a"))
    queue.put(job("b"))
    with pytest.raises(Refusal) as all_of_them:
        queue.put(job("b"))
    assert (own.value.status, all_of_them.value.status) == (429, 503)
    assert own.value.headers["Retry-After"]


def test_more_clients_than_may_wait_are_refused() -> None:
    queue = Queue(Limits(clients=1))
    queue.put(job("a"))
    with pytest.raises(Refusal) as refused:
        queue.put(job("b"))
    assert refused.value.status == 503


def test_a_removed_job_is_not_taken() -> None:
    queue = Queue(Limits())
    first, second = job("a"), job("a")
    queue.put(first)
    queue.put(second)
    queue.remove(first)
    assert queue.take(key, 8) == [second]
    assert len(queue) == 0


def log(one: Job) -> list[Event]:
    """All that a stream sends of a job's log as it is now."""
    events: list[Event] = []
    while (event := one.event_after(events[-1].number if events else 0)) is not None:
        events.append(event)
    return events


def data(event: Event) -> dict[str, Any]:
    return json.loads(event.text.decode().split("data: ")[1])


def test_the_log_of_a_job_stays_small_and_keeps_the_newest() -> None:
    one = Job(JobRequest("generate", None, Sampling()), "a", 400_000)
    for level in range(1, 51):
        one.level(level, 50, 0, np.zeros((1, 100, 22, 3)))
    levels = [data(event)["level"] for event in log(one)]
    assert levels == list(range(51 - len(levels), 51))
    assert len(levels) == 400_000 // len(log(one)[-1].text)
    assert one.log_bytes <= one.most_bytes


def test_an_event_is_written_out_once_however_many_read_it() -> None:
    one = job("a")
    one.level(1, 2, 0, np.zeros((1, 40, 22, 3)))
    one.progress(1, 2)
    assert all(first.text is second.text for first, second in zip(log(one), log(one), strict=True))
    assert [event.kind for event in log(one)] == ["level", "progress"]


def test_a_stream_that_is_slow_goes_on_with_what_is_still_in_the_log() -> None:
    one = Job(JobRequest("generate", None, Sampling()), "a", 100_000)
    one.level(1, 99, 0, np.zeros((1, 40, 22, 3)))
    first = one.event_after(0)
    assert first is not None
    for level in range(2, 100):
        one.level(level, 99, 0, np.zeros((1, 40, 22, 3)))
        one.progress(level, 99)
    one.end("done")
    rest = []
    while (event := one.event_after(rest[-1].number if rest else first.number)) is not None:
        rest.append(event)
    assert data(rest[0])["level"] > 2
    assert [event.number for event in rest] == sorted({event.number for event in rest})
    assert [event.kind for event in rest[-2:]] == ["progress", "done"]


def test_what_ended_stays_as_it_ended() -> None:
    one = job("a")
    assert one.end("cancelled")
    assert not one.end("done")
    assert not one.started()
    assert one.public()["state"] == "cancelled"
