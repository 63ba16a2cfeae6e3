"""Networks as sessions of ONNX Runtime: arrays in, arrays out. Nothing here imports torch."""

from motionloom.runtime.session import set_threads

__all__ = ["set_threads"]
