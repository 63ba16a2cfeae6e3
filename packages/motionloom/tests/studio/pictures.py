"""The pictures of `docs/studio.md`, taken of the real page while its walk-through is walked.

`python -m tests.studio.pictures docs/pictures` writes `studio_*.png` there.
"""

import argparse
import io
import tempfile
from pathlib import Path

from PIL import Image

from tests.studio import started
from tests.studio.studio import Studio

COLORS = 200
"""A picture of a page needs no more, and is a third of the size."""


def main() -> None:
    """Walk and write."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("folder", type=Path)
    folder = parser.parse_args().folder
    started.check()
    with tempfile.TemporaryDirectory() as place, started.server(Path(place)) as server, started.browser() as browser:
        view = {"width": 1280, "height": 720}
        page = Studio(
            browser.new_context(viewport=view, color_scheme="light", accept_downloads=True).new_page(), server
        )
        walk(page, folder)


def walk(studio: Studio, folder: Path) -> None:
    """The steps of the walk-through, a picture behind each."""
    studio.open(("a person walks forward", 4.0), ("a person waves with the right hand", 3.0))
    seek(studio, 1.3)
    keep(studio, folder / "studio_words.png")

    studio.key("p")
    x, y = studio.middle("#canvas")
    studio.drag(
        (x, y + 60), (x - 120, y + 90), (x - 210, y + 30), (x - 120, y - 20), (x + 40, y - 30), (x + 150, y - 5)
    )
    studio.drawn()
    studio.key("x")
    keep(studio, folder / "studio_path.png")

    studio.key("x", "v")
    seek(studio, 5.5)
    studio.key("t")
    for _ in range(4):
        studio.key("PageUp")
    studio.drawn()
    for _ in range(3):
        studio.key("PageUp")
    studio.drawn()
    keep(studio, folder / "studio_target.png")

    studio.key("v", "Escape", "g")
    studio.drawn()
    keep(studio, folder / "studio_takes.png")

    studio.key("g", "n")
    studio.page.wait_for_selector("#inspector >> text=What could come next")
    studio.key("Space")
    seek(studio, 8.6)
    keep(studio, folder / "studio_next.png")
    studio.key("Escape", "Shift+D")

    studio.open(("two people shake hands", 4.0), people=2)
    seek(studio, 1.5)
    keep(studio, folder / "studio_two.png")


def seek(studio: Studio, seconds: float) -> None:
    """Put the playhead there."""
    studio.key("Home")
    for _ in range(int(seconds)):
        studio.key("Shift+ArrowRight")
    for _ in range(round(seconds % 1 * 20)):
        studio.key("ArrowRight")
    studio.page.wait_for_timeout(1500)


def keep(studio: Studio, place: Path) -> None:
    """Write the page as it is."""
    studio.page.wait_for_timeout(1800)  # a picture that changed during a draw is sharp a second later
    picture = Image.open(io.BytesIO(studio.page.screenshot())).convert("RGB")
    picture.quantize(COLORS, dither=Image.Dither.NONE).save(place, optimize=True)


if __name__ == "__main__":
    main()
