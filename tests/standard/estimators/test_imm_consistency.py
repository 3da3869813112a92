"""The IMM is consistent on jump-Markov truth."""

import numpy as np
import pytest
from scipy import stats

from support.imm import step
from vedette import Detections, Gate, Gaussian
from vedette_standard.estimators.imm import Imm
from vedette_standard.estimators.kalman import Kalman
from vedette_standard.motion.constant_velocity import ConstantVelocity
from vedette_standard.sensors.cartesian_position import CartesianPosition

RNG = np.random.default_rng(0)
"""Asked for by the signature; these filters draw nothing."""
TWO = Kalman(ConstantVelocity(0.1)), Kalman(ConstantVelocity(3.0))
SWITCH = np.array([[0.9, 0.1], [0.3, 0.7]])


def jump_markov(modes, T, initial, prior, sensor, runs, scans, dt, seed):
    """Truth (runs, 1, n) and returns (runs, 1, m) of each scan, drawn from the IMM's own models, all runs at once."""
    rng = np.random.default_rng(seed)
    mode = rng.choice(len(T), size=runs, p=initial)
    x = rng.multivariate_normal(prior.mean, prior.cov, size=(runs, 1))
    for _ in range(scans):
        mode = (rng.random((runs, 1)) > np.cumsum(T, axis=1)[mode]).sum(axis=1)
        L = np.linalg.cholesky(np.stack([m.noise(x, dt) for m in modes]))[mode]
        x = modes[0].move(x, dt) + (L @ rng.normal(size=(runs, 4, 1)))[..., 0][:, None, :]
        yield x, sensor.measure(x[..., :2]) + sensor.sigma * rng.normal(size=(runs, 1, 2))


def test_nis_of_an_imm_has_mean_m_where_its_prior_is_exact():
    """From a common prior the predicted mixture is exact, so over 20000 runs the mean lies within 5.4 standard errors of m:
    false alarms below 1e-7. Weights that do not know the return, and the least distance, do not have that mean.
    """
    runs, sensor, initial = 20000, CartesianPosition(3.0), [0.5, 0.5]
    prior = Gaussian(np.array([800.0, 500.0, -10.0, 5.0]), np.diag([10.0, 10.0, 1.0, 1.0]))
    _, z = next(jump_markov([mode.motion for mode in TWO], SWITCH, initial, prior, sensor, runs, 1, 2.0, seed=5))
    imm = Imm(TWO, transition=SWITCH, initial=initial)
    spread = Gaussian(np.broadcast_to(prior.mean, (runs, 1, 4)), np.broadcast_to(prior.cov, (runs, 1, 4, 4)))
    predicted = imm.predict(imm.start(spread, imm.state, RNG), 2.0, RNG)
    innovation = imm.evaluate(predicted, sensor, Detections(z, np.ones((runs, 1), bool)), 1.0)
    each = np.stack([part.nis[:, 0, 0] for part in innovation.detail.innovations], axis=-1)

    def is_two(nis):
        return abs(nis.mean() - 2) < 5.4 * nis.std() / np.sqrt(runs)

    assert is_two(innovation.nis[:, 0, 0])
    assert not is_two(each @ imm.mode_prob(predicted)[0, 0])
    assert not is_two(each.min(axis=-1))


def within_a_tenth(values, freedom):
    """Whether the mean of `values` (scans, runs) over `freedom` lies in .9 to 1.1 by all of 5.2 of its standard errors.

    The run is the unit: values within one are not independent. A mean outside passes once in 1e7.
    """
    of_runs = np.mean(values, axis=0) / freedom
    margin = 5.2 * of_runs.std(ddof=1) / np.sqrt(of_runs.size)
    return bool(margin < 0.06 and 0.9 + margin < of_runs.mean() < 1.1 - margin)


