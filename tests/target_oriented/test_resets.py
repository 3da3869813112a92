"""Resets, targets at rest, and changes of frame."""

import numpy as np
import pytest

from vedette import Gaussian
from vedette_target_oriented.certain import TargetOrientedCertain
from vedette_target_oriented.consistent import TargetOriented
from vedette_target_oriented.literal import TargetOrientedLiteral
from vedette_target_oriented.resets import cartesian, in_frame
from vedette_target_oriented.smoothed import TargetOrientedSmoothed

RESETTING = (TargetOrientedLiteral, TargetOrientedCertain)


def test_a_filtered_heading_lags_by_its_gain():
    """The short way round: from 3.0 rad towards -3.0 rad it goes on beyond pi; with a gain of 1 it is the direction."""
    model = TargetOrientedSmoothed(2.0, 10.0, heading_gain=0.25)
    apart = 2 * np.pi - 6.0
    np.testing.assert_allclose(model.steer(np.array([3.0, 0.0]), np.array([-3.0, 1.0])), [3.0 + apart / 4, 0.25])
    way = np.array([np.cos(1.0), np.sin(1.0)])
    here = Gaussian(np.array([[*way, 5, 1, 0.0, 0, 0]]), np.eye(7)[None])
    assert model.reframe(here, here).mean[0, 4] == pytest.approx(0.25)
    assert TargetOrientedSmoothed(2.0, 10.0, heading_gain=1.0).reframe(here, here).mean[0, 4] == pytest.approx(1.0)
    np.testing.assert_array_equal(model.reframe(here, here).cov, here.cov)


# No motion, no heading.
def test_a_target_at_rest():
    model = TargetOriented(3.0, 10.0, side_accel=60.0)
    x = np.array([[1.0, 2, 0, 0], [1, 2, 0.3, 0.4], [1, 2, 1e-300, 0]])
    assert np.all(np.isfinite(model.jacobian(x, 1.0)))
    np.testing.assert_array_equal(model.move(x, 1.0)[0], x[0])
    Q = model.noise(x, 1.0)
    np.testing.assert_allclose(Q[0, 2:, 2:], (9.0 + 100.0) / 2 * np.eye(2))  # no direction is preferred
    assert np.all(np.linalg.eigvalsh(Q[:, 2:, 2:])[:, 0] >= 9.0 - 1e-9)
    np.testing.assert_allclose(np.trace(Q[:, 2:, 2:], axis1=1, axis2=2), 109.0)
    fast = model.noise(np.array([0.0, 0, 3, 4]), 1.0)[2:, 2:]
    np.testing.assert_allclose(np.linalg.eigvalsh(fast), [9.0, 100.0])


@pytest.mark.parametrize("kind", RESETTING)
@pytest.mark.parametrize("way", [(3.0, 4.0), (-3.0, 4.0), (-3.0, -4.0), (3.0, -4.0), (0.0, -2.0)])
def test_the_reset(kind, way):
    """Heading from the last two combined positions, in its own quadrant; v_side anew; the covariance as the kind says."""
    combined = Gaussian(np.array([[10.0, 20, 5, 1, 0.1, 10 - way[0], 20 - way[1]]]), np.zeros((1, 7, 7)))
    root = np.tril(np.arange(1.0, 17).reshape(4, 4))
    cov = np.zeros((1, 7, 7))
    cov[0, :4, :4] = root @ root.T
    own = Gaussian(np.array([[11.0, 21, 6, 2, 0.2, 0, 0]]), cov)
    settled = kind(2.0, 10.0, side_speed=-70.0).reframe(own, combined)
    np.testing.assert_allclose(settled.mean[0], [11, 21, 6, -70, np.arctan2(way[1], way[0]), 10, 20])
    expected = cov.copy()
    if kind is TargetOrientedCertain:
        expected[0, 3] = expected[0, :, 3] = 0
    np.testing.assert_array_equal(settled.cov, expected)
    np.testing.assert_array_equal(own.mean[0, 3:], [2, 0.2, 0, 0])


@pytest.mark.parametrize("kind", RESETTING)
def test_the_heading_stays_where_there_was_no_motion(kind):
    still = Gaussian(np.array([[10.0, 20, 5, 1, -2.5, 10, 20]]), np.zeros((1, 7, 7)))
    assert kind(2.0, 10.0).reframe(still, still).mean[0, 4] == -2.5


@pytest.mark.parametrize("kind", [TargetOriented, *RESETTING])
@pytest.mark.parametrize(
    ("forward", "side", "message"), [(0, 1, "sigma_forward: must be > 0"), (1, -2, "sigma_side: must be > 0")]
)
def test_noise_that_is_none_is_refused(kind, forward, side, message):
    with pytest.raises(ValueError, match=message):
        kind(forward, side)


def test_there_and_back_again():
    rng = np.random.default_rng(0)
    root = rng.standard_normal((5, 4, 4))
    prior = Gaussian(100 * rng.standard_normal((5, 4)), root @ np.swapaxes(root, -1, -2))
    framed = in_frame(prior, np.zeros((5, 2)))
    np.testing.assert_allclose(framed.mean[:, 3], 0, atol=1e-12)
    np.testing.assert_allclose(framed.mean[:, 2], np.hypot(*prior.mean[:, 2:].T))
    back = cartesian(TargetOrientedLiteral(1.0, 1.0).state, framed)
    np.testing.assert_allclose(back.mean, prior.mean, atol=1e-10)
    np.testing.assert_allclose(back.cov, prior.cov, atol=1e-10)
