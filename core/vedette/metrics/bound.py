"""What the truth is drawn from, for the posterior Cramer-Rao bound: `vedette_standard.whole_tracks` computes it."""

from __future__ import annotations

from typing import final

import numpy as np
from attrs import frozen

from vedette import fields
from vedette.roles import MotionModel
from vedette.space import Array


@final
@frozen
class Bound:
    """What the truth is drawn from, for the posterior Cramer-Rao bound of the position."""

    motion: MotionModel = fields.part("how the objects move")
    start: dict[str, float] = fields.table(
        "axis to the standard deviation with which a state is known before its first scan"
    )
    method: str = fields.choice(
        "how failed detections enter: the information of each scan times its detection probability, or sequences of them",
        ("information_reduction", "enumeration"),
        default="information_reduction",
    )

    def __attrs_post_init__(self) -> None:
        space = self.motion.state
        if sorted(self.start) != sorted(space.names):
            raise ValueError(f"start: must give the axes {', '.join(space.names)}, got {', '.join(self.start) or 'none'}")
        if wrong := [name for name, deviation in self.start.items() if deviation < 0]:
            raise ValueError(f"start: {wrong[0]}: the standard deviation must be >= 0, got {self.start[wrong[0]]:g}")

    @property
    def covariance(self) -> Array:
        """The covariance (n, n) at an object's first scan, before it."""
        return np.diag([self.start[name] ** 2 for name in self.motion.state.names])
