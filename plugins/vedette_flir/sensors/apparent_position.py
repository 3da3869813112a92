"""The common part of all cameras: the target appears at the sum of its dynamics and its jitter."""

from __future__ import annotations

import numpy as np
from attrs import Factory, field, frozen

from vedette import Array, ImagingSensor, Space, fields

APPARENT = Space.of(x="px", y="px")
APPEARANCE = {"amplitude": "count", "spread": "px", "background": "count"}


def _observed(self: ApparentPosition) -> Space:
    where = dict.fromkeys((*self.across, *self.down), "px")
    if len(where) < len(self.across) + len(self.down) or not self.across or not self.down:
        raise ValueError(f"across, down: must name at least one axis each, none twice, got {self.across}, {self.down}")
    return Space.of(**where, **self.appearance())


def _select(self: ApparentPosition) -> Array:
    chosen = np.zeros((2, len(self.observes)))
    chosen[0, : len(self.across)] = 1.0
    chosen[1, len(self.across) : len(self.across) + len(self.down)] = 1.0
    return chosen


@frozen(kw_only=True)
class ApparentPosition(ImagingSensor):
    """A camera that sees a target at the sum of some of its axes, in px, and reads further axes for its appearance."""

    across: tuple[str, ...] = fields.words("the axes whose sum is the apparent x, the column", default=("x",))
    down: tuple[str, ...] = fields.words("the axes whose sum is the apparent y, the row", default=("y",))
    detection_probability: float = fields.probability("probability that the target is to be seen in a frame", default=1.0)
    observes: Space = field(init=False, repr=False, eq=False, default=Factory(_observed, takes_self=True))
    _chosen: Array = field(init=False, repr=False, eq=False, default=Factory(_select, takes_self=True))

    def appearance(self) -> dict[str, str]:
        """Return axis to unit of what it reads beyond the position."""
        return APPEARANCE

    @property
    def measurement(self) -> Space:
        return APPARENT

    def measure(self, x: Array) -> Array:
        """Return where it appears: (*b, n) -> (*b, 2)."""
        return x @ self._chosen.T

    def jacobian(self, x: Array) -> Array:
        """Return H (2, n)."""
        return self._chosen

    def detects(self, x: Array) -> Array:
        """Return the detection probability: ()."""
        return np.asarray(self.detection_probability)

    def looks(self, x: Array) -> tuple[Array, ...]:
        """Return the axes beyond the position (*b, n) -> (*b) each, in the order of `appearance`."""
        first = len(self.across) + len(self.down)
        return tuple(x[..., i] for i in range(first, x.shape[-1]))
