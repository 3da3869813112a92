"""Where a sensor of positions sees, as what others follow tells."""

from __future__ import annotations

import numpy as np

from vedette.space import Array
from vedette_tools.drafting.reading import Reading
from vedette_tools.drafting.several import carried

MARGIN, UNSEEN = 0.1, 20.0
"""A sensor sees within the box of its returns, wider on each side by such a part of the longer one, if it would have
detected so many times what others saw beyond: of so many chances all are missed by no chance. By hand.
"""


def view_of(best: Reading, name: str, z: Array, probability: float) -> tuple[Array, Array] | None:
    """Return the corners (2,) of the box that a sensor sees, by its returns z (k, m); None where others do not tell.

    probability: of a look to detect. A polar sensor has a range; what objects report, or has names, tells of them alone.
    """
    seen, table = best.seen[name], best.table.of(name)
    own = [scan for scan in best.recording.scans if scan.sensor == name]
    named = any(codes is not None and np.any(codes >= 0) for codes in (scan.detections.identity for scan in own))
    if table.polar or table.third or table.reported or seen.in_turn or named or not len(z):
        return None
    low, high = np.min(z, axis=0), np.max(z, axis=0)
    wider = MARGIN * float(np.max(high - low))
    low, high = low - wider, high + wider
    times, looks = np.array([scan.time for scan in own]), 0
    for chain in (chain for other, each in best.seen.items() if other != name for chain in each.chains):
        known, spots = carried(chain, times)
        looks += int(np.count_nonzero(np.any((spots < low) | (spots > high), axis=-1) & known))
    return (low, high) if looks * probability > UNSEEN else None
