"""Preprocessors of one sensor's own returns: clusters become one return, duplicates go."""

import numpy as np
from attrs import frozen

import vedette
from foreign import Foreign
from foreign.sensor_active import FadingRadar


def noises(sensor, found):
    """Return each return's covariance (*b, k, m, m): its own or the sensor's where it says the target is."""
    if found.noise is not None:
        return found.noise
    each = sensor.noise(sensor.invert(found.z).mean)
    return np.broadcast_to(each, (*found.z.shape, found.z.shape[-1]))


def clusters(space, z, noise, limit):
    """Return the single-linkage cluster (k,) of each z (k, m): neighbours are closer than `limit` deviations."""
    apart = space.difference(z[:, None, :], z[None, :, :])
    both = noise[:, None] + noise[None, :]
    near = np.einsum("ijm,ijm->ij", apart, np.linalg.solve(both, apart[..., None])[..., 0]) <= limit**2
    label = np.arange(len(z))
    while True:
        lower = np.where(near, label[None, :], len(z)).min(axis=1, initial=len(z))
        if np.array_equal(lower, label):
            return label
        label = lower


def reduced(sensor, found, limit, merge):
    """Return the detections with each run's clusters made one return by `merge`, padded to the longest run."""
    m, lead = len(sensor.measurement), found.valid.shape[:-1]
    k, runs = found.valid.shape[-1], int(np.prod(lead))
    z, noise = found.z.reshape(runs, k, m), noises(sensor, found).reshape(runs, k, m, m)
    evidence = np.zeros(found.valid.shape) if found.evidence is None else found.evidence
    evidence, usable = evidence.reshape(runs, k), found.valid.reshape(runs, k)
    missing = np.zeros(z.shape, dtype=bool) if found.missing is None else found.missing.reshape(runs, k, m)
    rows = []
    for run in range(len(z)):
        complete = np.flatnonzero(usable[run] & ~missing[run].any(axis=-1))
        label = clusters(sensor.measurement, z[run, complete], noise[run, complete], limit)
        groups = [complete[label == one] for one in np.unique(label)]
        groups += [[i] for i in np.flatnonzero(usable[run] & missing[run].any(axis=-1))]  # kept as they are
        rows.append([(*merge(z[run, g], noise[run, g], evidence[run, g]), missing[run, g[0]]) for g in groups])
    most = max((len(row) for row in rows), default=0)
    out = vedette.Detections(
        np.zeros((len(rows), most, m)),
        np.zeros((len(rows), most), dtype=bool),
        np.zeros((len(rows), most)),
        np.zeros((len(rows), most, m, m)) + np.eye(m),
        np.zeros((len(rows), most, m), dtype=bool),
    )
    for run, row in enumerate(rows):
        for i, (mean, cov, strength, lacks) in enumerate(row):
            out.z[run, i], out.noise[run, i], out.evidence[run, i] = mean, cov, strength
            out.missing[run, i], out.valid[run, i] = lacks, True
    return vedette.Detections(
        out.z.reshape(*lead, most, m),
        out.valid.reshape(*lead, most),
        None if found.evidence is None else out.evidence.reshape(*lead, most),
        out.noise.reshape(*lead, most, m, m),
        None if found.missing is None else out.missing.reshape(*lead, most, m),
    )


def nothing(space):
    return vedette.Detections.of([], len(space))


@frozen
class Clusters(vedette.Preprocessor):
    """Returns of one extended target become one, by single linkage: their mean, with the mean noise plus that of the mean.

    Granstrom, Baum, Reuter, Extended Object Tracking: Introduction, Overview, and Applications, JAIF 12, 2017.
    """

    kind = "clusters"
    sensors: dict[str, vedette.Sensor] = vedette.fields.part("the one sensor, under the name that its scans bear")
    limit: float = vedette.fields.quantity(
        "1", "distance of neighbours, in standard deviations", default=3, above=0, at_most=10
    )

    def __attrs_post_init__(self):
        if len(self.sensors) != 1:
            raise ValueError(f"sensors: must be one, got {len(self.sensors)}")

    @property
    def measurement(self):
        return next(iter(self.sensors.values())).measurement

    def process(self, scans):
        name, sensor = next(iter(self.sensors.items()))
        if name not in scans:
            return nothing(sensor.measurement)

        def merge(z, noise, evidence):
            weights = np.full(len(z), 1 / len(z))
            mean, apart = sensor.measurement.mean(z, weights)
            return mean, noise.mean(axis=0) + apart.T @ apart / len(z) ** 2, evidence.max()

        return reduced(sensor, scans[name].detections, self.limit, merge)


@frozen
class Unduplicated(vedette.Preprocessor):
    """Of returns within a resolution cell the strongest stays, by its evidence, and of equals the one of least noise.

    Richards, Scheer, Holm, Principles of Modern Radar: Basic Principles, 2010.
    """

    kind = "unduplicated"
    sensors: dict[str, vedette.Sensor] = vedette.fields.part("the one sensor, under the name that its scans bear")
    cell: float = vedette.fields.quantity("1", "size of a cell, in standard deviations", default=1, above=0, at_most=10)

    def __attrs_post_init__(self):
        if len(self.sensors) != 1:
            raise ValueError(f"sensors: must be one, got {len(self.sensors)}")

    @property
    def measurement(self):
        return next(iter(self.sensors.values())).measurement

    def process(self, scans):
        name, sensor = next(iter(self.sensors.items()))
        if name not in scans:
            return nothing(sensor.measurement)

        def strongest(z, noise, evidence):
            best = np.lexsort((np.trace(noise, axis1=-2, axis2=-1), -evidence))[0]
            return z[best], noise[best], evidence[best]

        return reduced(sensor, scans[name].detections, self.cell, strongest)


COMPONENTS = (
    Foreign("clusters", "preprocessor", lambda: Clusters({"raw": FadingRadar()})),
    Foreign("duplicates removed", "preprocessor", lambda: Unduplicated({"raw": FadingRadar()})),
)