@pytest.mark.parametrize(
    ("switch", "sigma", "consistent"),
    [(SWITCH, 10.0, True), (SWITCH, 8.8, False), (np.array([[0.999, 0.001], [0.5, 0.5]]), 10.0, False)],
    ids=["matched", "too sure of the returns", "hardly ever switches"],
)
@pytest.mark.by_turns
def test_nees_and_nis_of_an_imm_on_jump_markov_truth(switch, sigma, consistent):
    """3000 runs of 30 scans, truth drawn from its own modes and switches; standard errors of about .006.

    By normal theory the matched case fails less than once in 1e9 while the filter's own mean is within .98 to 1.02.
    """
    modes, initial = (ConstantVelocity(0.2), ConstantVelocity(3.0)), np.array([0.75, 0.25])
    sensor, runs = CartesianPosition(10.0), 3000
    prior = Gaussian(np.array([800.0, 500.0, -10.0, 5.0]), np.diag([400.0, 400.0, 25.0, 25.0]))
    imm = Imm(tuple(map(Kalman, modes)), transition=switch, initial=initial)
    belief = imm.start(
        Gaussian(np.broadcast_to(prior.mean, (runs, 1, 4)), np.broadcast_to(prior.cov, (runs, 1, 4, 4))), imm.state, RNG
    )
    nees, nis = [], []
    for x, z in jump_markov(modes, SWITCH, initial, prior, sensor, runs, 30, 2.0, seed=3):
        belief = imm.predict(belief, 2.0, RNG)
        innovation = imm.evaluate(belief, CartesianPosition(sigma), Detections(z, np.ones((runs, 1), bool)), 1.0)
        belief = imm.update(belief, innovation, np.broadcast_to([0.0, 1.0], (runs, 1, 2)))
        found = imm.moments(belief)
        error = x - found.mean
        nees.append((error[..., None, :] @ np.linalg.solve(found.cov, error[..., None]))[:, 0, 0, 0])
        nis.append(innovation.nis[:, 0, 0])
    assert (within_a_tenth(nees, 4) and within_a_tenth(nis, 2)) == consistent


@pytest.mark.parametrize("estimator", [Kalman(ConstantVelocity(1.0)), Imm(TWO, transition=SWITCH)], ids=["kalman", "imm"])
@pytest.mark.by_turns
def test_nis_under_pda_is_that_of_a_return_in_the_gate(estimator):
    """Among clutter the weighted squared distance over the weight of a return estimates E[d | d < gate] = m F_m+2 / F_m,
    here 1.69 of 2 axes.

    Truth, its detection and the clutter are drawn from the models; one scan of 40000 runs, false alarms 2e-7. The plain m
    is far outside the band. An IMM's gate is the union of its modes', so there the figure is only near.
    """
    runs, gate, dt = 40000, Gate(0.95), 2.0
    rng = np.random.default_rng(6)
    sensor = CartesianPosition(10.0, 0.8, clutter_density=2e-4)
    prior = Gaussian(np.array([800.0, 500.0, -10.0, 5.0]), np.diag([100.0, 100.0, 4.0, 4.0]))
    modes = [mode.motion for mode in getattr(estimator, "modes", [estimator])]
    chain = (SWITCH, [0.5, 0.5]) if len(modes) == 2 else (np.ones((1, 1)), [1.0])
    x, z = next(jump_markov(modes, *chain, prior, sensor, runs, 1, dt, seed=7))
    side, most = 240.0, 40
    clutter = x[..., :2] + rng.uniform(-side / 2, side / 2, (runs, most, 2))
    counts = np.minimum(rng.poisson(2e-4 * side**2, runs), most)
    valid = np.concatenate([rng.random((runs, 1)) < 0.8, np.arange(most) < counts[:, None]], axis=1)
    detections = Detections(np.concatenate([z, clutter], axis=1), valid)
    spread = Gaussian(np.broadcast_to(prior.mean, (runs, 1, 4)), np.broadcast_to(prior.cov, (runs, 1, 4, 4)))
    _, innovation, weights, _ = step(estimator, estimator.start(spread, estimator.state, RNG), sensor, detections, dt, gate)
    used = np.sum(weights[:, 0, 1:] * innovation.nis[:, 0], axis=-1)
    hit = 1 - weights[:, 0, 0]
    if len(modes) == 1:
        threshold = gate.threshold(2)
        expected = 2 * stats.chi2.cdf(threshold, 4) / stats.chi2.cdf(threshold, 2)
        excess = used - expected * hit
        margin = 5.4 * excess.std() / np.sqrt(runs)
        assert abs(excess.mean()) < margin
        assert abs((used - 2.0 * hit).mean()) > 2 * margin
        assert abs(hit.mean() - 0.8 * 0.95) < 5.4 * hit.std() / np.sqrt(runs)
    assert 1.6 < used.sum() / hit.sum() < 1.8
