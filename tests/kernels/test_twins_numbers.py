"""Draws, exponentials and ill-conditioned covariances of the compiled kernels."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from support.twins import REFERENCE, on, seeds
from vedette import kernels
from vedette.kernels import _compiled, reference


@pytest.mark.parametrize("shape", [(), (0,), (5,), (3, 2)])
@pytest.mark.parametrize("name", ["normals", "uniforms"])
def test_numbers_are_what_each_generator_draws_by_itself(name, shape):
    def generators():
        return [np.random.default_rng(7), np.random.Generator(np.random.MT19937(8)), np.random.default_rng(9)]

    ours, theirs = generators(), generators()
    for _ in range(2):
        np.testing.assert_array_equal(getattr(kernels, name)(ours, shape), REFERENCE[name](theirs, shape))
    assert [a.bit_generator.random_raw() for a in ours] == [b.bit_generator.random_raw() for b in theirs]
    same = np.random.default_rng(1)
    np.testing.assert_array_equal(
        getattr(kernels, name)([same, same], (4,)).ravel(), REFERENCE[name]([np.random.default_rng(1)], (8,)).ravel()
    )


def test_a_generator_of_another_kind_draws_in_its_own_way():
    class Halves(np.random.Generator):
        def random(self, size=None):
            return np.full(size, 0.5)

    assert np.all(kernels.uniforms([Halves(np.random.PCG64(1))], (4,)) == 0.5)


@given(seeds, st.integers(2, 12), st.integers(1, 4), st.floats(-14, 14))
@pytest.mark.costly
def test_covariances_stay_what_they_are_on_ill_conditioned_input(seed, n, m, exponent):
    """Symmetric to the last bit, and no eigenvalue below rounding, whatever the scales: both twins promise it."""
    rng = np.random.default_rng(seed)
    scales = 10.0 ** rng.uniform(-6, 6, n)
    a = rng.normal(size=(9, n, n)) * scales[:, None]
    P, H = a @ np.swapaxes(a, -1, -2), rng.normal(size=(m, n)) / scales
    R = np.eye(m) * 10.0**exponent
    for update in (kernels.update, reference.update):
        cov = update(np.zeros(n), P, np.zeros(m), H, R)[1]
        np.testing.assert_array_equal(cov, np.swapaxes(cov, -1, -2))
        scaled = cov / np.sqrt(np.einsum("...i,...j->...ij", *2 * [np.diagonal(cov, axis1=-2, axis2=-1)]))
        assert np.linalg.eigvalsh(scaled).min() > -1e-7


def test_exponentials_and_logarithms_of_eight_lanes_are_the_librarys():
    """Those of the vectors are written out; seen through a mixture's weights and a detection probability."""
    rng = np.random.default_rng(0)
    logs = np.concatenate([rng.uniform(-745, 0, 40_000), rng.uniform(-1, 0, 39_998), [-np.inf, -746.0]])
    log_prob = np.stack([np.zeros_like(logs), logs], axis=-1)
    ends = [np.zeros((len(logs), 1)), np.ones((len(logs), 1))]
    cov = [np.ones((len(logs), 1, 1))] * 2
    p_detect = np.concatenate([10 ** rng.uniform(-305, 0, 40_000), rng.random(39_999), [0.0]])[:, None]
    n = len(p_detect)
    looks = np.ones((n, 1, 1, 1)), np.zeros((n, 1, 1)), np.zeros((n, 1, 1)), np.ones((1, 1)), np.ones((1, 1, 1))
    for instruction_set in _compiled.instruction_sets():
        with on(instruction_set):
            mean = kernels.mixture_moments(log_prob, ends, cov, ((0,), (0,)), np.zeros((2, 1)), ()).mean[:, 0]
            loglik = kernels.evaluate_returns(*looks, p_detect, 0.0, ()).loglik[:, 0, 1]
        expected = np.where(logs < np.log(np.finfo(float).tiny), 0.0, np.exp(logs))
        np.testing.assert_allclose(mean, expected, rtol=1e-15, atol=0.0)
        certain = kernels.evaluate_returns(*(a[:1] if a.shape[0] == n else a for a in looks), 1.0, 0.0, ())
        np.testing.assert_allclose(
            loglik - certain.loglik[0, 0, 1], reference.safe_log(p_detect[:, 0]), rtol=1e-15, atol=3e-16
        )
