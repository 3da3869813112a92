"""Libraries that only some installations have."""

from __future__ import annotations

from importlib import import_module
from typing import Any

from vedette.errors import InputError


def needed(module: str, told: str, extra: str) -> Any:
    """Return a module of an optional library; InputError if it is not there.

    Parameters
    ----------
    module : str
        The module's dotted name.
    told : str
        What needs the library, as in "AIS sentences need pyais".
    extra : str
        The extra of `vedette` that installs it.
    """
    try:
        return import_module(module)
    except ImportError:
        raise InputError(f"{told}: pip install 'vedette[{extra}]'") from None
