"""The common part of lifecycles that end tracks: limits that hold whatever their other criteria."""

from __future__ import annotations

import math
from abc import abstractmethod
from typing import Any

import numpy as np
from attrs import frozen

from vedette import Array, Lifecycle, Mask, Review, fields, maker
from vedette_standard.compiled import fastest
from vedette_standard.regions import Polygon, held

DETECTED = 0.5
"""A track counts as detected if a return was its own with a greater probability."""
UNSEEN = 1e-9
"""A scan that should detect a track with no more than this probability has not looked at it."""
COVERED = 0.01
"""A scan covers a track if it should detect it with this probability at least."""


@frozen(eq=False)
class Since:
    """Seconds (*b, t) since a sensor last covered the track and since it was last detected, and what the kind keeps."""

    covered: Array
    detected: Array
    own: Any


@frozen
class Limited(Lifecycle):
    """A lifecycle that also ends tracks that no sensor covers, that are not detected, whose position is too uncertain,
    or that leave the areas in which targets survive.
    """

    max_out_of_coverage: float = fields.quantity(
        "s", "a track ends after this time in places where no sensor that still looks is likely to detect it",
        default=60.0, above=0,
    )  # fmt: skip
    max_without_detection: float | None = fields.quantity(
        "s", "a track ends after this time without a detection; default: never for that alone", default=None, above=0
    )
    max_spread: float | None = fields.quantity(
        "m", "a track ends when its position's largest standard deviation exceeds this; default: never for that alone",
        default=None, above=0,
    )  # fmt: skip

    survives_in: tuple[Polygon, ...] = fields.part(
        "areas outside of which there are no targets: a track that leaves them all ends; default: everywhere",
        default=(), tried=((),),
    )  # fmt: skip

    @property
    def needs_place(self) -> bool:
        """Whether there are areas in which targets survive."""
        return bool(self.survives_in)

    @property
    def needs_spread(self) -> bool:
        """Whether the spread is limited."""
        return self.max_spread is not None

    @property
    def least_covered(self) -> float:
        """The detection probability from which on a scan covers a track; with less, misses say too little to end it."""
        return COVERED

    def start(self, existence: Array) -> Since:
        """Return the memory of tracks that start now, at a return."""
        return Since(np.zeros(existence.shape), np.zeros(existence.shape), self.start_own(existence))

    def review(self, memory: Since, scan: Review) -> tuple[Since, Mask, Mask]:
        """Return the lifecycle's own judgement, and end the tracks that are beyond a limit."""
        own, confirmed, alive = self.judge(memory.own, scan)
        most = self.max_out_of_coverage, math.inf if self.max_without_detection is None else self.max_without_detection
        covers = scan.p_detect if scan.awaited is None else np.maximum(scan.p_detect, scan.awaited)
        covered, detected, alive = limited(
            memory.covered, memory.detected, scan.hit, covers, alive, self.least_covered, scan.dt, *most
        )
        if self.max_spread is not None and scan.spread is not None:
            alive = alive & (scan.spread <= self.max_spread)
        if self.survives_in and scan.place is not None:
            alive = alive & held(self.survives_in, scan.place)
        return new_since(covered, detected, own), confirmed, alive

    def unseen(self, scan: Review) -> Mask:
        """Return which tracks the scan cannot see, and only a limit ends."""
        return (scan.p_detect <= UNSEEN) & (scan.hit <= DETECTED)

    @abstractmethod
    def start_own(self, existence: Array) -> Any:
        """Return what the lifecycle keeps of tracks that start now, with their existence (t,)."""

    @abstractmethod
    def judge(self, own: Any, scan: Review) -> tuple[Any, Mask, Mask]:
        """Return what the lifecycle keeps, confirmed (*b, t) and alive (*b, t) after a scan, the limits aside."""


new_since = maker(Since)


@fastest
def limited(
    covered: Array,
    detected: Array,
    hit: Array,
    p_detect: Array,
    alive: Mask,
    least_covered: float,
    dt: float,
    most_out: float,
    most_unseen: float,
) -> tuple[Array, Array, Mask]:
    """Return the seconds out of coverage and without a detection after a scan, and which tracks live within both limits."""
    seen = hit > DETECTED
    covered = np.where(seen | (p_detect >= least_covered), 0.0, covered + dt)
    detected = np.where(seen, 0.0, detected + dt)
    return covered, detected, alive & (covered <= most_out) & (detected <= most_unseen)
