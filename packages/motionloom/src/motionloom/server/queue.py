"""The queue: bounded, and fair between clients, who take turns however many jobs each of them has."""

import threading
from collections import OrderedDict, deque
from collections.abc import Callable, Hashable

from motionloom.server.jobs import Job
from motionloom.server.limits import Limits
from motionloom.server.refusal import Refusal

AGAIN = {"Retry-After": "2"}


class Queue:
    """Jobs that wait. Each client's are taken in their order; clients take turns."""

    def __init__(self, limits: Limits) -> None:
        self.limits = limits
        self._waiting: OrderedDict[str, deque[Job]] = OrderedDict()
        self._changed = threading.Condition()
        self._closed = False

    def __len__(self) -> int:
        return sum(len(jobs) for jobs in self._waiting.values())

    def put(self, job: Job) -> None:
        """Let a job wait; raises `Refusal` where too many do."""
        with self._changed:
            if len(self) >= self.limits.queue:
                raise Refusal(503, f"{self.limits.queue} jobs wait already; try again in a moment", headers=AGAIN)
            own = self._waiting.get(job.client)
            if own is None and len(self._waiting) >= self.limits.clients:
                raise Refusal(503, f"{self.limits.clients} clients wait already; try again in a moment", headers=AGAIN)
            if own is not None and len(own) >= self.limits.queue_per_client:
                raise Refusal(
                    429,
                    f"{self.limits.queue_per_client} of your jobs wait already; wait for some or cancel them",
                    headers=AGAIN,
                )
            self._waiting.setdefault(job.client, deque()).append(job)
            self._changed.notify()

    def take(self, key: Callable[[Job], Hashable], rows: int) -> list[Job]:
        """Wait for the next job and take it, with those at the heads of clients' lines that have its `key`.

        They have at most ``rows`` motions together; a job whose key is None is taken alone. Empty once closed.
        """
        with self._changed:
            while not self._waiting and not self._closed:
                self._changed.wait()
            if not self._waiting:
                return []
            first = self._next(lambda job: True)
            assert first is not None
            batch, left, common = [first], rows - first.request.count, key(first)

            def joins(job: Job) -> bool:
                return key(job) == common and job.request.count <= left

            while common is not None and left > 0 and (more := self._next(joins)) is not None:
                batch.append(more)
                left -= more.request.count
            return batch

    def remove(self, job: Job) -> None:
        """Take a job out of the queue, if it is in it."""
        with self._changed:
            own = self._waiting.get(job.client)
            if own is not None and job in own:
                own.remove(job)
                if not own:
                    del self._waiting[job.client]

    def close(self) -> None:
        """Let `take` give nothing more."""
        with self._changed:
            self._closed = True
            self._waiting.clear()
            self._changed.notify_all()

    def _next(self, fits: Callable[[Job], bool]) -> Job | None:
        """The first client's job at the head of a line that fits; that client's turn is over then."""
        for client, jobs in self._waiting.items():
            if fits(jobs[0]):
                job = jobs.popleft()
                if jobs:
                    self._waiting.move_to_end(client)
                else:
                    del self._waiting[client]
                return job
        return None
