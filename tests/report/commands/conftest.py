"""The scene and the third party that tests of commands share."""

import pytest

from support.command_line import acme, config, undrawn

__all__ = ["acme", "config", "undrawn"]


@pytest.fixture(autouse=True)
def style():
    """Draw in whatever style the command asks for."""
