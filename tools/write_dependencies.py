"""Write docs/dependencies.md: every component that is shipped or run, with its version, licence and date.

Names and versions come from the lock files: the `constraints*.txt` of Python, the lock of npm, and the pin of Node.
Licences come from what is installed and from npm's lock. What is not installed here keeps the licence that the page
has for the same version. ``--check`` writes nothing and ends with 1 where the page is not up to date.
"""

import json
import platform
import re
import subprocess
import sys
from collections.abc import Iterator
from dataclasses import dataclass
from importlib import metadata
from importlib.util import find_spec
from pathlib import Path
from typing import Any

ROOT = Path(__file__).parents[1]
PLACE = ROOT / "docs" / "dependencies.md"
LOCKS = {
    "constraints-runtime.txt": "What a user's installation runs",
    "constraints-robots.txt": "For robots",
    "constraints-cuda.txt": "For graphics processors",
    "constraints.txt": "For the server's extras, training, measurements and tests",
    "studio/node.txt": "Builds the page",
}
"""Lock files of Python, with headings; a component stands under the first of them that has it."""
SHIPPED, BUILDS = "Inside the pages (npm)", "Builds and tests the pages (npm)"
HEAD = """# What motionloom depends on

Written by `python tools/write_dependencies.py` out of the lock files and of what is installed; a test compares it with
the lock files. The date of a release stands where its version or its program tells it: neither a lock file nor the
metadata of an installed package has one. `pip-audit -r constraints.txt` and `npm audit` in `studio` ask for known
weaknesses of these versions; both need a network.

**ONNX Runtime has two versions on purpose.** Python runs {python}, the browser {web}: npm has no {python}. Its newest
release of 2026-11-28, 1.30.0, makes the WebAssembly build that every visitor of the tab downloads 3.9 MB instead of
3.1 MB (compressed), and the graphs in the weight files need nothing that is new in it. Tests compare what the browser's
version computes with Python's numbers.

**ffmpeg** is a program of its own inside of the wheel of `imageio-ffmpeg`: it is started as a process, never linked,
and only for films (`.mp4`) where the system has no ffmpeg. It is under the GPL; motionloom, which is under the MIT
licence, does not contain it.
"""
DATES = {("onnxruntime-web", "1.24.3"): "2026-03-21", ("onnxruntime-common", "1.24.3"): "2026-03-21"}
"""Of releases whose registry was asked."""


@dataclass(frozen=True)
class Component:
    """A row of the page."""

    name: str
    version: str
    licence: str
    """Empty: not told here."""
    date: str = ""

    @property
    def row(self) -> str:
        """As a line of the table."""
        return f"| {self.name} | {self.version} | {self.licence or 'not told'} | {self.date or '-'} |"


def licence_of(name: str, version: str) -> str:
    """The licence of an installed package of this version, as its metadata has it; empty where there is none."""
    try:
        told: Any = metadata.distribution(name).metadata
    except metadata.PackageNotFoundError:
        return ""
    if told["Version"].partition("+")[0] != version.partition("+")[0]:
        return ""
    lines = (told.get("License-Expression") or told.get("License") or "").strip().splitlines()
    if lines and len(lines[0]) <= 120:
        return lines[0].replace("|", "/")
    kinds = [one.rsplit(" :: ", 1)[-1] for one in told.get_all("Classifier") or () if one.startswith("License ::")]
    return ", ".join(kinds)


def date_of(version: str) -> str:
    """The month or day that a version is called after; empty where it is a mere number."""
    match = re.match(r"(20[12]\d)\.(\d{1,2})(?:\.(\d{1,2}))?(?!\d)", version)
    if match is None or not 1 <= int(match[2]) <= 12:
        return ""
    return f"{match[1]}-{int(match[2]):02}"


