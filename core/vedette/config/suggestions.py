"""What an unknown name was probably meant to be."""

from __future__ import annotations

from collections.abc import Iterable


def nearest(given: str, known: Iterable[str]) -> str | None:
    """Return the known name that `given` was probably meant to be, or None."""
    from difflib import get_close_matches

    known = list(known)
    near = get_close_matches(given, known, n=1) or [name for name in known if name.startswith(f"{given}_")]
    return next(iter(near), None)


def did_you_mean(given: str, known: Iterable[str]) -> str:
    """Return the question after an unknown name, preceded by a space; "" if no known name is similar."""
    near = nearest(given, known)
    return f" did you mean {near!r}?" if near else ""
