"""The tracks of a true object together: a target that was lost is not judged by the track that lived longest alone."""

from __future__ import annotations

from collections import Counter
from collections.abc import Sequence
from functools import reduce
from operator import or_

import numpy as np
from attrs import frozen

from vedette_report.recorded.pairing import Followed
from vedette_report.recorded.pooled import pooled_nis
from vedette_report.recorded.tracks import Recorded


@frozen(eq=False)
class Pooled:
    """One object with its tracks, one after the other, and their figures over the `scans` of all that could be judged."""

    target: Followed
    scans: int
    anees: float
    nis: float | None

    @property
    def text(self) -> str:
        """When it was lost, and the figures of all its tracks; "" if it was not."""
        nis = "unknown" if self.nis is None else f"{self.nis:.2f}"
        figures = f"in all {self.scans} scans, ANEES {self.anees:.2f} and NIS {nis}"
        return f"{self.target.truth}: {self.target.hint}; {figures}" if self.target.hint else ""

    def data(self) -> dict[str, object]:
        """Return the figures as plain data."""
        target = self.target
        names = {"truth": target.truth, "tracks": [track.id for track in target.tracks], "lost_at_s": list(target.lost)}
        return names | {"scans": self.scans, "anees": self.anees, "nis": self.nis, "hint": target.hint}


def pooled(told: Sequence[Recorded], p_gate: float) -> tuple[Pooled, ...]:
    """Return the objects that tracks covered, each with the figures of all of them; `p_gate` is the tracker's."""
    objects = []
    for target in {id(one.target): one.target for one in told}.values():
        if target is not None:
            tracks = [one for one in told if one.target is target]
            seen = [one.innovations for one in tracks]
            nis, hit, axes = (np.concatenate([getattr(one, name) for one in seen]) for name in ("nis", "hit", "axes"))
            anees = float(np.mean(np.concatenate([one.nees for one in tracks if one.nees is not None])))
            mean = float(pooled_nis(nis, hit, axes, p_gate)) if np.any(hit > 0) else None
            times = reduce(or_, (Counter(one.times.tolist()) for one in tracks))  # of a scan that two followed, one
            objects.append(Pooled(target, times.total(), anees, mean))
    return tuple(objects)
