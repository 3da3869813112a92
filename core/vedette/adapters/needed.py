"""The libraries that bridges lead to."""

from __future__ import annotations

import importlib
from typing import Any

from vedette.errors import InputError


def needed(module: str) -> Any:
    """Return a module of another library; InputError, with how to install it, if it is not there."""
    try:
        return importlib.import_module(module)
    except ImportError:
        name = module.partition(".")[0]
        raise InputError(f"this needs {name}: pip install 'vedette[adapters]'") from None
