"""How often tracks were detected against what sensors declare, each sensor by itself."""

from __future__ import annotations

from collections.abc import Mapping, Sequence

import numpy as np

from vedette.space import Array
from vedette_report.recorded.used import Innovations

SIGMAS, OFF = 4.0, 0.15
"""Detections tell of P_D if they are off by so many deviations of their number and by such a part: by hand."""


def of_each(told: Sequence[Innovations]) -> dict[str, Array]:
    """Return by sensor how probably its looks detected a track, and were declared to (2, l), of some tracks together."""
    looks = [(one, np.array(one.sensors)) for one in told]
    names = dict.fromkeys(name for one in told for name in one.sensors)
    rows = {name: [np.stack([one.hit, one.declared])[:, own == name] for one, own in looks] for name in names}
    return {name: np.concatenate(parts, axis=1) for name, parts in rows.items()}


def ratio(looks: Array) -> float | None:
    """Return how often looks (2, l) detected over what was declared; None where nothing was."""
    hit, declared = np.sum(looks, axis=1)
    return float(hit / declared) if declared > 0 else None


def otherwise(told: Sequence[Innovations]) -> Mapping[str, float]:
    """Return by sensor how often it detects over what it declares, where that is beyond chance, and enough to count."""
    return {name: times for name, looks in of_each(told).items() if (times := ratio(looks)) is not None and _off(looks)}


def _off(looks: Array) -> bool:
    hit, declared = looks
    off, rate = float(np.sum(hit - declared)), float(np.mean(hit))
    chance = np.sqrt(max(len(hit) * rate * (1.0 - rate), float(np.sum(declared * (1.0 - declared)))))
    return abs(off) > max(SIGMAS * float(chance), OFF * float(np.sum(declared)))


def words(times: float, gated: bool) -> str:
    """Say what it means that tracks are detected so many times as often as stated, behind a gate or without."""
    if times > 1:
        return f"it is detected {times:.2f} times as often as stated: likely P_D is higher"
    told = f"returns are missed, it is detected {times:.2f} times as often as stated"
    return f"{told}: likely P_D is lower" + ", or Q or R so small that the gate shuts them out" * gated


def mixed(told: Sequence[Mapping[str, float]]) -> dict[str, str]:
    """Return by sensor that it detects some tracks more often than stated, and others less, as `otherwise` tells of each."""
    found = {}
    for name in dict.fromkeys(name for one in told for name in one):
        times = [one[name] for one in told if name in one]
        often, seldom = sum(each > 1 for each in times), sum(each < 1 for each in times)
        if min(often, seldom) > 1:
            many = f"{often} tracks up to {max(times):.2g} times as often as stated, {seldom} down to {min(times):.2g} times"
            found[name] = f"detects {many}: do all targets answer it? One P_D fits neither"
    return found
