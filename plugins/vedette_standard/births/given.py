"""One target that is known before the first scan."""

from __future__ import annotations

from typing import ClassVar, final

import numpy as np
from attrs import frozen

from vedette import Gaussian, Recording, Space, fields
from vedette.tracking import GivenTracks


@final
@frozen
class Given(GivenTracks):
    """One track before the first scan, and none after it.

    It starts at `start`; an axis missing there starts at the recording's first true state, moved by `offset`, with
    `spread` as its standard deviation (an axis that the truth lacks: at 0).
    """

    kind: ClassVar[str] = "given"

    start: dict[str, tuple[float, float]] = fields.table("state axis to [mean, standard deviation]", pairs=True)
    spread: dict[str, float] = fields.table("state axis to standard deviation around the first true state")
    offset: dict[str, float] = fields.table("state axis to what is added to the first true state")

    def given(self, state: Space, recording: Recording) -> Gaussian:
        """Return the one track: mean (1, n), cov (1, n, n)."""
        lacking = [name for name in state.names if name not in self.start and name not in self.spread]
        if lacking:
            raise ValueError(f"spread: must state the standard deviation of {', '.join(map(repr, lacking))}")
        rest = [name for name in state.names if name not in self.start]
        if rest and not recording.truth:
            raise ValueError(f"start: must state {', '.join(map(repr, rest))}, as the recording has no truth")
        known = {}
        if recording.truth:
            first = min(recording.truth, key=lambda trajectory: trajectory.times[0])
            at_start = first.at(recording.scans[0].time) if recording.scans else None
            known = dict(zip(first.space.names, first.states[0] if at_start is None else at_start, strict=True))
        mean, deviation = np.zeros((1, len(state))), np.zeros(len(state))
        for i, name in enumerate(state.names):
            if name in self.start:
                mean[0, i], deviation[i] = self.start[name]
            else:
                mean[0, i], deviation[i] = known.get(name, 0.0) + self.offset.get(name, 0.0), self.spread[name]
        return Gaussian(state.canonical(mean), np.diag(deviation**2)[None])
