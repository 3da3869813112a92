"""A scan as a line of Vedette's own format."""

from __future__ import annotations

import math
from collections.abc import Collection, Iterable, Mapping
from pathlib import Path
from typing import Any

import numpy as np

from vedette import Array, Detections, Mask, Pose, Scan, Space
from vedette_files.codes import code, label
from vedette_files.input_files import shown
from vedette_files.json_values import number, short, vector
from vedette_files.jsonl.frames import read_frame

SCAN_FIELDS = ("time", "sensor", "z", "noise", "evidence", "pose", "frame", "identity", "times", "arrived")

POSE_FIELDS = ("position", "velocity", "heading")


def scan_fields(scan: Scan, sensors: Mapping[str, Space]) -> dict[str, Any]:
    seen, pose = scan.detections, scan.pose
    if scan.sensor not in sensors or seen.z.ndim != 2 or seen.z.shape[1] != len(sensors[scan.sensor]):
        raise ValueError(f"scan of {scan.sensor!r} at {scan.time} s: z {seen.z.shape} is not (returns, axes) of {sensors}")
    fields = {"time": float(scan.time), "sensor": scan.sensor, "z": _numbers(seen.z, seen.missing, seen.valid)}
    if seen.noise is not None:
        either = None if seen.missing is None else seen.missing[:, :, None] | seen.missing[:, None, :]
        fields["noise"] = _numbers(seen.noise, either, seen.valid)
    if seen.evidence is not None:
        fields["evidence"] = seen.evidence[seen.valid].tolist()
    if seen.identity is not None:
        fields["identity"] = [identity_value(one) for one in seen.identity[seen.valid].tolist()]
    if seen.time is not None:
        fields["times"] = seen.time[seen.valid].tolist()
    if pose is not None:
        velocity = {} if pose.velocity is None else {"velocity": pose.velocity.tolist()}
        fields["pose"] = {"position": pose.position.tolist(), **velocity, "heading": float(pose.heading)}
    return fields


def _numbers(values: Array, missing: Mask | None, valid: Mask) -> list[Any]:
    """Return the numbers of the returns that are `valid`, null for those that are missing."""
    if missing is None:
        return values[valid].tolist()
    told = values.astype(object)
    told[missing] = None
    return told[valid].tolist()


def check_fields(given: Mapping[str, Any], known: tuple[str, ...], what: str = "") -> None:
    for name in given:
        if name not in known:
            raise ValueError(f"unknown field {what}{shown(name)}; known are {', '.join(known)}")


def one_of(known: Iterable[str]) -> str:
    return f"one of the header's, {names}" if (names := ", ".join(map(repr, known))) else "in the header, which lists none"


