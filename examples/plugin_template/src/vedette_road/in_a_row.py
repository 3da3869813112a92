"""Tracks that count as real after some detections without a gap."""

import numpy as np
from attrs import frozen

import vedette


@frozen(eq=False)
class Record:
    """What is kept of each track, all (*b, t): detections in a row, s since the last one, and whether it is confirmed."""

    row: vedette.Array
    waited: vedette.Array
    confirmed: vedette.Mask


@frozen
class InARow(vedette.Lifecycle):
    """Confirms a track after `hits` detections in a row and ends it `patience` s after its last one.

    A detection is a probability above 1/2 that a return was the track's. A scan that should have detected it, P_D >= 1/2,
    and did not ends a track that is not confirmed yet.
    Blackman, Popoli, Design and Analysis of Modern Tracking Systems, 1999, section 6.2.
    """

    kind = "in_a_row"
    certain = True
    hits: int = vedette.fields.integer("detections in a row that confirm a track", default=3, at_least=1, at_most=100)
    patience: float = vedette.fields.quantity("s", "time without a detection after which a track ends", default=10, above=0)

    def start(self, existence):
        return Record(np.ones(existence.shape), np.zeros(existence.shape), np.full(existence.shape, self.hits == 1))

    def review(self, memory, scan):
        hit = scan.hit > 0.5
        missed = ~hit & (scan.p_detect >= 0.5)
        row = np.where(missed, 0.0, memory.row + hit)
        waited = np.where(hit, 0.0, memory.waited + scan.dt)
        confirmed = memory.confirmed | (row >= self.hits)
        return Record(row, waited, confirmed), confirmed, (waited <= self.patience) & (confirmed | ~missed)
