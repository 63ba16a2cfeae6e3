"""What is recorded, as processors of other kinds make it: QEMU carries out their instructions alone.

ONNX Runtime asks the processor which kernels it takes; no variable of the environment tells it otherwise.
"""

import os
import platform
import shutil
import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest

from tests.outputs.commands import RECORDED, ROOT
from tests.outputs.test_commands import METRES

QEMU = shutil.which("qemu-x86_64")
CODE = """
import sys
from pathlib import Path
import numpy as np
from tests.outputs.commands import places, sampled
np.save(sys.argv[1], sampled(places(sys.argv[2], Path(sys.argv[3]))))
"""

pytestmark = pytest.mark.skipif(
    QEMU is None or platform.machine() != "x86_64", reason="qemu-x86_64 (Debian: qemu-user) is not installed"
)


@pytest.mark.parametrize(
    ("processor", "name"),
    [("Nehalem", "generate dpm2m"), ("Nehalem", "predict raw"), ("Haswell", "generate dpm2m")],
)
def test_another_kind_of_processor_makes_what_is_recorded(processor: str, name: str, tmp_path: Path) -> None:
    """One with SSE4.2 alone, which rounds each product before it is added, and one with AVX2."""
    made = tmp_path / "made.npy"
    words = [str(QEMU), "-cpu", processor, sys.executable, "-c", CODE, str(made), name, str(tmp_path)]
    env = {**os.environ, "PYTHONPATH": os.pathsep.join(filter(None, sys.path))}
    subprocess.run(words, check=True, cwd=ROOT, env=env, capture_output=True, timeout=900)
    with np.load(RECORDED, allow_pickle=False) as recorded:
        np.testing.assert_allclose(np.load(made), recorded[name], rtol=0, atol=METRES)