def pinned(path: Path) -> Iterator[tuple[str, str]]:
    """Names and versions of a lock file of Python."""
    for match in re.finditer(r"^([A-Za-z0-9._-]+)==([^\s\\;]+)", path.read_text(encoding="utf-8"), re.MULTILINE):
        yield match[1], match[2]


def of_python(known: dict[tuple[str, str], Component]) -> dict[str, list[Component]]:
    """Components by heading."""
    tables: dict[str, list[Component]] = {}
    seen: set[tuple[str, str]] = set()
    for file, heading in LOCKS.items():
        for name, version in pinned(ROOT / file):
            if (name, version) in seen:
                continue
            seen.add((name, version))
            before = known.get((name, version))
            licence = licence_of(name, version) or (before.licence if before else "")
            tables.setdefault(heading, []).append(Component(name, version, licence, date_of(version)))
            if name == "imageio-ffmpeg":
                tables[heading].append(ffmpeg(known))
    return tables


def ffmpeg(known: dict[tuple[str, str], Component]) -> Component:
    """The program inside of imageio-ffmpeg; as the page has it where that is not installed."""
    name = "ffmpeg (in imageio-ffmpeg, Linux x86-64)"
    here = (platform.system(), platform.machine()) == ("Linux", "x86_64")
    if not here or find_spec("imageio_ffmpeg") is None:
        return next((one for key, one in known.items() if key[0] == name), Component(name, "not told", ""))
    from imageio_ffmpeg import get_ffmpeg_exe

    told = subprocess.run([get_ffmpeg_exe(), "-version"], capture_output=True, text=True, check=True).stdout
    version = told.split()[2]
    licence = "GPL-3.0-or-later" if "--enable-version3" in told else "GPL-2.0-or-later"
    day = re.search(r"(20\d\d)(\d\d)(\d\d)$", version)
    return Component(name, version, licence, "-".join(day.groups()) if day else "")


def of_npm() -> dict[str, list[Component]]:
    """Components by heading, as npm's lock tells them."""
    packages = json.loads((ROOT / "studio" / "package-lock.json").read_text(encoding="utf-8"))["packages"]
    tables: dict[str, list[Component]] = {SHIPPED: [], BUILDS: []}
    for place, one in packages.items():
        if not place.startswith("node_modules/") or one.get("link") or "version" not in one:
            continue
        name, version = place.rpartition("node_modules/")[2], one["version"]
        heading = BUILDS if one.get("dev") or one.get("devOptional") or one.get("optional") else SHIPPED
        tables[heading].append(Component(name, version, one.get("license", ""), DATES.get((name, version), "")))
    return tables


def written() -> dict[tuple[str, str], Component]:
    """The components of the page as it is, by name and version."""
    if not PLACE.exists():
        return {}
    rows = re.findall(r"^\| (.+?) \| (.+?) \| (.+?) \| (.+?) \|$", PLACE.read_text(encoding="utf-8"), re.MULTILINE)
    components = [Component(*(("" if part in ("not told", "-") else part) for part in row)) for row in rows]
    return {(one.name, one.version): one for one in components}


def page() -> str:
    """The whole page."""
    tables = of_python(written()) | of_npm()
    versions = {one.name: one.version for table in tables.values() for one in table}
    parts = [HEAD.format(python=versions["onnxruntime"], web=versions["onnxruntime-web"])]
    for heading, table in tables.items():
        rows = dict.fromkeys(one.row for one in sorted(table, key=lambda one: (one.name.lower(), one.version)))
        parts.append(
            "\n".join([f"## {heading}\n", "| component | version | licence | date |", "|---|---|---|---|", *rows])
        )
    return "\n\n".join(part.strip() for part in parts) + "\n"


def main() -> int:
    """Write the page, or check it."""
    text = page()
    if "--check" in sys.argv[1:]:
        return 0 if PLACE.exists() and PLACE.read_text(encoding="utf-8") == text else 1
    PLACE.write_text(text, encoding="utf-8")
    return 0


if __name__ == "__main__":
    sys.exit(main())
