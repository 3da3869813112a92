"""What is installed."""

import pytest

from vedette import Registry


@pytest.fixture(scope="module")
def registry() -> Registry:
    return Registry.installed()
