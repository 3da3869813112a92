"""The kernels of the textbook's IMM-PDAF on stacked modes, against its hypotheses one at a time."""

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from vedette import kernels

exactly = settings(max_examples=60)
P_DETECT, P_GATE, LOG_DENSITY = 0.8, 0.95, -3.0


def covariance(rng, *shape, n):
    a = rng.normal(size=(*shape, n, n + 1))
    return a @ np.swapaxes(a, -1, -2) + 0.1 * np.eye(n)


def moments(weights, means, covs):
    mean = sum(w * x for w, x in zip(weights, means, strict=True))
    parts = zip(weights, means, covs, strict=True)
    return mean, sum(w * (P + np.outer(x - mean, x - mean)) for w, x, P in parts)


def close(actual, expected):
    np.testing.assert_allclose(actual, expected, rtol=1e-9, atol=1e-9)


def hypotheses(x, P, z, H, R):
    """Of every return: squared distance, its density over that of clutter, mean and covariance if it is the target's."""
    S = H @ P @ H.T + R
    K = P @ H.T @ np.linalg.inv(S)
    for one in z:
        nu = one - H @ x
        distance = nu @ np.linalg.solve(S, nu)
        density = np.exp(-0.5 * distance) / np.sqrt(np.linalg.det(2 * np.pi * S))
        yield distance, density / np.exp(LOG_DENSITY), x + K @ nu, P - K @ S @ K.T


def check_pda_update(seed, r, n, m, k, batch, limit):
    rng = np.random.default_rng(seed)
    xs, Ps, z = rng.normal(size=(*batch, r, n)), covariance(rng, *batch, r, n=n), 3 * rng.normal(size=(*batch, k, m))
    H, R = rng.normal(size=(m, n)), covariance(rng, n=m)
    means, covs, loglik = kernels.pda_update(xs, Ps, z, H, R, P_DETECT, P_GATE, limit, LOG_DENSITY)
    np.testing.assert_array_equal(covs, np.swapaxes(covs, -1, -2))
    for i in np.ndindex(batch):
        all_of = [list(hypotheses(xs[i][j], Ps[i][j], z[i], H, R)) for j in range(r)]
        inside = [min(modes[h][0] for modes in all_of) <= limit for h in range(k)]
        for j in range(r):
            seen = [given for given, counts in zip(all_of[j], inside, strict=True) if counts]
            weights = np.array([1 - P_DETECT * P_GATE, *(P_DETECT * ratio for _, ratio, _, _ in seen)])
            close(loglik[i][j], np.log(weights.sum()))
            mean, cov = moments(
                weights / weights.sum(), [xs[i][j], *(x for *_, x, _ in seen)], [Ps[i][j], *(P for *_, P in seen)]
            )
            close(means[i][j], mean)
            close(covs[i][j], cov)


@exactly
@given(
    st.integers(0, 2**32 - 1),
    st.integers(1, 3),
    st.integers(1, 5),
    st.integers(1, 3),
    st.integers(0, 4),
    st.sampled_from([(), (9,), (2, 3), (0,)]),
    st.sampled_from([2.0, 9.0, np.inf]),
)
def test_pda_update_is_the_mixture_of_its_hypotheses_in_a_common_gate(seed, r, n, m, k, batch, limit):
    check_pda_update(seed, r, n, m, k, batch, limit)


def check_imm_combine(seed, r, n, batch):
    rng = np.random.default_rng(seed)
    prob, likelihood = rng.dirichlet(np.ones(r), size=batch), rng.gamma(1.0, size=(*batch, r))
    xs, Ps = rng.normal(size=(*batch, r, n)), covariance(rng, *batch, r, n=n)
    log_after, mean, cov, loglik = kernels.imm_combine(np.log(prob), np.log(likelihood), xs, Ps)
    np.testing.assert_array_equal(cov, np.swapaxes(cov, -1, -2))
    for i in np.ndindex(batch):
        joint = prob[i] * likelihood[i]
        close(loglik[i], np.log(joint.sum()))
        close(np.exp(log_after[i]), joint / joint.sum())
        one, spread = moments(joint / joint.sum(), xs[i], Ps[i])
        close(mean[i], one)
        close(cov[i], spread)


@exactly
@given(st.integers(0, 2**32 - 1), st.integers(1, 4), st.integers(1, 5), st.sampled_from([(), (9,), (2, 3), (0,)]))
def test_imm_combine_is_bayes_rule_and_the_mixture(seed, r, n, batch):
    check_imm_combine(seed, r, n, batch)


REAL = {name: getattr(kernels, name) for name in ("pda_update", "imm_combine")}


def pda_with_a_gate_of_each_mode(xs, Ps, *given):
    parts = [REAL["pda_update"](xs[..., [j], :], Ps[..., [j], :, :], *given) for j in range(xs.shape[-2])]
    return tuple(np.concatenate([part[i] for part in parts], axis=1) for i in range(3))


def pda_without_the_gates_probability(xs, Ps, z, H, R, p_detect, p_gate, limit, log_density):
    return REAL["pda_update"](xs, Ps, z, H, R, p_detect, 1.0, limit, log_density)


def combined_without_spread(log_prob, loglik, xs, Ps):
    after, mean, _, total = REAL["imm_combine"](log_prob, loglik, xs, Ps)
    return after, mean, REAL["imm_combine"](log_prob, loglik, 0 * xs, Ps)[2], total


@pytest.mark.parametrize(
    ("name", "mutant", "check"),
    [
        ("pda_update", pda_with_a_gate_of_each_mode, lambda: check_pda_update(1, 2, 4, 2, 4, (9,), 4.0)),
        ("pda_update", pda_without_the_gates_probability, lambda: check_pda_update(1, 2, 4, 2, 3, (9,), 9.0)),
        ("imm_combine", combined_without_spread, lambda: check_imm_combine(1, 2, 3, (2,))),
    ],
)
def test_the_checks_bite(monkeypatch, name, mutant, check):
    check()
    monkeypatch.setattr(kernels, name, mutant)
    with pytest.raises(AssertionError):
        check()
