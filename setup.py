"""The build step that pyproject.toml cannot say: the studio's page and the viewer are built where Node.js is there."""

import shutil
import subprocess
import sys
from collections.abc import Sequence
from pathlib import Path

from setuptools import setup
from setuptools.command.build_py import build_py

ROOT = Path(__file__).parent
STUDIO = ROOT / "studio"
SOURCE = ROOT / "packages" / "motionloom" / "src" / "motionloom"
PAGE = SOURCE / "server" / "page" / "index.html"
VIEWER = SOURCE / "viz" / "viewer.html"
WITHOUT = (
    "the studio's page and the viewer of .html files are not part of this build ({}); everything but 'motionloom "
    "studio' and .html files works; with Node.js 20.19 or later on the PATH, or by 'make wheel' on Linux, they are too"
)


def build_page(studio: Path = STUDIO, pages: Sequence[Path] = (PAGE, VIEWER)) -> str | None:
    """Build the pages where one is missing; why it is still missing, or None."""
    if all(page.is_file() for page in pages):
        return None
    if not (studio / "package.json").is_file():
        return "its sources are not here"
    npm = shutil.which("npm")
    if npm is None:
        return "npm was not found"
    for command in (["ci", "--no-audit", "--no-fund"], ["run", "build"]):
        done = subprocess.run([npm, *command], cwd=studio, check=False)
        if done.returncode:
            return f"'npm {command[0]}' failed"
    return None


class BuildWithPage(build_py):
    """Python's files, after the page; an editable install takes the page from the source tree whenever it is built."""

    def run(self) -> None:
        why = None if self.editable_mode else build_page()
        if why:
            print(f"motionloom: {WITHOUT.format(why)}", file=sys.stderr)
        super().run()


if __name__ == "__main__":
    setup(cmdclass={"build_py": BuildWithPage})
