"""Iterated, cubature, square-root and Gaussian-sum filters: equal where they must be, better where they should be."""

from fractions import Fraction

import numpy as np
import pytest
from attrs import evolve, frozen

from vedette import Detections, Gaussian, MotionModel, Sensor, Space, kernels
from vedette_standard.estimators.cubature import CubatureKalman
from vedette_standard.estimators.extended import ExtendedKalman
from vedette_standard.estimators.gaussian_sum import GaussianSum
from vedette_standard.estimators.imm import Imm
from vedette_standard.estimators.iterated import IteratedExtendedKalman
from vedette_standard.estimators.kalman import Kalman
from vedette_standard.estimators.square_root import SquareRootKalman
from vedette_standard.estimators.unscented import UnscentedKalman
from vedette_standard.motion.constant_velocity import ConstantVelocity
from vedette_standard.motion.coordinated_turn import CoordinatedTurn
from vedette_standard.sensors.bearing_only import BearingOnly
from vedette_standard.sensors.cartesian_position import CartesianPosition
from vedette_standard.sensors.range_bearing import RangeBearing

RNG = np.random.default_rng(0)
"""Asked for by the signature; these filters draw nothing."""

CV = ConstantVelocity(0.5)
KINDS = [
    ExtendedKalman(CV),
    UnscentedKalman(CV),
    UnscentedKalman(CV, 0.3),
    CubatureKalman(CV),
    SquareRootKalman(CV),
    *(IteratedExtendedKalman(CV, passes) for passes in (1, 2, 7)),
]


def prior(n, *batch, seed=0):
    rng = np.random.default_rng(seed)
    scale = np.array([20.0, 20.0, 3.0, 3.0, 0.02])[:n]
    mean = np.array([800.0, 500.0, -10.0, 5.0, 0.05])[:n] + rng.normal(size=(*batch, n)) * scale
    a = scale[:, None] * (rng.normal(size=(*batch, n, n)) / 4 + np.eye(n))
    return Gaussian(mean, a @ np.swapaxes(a, -1, -2))


def walk(estimator, sensor, at_start, weights=None, scans=6):
    """Moments and log likelihoods over some scans of three returns, softly associated."""
    rng = np.random.default_rng(5)
    belief = estimator.start(at_start, estimator.state, RNG)
    told = []
    for _ in range(scans):
        belief = estimator.predict(belief, 1.5, RNG)
        where = CV.state.locate(sensor.observes)
        z = sensor.measure(at_start.mean[:1, where] + 10 * rng.normal(size=(3, len(where))))
        innovation = estimator.evaluate(belief, sensor, Detections.of(z), 0.99)
        w = rng.random(innovation.loglik.shape)
        belief = estimator.update(belief, innovation, w / w.sum(axis=-1, keepdims=True))
        moments = estimator.moments(belief)
        told.append((moments.mean, moments.cov, innovation.loglik, innovation.distance, innovation.log_volume))
    return [np.stack(part) for part in zip(*told, strict=True)]


@pytest.mark.parametrize("estimator", KINDS, ids=lambda e: f"{e.kind}{getattr(e, 'passes', '')}")
def test_all_are_the_kalman_filter_on_a_linear_problem(estimator):
    at_start = prior(4, 2)
    sensor = CartesianPosition(5.0, 0.9)
    exact = walk(Kalman(CV), sensor, at_start)
    deviation = np.sqrt(np.diagonal(exact[1], axis1=-2, axis2=-1))
    found = walk(estimator, sensor, at_start)
    np.testing.assert_allclose((found[0] - exact[0]) / deviation, 0, atol=1e-9)
    np.testing.assert_allclose((found[1] - exact[1]) / (deviation[..., :, None] * deviation[..., None, :]), 0, atol=1e-9)
    for one, other in zip(found[2:], exact[2:], strict=True):
        np.testing.assert_allclose(one, other, rtol=1e-9, atol=1e-9)


def test_the_comparison_bites(monkeypatch):
    estimator, update = IteratedExtendedKalman(CV), kernels.weighted_update
    at_start, sensor = prior(4, 2), CartesianPosition(5.0, 0.9)
    exact = walk(Kalman(CV), sensor, at_start)[0]
    monkeypatch.setattr(kernels, "weighted_update", lambda x, P, shift, *rest: update(x, P, (1 + 1e-7) * shift, *rest))
    with pytest.raises(AssertionError):
        np.testing.assert_allclose(walk(estimator, sensor, at_start)[0], exact, rtol=0, atol=1e-9)


# Iteration.


def sharp_update(estimator, sensor, z):
    at_start = Gaussian(np.array([[100.0, 0.0, 0.0, 0.0]]), np.diag([900.0, 900.0, 1.0, 1.0])[None])
    belief = estimator.start(at_start, CV.state, RNG)
    innovation = estimator.evaluate(belief, sensor, Detections.of([z]), 1.0)
    weights = np.array([[0.0, 1.0]])
    return at_start, estimator.moments(estimator.update(belief, innovation, weights)), innovation


