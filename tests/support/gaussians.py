"""Random covariances and draws."""

import numpy as np
from hypothesis import strategies as st


def covariances(rng, *shape, orders=4):
    """Positive definite matrices with axes of unlike size, `orders` of magnitude up and down, as position and turn rate."""
    root = rng.normal(size=(*shape, shape[-1]))
    size = 10.0 ** rng.uniform(-orders, orders, size=shape[-1])
    return (root @ np.swapaxes(root, -1, -2) + 0.1 * np.eye(shape[-1])) * size[:, None] * size


def draw(rng, cov, count):
    """`count` errors of a right filter."""
    return rng.normal(size=(count, len(cov))) @ np.linalg.cholesky(cov).T


seeds = st.integers(0, 2**32 - 1).map(np.random.default_rng)
