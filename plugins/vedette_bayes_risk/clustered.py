"""Distributed detection without a base: returns of several sensors that lie together, whichever sensors report them."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any, ClassVar, final

import numpy as np
from attrs import field, frozen

from vedette import Array, Detections, Mask, Preprocessor, Scan, Sensor, Space, fields
from vedette_bayes_risk.counting import Confirmation, number_of
from vedette_bayes_risk.fusion import first_valid, nothing

PASSES = 3
"""Means that a cluster moves to: of the sensors' returns near the last mean. More change no return in the paper's scene."""


@final
@frozen
class ClusteredDetection(Preprocessor):
    """Gathers around each return of every sensor the nearest of each sensor within `threshold`, and again around their mean.

    Of clusters with the same members one is kept, and none with fewer than two. z = R sum_j z_j / v_j, R = I / sum_j 1/v_j.
    No sensor is the base: a target that one of them misses is still seen, and the selection, around the mean, hardly depends
    on any one error. Evidence: log p(k | H1, k > 1) - log p(k | H0, k > 1) with independent sensors, for `pda`;
    p_j = 1 - (1 - P_D)(1 - P_FA) given a target, P_FA without. The tracker's sensor states the density of false clusters.
    Comaniciu, Meer, Mean Shift, IEEE T-PAMI 24, 2002 (means that move); for the counts, `count_likelihood_detection`.

    >>> from vedette_standard import CartesianPosition
    >>> settings = {"a": (4.0, 0.9, 1e-3), "b": (3.0, 0.8, 2e-3), "c": (6.0, 0.7, 5e-4)}  # sigma, P_D, clutter
    >>> sensors = {j: CartesianPosition(s, detection_probability=p, clutter_density=l) for j, (s, p, l) in settings.items()}
    >>> z = {"a": [[0.0, 2.0], [200.0, 0.0]], "b": [[1.0, 0.0], [206.0, 4.0]], "c": [[300.0, 9.0], [3.0, 0.0]]}
    >>> scans = {name: Scan(0.0, name, Detections.of(each)) for name, each in z.items()}
    >>> made = ClusteredDetection(sensors, threshold=8.0).process(scans)
    >>> w = np.array([1 / 16, 1 / 9, 1 / 36])
    >>> all_three, two = w @ [[0, 2], [1, 0], [3, 0]] / np.sum(w), w[:2] @ [[200, 0], [206, 4]] / np.sum(w[:2])
    >>> np.allclose(made.z, [all_three, two]), np.allclose(made.noise[:, 0, 0], [1 / np.sum(w), 1 / np.sum(w[:2])])
    (True, True)
    >>> f = 1 - np.exp(-64 * np.pi * np.array([1e-3, 2e-3, 5e-4]))
    >>> shares = []
    >>> for p in (1 - (1 - np.array([0.9, 0.8, 0.7])) * (1 - f), f):
    ...     pairs = np.sum(np.prod(p) / p * (1 - p))
    ...     shares.append(np.array([np.prod(p), pairs]) / (np.prod(p) + pairs))
    >>> np.allclose(made.evidence, np.log(shares[0] / shares[1]))
    True
    """

    kind: ClassVar[str] = "clustered_detection"

    sensors: dict[str, Sensor] = fields.part("two or more, by the names that their scans bear")
    threshold: float = fields.quantity("m", "greatest distance of a return from the mean of its cluster", above=0)
    _each: tuple[Array, Array, Array] = field(init=False, repr=False, eq=False)

    @_each.default
    def _read(self) -> tuple[Array, Array, Array]:
        if len(self.sensors) < 2:
            raise ValueError(f"sensors: must be at least 2, for one to confirm the other, got {len(self.sensors)}")
        confirmations = [Confirmation.of({"": sensor, name: sensor}, "") for name, sensor in self.sensors.items()]
        rows = [(one.base, one.p_detect[0], one.false_alarm(self.threshold)[0]) for one in confirmations]
        variance, detects, false = np.array(rows, dtype=float).T
        return variance, detects, false

    @property
    def measurement(self) -> Space:
        return next(iter(self.sensors.values())).observes

    def log_weights(self) -> Array:
        """Return the log-likelihood ratio of a cluster of k = 0 .. N returns, (N+1,)."""
        _, detects, false = self._each
        pair = number_of(1 - (1 - detects) * (1 - false)), number_of(false)
        log = [np.log(np.maximum(p, 1e-300)) - np.log(max(float(np.sum(p[2:])), 1e-300)) for p in pair]
        return log[0] - log[1]

    def process(self, scans: Mapping[str, Scan]) -> Detections:
        """Fuse scans (*b, k_j, 2) of the sensors to clusters (*b, k, 2) with evidence (*b, k) and noise (*b, k, 2, 2)."""
        names = [name for name in self.sensors if name in scans and scans[name].detections.z.shape[-2] > 0]
        if not names:
            return nothing(next(iter(scans.values())).detections)
        seen = [scans[name].detections for name in names]
        weights = [1.0 / self._each[0][list(self.sensors).index(name)] for name in names]
        mean = np.concatenate([scan.z for scan in seen], axis=-2)
        valid = np.concatenate([scan.valid for scan in seen], axis=-1)
        for _ in range(PASSES):
            total, information = np.zeros(mean.shape), np.zeros(valid.shape)
            members = np.empty((*valid.shape, len(names)), dtype=int)
            for j, (scan, weight) in enumerate(zip(seen, weights, strict=True)):
                nearest, near = _nearest(mean, scan, self.threshold)
                members[..., j] = np.where(near, nearest, -1)
                share = np.where(near, weight, 0.0)
                total = total + share[..., None] * np.take_along_axis(scan.z, nearest[..., None], axis=-2)
                information += share
            known = information > 0
            mean = np.where(known[..., None], total / np.where(known, information, 1.0)[..., None], mean)
        count = np.sum(members >= 0, axis=-1)
        valid = valid & (count > 1)
        valid &= ~_repeated(members, valid)
        noise = np.eye(2) / np.where(information > 0, information, 1.0)[..., None, None]
        return first_valid(Detections(mean, valid, self.log_weights()[count], noise))


def _nearest(mean: Array, seen: Detections, threshold: float) -> tuple[Any, Mask]:
    """Return for each mean (*b, c, 2) the index of the nearest valid return (*b, c), and whether it is within reach."""
    apart = mean[..., :, None, :] - seen.z[..., None, :, :]
    square = np.where(seen.valid[..., None, :], apart[..., 0] ** 2 + apart[..., 1] ** 2, np.inf)
    nearest = np.argmin(square, axis=-1)
    return nearest, np.take_along_axis(square, nearest[..., None], axis=-1)[..., 0] <= threshold**2


def _repeated(members: Array, valid: Mask) -> Mask:
    """Return which clusters (*b, c) have the members (*b, c, s) of a valid one before them."""
    same = np.all(members[..., :, None, :] == members[..., None, :, :], axis=-1) & valid[..., None, :]
    return np.any(same & np.tri(members.shape[-2], k=-1, dtype=bool), axis=-1)
