"""What the filters with a Gaussian belief share: they differ in how they predict and in what a scan says to them."""

from __future__ import annotations

from abc import abstractmethod
from typing import Any

import numpy as np
from attrs import field, frozen

from vedette import kernels
from vedette.filters.memo import Memo, embedded
from vedette.roles import Estimator, ImagingSensor, MotionModel, Sensor
from vedette.space import Array, Mask, Space
from vedette.types import Detections, Frame, Gaussian, Innovation, new_gaussian, new_innovation
from vedette.values import maker


@frozen(eq=False)
class Hypotheses:
    """The detail of a Gaussian filter's innovation: shift (*b, t, k, n) and post (*b, t, 1|k, n, n) of each return."""

    shift: Array
    post: Array


new_hypotheses = maker(Hypotheses)


@frozen
class GaussianFilter(Estimator[Gaussian]):
    """A filter over one motion model whose belief is a mean and a covariance."""

    _memo: Memo = field(init=False, repr=False, eq=False, factory=Memo)

    @property
    @abstractmethod
    def motion(self) -> MotionModel: ...

    @property
    def state(self) -> Space:
        return self.motion.state

    @property
    def zero_variance(self) -> Space:
        return self.motion.zero_variance

    def start(self, prior: Gaussian, axes: Space, rng: np.random.Generator) -> Gaussian:
        """The prior's own axes; those without variance lose their variance."""
        return own_part(prior, axes, self.state, self.zero_variance)

    def update(self, belief: Gaussian, innovation: Innovation, weights: Array) -> Gaussian:
        """Moments of the weighted hypotheses, the spread of their means included."""
        detail: Hypotheses = innovation.detail
        memo = self._memo
        periods, zero_variance = memo.frame or memo.framed(self.motion)
        mean, cov = kernels.weighted_update(belief.mean, belief.cov, detail.shift, detail.post, weights, periods)
        if zero_variance:
            cov = without_variance(cov, zero_variance)
        return new_gaussian(mean, cov)

    def moments(self, belief: Gaussian) -> Gaussian:
        return belief

    def cross_covariance(self, belief: Gaussian, dt: float) -> Array:
        """P F', F the derivative of the motion at the mean; for filters that predict by it."""
        keeps_its_frame(self.motion)
        return belief.cov @ np.swapaxes(self.motion.jacobian(belief.mean, dt), -1, -2)


def turns_its_frame(estimator: Estimator[Any]) -> bool:
    """Whether the estimator needs the estimate of an enclosing mixture: all but filters whose motion keeps its frame."""
    return not isinstance(estimator, GaussianFilter) or type(estimator.motion).reframe is not MotionModel.reframe


def keeps_its_frame(motion: MotionModel) -> None:
    """NotImplementedError if beliefs over this motion are re-expressed on the way: two moments have no common frame."""
    if type(motion).reframe is not MotionModel.reframe:
        raise NotImplementedError(f"motion {motion.kind!r} turns its frame from scan to scan")


def own_part(prior: Gaussian, axes: Space, state: Space, zero_variance: Space) -> Gaussian:
    """What a Gaussian over `axes` says of `state`, where `zero_variance` axes lose their variance."""
    if axes is state and not zero_variance:
        return prior
    own = axes.locate(state)
    cov = prior.cov[..., own, :][..., own]
    if len(zero_variance):
        cov = without_variance(cov, state.locate(zero_variance))
    return Gaussian(prior.mean[..., own], cov)


def without_variance(cov: Array, axes: list[int]) -> Array:
    """Covariances (*b, n, n) with zeros in the rows and columns of `axes`, as zero-variance axes have."""
    keep = np.ones(cov.shape[-1])
    keep[axes] = 0.0
    return cov * (keep[:, None] * keep)


