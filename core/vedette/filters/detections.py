"""Detections prepared for a filter: residuals, their own noises, missing components."""

from __future__ import annotations

from typing import Any

import numpy as np
from attrs import frozen

from vedette import kernels
from vedette.roles import Sensor
from vedette.space import Array, Mask
from vedette.types import Detections, Innovation


@frozen(eq=False)
class Prepared:
    """The detections of a scan against predicted tracks, so that a filter need not ask what each detection holds.

    residuals     (*b, t, k, m)        detection minus expectation, 0 for a missing component
    noise         (*b, 1|t, 1|k, m, m) the detection's own or the sensor's; a missing component has variance 1, uncorrelated
    log_constant  (*b, 1, k) or 0      to be added to the log of a Gaussian over all m components, to correct for the
                                       missing ones
    present       (*b, 1, k, m)        which components there are; None if all

    For states that are points (*b, t, p, n), an axis p comes before the components in all of them.
    """

    sensor: Sensor
    z: Array
    residuals: Array
    noise: Array
    log_constant: Array | float
    present: Mask | None

    def residuals_from(self, expected: Array) -> Array:
        """Return the residuals (*b, t, k, m) from what each track expects of each detection separately (*b, t, k, m)."""
        residuals = self.sensor.measurement.difference(self.z, expected)
        return residuals if self.present is None else np.where(self.present, residuals, 0.0)

    def rows(self, slope: Array) -> Array:
        """Return derivatives (*b, t, 1|k, m, n) with 0 in the rows of missing components."""
        return slope if self.present is None else slope * self.present[..., None]

    def columns(self, deviations: Array) -> Array:
        """Return deviations of points (*b, t, 1, p, m) with 0 in missing components: (*b, t, 1|k, p, m)."""
        return deviations if self.present is None else deviations * self.present[..., None, :]


def prepare(sensor: Sensor, detections: Detections, expected: Array, noise: Array, points: bool = False) -> Prepared:
    """Return the detections as residuals from what is expected of them, and noises where they bring none of their own.

    Parameters
    ----------
    sensor
        The sensor of the scan.
    detections
        The scan: z (*b, k, m).
    expected
        Expected measurements (*b, t, m); of points (*b, t, p, m).
    noise
        The sensor's R there, (*b, t, m, m) or (m, m); of points (*b, t, p, m, m) or (m, m).
    points
        Whether each track is p points.

    Returns
    -------
    Prepared
        Residuals and noises in which missing components say nothing.
    """
    z, of_return, missing = detections.z[..., None, :, :], detections.noise, detections.missing
    present = None if missing is None else ~missing[..., None, :, :]
    if points:
        z, expected = z[..., None, :], expected[..., :, None, :, :]
        present = None if present is None else present[..., None, :]
        of_return = None if of_return is None else of_return[..., None, :, :]
        noise = noise[..., None, :, :, :] if noise.ndim > 2 else noise
        R = noise if of_return is None else of_return[..., None, :, :, :, :]
    else:
        expected = expected[..., :, None, :]
        R = noise[..., None, :, :] if of_return is None else of_return[..., None, :, :, :]
    residuals = sensor.measurement.difference(z, expected)
    if present is None:
        return Prepared(sensor, z, residuals, R, 0.0, None)
    log_constant = 0.5 * np.log(2 * np.pi) * np.sum(~present, axis=-1)
    return Prepared(sensor, z, np.where(present, residuals, 0.0), present_noise(R, present), log_constant, present)


def present_noise(R: Array, present: Mask) -> Array:
    """Return noise (*b, m, m) over the components that are `present` (*b, m); a missing one has variance 1, uncorrelated.

    With its residual and its row of H at 0 it then changes neither gain, distance nor determinant.
    """
    both = present[..., :, None] & present[..., None, :]
    return np.where(both, R, 0.0) + np.eye(present.shape[-1]) * ~present[..., None]


def make_innovation(
    sensor: Sensor,
    x: Array,
    p_gate: float,
    loglik: Array,
    distance: Array,
    log_volume: Array,
    detail: Any,
    in_view: Mask | None = None,
) -> Innovation:
    """Return the innovation of tracks, with the detection probability at their states.

    Parameters
    ----------
    sensor
        The sensor of the scan.
    x
        The axes that the sensor observes (*b, t, ...).
    p_gate
        Probability that the target's own return is inside the gate.
    loglik
        Log density of each detection (*b, t, k), in 1 / volume of the measurement space.
    distance
        Squared distances (*b, t, k).
    log_volume
        Logarithm of sqrt|S| (*b, t, 1|k).
    detail
        What `update` reads of it.
    in_view
        Where the scan covers the track at all (*b, t): elsewhere the detection probability is 0; default: everywhere.

    Returns
    -------
    Innovation
        Its loglik is (*b, t, 1+k), column 0 the miss.
    """
    p_detect = np.asarray(sensor.detects(x))
    if in_view is not None:
        p_detect = np.where(in_view, p_detect, 0.0)
    columns = np.empty((*loglik.shape[:-1], 1 + loglik.shape[-1]))
    columns[..., 0] = kernels.safe_log(1.0 - p_detect * p_gate)
    columns[..., 1:] = loglik + kernels.safe_log(p_detect)[..., None]
    volume = np.broadcast_to(np.max(log_volume, axis=-1, initial=-np.inf), loglik.shape[:-1])
    return Innovation(columns, distance, volume, distance, detail)
