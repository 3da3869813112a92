"""How many sensors confirm a return: probabilities of the count, given a false alarm and given a target."""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np
from attrs import frozen

from vedette import Array, Sensor

_NODES = 48
"""Number of quadrature points over the base sensor's error: the counts' probabilities are then right to 1e-9."""
_STEPS = 64
"""The same over the distance of the return that confirms."""


@frozen(eq=False)
class Confirmation:
    """The sensors beside the base (n,): variance per axis in m^2, P_D, clutter density in 1/m^2; base: its variance."""

    base: float
    variance: Array
    p_detect: Array
    density: Array

    @classmethod
    def of(cls, sensors: Mapping[str, Sensor], base: str) -> Confirmation:
        """Read the sensors, which must measure positions in the plane with the same isotropic noise everywhere."""
        variance = {name: _variance(name, sensor) for name, sensor in sensors.items()}
        others = [name for name in sensors if name != base]
        origin = np.zeros((1, 2))
        return cls(
            variance[base],
            np.array([variance[name] for name in others]),
            np.array([float(np.max(sensors[name].detects(origin))) for name in others]),
            np.array([float(np.max(sensors[name].clutter(origin))) for name in others]),
        )

    def false_alarm(self, threshold: float) -> Array:
        """Return P_FA = 1 - exp(-density pi threshold^2): a sensor's false return confirms any other return, (n,)."""
        return -np.expm1(-self.density * np.pi * threshold**2)

    def miss(self, threshold: float) -> Array:
        """Return P_M = 1 - P_D (1 - exp(-threshold^2 / (2 (v_base + v)))), the target's return not confirming, (n,)."""
        return 1.0 + self.p_detect * np.expm1(-(threshold**2) / (2 * (self.base + self.variance)))

    def given_clutter(self, threshold: float) -> Array:
        """Return p(k | H0) for k = 1 ... N, the base's false return included: k - 1 sensors confirm it by chance, (N,)."""
        return number_of(self.false_alarm(threshold))

    def given_target(self, threshold: float) -> Array:
        """Return p(k | H1) for k = 1 ... N: k - 1 sensors confirm the target's return at the base, (N,).

        All distances share the base's error e, so confirmations are independent only given e:
        p_j(e) = P_D P(chi2_2(e^2/v_j) < threshold^2/v_j), averaged over e^2/(2 v_base), which is exponential.
        """
        from scipy.special import chndtr

        nodes, weights = np.polynomial.laguerre.laggauss(_NODES)
        square = 2 * self.base * nodes[:, None]
        near = self.p_detect * chndtr(threshold**2 / self.variance, 2, square / self.variance)
        confirmed = 1 - (1 - near) * (1 - self.false_alarm(threshold))
        mean: Array = weights @ number_of(confirmed)
        return mean / np.sum(mean)

    def fused_error(self, threshold: float) -> Array:
        """Return the mean square of the fused return's error over the one that k independent returns have, k = 1 .. N, (N,).

        A low k says that the base erred. Given its error e, a sensor's confirming return is the nearest to the base: the
        target's at the distance d with the density P_D rice(d; e) exp(-density pi d^2), or a false one. With m and s the
        mean along e and the mean square of its error, and 1/v_0 and 1/v the weights of base and others,
        |fused|^2 = [(e/v_0 + (k-1) m/v)^2 + (k-1)(s - m^2)/v^2] / (1/v_0 + (k-1)/v)^2, averaged over e given k.
        The other sensors are taken to be alike: with the means of their variances, P_D and densities.
        """
        from scipy.special import chndtr, ive

        v, p_detect, density = (float(np.mean(values)) for values in (self.variance, self.p_detect, self.density))
        nodes, weights = np.polynomial.laguerre.laggauss(_NODES)
        e = np.sqrt(2 * self.base * nodes)[:, None]
        places, steps = np.polynomial.legendre.leggauss(_STEPS)
        d, step = 0.5 * threshold * (places + 1), 0.5 * threshold * steps
        free = np.exp(-density * np.pi * d**2) * step
        true = p_detect * d / v * np.exp(-((d - e) ** 2) / (2 * v)) * ive(0, e * d / v) * free
        false = 2 * np.pi * density * d * (1 - p_detect * chndtr(d**2 / v, 2, e**2 / v)) * free
        back = d * ive(1, e * d / v) / np.maximum(ive(0, e * d / v), 1e-300)  # the mean way back towards the target
        near = np.sum(true + false, axis=1)
        m = np.sum(true * (e - back) + false * e, axis=1) / near
        s = np.sum(true * (e**2 - 2 * e * back + d**2) + false * (e**2 + d**2), axis=1) / near
        others = np.arange(len(self.variance) + 1.0)
        chances = weights[:, None] * number_of(np.repeat(near[:, None], len(self.variance), axis=1))
        along = e / self.base + others * m[:, None] / v
        square = (along**2 + others * (s - m**2)[:, None] / v**2) / (1 / self.base + others / v)
        return 0.5 * np.sum(chances * square, axis=0) / np.sum(chances, axis=0)


def _variance(name: str, sensor: Sensor) -> float:
    """Return the variance per axis of a sensor whose noise is the same everywhere; ValueError for any other sensor."""
    if len(sensor.measurement) != 2 or sensor.measurement != sensor.observes:
        raise ValueError(f"sensors.{name}: must report positions over two axes, got {sensor.measurement}")
    here, there = (np.broadcast_to(sensor.noise(np.full((1, 2), at)), (1, 2, 2))[0] for at in (0.0, 1e4))
    if not np.allclose(here, here[0, 0] * np.eye(2)) or not np.allclose(here, there):
        raise ValueError(f"sensors.{name}: must have the same noise on both axes and everywhere, got {here.tolist()}")
    return float(here[0, 0])


def number_of(probabilities: Array) -> Array:
    """Return the probabilities (*b, n+1) that 0 ... n of independent events with probabilities (*b, n) happen."""
    counts = np.ones((*probabilities.shape[:-1], 1))
    for p in np.moveaxis(probabilities, -1, 0):
        grown = np.zeros((*counts.shape[:-1], counts.shape[-1] + 1))
        grown[..., :-1] = counts * (1 - p[..., None])
        grown[..., 1:] += counts * p[..., None]
        counts = grown
    return counts
