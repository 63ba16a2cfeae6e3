"""What tests of commands share."""

from tests.cli.conftest import weights

__all__ = ["weights"]
