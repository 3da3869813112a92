"""Linear problems to smooth, their exact answer, and a turning target seen by a radar."""

import math

import numpy as np
from attrs import frozen
from scipy.linalg import block_diag

from support.models import Linear, Looking
from vedette import Associator, Detections, Gaussian, Scan, Tracker
from vedette.sampling import draw_states
from vedette_standard.lifecycles.single_target import SingleTarget
from vedette_standard.motion.coordinated_turn import CoordinatedTurn
from vedette_standard.sensors.range_bearing import RangeBearing


@frozen
class Sure(Associator):
    """Whatever came is the target's."""

    kind = "test_sure"

    def associate(self, scores, evidence):
        weights = np.zeros_like(scores)
        weights[..., 1 if scores.shape[-1] > 1 else 0] = 1.0
        return weights


def tracker_of(estimator, sensors, associator=None):
    return Tracker(estimator, sensors, associator or Sure(), SingleTarget(), None)


def states_of(tracker, given, scans, begin=0.0):
    state = tracker.start(given, begin)
    states = [state]
    for scan in scans:
        state = tracker.step(state, scan)
        states.append(state)
    return states


def estimates(tracker, states):
    found = [tracker.estimate(state) for state in states]
    return np.stack([each.mean for each in found]), np.stack([each.cov for each in found])


def random_cov(rng, n, least=0.1):
    a = rng.standard_normal((n, n))
    return a @ a.T + least * np.eye(n)


def random_problem(seed):
    """A linear model and prior, and scans of three sensors: irregular, several at one time, some without a return."""
    rng = np.random.default_rng(seed)
    n = int(rng.integers(1, 5))
    motion = Linear(0.5 * rng.standard_normal((n, n)), random_cov(rng, n))
    sensors = {f"s{m}": Looking(rng.standard_normal((m, n)), random_cov(rng, m)) for m in (1, 2, 3)}
    scans, time = [], 0.0
    for _ in range(8):
        time += float(rng.choice([0.0, 0.4, 1.0, rng.random()]))
        name = f"s{rng.integers(1, 4)}"
        m = int(name[1])
        z = np.zeros((0, m)) if rng.random() < 0.25 else 3 * rng.standard_normal((1, m))
        scans.append(Scan(time, name, Detections.of(z, m)))
    return motion, sensors, Gaussian(rng.standard_normal((1, n)), random_cov(rng, n)[None]), scans


def conditioned(motion, sensors, prior, scans, lag=math.inf):
    """Mean (s, n) and cov (s, n, n) at the prior's time and after each scan, given the returns of up to `lag` s later.

    All states as one Gaussian vector, a linear function of the prior and the noises; then the formula of conditioning.
    """
    n, s = prior.mean.shape[-1], len(scans) + 1
    times = [0.0, *(scan.time for scan in scans)]
    gain, mean = [np.eye(n, n * s)], [prior.mean[0]]
    noises = [prior.cov[0]]
    for k in range(1, s):
        dt = times[k] - times[k - 1]
        F = motion.jacobian(mean[-1], dt)
        gain.append(F @ gain[-1] + np.eye(n, n * s, k * n))
        mean.append(F @ mean[-1])
        noises.append(motion.noise(mean[-1], dt))
    gain, mean = np.concatenate(gain), np.concatenate(mean)
    cov = gain @ block_diag(*noises) @ gain.T
    means, covs = [], []
    for k in range(s):
        rows, noise, z = [np.zeros((0, n * s))], [np.zeros((0, 0))], [np.zeros(0)]
        for i, scan in enumerate(scans):
            if scan.detections.z.shape[0] and scan.time <= times[k] + lag:
                sensor = sensors[scan.sensor]
                row = np.zeros((len(sensor.H), n * s))
                row[:, (i + 1) * n : (i + 2) * n] = sensor.H
                rows.append(row)
                noise.append(sensor.R)
                z.append(scan.detections.z[0])
        H, R, z = np.concatenate(rows), block_diag(*noise), np.concatenate(z)
        own = slice(k * n, (k + 1) * n)
        K = np.linalg.solve(H @ cov @ H.T + R, H @ cov[:, own]).T if len(z) else np.zeros((n, 0))
        means.append(mean[own] + K @ (z - H @ mean))
        covs.append(cov[own, own] - K @ H @ cov[:, own])
    return np.array(means), np.array(covs)


TURN = CoordinatedTurn(sigma_accel=0.5, sigma_turn_rate=0.05)
RADAR = RangeBearing(sigma_range=5.0, sigma_bearing=0.01, detection_probability=0.8, clutter_per_scan=3.0, max_range=3e3)


def turning(rng, runs, count):
    """States (runs, count, 5), the scans of them all (batched), and the prior."""
    mean = np.array([800.0, 500.0, 5.0, 3.0, 0.03])
    cov = np.diag([20.0, 20.0, 1.0, 1.0, 0.02]) ** 2
    x0 = rng.multivariate_normal(mean, cov, size=runs)
    times = np.cumsum(rng.choice([0.0, 1.0, 2.5], size=count))
    truth = draw_states(TURN, x0, np.concatenate([[-1.0], times]), rng)[:, 1:]
    noise = rng.standard_normal((runs, count, 2)) * [5.0, 0.01]
    z = RADAR.measurement.displace(RADAR.measure(truth[..., RADAR_AXES]), noise)
    z = np.stack([z, RADAR.measurement.displace(z, 4 * rng.standard_normal(z.shape) * [5.0, 0.01])], axis=-2)
    valid = rng.random((runs, count, 2)) < [0.8, 0.3]
    scans = [Scan(time, "radar", Detections(z[:, k], valid[:, k])) for k, time in enumerate(times)]
    return truth, scans, Gaussian(np.broadcast_to(mean, (runs, 1, 5)), np.broadcast_to(cov, (runs, 1, 5, 5)))


RADAR_AXES = TURN.state.locate(RADAR.observes)
