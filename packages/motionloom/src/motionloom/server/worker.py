"""The worker: one thread with the prior loaded once, which samples what the queue gives it, batch by batch."""

import logging
import sys
import threading
from collections.abc import Callable, Sequence
from dataclasses import asdict
from typing import TYPE_CHECKING, Any

from motionloom.core.errors import MotionloomError
from motionloom.goals.adapters import Applied
from motionloom.server.jobs import Job
from motionloom.server.limits import Limits
from motionloom.server.project import Project
from motionloom.server.queue import Queue
from motionloom.server.refusal import Refusal, full_disk

if TYPE_CHECKING:
    from motionloom.core.models.prior import Prior
    from motionloom.tasks.run import Models, Result
    from motionloom.tasks.watching import Denoised

log = logging.getLogger("motionloom.server")
ROWS = 8
"""Motions of one network call."""


class _Cancelled(Exception):
    """The jobs of a batch were cancelled."""


class Worker:
    """Jobs by their ids, and the thread that samples them."""

    def __init__(
        self,
        project: Project,
        limits: Limits,
        *,
        weights: str = "default",
        device: str = "cpu",
        adapters: Sequence[Applied] = (),
    ) -> None:
        self.project, self.limits, self.queue = project, limits, Queue(limits)
        self.weights, self.device, self.adapters = weights, device, adapters
        self.models: Models | None = None
        self.problem: str | None = None
        """Why nothing can be sampled."""
        self._jobs: dict[str, Job] = {}
        self._lock = threading.Lock()
        self._loaded = threading.Event()
        self._thread = threading.Thread(target=self._run, name="motionloom-worker", daemon=True)

    @property
    def warm(self) -> bool:
        """Whether the prior is loaded and has sampled once."""
        return self.models is not None

    def prior(self) -> "Prior":
        """The weights, once they are loaded; raises `Refusal` 503 where they cannot be."""
        self._loaded.wait()
        if self.models is None:
            raise Refusal(503, self.problem or "the server was stopped")
        return self.models.prior

    def start(self) -> None:
        """Begin to load the prior, and to sample."""
        self._thread.start()

    def stop(self) -> None:
        """Cancel everything; the thread ends at the next network call."""
        with self._lock:
            jobs = list(self._jobs.values())
        for job in jobs:
            job.end("cancelled", "the server was stopped")
        self.queue.close()

    def submit(self, request: Any, client: str) -> Job:
        """Queue a request; raises `Refusal` where the queue is full."""
        if self.problem is not None:
            raise Refusal(503, self.problem)
        job = Job(request, client, self.limits.level_bytes_per_job)
        self.queue.put(job)
        with self._lock:
            self._jobs[job.id] = job
            self._forget()
        return job

    def job(self, name: str) -> Job:
        """The job of that id; raises `Refusal` 404."""
        with self._lock:
            if name not in self._jobs:
                raise Refusal(404, "there is no such job; it ended long ago, or the server was started anew since")
            return self._jobs[name]

    def cancel(self, job: Job) -> None:
        """End a job: one that waits at once, one that is sampled at the next network call."""
        self.queue.remove(job)
        job.end("cancelled")

    def _forget(self) -> None:
        """Keep the memory flat: the oldest finished jobs go, and the poses of the older ones' logs."""
        finished = [job for job in self._jobs.values() if job.finished]
        for job in finished[: max(len(finished) - self.limits.kept_jobs, 0)]:
            del self._jobs[job.id]
        spare = sum(job.log_bytes for job in self._jobs.values()) - self.limits.level_bytes
        for job in finished:
            if spare <= 0:
                return
            spare -= job.log_bytes
            job.forget_levels()

    # -- the thread

    def _run(self) -> None:
        try:
            self.models = models = self._load()
            self._loaded.set()
        except Exception as error:
            if not isinstance(error, MotionloomError):
                log.exception("the prior could not be loaded")
            self.problem = f"nothing can be drawn: {error or type(error).__name__}"
            print(f"motionloom: {self.problem}", file=sys.stderr)
            self._loaded.set()
            self.stop()
            return
        from motionloom.server.drawing import batch_key

        while jobs := self.queue.take(lambda job: batch_key(job.request), ROWS):
            self._draw(models, [job for job in jobs if job.started()])

    def _load(self) -> "Models":
        from motionloom.tasks.run import Models
        from motionloom.tasks.text import generate

        models = Models(self.weights, device=self.device, adapters=self.adapters)
        # so that no client waits for what the first call sets up
        generate(models.prior, "a person walks", seconds=1.0, steps=2)
        return models

    def _draw(self, models: "Models", jobs: Sequence[Job]) -> None:
        """Sample one batch; whatever goes wrong is reported in its jobs."""
        from motionloom.tasks.watching import watching

        if not jobs:
            return
        try:
            with watching(self._watcher(jobs)):
                self._finish(models, jobs, self._progress(jobs))
        except _Cancelled:
            return
        except Exception as error:
            refusal = self._refusal(error)
            for job in jobs:
                job.end("failed", refusal.sentence, refusal.status)

    def _refusal(self, error: Exception) -> Refusal:
        """What is reported of an error of a job."""
        if (full := full_disk(error)) is not None:
            return full
        if isinstance(error, Refusal):
            return Refusal(error.status, self.project.without_paths(error.sentence))
        if isinstance(error, MotionloomError):
            return Refusal(400, self.project.without_paths(str(error)))
        if isinstance(error, MemoryError):
            return Refusal(413, "this takes more memory than there is; ask for less at once")
        log.error("a job failed", exc_info=error)
        what = f"{type(error).__name__}: {str(error)[:200]}"
        return Refusal(500, f"the server failed ({what}); this is a fault of the program")

    def _finish(self, models: "Models", jobs: Sequence[Job], progress: Callable[[int, int], None]) -> None:
        from motionloom.server.drawing import batch_key, draw, draw_together, remarks_of

        for job in jobs:
            job.remarks = remarks_of(models, job.request)
        if batch_key(jobs[0].request) is not None:
            for index, result in draw_together(models, [job.request for job in jobs], progress):
                if not jobs[index].finished:
                    self._keep(jobs[index], result)
        else:
            for result in draw(models, jobs[0].request, progress):
                self._check(jobs)
                self._keep(jobs[0], result)
        for job in jobs:
            job.end("done")

    def _keep(self, job: Job, result: "Result") -> None:
        from motionloom.kinematics.capsules import overlaps
        from motionloom.kinematics.deeds import happened
        from motionloom.retarget import joints22

        request, measures = job.request, result.measures
        did = happened(result.people)
        if request.task == "duet":
            one, two = map(joints22, result.people)
            measures = measures | {"overlaps": overlaps(one, two, result.people[0].fps)}
        about = {"task": request.task, "prompt": request.prompt, "seed": result.seed}
        about |= {"measures": measures, "happened": did}
        if result.blocks and request.timeline and request.timeline.start is None and not request.values.loop:
            about["blocks"] = [list(block) for block in result.blocks]
        stored = self.project.add(result.people, about)
        motion = result.people[0]
        job.add_result(
            {
                "id": stored.id,
                "number": result.number,
                "seed": result.seed,
                "seconds": round(motion.seconds, 4),
                "frames": len(motion),
                "people": len(result.people),
                "measures": measures,
                "happened": did,
                "remarks": result.remarks,
                "notes": [asdict(one) for one in result.notes],
            }
        )

    def _progress(self, jobs: Sequence[Job]) -> Callable[[int, int], None]:
        def progress(calls: int, of: int) -> None:
            self._check(jobs)
            for job in jobs:
                if not job.finished:
                    job.progress(calls, of)

        return progress

    def _watcher(self, jobs: Sequence[Job]) -> "Callable[[Denoised], None]":
        """Hands the poses of every network call to the jobs whose rows they are."""
        from motionloom.server.drawing import at_once, placed

        together = len(jobs) > 1 or at_once(jobs[0].request)
        owners = [(job, row) for job in jobs for row in range(job.request.count)]
        walks = 0

        def report(denoised: "Denoised") -> None:
            nonlocal walks
            self._check(jobs)
            walks += denoised.move == 1
            if jobs[0].request.task == "switch":  # which reports no progress itself
                count = jobs[0].request.count
                jobs[0].progress(min(walks - 1, count - 1) * denoised.of + denoised.move, count * denoised.of)
            if not any(_wants(job, denoised.move) for job in jobs):
                return
            for row, poses in zip(denoised.rows, denoised.positions(), strict=True):
                job, number = owners[row] if together or denoised.rows != (0,) else _alone(jobs[0], walks)
                if _wants(job, denoised.move):
                    job.level(denoised.move, denoised.of, number, placed(job.request, poses), denoised.begin)

        return report

    def _check(self, jobs: Sequence[Job]) -> None:
        if all(job.finished for job in jobs):
            raise _Cancelled


def _wants(job: Job, calls: int) -> bool:
    """Whether a job's poses are sent after so many network calls."""
    return not job.finished and job.request.levels > 0 and calls % job.request.levels == 0


def _alone(job: Job, walks: int) -> tuple[Job, int]:
    """Whose row it is where motions are sampled one after the other: of a job, that which its progress has come to."""
    count = job.request.count
    number = walks - 1 if job.request.task == "switch" else job.calls * count // max(job.of, 1)
    return job, min(number, count - 1)
