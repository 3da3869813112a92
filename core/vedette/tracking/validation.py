"""Validation of scans as they enter the tracker: the only check of data, so that nothing later needs one."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

import numpy as np
from attrs import evolve

from vedette import kernels
from vedette.errors import Problem, ScanRefused
from vedette.fields import ABSURD
from vedette.filters.declared import contradiction, unforwarded
from vedette.filters.detections import present_noise
from vedette.roles import Estimator, Sensor
from vedette.space import Array, Mask, SpaceError
from vedette.supporting import ImagingSensor
from vedette.tracking import pytrees
from vedette.tracking.components import parts
from vedette.tracking.gate import Gate, SensorGate
from vedette.types import Detections, Frame, Gaussian, Pose, Scan
from vedette.units import short

LONG_AGO = -ABSURD
"""Before this time in s no scan is taken: a state without a time is of -inf."""


def check_forwarding(estimator: Estimator[Any]) -> None:
    """Raise ValueError, with its place, if an estimator or motion within does not forward what it holds."""
    for place, part in parts(estimator, "estimator"):
        if reason := contradiction(type(part)) or unforwarded(part):
            raise ValueError(f"{place}: {reason}")


def check_sensors(sensors: Mapping[str, Sensor], estimator: Estimator[Any], gate: Gate) -> None:
    """Raise ValueError, with its place, if a sensor does not go with the estimator or the gate."""
    if not sensors:
        raise ValueError("sensors: must hold at least one sensor, got none")
    for name, sensor in sensors.items():
        try:
            estimator.state.locate(sensor.observes)
        except SpaceError as error:
            raise ValueError(f"sensors.{name}: observes an axis that the estimator lacks: {error}") from None
        for axis, length in sensor.optional.items():
            if axis not in sensor.measurement.names or not 0 < length <= ABSURD:
                told = f"must map axes of {sensor.measurement} to lengths > 0, got {axis!r}: {length}"
                raise ValueError(f"sensors.{name}: optional of {sensor.kind!r} {told}")
        if isinstance(sensor, ImagingSensor) and not estimator.traits.takes_frames:
            raise ValueError(f"sensors.{name}: is a camera, but {estimator.kind!r} takes no frames: use 'ekf' or 'iekf'")
        if reason := estimator.refuses(sensor):
            raise ValueError(f"sensors.{name}: {reason}")
        if sensor.optional and gate.clutter != "sensor":
            raise ValueError(f"gate.clutter: must be 'sensor', as returns of {name!r} may lack components")


def flaws(scan: Scan, sensors: Mapping[str, Sensor], since: float) -> list[Problem]:
    """Return what is wrong with a scan for a tracker at time `since` in s; nothing if it can be taken."""
    if scan.sensor not in sensors:
        return [Problem("sensor", f"must be one of {', '.join(map(repr, sensors))}, got {scan.sensor!r}")]
    problems = []
    if not abs(scan.time) <= ABSURD:
        problems.append(Problem("time", f"must be a finite number of s{_at_most(scan.time)}, got {scan.time}"))
    elif scan.time < since:
        problems.append(
            Problem("time", f"must not go back: {scan.time:.6f} s is {since - scan.time:.6g} s before the last scan")
        )
    if scan.pose is not None:
        problems += _pose_flaws(scan.pose)
    sensor = sensors[scan.sensor]
    if isinstance(sensor, ImagingSensor) != (scan.frame is not None):
        text = "must hold a frame, as it is a camera's" if scan.frame is None else f"{scan.sensor!r} is not a camera"
        return [*problems, Problem("frame", text)]
    if scan.frame is not None:
        return problems + _frame_flaws(scan.frame)
    return problems + (_return_flaws(scan.detections, sensor) or _time_flaws(scan))


def with_axes(scan: Scan, sensors: Mapping[str, Sensor]) -> Scan:
    """Return the scan, over the axes of its sensor if it holds no return and does not state its axes."""
    if scan.detections.z.shape != (0, 0) or scan.frame is not None or scan.sensor not in sensors:
        return scan
    return evolve(scan, detections=Detections.of([], len(sensors[scan.sensor].measurement)))


def checked_prior(given: Any, axes: int) -> Gaussian:
    """Return a user's prior for the start; ValueError if it is not a Gaussian over so many axes for each track."""
    if not isinstance(given, Gaussian):
        raise ValueError(f"given: must be vedette.Gaussian(mean, cov), got {short(given)}")
    try:
        mean, cov = np.asarray(given.mean, dtype=float), np.asarray(given.cov, dtype=float)
    except (TypeError, ValueError):
        raise ValueError(f"given: must hold numbers in rows of equal length, got {short(given)}") from None
    if mean.ndim < 2 or mean.shape[-1] != axes or cov.shape != (*mean.shape, axes):
        wanted = f"mean (..., tracks, {axes}) and cov (..., tracks, {axes}, {axes})"
        raise ValueError(f"given: must have {wanted}, got {mean.shape} and {cov.shape}")
    bad = ~(np.all(np.abs(mean) <= ABSURD, axis=-1) & _is_covariance(cov, -1e-9))
    if bad.any():
        i = tuple(map(int, np.argwhere(bad)[0]))
        most = f"means of at most {ABSURD:g}, variances of at most {ABSURD**2:g}"
        told = f"must have finite numbers, {most}, and a symmetric positive semi-definite covariance"
        raise ValueError(f"given: track {list(i)} {told}, got {short(mean[i].tolist())} and {short(cov[i].tolist())}")
    return Gaussian(mean, cov)


