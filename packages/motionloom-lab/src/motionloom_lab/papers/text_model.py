"""A published text model as safetensors: ``python -m motionloom_lab.papers.text_model FOLDER``.

Turns the folder's pytorch_model.bin into the model.safetensors that `nets.text.hub` opens.
"""

import argparse
import sys
from pathlib import Path

from torch import Tensor

from motionloom.core.errors import MotionloomError
from motionloom.core.files.tensors import save_tensors
from motionloom_lab.papers.torch_file import read_torch_file


def convert(folder: Path) -> Path:
    """Write folder/model.safetensors with the tensors of folder/pytorch_model.bin, which is read without pickle code.

    Raises MotionloomError where the file is missing or is not a plain dictionary of tensors.
    """
    source, target = folder / "pytorch_model.bin", folder / "model.safetensors"
    state = read_torch_file(source)
    if not isinstance(state, dict) or not all(isinstance(value, Tensor) for value in state.values()):
        raise MotionloomError(f"{source} is not a plain dictionary of tensors; fetch the published file again.")
    tensors = {str(name): value.contiguous().numpy() for name, value in state.items()}
    save_tensors(tensors, target, metadata={"format": "pt"})
    return target


def main() -> int:
    parser = argparse.ArgumentParser(prog="python -m motionloom_lab.papers.text_model", description=__doc__)
    parser.add_argument("folder", type=Path)
    try:
        print(convert(parser.parse_args().folder))
    except MotionloomError as error:
        print(error, file=sys.stderr)
        return 2
    return 0


if __name__ == "__main__":
    raise SystemExit(main())
