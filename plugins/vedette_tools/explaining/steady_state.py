"""How a filter's covariances develop from the start of a track on, when every scan brings the return that it expects."""

from __future__ import annotations

import math
from collections.abc import Iterator, Sequence
from typing import Any

import numpy as np
from attrs import frozen

from vedette import Array, Detections, Gaussian, ImagingSensor, Indices, Mask, Pose, Recording, Sensor, Tracker
from vedette.filters import expected_return, predicted
from vedette_standard import stands

SCANS = 60
"""After this many scans a filter has settled, or will hardly do so."""
MOST = 600
"""Of several sensors that look at once, so many scans in all do as well."""
TRIED = tuple(10.0 ** (0.25 * k) for k in range(29))
"""Distances in m, 1 to 10^7, at which it is asked what a sensor sees, where no data say where targets are."""
FAR = TRIED[-1]


def ball(m: int, threshold: float) -> float:
    """Return the volume of a ball in m dimensions, of a squared radius."""
    return math.exp(0.5 * m * math.log(math.pi * threshold) - math.lgamma(m / 2 + 1))


@frozen(eq=False)
class Settled:
    """One sensor and one track over SCANS scans: the prior of its start, and what it comes to.

    start    the prior of a new track (1, n)
    updated  covariances (s, n, n) after each scan;  mean (s, n)
    has      which measured axes its returns have, m of them
    S        innovation covariance (s, m, m);  R (m, m) of the last
    measured            the last return, over all axes
    detects, density    probability of detection, clutter density at the last, in 1 / volume of the measurement space
    """

    start: Gaussian
    updated: Array
    mean: Array
    has: Indices
    S: Array
    R: Array
    measured: Array
    detects: float
    density: float

    def gate_volumes(self, threshold: float) -> Array:
        """Return the volume of the gate at each scan (s,), in the measurement's units."""
        return ball(self.R.shape[-1], threshold) * np.sqrt(np.maximum(np.linalg.det(self.S), 0.0))


def reach(sensor: Sensor) -> tuple[float, float]:
    """Return the least and the largest distance in m at which it detects something; FAR: no limit; NaN: nothing."""
    seen = [i for i, r in enumerate(TRIED) if _sees(sensor, r)]
    if not seen:
        return math.nan, math.nan
    near, far = TRIED[seen[0]], TRIED[seen[-1]]
    beyond = TRIED[min(seen[-1] + 1, len(TRIED) - 1)]
    while beyond / far > 1.0001:
        middle = math.sqrt(far * beyond)
        far, beyond = (middle, beyond) if _sees(sensor, middle) else (far, middle)
    return near, float(f"{far:.3g}")


def _sees(sensor: Sensor, r: float) -> bool:
    return bool(np.max(sensor.detects(ring(sensor, r))) > 0)


def ring(sensor: Sensor, r: float) -> Array:
    """Return points (8, n) over what the sensor observes, at the distance r around where it stands, or the origin."""
    axes = [i for i, axis in enumerate(sensor.observes.axes) if axis.unit in ("m", "px")][:2]
    x = np.zeros((8, len(sensor.observes)))
    turn, pose = np.pi / 8 + np.arange(8) * np.pi / 4, stands(sensor)
    middle = np.zeros(2) if pose is None else pose.position[:2]
    for i, part, own in zip(axes, (np.cos(turn), np.sin(turn)), middle, strict=False):
        x[:, i] = own + r * part
    return x


def settle(
    tracker: Tracker, name: str, dt: float, recording: Recording | None, returns: Array, pose: Pose | None,
    lacks: Mask | None = None,
) -> Settled | None:  # fmt: skip
    """Return how a track of one sensor settles with scans `dt` s apart; None if none can or does, or for a camera.

    lacks (m,): the components that none of its returns has.
    """
    sensor = tracker.sensors[name]
    if isinstance(sensor, ImagingSensor):
        return None
    start = _prior(tracker, name, dt, recording, returns, pose)
    return None if start is None else _run(tracker, sensor.placed(pose), dt, start, lacks)


