"""Hold every figure of the documents against the weights that ship.

A figure that depends on weights stands between two comment lines, of which the first names the weight files and the
first twelve digits of their SHA-256:

    <!-- filled from benchmarks/NAME: COLUMN, COLUMN; of default 0123456789ab -->  replaced by that file
    <!-- suite NAME; of default 0123456789ab, duet 0123456789ab -->                written by `motionloom evaluate all`
    <!-- figures; of default 0123456789ab -->                                      a study's, or kept by hand
    <!-- end -->

A file that fills a place ends with the line ``Weights: default 0123456789ab``, from which the opening line is made; it
is shown without its title and that line, Markdown as it is and anything else as preformatted text, and of its tables
only the named columns where any are named. A missing file leaves its place as it is. Where a hash is not that of the
file which ships, the place begins with a sentence that says so; this program puts it there and takes it away.

    python tools/fill_readme.py [--check]        # --check changes nothing; exit code 1 where something would change
"""

import re
import sys
from collections.abc import Mapping
from pathlib import Path

from motionloom.core.models.container import weights_digest

ROOT = Path(__file__).resolve().parents[1]
WEIGHTS = ROOT / "packages" / "motionloom" / "src" / "motionloom" / "weights"
PLACE = re.compile(
    r"<!-- (filled from|suite|figures)(?: ([^\s:;]+))?(?:: ([^\n;]+?))?(?:; of ([^\n]+?))? -->\n(.*?)<!-- end -->",
    re.DOTALL,
)
EARLIER = re.compile(r"\A\*Measured on earlier weights \([^)\n]*\)\.\*\n\n")
MEASURED = re.compile(r"\n+Weights: ([^\n]+)\s*\Z")


def documents(root: Path = ROOT) -> list[Path]:
    """The files that may hold figures: README, pages, decisions and the cards of the weights."""
    weights = root / "packages" / "motionloom" / "src" / "motionloom" / "weights"
    return [root / "README.md", *sorted((root / "docs").rglob("*.md")), *sorted(weights.glob("*.md"))]


def shipped(folder: Path = WEIGHTS) -> dict[str, str]:
    """The first twelve digits of the digest of every weight file that ships, by its name; graphs do not count."""
    return {path.stem: weights_digest(path)[:12] for path in sorted(folder.rglob("*.safetensors"))}


def parse_weights(text: str) -> dict[str, str]:
    """``default 0123456789ab, duet 0123456789ab`` as a mapping; raises ValueError for anything else."""
    found = {}
    for one in text.split(", "):
        match = re.fullmatch(r"([\w.-]+) ([0-9a-f]{12})", one)
        if match is None:
            raise ValueError(f"{one!r} is no name of weights with twelve digits of a hash")
        found[match[1]] = match[2]
    return found


def places(text: str) -> dict[str, str]:
    """What is in each place that is filled from a file, by that file."""
    return {found[2]: found[5].strip() for found in PLACE.finditer(text) if found[1] == "filled from"}


def measured_file(source: Path, columns: str | None = None) -> tuple[str, str | None]:
    """A measured file as Markdown, only the named columns of its tables, and the weights it says it is of."""
    text = source.read_text().strip()
    line = MEASURED.search(text)
    text = MEASURED.sub("", text)
    if source.suffix == ".md":
        text = re.sub(r"\A# .*\n+", "", text)
        text = select_columns(text, [name.strip() for name in columns.split(",")]) if columns else text
    else:
        text = f"```text\n{text}\n```"
    return text, line[1] if line else None


def select_columns(text: str, columns: list[str]) -> str:
    """Markdown whose tables keep only the named columns; tables that have none of them go.

    Raises ValueError where a table has some of them and not all, or no table has any.
    """
    lines: list[str] = []
    kept: list[int] | None = None
    for line in text.splitlines():
        if not line.startswith("|"):
            kept = None
            lines.append(line)
            continue
        cells = [cell.strip() for cell in line.strip("|").split("|")]
        if kept is None:
            kept = [cells.index(name) for name in columns] if set(columns) & set(cells) else []
        if kept:
            lines.append(f"| {' | '.join(cells[place] for place in kept)} |")
    if not any(line.startswith("|") for line in lines):
        raise ValueError(f"no table has the columns {', '.join(columns)}")
    return re.sub(r"\n{3,}", "\n\n", "\n".join(lines)).strip()


def fill(text: str, root: Path = ROOT, known: Mapping[str, str] | None = None) -> str:
    """``text`` with every place filled from its file under ``root`` and held against the hashes that are known."""
    hashes = shipped(root / "packages" / "motionloom" / "src" / "motionloom" / "weights") if known is None else known

    def fill_one(found: re.Match[str]) -> str:
        kind, name, columns, weights, body = found.groups()
        body = EARLIER.sub("", body)
        if kind == "filled from" and (root / name).is_file():
            shown, said = measured_file(root / name, columns)
            weights, body = said or weights, f"{shown}\n"
        differs = weights and any(hashes.get(one) != mark for one, mark in parse_weights(weights).items())
        opening = kind + (f" {name}" if name else "") + (f": {columns}" if columns else "")
        return "".join(
            (
                f"<!-- {opening}{f'; of {weights}' if weights else ''} -->\n",
                f"*Measured on earlier weights ({weights}).*\n\n" if differs else "",
                f"{body}<!-- end -->",
            )
        )

    return PLACE.sub(fill_one, text)


def main() -> int:
    """Fill all documents, or say which are not filled."""
    stale = [path for path in documents() if fill(path.read_text()) != path.read_text()]
    for path in stale:
        print(path.relative_to(ROOT), "differs" if "--check" in sys.argv[1:] else "filled")
        if "--check" not in sys.argv[1:]:
            path.write_text(fill(path.read_text()))
    return int(bool(stale) and "--check" in sys.argv[1:])


if __name__ == "__main__":
    sys.exit(main())