def admitted(scan: Scan, gates: Mapping[str, SensorGate], since: float) -> Detections | Frame:
    """Return the detections or frame of a scan that a tracker at time `since` in s can take, or raise ScanRefused.

    What padding and missing components hold is set to 0, so that it cannot reach a sum, not even as 0 * nan.
    """
    try:
        detections, sensor_gate = scan.detections, gates.get(scan.sensor)
    except AttributeError:
        if isinstance(scan, Scan):
            raise
        told = "a scan: must be a vedette.Scan, as Scan(time, sensor, Detections.of(z)) makes one of returns z"
        raise TypeError(f"{told}, got {type(scan).__name__}") from None
    except TypeError:  # a list, say, names no sensor
        told = f"must be one of {', '.join(map(repr, gates))}, got {short(scan.sensor)}"
        raise ScanRefused(str(Problem("sensor", told))) from None
    if (  # the most common kind of scan, without problems
        sensor_gate is not None
        and LONG_AGO < since <= scan.time <= ABSURD
        and scan.frame is None
        and scan.pose is None
        and detections.evidence is None
        and detections.noise is None
        and detections.missing is None
        and detections.identity is None
        and detections.time is None
        and sensor_gate.axes
        and kernels.is_plain(detections.z, detections.valid, sensor_gate.axes, ABSURD)
    ):
        return detections
    if detections.z.shape == (0, 0) and sensor_gate is not None:
        scan = with_axes(scan, {scan.sensor: sensor_gate.sensor})
        detections = scan.detections
    if problems := flaws(scan, {name: sensor_gate.sensor for name, sensor_gate in gates.items()}, since):
        raise ScanRefused("; ".join(map(str, problems)))
    if scan.frame is not None:
        return scan.frame
    unread = ~detections.valid[..., None]
    if detections.missing is not None:
        unread = unread | detections.missing
    return _without_padding(detections, unread) if unread.any() else detections


def _without_padding(detections: Detections, unread: Mask) -> Detections:
    """Return the detections with 0 where z (*b, k, m) is `unread`, and noises and evidence of padding that are numbers."""
    noise, evidence, valid, time = detections.noise, detections.evidence, detections.valid, detections.time
    if noise is not None:
        noise = np.where(valid[..., None, None], noise, np.eye(noise.shape[-1]))
    if evidence is not None:
        evidence = np.where(valid, evidence, 0.0)
    if time is not None:
        time = np.where(valid, time, np.min(time, where=valid, initial=ABSURD))
    return evolve(detections, z=np.where(unread, 0.0, detections.z), noise=noise, evidence=evidence, time=time)


