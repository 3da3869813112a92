"""The kernels against the textbook's lines, one problem at a time: values, symmetry, positive definiteness, batches."""

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from vedette import kernels

exactly = settings(max_examples=60)


def covariance(rng, *shape, n):
    a = rng.normal(size=(*shape, n, n + 1))
    return a @ np.swapaxes(a, -1, -2) + 0.1 * np.eye(n)


@st.composite
def problems(draw):
    """P, nu, H, R of any shape: no, one or two batch axes, some or no tracks and returns, noise shared or a return's own."""
    batch = draw(st.sampled_from([(), (2,), (2, 3), (0,)]))
    t, k, n, m = (draw(st.integers(low, high)) for low, high in ((0, 3), (0, 4), (1, 5), (1, 4)))
    rng = np.random.default_rng(draw(st.integers(0, 2**32 - 1)))
    H = rng.normal(size=(*batch, t, m, n) if draw(st.booleans()) else (m, n))
    noise_shape = draw(st.sampled_from([(*batch, t, 1), (*batch, t, k), (1,), (*batch, 1, k)]))
    return covariance(rng, *batch, t, n=n), rng.normal(size=(*batch, t, k, m)), H, covariance(rng, *noise_shape, n=m)


def log_normal(nu, S):
    return -0.5 * (nu @ np.linalg.solve(S, nu) + np.log(np.linalg.det(2 * np.pi * S)))


def assert_symmetric(P):
    np.testing.assert_array_equal(P, np.swapaxes(P, -1, -2))


def close(actual, expected):
    np.testing.assert_allclose(actual, expected, rtol=1e-9, atol=1e-9)


def check_innovate(P, nu, H, R):
    """Of every return and track on its own."""
    loglik, distance, log_volume, shift, post = kernels.evaluate(P, nu, H, R)
    shape, n, m = nu.shape[:-1], P.shape[-1], nu.shape[-1]
    assert loglik.shape == distance.shape == shape
    assert shift.shape == (*shape, n)
    assert_symmetric(post)
    P, H = (np.broadcast_to(a[..., None, :, :], (*shape, *a.shape[-2:])) for a in (P, H))
    R = np.broadcast_to(R, (*shape, m, m))
    log_volume, post = np.broadcast_to(log_volume, shape), np.broadcast_to(post, (*shape, n, n))
    for i in np.ndindex(shape):
        S = H[i] @ P[i] @ H[i].T + R[i]
        K = P[i] @ H[i].T @ np.linalg.inv(S)
        close(loglik[i], log_normal(nu[i], S))
        close(distance[i], nu[i] @ np.linalg.inv(S) @ nu[i])
        close(log_volume[i], 0.5 * np.log(np.linalg.det(S)))
        close(shift[i], K @ nu[i])
        close(post[i], P[i] - K @ S @ K.T)


@exactly
@given(problems())
def test_innovate_is_the_textbooks_update(problem):
    check_innovate(*problem)


@exactly
@given(problems(), st.sampled_from([0.0, 1.0, 2.5]))
def test_points_of_a_linear_model_innovate_as_the_model_does(problem, kappa):
    P, nu, H, R = problem
    dx, weights = kernels.sigma_points(P, kappa)
    found = kernels.evaluate_points(dx, dx @ np.swapaxes(H, -1, -2), weights, nu, R)
    assert_symmetric(found[-1])
    for one, other in zip(found, kernels.evaluate(P, nu, H, R), strict=True):
        close(one, other)


@exactly
@given(st.integers(0, 2**32 - 1), st.integers(1, 6), st.sampled_from([0.0, 0.5, 3.0]))
def test_sigma_points_have_the_covariance_of_their_axes(seed, n, kappa):
    """Also where an axis is known exactly, or follows from another, and the Cholesky factor does not exist."""
    rng = np.random.default_rng(seed)
    a = rng.normal(size=(3, n, n))
    a[0, rng.integers(n)] = 0.0
    a[1, :, rng.integers(n)] = 0.0
    P = a @ np.swapaxes(a, -1, -2)
    offsets, weights = kernels.sigma_points(P, kappa)
    assert weights.min() >= 0
    np.testing.assert_allclose(weights @ offsets, 0, atol=1e-12)
    np.testing.assert_allclose(np.swapaxes(offsets * weights[:, None], -1, -2) @ offsets, P, rtol=1e-6, atol=1e-6)
    unknown = P[0].diagonal() > 0
    assert np.all(offsets[0][:, ~unknown] == 0.0)
    np.testing.assert_allclose(
        np.swapaxes(offsets[0] * weights[:, None], -1, -2) @ offsets[0], P[0], rtol=1e-12, atol=1e-12 * P[0].max()
    )


