"""What holds for every test of the laboratory."""

from tests_train.conftest import _no_product_is_timed

__all__ = ["_no_product_is_timed"]
