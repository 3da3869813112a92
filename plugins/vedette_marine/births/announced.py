"""Targets known in advance when tracking begins: from their AIS, or from the truth."""

from __future__ import annotations

from typing import ClassVar, final

import numpy as np
from attrs import frozen

from vedette import Gaussian, Recording, Space, fields
from vedette_standard import GivenTracks


@final
@frozen
class Announced(GivenTracks):
    """Starts one track for each trajectory of the recording's truth that exists at the first scan, as AIS announces it.

    Each starts at its position then, with `spread` as standard deviations; an axis that the truth lacks starts at 0.
    A good standard deviation of the position is the greatest of 10 m, the antenna's offset and half the length.

    >>> from vedette import Recording, Scan, Space, Trajectory
    >>> times, own = np.array([0.0, 10.0]), Space.of(y="m", x="m")
    >>> paths = [Trajectory(str(t), own, times + t, np.array([[100.0, 7.0], [140.0, 9.0]])) for t in (0.0, 2.0, 4.0)]
    >>> birth = Announced({"x": 3.0, "y": 4.0, "vx": 6.0})
    >>> tracks = birth.given(Space.of(x="m", y="m", vx="m/s"), Recording([Scan(2.5, "radar", [])], truth=tuple(paths)))
    >>> tracks.mean.tolist()  # the third is not there yet
    [[7.5, 110.0, 0.0], [7.1, 102.0, 0.0]]
    >>> tracks.cov.tolist() == [np.diag([9.0, 16.0, 36.0]).tolist()] * 2
    True
    """

    kind: ClassVar[str] = "announced"

    spread: dict[str, float] = fields.table("state axis to standard deviation around the announced state", at_least=0)

    def given(self, state: Space, recording: Recording) -> Gaussian:
        """Return the announced tracks: mean (t, n), cov (t, n, n)."""
        lacking = [name for name in state.names if name not in self.spread]
        if lacking:
            raise ValueError(f"spread: must state the standard deviation of {', '.join(map(repr, lacking))}")
        if not recording.scans:
            return Gaussian(np.zeros((0, len(state))), np.zeros((0, len(state), len(state))))
        begin = recording.scans[0].time
        there = [(path.space.names, path.at(begin)) for path in recording.truth]
        known = [dict(zip(names, at, strict=True)) for names, at in there if at is not None]
        if not known:
            raise ValueError(f"nothing is announced at the first scan, {begin:.6g} s; let tracks start by themselves")
        mean = np.array([[one.get(name, 0.0) for name in state.names] for one in known])
        deviation = np.array([self.spread[name] for name in state.names])
        return Gaussian(state.canonical(mean), np.broadcast_to(np.diag(deviation**2), (len(mean), len(state), len(state))))