def without_bad_returns(scan: Scan) -> tuple[Scan, list[Problem]]:
    """Return the scan without returns that are not finite or have no valid noise covariance, and what was wrong.

    One whose returns are all bad stays as it is, to be refused: without any it would count as a miss of every track.
    """
    detections = scan.detections
    bad = ~_good(detections) if detections.valid.shape == detections.z.shape[:-1] else np.zeros(1, dtype=bool)
    if not bad.any() or not (detections.valid & ~bad).any():
        return scan, []
    problems = [Problem(f"return {i}", _complaint(detections, i)) for i in np.flatnonzero(bad)]
    return evolve(scan, detections=pytrees.take(detections, ~bad, 0)), problems


def _at_most(values: Array | float) -> str:
    """Return what is to be added to "finite" where numbers are refused that are, but are too large for anything."""
    return f" of at most {ABSURD:g}" if np.all(np.isfinite(values)) else ""


def _pose_flaws(pose: Pose) -> list[Problem]:
    if not isinstance(pose, Pose):
        return [Problem("pose", f"must be a vedette.Pose, as Pose([x, y]) makes one, got {short(pose)}")]
    parts = {"position": pose.position, "velocity": pose.velocity, "heading": pose.heading}
    return [
        Problem(f"pose.{name}", f"must be finite numbers{_at_most(value)}, got {np.asarray(value).tolist()}")
        for name, value in parts.items()
        if value is not None and not np.all(np.abs(value) <= ABSURD)
    ] + [
        Problem(f"pose.{name}", f"must be 2 or 3 numbers, got shape {np.shape(value)}")
        for name, value in (("position", pose.position), ("velocity", pose.velocity))
        if value is not None and (np.ndim(value) < 1 or np.shape(value)[-1] not in (2, 3))
    ]


def _frame_flaws(frame: Frame) -> list[Problem]:
    """Return what is wrong with a frame; NaN pixels are allowed, as they carry no information, but infinite ones are not."""
    if not isinstance(frame, Frame):
        return [Problem("frame", f"must be a vedette.Frame, as Frame(pixels) makes one, got {short(frame)}")]
    pixels, corner = frame.pixels, frame.corner
    if not isinstance(pixels, np.ndarray) or pixels.dtype.kind not in "buif":
        kind = pixels.dtype if isinstance(pixels, np.ndarray) else type(pixels).__name__
        return [Problem("frame", f"pixels must be an array of real numbers, got {kind}")]
    if pixels.ndim < 2 or 0 in pixels.shape[-2:]:
        return [Problem("frame", f"pixels must have shape (..., height, width), got {pixels.shape}")]
    if pixels.dtype.kind == "f" and np.any(np.abs(pixels) > ABSURD):
        return [Problem("frame", f"pixels must be at most {ABSURD:g} in size, or NaN where they say nothing")]
    if corner is not None and (corner.shape[-1:] != (2,) or not np.all(np.abs(corner) <= ABSURD)):
        return [Problem("frame", f"corner must be finite with shape (..., 2), got {np.asarray(corner).tolist()}")]
    return []


