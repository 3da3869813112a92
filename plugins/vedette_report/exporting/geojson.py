"""Tracks as GeoJSON by RFC 7946: a line each, and ellipses that hold the place with 95 %."""

from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from vedette import Array, Track
from vedette_files import geometry, write_features
from vedette_report.exporting.run import Run, chosen

_DIGITS = 9
"""Of a degree: a tenth of a millimetre."""


def write_geojson(path: Path, run: Run, ellipses: int) -> None:
    """Write the tracks, each with its times and its ellipses' axes, and of each at most so many ellipses as areas."""
    run.check_placed("GeoJSON")
    features = [feature for track in run.tracks for feature in _features(run, track, ellipses)]
    write_features(path, features)


def _features(run: Run, track: Track, ellipses: int) -> Iterator[dict[str, Any]]:
    places, axes = run.places(track), run.axes(track)
    times: list[Any] = run.dates(track) if run.terms.dated else track.times.tolist()
    for part in np.split(np.arange(len(places)), _crossings(places)):
        if len(part):
            told = {
                "track": track.id,
                "times": [times[i] for i in part],
                "existence": _rounded(track.existence[part], 6),
                "ellipse_95": _rounded(axes[part], 3),
                "run": run.title,
            }
            yield {"type": "Feature", "geometry": geometry(_rounded(places[part], _DIGITS)), "properties": told}
    for i in chosen(len(places), ellipses).tolist():
        outline = run.ellipse(track, i)
        if outline is not None:
            properties = {"track": track.id, "time": times[i], "probability": 0.95}
            area = {"type": "Polygon", "coordinates": [_rounded(outline, _DIGITS)]}
            yield {"type": "Feature", "geometry": area, "properties": properties}


def _crossings(places: Array) -> NDArray[np.intp]:
    """Return where a line crosses 180 deg: there it is cut, or it would be drawn around the earth."""
    return np.flatnonzero(np.abs(np.diff(places[:, 0])) > 180.0) + 1


def _rounded(values: Array, digits: int) -> Any:
    return np.round(values, digits).tolist()
