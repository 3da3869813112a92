"""The libraries that bridges lead to."""

from __future__ import annotations

import importlib
from typing import Any

from attrs import NOTHING, field

from vedette.errors import InputError


def needed(module: str) -> Any:
    """Return a module of another library; InputError, with how to install it, if it is not there."""
    try:
        return importlib.import_module(module)
    except ImportError:
        name = module.partition(".")[0]
        raise InputError(f"this needs {name}: pip install 'vedette[adapters]'") from None


def foreign(doc: str, *, default: Any = NOTHING) -> Any:
    """Declare a parameter that is another library's object, which a file cannot state."""

    def given(_: Any, attribute: Any, value: Any) -> None:
        if isinstance(value, int | float | dict):
            raise ValueError(f"{attribute.name}: must be {doc}, made in Python, got {value!r}")

    return field(default=default, metadata={"unit": "", "doc": doc}, validator=given)