def objective(at_start, sensor, z, x):
    left = sensor.measurement.difference(np.array(z), sensor.measure(x[..., :2]))
    apart = x - at_start.mean[0]
    return left @ np.linalg.solve(sensor.noise(x), left) + apart @ np.linalg.solve(at_start.cov[0], apart)


def test_iteration_finds_the_mode_of_the_posterior():
    """A sharp range on a wide prior: the gradient of the posterior's logarithm vanishes at the estimate."""
    sensor, z = RangeBearing(0.5, 0.01), [140.0, 0.4]
    at_start, found, _ = sharp_update(IteratedExtendedKalman(CV, 30), sensor, z)
    x = found.mean[0]

    def gradient(y):
        return np.array(
            [
                (objective(at_start, sensor, z, y + e) - objective(at_start, sensor, z, y - e)) / 2e-4
                for e in 1e-4 * np.eye(4)
            ]
        )

    spread = np.sqrt(np.diag(found.cov[0]))
    assert np.max(np.abs(gradient(x) * spread)) < 1e-4
    once = sharp_update(IteratedExtendedKalman(CV, 1), sensor, z)[1]
    assert np.max(np.abs(gradient(once.mean[0]) * spread)) > 1.0
    np.testing.assert_allclose(once.mean, sharp_update(ExtendedKalman(CV), sensor, z)[1].mean, rtol=1e-13)


def test_more_passes_never_raise_the_cost():
    """What is far off, behind or on top of the sensor, among them."""
    for place in ([140.0, 0.4], [5.0, 3.0], [400.0, -3.1], [0.001, 1.0], [100.0, 3.14]):
        sensor = RangeBearing(0.5, 0.01)
        costs = []
        for passes in (1, 2, 3, 5, 20):
            at_start, found, _ = sharp_update(IteratedExtendedKalman(CV, passes), sensor, place)
            assert np.all(np.isfinite(found.mean))
            assert np.linalg.eigvalsh(found.cov[0])[0] > 0
            costs.append(objective(at_start, sensor, place, found.mean[0]))
        assert np.all(np.diff(costs) <= 1e-9 * np.array(costs[:-1]))


def test_iteration_approximates_the_evidence():
    """The likelihood of a return, against quadrature over the prior; the extended filter misses it by far."""
    sensor, z = RangeBearing(2.0, 0.02), [135.0, 1.2]
    cell = 0.25
    x, y = np.meshgrid(np.arange(-60, 220, cell), np.arange(-60, 220, cell), indexing="ij")
    left = sensor.measurement.difference(np.array(z), sensor.measure(np.stack([x, y], axis=-1)))
    R = np.diag(sensor.noise(np.zeros(2)))
    log_p = -0.5 * np.sum(left**2 / R, axis=-1) - 0.5 * ((x - 100) ** 2 + y**2) / 900
    evidence = np.log(np.sum(np.exp(log_p)) * cell**2) - np.log((2 * np.pi) ** 2 * np.sqrt(np.prod(R)) * 900)
    iterated = sharp_update(IteratedExtendedKalman(CV, 20), sensor, z)[2].loglik[0, 1]
    extended = sharp_update(ExtendedKalman(CV), sensor, z)[2].loglik[0, 1]
    assert abs(iterated - evidence) < 0.1
    assert abs(extended - evidence) > 1.0


# Digits.


def rational(a):
    return np.vectorize(lambda value: Fraction(float(value)), otypes=[object])(np.asarray(a))


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


# Sums.


def test_a_prior_is_split_without_a_change_of_its_moments():
    at_start = prior(4, 3)
    for axis in ("", "x", "vy"):
        estimator = GaussianSum(ExtendedKalman(CV), parts=5, share=0.7, axis=axis)
        belief = estimator.start(at_start, CV.state, RNG)
        found = estimator.moments(belief)
        np.testing.assert_allclose(found.mean, at_start.mean, rtol=1e-12)
        np.testing.assert_allclose(found.cov, at_start.cov, rtol=1e-9, atol=1e-9)
        assert all(np.all(np.linalg.eigvalsh(part.cov) > 0) for part in belief.beliefs)


def test_a_split_has_the_normals_higher_moments():
    """Along the axis, up to order 2 parts - 1: a standard normal's are 1, 3, 15, 105 for 2, 4, 6, 8."""
    estimator = GaussianSum(Kalman(CV), parts=5, share=0.6, axis="x")
    belief = estimator.start(Gaussian(np.zeros((1, 4)), np.eye(4)[None]), CV.state, RNG)
    w = estimator.mode_prob(belief)[0]
    nodes, weights = np.polynomial.hermite_e.hermegauss(12)
    weights = weights / np.sum(weights)
    for order, expected in ((2, 1), (4, 3), (6, 15), (8, 105)):
        each = [np.sum(weights * (part.mean[0, 0] + np.sqrt(part.cov[0, 0, 0]) * nodes) ** order) for part in belief.beliefs]
        assert w @ each == pytest.approx(expected, rel=1e-9)


