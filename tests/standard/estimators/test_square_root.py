"""Roots keep the digits that covariances lose."""

from fractions import Fraction

import numpy as np
import pytest
from attrs import frozen

from support.boats import prior
from support.rational import rational
from vedette import Detections, Gaussian, MotionModel, Sensor, Space, kernels
from vedette_standard.estimators.extended import ExtendedKalman
from vedette_standard.estimators.square_root import SquareRootKalman, mixed_roots
from vedette_standard.motion.constant_velocity import ConstantVelocity
from vedette_standard.motion.coordinated_turn import CoordinatedTurn
from vedette_standard.sensors.cartesian_position import CartesianPosition
from vedette_standard.sensors.range_bearing import RangeBearing

RNG = np.random.default_rng(0)
"""Asked for by the signature; these filters draw nothing."""
CV = ConstantVelocity(0.5)


# Digits.


def inverse(A):
    n = len(A)
    A, B = A.copy(), rational(np.eye(n))
    for i in range(n):
        B[i], A[i] = B[i] / A[i, i], A[i] / A[i, i]
        for j in range(n):
            if j != i:
                B[j], A[j] = B[j] - A[j, i] * B[i], A[j] - A[j, i] * A[i]
    return B


@frozen(eq=False)
class Still(MotionModel):
    """Three axes that stay."""

    kind = "test_still"
    linear = True
    state = Space.of(a="m", b="m", c="m")

    def move(self, x, dt):
        return x

    def jacobian(self, x, dt):
        return np.eye(3)

    def noise(self, x, dt):
        return 2.0**-40 * np.eye(3) * dt


@frozen(eq=False)
class Row(Sensor):
    """z = H x + v"""

    H: np.ndarray
    R: float
    kind = "test_row"
    linear = True
    observes = Still.state
    measurement = Space.of(z="m")

    def measure(self, x):
        return x @ self.H.T

    def jacobian(self, x):
        return self.H

    def noise(self, x):
        return np.array([[self.R]])

    def detects(self, x):
        return np.asarray(1.0)

    def clutter(self, z):
        return np.asarray(0.0)


def worst_digit(estimator, ratio):
    """Largest relative error of a covariance after four scans of nearly parallel rows, against rational numbers."""
    P = np.eye(3)
    belief = estimator.start(Gaussian(np.zeros((1, 3)), P[None]), Still.state, RNG)
    exact = rational(P)
    for H in ([1, 1, 1], [1, 1, 1 + 2.0**-18], [1, 1 + 2.0**-18, 1], [1 + 2.0**-17, 1, 1]):
        sensor = Row(np.array([H], float), ratio)
        belief = estimator.predict(belief, 1.0, RNG)
        innovation = estimator.evaluate(belief, sensor, Detections.of([[0.5]]), 1.0)
        belief = estimator.update(belief, innovation, np.array([[0.0, 1.0]]))
        h = rational(sensor.H)
        exact = exact + rational(2.0**-40 * np.eye(3))
        exact = inverse(inverse(exact) + h.T @ h / Fraction(ratio))
    exact, cov = np.array(exact, float), estimator.moments(belief).cov[0]
    assert np.linalg.eigvalsh(exact)[0] > 0
    axes = np.linalg.eigh(exact)[1]
    along = np.sum(axes * (cov @ axes), axis=0) / np.sum(axes * (exact @ axes), axis=0)
    return np.max(np.abs(along - 1))


def test_roots_keep_their_digits_where_covariances_lose_theirs():
    """Noises 1e12 and 7e13 below the prior: a root's covariance is right along every principal axis, the other's is not."""
    assert worst_digit(SquareRootKalman(Still()), 2.0**-40) < 1e-3
    least = 2.0**-46
    assert worst_digit(ExtendedKalman(Still()), least) > 1.0 > 1000 * worst_digit(SquareRootKalman(Still()), least)


