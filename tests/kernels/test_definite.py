"""No kernel makes an indefinite covariance, whatever the scales of prior and noise: both twins, every instruction set."""

from fractions import Fraction
from functools import partial

import numpy as np
import pytest
from hypothesis import example, given, settings
from hypothesis import strategies as st

from vedette import kernels
from vedette.kernels import modes, reference

LEAST = -4e-12  # smallest eigenvalue of a covariance's correlations: a thousandth is lost at most by the short form

PREDICTED = 5 * LEAST
"""The same after a prediction F P F' + Q, whose own rounding comes first: the worst that was found is -6e-12."""


def twins():
    """Each instruction set's kernels, and the reference: a name and a function that gives a kernel by its name."""
    found = [("numpy", lambda name: getattr(reference, name, None) or getattr(modes, name))]
    if kernels.update is not reference.update:
        from vedette.kernels import _compiled

        def on(instruction_set, name):
            def call(*given):
                usual = _compiled.instruction_set()
                _compiled.use(instruction_set)
                try:
                    return getattr(_compiled, name)(*given)
                finally:
                    _compiled.use(usual)

            return call

        found += [(each, partial(on, each)) for each in _compiled.instruction_sets()]
    return found


TWINS = twins()


def smallest(cov):
    """The smallest eigenvalue of the correlations of covariances (*b, n, n); -inf where a number is none."""
    variance = np.diagonal(cov, axis1=-2, axis2=-1)
    if not np.all(np.isfinite(cov)) or np.any(variance < 0):
        return -np.inf
    deviation = np.sqrt(np.where(variance > 0, variance, 1.0))
    return np.linalg.eigvalsh(cov / deviation[..., :, None] / deviation[..., None, :]).min(initial=np.inf)


def assert_covariances(cov, what, least=LEAST):
    np.testing.assert_array_equal(cov, np.swapaxes(cov, -1, -2), err_msg=what)
    assert smallest(cov) >= least, what


class Problem:
    """Priors (b, n, n), rows H (b, m, n) and noises (b, m, m) of any scale, correlated up to the last digit."""

    def __init__(self, seed, n, m, batch, decades, lost):
        rng = self.rng = np.random.default_rng(seed)
        self.n, self.m, self.b = n, m, batch
        scale = 10.0 ** rng.uniform(-decades / 2, decades / 2, (batch, n, 1))
        parts = rng.normal(size=(batch, n, n)) * 10.0 ** rng.uniform(-lost, 0, (batch, 1, n))
        P = (scale * parts) @ np.swapaxes(scale * parts, -1, -2)
        self.P = 0.5 * (P + np.swapaxes(P, -1, -2))
        unit = rng.normal(size=(batch, m, n)) if rng.random() < 0.5 else np.eye(n)[:m] + np.zeros((batch, 1, 1))
        self.H = unit / np.swapaxes(scale, -1, -2) * np.median(scale)
        a = rng.normal(size=(batch, m, m + 1))
        noise = 10.0 ** rng.uniform(-decades / 2, decades / 2, (batch, m, 1))
        self.R = (noise * a) @ np.swapaxes(noise * a, -1, -2)
        self.R = 0.5 * (self.R + np.swapaxes(self.R, -1, -2))
        self.x, self.z = rng.normal(size=(batch, n)), rng.normal(size=(batch, m))


