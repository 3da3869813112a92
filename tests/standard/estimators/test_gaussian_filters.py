"""Kalman, extended and unscented filters: exact where that is defined, safe on circles, consistent on matched truth."""

from fractions import Fraction

import numpy as np
import pytest
from attrs import evolve, frozen
from scipy import stats

from vedette import Detections, Gaussian, MotionModel, Sensor, Space, kernels
from vedette_standard.estimators.extended import ExtendedKalman
from vedette_standard.estimators.kalman import Kalman
from vedette_standard.estimators.unscented import UnscentedKalman
from vedette_standard.motion.constant_velocity import ConstantVelocity
from vedette_standard.motion.coordinated_turn import CoordinatedTurn
from vedette_standard.sensors.cartesian_position import CartesianPosition
from vedette_standard.sensors.range_bearing import RangeBearing

ALL = [Kalman, ExtendedKalman, UnscentedKalman]
RNG = np.random.default_rng(0)
"""Asked for by the signature; these filters draw nothing."""


def space(prefix, n):
    return Space.of(**{f"{prefix}{i}": "m" for i in range(n)})


@frozen(eq=False)
class Linear(MotionModel):
    """x' = (I + A dt) x + w, w ~ N(0, C dt): sums and products of short binary fractions have no rounding."""

    A: np.ndarray
    C: np.ndarray
    kind = "test_linear"
    linear = True

    @property
    def state(self):
        return space("x", len(self.A))

    def jacobian(self, x, dt):
        return np.eye(len(self.A)) + self.A * dt

    def move(self, x, dt):
        return x @ self.jacobian(x, dt).T

    def noise(self, x, dt):
        return self.C * dt


@frozen(eq=False)
class Looking(Sensor):
    """z = H x + v, v ~ N(0, R)"""

    H: np.ndarray
    R: np.ndarray
    p: float = 1.0
    kind = "test_looking"
    linear = True

    @property
    def observes(self):
        return space("x", self.H.shape[1])

    @property
    def measurement(self):
        return space("z", len(self.H))

    def measure(self, x):
        return x @ self.H.T

    def jacobian(self, x):
        return self.H

    def noise(self, x):
        return self.R

    def detects(self, x):
        return np.asarray(self.p)

    def clutter(self, z):
        return np.asarray(0.0)


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


def rational(a):
    return np.vectorize(lambda value: Fraction(float(value)), otypes=[object])(a)


def solve(A, B):
    """A^-1 B and log |A| by elimination, in rational numbers."""
    A, B, log_det = A.copy(), B.copy(), 0.0
    for i in range(len(A)):
        log_det += np.log(float(A[i, i]))
        B[i], A[i] = B[i] / A[i, i], A[i] / A[i, i]
        for j in range(len(A)):
            if j != i:
                B[j], A[j] = B[j] - A[j, i] * B[i], A[j] - A[j, i] * A[i]
    return B, log_det


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
def test_equals_exact_conditioning_of_the_joint_gaussian(kind, seed, spread):
    check_exact(kind, seed, spread)


REAL_ABSORB, REAL_PREDICT, REAL_RETURNS = kernels.weighted_update, kernels.predict, kernels.evaluate_returns


@pytest.mark.parametrize(
    ("name", "mutant"),
    [
        ("weighted_update", lambda x, P, shift, *rest: REAL_ABSORB(x, P, shift + 1e-6, *rest)),
        ("weighted_update", lambda x, P, *rest: (REAL_ABSORB(x, P, *rest)[0], P)),
        ("predict", lambda x, P, F, Q: REAL_PREDICT(x, P, F, 0 * Q)),
        ("predict", lambda x, P, F, Q: REAL_PREDICT(x, P, np.swapaxes(F, -1, -2), Q)),
    ],
    ids=["shifted", "covariance not updated", "no process noise", "F transposed"],
)
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


def start(estimator, *batch, seed=0):
    """Boats 1 km off, some m/s fast."""
    rng = np.random.default_rng(seed)
    n = len(estimator.state)
    mean = np.array([800.0, 500.0, -10.0, 5.0, 0.05])[:n] + rng.normal(size=(*batch, n)) * [30, 30, 3, 3, 0.02][:n]
    a = rng.normal(size=(*batch, n, n)) / 4 + np.eye(n)
    a = np.array([20.0, 20.0, 3.0, 3.0, 0.02])[:n, None] * a
    return estimator.start(Gaussian(mean, a @ np.swapaxes(a, -1, -2)), estimator.state, rng)