def moved(belief: Gaussian, motion: MotionModel, dt: float, combined: Gaussian | None, memo: Memo | None = None) -> Gaussian:
    """The belief `dt` > 0 s later, by the motion's derivative at each track's mean: P- = F P F' + Q.

    `memo`: the filter's own, so that the matrices of a linear motion are taken once per dt.
    """
    belief = motion.reframe(belief, belief if combined is None else combined)
    x = belief.mean
    if motion.linear:
        return new_gaussian(*kernels.predict(x, belief.cov, *(memo or Memo()).step(motion, x, dt)))
    return Gaussian(motion.move(x, dt), kernels.propagate(belief.cov, motion.jacobian(x, dt), motion.noise(x, dt)))


def linearised(
    belief: Gaussian, state: Space, sensor: Sensor, observed: Detections | Frame, p_gate: float, memo: Memo | None = None
) -> Innovation:
    """Every return against every track, by the sensor's derivative at each track's mean.

    `memo`: the filter's own, so that the matrices of a linear sensor are taken once.
    """
    if not isinstance(observed, Detections):
        return imaged(belief, state, sensor, observed, p_gate)
    memo = memo or Memo()
    constants = memo.last
    if constants is None or constants.sensor is not sensor:
        constants = memo.constants(state, sensor, belief.mean)
    x = belief.mean[constants.where]
    H = embedded(sensor.jacobian(x), constants.where[-1], len(state)) if constants.H is None else constants.H
    R = constants.R if observed.noise is None and constants.R is not None else noise_of(sensor, observed, x)
    if observed.missing is not None:
        nu, there = residuals(sensor, observed, sensor.measure(x)), reported(observed)
        return joined(sensor, x, p_gate, one_by_one(belief.cov, nu, H[..., None, :, :], R, there))
    p_detect = sensor.detects(x) if constants.p_detect is None else constants.p_detect
    loglik, distance, log_volume, shift, post = kernels.evaluate_returns(
        belief.cov, observed.z, sensor.measure(x), H, R, p_detect, p_gate, constants.periods
    )
    return new_innovation(loglik, distance, log_volume, distance, new_hypotheses(shift, post))


def reported(detections: Detections) -> Mask:
    """Which components the returns have (*b, 1, k, m); the axis of 1 is that of the tracks."""
    assert detections.missing is not None
    there: Mask = ~detections.missing[..., None, :, :]
    return there


def among_present(R: Array, there: Mask) -> Array:
    """Noise (*b, m, m) of the components that are there (*b, m); a missing one has variance 1 and goes with no other.

    With its residual and its row of H at 0 it then changes neither gain, distance nor determinant.
    """
    both = there[..., :, None] & there[..., None, :]
    return np.where(both, R, 0.0) + np.eye(there.shape[-1]) * ~there[..., None]


def missing_share(there: Mask) -> Array:
    """What a missing component takes from a Gaussian's logarithm, to be given back: (*b, m) -> (*b)"""
    share: Array = 0.5 * np.log(2 * np.pi) * np.sum(~there, axis=-1)
    return share


def one_by_one(
    P: Array, nu: Array, H: Array, R: Array, there: Mask | None = None
) -> tuple[Array, Array, Array, Array, Array]:
    """`kernels.evaluate` with a derivative H (*b, t, 1|k, m, n) of each return, of the components `there` (*b, 1, k, m)."""
    share: Array | float = 0.0
    if there is not None:
        nu, H, R = np.where(there, nu, 0.0), H * there[..., None], among_present(R, there)
        share = missing_share(there)
    parts = kernels.evaluate(P[..., None, :, :], nu[..., None, :], H, R[..., None, :, :])
    loglik, distance, log_volume, shift, post = parts
    return loglik[..., 0] + share, distance[..., 0], log_volume[..., 0], shift[..., 0, :], post[..., 0, :, :]


