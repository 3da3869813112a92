"""Axes that follow a random walk whose rate is held through each step."""

from __future__ import annotations

from typing import ClassVar, final

import numpy as np
from attrs import Factory, field, frozen

from vedette import Array, Space, fields
from vedette_standard.motion.drifting import UNITS, Wandering, drifting


@final
@frozen
class RandomWalkPiecewise(Wandering):
    """x' = x + w T, w ~ N(0, sigma^2) per axis: Q = sigma^2 T^2, as beside a piecewise-constant acceleration.

    The rate is drawn at every step and held through it, so the meaning of `sigma` depends on the step length, and two steps
    do not equal one: for scans at unequal intervals, use `random_walk`.
    Bar-Shalom, Li, Kirubarajan, Estimation with Applications to Tracking and Navigation, 2001, section 6.3.

    >>> model = RandomWalkPiecewise(0.3, axes=("bias", "other"), unit="rad")
    >>> model.move(np.array([0.1, -0.2]), 4.0).tolist(), model.noise(np.zeros(2), 4.0).round(9).tolist(), str(model.state)
    ([0.1, -0.2], [[1.44, 0.0], [0.0, 1.44]], '(bias [rad], other [rad])')
    """

    kind: ClassVar[str] = "random_walk_piecewise"

    sigma: float = fields.quantity("1", "standard deviation of the rate held in a step, in the axes' unit per s", at_least=0)
    axes: tuple[str, ...] = fields.words("the axes that wander", default=("x", "y"))
    unit: str = fields.choice("the axes' unit", UNITS, default="m")
    state: Space = field(init=False, repr=False, eq=False, default=Factory(drifting, takes_self=True))

    def noise(self, x: Array, dt: float) -> Array:
        return (self.sigma * dt) ** 2 * np.eye(len(self.state))
