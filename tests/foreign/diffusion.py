"""Linear stochastic differential equations, discretised exactly."""

from functools import lru_cache

import numpy as np
from scipy.linalg import expm

import vedette

NODES, WEIGHTS = np.polynomial.legendre.leggauss(10)


def discretised(drift, spread, dt):
    """Return F = exp(A dt) and Q = int_0^dt exp(A s) G G' exp(A s)' ds of dx = A x dt + G dW.

    Q is a sum of squares over a step so short that ten nodes are exact to rounding, then doubled: PSD by construction.
    """
    size = np.abs(drift).sum(axis=0).max() * dt
    halvings = max(0, int(np.ceil(np.log2(max(size, 1e-300) / 0.5))))
    step = dt / 2**halvings
    roots = expm(drift * (step * (NODES + 1) / 2)[:, None, None]) @ spread
    noise = np.einsum("s,sir,sjr->ij", step * WEIGHTS / 2, roots, roots)
    move = expm(drift * step)
    for _ in range(halvings):
        noise = noise + move @ noise @ move.T
        move = move @ move
    return move, (noise + noise.T) / 2


@lru_cache(maxsize=4096)
def _matrices(model, dt):
    return discretised(model.drift(), model.spread(), dt)


class Diffusion(vedette.MotionModel):
    """dx = A x dt + G dW: a subclass gives A by `drift` and G by `spread`."""

    divisible = True
    linear = True

    def move(self, x, dt):
        return self.state.canonical(x @ _matrices(self, float(dt))[0].T)

    def jacobian(self, x, dt):
        return _matrices(self, float(dt))[0].copy()

    def noise(self, x, dt):
        return _matrices(self, float(dt))[1].copy()
