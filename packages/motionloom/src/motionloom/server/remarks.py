"""What is said of a job's words before it is drawn, as the command line says it on stderr."""

from typing import TYPE_CHECKING

from motionloom.goals.remarks import Remark, numbers_read, parts_read, remarks_on, remarks_on_two
from motionloom.server.job_request import JobRequest
from motionloom.tasks.direct_edits import is_only_head_free

if TYPE_CHECKING:
    from motionloom.tasks.run import Models

MOST = 64
"""Texts of one job that are looked at."""


def remarks_of(models: "Models", request: JobRequest) -> list[Remark]:
    """Remarks on the words of a request: numbers and actions read in them, words that nobody learned.

    Raises `MotionloomError` where a text cannot be encoded.
    """
    if request.call is not None or request.task in ("predict", "switch"):
        return []
    timeline, prior = request.timeline, models.prior
    texts = [request.prompt] if timeline is None else [segment.text for segment in timeline.segments]
    texts = list(dict.fromkeys(texts))[:MOST]
    if request.task == "edit" and is_only_head_free(request.values.keep):
        return []
    if request.task == "duet":
        return remarks_on_two(texts, models.block.known, prior.known, prior.text)
    read = [] if timeline is None or request.task != "generate" else [numbers_read(timeline), parts_read(timeline)]
    remarks = [Remark(request.prompt, line) for line in read if line]
    return remarks + remarks_on(texts, prior.known, prior.text)
