"""Prediction and evaluation by the derivatives of motion and sensor at the mean, as in Kalman filters."""

from __future__ import annotations

import numpy as np

from vedette import kernels
from vedette.filters.detections import Prepared, make_innovation, prepare
from vedette.filters.frames import evaluate_frame
from vedette.filters.memo import Memo, embedded
from vedette.roles import GatedScan, MotionModel, Sensor
from vedette.space import Array, Space, wrapped
from vedette.types import Detections, Frame, Gaussian, Hypotheses, Innovation, new_gaussian


def predict_linearised(belief: Gaussian, motion: MotionModel, dt: float, memo: Memo | None = None) -> Gaussian:
    """Return the belief `dt` s later, by the motion's derivative at each track's mean: P- = F P F' + Q.

    Parameters
    ----------
    belief
        Mean (*b, t, n) and covariance (*b, t, n, n) over the motion's axes.
    motion
        How the targets move.
    dt
        Time step in s, > 0.
    memo
        The filter's own, so that the matrices of a linear motion are computed once per dt.

    Returns
    -------
    Gaussian
        Of the same shapes.
    """
    x, P, memo = belief.mean, belief.cov, memo or Memo()
    if motion.linear:
        F, Q, periods = memo.step(motion, x, dt)
        ahead = kernels.predict(x, P, F, Q)
        return new_gaussian(wrapped(ahead.mean, periods), ahead.cov) if periods else ahead
    twin, periods = memo.moving or memo.twin(motion)
    if twin is not None:
        by_twin = kernels.predict_twin(x, P, dt, twin.function, twin.numbers(x, dt), periods)
        if by_twin is not None:
            return by_twin
    moved = wrapped(motion.move(x, dt), periods)
    F, Q = motion.jacobian(x, dt), motion.mean_noise(x, P, dt)
    cov = kernels.propagate(P, F, Q)
    if kernels.cancels(P, F, cov):
        rows = F @ kernels.root(P)
        cov = kernels.propagate(np.broadcast_to(np.eye(P.shape[-1]), P.shape), rows, Q)
    return Gaussian(moved, cov)


def evaluate_linearised(
    belief: Gaussian, state: Space, sensor: Sensor, observed: Detections | Frame, p_gate: float, memo: Memo | None = None
) -> Innovation:
    """Return the innovation of each track, by the sensor's derivative at the track's mean.

    Parameters
    ----------
    belief
        Mean (*b, t, n) and covariance (*b, t, n, n) over `state`.
    state
        The axes of `belief`; those that the sensor observes must be among them.
    sensor
        The sensor, placed if it stands on a platform.
    observed
        Its scan, z (*b, k, m), or a camera's frame, which counts as one return.
    p_gate
        Probability that the target's own return is inside the gate.
    memo
        The filter's own, so that the matrices of a linear sensor are computed once.

    Returns
    -------
    Innovation
        Its loglik is (*b, t, 1+k), column 0 the miss; its detail is `Hypotheses`.
    """
    memo = memo or Memo()
    constants = memo.last
    if constants is None or constants.sensor is not sensor:
        if isinstance(observed, Frame):  # a camera has no constants, so that it is never the last to have had some
            return evaluate_frame(belief, state, sensor, observed, p_gate)
        constants = memo.constants(state, sensor, belief.mean)
    returns: Detections = observed  # type: ignore[assignment]  # a frame has gone its way above
    if constants.plain is not None and returns.noise is None and returns.missing is None:
        H, R, p_detect, _ = constants.plain
        return kernels.evaluate_returns(belief.cov, returns.z, belief.mean, H, R, p_detect, p_gate, constants.periods)
    if constants.twin is not None and returns.missing is None:
        mean, (twin, axes), stated = belief.mean, constants.twin, returns.noise
        noise = None if stated is None else stated[..., None, :, :, :]
        numbers, periods = twin.numbers(mean), constants.periods
        innovation = kernels.evaluate_twin(mean, belief.cov, returns.z, noise, twin.function, numbers, axes, p_gate, periods)
        if innovation is not None:
            return innovation
    x = belief.mean[constants.where]
    H = embedded(sensor.jacobian(x), constants.where[-1], len(state)) if constants.H is None else constants.H
    if returns.missing is not None:
        ready = prepare(sensor, returns, sensor.measure(x), noise_over(belief, sensor, constants.where[-1]))
        return evaluate_each(belief, ready, H[..., None, :, :], x, p_gate)
    noise = constants.R if returns.noise is None else returns.noise[..., None, :, :, :]
    if noise is None:
        noise = noise_over(belief, sensor, constants.where[-1])[..., None, :, :]
    detects = sensor.detects(x) if constants.p_detect is None else constants.p_detect
    expected = sensor.measure(x)
    return kernels.evaluate_returns(belief.cov, returns.z, expected, H, noise, detects, p_gate, constants.periods)


def scan_step_linearised(
    belief: Gaussian, motion: MotionModel, scan: GatedScan, memo: Memo
) -> tuple[Gaussian, Array, Array] | None:
    """Return what `Estimator.scan_step` does, in one kernel, for filters that have their own of no method but these.

    Parameters
    ----------
    belief, scan
        As there.
    motion
        How the targets move.
    memo
        The filter's own.

    Returns
    -------
    tuple or None
        None unless the motion is linear, alike for all tracks, and without angles among its axes, and the sensor either has
        a twin or is linear, alike everywhere, and measures its first axes as they are.
    """
    x, P, (periods, fixed) = belief.mean, belief.cov, memo.frame or memo.framed(motion)
    if periods or fixed or not motion.linear or motion.reframes:
        return None
    F, Q, _ = memo.steps.get(scan.dt) or memo.step(motion, x, scan.dt)
    if F.ndim > 2 or Q.ndim > 2:
        return None
    seen = memo.last
    if seen is None or seen.sensor is not scan.sensor:
        seen = memo.constants(motion.state, scan.sensor, x)
    numbers = (scan.p_gate, scan.limit, scan.log_density, scan.best)
    if seen.plain is not None:
        H, _, p_detect, R = seen.plain
        return kernels.scan_step(x, P, F, Q, scan.z, H, R, p_detect, *numbers, seen.periods)
    if seen.twin is not None:
        twin, axes = seen.twin
        return kernels.scan_step_twin(x, P, F, Q, scan.z, twin.function, twin.numbers(x), axes, *numbers, seen.periods)
    return None


