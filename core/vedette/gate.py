"""The gate: the one place where scores are made."""

from __future__ import annotations

import math

import numpy as np
from attrs import frozen

from vedette import fields, kernels
from vedette.roles import Sensor
from vedette.space import Array, Mask
from vedette.types import Detections, Innovation


@frozen
class Gate:
    """Which returns a track considers, and against what density of clutter.

    A return counts if its squared distance is within the chi-square quantile of `probability` for the measured axes (with
    several modes: in any of their gates). `clutter`: "sensor" takes the density that the sensor states; "nonparametric"
    takes the number of returns in the gate over its volume, for scenes whose clutter is not known.
    Bar-Shalom, Li, Multitarget-Multisensor Tracking, 1995, section 3.4.
    """

    probability: float = fields.probability("that a target's return falls in its gate", default=0.99, above=0, below=1)
    clutter: str = fields.choice("where the clutter density comes from", ("sensor", "nonparametric"), default="sensor")

    def threshold(self, axes: int) -> float:
        """The largest squared distance inside the gate, for `axes` measured axes."""
        from scipy.special import gammaincinv

        return 2.0 * float(gammaincinv(axes / 2, self.probability))

    def scores(self, innovation: Innovation, sensor: Sensor, seen: Detections, existence: Array, threshold: float) -> Array:
        """Log scores (*b, t, 1+k) of a miss (column 0) and of every return, relative to clutter; -inf outside the gate.

        Existence e (*b, t) enters as log e + score, and log(1 - e + e exp(miss)): e = 1 changes nothing.
        """
        loglik, distance = innovation.loglik, innovation.distance
        limit: float | Array = threshold if seen.missing is None else self._limits(seen.missing)
        inside = (distance <= limit) & seen.valid[..., None, :]
        if self.clutter == "sensor":
            density = np.broadcast_to(sensor.clutter(seen.z), seen.valid.shape)
            log_density = kernels.safe_log(density)[..., None, :]
            if seen.missing is not None:  # the density over the components that there are
                lengths = [sensor.optional.get(name, 1.0) for name in sensor.measurement.names]
                log_density = log_density + (seen.missing @ np.log(lengths))[..., None, :]
        else:
            log_density = self._sample_density(inside, innovation.log_volume, len(sensor.measurement), threshold)
        gain = loglik[..., 1:] - log_density
        if seen.evidence is not None:
            gain = gain + seen.evidence[..., None, :]
        scores = np.empty_like(loglik)
        scores[..., 0] = kernels.safe_log(1.0 - existence + existence * np.exp(loglik[..., 0]))
        scores[..., 1:] = np.where(inside, gain + kernels.safe_log(existence)[..., None], -np.inf)
        return scores

    def _limits(self, missing: Mask) -> Array:
        """The threshold for the components that each return has (*b, 1, k)."""
        m = missing.shape[-1]
        table = np.array([0.0] + [self.threshold(axes) for axes in range(1, m + 1)])
        limits: Array = table[m - np.sum(missing, axis=-1)][..., None, :]
        return limits

    def frame_scores(self, innovation: Innovation, existence: Array, threshold: float) -> Array:
        """Log scores (*b, t, 2) of a miss and of the frame, whose likelihood is relative to its background already."""
        scores = innovation.loglik + kernels.safe_log(existence)[..., None]
        scores[..., 0] = kernels.safe_log(1.0 - existence + existence * np.exp(innovation.loglik[..., 0]))
        scores[..., 1:] = np.where(innovation.distance <= threshold, scores[..., 1:], -np.inf)
        return scores

    def _sample_density(self, inside: Mask, log_volume: Array, m: int, threshold: float) -> Array:
        """Log of the number of returns in each gate over its volume (*b, t, 1)."""
        log_ball = 0.5 * m * math.log(math.pi * threshold) - math.lgamma(m / 2 + 1)
        count = np.maximum(np.sum(inside, axis=-1), 1)
        density: Array = np.log(count) - log_ball - log_volume
        return density[..., None]
