"""Drawn states against the models' own moments.

Every statistical test accepts at a false alarm rate of ALPHA, whatever the seed.
"""

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy import stats

from support.scenes import PulledVelocity, Weaving
from support.statistics import ALPHA, moments_match
from vedette import sampling
from vedette_standard.motion.constant_velocity import ConstantVelocity


@settings(max_examples=60)
@given(seed=st.integers(0, 2**32 - 1), n=st.integers(1, 6), data=st.data())
def test_factor_squares_to_the_covariance_whatever_its_rank(seed, n, data):
    rank = data.draw(st.integers(0, n))
    rng = np.random.default_rng(seed)
    root = rng.standard_normal((3, n, rank)) * 10.0 ** rng.uniform(-4, 4, n)[:, None]
    root[:, rng.random(n) < 0.2] = 0.0
    cov = root @ np.swapaxes(root, -1, -2)
    lower = sampling.psd_root(cov)
    scale = np.sqrt(np.einsum("bii->bi", cov))
    assert np.all(np.abs(lower @ np.swapaxes(lower, -1, -2) - cov) <= 1e-7 * scale[:, :, None] * scale[:, None, :])
    assert np.all(lower[scale == 0] == 0)
    if rank == n and np.all(scale > 0) and np.all(np.linalg.cond(cov / scale[:, :, None] / scale[:, None, :]) < 1e6):
        np.testing.assert_allclose(lower, np.linalg.cholesky(cov), rtol=1e-6, atol=1e-9 * scale.max())


@pytest.mark.parametrize(
    "cov", [[[1.0, 2.0], [2.0, 1.0]], [[0.0, 1.0], [1.0, 0.0]], [[-1.0]], [[1.0, 0.5], [0.0, 1.0]], [[np.nan]]]
)
def test_factor_refuses_what_is_no_covariance(cov):
    with pytest.raises(ValueError, match="symmetric positive semi-definite"):
        sampling.psd_root(np.array(cov))


def test_noise_of_times_that_underflow_is_none():
    with np.errstate(under="ignore"):
        assert np.all(sampling.psd_root(ConstantVelocity(1.0).noise(np.zeros(4), 3e-123)) < 1e-60)


def test_rounding_adds_no_noise_to_a_singular_covariance():
    cov = np.stack([PulledVelocity().noise(np.zeros(4), dt) for dt in np.linspace(0.01, 30, 500)])
    assert np.all(np.sum(np.any(sampling.psd_root(cov) != 0, axis=-2), axis=-1) == 2)


@pytest.mark.parametrize("model", [ConstantVelocity(0.3), PulledVelocity(), Weaving()], ids=lambda model: model.kind)
def test_a_batch_follows_its_noise_as_each_run_does(model):
    rng = np.random.default_rng(1)
    times, n = np.array([0.0, 1.0, 1.0, 3.5, 4.0]), len(model.state)
    x0, noise = rng.standard_normal((3, 2, n)), rng.standard_normal((3, 2, 4, n))
    batch = sampling.follow(model, x0, times, noise)
    assert batch.shape == (3, 2, 5, n)
    assert np.all(batch[..., 1, :] == batch[..., 2, :])
    for i, j in np.ndindex(3, 2):
        x = x0[i, j]
        np.testing.assert_array_equal(batch[i, j, 0], x)
        for k, dt in enumerate(np.diff(times)):
            Q = model.noise(x, dt)
            w, v = np.linalg.eigh(Q)
            move = model.move(x, dt)
            x = batch[i, j, k + 1]
            # The draw is in the span of Q, and lower triangular in the noise.
            assert np.all(np.abs((x - move) @ v[:, w < 1e-12 * max(w.max(), 1e-300)]) < 1e-9)
        np.testing.assert_allclose(batch[i, j], sampling.follow(model, x0[i, j], times, noise[i, j]), rtol=1e-12, atol=1e-12)


@pytest.mark.parametrize("model", [ConstantVelocity(0.3), PulledVelocity()], ids=lambda model: model.kind)
def test_draws_have_the_models_mean_and_covariance(model):
    times, x0 = np.array([2.0, 3.0, 5.5, 6.0]), np.array([10.0, -20.0, 3.0, 1.0])
    states = sampling.draw_states(model, x0, times, np.random.default_rng(5), size=(4000,))
    mean, cov = x0, np.zeros((4, 4))
    for dt in np.diff(times):
        F = model.jacobian(mean, dt)
        mean, cov = F @ mean, F @ cov @ F.T + model.noise(mean, dt)
    assert moments_match(states[:, -1], mean, cov)
    assert not moments_match(states[:, -1], mean, 1.2 * cov)
    assert not moments_match(states[:, -1], mean + 0.2 * np.sqrt(np.diag(cov)), cov)