POLAR = RangeBearing(10.0, 0.01, detection_probability=0.9, max_range=5000.0, clutter_per_scan=5.0)
BOATS = [
    (Kalman(ConstantVelocity(0.5)), CartesianPosition(5.0, 0.9)),
    (ExtendedKalman(CoordinatedTurn(0.5, 0.01)), POLAR),
    (UnscentedKalman(CoordinatedTurn(0.5, 0.01)), POLAR),
]
named = pytest.mark.parametrize(("estimator", "sensor"), BOATS, ids=["kalman", "ekf", "ukf"])


def returns(sensor, estimator, belief, k, seed=1, own=False):
    """Returns about the first track of each batch entry, (*b, k, m)"""
    rng = np.random.default_rng(seed)
    m = len(sensor.measurement)
    x = belief.mean[..., :1, estimator.state.locate(sensor.observes)]
    x = x + 10 * rng.normal(size=(*x.shape[:-2], k, x.shape[-1]))
    z = sensor.measure(x)
    a = np.sqrt(sensor.noise(x)) @ (np.eye(m) + rng.normal(size=(*z.shape, m)) / 4) if own else None
    noise = None if a is None else a @ np.swapaxes(a, -1, -2)
    return Detections(z, np.ones(z.shape[:-1], dtype=bool), None, noise)


def scan(estimator, belief, sensor, seen, dt=1.5):
    predicted = estimator.predict(belief, dt, RNG)
    innovation = estimator.evaluate(predicted, sensor, seen, 0.99)
    weights = np.exp(innovation.loglik - kernels.log_sum(innovation.loglik)[..., None])
    return predicted, innovation, estimator.update(predicted, innovation, weights)


@named
@pytest.mark.parametrize("own", [False, True], ids=["sensor's noise", "own noise"])
def test_a_batch_is_the_loop_over_its_runs(estimator, sensor, own):
    belief = start(estimator, 3, 2)
    seen = returns(sensor, estimator, belief, 4, own=own)
    predicted, innovation, posterior = scan(estimator, belief, sensor, seen)
    for i in range(3):
        alone = Detections(seen.z[i], seen.valid[i], None, seen.noise[i] if own else None)
        one, told, after = scan(estimator, Gaussian(belief.mean[i], belief.cov[i]), sensor, alone)
        for batched, single in ((predicted, one), (posterior, after)):
            np.testing.assert_allclose(batched.mean[i], single.mean, rtol=1e-12, atol=1e-12)
            np.testing.assert_allclose(batched.cov[i], single.cov, rtol=1e-12, atol=1e-10)
        for name in ("loglik", "distance", "log_volume", "nis"):
            np.testing.assert_allclose(getattr(innovation, name)[i], getattr(told, name), rtol=1e-12, atol=1e-12)


@named
@pytest.mark.parametrize("batch", [(0,), (1,), (2, 0), (2, 3)])
@pytest.mark.parametrize("k", [0, 2])
@pytest.mark.parametrize("own", [False, True])
def test_no_tracks_and_no_returns_are_no_special_case(estimator, sensor, batch, k, own):
    belief = start(estimator, *batch)
    m = len(sensor.measurement)
    z = np.full((*batch[:-1], k, m), 0.5)
    noise = np.broadcast_to(np.eye(m), (*z.shape, m)) if own else None
    detections = Detections(z, np.ones(z.shape[:-1], dtype=bool), None, noise)
    predicted, innovation, posterior = scan(estimator, belief, sensor, detections)
    assert innovation.loglik.shape == (*batch, 1 + k)
    assert innovation.distance.shape == innovation.nis.shape == (*batch, k)
    assert innovation.log_volume.shape == batch
    assert posterior.mean.shape == belief.mean.shape
    if k == 0:
        np.testing.assert_array_equal(posterior.mean, predicted.mean)
        np.testing.assert_array_equal(posterior.cov, predicted.cov)


@named
def test_a_miss_leaves_the_prediction_and_no_time_leaves_the_belief(estimator, sensor):
    belief = start(estimator, 2)
    assert estimator.predict(belief, 0.0, RNG) is belief
    predicted, innovation, _ = scan(estimator, belief, sensor, returns(sensor, estimator, belief, 2))
    missed = estimator.update(predicted, innovation, np.array([[1.0, 0.0, 0.0]] * 2))
    np.testing.assert_array_equal(missed.mean, predicted.mean)
    np.testing.assert_array_equal(missed.cov, predicted.cov)


