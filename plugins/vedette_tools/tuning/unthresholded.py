"""The tracker that a likelihood is of: without thresholds, as what is estimated must not depend on what saves time."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

from attrs import evolve

from vedette import Birth, Tracker
from vedette_standard import Existence

GIVEN_UP = 0.01
"""A new track is followed until it is so many times less likely than when it began: a real one is given up as seldom."""

FARTHEST = 40.0
"""Squared distance beyond which returns are left out: along two axes 2e-9 of a target's own lie there."""

LIFETIME = 600.0
"""s: how long targets stay, where a lifecycle does not say it."""

Path = tuple[str | int, ...]


def unthresholded(tracker: Tracker, real: float | None, freed: Sequence[Path]) -> Tracker:
    """Return the tracker whose gate leaves out nothing that counts and whose tracks end when nearly nothing is left of them.

    real: the probability that a new track is of a target, None as the birth has it. Thresholds that are tuned themselves,
    those at the paths `freed`, stay, as do those of `kept_thresholds`.
    """
    stay = {path[0] for path in freed if path[0] == "gate" or (path[0] == "lifecycle" and path[1:] != ("lifetime",))}
    birth, lifecycle, gate = tracker.birth, tracker.lifecycle, tracker.gate
    if real is not None and birth is not None and has_initial(birth) and ("birth", "initial") not in freed:
        birth = evolve(birth, initial=real)  # type: ignore[misc]
    if "gate" not in stay and gate.clutter == "sensor":
        gate = evolve(gate, probability=1.0, largest_distance=FARTHEST)
    if "lifecycle" not in stay and _replaceable(lifecycle):
        lifecycle = _patient(lifecycle, None if birth is None else birth.initial_existence)
    return evolve(tracker, birth=birth, lifecycle=lifecycle, gate=gate)


def has_initial(birth: Birth | None) -> bool:
    """Return whether new tracks have one probability of being of a target, as of `from_returns`: a guess, not a model."""
    return birth is not None and birth.initial_existence is not None and hasattr(birth, "initial")


def kept_thresholds(tracker: Tracker, freed: Sequence[Path]) -> str:
    """Say which thresholds have a part in the likelihood, or return ""."""
    told = [
        f"{'.'.join(map(str, path))} is tuned"
        for path in freed
        if path[0] in ("gate", "lifecycle") and path[1:] != ("lifetime",)
    ]
    if tracker.gate.clutter != "sensor":
        told.append("its gate counts the clutter")
    if not tracker.lifecycle.permanent and not _replaceable(tracker.lifecycle):
        told.append(f"its lifecycle {tracker.lifecycle.kind!r} is none that could be replaced")
    if not told:
        return ""
    return f"the likelihood is that of this tracker with its thresholds, not of the data alone: {', '.join(told)}"


def _replaceable(lifecycle: Any) -> bool:
    """Return whether a lifecycle's tracks end by thresholds that the standard lifecycles have in common."""
    return not lifecycle.permanent and hasattr(lifecycle, "max_out_of_coverage") and hasattr(lifecycle, "survives_in")


def _patient(lifecycle: Any, first: float | None) -> Existence:
    """Return existence as a lifecycle that ends a track when nearly nothing is left of it; `first`: that of new tracks."""
    least = lifecycle.least_existence or 1.0
    return Existence(
        lifetime=getattr(lifecycle, "lifetime", LIFETIME),
        confirm=0.99,
        delete=min(least, GIVEN_UP * (1e-3 if first is None else first)),
        max_out_of_coverage=lifecycle.max_out_of_coverage,
        survives_in=lifecycle.survives_in,
    )
