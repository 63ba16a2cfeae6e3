"""Renew the pins: exact versions and hashes of all that `make` installs. Run as ``make pins``.

uv resolves pyproject.toml for CPython 3.11 on Linux and writes the hashes that the package index states, for every
platform's files. Five files come of it, which pip takes with ``--require-hashes``:

constraints.txt          what tests and checks need, the runtime's packages among them
constraints-runtime.txt  what `make demo` needs
constraints-cuda.txt     CUDA's own libraries, which only a CUDA build of torch wants
constraints-studio.txt   what `make studio` needs beside constraints-runtime.txt
constraints-robots.txt   what the extra `robots` needs beside constraints.txt

PyTorch also ships builds outside of the index (``2.13.0+cpu``), with other hashes. Those that this machine's pip would
take are added, and those in the file for the same version stay.
"""

import argparse
import hashlib
import re
import subprocess
import sys
import tempfile
from pathlib import Path

ROOT = Path(__file__).parents[1]
HEAD = """# Exact versions and hashes of {what}.
# Written by `make pins` (tools/pins.py) with uv; not to be edited. Of torch the index's hashes and those of CPU builds.
"""
WHAT = {
    "constraints.txt": "all that tests and checks need, the runtime's packages too (Linux, CPython 3.11)",
    "constraints-runtime.txt": "all that `make demo` installs (Linux, CPython 3.11)",
    "constraints-cuda.txt": "CUDA's libraries, for a CUDA build of torch (Linux, CPython 3.11)",
    "constraints-studio.txt": "all that `make studio` installs beside constraints-runtime.txt (Linux, CPython 3.11)",
    "constraints-robots.txt": "all that robots need beside constraints.txt (Linux, CPython 3.11)",
}
BUILD = "setuptools>=77\n"
"""What builds the package, without isolation."""
CUDA = re.compile(r"(nvidia|cuda|triton)\b")


def resolved(extras: list[str], limits: Path | None, *, upgrade: bool) -> dict[str, list[str]]:
    """Lines of each package's pin, by its name."""
    known = [ROOT / f"constraints{kind}.txt" for kind in ("", "-cuda", "-robots")]
    with tempfile.TemporaryDirectory() as place:
        made = Path(place) / "made.txt"
        if not upgrade:  # uv keeps the versions that its output file has
            made.write_text("".join(path.read_text() for path in known if path.is_file()))
        command = [
            "uv",
            "pip",
            "compile",
            "pyproject.toml",
            "-",
            "--quiet",
            "--generate-hashes",
            "--no-annotate",
            "--no-header",
            "--python-version",
            "3.11",
            "--python-platform",
            "x86_64-manylinux_2_28",
            "--output-file",
            str(made),
            *(word for extra in extras for word in ("--extra", extra)),
            *(("-c", str(limits)) if limits else ()),
        ]
        subprocess.run(command, cwd=ROOT, input=BUILD, text=True, check=True)
        return parsed(made.read_text())


def parsed(text: str) -> dict[str, list[str]]:
    """Lines of each package's pin, by its name."""
    pins: dict[str, list[str]] = {}
    for line in text.splitlines():
        if line and not line.startswith("#"):
            if not line.startswith(" "):
                pins[re.split(r"[=\[ ]", line)[0]] = []
            pins[list(pins)[-1]].append(line.removesuffix(" \\"))
    return pins


def other_builds(torch: list[str]) -> list[str]:
    """Hashes of torch's builds that this machine's pip takes, or that the old file has for this version."""
    found = set()
    old = parsed((ROOT / "constraints.txt").read_text()) if (ROOT / "constraints.txt").is_file() else {}
    if old.get("torch", [""])[0] == torch[0]:
        found |= {line.strip() for line in old["torch"][1:]}
    with tempfile.TemporaryDirectory() as place:
        command = [sys.executable, "-m", "pip", "download", "--quiet", "--no-deps", "--dest", place, torch[0]]
        subprocess.run(command, check=True)
        for wheel in Path(place).iterdir():
            with wheel.open("rb") as content:
                found.add(f"--hash=sha256:{hashlib.file_digest(content, 'sha256').hexdigest()}")
    return [f"    {one}" for one in sorted(found - {line.strip() for line in torch})]


def write(name: str, pins: dict[str, list[str]]) -> None:
    body = "\n".join(" \\\n".join(lines) for lines in pins.values())
    (ROOT / name).write_text(HEAD.format(what=WHAT[name]) + body + "\n")
    print(f"{name}: {len(pins)} packages")


def main() -> int:
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--upgrade", action="store_true", help="take newer versions where there are any")
    upgrade = parser.parse_args().upgrade
    everything = resolved(["dev"], None, upgrade=upgrade)
    everything["torch"] += other_builds(everything["torch"])
    with tempfile.TemporaryDirectory() as place:
        limits = Path(place) / "limits.txt"
        limits.write_text("".join(f"{lines[0]}\n" for lines in everything.values()))
        runtime = resolved(["film"], limits, upgrade=upgrade)
        studio = resolved(["studio"], limits, upgrade=upgrade)
        robots = resolved(["robots"], limits, upgrade=upgrade)
    write("constraints.txt", {name: lines for name, lines in everything.items() if not CUDA.match(name)})
    write("constraints-runtime.txt", {name: everything[name] for name in runtime if not CUDA.match(name)})
    write("constraints-studio.txt", {name: everything[name] for name in studio if name not in runtime})
    write("constraints-cuda.txt", {name: lines for name, lines in everything.items() if CUDA.match(name)})
    write("constraints-robots.txt", {name: lines for name, lines in robots.items() if name not in everything})
    return 0


if __name__ == "__main__":
    sys.exit(main())
