"""What can be drawn of a recording, so that runs over it differ: which returns are there, and where given tracks start."""

from __future__ import annotations

from collections.abc import Sequence
from typing import final

import numpy as np
from attrs import evolve, frozen

from vedette import Gaussian, LazyScans, Recording, Scan, Space, Trajectory, fields
from vedette.sampling import psd_root
from vedette.tracking import take

_RETURNS, _STARTS = 2, 3
"""Spawn keys of the draws; 0 and 1 are those of source and tracker."""


@final
@frozen
class Redraw:
    """Draws a run's own version of a recording: each return is left out with the probability `drop`, independently.

    A camera's frame is one return. With `starts`, tracks that are given before the first scan start from a draw of their
    prior, on the axes that the truth has: what it does not know, such as a bias of the sensor, starts where it is said to.
    The draws depend on the seed, the sensor's name and the place in the recording alone: whatever the tracker, it meets the
    same returns.
    """

    drop: float = fields.probability("probability with which a return is left out", default=0.1, below=1)
    starts: bool = fields.flag("draw the start of a given track from its prior", default=True)

    def recording(self, whole: Recording, seeds: np.random.SeedSequence) -> Recording:
        """Return the recording without the returns that are left out; its scans stay, but for those of frames."""
        if self.drop == 0:
            return whole
        scans = whole.scans
        if isinstance(scans, LazyScans):
            places = np.flatnonzero(_stream(seeds, _RETURNS).random(len(scans)) >= self.drop).tolist()
            return evolve(whole, scans=LazyScans(len(places), lambda i: scans[places[i]], scans.once))
        return evolve(whole, scans=tuple(self._thinned(scans, seeds)))

    def _thinned(self, scans: Sequence[Scan], seeds: np.random.SeedSequence) -> list[Scan]:
        streams: dict[str, np.random.Generator] = {}
        left = []
        for scan in scans:
            rng = streams.setdefault(scan.sensor, _stream(seeds, _RETURNS, scan.sensor))
            if scan.frame is not None:
                left += [scan] if rng.random() >= self.drop else []
            else:
                keep = rng.random(len(scan.detections.valid)) >= self.drop
                left.append(evolve(scan, detections=take(scan.detections, keep, 0)))
        return left

    def start(
        self, given: Gaussian | None, space: Space, truth: Sequence[Trajectory], seeds: np.random.SeedSequence
    ) -> Gaussian | None:
        """Return the given tracks (t, n) over `space`, each mean drawn from its prior; without a truth on all axes."""
        if given is None or not self.starts:
            return given
        known = [i for i, name in enumerate(space.names) if not truth or any(name in path.space for path in truth)]
        step = np.zeros(given.mean.shape)
        standard = _stream(seeds, _STARTS).standard_normal(given.mean.shape)[..., known]
        step[..., known] = (psd_root(given.cov[..., known, :][..., known]) @ standard[..., None])[..., 0]
        return Gaussian(space.displace(given.mean, step), given.cov)


def _stream(seeds: np.random.SeedSequence, key: int, name: str = "") -> np.random.Generator:
    """Return the generator of one part of a run's draws."""
    return np.random.default_rng(np.random.SeedSequence(seeds.entropy, spawn_key=(*seeds.spawn_key, key, *name.encode())))
