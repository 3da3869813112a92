"""Targets that are known before the first scan."""

from __future__ import annotations

from typing import ClassVar, final

import numpy as np
from attrs import frozen

from vedette import Gaussian, Recording, Space, Trajectory, fields
from vedette_standard.permanent import GivenTracks


@final
@frozen
class Given(GivenTracks):
    """One track before the first scan, or one for each start that the source knows, and none after it.

    An axis in `start` begins there. Another axis begins at the state that the source gives, or else at the recording's first
    true state, plus `offset`; its standard deviation is that of `spread`. An axis without such a state begins at 0.

    >>> from vedette import Recording, Scan, Space, Trajectory
    >>> times, own = np.array([0.0, 10.0]), Space.of(y="m", vx="m/s")
    >>> first = Trajectory("first", own, times, np.array([[100.0, 7.0], [140.0, 9.0]]))
    >>> later = Trajectory("later", own, times + 1.0, np.array([[-50.0, 1.0], [-70.0, 3.0]]))
    >>> birth = Given(start={"x": (5.0, 2.0)}, spread={"y": 3.0, "vx": 4.0, "vy": 6.0}, offset={"vx": -0.5})
    >>> state, scan = Space.of(x="m", y="m", vx="m/s", vy="m/s"), Scan(2.5, "radar", [])
    >>> tracks = birth.given(state, Recording([scan], truth=(later, first)))  # a quarter of the way from 0 to 10 s
    >>> tracks.mean.tolist(), np.sqrt(np.diag(tracks.cov[0])).tolist()
    ([[5.0, 110.0, 7.0, 0.0]], [2.0, 3.0, 4.0, 6.0])
    >>> birth.given(state, Recording([scan], truth=(first,), starts=(later, first))).mean.tolist()
    [[5.0, -53.0, 0.8, 0.0], [5.0, 110.0, 7.0, 0.0]]
    >>> Given({"to": (4.0, 0.1)}, {}, {}).given(Space.of(to="rad mod 2pi"), Recording([scan])).mean.round(3).tolist()
    [[-2.283]]
    """

    kind: ClassVar[str] = "given"

    start: dict[str, tuple[float, float]] = fields.table("state axis to [mean, standard deviation]", pairs=True)
    spread: dict[str, float] = fields.table("state axis to standard deviation around the first true state", at_least=0)
    offset: dict[str, float] = fields.table("state axis to what is added to the first true state")

    def given(self, state: Space, recording: Recording) -> Gaussian:
        """Return the tracks: mean (t, n), cov (t, n, n)."""
        lacking = [name for name in state.names if name not in self.start and name not in self.spread]
        if lacking:
            raise ValueError(f"spread: must state the standard deviation of {', '.join(map(repr, lacking))}")
        rest = [name for name in state.names if name not in self.start]
        if rest and not recording.truth and not recording.starts:
            raise ValueError(f"start: must state {', '.join(map(repr, rest))}, as the recording has no truth")
        known = [_at_start(start, recording) for start in recording.starts or _first(recording)] or [{}]
        mean, deviation = np.zeros((len(known), len(state))), np.zeros(len(state))
        for i, name in enumerate(state.names):
            if name in self.start:
                mean[:, i], deviation[i] = self.start[name]
            else:
                mean[:, i] = [start.get(name, 0.0) + self.offset.get(name, 0.0) for start in known]
                deviation[i] = self.spread[name]
        return Gaussian(state.canonical(mean), np.tile(np.diag(deviation**2), (len(known), 1, 1)))


def _first(recording: Recording) -> list[Trajectory]:
    """Return the true object that appears first, if there is one."""
    return sorted(recording.truth, key=lambda trajectory: trajectory.times[0])[:1]


def _at_start(trajectory: Trajectory, recording: Recording) -> dict[str, float]:
    """Return a trajectory's state at the first scan, or its first one if it is not known then."""
    now = trajectory.at(recording.scans[0].time) if recording.scans else None
    return dict(zip(trajectory.space.names, (trajectory.states[0] if now is None else now).tolist(), strict=True))
