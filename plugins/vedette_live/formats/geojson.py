"""Tracks as GeoJSON."""

from __future__ import annotations

import json
from typing import ClassVar, final

from attrs import frozen

from vedette.streams import Decoded, Format, TrackReport


@final
@frozen
class GeoJson(Format):
    """A FeatureCollection a report, on one line: a point a track, in longitude and latitude.

    RFC 7946, The GeoJSON Format, 2016.
    """

    kind: ClassVar[str] = "geojson"
    reads: ClassVar[bool] = False
    writes: ClassVar[bool] = True

    def decode(self, memory: bytes, data: bytes) -> Decoded:
        return Decoded(b"", (), ("GeoJSON is written only",) if data.strip() else ())

    def encode(self, report: TrackReport) -> bytes:
        if report.geodetic is None:
            raise ValueError("GeoJSON needs latitudes and longitudes: the config must name an origin")
        latitude, longitude, _ = report.geodetic(report.mean)
        names = [axis.name for axis in report.space.axes]
        columns = (longitude, latitude, report.ids, report.existence, report.confirmed, report.mean)
        features = [
            {
                "type": "Feature",
                "id": i,
                "geometry": {"type": "Point", "coordinates": [round(east, 7), round(north, 7)]},
                "properties": {
                    "time": report.time, "existence": existence, "confirmed": sure, **dict(zip(names, mean, strict=True)),
                },
            }
            for east, north, i, existence, sure, mean in zip(*(column.tolist() for column in columns), strict=True)
        ]  # fmt: skip
        head = {"type": "FeatureCollection", "number": report.number, "time": report.time}
        return json.dumps({**head, "features": features}).encode() + b"\n"
