"""Wrong filters of one Gaussian: what a scan says, and what becomes of the belief."""

from functools import partial

import attrs
import numpy as np

import vedette
import vedette_standard as standard
from mutants.foreign.base import Mutant, broken_class, mutant
from vedette.filters import GaussianFilter, embedded, evaluate_each, prepare

MOTION = standard.ConstantVelocity(0.5)
KALMAN = partial(standard.Kalman, motion=MOTION)
EKF = partial(standard.ExtendedKalman, motion=standard.CoordinatedTurn(0.5, 0.05))


def _changed(**change):
    """Return an `evaluate` that changes parts of the innovation, each a function of it, the sensor and p_gate."""

    def evaluate(right, belief, sensor, observed, p_gate):
        innovation = right.evaluate(belief, sensor, observed, p_gate)
        return attrs.evolve(innovation, **{name: f(innovation, sensor, p_gate) for name, f in change.items()})

    return evaluate


def _first_column(value):
    """Return the log-likelihoods with another column 0."""
    return lambda i, s, p: np.concatenate([value(i, s, p)[..., None], i.loglik[..., 1:]], axis=-1)


def _other_columns(add):
    return lambda i, s, p: np.concatenate([i.loglik[..., :1], i.loglik[..., 1:] + add(i, s, p)], axis=-1)


def _seen_without(**lost):
    def evaluate(right, belief, sensor, observed, p_gate):
        seen = observed if isinstance(observed, vedette.Frame) else attrs.evolve(observed, **lost)
        return right.evaluate(belief, sensor, seen, p_gate)

    return evaluate


def _needs_a_return(right, belief, sensor, observed, p_gate):
    nearest = right.evaluate(belief, sensor, observed, p_gate).distance.min(axis=-1)
    innovation = right.evaluate(belief, sensor, observed, p_gate)
    return innovation if np.all(nearest >= 0) else None


def _linearised(residual=None, at=None, noise=None):
    """Return an `evaluate` of the extended filter with another residual, another place of H, or another noise."""

    def evaluate(right, belief, sensor, observed, p_gate):
        if isinstance(observed, vedette.Frame):
            return right.evaluate(belief, sensor, observed, p_gate)
        where = right.state.locate(sensor.observes)
        x = belief.mean[..., where]
        ready = prepare(sensor, observed, sensor.measure(x), sensor.noise(x))
        if residual is not None:
            ready = attrs.evolve(ready, residuals=residual(ready, sensor.measure(x)))
        if noise is not None:
            ready = attrs.evolve(ready, noise=noise(ready))
        H = sensor.jacobian(x if at is None else at(x))
        slope = embedded(H, where, len(right.state))
        return evaluate_each(belief, ready, slope[..., None, :, :], x, p_gate)

    return evaluate


def _merged(miss, spread):
    """Return an `update` with or without the miss' covariance and the spread of the means."""

    def update(right, belief, innovation, weights):
        detail, w = innovation.detail, weights[..., 1:, None]
        shift = (w * detail.shift).sum(axis=-2)
        post = np.broadcast_to(detail.post, (*detail.shift.shape, detail.shift.shape[-1]))
        each = (w[..., None] * post).sum(axis=-3)
        cov = (
            weights[..., 0, None, None] * belief.cov + each
            if miss
            else np.where(w.sum(-2, keepdims=True) > 0, each, belief.cov)
        )
        if spread:
            apart = detail.shift - shift[..., None, :]
            cov = cov + np.swapaxes(apart, -1, -2) @ (w * apart)
            cov = cov + weights[..., 0, None, None] * shift[..., None] * shift[..., None, :]
        return vedette.Gaussian(belief.mean + shift, cov)

    return update


def _best_return(right, belief, innovation, weights):
    hard = (weights == weights.max(axis=-1, keepdims=True)).astype(float)
    return right.update(belief, innovation, hard / hard.sum(axis=-1, keepdims=True))


def _in_place(right, belief, innovation, weights):
    after = right.update(belief, innovation, weights)
    belief.mean[...], belief.cov[...] = after.mean, after.cov
    return belief


def _base(name, fault, right, **faults):
    """Return a mutant that is itself a `GaussianFilter`, so that it smooths by its own methods."""
    return Mutant(
        name, "estimator", fault, right, partial(broken_class(GaussianFilter, right.func, name, faults), **right.keywords)
    )


estimator = partial(mutant, "estimator")

MUTANTS: tuple[Mutant, ...] = (
    _base(
        "ekf_unwrapped",
        "Residuals of angles are not wrapped.",
        EKF,
        evaluate=_linearised(residual=lambda r, z: np.where(r.residuals == 0, 0.0, r.z[..., None, :, :] - z[..., None, :])),
    ),
    _base(
        "ekf_residual_sign",
        "The residual is expectation minus detection.",
        EKF,
        evaluate=_linearised(residual=lambda r, z: -r.residuals),
    ),
    _base(
        "ekf_h_of_the_first",
        "H is that of the first track for all.",
        EKF,
        evaluate=_linearised(at=lambda x: np.broadcast_to(x.reshape(-1, x.shape[-1])[:1], x.shape) if x.size else x),
    ),
    estimator("kalman_ignores_noise", "A return's own covariance is ignored.", KALMAN, evaluate=_seen_without(noise=None)),
    estimator(
        "kalman_ignores_missing",
        "Components that are missing are taken as measured.",
        KALMAN,
        evaluate=_seen_without(missing=None),
    ),
    estimator("kalman_needs_a_return", "A scan without returns raises an error.", KALMAN, evaluate=_needs_a_return),
    estimator(
        "miss_without_p_gate",
        "Column 0 is log(1 - P_D): the gate's probability is forgotten.",
        KALMAN,
        evaluate=_changed(
            loglik=_first_column(lambda i, s, p: np.log(np.maximum(1 - (1 - np.exp(i.loglik[..., 0])) / p, 1e-300)))
        ),
    ),
    estimator(
        "loglik_without_p_detect",
        "The columns of the returns lack log P_D.",
        EKF,
        evaluate=_changed(
            loglik=_other_columns(lambda i, s, p: -np.log(np.maximum((1 - np.exp(i.loglik[..., :1])) / p, 1e-300)))
        ),
    ),
    estimator(
        "loglik_without_determinant",
        "The density lacks 1 / sqrt|S|.",
        EKF,
        evaluate=_changed(loglik=_other_columns(lambda i, s, p: i.log_volume[..., None])),
    ),
    estimator(
        "volume_of_determinant",
        "log_volume is log|S|, not log sqrt|S|.",
        EKF,
        evaluate=_changed(log_volume=lambda i, s, p: 2 * i.log_volume),
    ),
    estimator(
        "distance_not_squared",
        "The distance is not squared.",
        EKF,
        evaluate=_changed(distance=lambda i, s, p: np.sqrt(i.distance)),
    ),
    estimator(
        "nis_normalised",
        "The NIS is divided by the number of measured axes.",
        EKF,
        evaluate=_changed(nis=lambda i, s, p: i.nis / len(s.measurement)),
    ),
    estimator(
        "update_without_spread",
        "The spread of the hypotheses' means is forgotten.",
        KALMAN,
        update=_merged(miss=True, spread=False),
    ),
    estimator(
        "update_without_miss",
        "The covariance of a miss does not count in the mixture.",
        KALMAN,
        update=_merged(miss=False, spread=True),
    ),
    estimator("update_best_return", "Only the heaviest hypothesis counts.", KALMAN, update=_best_return),
    estimator("update_in_place", "The belief that is passed in is changed.", KALMAN, update=_in_place),
)
