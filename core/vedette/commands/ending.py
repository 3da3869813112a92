"""How a command ends: its exit codes, and how it says what is wrong."""

from __future__ import annotations

import sys

DONE, FAILED, WRONG, INTERRUPTED, CLOSED = 0, 1, 2, 130, 141
"""Done; a law was broken; wrong use, config or input; interrupted; the reader went away."""


def complain(text: str) -> int:
    """Tell what is wrong, each line by itself, and return the exit code that says so."""
    for line in text.splitlines() or ["unknown error"]:
        print(f"vedette: error: {line}", file=sys.stderr)
    return WRONG
