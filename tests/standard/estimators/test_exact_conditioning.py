"""Kalman, extended and unscented filters are exact conditioning on linear problems."""

from fractions import Fraction

import numpy as np
import pytest
from attrs import evolve

from support.models import Linear, Looking
from support.rational import rational, solve
from vedette import Detections, Gaussian, kernels
from vedette_standard.estimators.extended import ExtendedKalman
from vedette_standard.estimators.kalman import Kalman
from vedette_standard.estimators.unscented import UnscentedKalman

ALL = [Kalman, ExtendedKalman, UnscentedKalman]
RNG = np.random.default_rng(0)
"""Asked for by the signature; these filters draw nothing."""


def short(rng, *shape):
    return rng.integers(-16, 17, size=shape) / 16


def short_cov(rng, n):
    a = short(rng, n, n)
    return a @ a.T + np.eye(n) / 4


def random_problem(seed, spread=0):
    """A linear model, three sensors, and scans (dt, sensor, z or None): some at one time, some missed.

    The sensors' deviations differ by up to 2^spread to either side, and the prior knows as little as the worst of them.
    """
    rng = np.random.default_rng(seed)
    n = int(rng.integers(2, 5))
    motion = Linear(short(rng, n, n) / 2, short_cov(rng, n))
    scale = 4.0 ** rng.integers(-spread, spread + 1, size=3)
    sensors = [Looking(short(rng, m, n), scale[m - 1] * short_cov(rng, m)) for m in (1, 2, 3)]
    scans = []
    for _ in range(7):
        sensor = sensors[rng.integers(3)]
        z = None if rng.random() < 0.25 else 4 * short(rng, len(sensor.H))
        scans.append((float(rng.choice([0.0, 0.5, 1.0])), sensor, z))
    return motion, Gaussian(short(rng, 1, n), 4.0**spread * short_cov(rng, n)[None]), scans


def run(estimator, prior, scans):
    """The last belief, and the log likelihood of all that was seen."""
    belief, total = estimator.start(prior, estimator.state, RNG), 0.0
    for dt, sensor, z in scans:
        belief = estimator.predict(belief, dt, RNG)
        detections = Detections.of([] if z is None else [z], len(sensor.measurement))
        innovation = estimator.evaluate(belief, sensor, detections, 1.0)
        weights = np.ones((1, 1)) if z is None else np.array([[0.0, 1.0]])
        belief = estimator.update(belief, innovation, weights)
        total += 0.0 if z is None else innovation.loglik[0, 1]
    return estimator.moments(belief), total


def condition(motion, prior, scans):
    """The joint Gaussian of the last state and everything seen, by its independent causes (the prior's error, each step's
    noise, each return's noise), conditioned in one go without any rounding.
    """
    n = len(motion.A)
    zero = Fraction(0)
    eye = {size: rational(np.eye(size)) for size in range(1, 5)}
    mean, x, causes = rational(prior.mean[0]), [eye[n]], [rational(prior.cov[0])]  # the state: sum of x[i] times cause i
    rows, nu = [], []
    for dt, sensor, z in scans:
        F = eye[n] + rational(motion.A * dt)
        mean, x = F @ mean, [*(F @ block for block in x), eye[n]]
        causes.append(rational(motion.C * dt))
        if z is not None:
            H = rational(sensor.H)
            rows.append([*(H @ block for block in x), eye[len(z)]])
            nu.append(rational(z) - H @ mean)
            x.append(np.full((n, len(z)), zero))
            causes.append(rational(sensor.R))
    stops = np.cumsum([len(cause) for cause in causes])
    D = np.full((stops[-1], stops[-1]), zero)
    for stop, cause in zip(stops, causes, strict=True):
        D[stop - len(cause) : stop, stop - len(cause) : stop] = cause

    def over_all_causes(blocks):
        row = np.concatenate(blocks, axis=1)
        return np.concatenate([row, np.full((len(row), len(D) - row.shape[1]), zero)], axis=1)

    X, Z = over_all_causes(x), np.concatenate([over_all_causes(blocks) for blocks in rows])
    nu, across = np.concatenate(nu), Z @ D @ X.T
    gain_t, log_det = solve(Z @ D @ Z.T, np.concatenate([across, nu[:, None]], axis=1))
    mean, cov = mean + across.T @ gain_t[:, -1], X @ D @ X.T - across.T @ gain_t[:, :-1]
    # The last column of gain_t is what the residuals weigh: S^-1 nu.
    loglik = -0.5 * (float(nu @ gain_t[:, -1]) + log_det + len(nu) * np.log(2 * np.pi))
    return np.array(mean, float), np.array(cov, float), loglik


def check_exact(kind, seed, spread=0):
    motion, prior, scans = random_problem(seed, spread)
    mean, cov, loglik = condition(motion, prior, scans)
    found, total = run(kind(motion), prior, scans)
    deviation = np.sqrt(np.diag(cov))
    np.testing.assert_allclose((found.mean[0] - mean) / deviation, 0, atol=1e-9)
    np.testing.assert_allclose((found.cov[0] - cov) / np.outer(deviation, deviation), 0, atol=1e-9)
    np.testing.assert_allclose(total, loglik, rtol=1e-9, atol=1e-9)
    np.testing.assert_array_equal(found.cov, np.swapaxes(found.cov, -1, -2))


@pytest.mark.parametrize("seed", range(6))
@pytest.mark.parametrize("kind", ALL)
@pytest.mark.parametrize("spread", [0, 5])
@pytest.mark.by_turns
def test_equals_exact_conditioning_of_the_joint_gaussian(kind, seed, spread):
    check_exact(kind, seed, spread)


REAL_ABSORB, REAL_PREDICT, REAL_RETURNS = kernels.weighted_update, kernels.predict, kernels.evaluate_returns


@pytest.mark.parametrize(
    ("name", "mutant"),
    [
        ("weighted_update", lambda x, P, shift, *rest: REAL_ABSORB(x, P, shift + 1e-6, *rest)),
        ("weighted_update", lambda x, P, *rest: evolve(REAL_ABSORB(x, P, *rest), cov=P)),
        ("predict", lambda x, P, F, Q: REAL_PREDICT(x, P, F, 0 * Q)),
        ("predict", lambda x, P, F, Q: REAL_PREDICT(x, P, np.swapaxes(F, -1, -2), Q)),
    ],
    ids=["shifted", "covariance not updated", "no process noise", "F transposed"],
)
@pytest.mark.by_turns
def test_exact_conditioning_bites(monkeypatch, name, mutant):
    monkeypatch.setattr(kernels, name, mutant)
    with pytest.raises(AssertionError):
        check_exact(Kalman, 0)


@pytest.mark.parametrize("kind", ALL)
def test_order_of_simultaneous_returns_does_not_matter(kind):
    motion, prior, scans = random_problem(3)
    rng = np.random.default_rng(8)
    together = [(0.0, Looking(short(rng, m, len(motion.A)), short_cov(rng, m)), short(rng, m)) for m in (1, 2, 3)]
    one, one_loglik = run(kind(motion), prior, [*scans, *together])
    other, other_loglik = run(kind(motion), prior, [*scans, *reversed(together)])
    np.testing.assert_allclose(one.mean, other.mean, rtol=1e-10, atol=1e-10)
    np.testing.assert_allclose(one.cov, other.cov, rtol=1e-10, atol=1e-10)
    np.testing.assert_allclose(one_loglik, other_loglik, rtol=1e-10)