@pytest.mark.parametrize("own", [False, True], ids=["sensor's noise", "own noise"])
def test_roots_carry_soft_association_as_covariances_do(own):
    at_start = prior(5, 2, 2)
    motion, sensor = CoordinatedTurn(0.5, 0.01), RangeBearing(10.0, 0.01, detection_probability=0.9)
    rng = np.random.default_rng(3)
    z = sensor.measure(at_start.mean[:, :1, :2]) + rng.normal(size=(2, 4, 2)) * [10, 0.01]
    a = np.diag([9.0, 0.01]) + rng.normal(size=(2, 4, 2, 2)) * [[1.0, 0.001]]
    noise = a @ np.swapaxes(a, -1, -2) if own else None
    detections = Detections(z, np.ones((2, 4), dtype=bool), None, noise)
    ends = []
    for estimator in (ExtendedKalman(motion), SquareRootKalman(motion)):
        belief = estimator.predict(estimator.start(at_start, motion.state, RNG), 2.0, RNG)
        innovation = estimator.evaluate(belief, sensor, detections, 0.99)
        weights = np.exp(innovation.loglik - kernels.log_sum(innovation.loglik)[..., None])
        ends.append((innovation, estimator.moments(estimator.update(belief, innovation, weights))))
    (told, plain), (told_root, root) = ends
    for name in ("loglik", "distance", "log_volume"):
        np.testing.assert_allclose(getattr(told_root, name), getattr(told, name), rtol=1e-9, atol=1e-9)
    np.testing.assert_allclose(root.mean, plain.mean, rtol=1e-9)
    scale = np.sqrt(np.diagonal(plain.cov, axis1=-2, axis2=-1))
    np.testing.assert_allclose(
        root.cov / scale[..., None, :] / scale[..., :, None],
        plain.cov / scale[..., None, :] / scale[..., :, None],
        atol=1e-9,
    )


def test_roots_take_no_tracks_and_no_returns():
    estimator, sensor = SquareRootKalman(CV), CartesianPosition(5.0)
    for t, k in ((0, 0), (0, 3), (2, 0)):
        belief = estimator.predict(estimator.start(prior(4, t), CV.state, RNG), 1.0, RNG)
        innovation = estimator.evaluate(belief, sensor, Detections.of(np.zeros((k, 2)), 2), 0.99)
        assert innovation.loglik.shape == (t, 1 + k)
        assert innovation.log_volume.shape == (t,)
        weights = np.full((t, 1 + k), 1.0 / (1 + k))
        assert estimator.moments(estimator.update(belief, innovation, weights)).cov.shape == (t, 4, 4)


# Mixtures.
@pytest.mark.parametrize(("shape", "k", "posts"), [((1,), 0, 1), ((3,), 1, 1), ((2, 3), 4, 4), ((2, 1), 4, 1)])
def test_the_root_of_a_mixture_has_its_covariance(shape, k, posts):
    rng, n = np.random.default_rng(5), 5
    root, shift = np.tril(rng.normal(size=(*shape, n, n))), rng.normal(size=(*shape, k, n))
    roots, weights = np.tril(rng.normal(size=(*shape, posts, n, n))), rng.dirichlet(np.ones(1 + k), size=shape)
    whole = np.concatenate(
        [root[..., None, :, :], np.broadcast_to(roots, (*shape, posts if posts > 1 else k, n, n))], axis=-3
    )
    at = np.concatenate([np.zeros((*shape, 1, n)), shift], axis=-2)
    mean = np.einsum("...k,...ka->...a", weights, at)
    apart = at - mean[..., None, :]
    second = whole @ np.swapaxes(whole, -1, -2) + apart[..., :, None] * apart[..., None, :]
    cov = np.einsum("...k,...kab->...ab", weights, second)
    for mixed in (mixed_roots, getattr(mixed_roots, "__wrapped__", mixed_roots)):
        found, L = mixed(root, shift, roots, weights)
        np.testing.assert_allclose(found, mean, rtol=1e-12, atol=1e-14)
        np.testing.assert_allclose(L @ np.swapaxes(L, -1, -2), cov, rtol=1e-12, atol=1e-13)
        np.testing.assert_array_equal(np.triu(L, 1), 0.0)
