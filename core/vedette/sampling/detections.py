"""What a sensor reports of objects, drawn from its own model: detections and their noise, among clutter."""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np

from vedette.roles import Sensor
from vedette.sampling.clutter import Bounds, draw_clutter
from vedette.sampling.gaussians import psd_root
from vedette.space import Array, Mask
from vedette.types import Detections


def returns(sensor: Sensor, x: Array, uniform: Array, standard: Array) -> tuple[Array, Mask]:
    """Return what a sensor measures of objects under given noise, z = h(x) + L w with L L' = R(x), and which it detects.

    Parameters
    ----------
    sensor
        The sensor, placed if it stands on a platform.
    x
        States of the objects (*b, t, n) over the axes that the sensor observes.
    uniform
        Numbers in [0, 1), (*b, t): an object is detected if its number is below P_D(x).
    standard
        Standard normal numbers (*b, t, m), the w above.

    Returns
    -------
    tuple of arrays
        Measurements z (*b, t, m), wrapped, and which of them are detected (*b, t).
    """
    noise = (psd_root(sensor.noise(x)) @ standard[..., None])[..., 0]
    return sensor.measurement.displace(sensor.measure(x), noise), uniform < sensor.detects(x)


def shuffled(z: Array, valid: Mask, rng: np.random.Generator) -> Detections:
    """Put the valid returns first, in random order.

    Parameters
    ----------
    z
        Returns (*b, k, m).
    valid
        Which of them there are (*b, k).
    rng
        The generator that is drawn from.

    Returns
    -------
    Detections
        Shortened to the longest run; padding of the shorter ones is 0.
    """
    key = np.where(valid, rng.random(valid.shape), 2.0)
    order = np.argsort(key, axis=-1, kind="stable")[..., : int(np.max(np.sum(valid, axis=-1), initial=0))]
    valid = np.take_along_axis(valid, order, axis=-1)
    z = np.take_along_axis(z, order[..., None], axis=-2)
    return Detections(np.where(valid[..., None], z, 0.0), valid)


def draw_detections(
    sensor: Sensor, x: Array, rng: np.random.Generator, region: Mapping[str, Bounds] | None = None, alive: Mask | None = None
) -> Detections:
    """Draw one scan of objects, in random order.

    Parameters
    ----------
    sensor
        The sensor, placed if it stands on a platform.
    x
        States of the objects (*b, t, n) over the axes that the sensor observes.
    rng
        The generator that is drawn from.
    region
        Measured axis to the limits within which clutter is drawn, in the axis' unit; default: no clutter.
    alive
        Which objects there are (*b, t); default: all.

    Returns
    -------
    Detections
        z (*b, k, m) and valid (*b, k).

    Raises
    ------
    ValueError
        If x lacks an axis, or for what `draw_clutter` refuses.
    """
    if x.shape[-1] != len(sensor.observes):
        raise ValueError(f"x: must have the {len(sensor.observes)} axes {sensor.observes}, got shape {x.shape}")
    shape = x.shape[:-1]
    z, valid = returns(sensor, x, rng.random(shape), rng.standard_normal((*shape, len(sensor.measurement))))
    if alive is not None:
        valid = valid & alive
    if region is not None:
        false, kept = draw_clutter(sensor, region, rng, shape[:-1])
        z, valid = np.concatenate([z, false], axis=-2), np.concatenate([valid, kept], axis=-1)
    return shuffled(z, valid, rng)
