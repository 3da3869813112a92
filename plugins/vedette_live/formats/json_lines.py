"""Scans and tracks as JSON, one a line."""

from __future__ import annotations

import json
import math
from typing import Any, ClassVar, final

import numpy as np
from attrs import frozen

from vedette.space import Array, Indices
from vedette.streams import Decoded, Format, Message, TrackReport
from vedette.types import Pose
from vedette_files import FRAMES, identity_code
from vedette_files.json_values import number, parse, short, vector
from vedette_live.formats.text import Rest, decoded, ended

FIELDS = ("time", "sensor", "z", "axes", "times", "evidence", "noise", "identity", "pose", "marker", "angle", "n", "frame")
POSE = ("position", "velocity", "heading")
MARKERS = ("north", "sector")


@final
@frozen
class JsonLines(Format):
    """A scan a line: `{"time": 12.5, "sensor": "north", "z": [[310.0, 0.52]], "n": 7}`, all but `z` optional.

    null in z is a missing component; `axes` names its columns where they are not the sensor's; `times` tells when each of
    its returns was measured; `n` is answered by `{"ack": n}` over a connection once it is kept; a line with
    `"marker": "north"` tells of the antenna. Tracks are written a report a line.
    RFC 8259, The JavaScript Object Notation (JSON) Data Interchange Format, 2017.
    """

    kind: ClassVar[str] = "json_lines"
    writes: ClassVar[bool] = True

    def sample(self) -> bytes:
        return (
            b'{"time": 1.5, "sensor": "a", "z": [[1, 2.5], [3, -4]], "identity": ["257000123", ""]}\n{"z": [], "n": 3}\n'
            b'{"time": 2.0, "z": [[5, 6]], "axes": ["x", "y"], "noise": [[[1, 0], [0, 1]]], "pose": {"position": [0, 1]}}\n'
            b'{"marker": "north", "time": 3.0, "angle": 0.5}\n'
        )

    def start(self) -> Rest:
        return Rest()

    def decode(self, memory: Rest, data: bytes) -> Decoded:
        return decoded(memory, data, _read)

    def end(self, memory: Rest) -> Decoded:
        return ended(memory, _read)

    def encode(self, report: TrackReport) -> bytes:
        names = [axis.name for axis in report.space.axes]
        deviations = np.sqrt(np.diagonal(report.cov, axis1=-2, axis2=-1))
        columns = (report.ids, report.existence, report.confirmed, report.mean, deviations)
        tracks = [
            {
                "id": i,
                "existence": existence,
                "confirmed": confirmed,
                **dict(zip(names, mean, strict=True)),
                "sigma": dict(zip(names, sigma, strict=True)),
            }
            for i, existence, confirmed, mean, sigma in zip(*(column.tolist() for column in columns), strict=True)
        ]
        if report.geodetic is not None:
            latitude, longitude, _ = report.geodetic(report.mean)
            for track, north, east in zip(tracks, latitude.tolist(), longitude.tolist(), strict=True):
                track |= {"latitude": north, "longitude": east}
        return json.dumps({"number": report.number, "time": report.time, "tracks": tracks}).encode() + b"\n"


def _read(line: bytes) -> Message | None:
    """Return a line's message; None for an empty one."""
    return _message(line) if line.strip() else None


def _message(line: bytes) -> Message:
    try:
        text = line.decode()
    except UnicodeDecodeError:
        raise ValueError("is not UTF-8") from None
    given = parse(text)
    if not isinstance(given, dict):
        raise ValueError(f"must be an object, got {short(given)}")
    sensor, count = given.get("sensor", ""), given.get("n")
    if not isinstance(sensor, str):
        raise ValueError(f"sensor must be a name, got {short(sensor)}")
    if count is not None and (isinstance(count, bool) or not isinstance(count, int) or not 0 <= count < 2**63):
        raise ValueError(f"n must be a whole number from 0, got {short(count)}")
    try:
        lists = {name: _with_gaps(given[name]) for name in ("z", "noise") if given.get(name) is not None and "null" in text}
        return _told({**given, **lists}, sensor, count, plain="true" not in text and "false" not in text)
    except ValueError as error:
        if count is None:
            raise
        return Message(sensor, None, np.zeros((0, 0)), number=count, refused=str(error))