def noise_over(belief: Gaussian, sensor: Sensor, where: slice | list[int]) -> Array:
    """Return a sensor's R averaged over a belief: (*b, t, m, m) or (m, m).

    Parameters
    ----------
    belief
        Mean (*b, t, n) and covariance (*b, t, n, n).
    sensor
        The sensor, placed if it stands on a platform.
    where
        The axes of the belief that it observes.
    """
    return sensor.mean_noise(belief.mean[..., where], belief.cov[..., where, :][..., where])


def expected_return(
    predicted: Gaussian, state: Space, sensor: Sensor, noise: Array | None = None
) -> tuple[Array, Array, Array]:
    """Return what a sensor is expected to measure.

    Parameters
    ----------
    predicted
        Tracks, mean (*b, n) and covariance (*b, n, n) over `state`.
    state
        The axes of `predicted`; those that the sensor observes must be among them.
    sensor
        The sensor, placed if it stands on a platform.
    noise
        R (*b, m, m) or (m, m), in the squares of the measured axes' units; default: the sensor's.

    Returns
    -------
    tuple of arrays
        The measurement (*b, m), the covariance S = H P H' + R of the innovation (*b, m, m), and H (*b, m, n) or (m, n) over
        the axes that the sensor observes.
    """
    where = state.locate(sensor.observes)
    x, P = predicted.mean[..., where], predicted.cov[..., where, :][..., where]
    H = sensor.jacobian(x)
    S: Array = H @ P @ np.swapaxes(H, -1, -2) + (sensor.mean_noise(x, P) if noise is None else noise)
    return sensor.measure(x), S, H


def extent_linearised(
    belief: Gaussian, state: Space, sensor: Sensor, detections: Detections, limit: Array | float, memo: Memo | None = None
) -> tuple[Array, Array]:
    """Return the box around each gate of `evaluate_linearised`: the mean +- sqrt(limit S_ii).

    Parameters
    ----------
    belief
        Mean (*b, t, n) and covariance (*b, t, n, n) over `state`.
    state
        The axes of `belief`.
    sensor
        The sensor, placed if it stands on a platform.
    detections
        Its scan; if returns have noises of their own, the largest of them counts.
    limit
        The gate's threshold: the greatest squared distance.
    memo
        The filter's own.

    Returns
    -------
    tuple of arrays
        The lower and the upper corners (*b, t, m); angles go up from the first and are not wrapped.
    """
    constants = (memo or Memo()).constants(state, sensor, belief.mean)
    x = belief.mean[constants.where]
    H = embedded(sensor.jacobian(x), constants.where[-1], len(state)) if constants.H is None else constants.H
    if H.ndim == 2:  # then one product of matrices does for all tracks
        squares = (H[:, :, None] * H[:, None, :]).reshape(len(H), -1)
        S = belief.cov.reshape(*belief.mean.shape[:-1], -1) @ squares.T
    else:
        S = np.sum((H @ belief.cov) * H, axis=-1)
    return gate_box(detections, limit, sensor.measure(x), S, noise_over(belief, sensor, constants.where[-1]))


def gate_box(seen: Detections, limit: Array | float, expected: Array, spread: Array, noise: Array) -> tuple[Array, Array]:
    """Return the corners of a box as `extent_linearised` does.

    Parameters
    ----------
    seen, limit
        The scan and the limit there.
    expected, spread
        What the sensor is expected to measure, and the variances of that without the errors of returns: (*b, t, m).
    noise
        The sensor's R, (*b, t, m, m) or (m, m).
    """
    if seen.noise is not None:
        noise = np.max(seen.noise, axis=-3, keepdims=True, initial=0.0)
    half = np.sqrt(limit * (spread + np.diagonal(noise, axis1=-2, axis2=-1))) * (1.0 + 1e-9)
    return expected - half, expected + half


def evaluate_each(belief: Gaussian, detections: Prepared, H: Array, x: Array, p_gate: float) -> Innovation:
    """Return the innovation of prepared detections.

    Parameters
    ----------
    belief
        Mean (*b, t, n) and covariance (*b, t, n, n).
    detections
        What `prepare` returns.
    H
        Derivatives (*b, t, 1|k, m, n) over the whole state, one for all detections or one for each.
    x
        The axes that the sensor observes (*b, t, ...), at which its detection probability is evaluated.
    p_gate
        Probability that the target's own return is inside the gate.

    Returns
    -------
    Innovation
        Its loglik is (*b, t, 1+k), column 0 the miss; its detail is `Hypotheses`.
    """
    evaluated = kernels.evaluate(
        belief.cov[..., None, :, :],
        detections.residuals[..., None, :],
        detections.rows(H),
        detections.noise[..., None, :, :],
    )
    detail = Hypotheses(evaluated.shift[..., 0, :], evaluated.post[..., 0, :, :])
    likely, distance = evaluated.loglik[..., 0] + detections.log_constant, evaluated.distance[..., 0]
    return make_innovation(detections.sensor, x, p_gate, likely, distance, evaluated.log_volume[..., 0], detail)
