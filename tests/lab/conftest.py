"""What holds for every test of the laboratory."""

from tests.train.conftest import _no_product_is_timed

__all__ = ["_no_product_is_timed"]
