"""Limits on what is read, and the factor by which a user raises them all."""

from __future__ import annotations

import math
import os

from vedette.errors import ConfigError

DEEPEST = 32
"""Lists and objects inside each other; a scan with covariances takes four."""

FACTOR = "VEDETTE_LIMITS"
"""Names the environment variable by which all these limits are multiplied; the option `--limits` sets it."""


def most(usual: int) -> int:
    """Return a limit, raised by the factor that the user gave; ConfigError if that is none."""
    given = os.environ.get(FACTOR, "1")
    try:
        factor = float(given)
    except ValueError:
        factor = math.nan
    if not 1 <= factor <= 1e6:
        raise ConfigError.at("--limits", f"must be a number from 1 to 1e6, got {given[:40]!r}")
    return int(usual * factor)
