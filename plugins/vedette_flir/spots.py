"""Images of hot spots on a grid of pixels, each pixel the mean of the intensity over its square, and their derivatives."""

from __future__ import annotations

import numpy as np

from vedette import Array

_ROOT_HALF_PI = np.sqrt(0.5 * np.pi)
_NODES, _WEIGHTS = np.polynomial.legendre.leggauss(5)
_HALVES = 0.5 * _WEIGHTS


def profile(offsets: Array, spread: Array) -> tuple[Array, Array, Array]:
    """Average e^(-u^2 / 2 s^2) over each pixel: value, and derivatives to the spot's position and to s, (*b, w) each.

    `offsets` (*b, w): pixel centres relative to the spot, in px; `spread` s (*b). With e+- the pixel's edges:
    s sqrt(pi/2) [erf(e+ / s sqrt2) - erf(e- / s sqrt2)], and -[E(e+) - E(e-)], E(e) = e^(-e^2 / 2 s^2).
    """
    s = spread[..., None]
    u = _edges(offsets, s)
    bell, value = np.exp(-0.5 * u * u), _mean(u, s)
    return value, -np.diff(bell, axis=-1), value / s - np.diff(u * bell, axis=-1)


def _edges(offsets: Array, s: Array) -> Array:
    """Return the pixels' edges in units of s: (*b, w) -> (*b, w + 1)."""
    return np.concatenate([offsets - 0.5, offsets[..., -1:] + 0.5], axis=-1) / s


def _mean(u: Array, s: Array) -> Array:
    """Return the mean over each pixel between edges u (*b, w + 1): (*b, w)."""
    from scipy.special import erf

    mean: Array = _ROOT_HALF_PI * s * np.diff(erf(u * np.sqrt(0.5)), axis=-1)
    return mean


def disc(x: Array, y: Array, spread: Array) -> Array:
    """Return the image of a circular spot of peak 1 alone, as `circular` does: (*b, h, w)."""
    s = spread[..., None]
    across, down = (_mean(_edges(offsets, s), s) for offsets in (x, y))
    return down[..., :, None] * across[..., None, :]


def circular(x: Array, y: Array, spread: Array) -> tuple[Array, Array, Array]:
    """Return a circular spot of peak 1: image (*b, w, w), slopes to its position (*b, 2, w, w) and to its spread (*b, w, w).

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


def elliptic(x: Array, y: Array, covariance: Array) -> tuple[Array, Array, Array]:
    """Average e^(-d' C^-1 d / 2) over each pixel: image (*b, w, w), its slopes (*b, 2, w, w) and bends (*b, 3, w, w).

    `covariance` C (*b, 2, 2), in px^2. With u = C^-1 d the slopes, to the position, are the means of u e^(..), and the bends
    those of ux ux, ux uy and uy uy e^(..): a change of C changes the image by u' dC u / 2. By 5 x 5 Gauss-Legendre points in
    each pixel, exact to 2e-6 of the peak where the narrowest width is at least .4 px.
    """
    bell, ux, uy = _points(x, y, covariance)
    parts = np.stack([bell, bell * ux, bell * uy, bell * ux * ux, bell * ux * uy, bell * uy * uy], axis=-3)
    mean = _over_pixels(parts)
    return mean[..., 0, :, :], mean[..., 1:3, :, :], mean[..., 3:, :, :]


def oval(x: Array, y: Array, covariance: Array) -> Array:
    """Return the image of `elliptic` alone: (*b, h, w)."""
    return _over_pixels(_points(x, y, covariance)[0])


def _points(x: Array, y: Array, covariance: Array) -> tuple[Array, Array, Array]:
    """Return e^(-d' C^-1 d / 2) and u = C^-1 d at the points within all pixels, (*b, 5 h, 5 w) each."""
    dx = (x[..., :, None] + 0.5 * _NODES).reshape(*x.shape[:-1], x.shape[-1] * len(_NODES))[..., None, :]
    dy = (y[..., :, None] + 0.5 * _NODES).reshape(*y.shape[:-1], y.shape[-1] * len(_NODES))[..., :, None]
    a, b, c = (covariance[..., i, j, None, None] for i, j in ((0, 0), (0, 1), (1, 1)))
    det = a * c - b * b
    ux, uy = (c * dx - b * dy) / det, (a * dy - b * dx) / det
    return np.exp(-0.5 * (ux * dx + uy * dy)), ux, uy


def _over_pixels(points: Array) -> Array:
    """Return the means over the pixels of what is known at the points within them: (*b, 5 h, 5 w) -> (*b, h, w)."""
    q = len(_NODES)
    rows, columns = points.shape[-2] // q, points.shape[-1] // q
    parts = points.reshape(*points.shape[:-2], rows, q, columns, q)
    mean: Array = np.einsum("...iajb,a,b->...ij", parts, _HALVES, _HALVES, optimize=True)
    return mean


def bivariate(sigma_x: Array, sigma_y: Array, correlation: Array) -> Array:
    """Return the covariance of exp{-1/(2(1-r^2)) [dx^2/sx^2 + dy^2/sy^2 - 2 r dx dy/(sx sy)]}: (*b) -> (*b, 2, 2)."""
    off = correlation * sigma_x * sigma_y
    return np.stack([np.stack([sigma_x**2, off], axis=-1), np.stack([off, sigma_y**2], axis=-1)], axis=-2)


def slopes_overlap(first: Array, second: Array, apart: Array) -> Array:
    """Return the integral over the plane of the product of two spots' slopes, both of peak 1: (*b, 2, 2).

    `first`, `second` (*b, 2, 2): their covariances in px^2; `apart` (*b, 2): from one to the other in px. With S their sum:
    2 pi sqrt(|first| |second| / |S|) e^(-d' S^-1 d / 2) (S^-1 - S^-1 d d' S^-1).
    """
    S = first + second
    inverse = np.linalg.inv(S)
    lever = (inverse @ apart[..., None])[..., 0]
    volume = 2.0 * np.pi * np.sqrt(np.linalg.det(first) * np.linalg.det(second) / np.linalg.det(S))
    share = volume * np.exp(-0.5 * np.sum(apart * lever, axis=-1))
    return np.asarray(share[..., None, None] * (inverse - lever[..., :, None] * lever[..., None, :]))
