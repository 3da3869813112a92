"""The iterated filter finds the mode of the posterior."""

import numpy as np

from vedette import Detections, Gaussian
from vedette_standard.estimators.extended import ExtendedKalman
from vedette_standard.estimators.iterated import IteratedExtendedKalman
from vedette_standard.motion.constant_velocity import ConstantVelocity
from vedette_standard.sensors.range_bearing import RangeBearing

RNG = np.random.default_rng(0)
"""Asked for by the signature; these filters draw nothing."""
CV = ConstantVelocity(0.5)


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
