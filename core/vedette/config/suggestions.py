"""What an unknown name was probably meant to be."""

from __future__ import annotations

from collections.abc import Iterable

SHORT = {
    "kf": "kalman",
    "srif": "srkf",
    "pf": "bootstrap_particles",
    "gsf": "gaussian_sum",
    "squareroot": "srkf",
    "information": "kalman",
    "mmae": "imm",
    "enkf": "ensemble_kalman",
    "hinf": "h_infinity",
    "ghk": "g_h",
    "alphabeta": "g_h",
    "alphabetagamma": "g_h",
    "rls": "least_squares",
    "mht": "n_scan",
    "tomht": "n_scan",
    "pmbm": "k_best",
    "ipda": "existence",
    "nn": "nearest",
    "gnnf": "gnn",
    "mofn": "m_of_n",
    "sprt": "score",
    "ncv": "constant_velocity",
    "nca": "constant_acceleration",
    "dwna": "constant_velocity_piecewise",
    "radar": "range_bearing",
    "position": "cartesian_position",
}
"""What the field calls some kinds in short, where the letters of the kind do not say it."""


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


def which_kind(given: str, kinds: Iterable[str]) -> str:
    """Return the question after an unknown kind, which may be the field's short name of one: `cv`, `KF`, `PDAF`."""
    kinds = list(kinds)
    short = folded(given).replace("_", "")
    initials = {"".join(word[0] for word in kind.split("_")): kind for kind in reversed(kinds) if "_" in kind}
    for name in (short, short.removesuffix("f")):
        meant = name if name in kinds else SHORT.get(name, initials.get(name))
        if meant in kinds and len(name) > 1:
            return f" did you mean {meant!r}?"
    return did_you_mean(given, kinds)
