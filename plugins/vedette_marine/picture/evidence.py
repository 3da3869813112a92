"""A return's appearance as a log-likelihood ratio of ship to clutter: sea spikes are faint and small."""

from __future__ import annotations

from typing import final

import numpy as np
from attrs import frozen

from vedette import Array, fields
from vedette_marine.picture.chain import Groups


@final
@frozen
class Excess:
    """Excess over the least value that is reported: exponential, with one mean for clutter and one for ships.

    log p(e | ship) / p(e | clutter) = log(c / s) + e (1/c - 1/s). Of all densities with a given mean, the exponential has
    the greatest entropy; a bounded quantity, such as a grey level, is more informative than it says.
    """

    clutter: float = fields.quantity("1", "mean of false returns", above=0)
    ship: float = fields.quantity("1", "mean of ships' returns", above=0)

    def ratio(self, excess: Array) -> Array:
        """Return the log-likelihood ratio: (k,) -> (k,)."""
        return np.log(self.clutter / self.ship) + excess * (1.0 / self.clutter - 1.0 / self.ship)


@final
@frozen
class Evidence:
    """Brightness and size, taken as independent given the origin of the return; each counts if it is given."""

    brightness: Excess | None = fields.part("counts of the brightest echo above the threshold", default=None)
    size: Excess | None = fields.part("m by which a group's spread exceeds the finest blob's", default=None)

    def of(self, groups: Groups, threshold: float, finest: float, metres_per_pixel: float) -> Array:
        """Return the log-likelihood ratio of each group (k,); `finest`: the least scale of a blob in px."""
        total = np.zeros(len(groups.at))
        if self.brightness is not None:
            total += self.brightness.ratio(groups.peak - threshold)
        if self.size is not None:
            total += self.size.ratio(np.maximum(groups.length - finest, 0.0) * metres_per_pixel)
        return total
