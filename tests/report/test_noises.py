"""What innovations say of Q and R, on a scalar filter in its steady state, worked out by hand."""

import numpy as np
import pytest

from vedette_report.noises import at_fault


def played(q, r, n=20_000):
    """Size and lag-1 correlation of the innovations of a random walk with Q = R = 1, followed with Q = q and R = r."""
    rng = np.random.default_rng(1)
    z = np.cumsum(rng.standard_normal(n)) + rng.standard_normal(n)
    p = (q + np.sqrt(q * q + 4 * q * r)) / 2  # the settled prediction's variance
    gain, x, nu = p / (p + r), 0.0, np.empty(n)
    for k in range(n):
        nu[k] = z[k] - x
        x += gain * nu[k]
    return np.mean(nu**2) / (p + r), np.mean(nu[1:] * nu[:-1]) / np.mean(nu**2), n


@pytest.mark.parametrize(
    ("q", "r", "said"),
    [
        (1.0, 1.0, ""),
        (0.05, 1.0, "Q is too small"),
        (20.0, 1.0, "Q is too large"),
        (1.0, 20.0, "R is too large"),
        (1.0, 0.05, "R is too small"),
        (0.2, 0.2, "too small"),
    ],
)
def test_the_culprit_is_named(q, r, said):
    size, whiteness, n = played(q, r)
    told = at_fault(size, whiteness, n, n)
    assert (told == "") if not said else said in told, (size, whiteness, told)


def test_it_does_not_choose_where_the_size_says_nothing():
    """Anticorrelated innovations of the right size: it was once said that R is too small, of a Q that was too large."""
    told = at_fault(0.95, -0.24, 300, 400)
    assert "Q is too large, or R too small" in told
    assert "Q is too small, or R too large" in at_fault(1.05, 0.24, 300, 400)
