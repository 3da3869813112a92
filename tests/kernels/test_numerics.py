"""Sums of logarithms, and numerical derivatives."""

import numpy as np
from hypothesis import given, settings
from hypothesis import strategies as st

from vedette import Space, kernels

exactly = settings(max_examples=60)


def test_log_sum_and_safe_log_at_their_edges():
    a = np.array([[-np.inf, -np.inf], [-np.inf, 3.0], [-1000.0, -1000.0], [1000.0, 999.0]])
    np.testing.assert_allclose(
        kernels.log_sum(a), [-np.inf, 3.0, -1000 + np.log(2), 1000 + np.log1p(np.exp(-1))], rtol=1e-15
    )
    assert kernels.log_sum(a, axis=0).shape == (2,)
    assert -709 < kernels.safe_log(np.zeros(1))[0] < -708
    assert kernels.safe_log(np.array([0.3]))[0] == np.log(0.3)


POLAR = Space.of(range="m", bearing="rad mod 2pi")


def polar(x, origin):
    d = x - origin
    return np.stack([np.hypot(d[..., 0], d[..., 1]), np.arctan2(d[..., 1], d[..., 0])], axis=-1)


@exactly
@given(st.floats(10.0, 1e4), st.floats(-np.pi, np.pi), st.sampled_from([0.0, 5e5, 6e6]), st.sampled_from([(), (3,), (2, 2)]))
def test_numerical_jacobian_is_the_derivative(distance, bearing, origin, batch):
    """Across the cut of the bearing, and in map coordinates thousands of km from their origin with the sensor near by."""
    d = distance * np.array([np.cos(bearing), np.sin(bearing)])
    x = np.broadcast_to(d + origin, (*batch, 2))
    dx, dy = (x - origin)[..., 0].flat[0], (x - origin)[..., 1].flat[0]
    r2 = dx**2 + dy**2
    expected = np.array([[dx / r2**0.5, dy / r2**0.5], [-dy / r2, dx / r2]])
    found = kernels.numerical_jacobian(lambda y: polar(y, origin), x, POLAR.difference)
    assert found.shape == (*batch, 2, 2)
    scale = np.array([1.0, 1 / r2**0.5])[:, None]
    np.testing.assert_allclose(found / scale, np.broadcast_to(expected / scale, found.shape), atol=1e-5)
    unwrapped = kernels.numerical_jacobian(lambda y: polar(y, origin), np.array([origin - 10.0, origin]), np.subtract)
    assert np.abs(unwrapped[1]).max() > 10  # what a plain difference makes of a bearing of pi
