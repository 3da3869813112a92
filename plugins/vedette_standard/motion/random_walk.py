"""Axes that follow a random walk."""

from __future__ import annotations

from typing import ClassVar, final

from attrs import Factory, field, frozen

from vedette import Array, Space, fields, kernels
from vedette_standard.motion.drifting import UNITS, Wandering, drifting


@final
@frozen
class RandomWalk(Wandering):
    """x' = x + w, w ~ N(0, sigma^2 T) per axis: a target that stays in one area, or a bias that drifts without bound.

    With sigma = 0 the axes are constants that are estimated. Its unit is that of the axes over the square root of a second.
    Bar-Shalom, Li, Kirubarajan, Estimation with Applications to Tracking and Navigation, 2001, section 4.3.

    >>> import numpy as np
    >>> model = RandomWalk(0.3, axes=("bias", "other"), unit="rad")
    >>> model.move(np.array([0.1, -0.2]), 4.0).tolist(), model.noise(np.zeros(2), 4.0).round(9).tolist(), str(model.state)
    ([0.1, -0.2], [[0.36, 0.0], [0.0, 0.36]], '(bias [rad], other [rad])')
    >>> len(RandomWalk(0.1, axes=("heading",), unit="rad mod 2pi").state.periods)  # of how many axes
    1
    """

    kind: ClassVar[str] = "random_walk"
    divisible: ClassVar[bool] = True

    sigma: float = fields.quantity("1", "standard deviation gained in 1 s, per axis, in the axes' unit / s^0.5", at_least=0)
    axes: tuple[str, ...] = fields.words("the axes that wander", default=("x", "y"))
    unit: str = fields.choice("the axes' unit; a heading wraps: rad mod 2pi", (*UNITS, "rad mod 2pi"), default="m")
    state: Space = field(init=False, repr=False, eq=False, default=Factory(drifting, takes_self=True))

    def noise(self, x: Array, dt: float) -> Array:
        return kernels.over_axes(((self.sigma**2 * dt,),), len(self.axes))
