"""The simulated sea and noise: their statistics."""

import numpy as np
import pytest
from scipy import special, stats

from support.marine import SMALL, within, world
from vedette_sim import SeaClutter
from vedette_sim.marine_synthesis import Synthesis
from vedette_sim.polar_fields import TextureMemory, Upsampling, own_stream


def clutter_power(shape, seed, **more):
    """Power of one turn over its mean; the noise is 60 dB below."""
    sea = SeaClutter(shape=shape, level=60.0)
    return Synthesis(world(sea=sea, **more), seed).power(0) / sea.mean(SMALL.ranges)


@pytest.mark.statistical(alpha=1e-5)
@pytest.mark.parametrize("shape", [0.7, 2.0])
@pytest.mark.by_turns
def test_the_sea_is_k_distributed(shape):
    """Moments n! Gamma(n + nu) / (nu^n Gamma(nu)) and the exceedance 2 / Gamma(nu) (nu z)^(nu/2) K_nu(2 sqrt(nu z))."""
    drawn = [clutter_power(shape, seed) for seed in range(48)]
    for n in (1, 2):
        expected = special.factorial(n) * special.gamma(n + shape) / (shape**n * special.gamma(shape))
        moments = [np.mean(power.astype(float) ** n) for power in drawn]
        assert within(moments, expected)
        if n == 2:
            assert not within(moments, 2.0)  # that of an untextured sea
    for z in (0.1, 1.0, 5.0):
        u = 2 * np.sqrt(shape * z)
        expected = 2 / special.gamma(shape) * (u / 2) ** shape * special.kv(shape, u)
        assert within([np.mean(power > z) for power in drawn], expected)


@pytest.mark.statistical(alpha=1e-5)
def test_noise_alone_is_exponential_and_has_the_beam_s_and_the_pulse_s_correlation():
    """Power of a Gaussian field smoothed by the amplitude pattern: autocorrelation e^(-d^2 / 4 s^2), s the power's."""
    drawn = [Synthesis(world(), seed).power(0).astype(float) for seed in range(40)]
    assert within([power.mean() for power in drawn], 1.0)
    assert within([np.mean(power > 3.0) for power in drawn], np.exp(-3.0))
    across, along = SMALL.spread
    for axis, spread in ((0, across), (1, along)):
        for lag in (2, 4):
            here = [np.mean((power * np.roll(power, lag, axis))[:, 20:]) - 1.0 for power in drawn]
            # The linear interpolation inside brings the Gaussian to within some hundredths only.
            assert abs(np.mean(here) - np.exp(-(lag**2) / (4 * spread**2))) < 0.04


@pytest.mark.statistical(alpha=1e-5)
@pytest.mark.costly
def test_the_texture_s_field_has_variance_one_everywhere():
    smooth = Upsampling((12, 9), (8, 16), (1.5, 0.0))
    made = np.stack([smooth(own_stream(3, k).standard_normal((12, 9), dtype=np.float32)) for k in range(4000)])
    assert made.shape[1:] == smooth.fine == (96, 144)
    squares = np.mean(made**2, axis=0)
    assert np.max(np.abs(squares - 1.0)) < 6.5 * np.sqrt(2 / 4000)
    across_the_seam = np.mean(made[:, 0] * made[:, -1])
    inside = np.mean(made[:, 8] * made[:, 7])  # as far from one of the coarse grid's points to the next
    assert across_the_seam == pytest.approx(inside, abs=0.02)


@pytest.mark.statistical(alpha=1e-5)
def test_the_texture_is_correlated_in_time_as_stated():
    """rho^k of the field; of the gamma texture with nu = 1 the covariance of -log(1 - Phi(g)), by quadrature."""
    rho, lag = 0.85, 3
    sea = SeaClutter(shape=1.0)
    fields, textures = [], []
    for seed in range(40):
        memory = TextureMemory((40, 40), rho, seed, 1)
        first, later = memory.at(20), memory.at(20 + lag)
        fields.append(np.mean(first * later))
        textures.append(np.mean(sea.texture(first) * sea.texture(later)) - 1.0)
    assert within(fields, rho**lag)
    nodes, weights = np.polynomial.hermite_e.hermegauss(80)
    weights = weights / weights.sum()
    quantile = -stats.norm.logsf(nodes)
    other = rho**lag * nodes[:, None] + np.sqrt(1 - rho ** (2 * lag)) * nodes
    expected = np.sum(weights[:, None] * weights * quantile[:, None] * -stats.norm.logsf(other)) - 1.0
    assert within(textures, expected)
    assert not within(textures, rho ** (2 * (lag + 1)))


def test_the_texture_of_a_turn_does_not_depend_on_what_was_asked_before():
    asked = TextureMemory((6, 5), 0.9, 4, 1)
    order = [33, 2, 40, 39, 16, 0]
    for turn in order:
        np.testing.assert_array_equal(asked.at(turn), TextureMemory((6, 5), 0.9, 4, 1).at(turn))


def test_sea_falls_with_the_cube_of_range_and_rises_against_the_wind():
    sea = SeaClutter(level=10.0, wind_from="90 deg", upwind=6.0)
    assert sea.mean(np.array(1000.0)) == pytest.approx(10.0)
    assert sea.mean(np.array(500.0)) == pytest.approx(80.0)
    np.testing.assert_allclose(sea.rose(np.radians([90.0, 180.0, 270.0])), [10**0.6, 1.0, 1.0], rtol=1e-12)
