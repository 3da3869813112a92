"""An extended Kalman filter that knows how much motion and sensor bend."""

import numpy as np
from attrs import evolve, frozen

import vedette
from vedette.filters import GaussianFilter, embedded, evaluate_each, predict_linearised, prepare


def bend(slope, x, cov):
    """Return what the second derivatives H_a of a function add to its mean, tr(H_a P) / 2, and its covariance,
    tr(H_a P H_b P) / 2, from its `slope` one standard deviation to each side of `x` along the columns of a root of P.
    """
    root = vedette.kernels.root(cov)
    step = np.swapaxes(root, -1, -2)  # (*b, s, n): a column a row
    change = (slope(x[..., None, :] + step) - slope(x[..., None, :] - step)) / 2  # (*b, s, m, n)
    change = np.broadcast_to(change, (*step.shape[:-1], *change.shape[-2:]))  # a constant slope may lack the batch axes
    curved = change @ root[..., None, :, :]  # (*b, s, m, s), the root's H_a root
    return np.einsum("...sas->...a", curved) / 2, np.einsum("...sai,...sbi->...ab", curved, curved) / 2


@frozen
class SecondOrder(GaussianFilter):
    """The extended Kalman filter with second-order terms in prediction and expected measurement; exact for linear models.

    x- = f(x) + tr(H P) / 2 and P- = F P F' + Q + tr(H P H P) / 2 with the motion's Hessians H; z- and S likewise.
    Athans, Wishner, Bertolini, Suboptimal State Estimation for Continuous-Time Nonlinear Systems from Discrete Noisy
    Measurements, IEEE T-AC 13, 1968.
    """

    kind = "second_order"
    declares = vedette.Traits(exact_when_linear=True)
    motion: vedette.MotionModel = vedette.fields.part("how the target moves")

    def predict(self, belief, dt, rng):
        if dt == 0:
            return belief
        ahead = predict_linearised(belief, self.motion, dt)
        if self.motion.linear:
            return ahead
        shift, spread = bend(lambda x: self.motion.jacobian(x, dt), belief.mean, belief.cov)
        return vedette.Gaussian(self.state.displace(ahead.mean, shift), ahead.cov + spread)

    def evaluate(self, belief, sensor, observed, p_gate):
        where = self.state.locate(sensor.observes)
        x, cov = belief.mean[..., where], belief.cov[..., where, :][..., where]
        shift, spread = bend(sensor.jacobian, x, cov)
        expected = sensor.measurement.displace(sensor.measure(x), shift)
        ready = prepare(sensor, observed, expected, sensor.mean_noise(x, cov))
        ready = evolve(ready, noise=ready.noise + ready.columns(ready.rows(spread[..., None, :, :])))
        slope = embedded(sensor.jacobian(x), where, len(self.state))
        return evaluate_each(belief, ready, slope[..., None, :, :], x, p_gate)
