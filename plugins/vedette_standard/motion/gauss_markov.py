"""Axes that fluctuate about zero: biases."""

from __future__ import annotations

import math
from typing import ClassVar, final

from attrs import Factory, field, frozen

from vedette import Array, MotionModel, Space, fields, kernels
from vedette_standard.motion.drifting import UNITS, drifting


@final
@frozen
class GaussMarkov(MotionModel):
    """First-order Gauss-Markov process, which sampled is AR(1): x' = e x + w, e = exp(-T/tau), w ~ N(0, sigma^2 (1 - e^2)).

    Each axis has the stationary standard deviation sigma and the autocorrelation exp(-|lag|/tau): a measurement's error that
    is correlated over scans, as a state axis of its own beside the target's.
    Bar-Shalom, Li, Kirubarajan, Estimation with Applications to Tracking and Navigation, 2001, section 8.2.

    >>> import numpy as np
    >>> model, e = GaussMarkov(("bias", "other"), sigma=0.3, tau=8.0, unit="rad"), np.exp(-0.25)
    >>> np.allclose(model.move(np.array([0.1, -0.2]), 2.0), [0.1 * e, -0.2 * e]), str(model.state)
    (True, '(bias [rad], other [rad])')
    >>> np.allclose(model.jacobian(np.zeros(2), 2.0), e * np.eye(2))
    True
    >>> np.allclose(model.noise(np.zeros(2), 2.0), 0.09 * (1.0 - e * e) * np.eye(2))
    True
    """

    kind: ClassVar[str] = "gauss_markov"
    divisible: ClassVar[bool] = True
    linear: ClassVar[bool] = True

    axes: tuple[str, ...] = fields.words("the axes that wander")
    sigma: float = fields.quantity("1", "stationary standard deviation, in the axes' own unit", above=0)
    tau: float = fields.quantity("s", "time after which a value is down to 1/e", above=0)
    unit: str = fields.choice("the axes' unit", UNITS, default="m")
    state: Space = field(init=False, repr=False, eq=False, default=Factory(drifting, takes_self=True))

    def move(self, x: Array, dt: float) -> Array:
        return x * math.exp(-dt / self.tau)

    def jacobian(self, x: Array, dt: float) -> Array:
        return kernels.over_axes(((math.exp(-dt / self.tau),),), len(self.axes))

    def noise(self, x: Array, dt: float) -> Array:
        return kernels.over_axes(((-(self.sigma**2) * math.expm1(-2 * dt / self.tau),),), len(self.axes))
