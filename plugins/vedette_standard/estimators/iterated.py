"""The iterated extended Kalman filter."""

from __future__ import annotations

from typing import ClassVar, final

import numpy as np
from attrs import evolve, frozen

from vedette import Array, Detections, Frame, Gaussian, Innovation, Mask, MotionModel, Sensor, Traits, fields, kernels
from vedette.filters import (
    GaussianFilter,
    Prepared,
    evaluate_each,
    evaluate_frame,
    evaluate_linearised,
    noise_over,
    predict_linearised,
    prepare,
)

_RISES, _STILL = 1 + 1e-9, 1e-12
"""Times the last cost, that of a pass must be less than the first: near the mode only rounding tells which is less. A pass
that moves the estimate by less than the second, in standard deviations of each axis, changes nothing.
"""


@final
@frozen
class IteratedExtendedKalman(GaussianFilter):
    """Linearises the sensor again at each return's own estimate, always against the prior: Gauss-Newton for its mode.

    x_{i+1} = x- + K_i (z - h(x_i) - H_i (x- - x_i)), H_i and K_i at x_i, x_0 = x-. A pass that raises
    |z - h(x)|^2_R + |x - x-|^2_P is rejected and ends the passes, so a distant or singular point cannot diverge. The
    likelihood and the covariance are those of the last linearisation; on a linear problem one pass gives the same as many. R
    stays that at x-. For sharp returns of whole positions: of bearings or ranges alone the mode may be far from the mean. Of
    a target 5 km away, known to 2 km, it was off by 3.2 km in the mean of 20 draws, where `ckf` was by .4.
    Bell, Cathey, The Iterated Kalman Filter Update as a Gauss-Newton Method, IEEE Trans. Automatic Control 38, 1993.

    >>> from vedette import Detections, Gaussian
    >>> from vedette_standard import RandomWalk, RangeOnly
    >>> x, P, z, R = np.array([30.0, 40.0]), np.array([[900.0, 100.0], [100.0, 400.0]]), 75.0, 4.0
    >>> def iterated(passes):
    ...     at = x
    ...     for _ in range(passes):
    ...         r, H = np.hypot(*at), at / np.hypot(*at)
    ...         K = P @ H / (H @ P @ H + R)
    ...         at = x + K * (z - r - H @ (x - at))
    ...     return at, P - np.outer(K, K) * (H @ P @ H + R)
    >>> for passes in (1, 2, 30):
    ...     estimator = IteratedExtendedKalman(RandomWalk(2.0), passes=passes)
    ...     belief = estimator.start(Gaussian(x[None], P[None]), estimator.state, None)
    ...     seen = estimator.evaluate(belief, RangeOnly(2.0), Detections.of([[z]]), 1.0)
    ...     after, (mean, cov) = estimator.update(belief, seen, np.array([[0.0, 1.0]])), iterated(passes)
    ...     np.allclose(after.mean[0], mean, rtol=1e-5), np.allclose(after.cov[0], cov, rtol=1e-3)
    (True, True)
    (True, True)
    (True, True)
    """

    kind: ClassVar[str] = "iekf"
    declares: ClassVar[Traits] = Traits(exact_when_linear=True, takes_frames=True)
    linearises: ClassVar[bool] = True

    motion: MotionModel = fields.part("how the target moves")
    passes: int = fields.integer("linearisations of each return", default=5, at_least=1, at_most=100)

    def predict(self, belief: Gaussian, dt: float, rng: np.random.Generator) -> Gaussian:
        """Return the belief `dt` s later, as the extended filter does."""
        return belief if dt == 0 else predict_linearised(belief, self.motion, dt, self._memo)

    def evaluate(self, belief: Gaussian, sensor: Sensor, observed: Detections | Frame, p_gate: float) -> Innovation:
        """Return the innovation of each detection and track, linearised at that detection's own estimate."""
        if isinstance(observed, Frame):
            return evaluate_frame(belief, self.state, sensor, observed, p_gate, self.passes)
        if sensor.linear:
            return evaluate_linearised(belief, self.state, sensor, observed, p_gate, self._memo)
        twin = self._memo.constants(self.state, sensor, belief.mean).twin
        if twin is not None and observed.missing is None:
            by, axes, noise = *twin, None if observed.noise is None else observed.noise[..., None, :, :, :]
            scan = observed.z, noise, by.function, by.numbers(belief.mean), axes, p_gate
            rest = self.state.periods, sensor.measurement.periods, self.passes
            seen = kernels.iterate_twin(belief.mean, belief.cov, *scan, *rest)
            if seen is not None:
                return seen
        where = self.state.locate(sensor.observes)
        prior, x0 = belief.mean[..., None, :], belief.mean[..., where]
        ready = prepare(sensor, observed, sensor.measure(x0), noise_over(belief, sensor, where))
        R = ready.noise
        x = np.broadcast_to(prior, (*belief.mean.shape[:-1], observed.z.shape[-2], len(self.state)))
        H, nu = used = self._line(x, prior, ready, where)
        price, volume, last = np.full(x.shape[:-1], np.inf), None, np.zeros_like(x)
        least = _STILL * np.sqrt(np.diagonal(belief.cov, axis1=-2, axis2=-1))[..., None, :]
        for _ in range(self.passes):
            P = belief.cov[..., None, :, :]
            inverse, log_det, gain = kernels.gains(P, H, R)
            if volume is None:  # that of the gate, around the prediction: no far return has a part in it
                volume = np.max(0.5 * log_det, axis=-1, initial=-np.inf)
            pull, step = inverse @ nu[..., None], (gain @ nu[..., None])[..., 0]
            ahead = self._line(self.state.displace(prior, step), prior, ready, where)
            # |x - x-|^2_P is pull' H P H' pull, and the residual at x what the new linearisation leaves there.
            left = ahead[1] - (ahead[0] @ step[..., None])[..., 0]
            cost = np.sum(left * np.linalg.solve(R, left[..., None])[..., 0], axis=-1)
            cost += np.sum(pull * (H @ P @ np.swapaxes(H, -1, -2) @ pull), axis=(-1, -2))
            better = (cost < price * _RISES) & np.any(np.abs(step - last) > least, axis=-1)
            if not better.any():
                break
            price, last = np.where(better, cost, price), step
            used = _where(better, (H, nu), used)
            H, nu = _where(better, ahead, (H, nu))
        H, nu = used
        innovation = evaluate_each(belief, evolve(ready, residuals=nu), H, x0, p_gate)
        return innovation if volume is None else evolve(innovation, log_volume=volume)

    def _line(self, x: Array, prior: Array, ready: Prepared, where: list[int]) -> tuple[Array, Array]:
        """Return the derivative (*b, t, k, m, n) at `x` (*b, t, k, n), and the linearised residual of each detection at the
        prior: z - h(x) - H (x- - x), (*b, t, k, m).
        """
        sensor = ready.sensor
        H = np.zeros((*x.shape[:-1], len(sensor.measurement), len(self.state)))
        H[..., where] = sensor.jacobian(x[..., where])
        H, left = ready.rows(H), ready.residuals_from(sensor.measure(x[..., where]))
        return H, left - (H @ self.state.difference(prior, x)[..., None])[..., 0]


def _where(better: Mask, new: tuple[Array, Array], old: tuple[Array, Array]) -> tuple[Array, Array]:
    """Return the new linearisation (*b, t, k, m, n) and (*b, t, k, m) where it is better (*b, t, k), else the old one."""
    return np.where(better[..., None, None], new[0], old[0]), np.where(better[..., None], new[1], old[1])
