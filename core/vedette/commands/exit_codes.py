"""How a command ends: its exit codes, and how it reports problems."""

from __future__ import annotations

import sys

DONE, FAILED, WRONG, UNFIT, UNTRIED, INTERRUPTED, CLOSED = 0, 1, 2, 3, 4, 130, 141
"""Done; a law failed; wrong use, config or input; nothing fits the data; no law applied; interrupted; the reader closed the
pipe.
"""


def complain(text: str) -> int:
    """Print what is wrong, each line by itself, and return the exit code for it."""
    from vedette.display import without_passwords  # which imports numpy: what is interrupted meanwhile is told in a line

    for line in without_passwords(text).splitlines() or ["unknown error"]:
        print(f"vedette: error: {line}", file=sys.stderr)
    return WRONG


def ended(error: BaseException, text: str, *, traceback: bool) -> int:
    """Say what ended a command, after the traceback if that is asked for, and return the exit code for it."""
    if traceback:
        from traceback import print_exception

        print_exception(error)
    return complain(text)