@named
def test_detection_probability_enters_every_column(estimator, sensor):
    belief = start(estimator, 2)
    seen = returns(sensor, estimator, belief, 3)
    likely = estimator.evaluate(belief, sensor, seen, 0.99).loglik
    rarely = estimator.evaluate(belief, evolve(sensor, detection_probability=0.3), seen, 0.99).loglik
    np.testing.assert_allclose(likely[:, 0], np.log(1 - 0.9 * 0.99), rtol=1e-12)
    np.testing.assert_allclose(rarely[:, 0], np.log(1 - 0.3 * 0.99), rtol=1e-12)
    np.testing.assert_allclose(likely[:, 1:] - rarely[:, 1:], np.log(3.0), rtol=1e-12)
    certain = estimator.evaluate(belief, evolve(sensor, detection_probability=1.0), seen, 1.0).loglik
    assert np.all(np.isfinite(certain))


@named
def test_a_returns_own_noise_is_used(estimator, sensor):
    """Twice the sensor's noise on each return is the same as a sensor with twice the noise."""
    belief = start(estimator, 2)
    seen = returns(sensor, estimator, belief, 3)
    name = "sigma" if isinstance(sensor, CartesianPosition) else "sigma_range"
    worse = evolve(sensor, **{name: 2.0 * getattr(sensor, name)})
    noise = np.broadcast_to(worse.noise(belief.mean), (3, 2, 2))
    one = scan(estimator, belief, sensor, Detections(seen.z, seen.valid, None, noise))
    other = scan(estimator, belief, worse, seen)
    np.testing.assert_allclose(one[1].loglik, other[1].loglik, rtol=1e-12)
    np.testing.assert_allclose(one[2].cov, other[2].cov, rtol=1e-12, atol=1e-10)


def turned(angle, belief):
    c, s = np.cos(angle), np.sin(angle)
    T = np.eye(belief.mean.shape[-1])
    T[:2, :2] = T[2:4, 2:4] = [[c, -s], [s, c]]
    return Gaussian(belief.mean @ T.T, T @ belief.cov @ T.T), T


def check_turned(estimator, angle):
    """Five scans of a wide bearing sensor in a frame that is turned, turned back."""
    sensor = RangeBearing(10.0, 0.05)
    ahead = turned(-np.arctan2(500.0, 800.0), start(estimator, 1))[0]  # about bearing 0

    def walk(by):
        belief, T = turned(by, ahead)
        rng = np.random.default_rng(4)
        for _ in range(5):
            belief = estimator.predict(belief, 2.0, RNG)
            x = ahead.mean[..., :2] @ T[:2, :2].T
            z = sensor.measurement.displace(sensor.measure(x), rng.normal(size=(1, 2)) * [10, 0.1])
            innovation = estimator.evaluate(belief, sensor, Detections.of(z), 1.0)
            belief = estimator.update(belief, innovation, np.array([[0.0, 1.0]]))
        return turned(-by, belief)[0]

    straight, around = walk(0.0), walk(angle)
    np.testing.assert_allclose(around.mean, straight.mean, rtol=1e-9, atol=1e-9)
    np.testing.assert_allclose(around.cov, straight.cov, rtol=1e-9, atol=1e-7)


NONLINEAR = [ExtendedKalman(CoordinatedTurn(0.5, 0.01)), UnscentedKalman(CoordinatedTurn(0.5, 0.01))]


TURNS = [(NONLINEAR[0], np.pi - 0.03), (NONLINEAR[0], np.pi), (NONLINEAR[0], 2.0), (NONLINEAR[1], np.pi)]


@pytest.mark.parametrize(("estimator", "angle"), TURNS)
def test_the_cut_of_the_bearing_is_a_direction_like_any_other(estimator, angle):
    """A half turn maps the points of the UKF onto each other; by other angles they differ, as Cholesky's factor does."""
    check_turned(estimator, angle)


def plain_mean(self, points, weights):
    mean = (weights[..., None, :] @ points)[..., 0, :]
    return mean, points - mean[..., None, :]


