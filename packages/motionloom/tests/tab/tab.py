"""The page without a server, as a test uses it."""

from pathlib import Path
from urllib.parse import urlencode

PATIENCE = 600_000
"""Milliseconds that a draw may take on a busy machine."""


class Tab:
    """One tab; what it asked of the network and what went wrong in it is kept."""

    def __init__(self, page, address: str) -> None:
        self.page, self.address = page, address
        self.asked: list[str] = []
        self.faults: list[str] = []
        page.set_default_timeout(PATIENCE)
        page.on("request", lambda request: self.asked.append(request.url))
        page.on("pageerror", lambda error: self.faults.append(str(error)))
        page.on("console", lambda message: message.type == "error" and self.faults.append(message.text))

    def open(self, *sentences: tuple[float, str], **said: object) -> None:
        """Follow a link to a motion."""
        told = [("v", 1), ("seed", said.pop("seed", 0)), ("takes", said.pop("takes", 1)), *said.items()]
        told += [("s", f"{seconds} {text}") for seconds, text in sentences]
        self.page.goto(f"{self.address}#{urlencode(told)}")

    def drawn(self) -> None:
        """Wait until the motion is there."""
        self.page.wait_for_selector("body[data-state=drawn], body[data-state=failed]")
        assert self.page.locator("body[data-state=drawn]").count(), self.alert()

    def alert(self) -> str:
        """What the page complains of."""
        return " ".join(self.page.locator("#notices [role=alert]").all_inner_texts())

    @property
    def threads(self) -> int:
        """How many the page draws with."""
        return int(self.page.evaluate("document.body.dataset.threads"))

    def button(self, name: str):
        """A button by its words."""
        return self.page.get_by_role("button", name=name, exact=True)

    def save(self, suffix: str, folder: Path) -> Path:
        """The motion as a file."""
        with self.page.expect_download() as file:
            self.button(suffix.upper()).click()
        path = folder / f"{len(list(folder.iterdir()))}.{suffix}"
        file.value.save_as(path)
        return path
