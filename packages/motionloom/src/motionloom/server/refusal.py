"""`Refusal`: a request that is not answered, with its status code and the sentence that says why."""

import errno
from typing import Any


class Refusal(Exception):
    """Becomes ``{"error": sentence}`` with ``status``; ``more``: further keys of the answer."""

    def __init__(
        self,
        status: int,
        sentence: str,
        *,
        headers: dict[str, str] | None = None,
        more: dict[str, Any] | None = None,
    ) -> None:
        super().__init__(sentence)
        self.status, self.sentence, self.headers, self.more = status, sentence, headers or {}, more or {}


FULL = (errno.ENOSPC, errno.EDQUOT, errno.EFBIG)


def full_disk(error: BaseException) -> Refusal | None:
    """The refusal of what found no room on the disk, itself or in what it came of; None: that is not its cause."""
    cause: BaseException | None = error
    while cause is not None:
        if isinstance(cause, OSError) and cause.errno in FULL:
            return Refusal(507, "the disk of the project folder is full, and nothing was kept; make room and try again")
        cause = cause.__cause__
    return None
