"""The iterated extended Kalman filter."""

from __future__ import annotations

from typing import ClassVar, final

import numpy as np
from attrs import Factory, field, frozen

from vedette import Array, Detections, Frame, Gaussian, Innovation, MotionModel, Sensor, fields
from vedette.filters.gaussian import GaussianFilter, among_present, imaged, joined, noise_of, one_by_one, reported
from vedette.space import Mask
from vedette_standard.estimators.extended import ExtendedKalman


@final
@frozen
class IteratedExtendedKalman(GaussianFilter):
    """Linearises the sensor anew at each return's own estimate, always against the prior: Gauss-Newton for its mode.

    x_{i+1} = x- + K_i (z - h(x_i) - H_i (x- - x_i)), H_i and K_i at x_i, x_0 = x-. A pass that does not lower
    |z - h(x)|^2_R + |x - x-|^2_P is not taken and ends the passes, so what is far off or singular cannot run away. The
    likelihood and the covariance are those of the last linearisation; on a linear problem any number of passes is one. R
    stays that at x-.
    Bell, Cathey, The Iterated Kalman Filter Update as a Gauss-Newton Method, IEEE Trans. Automatic Control 38, 1993.
    """

    kind: ClassVar[str] = "iekf"
    exact_when_linear: ClassVar[bool] = True

    motion: MotionModel = fields.part("how the target moves")
    passes: int = fields.integer("linearisations of each return", default=5, at_least=1, at_most=100)
    _extended: ExtendedKalman = field(
        init=False, repr=False, eq=False, default=Factory(lambda self: ExtendedKalman(self.motion), takes_self=True)
    )

    def predict(self, belief: Gaussian, dt: float, rng: np.random.Generator, combined: Gaussian | None = None) -> Gaussian:
        """The belief `dt` s later, as the extended filter's."""
        return self._extended.predict(belief, dt, rng, combined)

    def evaluate(self, belief: Gaussian, sensor: Sensor, observed: Detections | Frame, p_gate: float) -> Innovation:
        """Every return against every track, each linearised where it says that the track is."""
        if isinstance(observed, Frame):
            return imaged(belief, self.state, sensor, observed, p_gate, self.passes)
        where = self.state.locate(sensor.observes)
        prior = belief.mean[..., None, :]
        R = noise_of(sensor, observed, belief.mean[..., where])
        there = None
        if observed.missing is not None:
            there = reported(observed)
            R = among_present(R, there)
        x = np.broadcast_to(prior, (*belief.mean.shape[:-1], observed.z.shape[-2], len(self.state)))
        H, nu = used = self._line(x, prior, sensor, observed, where)
        price = np.full(x.shape[:-1], np.inf)
        for _ in range(self.passes):
            cross = belief.cov[..., None, :, :] @ np.swapaxes(H, -1, -2)
            pull = np.linalg.solve(H @ cross + R, nu[..., None])
            step = (cross @ pull)[..., 0]
            ahead = self._line(self.state.displace(prior, step), prior, sensor, observed, where)
            # |x - x-|^2_P is pull' H P H' pull, and the residual at x what the new line leaves there.
            left = ahead[1] - (ahead[0] @ step[..., None])[..., 0]
            cost = np.sum(left * np.linalg.solve(R, left[..., None])[..., 0], axis=-1)
            cost += np.sum(pull * (H @ cross @ pull), axis=(-1, -2))
            better = cost < price
            if not better.any():
                break
            price = np.where(better, cost, price)
            used = _where(better, (H, nu), used)
            H, nu = _where(better, ahead, (H, nu))
        H, nu = used
        parts = one_by_one(belief.cov, nu, H, R, there)
        return joined(sensor, belief.mean[..., where], p_gate, parts)

    def _line(self, x: Array, prior: Array, sensor: Sensor, detections: Detections, where: list[int]) -> tuple[Array, Array]:
        """Derivative (*b, t, k, m, n) at `x` (*b, t, k, n), and what the line through there makes of each return at the
        prior: z - h(x) - H (x- - x), (*b, t, k, m).
        """
        slope = sensor.jacobian(x[..., where])
        H = np.zeros((*x.shape[:-1], len(sensor.measurement), len(self.state)))
        H[..., where] = slope
        left = sensor.measurement.difference(detections.z[..., None, :, :], sensor.measure(x[..., where]))
        if detections.missing is not None:
            there = reported(detections)
            H, left = H * there[..., None], np.where(there, left, 0.0)
        return H, left - (H @ self.state.difference(prior, x)[..., None])[..., 0]


def _where(better: Mask, new: tuple[Array, Array], old: tuple[Array, Array]) -> tuple[Array, Array]:
    """The new line (*b, t, k, m, n) and (*b, t, k, m) where it is better (*b, t, k)."""
    return np.where(better[..., None, None], new[0], old[0]), np.where(better[..., None], new[1], old[1])
