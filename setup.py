"""The build step that pyproject.toml cannot say: the studio's page is built into the package where Node.js is there."""

import shutil
import subprocess
import sys
from pathlib import Path

from setuptools import setup
from setuptools.command.build_py import build_py

ROOT = Path(__file__).parent
STUDIO = ROOT / "studio"
PAGE = ROOT / "packages" / "motionloom" / "src" / "motionloom" / "server" / "page" / "index.html"
WITHOUT = (
    "the studio's page is not part of this build ({}); everything but 'motionloom studio' works; with Node.js 20.19 "
    "or later on the PATH, or by 'make wheel' on Linux, it is built too"
)


def build_page(studio: Path = STUDIO, page: Path = PAGE) -> str | None:
    """Build the page where it is missing; why it is still missing, or None."""
    if page.is_file():
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
