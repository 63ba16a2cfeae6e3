"""No recorded setting is passed over and no recorded output left uncompared."""

from tests.conformance.conftest import pytest_pyfunc_call

__all__ = ["pytest_pyfunc_call"]
