"""A run of a scene of two ships."""

import pytest

from support.results import run


@pytest.fixture(scope="module")
def scene():
    return run()
