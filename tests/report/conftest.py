"""A run of a scene of two ships."""

import pytest

from support.results import run
from vedette_report.drawing import canvas


@pytest.fixture(scope="module")
def scene():
    return run()


@pytest.fixture(autouse=True)
def style():
    """All pictures are drawn in Vedette's style, for a screen."""
    with canvas.styled():
        yield
