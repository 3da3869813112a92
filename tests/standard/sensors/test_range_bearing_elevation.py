"""Range, bearing and elevation against spherical coordinates."""

import numpy as np
import pytest

from vedette import Gaussian, Pose
from vedette_standard.sensors.range_bearing_elevation import RangeBearingElevation

SPACE = RangeBearingElevation(10.0, 0.02, 0.03, z=15.0)
POSE = Pose(np.array([300.0, -200.0]), np.array([4.0, -3.0]), 0.7)


# In space.
def test_range_bearing_and_elevation_are_spherical_coordinates():
    r, b, e = 900.0, 0.4, -0.3
    there = SPACE.at(POSE)
    place = np.array([300.0, -200.0, 15.0])
    ahead = np.array([np.cos(b + 0.7) * np.cos(e), np.sin(b + 0.7) * np.cos(e), np.sin(e)])
    np.testing.assert_allclose(there.measure(place + r * ahead), [r, b, e], rtol=1e-13)
    np.testing.assert_allclose(there.invert(np.array([[r, b, e]])).mean[0], place + r * ahead, rtol=1e-13)
    aloft = SPACE.at(Pose(np.array([300.0, -200.0, 500.0]), heading=0.7))
    np.testing.assert_allclose(aloft.measure(place + r * ahead + [0, 0, 485]), [r, b, e], rtol=1e-13)


def inversion_has_the_moments_it_states(sensor, z):
    """Against Gauss-Hermite quadrature over the errors of range, bearing and elevation."""
    nodes, weights = np.polynomial.hermite_e.hermegauss(16)
    grid = np.stack(np.meshgrid(nodes, nodes, nodes, indexing="ij"), axis=-1).reshape(-1, 3)
    w = np.prod(np.stack(np.meshgrid(weights, weights, weights, indexing="ij"), axis=-1).reshape(-1, 3), axis=-1)
    w /= np.sum(w)
    found = sensor.invert(z[None])
    true = z + grid * np.sqrt(np.diag(sensor.noise(z)))
    r, b, e = true.T
    apart = np.stack([r * np.cos(b) * np.cos(e), r * np.sin(b) * np.cos(e), r * np.sin(e)], axis=-1)
    apart = apart + [sensor.x, sensor.y, sensor.z] - found.mean
    scale = np.sqrt(np.diagonal(found.cov[0]))
    square = (apart / scale).T @ (w[:, None] * apart / scale)
    np.testing.assert_allclose(found.cov[0] / np.outer(scale, scale), square, rtol=0, atol=1e-9)
    assert np.linalg.eigvalsh(found.cov[0] / np.outer(scale, scale))[0] > 0


@pytest.mark.parametrize("z", [[900.0, 0.4, -0.3], [5e4, -3.0, 1.2], [0.0, 0.0, 0.0], [500.0, 1.0, np.pi / 2]])
def test_a_return_in_space_states_the_mean_square_of_its_error(z):
    inversion_has_the_moments_it_states(SPACE, np.array(z))


def test_the_law_of_inversion_bites():
    class Naive:
        """To first order in the errors, as J R J'."""

        x = y = 0.0
        z = 15.0
        noise = staticmethod(SPACE.noise)

        def invert(self, z):
            found = SPACE.invert(z)
            J = np.linalg.inv(SPACE.jacobian(found.mean))
            return Gaussian(found.mean, J @ SPACE.noise(z) @ np.swapaxes(J, -1, -2))

    with pytest.raises(AssertionError):
        inversion_has_the_moments_it_states(Naive(), np.array([900.0, 0.4, -0.3]))