def _told(given: dict[str, Any], sensor: str, count: int | None, *, plain: bool) -> Message:
    for name in given:
        if name not in FIELDS:
            raise ValueError(f"unknown field {short(name)}; known are {', '.join(FIELDS)}")
    marker = given.get("marker", "")
    if marker and marker not in MARKERS:
        raise ValueError(f"marker must be one of {', '.join(MARKERS)}, got {short(marker)}")
    if "z" not in given and not marker:
        raise ValueError("z is missing: the returns, [] where there is none")
    z = _numbers(given.get("z", []), "z", 2, plain=plain)
    return Message(
        sensor,
        None if given.get("time") is None else number(given["time"], "time"),
        z,
        _axes(given.get("axes"), z),
        _by_return(given, "times", z, 1, plain=plain),
        _by_return(given, "evidence", z, 1, plain=plain),
        _by_return(given, "noise", z, 3, plain=plain),
        _identity(given.get("identity"), z),
        _pose(given.get("pose")),
        marker,
        None if given.get("angle") is None else number(given["angle"], "angle"),
        number=count,
        frame=_frame(given.get("frame")),
    )


def _frame(given: Any) -> str:
    if given is not None and given not in FRAMES:
        raise ValueError(f"frame must be one of {', '.join(map(repr, FRAMES))}, got {short(given)}")
    return given or ""


def _with_gaps(given: Any) -> Any:
    """Return nested lists with NaN for each null."""
    if isinstance(given, list):
        return [_with_gaps(one) for one in given]
    return math.nan if given is None else given


def _numbers(given: Any, what: str, ndim: int, *, plain: bool) -> Array:
    """Return nested lists of numbers as an array; `plain`: there is no boolean among them."""
    try:
        if not isinstance(given, list):
            raise ValueError
        values = np.array(given)
        if given and (values.dtype.kind not in "if" or values.ndim != ndim):
            raise ValueError
        if not plain and any(isinstance(value, bool) for value in np.array(given, dtype=object).ravel().tolist()):
            raise ValueError
    except (ValueError, OverflowError):
        shape = ("a list of numbers", "a list of returns, each a list of numbers", "a list of matrices")[ndim - 1]
        raise ValueError(f"{what} must be {shape}, got {short(given)}") from None
    return values.astype(float) if given else np.zeros((0,) * ndim)


def _by_return(given: dict[str, Any], what: str, z: Array, ndim: int, *, plain: bool) -> Array | None:
    if given.get(what) is None:
        return None
    values = _numbers(given[what], what, ndim, plain=plain)
    if len(values) != len(z):
        raise ValueError(f"{what} must have an entry for each of {len(z)} returns, got {len(values)}")
    return values


def _identity(given: Any, z: Array) -> Indices | None:
    """Return the codes of the names that returns bear."""
    if given is None:
        return None
    if not isinstance(given, list) or len(given) != len(z):
        raise ValueError(f"identity must be a name for each of {len(z)} returns, '' for none, got {short(given)}")
    return np.array([identity_code(name) for name in given], dtype=np.int64)


def _axes(given: Any, z: Array) -> tuple[str, ...] | None:
    if given is None:
        return None
    if not isinstance(given, list) or not all(isinstance(name, str) for name in given) or len(set(given)) != len(given):
        raise ValueError(f"axes must be names, each once, got {short(given)}")
    if len(z) and len(given) != z.shape[1]:
        raise ValueError(f"axes must name the {z.shape[1]} columns of z, got {short(given)}")
    return tuple(given)


def _pose(given: Any) -> Pose | None:
    if given is None:
        return None
    if not isinstance(given, dict) or not set(given) <= set(POSE):
        raise ValueError(f"pose must be an object of {', '.join(POSE)}, got {short(given)}")
    position = np.array(vector(given.get("position"), "pose.position"))
    velocity = None if given.get("velocity") is None else np.array(vector(given["velocity"], "pose.velocity"))
    if len(position) not in (2, 3) or (velocity is not None and len(velocity) != len(position)):
        raise ValueError(f"pose must hold 2 or 3 coordinates of each, got {short(given)}")
    return Pose(position, velocity, number(given.get("heading", 0.0), "pose.heading"))
