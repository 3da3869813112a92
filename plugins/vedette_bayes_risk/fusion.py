"""Distributed detection: returns of a base sensor, confirmed by the nearest returns of the others, and fused with them."""

from __future__ import annotations

from abc import abstractmethod
from collections.abc import Mapping

import numpy as np
from attrs import field, frozen

from vedette import Array, Detections, Mask, Preprocessor, Scan, Sensor, Space, fields
from vedette_bayes_risk.counting import Confirmation


@frozen
class DistributedDetection(Preprocessor):
    """Confirms each return of the base sensor by the nearest of each other sensor, if that lies within `threshold`.

    With k returns in all, the base's own included: z = R sum_j z_j / v_j, R = I / sum_j 1/v_j over the k. A return that no
    other sensor confirms (k = 1) is a false alarm and dropped. Evidence: the log weight of k. The kinds differ in it, in how
    many must confirm, and in R. The sensors' detection probability, noise and clutter are taken at the origin and must be
    the same everywhere.
    Kim, Choi, Ahn, Ko, on using Bayes risk for data association (in Korean).
    """

    sensors: dict[str, Sensor] = fields.part("two or more, by the names that their scans bear")
    base: str = fields.text("the sensor whose returns are confirmed by the others")
    threshold: float = fields.quantity("m", "greatest distance of a return that confirms one of the base", above=0)
    confirmation: Confirmation = field(init=False, repr=False, eq=False)

    @confirmation.default
    def _read(self) -> Confirmation:
        if len(self.sensors) < 2:
            raise ValueError(f"sensors: must be at least 2, for one to confirm the other, got {len(self.sensors)}")
        if self.base not in self.sensors:
            raise ValueError(f"base: must be one of {', '.join(map(repr, self.sensors))}, got {self.base!r}")
        return Confirmation.of(self.sensors, self.base)

    @property
    def measurement(self) -> Space:
        return self.sensors[self.base].observes

    @abstractmethod
    def log_weights(self) -> Array:
        """Return the log weight of a return that k = 1 ... N sensors report, (N,); k = 1 is never used."""

    def least(self) -> int:
        """Return the number of sensors that must report a return, its base among them."""
        return 2

    def spread(self) -> Array:
        """Return the factor on R of a return that k = 1 .. N sensors report, (N,); 1 as printed."""
        return np.ones(len(self.sensors))

    def __attrs_post_init__(self) -> None:
        self.log_weights()

    def process(self, scans: Mapping[str, Scan]) -> Detections:
        """Fuse scans (*b, k_j, 2) of the sensors to returns (*b, k, 2) with evidence (*b, k) and noise (*b, k, 2, 2)."""
        if self.base not in scans:
            return nothing(next(iter(scans.values())).detections)
        detections = scans[self.base].detections
        information = np.full(detections.valid.shape, 1.0 / self.confirmation.base)
        total = detections.z * information[..., None]
        count = np.ones(detections.valid.shape, dtype=int)
        others = [name for name in self.sensors if name != self.base]
        for name, variance in zip(others, self.confirmation.variance, strict=True):
            if name not in scans or scans[name].detections.z.shape[-2] == 0:
                continue
            z, near = _nearest(detections.z, scans[name].detections, self.threshold)
            weight = np.where(near, 1.0 / variance, 0.0)
            total = total + weight[..., None] * z
            information = information + weight
            count += near
        valid = detections.valid & (count >= self.least())
        evidence = self.log_weights()[count - 1]
        noise = np.eye(2) * (self.spread()[count - 1] / information)[..., None, None]
        return first_valid(Detections(total / information[..., None], valid, evidence, noise))


def _nearest(z: Array, detections: Detections, threshold: float) -> tuple[Array, Mask]:
    """Find for each of z (*b, k, 2) the nearest valid return (*b, k, 2), and whether it is within `threshold` (*b, k)."""
    apart = z[..., :, None, :] - detections.z[..., None, :, :]
    square = np.where(detections.valid[..., None, :], apart[..., 0] ** 2 + apart[..., 1] ** 2, np.inf)
    nearest = np.argmin(square, axis=-1)
    chosen = np.take_along_axis(detections.z, nearest[..., None], axis=-2)
    return chosen, np.take_along_axis(square, nearest[..., None], axis=-1)[..., 0] <= threshold**2


def first_valid(detections: Detections) -> Detections:
    """Put the valid returns first, in their order, with no more padding than the fullest run needs."""
    assert detections.evidence is not None
    assert detections.noise is not None
    most = int(np.max(np.sum(detections.valid, axis=-1), initial=0))
    order = np.argsort(~detections.valid, axis=-1, kind="stable")[..., :most]
    return Detections(
        np.take_along_axis(detections.z, order[..., None], axis=-2),
        np.take_along_axis(detections.valid, order, axis=-1),
        np.take_along_axis(detections.evidence, order, axis=-1),
        np.take_along_axis(detections.noise, order[..., None, None], axis=-3),
    )


def nothing(like: Detections) -> Detections:
    """Return no detections, in as many runs as `like` has."""
    runs = like.valid.shape[:-1]
    empty = np.zeros((*runs, 0))
    return Detections(np.zeros((*runs, 0, 2)), empty.astype(bool), empty, np.zeros((*runs, 0, 2, 2)))
