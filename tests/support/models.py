"""Linear models of any size, for filters that are exact on them."""

import numpy as np
from attrs import field, frozen

from vedette import MotionModel, Sensor, Space


def space(prefix, n):
    return Space.of(**{f"{prefix}{i}": "m" for i in range(n)})


@frozen(eq=False)
class Linear(MotionModel):
    """x' = (I + A dt) x + w, w ~ N(0, C dt): sums and products of short binary fractions have no rounding."""

    A: np.ndarray
    C: np.ndarray
    state: Space = field(init=False)
    kind = "test_linear"
    linear = True

    @state.default
    def _state(self):
        return space("x", len(self.A))

    def jacobian(self, x, dt):
        return np.eye(len(self.A)) + self.A * dt

    def move(self, x, dt):
        return x @ self.jacobian(x, dt).T

    def noise(self, x, dt):
        return self.C * dt


@frozen(eq=False)
class LinearStep(MotionModel):
    """x' = F x + w, w ~ N(0, Q), whatever the time."""

    F: np.ndarray
    Q: np.ndarray
    kind = "test_linear"
    linear = True

    @property
    def state(self):
        return space("x", len(self.F))

    def jacobian(self, x, dt):
        return self.F

    def move(self, x, dt):
        return x @ self.F.T

    def noise(self, x, dt):
        return self.Q


@frozen(eq=False)
class Looking(Sensor):
    """z = H x + v, v ~ N(0, R), over the first axes of the state, seen with probability `p` among clutter of `density`."""

    H: np.ndarray
    R: np.ndarray
    p: float = 1.0
    density: float = 0.02
    kind = "test_looking"
    linear = True

    @property
    def observes(self):
        return space("x", self.H.shape[1])

    @property
    def measurement(self):
        return space("z", len(self.H))

    def measure(self, x):
        return x @ self.H.T

    def jacobian(self, x):
        return self.H

    def noise(self, x):
        return self.R

    def detects(self, x):
        return np.asarray(self.p)

    def clutter(self, z):
        return np.asarray(self.density)
