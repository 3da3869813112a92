"""Tracks as KML 2.2 with Google's extension for moving places, for Google Earth and what reads its files."""

from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path
from xml.sax.saxutils import escape

import numpy as np

from vedette import Array, Track
from vedette_files.writing import whole_file
from vedette_report.drawing import canvas
from vedette_report.exporting.run import Run, chosen

FIELDS = {
    "existence": "existence",
    "long": "95 %: half the long axis [m]",
    "short": "half the short axis [m]",
    "bearing": "of the long axis [deg]",
}
"""What is told of a track at each time."""


def write_kml(path: Path, run: Run, ellipses: int) -> None:
    """Write the tracks with their times, existence and ellipses' axes, and of each at most so many ellipses as areas."""
    run.check_placed("KML")
    with whole_file(path) as file:
        file.writelines(f"{line}\n" for line in _document(run, ellipses))


def _document(run: Run, ellipses: int) -> Iterator[str]:
    clock = "" if run.terms.dated else " Times are not dates: 0 s stands at 1970-01-01T00:00:00Z."
    yield '<?xml version="1.0" encoding="UTF-8"?>'
    yield '<kml xmlns="http://www.opengis.net/kml/2.2" xmlns:gx="http://www.google.com/kml/ext/2.2">'
    yield f"<Document><name>{escape(run.title)}</name>"
    about = f"{len(run.tracks)} tracks by Vedette, with ellipses that hold the place with 95 %.{clock}"
    yield f"<description>{about}</description>"
    for i, colour in enumerate(canvas.TRACKS):
        shade = "".join(reversed([colour[k : k + 2] for k in (1, 3, 5)]))
        yield f'<Style id="colour{i}"><IconStyle><color>ff{shade}</color></IconStyle>'
        yield f"<LineStyle><color>ff{shade}</color><width>2</width></LineStyle>"
        yield f"<PolyStyle><color>40{shade}</color></PolyStyle></Style>"
    yield '<Schema id="estimate">'
    for name, about in FIELDS.items():
        shown = f"<displayName>{escape(about)}</displayName>"
        yield f'<gx:SimpleArrayField name="{name}" type="float">{shown}</gx:SimpleArrayField>'
    yield "</Schema>"
    for i, track in enumerate(run.tracks):
        yield from _track(run, track, f"#colour{i % len(canvas.TRACKS)}", ellipses)
    yield "</Document></kml>"


def _track(run: Run, track: Track, style: str, ellipses: int) -> Iterator[str]:
    places, dates = run.places(track), run.dates(track)
    height = "absolute" if places.shape[1] == 3 else "clampToGround"
    yield f"<Folder><name>track {track.id}</name>"
    yield f"<Placemark><name>{track.id}</name><styleUrl>{style}</styleUrl>"
    yield f"<gx:Track><altitudeMode>{height}</altitudeMode>"
    yield from (f"<when>{date}</when>" for date in dates)
    yield from (f"<gx:coord>{_numbers(place, ' ')}</gx:coord>" for place in _with_height(places))
    yield '<ExtendedData><SchemaData schemaUrl="#estimate">'
    columns = [track.existence, *run.axes(track).T]
    for name, column in zip(FIELDS, columns, strict=True):
        values = "".join(f"<gx:value>{value:.6g}</gx:value>" for value in column.tolist())
        yield f'<gx:SimpleArrayData name="{name}">{values}</gx:SimpleArrayData>'
    yield "</SchemaData></ExtendedData></gx:Track></Placemark>"
    shown = chosen(len(dates), ellipses).tolist()
    for i, until in zip(shown, [*shown[1:], None], strict=True):
        outline = run.ellipse(track, i)
        if outline is not None:
            end = "" if until is None or dates[until] == dates[i] else f"<end>{dates[until]}</end>"
            yield f"<Placemark><name>95 % of {track.id}</name><TimeSpan><begin>{dates[i]}</begin>{end}</TimeSpan>"
            ring = " ".join(_numbers(point, ",") for point in outline)
            yield f"<styleUrl>{style}</styleUrl><Polygon><outerBoundaryIs><LinearRing><coordinates>{ring}</coordinates>"
            yield "</LinearRing></outerBoundaryIs></Polygon></Placemark>"
    yield "</Folder>"


def _with_height(places: Array) -> Array:
    return places if places.shape[1] == 3 else np.column_stack([places, np.zeros(len(places))])


def _numbers(values: Array, between: str) -> str:
    return between.join(f"{value:.9f}".rstrip("0").rstrip(".") for value in values.tolist())