def _return_flaws(detections: Detections, sensor: Sensor) -> list[Problem]:
    m = len(sensor.measurement)
    if detections.z.ndim < 2 or detections.z.shape[-1] != m:
        return [Problem("z", f"must have shape (..., returns, {m}), got {detections.z.shape}")]
    for name, part, shape in (
        ("valid", detections.valid, detections.z.shape[:-1]),
        ("evidence", detections.evidence, detections.z.shape[:-1]),
        ("noise", detections.noise, (*detections.z.shape, m)),
        ("missing", detections.missing, detections.z.shape),
        ("identity", detections.identity, detections.z.shape[:-1]),
        ("time", detections.time, detections.z.shape[:1]),
    ):
        if part is not None and part.shape != shape:
            return [Problem(name, f"must have shape {shape} as `z` has {detections.z.shape}, got {part.shape}")]
    if detections.missing is not None:
        for name, lacking in zip(sensor.measurement.names, np.moveaxis(detections.missing, -1, 0), strict=True):
            if name not in sensor.optional and np.any(lacking & detections.valid):
                may = ", ".join(sensor.optional) or "none"
                return [Problem("missing", f"{sensor.kind!r} always reports {name}; of its axes a return may lack: {may}")]
    good = _good(detections)
    if good.all():
        return []
    return [Problem(f"return {list(map(int, i))}", _complaint(detections, tuple(i))) for i in np.argwhere(~good)]


def _time_flaws(scan: Scan) -> list[Problem]:
    """Return which returns have times of their own that are none, or after the scan's."""
    times, valid = scan.detections.time, scan.detections.valid
    wrong = [] if times is None else np.flatnonzero(valid & ~((times >= LONG_AGO) & (times <= scan.time))).tolist()
    told = f"its time must be a number of s until the scan's, {scan.time:.6f} s"
    return [Problem(f"return {[i]}", f"{told}, got {times[i]}") for i in wrong]  # type: ignore[index]


def _good(detections: Detections) -> Mask:
    """Return which returns (*b, k) can be used; padding is ignored."""
    number = np.abs(detections.z) <= ABSURD
    if detections.missing is not None:
        number |= detections.missing & ~detections.missing.all(axis=-1, keepdims=True)
    good: Mask = np.all(number, axis=-1)
    if detections.evidence is not None:
        good &= np.isfinite(detections.evidence)
    if detections.noise is not None:
        noise = detections.noise if detections.missing is None else present_noise(detections.noise, ~detections.missing)
        good &= _is_covariance(noise)
    return good | ~detections.valid


def _is_covariance(given: Array, least: float = 1e-14) -> Mask:
    """Return which matrices (*b, n, n) are symmetric, their correlations' eigenvalues above `least`.

    Axes have scales of their own, so each is measured by its deviation; one without variance only counts if `least` < 0.
    """
    finite: Mask = np.all(np.abs(given) <= ABSURD**2, axis=(-1, -2))
    safe = np.where(finite[..., None, None], given, np.eye(given.shape[-1]))
    variance = np.diagonal(safe, axis1=-2, axis2=-1)
    deviation = np.sqrt(np.where(variance > 0, variance, 1.0))
    with np.errstate(over="ignore"):
        correlation = np.clip(safe / deviation[..., :, None] / deviation[..., None, :], -2.0, 2.0)  # beyond 1 none is good
    skew = np.max(np.abs(correlation - np.swapaxes(correlation, -1, -2)), axis=(-1, -2))
    varies = np.all((variance >= 0) if least < 0 else (variance > 0), axis=-1)
    usable: Mask = varies & (skew <= 1e-9) & (np.linalg.eigvalsh(correlation)[..., 0] > least)
    return finite & usable


def _complaint(detections: Detections, i: Any) -> str:
    if detections.missing is not None and detections.missing[i].all():
        return "must have at least one component"
    if not np.all((np.abs(detections.z[i]) <= ABSURD) | (False if detections.missing is None else detections.missing[i])):
        return f"must be finite numbers{_at_most(detections.z[i])}, got {detections.z[i].tolist()}"
    if detections.evidence is not None and not np.isfinite(detections.evidence[i]):
        return f"its evidence must be a finite number, got {detections.evidence[i]}"
    assert detections.noise is not None
    noise = detections.noise[i]
    too_large = np.all(np.isfinite(noise)) and np.any(np.abs(noise) > ABSURD**2)
    told = f", its elements at most {ABSURD**2:g}" if too_large else ", its correlations within 1 by 1e-14 at least"
    return f"its noise must be symmetric and positive definite{told}, got {noise.tolist()}"
