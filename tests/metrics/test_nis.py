"""NIS of gated and weighted returns."""

import numpy as np
import pytest
from scipy.integrate import quad

from vedette.metrics import consistency as c
from vedette_report.recorded.pooled import pooled_nis

Z = 5.33


# NIS under a gate and under association weights
@pytest.mark.parametrize("m", [1, 2, 3, 4])
@pytest.mark.parametrize("probability", [0.5, 0.9, 0.99])
def test_gate_truncation_is_the_mean_of_a_cut_chi_square(m, probability):
    from scipy.special import chdtri, gamma

    gate = chdtri(m, 1 - probability)
    density = lambda x: x ** (m / 2 - 1) * np.exp(-x / 2) / (2 ** (m / 2) * gamma(m / 2))  # noqa: E731
    mean = quad(lambda x: x * density(x), 0, gate)[0] / probability
    assert c.gate_truncation(m, probability) == pytest.approx(mean / m, rel=1e-6)
    assert c.gate_truncation(m, 1.0) == 1.0


def weighted_scans(rng, count, p_detect, p_gate, density):
    """NIS and hits of PDA on its own truth: one target, S = I in the plane, Poisson clutter in the gate."""
    gate = -2 * np.log(1 - p_gate)
    nis, hit = np.zeros(count), np.zeros(count)
    for s in range(count):
        clutter = gate * rng.uniform(size=rng.poisson(density * np.pi * gate))
        target = 2 * rng.exponential(size=int(rng.uniform() < p_detect))
        squared = np.concatenate([clutter, target[target < gate]])
        likelihood = p_detect * np.exp(-squared / 2) / (2 * np.pi) / density
        weights = likelihood / (1 - p_detect * p_gate + likelihood.sum())
        nis[s], hit[s] = weights @ squared, weights.sum()
    return nis, hit


@pytest.mark.costly
def test_weighted_nis_is_one_on_matched_truth():
    """Under PDA in clutter, at 1e-7; without the truncation, or counting scans instead of hits, it is not."""
    rng = np.random.default_rng(6)
    nis, hit = weighted_scans(rng, 20_000, p_detect=0.8, p_gate=0.9, density=0.1)

    def off(axes, gate):
        rest = nis - hit * axes * c.gate_truncation(axes, gate)
        return abs(rest.mean()) / (rest.std() / np.sqrt(len(rest)))

    ratio = pooled_nis(nis, hit, 2, 0.9)
    assert off(2, 0.9) < Z
    assert off(2, 1.0) > 2 * Z
    assert ratio == pytest.approx(1, abs=0.05)
    assert pooled_nis(nis, np.ones_like(hit), 2, 0.9) < 0.9


def test_pooled_nis_by_hand():
    nis, hit, axes = np.array([[2.0, 1.5], [0.0, 0.0]]), np.array([[1.0, 0.5], [0.0, 0.0]]), np.array([2, 1])
    ratio = pooled_nis(nis, hit, axes)
    assert ratio[0] == pytest.approx(3.5 / 2.5)
    assert np.isnan(ratio[1])