@pytest.mark.parametrize(
    ("estimator", "where", "name", "mutant"),
    [
        (NONLINEAR[0], kernels, "evaluate_returns", lambda *given: REAL_RETURNS(*given[:-1], ())),
        (NONLINEAR[1], Space, "difference", lambda self, a, b: a - b),
        (NONLINEAR[1], Space, "mean", plain_mean),
    ],
    ids=["ekf unwrapped residual", "ukf unwrapped residual", "ukf plain mean"],
)
def test_the_turned_frame_bites(monkeypatch, estimator, where, name, mutant):
    monkeypatch.setattr(where, name, mutant)
    with pytest.raises(AssertionError):
        check_turned(estimator, np.pi)


@frozen(eq=False)
class Drifting(MotionModel):
    """One axis with noise, and a zero_variance one that counts the time."""

    kind = "test_drifting"

    @property
    def state(self):
        return Space.of(clock="s", x="m", v="m/s")

    @property
    def zero_variance(self):
        return Space.of(clock="s")

    def move(self, x, dt):
        return x + dt * np.stack([np.ones(x.shape[:-1]), x[..., 2], np.zeros(x.shape[:-1])], axis=-1)

    def noise(self, x, dt):
        return np.diag([0.0, 0.0, 1.0]) * dt


class AlongX(Looking):
    @property
    def observes(self):
        return Space.of(x="m")


@pytest.mark.parametrize("kind", [ExtendedKalman, UnscentedKalman])
def test_carried_axes_have_no_variance_and_are_moved_by_the_model(kind):
    estimator, sensor = kind(Drifting()), AlongX(np.eye(1), np.eye(1))
    belief = estimator.start(Gaussian(np.array([[5.0, 0.0, 1.0]]), np.ones((1, 3, 3)) + np.eye(3)), estimator.state, RNG)
    for _ in range(3):
        belief = estimator.predict(belief, 0.5, RNG)
        innovation = estimator.evaluate(belief, sensor, Detections.of([[1.0]]), 1.0)
        belief = estimator.update(belief, innovation, np.array([[0.0, 1.0]]))
    np.testing.assert_allclose(belief.mean[0, 0], 6.5, rtol=1e-12)
    assert np.all(belief.cov[0, 0] == 0.0)
    assert np.all(belief.cov[0, :, 0] == 0.0)
    assert np.linalg.eigvalsh(belief.cov[0, 1:, 1:])[0] > 0


def test_ukf_takes_an_axis_that_is_known_exactly():
    """A prior may say that a target does not turn yet; the rate then gets its variance from the motion's noise."""
    estimator = UnscentedKalman(CoordinatedTurn(0.5, 0.01))
    known = estimator.start(
        Gaussian(np.array([[800.0, 500.0, -10.0, 5.0, 0.0]]), np.diag([400.0, 400.0, 9.0, 9.0, 0.0])[None]),
        estimator.state,
        RNG,
    )
    nearly = Gaussian(known.mean, known.cov + np.diag([0, 0, 0, 0, 1e-12]))
    seen = returns(POLAR, estimator, known, 1)
    for one, other in zip(scan(estimator, known, POLAR, seen), scan(estimator, nearly, POLAR, seen), strict=True):
        if isinstance(one, Gaussian):
            np.testing.assert_allclose(one.mean, other.mean, rtol=1e-6, atol=1e-9)
            np.testing.assert_allclose(one.cov, other.cov, rtol=1e-5, atol=1e-5)


def test_kalman_refuses_what_is_not_linear():
    with pytest.raises(ValueError, match="'coordinated_turn' is not linear: use the estimator 'ekf' or 'ukf'"):
        Kalman(CoordinatedTurn(0.5, 0.01))
    assert "'range_bearing'" in Kalman(ConstantVelocity(1.0)).refuses(POLAR)
    assert Kalman(ConstantVelocity(1.0)).refuses(CartesianPosition(1.0)) is None
    assert ExtendedKalman(ConstantVelocity(1.0)).refuses(POLAR) is None


def drawn(motion, prior, sensor, runs, scans, dt, seed):
    """Truth (scans, runs, 1, n) and returns (scans, runs, 1, m) from the models themselves, all runs at once."""
    rng = np.random.default_rng(seed)
    x = rng.multivariate_normal(prior.mean, prior.cov, size=(runs, 1))
    R = np.linalg.cholesky(sensor.noise(x))
    truth, seen = [], []
    for _ in range(scans):
        L = np.linalg.cholesky(motion.noise(x, dt))
        x = motion.move(x, dt) + (L @ rng.normal(size=(*x.shape, 1)))[..., 0]
        z = sensor.measure(x[..., sensor_axes(motion, sensor)])
        seen.append(sensor.measurement.displace(z, (R @ rng.normal(size=(*z.shape, 1)))[..., 0]))
        truth.append(x)
    return truth, seen


