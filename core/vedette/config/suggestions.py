"""What an unknown name was probably meant to be."""

from __future__ import annotations

from collections.abc import Iterable

from vedette.config.contract import Installed


def folded(name: str) -> str:
    """Return a name in small letters, with underscores between words."""
    return name.strip().lower().replace("-", "_").replace(" ", "_")


def nearest(given: str, known: Iterable[str]) -> str | None:
    """Return the known name that `given` was probably meant to be, or None."""
    from difflib import get_close_matches

    by_fold = {folded(name): name for name in known}
    given = folded(given)
    if given in by_fold:
        return by_fold[given]
    near = get_close_matches(given, by_fold, n=1) or [name for name in by_fold if name.startswith(f"{given}_")]
    return by_fold[near[0]] if near else None


def did_you_mean(given: str, known: Iterable[str]) -> str:
    """Return the question after an unknown name, preceded by a space; "" if no known name is similar."""
    near = nearest(given, known)
    return f" did you mean {near!r}?" if near else ""


def which_kind(given: str, entries: Iterable[Installed]) -> str:
    """Return the question after an unknown kind, which may be the field's short name of one: `cv`, `KF`, `PDAF`."""
    abbreviations: dict[str, str] = {}
    kinds = []
    for entry in entries:
        kinds.append(entry.kind)
        if "_" in entry.kind:
            abbreviations.setdefault("".join(word[0] for word in entry.kind.split("_")), entry.kind)
        abbreviations |= dict.fromkeys(entry.cls.abbreviations, entry.kind)
    short = folded(given).replace("_", "")
    for name in (short, short.removesuffix("f")):
        meant = name if name in kinds else abbreviations.get(name)
        if meant is not None and len(name) > 1:
            return f" did you mean {meant!r}?"
    return did_you_mean(given, kinds)
