"""Copy the measured tables of benchmarks/ into README.md, so that no number there was typed by hand.

README.md holds pairs of lines, ``<!-- filled from benchmarks/NAME -->`` and ``<!-- end -->``; what is between
them is replaced by that file: Markdown without its title, anything else as preformatted text. A missing file leaves
its place as it is. ``NAME: COLUMN, COLUMN`` takes only these columns of the tables in a Markdown file.

    python tools/fill_readme.py
"""

import re
from pathlib import Path

ROOT = Path(__file__).resolve().parents[1]
PLACE = re.compile(r"(<!-- filled from ([^\s:]+)(?:: ([^\n]+?))? -->\n)(.*?)(<!-- end -->)", re.DOTALL)


def places(text: str) -> dict[str, str]:
    """What is now between each pair of markers, by the file it comes from."""
    return {found[2]: found[4].strip() for found in PLACE.finditer(text)}


def shown(source: Path, columns: str | None = None) -> str:
    """A measured file as Markdown, of its tables only the named columns (all without any)."""
    text = source.read_text().strip()
    if source.suffix != ".md":
        return f"```text\n{text}\n```"
    text = re.sub(r"\A# .*\n+", "", text)
    return chosen(text, [name.strip() for name in columns.split(",")]) if columns else text


def chosen(text: str, columns: list[str]) -> str:
    """Markdown whose tables keep only the named columns; raises ValueError where a table lacks one."""
    lines, places = [], None
    for line in text.splitlines():
        cells = [cell.strip() for cell in line.strip("|").split("|")] if line.startswith("|") else []
        if not cells:
            places = None
        elif places is None:
            places = [cells.index(name) for name in columns]
        lines.append(f"| {' | '.join(cells[place] for place in places)} |" if cells and places else line)
    return "\n".join(lines)


def fill(text: str, root: Path = ROOT) -> str:
    """``text`` with every marked place filled from its file under ``root``."""

    def one(found: re.Match[str]) -> str:
        source = root / found[2]
        return f"{found[1]}{shown(source, found[3])}\n{found[5]}" if source.is_file() else found[0]

    return PLACE.sub(one, text)


if __name__ == "__main__":
    readme = ROOT / "README.md"
    readme.write_text(fill(readme.read_text()))
    for name in places(readme.read_text()):
        print(name, "filled" if (ROOT / name).is_file() else "missing")
