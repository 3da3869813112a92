"""The gate: the only place where scores are asked for."""

from __future__ import annotations

import math
from collections.abc import Mapping
from typing import Any, ClassVar

import numpy as np
from attrs import frozen

from vedette import fields, kernels
from vedette.roles import Sensor
from vedette.space import Array, Mask
from vedette.supporting import ImagingSensor
from vedette.types import Detections, Frame, Innovation

HOPELESS = 60.0
"""Without a gate, a return so many nats below a miss counts for nothing, and links no tracks: the probability of a pair is
at most exp(score - miss), here 1e-26, beyond the digits of any weight.
"""


@frozen(eq=False)
class SensorGate:
    """A gate's constants for one sensor: the threshold on the squared distance, log of the volume inside it where |S| = 1,
    and log of the clutter density where that is the same everywhere (), else None. `axes`: how many a return has, 0 for a
    camera, whose frames have no threshold. beyond: for confirmed tracks, likely returns beyond the threshold count, too.
    """

    sensor: Sensor
    axes: int
    threshold: float
    log_ball: float
    log_density: Array | None
    beyond: bool = False


@frozen
class Gate:
    """Which returns a track considers, and against what clutter density.

    A return counts if its squared distance is within the chi-square quantile of `probability` for the measured axes (with
    several modes: in any of their gates). Where tracks may begin, one beyond it counts for a confirmed track, too, if that
    is likelier than a miss: else the track's own outlier begins a second one. With a probability of 1, which a config may
    write as `gate = "off"`, all returns count. Those beyond a `largest_distance` never do. A frame is one return, without a
    threshold: its pixels decide, by their likelihood ratio to the background against 1 - P_D P_G of a miss. `clutter`:
    "sensor" takes the density that the sensor states; "nonparametric" takes the number of returns in the gate over its
    volume, for scenes of unknown clutter. Bar-Shalom, Li, Multitarget-Multisensor Tracking, 1995, section 3.4.
    """

    words: ClassVar[Mapping[str, Mapping[str, Any]]] = {"off": {"probability": 1.0}}

    probability: float = fields.probability("that a target's return falls in its gate; 1: no gate", default=0.99, above=0)
    clutter: str = fields.choice("where the clutter density comes from", ("sensor", "nonparametric"), default="sensor")
    largest_distance: float | None = fields.quantity(
        "1", "squared distance beyond which returns are left out, however likely; default: no limit", default=None, above=0
    )

    def __attrs_post_init__(self) -> None:
        if self.clutter == "nonparametric" and self.probability == 1:
            raise ValueError("clutter: 'nonparametric' counts the returns in a gate: it needs a probability < 1, got 1")

    def threshold(self, axes: int) -> float:
        """Return the largest squared distance inside the gate, for `axes` measured axes; inf without a gate."""
        quantile = float(kernels.gate_threshold(axes, self.probability))
        return quantile if self.largest_distance is None else min(quantile, self.largest_distance)

    def for_sensor(self, sensor: Sensor, beyond: bool = False) -> SensorGate:
        """Return the gate's constants for one sensor, the same for every scan."""
        axes, beyond = len(sensor.measurement), beyond and self.probability < 1 and self.largest_distance is None
        if isinstance(sensor, ImagingSensor):
            return SensorGate(sensor, 0, math.inf, math.inf, None)
        threshold = self.threshold(axes)
        log_ball = 0.5 * axes * math.log(math.pi * threshold) - math.lgamma(axes / 2 + 1)
        if self.clutter != "sensor":
            return SensorGate(sensor, axes, threshold, log_ball, None, beyond)
        # A density without the batch's axes does not depend on the return: the contract says so.
        density = np.asarray(sensor.clutter(np.zeros((0, axes))))
        log_density = kernels.safe_log(density) if density.ndim == 0 else None
        return SensorGate(sensor, axes, threshold, log_ball, log_density, beyond)

    def scores(
        self,
        innovation: Innovation,
        sensor: Sensor,
        observed: Detections | Frame,
        existence: Array,
        sensor_gate: SensorGate,
        rate: Array | None = None,
        sure: Mask | None = None,
    ) -> Array:
        """Return log scores (*b, t, 1+k) of a miss (column 0) and each return, relative to clutter; -inf outside the gate.

        Existence e (*b, t) enters as log e + score, and log(1 - e + e exp(miss)): e = 1 changes nothing. `sensor` is that of
        `sensor_gate`, or it elsewhere. `rate` (k,) is the density of returns from targets without a track, beside the
        clutter's; `sure` (*b, t): confirmed tracks. A frame's likelihood is relative to its background already.
        """
        distance, limit, log_density = innovation.distance, sensor_gate.threshold, sensor_gate.log_density
        if log_density is None or rate is not None or observed.missing is not None or sensor is not sensor_gate.sensor:
            if isinstance(observed, Frame):
                return self._frame_scores(innovation, existence)
            limit, log_density = self._against(innovation, sensor, observed, sensor_gate, rate)
        evidence = None if observed.evidence is None else observed.evidence[..., None, :]
        # A frame has returned above: its sensor states no density.
        valid, sure = observed.valid, sure if sensor_gate.beyond else None  # type: ignore[union-attr]
        scores = kernels.gate_scores(innovation.loglik, distance, valid, existence, limit, log_density, evidence, sure)
        if sensor_gate.threshold == math.inf:
            scores[..., 1:][scores[..., 1:] < scores[..., :1] - HOPELESS] = -math.inf
        return scores

    def _against(
        self, innovation: Innovation, sensor: Sensor, detections: Detections, sensor_gate: SensorGate, rate: Array | None
    ) -> tuple[Any, Array]:
        """Return the limit of the squared distance, and log of the density of all other sources of returns."""
        limit = sensor_gate.threshold if detections.missing is None else self._limits(detections.missing)
        if self.clutter == "nonparametric":
            valid, volume = detections.valid, innovation.log_volume
            log_density = kernels.sample_density(innovation.distance, valid, limit, volume, sensor_gate.log_ball)
        else:
            log_density = self.stated_density(sensor, detections)
        return limit, log_density if rate is None else np.logaddexp(log_density, kernels.safe_log(rate))

    def stated_density(self, sensor: Sensor, detections: Detections) -> Array:
        """Return the log of the sensor's clutter density at each return (*b, 1, k), over the components that it has."""
        density = np.empty(detections.valid.shape)
        density[...] = sensor.clutter(detections.z)
        log_density = kernels.safe_log(density)
        if detections.missing is not None:
            lengths = [sensor.optional.get(name, 1.0) for name in sensor.measurement.names]
            log_density = log_density + detections.missing @ np.log(lengths)
        return log_density[..., None, :]

    def reach(self, gate: SensorGate, sensor: Sensor, detections: Detections, x: Array, existence: Array) -> Array:
        """Return the squared distance (t,) beyond which no return is likelier than a miss of tracks x (t, n), which are of
        `existence` (t,): where e P_D N(z; 0, S) / density = 1 - e P_D P_G. |S| is taken to be |R|: it is no less.
        """
        if self.clutter == "sensor":
            noise = sensor.noise(x) if detections.noise is None else detections.noise
            density = self.stated_density(sensor, detections) if gate.log_density is None else gate.log_density
            spread = 0.5 * np.linalg.slogdet(noise)[1].min(initial=math.inf) + density.min(initial=math.inf)
        else:
            spread = -gate.log_ball
        there, evidence = existence * sensor.detects(x), detections.evidence
        odds = kernels.safe_log(there) - np.log1p(-self.probability * there) - spread
        more = 0.0 if evidence is None else np.max(evidence, initial=0.0)
        return 2.0 * (odds + more) - gate.axes * math.log(2.0 * math.pi)

    def _limits(self, missing: Mask) -> Array:
        """Return the threshold for the components that each return has (*b, 1, k)."""
        m = missing.shape[-1]
        table = np.array([0.0] + [self.threshold(axes) for axes in range(1, m + 1)])
        return table[m - np.sum(missing, axis=-1)][..., None, :]

    def _frame_scores(self, innovation: Innovation, existence: Array) -> Array:
        """Return log scores (*b, t, 2) of a miss and of the frame."""
        scores = innovation.loglik + kernels.safe_log(existence)[..., None]
        scores[..., 0] = kernels.safe_log(1.0 - existence + existence * np.exp(innovation.loglik[..., 0]))
        return scores
