"""Networks as sessions of ONNX Runtime: arrays in, arrays out. Nothing here imports torch."""

from motionloom.core.models.networks.session import set_threads

__all__ = ["set_threads"]