def test_parts_never_switch_and_follow_bayes():
    estimator = GaussianSum(Kalman(CV), parts=4, axis="x")
    one = Kalman(CV)
    at_start, sensor = prior(4, 1), CartesianPosition(5.0)
    belief = estimator.start(at_start, CV.state, RNG)
    parts, log_w = list(belief.beliefs), np.log(estimator.mode_prob(belief)[0])
    for z in ([790.0, 505.0], [770.0, 515.0]):
        belief = estimator.predict(belief, 2.0, RNG)
        innovation = estimator.evaluate(belief, sensor, Detections.of([z]), 1.0)
        belief = estimator.update(belief, innovation, np.array([[0.0, 1.0]]))
        parts = [one.predict(part, 2.0, RNG) for part in parts]
        told = [one.evaluate(part, sensor, Detections.of([z]), 1.0) for part in parts]
        log_w = log_w + [each.loglik[0, 1] for each in told]
        parts = [one.update(part, each, np.array([[0.0, 1.0]])) for part, each in zip(parts, told, strict=True)]
    np.testing.assert_allclose(estimator.mode_prob(belief)[0], np.exp(log_w - kernels.log_sum(log_w)), rtol=1e-9)
    for part, alone in zip(belief.beliefs, parts, strict=True):
        np.testing.assert_allclose(part.mean, alone.mean, rtol=1e-10)
        np.testing.assert_allclose(part.cov, alone.cov, rtol=1e-9)


def test_a_sum_holds_the_range_behind_a_bearing():
    """Bearings from two places, range unknown from 200 m to 4 km: mean error of the sum against the extended filter's.

    100 geometries, the same for both; the ratio is 0.3 with a standard error of about 0.05.
    """
    rng = np.random.default_rng(6)
    runs = 100
    r = rng.uniform(400, 3600, runs)
    truth = np.stack([r, np.zeros(runs), np.zeros(runs), np.zeros(runs)], axis=-1)
    wide = Gaussian(
        np.broadcast_to([2000.0, 0, 0, 0], (runs, 1, 4)),
        np.broadcast_to(np.diag([900.0**2, 40.0**2, 0.01, 0.01]), (runs, 1, 4, 4)),
    )
    motion = ConstantVelocity(1e-3)
    errors = {}
    for estimator in (ExtendedKalman(motion), GaussianSum(ExtendedKalman(motion), parts=11, share=0.95)):
        noise = np.random.default_rng(7)
        belief = estimator.start(wide, motion.state, RNG)
        for y in np.linspace(0, 300, 7):
            sensor = BearingOnly(0.01, y=-y)
            z = sensor.measure(truth[:, None, :2]) + 0.01 * noise.normal(size=(runs, 1, 1))
            belief = estimator.predict(belief, 1.0, RNG)
            innovation = estimator.evaluate(belief, sensor, Detections(z, np.ones((runs, 1), bool)), 1.0)
            belief = estimator.update(belief, innovation, np.broadcast_to([0.0, 1.0], (runs, 1, 2)))
        errors[estimator.kind] = np.sqrt(np.mean((estimator.moments(belief).mean[:, 0, 0] - r) ** 2))
    assert errors["gaussian_sum"] < 0.7 * errors["ekf"]


@pytest.mark.parametrize("axis", ["z", "turn"])
def test_a_sum_names_an_axis_that_is_there(axis):
    with pytest.raises(ValueError, match="axis: must be one of x, y, vx, vy"):
        GaussianSum(Kalman(CV), axis=axis)


# In mixtures.


@pytest.mark.parametrize("mode", [IteratedExtendedKalman, CubatureKalman, SquareRootKalman], ids=lambda kind: kind.kind)
def test_an_imm_over_any_of_them_is_the_imm_over_kalman_filters(mode):
    models = (ConstantVelocity(0.1), ConstantVelocity(2.0))
    chain = np.array([[0.95, 0.05], [0.1, 0.9]])
    at_start, sensor = prior(4, 2), CartesianPosition(5.0, 0.9)
    exact, found = (walk(Imm(tuple(kind(m) for m in models), chain), sensor, at_start) for kind in (Kalman, mode))
    for one, other in zip(found, exact, strict=True):
        np.testing.assert_allclose(one, other, rtol=1e-8, atol=1e-8)


@pytest.mark.parametrize("estimator", KINDS[3:6], ids=lambda e: e.kind)
def test_the_detection_probability_enters_every_column(estimator):
    at_start, sensor = prior(4, 2), RangeBearing(10.0, 0.01, detection_probability=0.9)
    belief = estimator.start(at_start, CV.state, RNG)
    detections = Detections.of(sensor.measure(at_start.mean[:, :2]))
    likely = estimator.evaluate(belief, sensor, detections, 0.99).loglik
    rarely = estimator.evaluate(belief, evolve(sensor, detection_probability=0.3), detections, 0.99).loglik
    np.testing.assert_allclose(likely[:, 0], np.log(1 - 0.9 * 0.99), rtol=1e-12)
    np.testing.assert_allclose(likely[:, 1:] - rarely[:, 1:], np.log(3.0), rtol=1e-12)
