"""Draw docs/architecture.svg: the five steps from what is asked to a file, and the doors.

python tools/draw_architecture.py

The doors and tasks are those of the code; a test holds the picture to it.
"""

from html import escape
from pathlib import Path

from motionloom.requests.tasks import REQUESTS

PLACE = Path(__file__).parents[1] / "docs" / "architecture.svg"
DOORS = (
    ("command line", "cli/"),
    ("server, studio", "server/"),
    ("assistants (MCP)", "server/assistant.py"),
    ("batch", "bulk/"),
    ("live", "live/"),
    ("Python", "motionloom.generate ..."),
)
STEPS = (
    ("request", "requests/", "checked values"),
    ("plan", "tasks/run.py", "files read"),
    ("sample", "tasks/sampling.py, core/diffusion/", "noise to features"),
    ("body", "core/features/, core/body/, edits/", "features to people"),
    ("write", "io/, viz/, retarget/", "people to files"),
)
WIDTH, ROW, BOX = 860, 34, 126


def _text(x: float, y: float, words: str, size: int = 12, more: str = "") -> str:
    return f'<text x="{x:g}" y="{y:g}" font-size="{size}" {more}>{escape(words)}</text>'


def _box(x: float, y: float, width: float, height: float, fill: str) -> str:
    return f'<rect x="{x:g}" y="{y:g}" width="{width:g}" height="{height:g}" rx="5" fill="{fill}" stroke="#556"/>'


def _line(x: float, y: float, to_x: float, to_y: float) -> str:
    return f'<path d="M{x:g} {y:g}L{to_x:g} {to_y:g}" stroke="#556" fill="none" marker-end="url(#tip)"/>'


def picture() -> str:
    """The SVG."""
    height = 50 + ROW * len(DOORS)
    middle = 14 + ROW * len(DOORS) / 2
    parts = [
        f'<svg xmlns="http://www.w3.org/2000/svg" viewBox="0 0 {WIDTH} {height}" font-family="sans-serif" fill="#223">',
        '<marker id="tip" viewBox="0 0 8 8" refX="8" refY="4" markerWidth="7" markerHeight="7" orient="auto">'
        '<path d="M0 0L8 4L0 8z" fill="#556"/></marker>',
        f'<rect width="{WIDTH}" height="{height}" fill="#fff"/>',
    ]
    for number, (door, where) in enumerate(DOORS):
        y = 14 + ROW * number
        parts += [_box(10, y, 140, ROW - 6, "#eef3fb"), _text(18, y + 13, door), _text(18, y + 24, where, 9)]
        parts.append(_line(150, y + 14, 176, middle))
    for number, (step, where, does) in enumerate(STEPS):
        x = 178 + number * (BOX + 10)
        parts.append(_box(x, middle - 34, BOX, 68, "#fdf6e3"))
        parts += [_text(x + 8, middle - 15, step, 14, 'font-weight="bold"'), _text(x + 8, middle + 3, does, 11)]
        parts.append(_text(x + 8, middle + 21, where, 8))
        if number:
            parts.append(_line(x - 10, middle, x, middle))
    said = "tasks: " + ", ".join(REQUESTS)
    back = "results, one after the other: people, measures, remarks; progress and poses on the way"
    parts += [_text(180, height - 34, said, 11), _text(180, height - 16, back, 11), "</svg>"]
    return "\n".join(parts) + "\n"


if __name__ == "__main__":
    PLACE.write_text(picture(), encoding="utf-8")
    print(PLACE)
