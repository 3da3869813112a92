"""What a settled filter makes of the truth's strongest manoeuvre: where it expects the returns, and where they would be."""

from __future__ import annotations

from collections.abc import Iterator, Sequence

import numpy as np
from attrs import frozen

from vedette import Array, Axis, Detections, Experiment, Gaussian, Pose, Sensor, Space, Trajectory
from vedette.filters import expected_return, predicted
from vedette_tools.explaining.steady_state import Settled

BEFORE, AFTER = 50, 20
"""Scans before and after the strongest manoeuvre that the filter is led over."""
FIT = 5
"""Scans over which an acceleration is fitted; what is shorter is the truth's own noise."""
MOST = 20_000
"""Scans of an object, from its first on, in which its manoeuvres are looked for."""
ROW = 3
"""Scans in a row over which the lag is to hold: a single one is a jump of the truth."""


@frozen(eq=False)
class Manoeuvre:
    """An object's strongest acceleration in m/s^2 at a time in s, and the filter's `lag` behind it.

    `lag` in standard deviations of the innovations that the filter itself expects, the least of ROW scans in a row at the
    worst, and `off` in m, how far the prediction is off there.
    """

    name: str
    time: float
    acceleration: float
    lag: float
    off: float


def strongest(experiment: Experiment, sensor: Sensor, pose: Pose | None, dt: float, settled: Settled,
              truth: Sequence[Trajectory]) -> Manoeuvre | None:  # fmt: skip
    """Return what a filter with returns that do not err makes of the strongest manoeuvre, None if that cannot be told.

    The truth is read at scans `dt` s apart, that of an object with longer gaps than FIT of them not at all.
    Only where the sensor observes positions and velocities at most.
    """
    tracker = experiment.tracker
    sensor = sensor.placed(pose)
    paths = [(path.name, *sampled) for path in truth if (sampled := _sampled(path, tracker.state, dt)) is not None]
    paths = [path for path in paths if len(path[1]) >= 2 * FIT]
    if not paths or not set(sensor.observes.axes) <= set(paths[0][3].axes):
        return None
    accelerations = [_accelerations(states[:, _metres(space)], dt) for _, _, states, space in paths]
    best = int(np.argmax([np.max(each) for each in accelerations]))
    name, times, states, space = paths[best]
    each = accelerations[best]
    at = int(np.argmax(each)) + FIT // 2
    begin, end = max(0, at - BEFORE), min(len(times), at + AFTER)
    led = list(_led(experiment, sensor, dt, settled, states[begin:end], space))
    lags, off = np.array([one[0] for one in led]), np.array([one[1] for one in led])
    rows = np.lib.stride_tricks.sliding_window_view(lags, ROW).min(axis=-1)
    worst = FIT + int(np.argmax(rows[FIT:]))  # the first scans find the velocity
    return Manoeuvre(name, float(times[begin + worst + 1]), float(np.max(each)), float(rows[worst]), float(off[worst]))


def _metres(space: Space) -> list[int]:
    return [i for i, axis in enumerate(space.axes) if axis.unit == "m"]


def _sampled(path: Trajectory, state: Space, dt: float) -> tuple[Array, Array, Space] | None:
    """Return times (s,) and positions with velocities (s, n) of an object, over the axes of `state`, and these."""
    axes = [axis for axis in path.space.axes if axis.unit == "m" and axis in state.axes]
    rates = [axis for axis in state.axes if axis.unit == "m/s" and axis.name in {f"v{each.name}" for each in axes}]
    if not axes or len(rates) != len(axes):
        return None
    end = min(path.times[-1], path.times[0] + MOST * dt)
    times = np.arange(path.times[0], end + 1e-9 * dt, dt)
    if len(times) < 2 or np.max(np.diff(path.times)) > FIT * dt:  # in between it has corners that are nobody's
        return None
    columns = path.states[:, path.space.locate(Space(tuple(axes)))].T
    places = np.stack([np.interp(times, path.times, column) for column in columns], axis=-1)
    space = Space((*axes, *(Axis(f"v{each.name}", "m/s") for each in axes)))
    return times, np.concatenate([places, np.gradient(places, dt, axis=0)], axis=-1), space


def _accelerations(places: Array, dt: float) -> Array:
    """Return the accelerations (s - FIT + 1,) that parabolas over FIT scans (least squares) give the positions (s, d)."""
    t = (np.arange(FIT) - FIT // 2) * dt
    weights = 2.0 * np.linalg.pinv(np.stack([np.ones(FIT), t, t**2], axis=-1))[2]
    return np.linalg.norm(np.lib.stride_tricks.sliding_window_view(places, FIT, axis=0) @ weights, axis=-1)


def _led(
    experiment: Experiment, sensor: Sensor, dt: float, settled: Settled, states: Array, space: Space
) -> Iterator[tuple[float, float]]:
    """Yield by scan how far the return is from the prediction, in deviations and in m; each is taken for the target's."""
    tracker, rng = experiment.tracker, np.random.default_rng(0)
    estimator, p_gate = tracker.estimator, tracker.gate.probability
    mean = settled.start.mean.copy()
    mean[0, tracker.state.locate(space)] = states[0]
    belief = estimator.start(Gaussian(mean, settled.start.cov), tracker.state, rng)
    seen = states[:, space.locate(sensor.observes)]
    spot = estimator.state.locate(Space(tuple(space.axes[i] for i in _metres(space))))
    for x, whole in zip(seen[1:], states[1:], strict=True):
        belief = predicted(estimator, belief, dt, rng)
        ahead = estimator.moments(belief)
        expected, S, _ = expected_return(Gaussian(ahead.mean[0], ahead.cov[0]), estimator.state, sensor)
        z = sensor.measure(x)
        residual = sensor.measurement.difference(z, expected)
        off = float(np.linalg.norm(whole[_metres(space)] - ahead.mean[0, spot]))
        square = float(residual @ np.linalg.pinv(S) @ residual)
        yield float(np.sqrt(max(square, 0.0))), off
        belief = estimator.update(
            belief, estimator.evaluate(belief, sensor, Detections.of(z[None]), p_gate), np.array([[0.0, 1.0]])
        )
