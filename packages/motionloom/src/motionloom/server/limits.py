"""How much one server takes: every number that a request is refused by, in one place."""

from dataclasses import dataclass, fields

from motionloom.requests.shared import LONGEST


@dataclass(frozen=True)
class PublicLimits:
    """Those that `/capabilities` reports."""

    seconds: float = LONGEST
    """Of one motion of one prompt."""
    total_seconds: float = 600.0
    """Of a long motion, of futures, and of a clip that is uploaded."""
    count: int = 8
    """Motions of one job."""
    steps: int = 200
    """Network calls of one motion."""
    prompt: int = 2000
    """Characters of a prompt."""
    body_bytes: int = 4 << 20
    """Of a JSON body."""
    upload_bytes: int = 64 << 20
    """Of a file that is sent."""
    project_bytes: int = 16 << 20
    """Of the project's JSON."""
    queue: int = 256
    """Jobs that wait, of all clients together."""
    queue_per_client: int = 64
    people: int = 8
    """People of one file that is sent."""


@dataclass(frozen=True)
class Limits(PublicLimits):
    """Bounds of requests, of the queue and of the project folder."""

    clients: int = 128
    """Clients with jobs that wait."""
    streams: int = 128
    """Event streams that are open."""
    kept_jobs: int = 500
    """Finished jobs that are remembered."""
    level_bytes: int = 64 << 20
    """Poses of denoising that are remembered for streams, of all jobs together."""
    level_bytes_per_job: int = 16 << 20
    motions: int = 5000
    """Motions in the project folder; the oldest that the project does not name go first."""
    stored_bytes: int = 4 << 30
    """Bytes of them, and of characters."""
    uploads: int = 200
    """Characters and ASF skeletons in the project folder."""
    body_seconds: float = 60.0
    """In which a body must have arrived."""
    connections: int = 512
    """Requests that are answered at the same time, and connections beyond which those go that have waited longest."""
    reserve: int = 128
    """Of these requests, those left for who holds the token."""
    header_seconds: float = 10.0
    """In which the headers of a request must have arrived."""
    stuck_seconds: float = 60.0
    """After which a client that takes nothing of its answer is gone."""
    exports: int = 2
    """Files that are written at the same time."""

    def public(self) -> dict[str, float]:
        """What `/capabilities` reports."""
        return {one.name: getattr(self, one.name) for one in fields(PublicLimits)}
