"""Returns of targets that may be anywhere."""

from __future__ import annotations

from collections.abc import Mapping, Sequence

import numpy as np

from vedette import Array, Gaussian, Sensor


def over_places(
    sensor: Sensor, spot: Gaussian, z: Array, noise: Array | None, own: Sequence[bool], spread: Mapping[str, float]
) -> Array:
    """Return the integral (k,) of the likelihood of returns z (k, m) over all places, the observed axes that are `own`.

    Other observed axes are N(0, spread^2). spot: what `Sensor.invert` says of the returns. Around its place, and 0 in other
    axes, z = h + P p + V v + w: the integral over p of N(z; h + P p, S), S = R + V diag(spread^2) V'.
    """
    names, m = sensor.observes.names, z.shape[-1]
    inner, outer = np.flatnonzero(own), np.flatnonzero(~np.array(own))
    R = np.broadcast_to(sensor.noise(spot.mean) if noise is None else noise, (*z.shape, m))
    if not len(outer):
        return np.asarray(np.sqrt(np.linalg.det(spot.cov) / np.linalg.det(R)))
    x = spot.mean.copy()
    x[:, outer] = 0.0
    H = np.broadcast_to(sensor.jacobian(x), (*z.shape, len(names)))
    P, V = H[..., inner], H[..., outer]
    S = R + (V * [spread[names[i]] ** 2 for i in outer]) @ np.swapaxes(V, -1, -2)
    off = sensor.measurement.difference(z, sensor.measure(x))[..., None]
    told, back = np.linalg.solve(S, np.concatenate([P, off], axis=-1)), np.swapaxes(P, -1, -2)
    A, b = back @ told[..., :-1], back @ told[..., -1:]
    square = np.swapaxes(off, -1, -2) @ told[..., -1:] - np.swapaxes(b, -1, -2) @ np.linalg.solve(A, b)
    size = np.linalg.det(S) * np.linalg.det(A) * (2.0 * np.pi) ** (m - len(inner))
    return np.asarray(np.exp(-0.5 * square[..., 0, 0]) / np.sqrt(size))
