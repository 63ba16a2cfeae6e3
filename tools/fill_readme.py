"""Copy the measured tables of benchmarks/ into README.md, so that no number there was typed by hand.

README.md holds pairs of lines, ``<!-- filled from benchmarks/NAME -->`` and ``<!-- end -->``; what stands between
them is replaced by that file: Markdown without its title, anything else as preformatted text. A missing file leaves
its place as it is.

    python tools/fill_readme.py
"""

import re
from pathlib import Path

ROOT = Path(__file__).resolve().parents[1]
PLACE = re.compile(r"(<!-- filled from (\S+) -->\n)(.*?)(<!-- end -->)", re.DOTALL)


def places(text: str) -> dict[str, str]:
    """What stands now between each pair of markers, by the file it comes from."""
    return {found[2]: found[3].strip() for found in PLACE.finditer(text)}


def shown(source: Path) -> str:
    """A measured file as Markdown."""
    text = source.read_text().strip()
    return re.sub(r"\A# .*\n+", "", text) if source.suffix == ".md" else f"```text\n{text}\n```"


def fill(text: str, root: Path = ROOT) -> str:
    """``text`` with every marked place filled from its file under ``root``."""

    def one(found: re.Match[str]) -> str:
        source = root / found[2]
        return f"{found[1]}{shown(source)}\n{found[4]}" if source.is_file() else found[0]

    return PLACE.sub(one, text)


if __name__ == "__main__":
    readme = ROOT / "README.md"
    readme.write_text(fill(readme.read_text()))
    for name in places(readme.read_text()):
        print(name, "filled" if (ROOT / name).is_file() else "missing")
