"""Smoothing keeps what tracks are, turns with angles, takes noiseless models and other filters, and says what it cannot."""

import itertools
import math

import numpy as np
import pytest
from attrs import evolve, frozen
from scipy import stats

from support.models import Linear, Looking
from support.smoothing import RADAR, TURN, conditioned, estimates, random_problem, states_of, tracker_of, turning
from vedette import Associator, Detections, Gaussian, MotionModel, Scan, Sensor, Space, Tracker
from vedette.errors import ConfigError
from vedette.filters import OverMotion
from vedette.tracking import pytrees
from vedette.tracking.smoothing import check_smoothing, smooth, smoothed
from vedette_standard.associators.pda import Pda
from vedette_standard.births.from_returns import FromReturns
from vedette_standard.estimators.bootstrap import BootstrapParticles
from vedette_standard.estimators.extended import ExtendedKalman
from vedette_standard.estimators.imm import Imm
from vedette_standard.estimators.kalman import Kalman
from vedette_standard.estimators.square_root import SquareRootKalman
from vedette_standard.estimators.unscented import UnscentedKalman
from vedette_standard.lifecycles.m_of_n import MOfN
from vedette_standard.motion.constant_velocity import ConstantVelocity
from vedette_standard.sensors.cartesian_position import CartesianPosition

UNLIKE = Imm(
    (ExtendedKalman(ConstantVelocity(0.2)), UnscentedKalman(TURN)),
    transition=[[0.9, 0.1], [0.2, 0.8]],
    absent={"turn_rate": (0.0, 0.02)},
)


@pytest.mark.parametrize("estimator", [ExtendedKalman(TURN), UnscentedKalman(TURN), UNLIKE], ids=lambda e: e.kind)
def test_runs_in_lock_step_are_those_runs_alone(estimator):
    _, scans, prior = turning(np.random.default_rng(1), 3, 12)
    tracker = tracker_of(estimator, {"radar": RADAR}, Pda())
    means, covs = estimates(tracker, smoothed(tracker, states_of(tracker, prior, scans, -1.0), 9.0))
    assert np.isfinite(means).all()
    assert np.linalg.eigvalsh(covs).min() > 0
    for run in range(3):
        own = [evolve(scan, detections=pytrees.take(scan.detections, run, 0)) for scan in scans]
        alone = states_of(tracker, Gaussian(prior.mean[run], prior.cov[run]), own, -1.0)
        mean, cov = estimates(tracker, smoothed(tracker, alone, 9.0))
        np.testing.assert_allclose(means[:, run], mean, rtol=1e-12, atol=1e-10)
        np.testing.assert_allclose(covs[:, run], cov, rtol=1e-10, atol=1e-10)


POSITION = Looking(np.array([[1.0, 0.0]]), np.eye(1))


@pytest.mark.parametrize("kind", [ExtendedKalman, UnscentedKalman])
def test_on_a_mildly_nonlinear_problem_errors_are_as_large_as_said(kind):
    """NEES over runs at one time in the middle: chi-square's band at 1e-6, widened by a tenth for what is not linear."""
    runs = 400
    truth, scans, prior = turning(np.random.default_rng(6), runs, 13)
    scans = [evolve(scan, detections=Detections(scan.detections.z[:, :1], scan.detections.valid[:, :1])) for scan in scans]
    tracker = tracker_of(kind(TURN), {"radar": RADAR}, FirstOfEach())
    states = states_of(tracker, prior, scans, -1.0)
    mean, cov = estimates(tracker, smoothed(tracker, states))
    k = 6
    error = mean[k + 1, :, 0] - truth[:, k]
    nees = np.sum(error * np.linalg.solve(cov[k + 1, :, 0], error[..., None])[..., 0], -1)
    low, high = stats.chi2.ppf([5e-7, 1 - 5e-7], 5 * runs) / (5 * runs)
    assert 0.9 * low < np.mean(nees) / 5 < 1.1 * high


@frozen
class FirstOfEach(Associator):
    """The first return where it is valid, else the miss."""

    kind = "test_first"

    def associate(self, scores, evidence):
        seen = np.isfinite(scores[..., 1])
        return np.stack([~seen, seen], axis=-1).astype(float)


