"""Preprocessors that change units, widen noise, sort returns, and put those of two sensors side by side."""

import numpy as np
from attrs import frozen

import vedette
from foreign import Foreign
from foreign.preprocessor_clusters import noises, nothing
from foreign.preprocessor_points import PLANE
from vedette.space import Space
from vedette_standard.sensors.cartesian_position import CartesianPosition


class OfOne(vedette.Preprocessor):
    """Takes the scans of one sensor."""

    def __attrs_post_init__(self):
        if len(self.sensors) != 1:
            raise ValueError(f"sensors: must be one, got {len(self.sensors)}")

    def process(self, scans):
        ((name, sensor),) = self.sensors.items()
        if name not in scans:
            return nothing(self.measurement)
        found = scans[name].detections
        return self.made(found, noises(sensor, found))


@frozen
class Kilometres(OfOne):
    """Positions in km of one sensor that reports m.

    BIPM, The International System of Units, 2019.
    """

    kind = "kilometres"
    sensors: dict[str, CartesianPosition] = vedette.fields.part("the one sensor, under the name that its scans bear")
    measurement = Space.of(x="km", y="km")

    def made(self, found, noise):
        return vedette.Detections(found.z / 1e3, found.valid, found.evidence, noise / 1e6, found.missing)


@frozen
class Wider(OfOne):
    """Passes all on, with a noise that is larger by a share: for errors that nobody stated.

    Julier, Uhlmann, General Decentralized Data Fusion with Covariance Intersection, 2001.
    """

    kind = "wider"
    sensors: dict[str, CartesianPosition] = vedette.fields.part("the one sensor, under the name that its scans bear")
    share: float = vedette.fields.quantity("1", "by which variances grow", default=0.05, at_least=0, at_most=0.08)
    measurement = PLANE

    def made(self, found, noise):
        return vedette.Detections(found.z, found.valid, found.evidence, (1 + self.share) * noise, found.missing)


@frozen
class Sorted(OfOne):
    """Passes all returns on, those of most evidence first.

    Blackman, Popoli, Design and Analysis of Modern Tracking Systems, 1999, section 6.4.
    """

    kind = "sorted"
    sensors: dict[str, CartesianPosition] = vedette.fields.part("the one sensor, under the name that its scans bear")
    measurement = PLANE

    def made(self, found, noise):
        own = np.zeros(found.valid.shape) if found.evidence is None else found.evidence
        order = np.argsort(np.where(found.valid, -own, np.inf), axis=-1, kind="stable")
        z = np.take_along_axis(found.z, order[..., None], axis=-2)
        R = np.take_along_axis(noise, order[..., None, None], axis=-3)
        evidence = None if found.evidence is None else np.take_along_axis(own, order, axis=-1)
        missing = None if found.missing is None else np.take_along_axis(found.missing, order[..., None], axis=-2)
        return vedette.Detections(z, np.take_along_axis(found.valid, order, axis=-1), evidence, R, missing)


@frozen
class Both(vedette.Preprocessor):
    """The returns of two sensors of positions, one after the other: nothing is fused.

    Bar-Shalom, Li, Multitarget-Multisensor Tracking, 1995, section 2.2 (measurements side by side).
    """

    kind = "both"
    sensors: dict[str, CartesianPosition] = vedette.fields.part("two sensors, under the names that their scans bear")
    measurement = PLANE

    def __attrs_post_init__(self):
        if len(self.sensors) != 2:
            raise ValueError(f"sensors: must be two, got {len(self.sensors)}")

    def process(self, scans):
        parts = [(scans[name].detections, sensor) for name, sensor in self.sensors.items() if name in scans]
        if not parts:
            return nothing(PLANE)
        lead = np.broadcast_shapes(*(found.valid.shape[:-1] for found, _ in parts))
        z = [np.broadcast_to(found.z, (*lead, *found.z.shape[-2:])) for found, _ in parts]
        valid = [np.broadcast_to(found.valid, (*lead, found.valid.shape[-1])) for found, _ in parts]
        R = [np.broadcast_to(noises(sensor, found), (*lead, *found.z.shape[-2:], 2)) for found, sensor in parts]
        return vedette.Detections(*(np.concatenate(each, axis=a) for each, a in ((z, -2), (valid, -1))), None,
                                  np.concatenate(R, axis=-3))  # fmt: skip


COMPONENTS = (
    Foreign("kilometres", "preprocessor", lambda: Kilometres({"raw": CartesianPosition(5.0)})),
    Foreign("wider", "preprocessor", lambda: Wider({"raw": CartesianPosition(5.0)})),
    Foreign("sorted", "preprocessor", lambda: Sorted({"raw": CartesianPosition(5.0)})),
    Foreign("both", "preprocessor", lambda: Both({"one": CartesianPosition(5.0), "two": CartesianPosition(9.0)})),
)