def covariances_of(kernel, p):
    """Name to covariances, by every way to one."""
    x, P, H, R, z = p.x, p.P, p.H, p.R, p.z
    none = np.zeros((p.b, 1, p.m))
    yield "update", kernel("update")(x, P, z, H, R)[1]
    F = np.eye(p.n) + np.eye(p.n, k=max(p.n // 2, 1))
    yield "filter_step", kernel("filter_step")(x, P, F, np.zeros((p.n, p.n)), z, H, R)[1]
    scan = P[:, None], z[:, None], none, H[:, None], R[:, None, None], 0.9, 0.99, ()
    detail = kernel("evaluate_returns")(*scan).detail
    yield "evaluate_returns", detail.post[:, 0, 0]
    for weight in (1e-9, 0.5, 1.0):
        weights = np.broadcast_to([1.0 - weight, weight], (p.b, 1, 2))
        yield (
            f"weighted_update by {weight}",
            kernel("weighted_update")(x[:, None], P[:, None], detail.shift, detail.post, weights, ()).cov[:, 0],
        )
    for density in (-30.0, 0.0, 30.0):
        pda = x[:, None], P[:, None], np.stack([z, 0.9 * z], axis=1), H, R, 0.9, 0.99, np.inf, density
        yield f"pda_update among {density}", kernel("pda_update")(*pda)[1][:, 0]
    dx, weights = reference.sigma_points(P, 0.5)
    points = dx[:, None], (dx @ np.swapaxes(H, -1, -2))[:, None], weights, z[:, None, None], R[:, None, None]
    yield "evaluate_points", kernel("evaluate_points")(*points)[-1][:, 0, 0]
    log_half = np.log(np.full((p.b, 2), 0.5))
    modes = np.stack([P, kernel("update")(x, P, z, H, R)[1]], axis=1)
    transition = np.log([[0.9, 0.1], [0.1, 0.9]])
    xs = np.stack([x, x], axis=1)
    yield "imm_mix", kernel("imm_mix")(log_half, transition, xs, modes)[2]
    yield "imm_combine", kernel("imm_combine")(log_half, log_half, xs, modes)[2]


@settings(max_examples=60)
@given(
    st.integers(0, 2**32 - 1),
    st.integers(1, 7),
    st.integers(1, 4),
    st.sampled_from([1, 8, 11]),
    st.sampled_from([2.0, 9.0, 18.0]),
    st.sampled_from([0.0, 4.0, 9.0]),
)
@example(0, 4, 2, 11, 18.0, 0.0)
@example(1, 6, 3, 11, 18.0, 9.0)
@pytest.mark.costly
def test_no_kernel_makes_an_indefinite_covariance(seed, n, m, batch, decades, lost):
    problem = Problem(seed, n, min(m, n), batch, decades, lost)
    for twin, kernel in TWINS:
        for way, cov in covariances_of(kernel, problem):
            assert_covariances(cov, f"{way} on {twin}", PREDICTED if way == "filter_step" else LEAST)


def exact_update(P, H, R):
    """The posterior covariance of these very numbers, in rational ones, with one row H."""
    P, h = [[Fraction(a) for a in row] for row in P.tolist()], [Fraction(a) for a in H[0].tolist()]
    cross = [sum(a * b for a, b in zip(row, h, strict=True)) for row in P]
    S = sum(a * b for a, b in zip(h, cross, strict=True)) + Fraction(R[0, 0])
    return np.array([[float(P[i][j] - cross[i] * cross[j] / S) for j in range(len(P))] for i in range(len(P))])


@pytest.mark.parametrize("twin", [name for name, _ in TWINS])
@pytest.mark.parametrize("speed", [1e3, 1e6, 1e9])
@pytest.mark.parametrize("sigma", [1.0, 1e-3, 1e-9])
def test_what_digits_the_prior_has_are_kept(twin, speed, sigma):
    """Of a position that was seen once and a speed of which nothing is known: position and speed after the second sight.

    Their prior correlation is 1 - 1e-18 at worst. What is lost is what a rounding of the prior makes of it, and no more.
    """
    kernel = dict(TWINS)[twin]
    F, H, R = np.array([[1.0, 1.0], [0.0, 1.0]]), np.eye(1, 2), np.array([[sigma**2]])
    P = F @ np.diag([sigma**2, speed**2]) @ F.T
    exact = exact_update(P, H, R)
    found = kernel("update")(np.zeros(2), P, np.zeros(1), H, R)[1]
    rounding = 1e-14 * np.diag(P)[1]
    assert abs(found[0, 0] / sigma**2 - 1.0) < 1e-6
    assert max(exact[1, 1] * (1 - 1e-9) - rounding, 0.0) <= found[1, 1] <= exact[1, 1] * (1 + 1e-9) + rounding
    assert smallest(found) >= LEAST


@pytest.mark.parametrize("twin", [name for name, _ in TWINS])
def test_noise_far_below_the_prior_along_nearly_parallel_rows(twin):
    """The two rows' S is singular to the last digit, so neither its inverse nor its determinant has any."""
    kernel = dict(TWINS)[twin]
    P, H, R = np.diag([1e16, 2e16, 1.0]), np.array([[1.0, 1.0, 0.0], [1.0, 1.0, 1e-3]]), 1e-6 * np.eye(2)
    _, cov, loglik = kernel("update")(np.zeros(3), P, np.array([1.0, 1.0]), H, R)
    assert_covariances(cov, twin)
    log_det = np.log(3e16 * (1e-6 + 1e-6 + 1e-6))  # S is 3e16 [1 1; 1 1] + diag(0, 1e-6) + R
    assert loglik == pytest.approx(-0.5 * log_det - np.log(2 * np.pi), rel=1e-3)


@pytest.mark.parametrize(("name", "kernel"), TWINS, ids=[name for name, _ in TWINS])
def test_a_noise_as_flat_as_the_prior_leaves_a_covariance(name, kernel):
    """|R| is a good part of |S|, yet S is all but singular: what is computed by its inverse has lost the digits."""
    rng = np.random.default_rng(4)
    turn, flat = rng.uniform(0, 2 * np.pi, 512), 10.0 ** rng.uniform(-14, -4, 512)
    along = np.stack([np.cos(turn), np.sin(turn)], axis=-1)
    across = np.stack([-along[:, 1], along[:, 0]], axis=-1)
    R = along[:, :, None] * along[:, None] + flat[:, None, None] * across[:, :, None] * across[:, None]
    P = np.zeros((512, 4, 4))
    P[:, :2, :2] = R * 10.0 ** rng.uniform(-1, 1, (512, 1, 1))
    P[:, [2, 3], [2, 3]] = 10.0 ** rng.uniform(-2, 2, (512, 2))
    F = np.eye(4) + np.zeros((512, 1, 1))
    F[:, 0, 2] = F[:, 1, 3] = 10.0 ** rng.uniform(-8, 0, 512)
    P = F @ P @ np.swapaxes(F, -1, -2)
    P, R = 0.5 * (P + np.swapaxes(P, -1, -2)), 0.5 * (R + np.swapaxes(R, -1, -2))
    z, H = np.zeros((1, 1, 2)), np.eye(4)[:2]
    post = kernel("evaluate_returns")(P[None], z, np.zeros((1, 512, 2)), H, R[None, :, None], 0.9, 0.99, ()).detail.post
    assert smallest(post) >= LEAST, name
