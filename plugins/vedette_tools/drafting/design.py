"""What a drafted config is made of: what was found of each sensor, and what is tried in several ways."""

from __future__ import annotations

from attrs import frozen

from vedette import Array
from vedette_report.detector_errors.in_time import Compared

GATE = 0.99
"""The probability of the gate where no other breaks fewer tracks."""

WIDE = 0.9999
"""That of a wide one. Where errors go on, a return that is outside of its gate is followed by others, and a second track."""


@frozen(eq=False)
class Facts:
    """What a config says of one sensor, by the first `scans` of all.

    `third` is the noise of what it measures beside a position, up to `fastest` or over a `height`; `in_turn`: its targets
    report in turn, and how seldom is told where they are `named`; `exact`: without noise; `longest`: the s that a name waits
    at most; `view`: the corners (2,) of the box in which alone it sees.
    """

    sigmas: tuple[float, ...]
    probability: float
    clutter: float
    reach: float
    area: float
    period: float
    scans: int
    of: int
    chains: int
    third: float = 0.0
    fastest: float = 0.0
    height: float = 1.0
    in_turn: bool = False
    named: bool = False
    longest: float = 0.0
    exact: bool = False
    errors: Compared | None = None
    view: tuple[Array, Array] | None = None

    @property
    def correlated(self) -> bool:
        """Whether the sensor's errors go on from return to return."""
        return self.errors is not None and self.errors.wins


@frozen
class Design:
    """What of a draft is tried in several ways: the targets' acceleration noise, and that of a second mode for manoeuvres,
    0 without one, which last `lasts` scans; the sensors' errors over those that were found; the gate's probability; the
    speed along an axis; whether errors are correlated in time; how many times as often as the slowest of those that report
    in turn targets do; whether names are `sure`, none is another object's. `found` is the acceleration noise of greatest
    likelihood, `sharp` one by which targets start and stop from one scan to the next.
    """

    accel: float
    speed: float
    agile: float = 0.0
    lasts: float = 1.0
    errors: float = 1.0
    gate: float = GATE
    found: float = 0.0
    correlated: bool = False
    often: float = 1.0
    sharp: float = 0.0
    sure: bool = False

    def __str__(self) -> str:
        told = f"sigma_accel {rounded(self.accel):g}"
        told += f" and {rounded(self.agile):g} for {self.lasts:g} scan{'s' if self.lasts > 1 else ''}" if self.agile else ""
        told += ", errors correlated in time" if self.correlated else ""
        told += f", errors times {self.errors:.2g}" if self.errors != 1 else ""
        told += f", reports {self.often:g} times as often" if self.often != 1 else ""
        told += ", names never wrong" if self.sure else ""
        return f"{told}, speeds of {rounded(self.speed):g}" + (f", gate {self.gate:g}" if self.gate != GATE else "")


def rounded(value: float, digits: int = 2) -> float:
    """Return a number to so many significant digits."""
    return float(f"{value:.{digits}g}")
