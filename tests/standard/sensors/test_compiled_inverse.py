"""Where a return by range and bearing says that a target is, is the same compiled as in numpy."""

import numpy as np
import pytest

from vedette_standard import compiled
from vedette_standard.sensors.range_bearing import from_polar

pytestmark = pytest.mark.skipif(not hasattr(from_polar, "__wrapped__"), reason="numpy runs")


@pytest.mark.parametrize("k", [0, 1, 5])
def test_compiled_and_in_numpy_they_agree(k):
    rng = np.random.default_rng(0)
    z = np.stack([rng.uniform(0, 4000, k), rng.uniform(-np.pi, np.pi, k)], axis=-1)
    root = rng.normal(size=(k, 2, 2)) * [[10.0], [0.01]]
    given = z, root @ np.swapaxes(root, -1, -2), np.array(50.0), np.array(-20.0), 0.3
    own = compiled._module.from_polar(*given)
    for got, wanted in zip(own, from_polar.__wrapped__(*given), strict=True):
        assert got.shape == wanted.shape
        np.testing.assert_allclose(got, wanted, rtol=1e-12, atol=1e-9)


def test_what_the_compiled_one_does_not_take_goes_to_numpy():
    z, R = np.array([[[900.0, 0.5]], [[700.0, -3.0]]]), np.broadcast_to(np.diag([25.0, 1e-4]), (2, 1, 2, 2))
    poses = np.array([0.0, 100.0]), np.zeros(2), np.array([0.0, 0.2])
    assert compiled._module.from_polar(z, R.copy(), *poses) is None
    assert compiled._module.from_polar(z[:, 0], R[:, 0].copy(), *poses) is None
    assert compiled._module.from_polar(z[0], R[0], 0.0, 0.0) is None
    mean, _ = from_polar(z, R, *poses)
    np.testing.assert_allclose(mean[1, 0] - [100.0, 0.0], 700 * np.exp(5e-5) * np.array([np.cos(-2.8), np.sin(-2.8)]))