def test_a_gaussian_draw_has_its_mean_and_covariance():
    mean, root = np.array([[1.0, 2.0], [-3.0, 0.5]]), np.array([[2.0, 0.0], [1.5, 0.3]])
    draws = sampling.draw_gaussian(mean, root @ root.T, np.random.default_rng(0), size=(4000,))
    assert draws.shape == (4000, 2, 2)
    assert moments_match(draws[:, 1], mean[1], root @ root.T)
    assert abs(np.mean((draws[:, 0] - mean[0]) * (draws[:, 1] - mean[1]) / np.diag(root @ root.T))) < 0.1


TRANSITION = np.array([[0.9, 0.1, 0.0], [0.2, 0.5, 0.3], [0.25, 0.25, 0.5]])


def test_modes_switch_as_often_as_the_matrix_says():
    times = np.arange(21.0)
    uniform = np.random.default_rng(3).random((500, 20))
    modes = sampling.switch(TRANSITION, 1, times, uniform)
    assert np.all(modes[:, 0] == 1)
    counts = np.zeros((3, 3))
    np.add.at(counts, (modes[:, :-1].ravel(), modes[:, 1:].ravel()), 1)
    expected = TRANSITION * counts.sum(axis=1, keepdims=True)
    assert counts[0, 2] == 0
    possible = TRANSITION > 0
    misfit = np.sum((counts - expected)[possible] ** 2 / expected[possible])
    assert misfit < stats.chi2.isf(ALPHA, possible.sum() - 3)
    transposed = TRANSITION.T * counts.sum(axis=1, keepdims=True)
    assert np.sum((counts - transposed)[possible] ** 2 / np.maximum(transposed[possible], 1)) > stats.chi2.isf(ALPHA, 5)


def test_nothing_switches_in_no_time():
    flip = np.array([[0.0, 1.0], [1.0, 0.0]])
    modes = sampling.switch(flip, 0, np.array([0.0, 1.0, 1.0, 1.0, 2.0]), np.random.default_rng(0).random((5, 4)))
    assert np.all(modes == [0, 1, 1, 1, 0])


def test_jumping_states_equal_one_run_told_by_hand():
    models = (ConstantVelocity(0.3), Weaving())
    assert sampling.union_state(models).names == ("x", "y", "vx", "vy", "turn_rate")
    assert sampling.common_state(models).names == ("x", "y", "vx", "vy")
    rng = np.random.default_rng(8)
    times = np.array([0.0, 1.0, 2.5, 2.5, 4.0, 5.0, 7.0])
    x0 = rng.standard_normal((6, 5))
    modes = sampling.switch(np.array([[0.5, 0.5], [0.5, 0.5]]), np.array([0, 1, 0, 1, 0, 1]), times, rng.random((6, 6)))
    noise, fresh = rng.standard_normal((2, 6, 6, 5))
    states = sampling.follow_modes(models, modes, x0, times, noise, fresh)
    assert len({tuple(run) for run in modes}) > 3
    for i in range(6):
        here = dict(zip(sampling.union_state(models).names, x0[i], strict=True))
        if modes[i, 0] == 0:
            del here["turn_rate"]
        for k in range(7):
            if k > 0:
                model = models[modes[i, k]]
                here = dict(zip(sampling.union_state(models).names, fresh[i, k - 1], strict=True)) | here
                x = np.array([here[name] for name in model.state.names])
                w = np.array(
                    [
                        dict(zip(sampling.union_state(models).names, noise[i, k - 1], strict=True))[n]
                        for n in model.state.names
                    ]
                )
                x = sampling.follow(model, x, times[k - 1 : k + 1], w[None])[1]
                here = dict(zip(model.state.names, x, strict=True))
            told = [here.get(name, np.nan) for name in sampling.union_state(models).names]
            np.testing.assert_allclose(states[i, k], told, rtol=1e-12, atol=1e-12)


def test_a_new_axis_starts_as_stated_and_the_others_go_on():
    models, flip = (ConstantVelocity(1e-6), Weaving()), np.array([[0.0, 1.0], [1.0, 0.0]])
    modes, states = sampling.draw_jump_markov(
        models, flip, np.array([5.0, 6.0, 0.0, 0.0, 99.0]), 0, np.array([0.0, 1e-9]), np.random.default_rng(2), (4000,),
        starts={"turn_rate": (0.4, 0.1)},
    )  # fmt: skip
    assert modes.shape == (4000, 2)
    assert np.all(np.isnan(states[:, 0, 4]))
    np.testing.assert_allclose(states[:, 1, :2], np.broadcast_to([5.0, 6.0], (4000, 2)), atol=1e-6)
    assert moments_match(states[:, 1, 4:], np.array([0.4]), np.array([[0.01]]))
