"""What a run found of the offsets that all tracks share."""

from __future__ import annotations

import numpy as np
from attrs import frozen

from vedette.experiment import Result

OBSERVED = 0.5
"""An offset whose standard deviation is still above this part of that of its prior was not observed: chosen by hand."""

NOTHING = 1e-6
"""A deviation that fell by less than this part did not fall."""

ALIKE = 0.9
"""Two offsets whose errors are correlated by more than this are told as alike."""


@frozen
class Registered:
    """What a run tells of one offset, in its unit; `refused` says why the estimate is not to be used, or is ""."""

    name: str
    unit: str
    estimate: float
    deviation: float
    prior: float
    refused: str

    @property
    def observability(self) -> float:
        """The part of the prior's variance that the run removed: 0 to 1."""
        return 1.0 - (self.deviation / self.prior) ** 2


def registered(result: Result) -> tuple[Registered, ...]:
    """Return what is told of each offset, in the order of the config; nothing where tracks share none."""
    if result.offsets is None:
        return ()
    tracker, offsets = result.made_by.tracker, result.offsets
    deviations = np.sqrt(np.diag(offsets.cov))
    alike = np.abs(offsets.cov / deviations / deviations[:, None]) > ALIKE
    names, told = list(tracker.registration.offsets), []
    for i, (name, prior) in enumerate(tracker.registration.offsets.items()):
        refused, deviation = "", float(deviations[i])
        if deviation > OBSERVED * prior:
            others = " and ".join(other for j, other in enumerate(names) if alike[i, j] and j != i)
            refused = "no confirmed track took returns of sensors that tell it together"
            if deviation < (1.0 - NOTHING) * prior:
                refused = f"{others} would move the returns alike" if others else "the paths seen say little of it"
        unit = tracker.state.axes[tracker.state.names.index(name)].unit
        told.append(Registered(name, unit, float(offsets.mean[i]), deviation, prior, refused))
    return tuple(told)