def check_propagate(P, nu, H, R):
    n = P.shape[-1]
    rng = np.random.default_rng(n)
    F, Q = rng.normal(size=(n, n)), covariance(rng, n=n)
    found = kernels.propagate(P, F, Q)
    assert found.shape == P.shape
    assert_symmetric(found)
    for i in np.ndindex(P.shape[:-2]):
        close(found[i], F @ P[i] @ F.T + Q)


@exactly
@given(problems())
def test_propagate_is_the_textbooks_line(problem):
    check_propagate(*problem)


def weights_for(rng, *shape):
    w = rng.exponential(size=shape)
    return w / w.sum(axis=-1, keepdims=True)


def mixture_by_moments(P, shift, post, weights):
    """The first two moments about the prior mean of: nothing seen, or return i."""
    means = np.concatenate([np.zeros((1, P.shape[-1])), shift])
    covs = np.concatenate([P[None], np.broadcast_to(post, (len(shift), *P.shape))])
    mean = sum(w * x for w, x in zip(weights, means, strict=True))
    second = sum(w * (c + np.outer(x, x)) for w, x, c in zip(weights, means, covs, strict=True))
    return mean, second - np.outer(mean, mean)


def check_mixture(P, nu, H, R):
    shift, post = kernels.evaluate(P, nu, H, R)[-2:]
    shape = nu.shape[:-2]
    weights = weights_for(np.random.default_rng(0), *shape, 1 + nu.shape[-2])
    mean, cov = kernels.mixture(P, shift, post, weights)
    assert_symmetric(cov)
    for i in np.ndindex(shape):
        expected = mixture_by_moments(P[i], shift[i], np.broadcast_to(post, (*shape, *post.shape[-3:]))[i], weights[i])
        close(mean[i], expected[0])
        close(cov[i], expected[1])


@exactly
@given(problems())
@pytest.mark.costly
def test_mixture_has_the_moments_of_its_hypotheses(problem):
    check_mixture(*problem)


def imm_mix_by_loops(prob, transition, xs, Ps):
    r = len(prob)
    c = np.array([sum(transition[i, j] * prob[i] for i in range(r)) for j in range(r)])
    means, covs = [], []
    for j in range(r):
        mu = np.array([transition[i, j] * prob[i] / c[j] for i in range(r)])
        x = sum(mu[i] * xs[i] for i in range(r))
        means.append(x)
        covs.append(sum(mu[i] * (Ps[i] + np.outer(xs[i] - x, xs[i] - x)) for i in range(r)))
    return c, np.array(means), np.array(covs)


def check_imm_mix(seed, r, n, batch):
    rng = np.random.default_rng(seed)
    prob, transition = weights_for(rng, *batch, r), weights_for(rng, r, r)
    xs, Ps = rng.normal(size=(*batch, r, n)), covariance(rng, *batch, r, n=n)
    log_c, means, covs = kernels.imm_mix(np.log(prob), np.log(transition), xs, Ps)
    merged = kernels.moments(prob[..., None, :], xs, Ps)
    assert_symmetric(covs)
    assert_symmetric(merged.cov)
    for i in np.ndindex(batch):
        for found, expected in zip(
            (np.exp(log_c[i]), means[i], covs[i]), imm_mix_by_loops(prob[i], transition, xs[i], Ps[i]), strict=True
        ):
            close(found, expected)
        one, spread = mixture_by_moments(np.zeros((n, n)), xs[i], Ps[i], np.concatenate([[0.0], prob[i]]))
        close(merged.mean[(*i, 0)], one)
        close(merged.cov[(*i, 0)], spread)


@exactly
@given(st.integers(0, 2**32 - 1), st.integers(1, 4), st.integers(1, 4), st.sampled_from([(), (3,), (2, 2), (0,)]))
def test_imm_mix_and_moments_are_the_textbooks_lines(seed, r, n, batch):
    check_imm_mix(seed, r, n, batch)


def test_imm_mix_gives_an_unreachable_mode_the_whole_mixture():
    with np.errstate(divide="ignore"):
        log_transition = np.log(np.array([[1.0, 0.0], [1.0, 0.0]]))
    xs, Ps = np.array([[0.0], [4.0]]), np.ones((2, 1, 1))
    log_c, means, covs = kernels.imm_mix(np.log([0.75, 0.25]), log_transition, xs, Ps)
    assert np.exp(log_c).tolist() == [1.0, 0.0]
    np.testing.assert_allclose(means[:, 0], [1.0, 1.0])
    np.testing.assert_allclose(covs[:, 0, 0], [4.0, 4.0])