def scan_of(
    given: Any, sensors: Mapping[str, Space], folder: Path, optional: Mapping[str, Collection[str]]
) -> tuple[Scan | None, list[str]]:
    """Return a scan without its bad returns, and what is wrong with them; None if no return is good, as it was not empty.

    optional: the axes that returns of a sensor may lack; of one that it does not name, any.
    """
    if not isinstance(given, dict):
        raise ValueError(f"must be an object, got {short(given)}")
    check_fields(given, SCAN_FIELDS)
    name = given.get("sensor")
    if not isinstance(name, str) or name not in sensors:
        raise ValueError(f"sensor must be {one_of(sensors)}, got {short(name)}")
    names = sensors[name].names
    m, may = len(names), optional.get(name, names)
    time, pose = number(given.get("time"), "time"), _pose(given.get("pose"))
    if "arrived" in given:
        number(given["arrived"], "arrived")
    frame = read_frame(given["frame"], folder) if "frame" in given else None
    columns = {part: given[part] for part in ("z", "noise", "evidence", "identity", "times") if part in given}
    k = len(columns["z"]) if isinstance(columns.get("z"), list) else -1
    for part, values in {"z": None, **columns}.items():
        if not isinstance(values, list) or len(values) != k:
            raise ValueError(f"{part} must be a list with one entry a return, got {short(values)}")
    good, problems = [], []
    for i in range(k):
        try:
            lacking = _lacking(columns["z"][i], f"z[{i}]", names, may)
            z = _vector(columns["z"][i], f"z[{i}]", m, lacking)
            noise = _matrix(columns["noise"][i], f"noise[{i}]", m, lacking) if "noise" in columns else []
            evidence = number(columns["evidence"][i], f"evidence[{i}]") if "evidence" in columns else 0.0
            code = identity_code(columns["identity"][i]) if "identity" in columns else -1
            own_time = number(columns["times"][i], f"times[{i}]") if "times" in columns else time
            if own_time > time:
                raise ValueError(f"times[{i}] must be until the scan's time, {time!r} s, got {own_time!r}")
            good.append((z, noise, evidence, code, own_time))
        except ValueError as error:
            problems.append(str(error))
    if k and not good:
        return None, problems
    returns = np.array([z for z, *_ in good]).reshape(-1, m)
    missing = np.isnan(returns)
    detections = Detections(
        returns,
        np.ones(len(good), dtype=bool),
        np.array([evidence for _, _, evidence, *_ in good]) if "evidence" in columns else None,
        np.array([noise for _, noise, *_ in good]).reshape(-1, m, m) if "noise" in columns else None,
        missing if missing.any() else None,
        identity=np.array([code for *_, code, _ in good], dtype=np.int64) if "identity" in columns else None,
        time=np.array([own_time for *_, own_time in good]) if "times" in columns else None,
    )
    return Scan(time, name, detections, pose, frame), problems


def identity_value(number: int) -> int | str | None:
    """Return what a line says of a code: the number or the name that it stands for, null of none."""
    name = label(number)
    return number if name == str(number) else name or None


def identity_code(value: Any) -> int:
    """Return the code of what a line says; ValueError if that is no name."""
    if value is None:
        return -1
    if isinstance(value, str) or (type(value) is int and value >= 0):
        return code(str(value))
    raise ValueError(f"identity must be a name, a whole number or null, got {short(value)}")


def _lacking(value: Any, what: str, names: tuple[str, ...], may: Collection[str]) -> list[int]:
    """Return which components of a return are null; ValueError if one is that none `may` lack, and if all are."""
    if not isinstance(value, list) or len(value) != len(names) or None not in value:
        return []
    lacking = [i for i, one in enumerate(value) if one is None]
    if always := [names[i] for i in lacking if names[i] not in may]:
        told = f"{what} is null, but the sensor always reports {', '.join(always)}"
        raise ValueError(f"{told}; 'partial' around it takes returns without")
    if len(lacking) == len(names):
        raise ValueError(f"{what} must have at least one number, got {short(value)}")
    return lacking


def _vector(value: Any, what: str, m: int, lacking: Collection[int]) -> list[float]:
    """Return a list of m numbers, NaN for null where one is lacking."""
    if not lacking or not isinstance(value, list) or len(value) != m:
        return vector(value, what, m)
    given = zip(value, range(m), strict=True)
    return [math.nan if one is None and i in lacking else number(one, f"{what}[{i}]") for one, i in given]


def _matrix(value: Any, what: str, m: int, lacking: Collection[int]) -> list[list[float]]:
    if not isinstance(value, list) or len(value) != m:
        raise ValueError(f"{what} must be a list of {m} rows, got {short(value)}")
    every = range(m)
    return [_vector(row, f"{what}[{i}]", m, every if i in lacking else lacking) for i, row in enumerate(value)]


def _pose(given: Any) -> Pose | None:
    if given is None:
        return None
    if not isinstance(given, dict):
        raise ValueError(f"pose must be an object with {', '.join(POSE_FIELDS)}, got {short(given)}")
    check_fields(given, POSE_FIELDS, "pose.")
    position = vector(given.get("position"), "pose.position")
    if len(position) not in (2, 3):
        raise ValueError(f"pose.position must be a list of 2 or 3 numbers, got {short(position)}")
    moving = given.get("velocity") is not None
    velocity = np.array(vector(given["velocity"], "pose.velocity", len(position))) if moving else None
    return Pose(np.array(position), velocity, number(given.get("heading", 0.0), "pose.heading"))
