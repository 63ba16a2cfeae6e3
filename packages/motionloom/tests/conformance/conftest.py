"""No recorded setting is passed over and no recorded output left uncompared."""

from collections.abc import Generator

import pytest

from tests.conformance.runner import Case


@pytest.hookimpl(wrapper=True)
def pytest_pyfunc_call(pyfuncitem: pytest.Function) -> Generator[None, object, object]:
    """After a test that passed: what of its case it left aside."""
    result = yield
    given = pyfuncitem.callspec.params.values() if hasattr(pyfuncitem, "callspec") else ()
    for case in given:
        if isinstance(case, Case):
            assert not case.left(), f"{case.group}/{case.name} passed, but the test looked at no {case.left()}"
    return result
