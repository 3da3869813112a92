"""Where a scan enters the tracker: the only check of data, so that nothing behind it needs one."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

import numpy as np
from attrs import evolve

from vedette import kernels
from vedette.errors import Problem, ScanRefused
from vedette.fields import ABSURD
from vedette.filters.gaussian import among_present
from vedette.roles import ImagingSensor, Sensor
from vedette.space import Array, Mask
from vedette.tracking.gate import Reach
from vedette.types import Detections, Frame, Pose, Scan


def flaws(scan: Scan, sensors: Mapping[str, Sensor], since: float) -> list[Problem]:
    """What is wrong with a scan for a tracker at time `since` in s; nothing if it can be taken."""
    if scan.sensor not in sensors:
        return [Problem("sensor", f"must be one of {', '.join(map(repr, sensors))}, got {scan.sensor!r}")]
    found = []
    if not abs(scan.time) <= ABSURD:
        found.append(Problem("time", f"must be a finite number of s, got {scan.time}"))
    elif scan.time < since:
        found.append(
            Problem("time", f"must not go back: {scan.time:.6f} s is {since - scan.time:.6g} s before the last scan")
        )
    if scan.pose is not None:
        found += _pose_flaws(scan.pose)
    sensor = sensors[scan.sensor]
    if isinstance(sensor, ImagingSensor) != (scan.frame is not None):
        text = "must bring a frame, as it is a camera's" if scan.frame is None else f"{scan.sensor!r} is no camera"
        return [*found, Problem("frame", text)]
    if scan.frame is not None:
        return found + _frame_flaws(scan.frame)
    return found + _return_flaws(scan.detections, sensor)


def admitted(scan: Scan, reaches: Mapping[str, Reach], since: float) -> Detections | Frame:
    """What a scan shows, if a tracker at time `since` in s can take it; else ScanRefused, which says all that is wrong.

    What padding and missing components hold is made 0, so that nothing of it can reach a sum, not even as 0 * nan.
    """
    seen, reach = scan.detections, reaches.get(scan.sensor)
    if (  # the commonest kind of scan, without a flaw
        reach is not None
        and since <= scan.time <= ABSURD
        and scan.frame is None
        and scan.pose is None
        and seen.evidence is None
        and seen.noise is None
        and seen.missing is None
        and since > -ABSURD
        and reach.axes
        and kernels.is_plain(seen.z, seen.valid, reach.axes, ABSURD)
    ):
        return seen
    if problems := flaws(scan, {name: reach.sensor for name, reach in reaches.items()}, since):
        raise ScanRefused("; ".join(map(str, problems)))
    if scan.frame is not None:
        return scan.frame
    unread = ~seen.valid[..., None]
    if seen.missing is not None:
        unread = unread | seen.missing
    return evolve(seen, z=np.where(unread, 0.0, seen.z)) if unread.any() else seen


def without_bad_returns(scan: Scan) -> tuple[Scan, list[Problem]]:
    """The scan without returns that are not finite or whose noise is no covariance, and what was wrong with them."""
    seen = scan.detections
    if seen.valid.shape != seen.z.shape[:-1]:
        return scan, []
    bad = ~_good(seen)
    if not bad.any():
        return scan, []
    problems = [Problem(f"return {i}", _complaint(seen, i)) for i in np.flatnonzero(bad)]
    kept = Detections(
        seen.z[~bad],
        seen.valid[~bad],
        None if seen.evidence is None else seen.evidence[~bad],
        None if seen.noise is None else seen.noise[~bad],
        None if seen.missing is None else seen.missing[~bad],
    )
    return evolve(scan, detections=kept), problems


def _pose_flaws(pose: Pose) -> list[Problem]:
    parts = {"position": pose.position, "velocity": pose.velocity, "heading": pose.heading}
    return [
        Problem(f"pose.{name}", f"must be finite numbers, got {np.asarray(value).tolist()}")
        for name, value in parts.items()
        if value is not None and not np.all(np.abs(value) <= ABSURD)
    ]


def _frame_flaws(frame: Frame) -> list[Problem]:
    """A frame may have NaN pixels, which say nothing, but no infinite ones."""
    pixels, corner = frame.pixels, frame.corner
    if pixels.ndim < 2 or 0 in pixels.shape[-2:]:
        return [Problem("frame", f"pixels must have shape (..., height, width), got {pixels.shape}")]
    if pixels.dtype.kind == "f" and np.any(np.abs(pixels) > ABSURD):
        return [Problem("frame", f"pixels must be at most {ABSURD:g} in size, or NaN where they say nothing")]
    if corner is not None and (corner.shape[-1:] != (2,) or not np.all(np.abs(corner) <= ABSURD)):
        return [Problem("frame", f"corner must be finite with shape (..., 2), got {np.asarray(corner).tolist()}")]
    return []


def _return_flaws(seen: Detections, sensor: Sensor) -> list[Problem]:
    m = len(sensor.measurement)
    if seen.z.ndim < 2 or seen.z.shape[-1] != m:
        return [Problem("z", f"must have shape (..., returns, {m}), got {seen.z.shape}")]
    for name, part, shape in (
        ("valid", seen.valid, seen.z.shape[:-1]),
        ("evidence", seen.evidence, seen.z.shape[:-1]),
        ("noise", seen.noise, (*seen.z.shape, m)),
        ("missing", seen.missing, seen.z.shape),
    ):
        if part is not None and part.shape != shape:
            return [Problem(name, f"must have shape {shape} as `z` has {seen.z.shape}, got {part.shape}")]
    if seen.missing is not None:
        for name, lacking in zip(sensor.measurement.names, np.moveaxis(seen.missing, -1, 0), strict=True):
            if name not in sensor.optional and np.any(lacking & seen.valid):
                may = ", ".join(sensor.optional) or "none"
                return [Problem("missing", f"{sensor.kind!r} always reports {name}; of its axes a return may lack: {may}")]
    good = _good(seen)
    if good.all():
        return []
    return [Problem(f"return {list(map(int, i))}", _complaint(seen, tuple(i))) for i in np.argwhere(~good)]


def _good(seen: Detections) -> Mask:
    """Which returns (*b, k) can be used; padding is never looked at."""
    number = np.abs(seen.z) <= ABSURD
    if seen.missing is not None:
        number |= seen.missing & ~seen.missing.all(axis=-1, keepdims=True)
    good: Mask = np.all(number, axis=-1)
    if seen.evidence is not None:
        good &= np.isfinite(seen.evidence)
    if seen.noise is not None:
        own = seen.noise if seen.missing is None else among_present(seen.noise, ~seen.missing)
        good &= _is_covariance(own)
    return good | ~seen.valid


def _is_covariance(noise: Array) -> Mask:
    finite: Mask = np.all(np.abs(noise) <= ABSURD, axis=(-1, -2))
    safe = np.where(finite[..., None, None], noise, np.eye(noise.shape[-1]))
    skew = np.max(np.abs(safe - np.swapaxes(safe, -1, -2)), axis=(-1, -2))
    usable: Mask = (skew <= 1e-9 * np.max(np.abs(safe), axis=(-1, -2))) & (np.linalg.eigvalsh(safe)[..., 0] > 0)
    return finite & usable


def _complaint(seen: Detections, i: Any) -> str:
    if seen.missing is not None and seen.missing[i].all():
        return "must have at least one component"
    if not np.all((np.abs(seen.z[i]) <= ABSURD) | (False if seen.missing is None else seen.missing[i])):
        return f"must be finite numbers, got {seen.z[i].tolist()}"
    if seen.evidence is not None and not np.isfinite(seen.evidence[i]):
        return f"its evidence must be a finite number, got {seen.evidence[i]}"
    assert seen.noise is not None
    return f"its noise must be symmetric and positive definite, got {seen.noise[i].tolist()}"