def test_tracks_keep_all_but_their_estimates_and_end_and_begin_where_they_did():
    """Two ships far apart, one of which comes late and leaves early, and clutter that starts tracks."""
    rng = np.random.default_rng(7)
    sensor = CartesianPosition(sigma=2.0, detection_probability=0.9, clutter_density=1e-7)
    tracker = Tracker(
        Kalman(ConstantVelocity(0.3)),
        {"radar": sensor},
        Pda(),
        MOfN(hits=2, looks=3, misses=2),
        FromReturns(spread={"vx": 5.0, "vy": 5.0}),
    )
    state, states, scans = tracker.start(), [], []
    for k in range(20):
        ships = [[10.0 + 4.0 * k, 5.0]] + ([[5000.0, 3.0 * k]] if 4 <= k < 12 else [])
        clutter = rng.uniform(-2e4, 2e4, size=(1, 2))
        scans.append(
            Scan(
                float(k),
                "radar",
                Detections.of(np.concatenate([ships + 2.0 * rng.standard_normal((len(ships), 2)), clutter])),
            )
        )
        state = tracker.step(state, scans[-1])
        states.append(state)
    assert any(set(one.ids) - set(other.ids) for one, other in itertools.pairwise(states))
    filtered = smooth(tracker, states, 0.0)
    found = smooth(tracker, states)
    assert [track.id for track in found] == [track.id for track in filtered]
    assert len(found) == 2
    assert len(found[1].times) < len(found[0].times) == 20
    for one, other in zip(found, filtered, strict=True):
        for name in ("times", "confirmed", "existence", "nis", "hit"):
            np.testing.assert_array_equal(getattr(one, name), getattr(other, name))
        for weights, same in zip(one.weights, other.weights, strict=True):
            np.testing.assert_array_equal(weights, same)
        np.testing.assert_array_equal(one.mean[-1], other.mean[-1])
        assert np.all(np.any(one.mean[:-3] != other.mean[:-3], axis=1))
        # The same track smoothed as if there were no other.
        alone = [
            evolve(
                each,
                **{
                    name: pytrees.take(getattr(each, name), each.ids == one.id, 0)
                    for name in ("belief", "memory", "ids", "existence", "confirmed", "weights", "distances")
                },
            )
            for each in states
            if one.id in each.ids
        ]
        own = smooth(tracker, alone)[0]
        np.testing.assert_allclose(own.mean, one.mean, rtol=1e-12)
        np.testing.assert_allclose(own.cov, one.cov, rtol=1e-12, atol=1e-12)


@frozen
class Heading(MotionModel):
    """A heading that wanders, and a mark that is zero_variance: it turns by .1 rad/s without noise."""

    kind = "test_heading"
    state = Space.of(heading="rad mod 2pi", mark="rad mod 2pi")
    zero_variance = Space.of(mark="rad mod 2pi")

    def move(self, x, dt):
        return self.state.displace(x, np.array([0.0, 0.1 * dt]))

    def noise(self, x, dt):
        return np.diag([0.01 * dt, 0.0])


@frozen
class Compass(Sensor):
    """The heading."""

    kind = "test_compass"
    observes = Space.of(heading="rad mod 2pi")
    measurement = Space.of(compass="rad mod 2pi")

    def measure(self, x):
        return x

    def noise(self, x):
        return 0.05 * np.eye(1)

    def detects(self, x):
        return np.asarray(0.9)

    def clutter(self, z):
        return np.asarray(0.01)


@pytest.mark.parametrize(
    "estimator",
    [
        ExtendedKalman(Heading()),
        UnscentedKalman(Heading()),
        Imm((ExtendedKalman(Heading()), UnscentedKalman(Heading())), transition=[[0.9, 0.1], [0.1, 0.9]]),
    ],
    ids=lambda e: e.kind,
)
def test_a_turn_of_all_angles_turns_the_result_and_carried_axes_stay(estimator):
    def run(turn):
        given = Gaussian(estimator.state.displace(np.array([[turn, 1.0]]), np.zeros((1, 2))), np.diag([0.2, 0.0])[None])
        tracker = tracker_of(estimator, {"compass": Compass()}, Pda())
        zs = 0.1 * np.random.default_rng(8).standard_normal(9) + turn
        scans = [Scan(1.0 + k, "compass", Detections.of([[z]])) for k, z in enumerate(zs)]
        return estimates(tracker, smoothed(tracker, states_of(tracker, given, scans)))

    mean, cov = run(0.0)
    turned, same = run(np.pi)
    apart = estimator.state.difference(turned, mean)[:, 0]
    np.testing.assert_allclose(np.abs(apart[:, 0]), np.pi, atol=1e-9)
    np.testing.assert_allclose(apart[:, 1], 0.0, atol=1e-9)
    np.testing.assert_allclose(same, cov, atol=1e-12)
    assert np.abs(mean[:, 0, 0]).max() < 0.5
    np.testing.assert_allclose(mean[:, 0, 1], 1.0 + 0.1 * np.arange(10), atol=1e-12)
    np.testing.assert_array_equal(cov[..., 1, :], 0.0)


