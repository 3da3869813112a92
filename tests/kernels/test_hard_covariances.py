"""Covariances stay positive semi-definite where the short form breaks."""

import numpy as np
import pytest

from vedette import kernels


def hard_recursion(update, steps=2000, runs=48, n=4, m=2):
    """The least eigenvalue, relative to the deviations, that a covariance has over thousands of steps with sensors whose
    deviations differ by up to 1e6 to either side of the state's; -inf once a variance is not positive.
    """
    rng = np.random.default_rng(11)
    P = np.eye(n) * 10.0 ** rng.uniform(-6, 6, runs)[:, None, None]
    ratios = 10.0 ** rng.uniform(-12, 12, (2, runs))
    F, Q = np.eye(n) + np.eye(n, k=m), np.diag(np.repeat([0.0, 1.0], [m, n - m]))
    least = np.inf
    for step in range(steps):
        H = rng.normal(size=(runs, m, n))
        P = update(P, H, ratios[step % 2, :, None, None] * np.eye(m))
        variance = P.diagonal(axis1=-2, axis2=-1)
        if not np.all(variance > 0):
            return -np.inf
        deviation = np.sqrt(variance)
        least = min(least, np.linalg.eigvalsh(P / (deviation[:, :, None] * deviation[:, None, :])).min())
        if step % 7 == 0:
            P = kernels.propagate(P, F, Q * 10.0 ** rng.uniform(-6, 6))
    return least


def by_kernel(P, H, R):
    return kernels.evaluate(P[:, None], np.zeros((len(P), 1, 0, H.shape[-2])), H[:, None], R[:, None, None])[-1][:, 0, 0]


def by_points(P, H, R):
    dx, weights = kernels.sigma_points(P[:, None], 0.0)
    dz = dx @ np.swapaxes(H, -1, -2)[:, None]
    return kernels.evaluate_points(dx, dz, weights, np.zeros((len(P), 1, 0, H.shape[-2])), R[:, None, None])[-1][:, 0, 0]


def by_update(P, H, R):
    return kernels.update(np.zeros(P.shape[-1]), P, np.zeros(H.shape[-2]), H, R)[1]


def by_scan(P, H, R):
    none = np.zeros((len(P), 1, H.shape[-2]))
    scan = P[:, None], none[:, :0], none, H[:, None], R[:, None, None], 0.9, 0.99, ()
    return kernels.evaluate_returns(*scan).detail.post[:, 0, 0]


def by_modes(P, H, R):
    """One mode, and one return that is surely the target's."""
    n, m = P.shape[-1], H.shape[-2]
    each = [
        kernels.pda_update(np.zeros((1, n)), P[i, None], np.zeros((1, m)), H[i], R[i], 1.0, 1.0, 9.0, 0.0)
        for i in range(len(P))
    ]
    return np.stack([Ps[0] for _, Ps, _ in each])


def without_joseph(P, H, R):
    S = H @ P @ np.swapaxes(H, -1, -2) + R
    K = P @ np.swapaxes(H, -1, -2) @ np.linalg.inv(S)
    post = P - K @ S @ np.swapaxes(K, -1, -2)
    return 0.5 * (post + np.swapaxes(post, -1, -2))


@pytest.mark.parametrize("update", [by_kernel, by_update, by_scan, by_modes, by_points])
@pytest.mark.by_turns
def test_covariances_stay_psd_where_the_short_form_breaks(update):
    assert hard_recursion(update) > -1e-14
    assert hard_recursion(without_joseph) < -1e-6


@pytest.mark.parametrize(("n", "m"), [(6, 3), (9, 3), (8, 4), (12, 6)])
@pytest.mark.by_turns
def test_they_do_so_at_more_axes(n, m):
    for update in (by_update, by_scan):
        assert hard_recursion(update, 400, n=n, m=m) > -1e-14
    assert hard_recursion(without_joseph, 400, n=n, m=m) < -1e-6
