"""Whether the returns that tracks of a recording took lie beside its truth, or are late."""

from __future__ import annotations

from collections import defaultdict
from collections.abc import Collection, Iterator, Sequence

from vedette import Tracker
from vedette_report.detector_errors.off_truth import Beside, Returns, beside
from vedette_report.recorded.tracks import Recorded


def beside_truth(tracker: Tracker, told: Sequence[Recorded], others: Collection[str] = ()) -> Iterator[Beside]:
    """Yield each sensor whose returns lie beside the objects whose tracks took them, or are late.

    others: sensors of which it is known otherwise.
    """
    seen = defaultdict[str, list[Returns]](list)
    for one in told:
        for off in one.off:
            seen[off.sensor].append(off.returns)
    for name, parts in seen.items():
        if name not in others:
            found = beside(name, tracker.sensors[name].measurement, Returns.of(parts))
            if found is not None:
                yield found
