"""Several returns of an object in one scan, as one."""

from __future__ import annotations

from collections.abc import Mapping
from typing import ClassVar, final

import numpy as np
from attrs import frozen

from vedette import Array, Detections, Indices, Mask, Preprocessor, Scan, Sensor, Space, fields
from vedette.tracking import take
from vedette_standard.grouping import Labels, grouped, linked


@final
@frozen
class GroupedReturns(Preprocessor):
    """Makes one return of those that steps of at most `link` join: their mean, as objects give trackers one return a scan.

    A group longer than `longest` is split by k-means, so that objects side by side stay two. The mean has the noise of the
    tracker's sensor: what is seen of an object lies beside its middle, an error that all its returns share, so that their
    number makes it no smaller; `vedette tune` finds it. Of noises that returns bring it has the mean, of their evidence the
    largest. Returns of two names are not joined. Of a group, those that lack components do not count beside those that lack
    fewer; one whose place is not known, as it lacks its range, is passed on as it is.
    Ester, Kriegel, Sander, Xu, A density-based algorithm for discovering clusters, KDD 1996; here by single linkage.

    >>> from attrs import evolve
    >>> from vedette_standard import CartesianPosition
    >>> cars = GroupedReturns({"raw": CartesianPosition(0.5)}, link=3.0, longest=8.0)
    >>> z = [[0.0, 0.0], [2.5, 0.0], [50.0, 50.0], [5.0, 0.6], [52.0, 50.0], [90.0, 0.0]]
    >>> made = cars.process({"raw": Scan(0.0, "raw", Detections.of(z))})
    >>> made.z.round(9).tolist()
    [[2.5, 0.2], [51.0, 50.0], [90.0, 0.0]]
    >>> evolve(cars, fewest=3).process({"raw": Scan(0.0, "raw", Detections.of(z))}).z.round(9).tolist()
    [[2.5, 0.2]]
    """

    kind: ClassVar[str] = "grouped_returns"
    takes_incomplete: ClassVar[bool] = True

    sensors: dict[str, Sensor] = fields.part("the one sensor, under the name that its scans bear")
    link: float = fields.quantity("m", "returns closer than this are of one object", above=0)
    longest: float | None = fields.quantity("m", "a longer group is split; without, none is", default=None, above=0)
    fewest: int = fields.integer("groups of fewer returns are left out, as clutter", default=1, at_least=1)

    def __attrs_post_init__(self) -> None:
        if len(self.sensors) != 1:
            raise ValueError(f"sensors: must hold one sensor, got {len(self.sensors)}")
        ((name, sensor),) = self.sensors.items()
        try:
            sensor.invert(np.zeros((1, len(sensor.measurement))))
        except NotImplementedError as error:
            raise ValueError(f"sensors.{name}: must tell places, but {error}") from None

    @property
    def measurement(self) -> Space:
        """The sensor's own."""
        return next(iter(self.sensors.values())).measurement

    def process(self, scans: Mapping[str, Scan]) -> Detections:
        """Return the mean of each group in the column of its first return (*b, k, m); of one run, these columns alone."""
        (name,) = self.sensors
        seen = scans[name].detections
        lacking = np.zeros(seen.z.shape, dtype=bool) if seen.missing is None else seen.missing
        z, leads = np.where(lacking, 0.0, seen.z), np.zeros_like(seen.valid)
        places, known = self._places(z, lacking, scans[name])
        noise, evidence, time = (None if each is None else each.copy() for each in (seen.noise, seen.evidence, seen.time))
        for run in np.ndindex(seen.valid.shape[:-1]):
            leads[run] = seen.valid[run] & ~known[run]
            rows = np.flatnonzero(seen.valid[run] & known[run])
            label = self._labels(places[run][rows], None if seen.identity is None else seen.identity[run][rows])
            counts = np.bincount(label)
            chosen = _fullest(label, lacking[run][rows])
            order = chosen[np.argsort(label[chosen], kind="stable")]
            which, start, size = np.unique(label[order], return_index=True, return_counts=True)
            order = rows[order]
            if not len(start):
                continue
            first = order[start]
            leads[run][first[counts[which] >= self.fewest]] = True
            steps = self.measurement.difference(z[run][order], np.repeat(z[run][first], size, axis=0))
            z[run][first] = self.measurement.displace(z[run][first], _means(steps, start))
            if noise is not None:
                noise[run][first] = _means(noise[run][order], start)
            if evidence is not None:
                evidence[run][first] = np.maximum.reduceat(evidence[run][order], start)
            if time is not None:
                time[first] = _means(time[order], start)
        made = Detections(z, leads, evidence, noise, seen.missing, seen.identity, time)
        return made if leads.ndim > 1 else take(made, leads, 0)

    def _places(self, z: Array, lacking: Mask, scan: Scan) -> tuple[Array, Mask]:
        """Return the places (*b, k, 2 or 3) of returns `z`, 0 where they lack a component, and whether these tell it."""
        ((_, sensor),) = self.sensors.items()
        metres = [i for i, axis in enumerate(sensor.observes.axes) if axis.unit == "m"]
        placed, noise = sensor.placed(scan.pose), scan.detections.noise
        places = placed.invert(z, noise).mean[..., metres]
        if not lacking.any():
            return places, np.ones(z.shape[:-1], dtype=bool)
        known: Mask = np.all(placed.invert(np.where(lacking, 1.0, z), noise).mean[..., metres] == places, axis=-1)
        return places, known

    def _labels(self, places: Array, identity: Indices | None) -> Labels:
        """Return the number (k,) of the group of each return at `places` (k, 2 or 3)."""
        if self.longest is None:
            label = linked(places, self.link)
        else:
            label = grouped(places, np.ones(len(places)), self.link, self.longest)
        if identity is None:
            return label
        return np.unique(np.stack([label, identity], axis=-1), axis=0, return_inverse=True)[1].reshape(label.shape)


def _fullest(label: Labels, lacking: Mask) -> Indices:
    """Return the returns (j,) that lack what the first of those of their group that lack fewest components lacks."""
    order = np.lexsort((np.sum(lacking, axis=-1), label))
    groups, start = np.unique(label[order], return_index=True)
    same: Mask = np.all(lacking == lacking[order[start]][np.searchsorted(groups, label)], axis=-1)
    return np.flatnonzero(same)


def _means(values: Array, start: Indices) -> Array:
    """Return the means (g, ...) of the parts of `values` (k, ...) that begin at `start` (g,)."""
    size = np.diff(np.append(start, len(values)))
    return np.asarray(np.add.reduceat(values, start) / size.reshape(-1, *[1] * (values.ndim - 1)))