def test_a_noiseless_model_is_smoothed_too():
    """The predicted covariance is then singular after a start from what is known: nothing moves, nothing is NaN."""
    motion = Linear(np.array([[0.0, 1.0], [0.0, 0.0]]), np.zeros((2, 2)))
    tracker = tracker_of(UnscentedKalman(motion), {"s": POSITION})
    prior = Gaussian(np.array([[1.0, 2.0]]), np.diag([1.0, 0.0])[None])
    scans = [Scan(float(k), "s", Detections.of([[3.0 * k]])) for k in range(1, 6)]
    mean, cov = estimates(tracker, smoothed(tracker, states_of(tracker, prior, scans)))
    np.testing.assert_allclose(mean[:, 0, 1], 2.0, atol=1e-9)
    np.testing.assert_allclose(cov[:, 0], np.broadcast_to(np.diag([1 / 6, 0.0]), (6, 2, 2)), atol=1e-9)


@frozen
class Silent(OverMotion):
    """A Kalman filter that does not state its cross-covariance, as a third party's may."""

    inner: Kalman
    kind = "test_silent"
    drops = ("bounded",)

    @property
    def motion(self):
        return self.inner.motion

    def start(self, prior, axes, rng):
        return self.inner.start(prior, axes, rng)

    def predict(self, belief, dt, rng):
        return self.inner.predict(belief, dt, rng)

    def evaluate(self, belief, sensor, seen, p_gate):
        return self.inner.evaluate(belief, sensor, seen, p_gate)

    def update(self, belief, innovation, weights):
        return self.inner.update(belief, innovation, weights)

    def moments(self, belief):
        return self.inner.moments(belief)


@frozen
class Stating(Silent):
    """The same with the one method that smoothing asks for."""

    kind = "test_stating"

    def cross_covariance(self, belief, dt):
        return belief.cov @ self.inner.motion.jacobian(belief.mean, dt).T


def test_one_method_makes_a_third_partys_filter_smooth():
    motion, sensors, prior, scans = random_problem(4)
    tracker = tracker_of(Stating(Kalman(motion)), sensors)
    check_smoothing(tracker)
    mean, _ = estimates(tracker, smoothed(tracker, states_of(tracker, prior, scans)))
    np.testing.assert_allclose(mean[:, 0], conditioned(motion, sensors, prior, scans)[0], rtol=1e-9, atol=1e-9)


class Turning(Linear):
    kind = "test_turning"
    reframes = True

    def reframe(self, own, combined):
        return own


def test_what_cannot_be_smoothed_is_told_with_its_place():
    motion, sensors, prior, scans = random_problem(4)
    silent = tracker_of(Silent(Kalman(motion)), sensors)
    with pytest.raises(ConfigError, match="estimator: cannot smooth: 'test_silent' does not state"):
        check_smoothing(silent)
    with pytest.raises(ConfigError, match="estimator: cannot smooth: 'bootstrap"):
        check_smoothing(tracker_of(BootstrapParticles(motion), sensors))
    for kind in (ExtendedKalman, UnscentedKalman, SquareRootKalman):
        with pytest.raises(ConfigError, match="cannot smooth: the motion of "):
            check_smoothing(tracker_of(kind(Turning(motion.A, motion.C)), sensors))
    tracker = tracker_of(Kalman(motion), sensors)
    states = states_of(tracker, prior, scans)
    for lag in (-1.0, math.nan):
        with pytest.raises(ValueError, match="lag: must be >= 0 s, got"):
            smooth(tracker, states, lag)
    with pytest.raises(ValueError, match="states: times must not go backwards"):
        smooth(tracker, states[::-1])


class Asked(float):
    """A time that counts how often a lag is added to it."""

    count = 0

    def __add__(self, other):
        Asked.count += 1
        return float(self) + other


@pytest.mark.parametrize("lag", [math.inf, 5.0])
def test_a_state_is_looked_at_twice_however_many_there_are(lag):
    motion, sensors, prior, scans = random_problem(1)
    tracker = tracker_of(Kalman(motion), sensors)
    state = states_of(tracker, prior, scans)[-1]
    states = [evolve(state, time=Asked(i)) for i in range(200)]
    Asked.count = 0
    assert len(list(smoothed(tracker, states, lag))) == 200
    assert Asked.count <= 2 * 200


def test_a_run_without_states_is_told_not_smoothed_to_nothing():
    motion, sensors, _, _ = random_problem(4)
    with pytest.raises(ValueError, match="states"):
        smooth(tracker_of(Kalman(motion), sensors), ())
