"""Laws of sensors whose returns start tracks: what one return says about the state."""

from __future__ import annotations

from typing import Any

import numpy as np

from vedette.roles import Sensor
from vedette.space import Array
from vedette.testing.comparisons import Closed, closed_by, demand, deviations, frozen_copy, same_moments, whitened
from vedette.testing.law import Law
from vedette.testing.laws.sensor_cases import Looks, noise_of, regular
from vedette.types import Gaussian

SHARP = 1e-4
"""A sharp return's own noise, as a share of the sensor's variance."""


def inverted(sensor: Sensor, z: Array, noise: Array | None = None) -> Gaussian:
    """What one return gives; Closed if it gives no position."""
    with closed_by(NotImplementedError, "one return does not give a position"):
        return sensor.invert(frozen_copy(z), None if noise is None else frozen_copy(noise))


def a_sharp_return_inverts_exactly(sensor: Sensor, drawn: Looks) -> None:
    """In the limit of a sharp return, the state that it stands for measures as it did, and with its noise: H C H' = R."""
    z, R = sensor.measure(drawn.x), SHARP * noise_of(sensor, drawn.x)
    found, wider = inverted(sensor, z, R), inverted(sensor, z, 2 * R)
    with np.errstate(all="ignore"):
        off = sensor.measurement.difference(z, sensor.measure(found.mean))
        H, root = sensor.jacobian(found.mean), np.linalg.cholesky(R)
        # What does not shrink with the return's noise, such as the doubt about a velocity that it says nothing of, cancels.
        own = wider.cov - found.cov
        white = whitened(root, H @ found.cov @ np.swapaxes(H, -1, -2))
        bent = whitened(root, _bent(sensor, found, own))
        apart = np.linalg.solve(root, off[..., None])[..., 0]
    for i in np.flatnonzero(_nearly_linear(sensor, drawn.x, found, root)):
        otherwise = f"invert: its mean must measure {z[i]}, it measures {z[i] - off[i]}, deviations off: {apart[i]}"
        demand(np.max(np.abs(apart[i])) <= 3.0, otherwise)
        ratios = np.linalg.eigvalsh(white[i])
        most = 1.4 + (2.0 * float(np.linalg.eigvalsh(bent[i])[-1]) if np.all(np.isfinite(bent[i])) else np.inf)
        span = f"{ratios[0]:.3g} to {ratios[-1]:.3g} times that"
        otherwise = f"invert: the covariance, in measured axes, must be the return's noise; is {span}"
        demand(ratios[0] > 0.7 and ratios[-1] < most, otherwise)


def _bent(sensor: Sensor, found: Gaussian, own: Array) -> Array:
    """Return the covariance (*b, m, m) that a return's noise, `own` (*b, n, n), makes of what it leaves open.

    An error of the bearing, for instance, turns an unknown velocity across the line of sight into it: an inverse that
    allows for that is right, as is one to first order, which does not.
    """
    values, axes = np.linalg.eigh(found.cov - own)
    steps = np.swapaxes(axes * np.sqrt(np.maximum(values, 0.0))[..., None, :], -1, -2)  # (*b, n, n): a direction a row
    bent = np.zeros(())
    for step in np.moveaxis(steps, -2, 0):
        ahead, behind = (sensor.jacobian(sensor.observes.displace(found.mean, sign * step)) for sign in (1.0, -1.0))
        change = (ahead - behind) / 2
        bent = bent + change @ own @ np.swapaxes(change, -1, -2)
    return bent


def _nearly_linear(sensor: Sensor, x: Array, found: Gaussian, root: Array) -> Any:
    """Whether (3,) the sensor is linear over what the return leaves open, and over the way back to the state."""
    with np.errstate(all="ignore"):
        H = np.broadcast_to(sensor.jacobian(found.mean), (len(x), len(sensor.measurement), x.shape[-1]))
        good = np.all(np.isfinite(H), axis=(-1, -2))
        # Conversions allow for the noise of angles that the sensor states: where that is large, so is what they add.
        usual = deviations(root @ np.swapaxes(root, -1, -2) / SHARP)
        angles = [axis.unit == "rad" for axis in sensor.measurement.axes]
        good &= np.all(usual[..., angles] < 0.2, axis=-1)
        back = np.swapaxes(np.linalg.pinv(np.where(good[:, None, None], H, 0.0)) @ root, -1, -2)  # (3, m, n), of deviations
        scale = np.maximum(np.max(np.abs(np.linalg.solve(root, H)), axis=(-1, -2)), 1e-300)
        for sign in (-3.0, 3.0):
            for shift in np.swapaxes(back, 0, 1):
                other = sensor.jacobian(sensor.observes.displace(found.mean, sign * shift))
                change = np.max(np.abs(np.linalg.solve(root, other - H)), axis=(-1, -2)) / scale
                good &= np.isfinite(change) & (change < 0.02)
        singular = np.linalg.svd(np.where(good[:, None, None], np.linalg.solve(root, H) / scale[:, None, None], 0.0))[1]
        good &= singular[..., -1] > 1e-6
    return good


def the_usual_noise_is_the_sensors(sensor: Sensor, drawn: Looks) -> None:
    """A return without a noise of its own is inverted with the sensor's."""
    x = regular(sensor, drawn.x)
    z = sensor.measure(x)
    usual = inverted(sensor, z)
    R, there = noise_of(sensor, x), noise_of(sensor, usual.mean)
    constant = np.ptp(R, axis=0).max() <= 1e-12 * np.abs(R).max()
    if not constant and np.abs(there - R).max() > 0.02 * np.abs(R).max():
        raise Closed("its noise depends on the state, which one return does not tell well enough")
    near = 1e-6 if constant else 0.2
    same_moments("invert, without a noise: ", sensor.observes, usual, inverted(sensor, z, R), near)


def inverts_in_batches(sensor: Sensor, drawn: Looks) -> None:
    """Returns over two batch axes stand for what each stands for alone, with its own noise or without."""
    x = regular(sensor, drawn.x)
    z = sensor.measure(x)
    R = noise_of(sensor, x) * np.array([1.0, 2.0, 0.5])[:, None, None]
    block, order = np.stack([z, z[::-1]]), np.array([2, 1, 0])
    for own in (None, R):
        alone = inverted(sensor, z, own)
        both = inverted(sensor, block, None if own is None else np.stack([own, own[order]]))
        twice = Gaussian(*(np.stack([part, part[order]]) for part in (alone.mean, alone.cov)))
        same_moments(f"invert, of returns {block.shape}: ", sensor.observes, both, twice, 1e-9)


LAWS = (Law(inverts_in_batches), Law(a_sharp_return_inverts_exactly), Law(the_usual_noise_is_the_sensors))