def _prior(
    tracker: Tracker, name: str, dt: float, recording: Recording | None, returns: Array, pose: Pose | None
) -> Gaussian | None:
    """Return the prior (1, n) of a track: one given, or one begun at a return that may be a target's."""
    given = tracker.given(recording if recording is not None else Recording(())) if _gives(tracker, recording) else None
    if given is not None:
        return Gaussian(given.mean[:1], given.cov[:1])
    starter = name if name in tracker.starters else next(iter(tracker.starters), None)
    if starter is None or tracker.birth is None:
        return None
    sensor = tracker.sensors[starter]
    if isinstance(sensor, ImagingSensor):
        return None
    sensor = sensor.placed(pose)
    tried = [z for z in returns[:: max(1, len(returns) // 40)] if starter == name] + list(_made_up(sensor))
    begun = (prior for z in tried if (prior := begun_at(tracker, sensor, starter, z, dt)) is not None)
    if starter == name:
        return next(begun, None)
    placed = tracker.sensors[name].placed(pose)
    where = tracker.state.locate(placed.observes)
    begun_tracks = list(begun)
    return next(
        (prior for prior in begun_tracks if np.max(placed.detects(prior.mean[0, where])) > 0),
        begun_tracks[0] if begun_tracks else None,
    )


def _gives(tracker: Tracker, recording: Recording | None) -> bool:
    """Return whether the birth's tracks before the first scan can be told, as without a recording they may not be."""
    try:
        tracker.given(recording if recording is not None else Recording(()))
    except ValueError:
        return False
    return True


def _made_up(sensor: Sensor) -> Iterator[Array]:
    """Yield returns where the sensor detects something, from the middle of its reach outwards and then inwards."""
    near, far = reach(sensor)
    if math.isnan(near):
        return
    middle = math.sqrt(near * far) if far < FAR else max(1000.0, near)
    for r in (middle, *(each for each in TRIED if near <= each <= far)):
        x = ring(sensor, r)
        seen = np.flatnonzero(np.broadcast_to(sensor.detects(x), 8) > 0)
        if len(seen):
            yield sensor.measure(x)[seen[0]]


def begun_at(tracker: Tracker, sensor: Sensor, name: str, z: Array, dt: float, scans: int = 3) -> Gaussian | None:
    """Return the prior of the first track that begins where one return comes in each of so many scans, or None."""
    birth, estimator, p_gate = tracker.birth, tracker.estimator, tracker.gate.probability
    assert birth is not None
    if not np.max(sensor.detects(sensor.invert(z[None]).mean)) > 0 if inverts(sensor, z) else False:
        return None
    rng = np.random.default_rng(0)
    one, free = Detections.of(z[None]), np.zeros(1)
    memory, sources = birth.initial_memory(estimator, rng) if birth.models_unseen else None, None
    for i in range(scans):
        if birth.models_unseen:
            memory = birth.predict(memory, estimator, dt if i else 0.0, rng)
            _, sources = birth.reveal(memory, estimator, sensor, one, p_gate)
            memory = birth.update(memory, estimator, sensor, one, free, p_gate)
        born = birth.begin(sources, estimator, sensor, name, one, free)
        if len(born.returns):
            return Gaussian(born.prior.mean[:1], born.prior.cov[:1])
    return None


def inverts(sensor: Sensor, z: Array) -> bool:
    """Return whether one return gives a position."""
    try:
        sensor.invert(z[None])
    except NotImplementedError:
        return False
    return True


def _run(tracker: Tracker, sensor: Sensor, dt: float, start: Gaussian, lacks: Mask | None) -> Settled | None:
    """Take SCANS scans, each with the return that is expected; None if the estimator learns nothing from any of them."""
    estimator, rng = tracker.estimator, np.random.default_rng(0)
    where = estimator.state.locate(sensor.observes)
    belief = estimator.start(start, estimator.state, rng)
    updated, means, S, learnt = list[Array](), list[Array](), list[Array](), False
    R: Array = np.zeros(0)
    x: Array = start.mean[0, where]
    for _ in range(SCANS):
        belief, ahead, R, covariance = _scan(tracker, belief, sensor, dt, rng, lacks)
        x = ahead.mean[0, where]
        S.append(covariance)
        after = estimator.moments(belief)
        learnt = learnt or not np.array_equal(after.cov[0], ahead.cov[0])
        updated.append(after.cov[0])
        means.append(after.mean[0])
    if not learnt:
        return None
    names = sensor.measurement.names
    has = np.arange(len(names)) if lacks is None else np.flatnonzero(~lacks)
    density = np.asarray(sensor.clutter(sensor.measure(x)[None]))
    lengths = math.prod(sensor.optional.get(name, 1.0) for i, name in enumerate(names) if i not in has)
    return Settled(
        start, np.array(updated), np.array(means), has, np.array(S)[:, has][..., has], R[has][:, has], sensor.measure(x),
        float(np.max(sensor.detects(x))), float(density.reshape(-1)[0]) * lengths if density.size else 0.0,
    )  # fmt: skip


def together(tracker: Tracker, looks: Sequence[tuple[Sensor, float, Mask | None]], start: Gaussian) -> tuple[float, Array]:
    """Return a time in s and the covariance (n, n) of a track by then, seen by each sensor at its interval in s.

    Of each sensor, which components (m,) all of its returns lack.

    After SCANS scans of the slowest, or so many of all that it makes no difference.
    """
    span = min(SCANS * max(dt for _, dt, _ in looks), MOST / sum(1.0 / dt for _, dt, _ in looks))
    due = sorted((k * dt, i) for i, (_, dt, _) in enumerate(looks) for k in range(1, 1 + int(span / dt + 1e-9)))
    rng, time = np.random.default_rng(0), 0.0
    belief = tracker.estimator.start(start, tracker.estimator.state, rng)
    for then, i in due:
        belief = _scan(tracker, belief, looks[i][0], then - time, rng, looks[i][2])[0]
        time = then
    return time, tracker.estimator.moments(belief).cov[0]


def _scan(
    tracker: Tracker, belief: Any, sensor: Sensor, dt: float, rng: np.random.Generator, lacks: Mask | None
) -> tuple[Any, Gaussian, Array, Array]:
    """Return the belief after a scan with the return that is expected but for what it lacks, the prediction, R and S."""
    estimator = tracker.estimator
    belief = predicted(estimator, belief, dt, rng)
    ahead = estimator.moments(belief)
    R = sensor.noise(ahead.mean[0, estimator.state.locate(sensor.observes)])
    expected, S, _ = expected_return(Gaussian(ahead.mean[0], ahead.cov[0]), estimator.state, sensor, R)
    seen = Detections(expected[None], [True], missing=None if lacks is None else lacks[None])
    innovation = estimator.evaluate(belief, sensor, seen, tracker.gate.probability)
    return estimator.update(belief, innovation, np.array([[0.0, 1.0]])), ahead, R, S