@exactly
@given(st.integers(0, 2**32 - 1), st.booleans(), st.integers(1, 3))
def test_a_batch_is_the_loop_over_its_problems(seed, own_noise, m):
    rng = np.random.default_rng(seed)
    b, t, k, n = 5, 2, 3, 4
    P, nu, H = covariance(rng, b, t, n=n), rng.normal(size=(b, t, k, m)), rng.normal(size=(b, t, m, n))
    R, weights = covariance(rng, b, t, k if own_noise else 1, n=m), weights_for(rng, b, t, 1 + k)
    dx, w = kernels.sigma_points(P, 1.0)
    dz = np.sin(dx @ np.swapaxes(H, -1, -2))
    log_prob, log_transition = np.log(weights_for(rng, b, t)), np.log(weights_for(rng, t, t))

    def run(i):
        linear = kernels.evaluate(P[i], nu[i], H[i], R[i])
        return [
            kernels.propagate(P[i], H[i][..., :1, :] + np.eye(n), P[i]),
            *linear,
            *kernels.evaluate_points(dx[i], dz[i], w, nu[i], R[i]),
            *kernels.mixture(P[i], *linear[-2:], weights[i]),
            *kernels.imm_mix(log_prob[i], log_transition, nu[i][..., 0, :], R[i][..., 0, :, :]),
        ]

    for batched, *alone in zip(run(slice(None)), *(run(i) for i in range(b)), strict=True):
        np.testing.assert_allclose(batched, np.stack(alone), rtol=1e-12, atol=1e-12)


REAL = {name: each for name, each in vars(kernels).items() if callable(each)}


def innovate_without_noise(P, nu, H, R):
    return REAL["evaluate"](P, nu, H, 1e-6 * R)


def innovate_without_determinant(P, nu, H, R):
    loglik, distance, log_volume, shift, post = REAL["evaluate"](P, nu, H, R)
    return loglik + log_volume, distance, log_volume, shift, post


def innovate_with_the_first_noise(P, nu, H, R):
    return REAL["evaluate"](P, nu, H, R[..., :1, :, :])


def innovate_in_plain_form(P, nu, H, R):
    """(I - K H) P is symmetric but for rounding."""
    parts = REAL["evaluate"](P, nu, H, R)
    S = H @ P @ np.swapaxes(H, -1, -2) + R[..., 0, :, :]
    K = P @ np.swapaxes(H, -1, -2) @ np.linalg.inv(S)
    return *parts[:-1], ((np.eye(P.shape[-1]) - K @ H) @ P)[..., None, :, :]


def mixture_without_spread(P, shift, post, weights):
    within = np.sum(weights[..., 1:, None, None] * post, axis=-3) + weights[..., :1, None] * P
    return (weights[..., None, 1:] @ shift)[..., 0, :], within


def mixture_without_spread_of_the_miss(P, shift, post, weights):
    mean, cov = REAL["mixture"](P, shift, post, weights)
    return mean, cov - weights[..., :1, None] * mean[..., :, None] * mean[..., None, :]


def imm_mix_transposed(log_prob, log_transition, xs, Ps):
    return REAL["imm_mix"](log_prob, log_transition.T, xs, Ps)


def imm_mix_without_spread(log_prob, log_transition, xs, Ps):
    return *REAL["imm_mix"](log_prob, log_transition, xs, Ps)[:2], REAL["imm_mix"](log_prob, log_transition, 0 * xs, Ps)[2]


MUTANTS = [
    ("evaluate", innovate_without_noise, check_innovate),
    ("evaluate", innovate_without_determinant, check_innovate),
    ("evaluate", innovate_with_the_first_noise, check_innovate),
    ("evaluate", innovate_in_plain_form, check_innovate),
    ("mixture", mixture_without_spread, check_mixture),
    ("mixture", mixture_without_spread_of_the_miss, check_mixture),
    ("imm_mix", imm_mix_transposed, check_imm_mix),
    ("imm_mix", imm_mix_without_spread, check_imm_mix),
]


@pytest.mark.parametrize(("name", "mutant", "check"), MUTANTS, ids=[mutant.__name__ for _, mutant, _ in MUTANTS])
def test_the_checks_bite(monkeypatch, name, mutant, check):
    rng = np.random.default_rng(5)
    t, k, n, m = 2, 3, 4, 2
    problem = covariance(rng, t, n=n), rng.normal(size=(t, k, m)), rng.normal(size=(m, n)), covariance(rng, 1, k, n=m)
    if mutant is innovate_in_plain_form:
        problem = (*problem[:3], problem[3][:, :1])
    if check is check_imm_mix:
        problem = 5, 3, 2, (2,)
    check(*problem)
    monkeypatch.setattr(kernels, name, mutant)
    with pytest.raises(AssertionError):
        check(*problem)
