"""Images of hot spots on a grid of pixels, each pixel the mean of the intensity over its square, and their derivatives."""

from __future__ import annotations

import numpy as np

from vedette import Array

_ROOT_HALF_PI = np.sqrt(0.5 * np.pi)
_NODES, _WEIGHTS = np.polynomial.legendre.leggauss(4)


def profile(offsets: Array, spread: Array) -> tuple[Array, Array, Array]:
    """e^(-u^2 / 2 s^2) averaged over each pixel: value, and derivatives to the spot's position and to s, (*b, w) each.

    `offsets` (*b, w): pixel centres relative to the spot, in px; `spread` s (*b). With e+- the pixel's edges:
    s sqrt(pi/2) [erf(e+ / s sqrt2) - erf(e- / s sqrt2)], and -[E(e+) - E(e-)], E(e) = e^(-e^2 / 2 s^2).
    """
    from scipy.special import erf

    s = spread[..., None]
    edges = np.concatenate([offsets - 0.5, offsets[..., -1:] + 0.5], axis=-1)
    u = edges / s
    tail, bell = erf(u * np.sqrt(0.5)), np.exp(-0.5 * u * u)
    value = _ROOT_HALF_PI * s * np.diff(tail, axis=-1)
    return value, -np.diff(bell, axis=-1), value / s - np.diff(u * bell, axis=-1)


def circular(x: Array, y: Array, spread: Array) -> tuple[Array, Array, Array]:
    """A circular spot of peak 1: image (*b, w, w), slopes to its position (*b, 2, w, w) and to its spread (*b, w, w).

    x, y (*b, w): columns' and rows' centres relative to it, in px; spread (*b) in px.
    """
    across, across_slope, across_spread = profile(x, spread)
    down, down_slope, down_spread = profile(y, spread)
    image = down[..., :, None] * across[..., None, :]
    slopes = np.stack(
        [down[..., :, None] * across_slope[..., None, :], down_slope[..., :, None] * across[..., None, :]], axis=-3
    )
    wider = down[..., :, None] * across_spread[..., None, :] + down_spread[..., :, None] * across[..., None, :]
    return image, slopes, wider


def elliptic(x: Array, y: Array, precision: Array) -> tuple[Array, Array]:
    """e^(-d' precision d / 2) averaged over each pixel: image (*b, w, w), slopes to its position (*b, 2, w, w).

    By 4 x 4 Gauss-Legendre points in each pixel, exact to 1e-6 of the peak for widths of at least .7 px; `precision`
    (*b, 2, 2) in 1/px^2 is the inverse of the covariance of the intensity.
    """
    dx = (x[..., :, None] + 0.5 * _NODES).reshape(*x.shape[:-1], -1)[..., None, :]
    dy = (y[..., :, None] + 0.5 * _NODES).reshape(*y.shape[:-1], -1)[..., :, None]
    a, b, c = (precision[..., i, j, None, None] for i, j in ((0, 0), (0, 1), (1, 1)))
    bell = np.exp(-0.5 * (a * dx * dx + 2.0 * b * dx * dy + c * dy * dy))
    parts = np.stack([bell, bell * (a * dx + b * dy), bell * (b * dx + c * dy)], axis=-3)
    w, q = x.shape[-1], len(_NODES)
    blocks = parts.reshape(*parts.shape[:-2], w, q, w, q)
    mean = np.einsum("...iajb,a,b->...ij", blocks, 0.5 * _WEIGHTS, 0.5 * _WEIGHTS)
    # The position moves against the offset: d/dp of -d'Wd/2 with d = pixel - p is W d.
    return mean[..., 0, :, :], mean[..., 1:, :, :]


def precision(sigma_x: float, sigma_y: float, correlation: float) -> Array:
    """Of the bivariate intensity exp{-1/(2(1-r^2)) [dx^2/sx^2 + dy^2/sy^2 - 2 r dx dy/(sx sy)]}: (2, 2)"""
    off = correlation * sigma_x * sigma_y
    return np.linalg.inv(np.array([[sigma_x**2, off], [off, sigma_y**2]]))
