"""Wrong filters of one Gaussian: how time changes a belief, forwards and backwards."""

from functools import partial

import attrs
import numpy as np

import vedette
import vedette_standard as standard
from mutants.foreign.base import Mutant, broken_class, mutant
from vedette.filters import GaussianFilter, predict_linearised

MOTION = standard.ConstantVelocity(0.5)
KALMAN = partial(standard.Kalman, motion=MOTION)
EKF = partial(standard.ExtendedKalman, motion=standard.CoordinatedTurn(0.5, 0.05))
UKF = partial(standard.UnscentedKalman, motion=standard.CoordinatedTurn(0.5, 0.05))


def _without_noise(right, belief, dt, rng):
    if dt == 0:
        return belief
    F = right.motion.jacobian(belief.mean, dt)
    return vedette.Gaussian(right.motion.move(belief.mean, dt), F @ belief.cov @ np.swapaxes(F, -1, -2))


def _no_transpose(right, belief, dt, rng):
    F, Q = right.motion.jacobian(belief.mean, dt), right.motion.noise(belief.mean, dt)
    return belief if dt == 0 else vedette.Gaussian(right.motion.move(belief.mean, dt), F @ belief.cov @ F + Q)


def _jacobian_ahead(right, belief, dt, rng):
    if dt == 0:
        return belief
    x = right.motion.move(belief.mean, dt)
    F, Q = right.motion.jacobian(x, dt), right.motion.noise(x, dt)
    return vedette.Gaussian(x, F @ belief.cov @ np.swapaxes(F, -1, -2) + Q)


def _noise_for_no_time(right, belief, dt, rng):
    return predict_linearised(belief, right.motion, max(dt, 0.1))


def _fading(right, belief, dt, rng):
    ahead = right.predict(belief, dt, rng)
    return ahead if dt == 0 else attrs.evolve(ahead, cov=1.05 * ahead.cov)


def _single_precision(right, belief, dt, rng):
    ahead = right.predict(belief, dt, rng)
    return vedette.Gaussian(*(a.astype(np.float32).astype(float) for a in (ahead.mean, ahead.cov)))


def _unscaled_points(right, belief, dt, rng):
    """Points one column of the root away, weighted as if they were sqrt(n) columns away."""
    if dt == 0:
        return belief
    root = np.swapaxes(vedette.kernels.root(belief.cov), -1, -2)
    moved = right.motion.move(
        np.concatenate([belief.mean[..., None, :] + root, belief.mean[..., None, :] - root], axis=-2), dt
    )
    mean = moved.mean(axis=-2)
    apart = moved - mean[..., None, :]
    return vedette.Gaussian(mean, np.swapaxes(apart, -1, -2) @ apart / moved.shape[-2] + right.motion.noise(belief.mean, dt))


def _first_axes(right, prior, axes, rng):
    n = len(right.state)
    return right.start(vedette.Gaussian(prior.mean[..., :n], prior.cov[..., :n, :n]), right.state, rng)


def _gain_of_filtered(right, belief, later, dt, rng):
    """The gain takes the filtered covariance where the predicted one belongs."""
    if dt == 0:
        return later
    ahead = right.predict(belief, dt, rng)
    gain = right.cross_covariance(belief, dt) @ np.linalg.inv(belief.cov)
    shift = (gain @ (later.mean - ahead.mean)[..., None])[..., 0]
    return vedette.Gaussian(belief.mean + shift, belief.cov + gain @ (later.cov - ahead.cov) @ np.swapaxes(gain, -1, -2))


def _against_the_past(right, belief, later, dt, rng):
    """The smoothed state is compared to the filtered one, which was not moved ahead."""
    step = right.smooth_step(belief, later, dt, rng)
    ahead = right.predict(belief, dt, rng)
    shifted = attrs.evolve(later, mean=later.mean - belief.mean + ahead.mean)
    return step if dt == 0 else right.smooth_step(belief, shifted, dt, rng)


def _base(name, fault, right, **faults):
    """Return a mutant that is itself a `GaussianFilter`, so that it smooths by its own methods."""
    return Mutant(
        name, "estimator", fault, right, partial(broken_class(GaussianFilter, right.func, name, faults), **right.keywords)
    )


estimator = partial(mutant, "estimator")

MUTANTS: tuple[Mutant, ...] = (
    _base("kalman_without_q", "Prediction forgets Q.", KALMAN, predict=_without_noise),
    _base("kalman_no_transpose", "P- = F P F + Q.", KALMAN, predict=_no_transpose),
    _base(
        "kalman_least_step",
        "Steps shorter than .1 s are taken as .1 s, even those of no time.",
        KALMAN,
        predict=_noise_for_no_time,
    ),
    _base("ekf_jacobian_ahead", "The motion is linearised at the predicted state.", EKF, predict=_jacobian_ahead),
    _base(
        "kalman_cross_transposed",
        "The covariance of now and later is transposed: the smoother's gain is wrong.",
        KALMAN,
        cross_covariance=lambda r, b, dt: np.swapaxes(r.cross_covariance(b, dt), -1, -2),
    ),
    estimator(
        "kalman_smooths_by_filtered", "The smoother's gain takes P where P- belongs.", KALMAN, smooth_step=_gain_of_filtered
    ),
    estimator(
        "kalman_smooths_unmoved",
        "The smoother compares with the filtered, not the predicted state.",
        KALMAN,
        smooth_step=_against_the_past,
    ),
    estimator(
        "kalman_fading",
        "The covariance is inflated by 5 % each scan, and exactness is still promised.",
        KALMAN,
        predict=_fading,
    ),
    estimator(
        "ekf_fading",
        "The covariance is inflated by 5 % each scan, which promises nothing.",
        EKF,
        label="other_model",
        predict=_fading,
        declares=vedette.Traits(),
    ),
    estimator(
        "root_single_precision",
        "The filter that is to keep digits rounds to single precision.",
        KALMAN,
        predict=_single_precision,
    ),
    estimator(
        "ukf_unscaled_points",
        "The points lie a factor sqrt(n) too near.",
        UKF,
        predict=_unscaled_points,
        declares=vedette.Traits(),
    ),
    estimator("start_by_position", "The prior's first axes are taken, whatever their names.", KALMAN, start=_first_axes),
)
