"""`Refusal`: a request that is not answered, with its status code and the sentence that says why."""


class Refusal(Exception):
    """Becomes ``{"error": sentence}`` with ``status``."""

    def __init__(self, status: int, sentence: str, *, headers: dict[str, str] | None = None) -> None:
        super().__init__(sentence)
        self.status, self.sentence, self.headers = status, sentence, headers or {}