def imaged(
    belief: Gaussian, state: Space, sensor: Sensor, frame: Frame, p_gate: float, passes: int = 1, least: float = 0.0
) -> Innovation:
    """A frame against every track, as one return, linearised anew in each of up to `passes` passes.

    With p = H x the apparent position, S = H P H', e how far the point of linearisation is from the expected one, and
    q = g + J e: x+ = x- + P H' (I + J S)^-1 q, P+ in Joseph's form with the gain K = P H' (I + J S)^-1 J. No inverse of J is
    taken, so a frame without information (J = 0) leaves the belief as it is. The squared distance is that of the sufficient
    statistic J^-1 q, whose covariance is J^-1 + S: it has as many degrees of freedom as there are apparent axes, not pixels.
    Passes end when no track's point moves by more than `least` standard deviations of the update.
    """
    assert isinstance(sensor, ImagingSensor)
    where = state.locate(sensor.observes)
    x, m = belief.mean[..., where], len(sensor.measurement)
    slope = sensor.jacobian(x)
    H = embedded(slope, where, len(state))
    cross = belief.cov @ np.swapaxes(H, -1, -2)
    S = H @ cross
    expected = sensor.measure(x)
    at = sensor.seek(x, belief.cov[..., where, :][..., where], frame)
    for _ in range(passes):
        J, g, llr = sensor.information(x, frame, at)
        e = sensor.measurement.difference(sensor.measure(at), expected)
        Je = _times(J, e)
        q = g + Je
        shrink = np.linalg.inv(np.eye(m) + J @ S)
        pull = _times(shrink, q)
        shift = _times(cross, pull)
        before, at = at, state.displace(belief.mean, shift)[..., where]
        if np.max(np.abs(at - before), initial=0.0) <= least:
            break
    loglik = llr - np.sum((g + 0.5 * Je) * e, axis=-1) + 0.5 * np.sum(_times(S, pull) * q, axis=-1)
    log_det = np.linalg.slogdet(np.eye(m) + J @ S)[1]
    distance = np.sum(_times(np.linalg.pinv(J, hermitian=True), q) * pull, axis=-1)
    gain = cross @ shrink
    keep = np.eye(len(state)) - gain @ J @ H
    post = keep @ belief.cov @ np.swapaxes(keep, -1, -2) + gain @ J @ np.swapaxes(gain, -1, -2)
    shift[..., where] += sensor.learn(at, frame) - at
    parts = (
        (loglik - 0.5 * log_det)[..., None],
        distance[..., None],
        0.5 * (log_det - kernels.safe_log(np.linalg.det(J)))[..., None],
        shift[..., None, :],
        kernels.symmetric(post)[..., None, :, :],
    )
    return joined(sensor, x, p_gate, parts)


def _times(matrix: Array, vector: Array) -> Array:
    """(*b, p, q) times (*b, q) -> (*b, p)"""
    product: Array = (matrix @ vector[..., None])[..., 0]
    return product


def residuals(sensor: Sensor, detections: Detections, expected: Array) -> Array:
    """Every return minus every track's expected one: (*b, k, m), (*b, t, m) -> (*b, t, k, m)"""
    return sensor.measurement.difference(detections.z[..., None, :, :], expected[..., :, None, :])


def noise_of(sensor: Sensor, detections: Detections, x: Array) -> Array:
    """Measurement noise (*b, t|1, 1|k, m, m): the returns' own where they bring it, else the sensor's at `x` (*b, t, n)."""
    if detections.noise is not None:
        return detections.noise[..., None, :, :, :]
    R = sensor.noise(x)
    return R[..., None, :, :]


def joined(sensor: Sensor, x: Array, p_gate: float, parts: tuple[Array, Array, Array, Array, Array]) -> Innovation:
    """A kernel's result over the returns, and the detection probability at `x` (*b, t, n), the sensor's axes."""
    loglik, distance, log_volume, shift, post = parts
    p_detect = np.asarray(sensor.detects(x))
    columns = np.empty((*loglik.shape[:-1], 1 + loglik.shape[-1]))
    columns[..., 0] = kernels.safe_log(1.0 - p_detect * p_gate)
    columns[..., 1:] = loglik + kernels.safe_log(p_detect)[..., None]
    volume = np.broadcast_to(np.max(log_volume, axis=-1, initial=-np.inf), loglik.shape[:-1])
    return Innovation(columns, distance, volume, distance, Hypotheses(shift, post))
