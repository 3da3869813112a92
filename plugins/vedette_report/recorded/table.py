"""What the tracks of a recording say of covariances, as lines of text."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from vedette.metrics import chi_square_band
from vedette.space import Array
from vedette_report.columns import aligned
from vedette_report.recorded import detected
from vedette_report.recorded.tracks import Recorded
from vedette_report.recorded.used import Innovations

TITLES = ("object", "track", "scans", "ANEES", "NIS", "correlation", "detected", "noncr. [dB]", "incl. [dB]", "lost at")
HEAD = "ANEES, NIS and detections over what is stated: 1 is right; correlation of innovations and inclination: 0"
UNEVEN = 2.0
"""Axes are not wrong alike where they differ so: by hand."""


def table(told: Sequence[Recorded]) -> list[str]:
    """Return the lines of a table, a row for each track."""
    return [HEAD, *aligned([TITLES, *(one.row for one in told)])]


def sentences(told: Sequence[Recorded]) -> list[str]:
    """Return what innovations say of detections, Q and R, a line each."""
    every = detected.otherwise([one.innovations for one in told]) if len(told) > 1 else {}
    gated = any(one.innovations.gated for one in told)
    lines = [f"{name}, over all tracks: {detected.words(times, gated)}" for name, times in every.items()]
    mixed = detected.mixed([one.detections for one in told])
    lines += [f"{name}: {said}" for name, said in mixed.items()]
    lines += dict.fromkeys(one.hint for one in told if one.hint and one.hint == one.goes_on)
    hinted = [one for one in told if one.hint not in ("", one.goes_on) and not one.as_all(every, mixed)]
    lines += [f"{one.truth or 'track'} ({one.track}): {one.hint}" for one in hinted]
    return lines + _uneven([one.innovations for one in told])


def _uneven(told: Sequence[Innovations]) -> list[str]:
    """Return a line if squared innovations are not alike, over what is stated, along all axes of all sensors."""
    sizes: dict[tuple[str, str], Array] = {}
    for one in told:
        for key, size in one.sizes.items():
            sizes[key] = sizes.get(key, np.zeros(2)) + size
    ratios = {key: float(total / count) for key, (total, count) in sizes.items() if count}
    bands = {key: chi_square_band(float(sizes[key][1]), 1e-3) for key in ratios}
    right = all(low < ratios[key] < high for key, (low, high) in bands.items())
    if right or max(ratios.values()) <= UNEVEN * min(ratios.values()):
        return []
    listed = ", ".join(f"{sensor} {axis} {ratio:.2g}" for (sensor, axis), ratio in ratios.items())
    said = f"squared innovations over what is stated are not off alike: {listed}"
    return [f"{said}: likely R of one of them, or Q, which shows most where R is small"]
