"""Several returns of an object in one scan, as one."""

from __future__ import annotations

from collections.abc import Mapping
from typing import ClassVar, final

import numpy as np
from attrs import frozen

from vedette import Array, Detections, Preprocessor, Scan, Sensor, Space, fields
from vedette.space import Indices
from vedette.tracking import take
from vedette_standard.grouping import Labels, grouped, linked


@final
@frozen
class GroupedReturns(Preprocessor):
    """Makes one return of those that steps of at most `link` join: their mean, as objects give trackers one return a scan.

    A group longer than `longest` is split by k-means, so that objects side by side stay two. The mean has the noise of the
    tracker's sensor: what is seen of an object lies beside its middle, an error that all its returns share, so that their
    number makes it no smaller; `vedette tune` finds it. Of noises that returns bring it has the mean, of their evidence the
    largest. Returns of two names are not joined.
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
        ((name, sensor),) = self.sensors.items()
        seen = scans[name].detections
        places = sensor.placed(scans[name].pose).invert(seen.z, seen.noise).mean
        places = places[..., [i for i, axis in enumerate(sensor.observes.axes) if axis.unit == "m"]]
        z, leads = seen.z.copy(), np.zeros_like(seen.valid)
        noise, evidence, time = (None if each is None else each.copy() for each in (seen.noise, seen.evidence, seen.time))
        for run in np.ndindex(seen.valid.shape[:-1]):
            rows = np.flatnonzero(seen.valid[run])
            label = self._labels(places[run][rows], None if seen.identity is None else seen.identity[run][rows])
            order = np.argsort(label, kind="stable")
            _, start, size = np.unique(label[order], return_index=True, return_counts=True)
            order = rows[order]
            if not len(start):
                continue
            first = order[start]
            leads[run][first[size >= self.fewest]] = True
            steps = self.measurement.difference(z[run][order], np.repeat(z[run][first], size, axis=0))
            z[run][first] = self.measurement.displace(z[run][first], _means(steps, start))
            if noise is not None:
                noise[run][first] = _means(noise[run][order], start)
            if evidence is not None:
                evidence[run][first] = np.maximum.reduceat(evidence[run][order], start)
            if time is not None:
                time[first] = _means(time[order], start)
        made = Detections(z, leads, evidence, noise, None, seen.identity, time)
        return made if leads.ndim > 1 else take(made, leads, 0)

    def _labels(self, places: Array, identity: Indices | None) -> Labels:
        """Return the number (k,) of the group of each return at `places` (k, 2 or 3)."""
        if self.longest is None:
            label = linked(places, self.link)
        else:
            label = grouped(places, np.ones(len(places)), self.link, self.longest)
        if identity is None:
            return label
        return np.unique(np.stack([label, identity], axis=-1), axis=0, return_inverse=True)[1].reshape(label.shape)


def _means(values: Array, start: Indices) -> Array:
    """Return the means (g, ...) of the parts of `values` (k, ...) that begin at `start` (g,)."""
    size = np.diff(np.append(start, len(values)))
    return np.asarray(np.add.reduceat(values, start) / size.reshape(-1, *[1] * (values.ndim - 1)))
