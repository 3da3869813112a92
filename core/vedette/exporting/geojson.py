"""Tracks as GeoJSON by RFC 7946: a line each, and ellipses that hold the place with 95 %."""

from __future__ import annotations

import json
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from vedette.exporting.run import Run, chosen
from vedette.io.atomic import whole_file
from vedette.space import Array
from vedette.types import Track

_DIGITS = 9
"""Of a degree: a tenth of a millimetre."""


def write_geojson(path: Path, run: Run, ellipses: int) -> None:
    """Write the tracks, each with its times and its ellipses' axes, and of each at most so many ellipses as areas."""
    run.check_placed("GeoJSON")
    features = [feature for track in run.tracks for feature in _features(run, track, ellipses)]
    with whole_file(path) as file:
        file.write('{"type": "FeatureCollection", "features": [\n')
        file.write(",\n".join(json.dumps(feature, allow_nan=False) for feature in features))
        file.write("\n]}\n")


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
            yield {"type": "Feature", "geometry": _line(places[part]), "properties": told}
    for i in chosen(len(places), ellipses).tolist():
        outline = run.ellipse(track, i)
        if outline is not None:
            own = {"track": track.id, "time": times[i], "probability": 0.95}
            area = {"type": "Polygon", "coordinates": [_rounded(outline, _DIGITS)]}
            yield {"type": "Feature", "geometry": area, "properties": own}


def _crossings(places: Array) -> NDArray[np.intp]:
    """Return where a line crosses 180 deg: there it is cut, or it would be drawn around the earth."""
    return np.flatnonzero(np.abs(np.diff(places[:, 0])) > 180.0) + 1


def _line(places: Array) -> dict[str, Any]:
    line = _rounded(places, _DIGITS)
    return {"type": "Point", "coordinates": line[0]} if len(line) == 1 else {"type": "LineString", "coordinates": line}


def _rounded(values: Array, digits: int) -> Any:
    return np.round(values, digits).tolist()