def sensor_axes(motion, sensor):
    return motion.state.locate(sensor.observes)


def consistency(estimator, prior, sensor, truth, seen, dt):
    """NEES and NIS (scans, runs)"""
    runs, n = truth[0].shape[0], len(estimator.state)
    at_start = Gaussian(np.broadcast_to(prior.mean, (runs, 1, n)), np.broadcast_to(prior.cov, (runs, 1, n, n)))
    belief = estimator.start(at_start, estimator.state, RNG)
    nees, nis = [], []
    for x, z in zip(truth, seen, strict=True):
        belief = estimator.predict(belief, dt, RNG)
        innovation = estimator.evaluate(belief, sensor, Detections(z, np.ones((runs, 1), bool)), 1.0)
        belief = estimator.update(belief, innovation, np.broadcast_to([0.0, 1.0], (runs, 1, 2)))
        error = estimator.state.difference(x, belief.mean)
        nees.append((error[..., None, :] @ np.linalg.solve(belief.cov, error[..., None]))[:, 0, 0, 0])
        nis.append(innovation.nis[:, 0, 0])
    return np.array(nees), np.array(nis)


def in_band(total, freedom, alpha=1e-7):
    """Whether a sum of squares lies in chi-square's two-sided band."""
    return stats.chi2.ppf(alpha / 2, freedom) < total < stats.chi2.isf(alpha / 2, freedom)


CV_PRIOR = Gaussian(np.array([800.0, 500.0, -10.0, 5.0]), np.diag([400.0, 400.0, 25.0, 25.0]))


@pytest.mark.parametrize(
    ("sigma_accel", "sigma", "consistent"),
    [(0.5, 10.0, True), (0.4, 10.0, False), (0.5, 9.5, False), (0.5, 10.5, False)],
    ids=["matched", "too little process noise", "too little measurement noise", "too much"],
)
def test_kalman_nees_and_nis_lie_in_their_bands_on_matched_truth(sigma_accel, sigma, consistent):
    """500 runs of 40 scans. NEES at the last scan ~ chi2(500 n), NIS over all ~ chi2(20000 m); false alarms 2e-7 in all."""
    motion, sensor = ConstantVelocity(0.5), CartesianPosition(10.0)
    truth, seen = drawn(motion, CV_PRIOR, sensor, 500, 40, 2.0, seed=1)
    told = Kalman(ConstantVelocity(sigma_accel))
    nees, nis = consistency(told, CV_PRIOR, CartesianPosition(sigma), truth, seen, 2.0)
    assert (in_band(nees[-1].sum(), nees[-1].size * 4) and in_band(nis.sum(), nis.size * 2)) == consistent


def within_a_tenth(values, freedom):
    """Whether the mean of `values` (scans, runs) over `freedom` lies in .9 to 1.1 by all of 5.2 of its standard errors.

    The run is the unit: values within one are not independent. A mean outside passes once in 1e7.
    """
    of_runs = values.mean(axis=0) / freedom
    margin = 5.2 * of_runs.std(ddof=1) / np.sqrt(of_runs.size)
    return margin < 0.05 and 0.9 + margin < of_runs.mean() < 1.1 - margin


@pytest.mark.parametrize("kind", [ExtendedKalman, UnscentedKalman])
@pytest.mark.parametrize(("sigma_bearing", "consistent"), [(0.01, True), (0.0085, False)], ids=["matched", "too sure"])
def test_nonlinear_filters_are_consistent_on_a_mild_problem(kind, sigma_bearing, consistent):
    """A boat 1 km from a radar of 10 m and 0.6 deg, turning a little; 3000 runs of 25 scans, standard errors below .006.

    By normal theory the matched case fails less than once in 1e12 while the filter's own mean is within .98 to 1.02.
    """
    motion, sensor = CoordinatedTurn(0.3, 0.003), RangeBearing(10.0, 0.01)
    prior = Gaussian(np.append(CV_PRIOR.mean, 0.02), np.diag([400.0, 400.0, 25.0, 25.0, 1e-4]))
    truth, seen = drawn(motion, prior, sensor, 3000, 25, 2.0, seed=2)
    nees, nis = consistency(kind(motion), prior, RangeBearing(10.0, sigma_bearing), truth, seen, 2.0)
    assert (within_a_tenth(nees, 5) and within_a_tenth(nis, 2)) == consistent
