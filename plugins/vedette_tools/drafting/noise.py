"""The noise of a sensor and of its targets, by the likelihood of their chains of returns."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from typing import Any

import numpy as np
from attrs import frozen

from vedette.space import Array
from vedette_tools.drafting.chains import Chain

LONGEST = 80
"""Chains are cut into windows of at most so many returns."""

MOST = 300
"""So many windows are enough."""

OUTLIER = 20.0
"""A squared distance beyond it counts no more: a return that is not the target's says nothing of the noise."""


OUTLIERS = 0.05
"""More outliers than this part are not: the targets then move as the model does not, and their returns count."""

LEAST = 14.0
"""A noise is at least exp(-14), a millionth, of its first guess."""


@frozen(eq=False)
class Windows:
    """Stretches of chains: positions (w, s, 2), the lines of sight J (w, s, 2, 2), which are used (w, s).

    `moves` and `shakes` (w, s, 4, 4) are F and Q, for an acceleration noise of 1 m/s^2, from the time before each.
    """

    spots: Array
    lines: Array
    used: Array
    moves: Array
    shakes: Array

    @classmethod
    def of(cls, chains: Sequence[Chain], lines: Sequence[Array]) -> Windows:
        """Cut chains into windows; `lines` (s, 2, 2) of each chain map a sensor's errors to errors in the plane."""
        pieces = []
        for chain, line in zip(chains, lines, strict=True):
            count = max(1, -(-len(chain.times) // LONGEST))
            pieces += [
                (chain.times[part], chain.spots[part], line[part])
                for part in np.array_split(np.arange(len(chain.times)), count)
            ]
        step = max(1, len(pieces) // MOST)
        pieces = [piece for piece in pieces[::step] if len(piece[0]) >= 4]
        longest = max((len(times) for times, _, _ in pieces), default=0)

        def padded(k: int) -> Array:
            return np.array([piece[k][np.minimum(np.arange(longest), len(piece[k]) - 1)] for piece in pieces])

        used = np.array([np.arange(longest) < len(piece[0]) for piece in pieces])
        dt = np.diff(padded(0), axis=1, prepend=padded(0)[:, :1])[..., None, None] * np.eye(2)
        moves, shakes = np.tile(np.eye(4), (*dt.shape[:2], 1, 1)), np.zeros((*dt.shape[:2], 4, 4))
        moves[..., :2, 2:] = dt
        shakes[..., :2, :2], shakes[..., 2:, 2:] = dt**3 / 3, dt
        shakes[..., :2, 2:] = shakes[..., 2:, :2] = dt**2 / 2
        return cls(padded(1), padded(2), used, moves, shakes)


@frozen
class Noise:
    """Standard deviations of a sensor's errors in its units, and of the targets' acceleration, m/s^2.

    `evidence` is the log-likelihood of the returns, each in m^-2, against 1 m^-2.
    """

    sensor: tuple[float, ...]
    accel: float
    evidence: float = 0.0


def estimated(windows: Windows, guess: Sequence[float], speed: float, free: Callable[[Array], Array]) -> Noise:
    """Return the noise of greatest likelihood, starting at `guess`: the sensor's errors, the acceleration.

    The targets move at nearly constant velocity with white acceleration, their speeds being of the order of `speed`. `free`
    maps the sensor's parameters to the standard deviations of the two errors that `Windows.lines` map.
    """
    for outlier in (OUTLIER, 10 * OUTLIER, 100 * OUTLIER):
        estimate = _estimated(windows, guess, speed, free, outlier)
        _, beyond = _filtered(windows, free(np.array(estimate.sensor)), estimate.accel, speed, outlier)
        if beyond <= OUTLIERS:
            break
    return estimate


def _estimated(
    windows: Windows, guess: Sequence[float], speed: float, free: Callable[[Array], Array], outlier: float
) -> Noise:
    from scipy.optimize import minimize

    def lost(logs: Array) -> float:
        values = np.exp(np.maximum(logs, start - LEAST))  # returns without any error would make it 0
        return -_filtered(windows, free(values[:-1]), float(values[-1]), speed, outlier)[0]

    start = np.log(np.asarray(guess, dtype=float))
    simplex = np.vstack([start, start + 1.0 * np.eye(len(start))])
    options: Any = {"initial_simplex": simplex, "xatol": 0.05, "fatol": 0.2, "maxfev": 200}
    best = minimize(lost, start, method="Nelder-Mead", options=options)
    *sensor, accel = np.exp(np.maximum(best.x, start - LEAST)).tolist()
    return Noise(tuple(sensor), accel, -float(best.fun))


def loglik(windows: Windows, sigmas: Array, accel: float, speed: float) -> float:
    """Return the log-likelihood of all windows, each by a Kalman filter that starts at its first return."""
    return _filtered(windows, sigmas, accel, speed, OUTLIER)[0]


def _filtered(windows: Windows, sigmas: Array, accel: float, speed: float, outlier: float) -> tuple[float, float]:
    """Return the log-likelihood of all windows, and which part of their returns are outliers."""
    w, s = windows.used.shape
    noise = windows.lines * sigmas
    R = noise @ np.swapaxes(noise, -1, -2)
    mean, P = np.zeros((w, 4, 1)), np.zeros((w, 4, 4))
    mean[:, :2, 0], P[:, :2, :2] = windows.spots[:, 0], R[:, 0]
    P[:, 2, 2] = P[:, 3, 3] = (2.0 * speed) ** 2
    singles, beyond = [], 0
    for i in range(1, s):
        F = windows.moves[:, i]
        mean, P = F @ mean, F @ P @ np.swapaxes(F, -1, -2) + accel**2 * windows.shakes[:, i]
        S = P[:, :2, :2] + R[:, i]
        squares = S[:, 0, 0] * S[:, 1, 1]
        det = np.maximum(squares - S[:, 0, 1] ** 2, np.finfo(float).eps * squares)  # rounding may take all
        inverse = (np.trace(S, axis1=-2, axis2=-1)[:, None, None] * np.eye(2) - S) / det[:, None, None]
        gain = P[:, :, :2] @ inverse
        apart = windows.spots[:, i, :, None] - mean[:, :2]
        distance = (np.swapaxes(apart, -1, -2) @ inverse @ apart)[:, 0, 0]
        single = -0.5 * np.minimum(distance, outlier) - 0.5 * np.log(det) - np.log(2 * np.pi)
        singles.append(np.where(windows.used[:, i], single, 0.0))
        gain = np.where((distance < outlier)[:, None, None], gain, 0.0)
        beyond += int(np.count_nonzero((distance >= outlier) & windows.used[:, i]))
        rest = np.eye(4) - np.pad(gain, ((0, 0), (0, 0), (0, 2)))
        mean = mean + gain @ apart  # P after Joseph: the shorter P - gain @ P[:, :2] may lose its sign to rounding
        P = rest @ P @ np.swapaxes(rest, -1, -2) + gain @ R[:, i] @ np.swapaxes(gain, -1, -2)
    return float(np.sum(singles)), beyond / max(int(np.count_nonzero(windows.used)), 1)


def plausible(sigmas: tuple[float, ...], spread: float) -> tuple[float, ...]:
    """Return noise in m, then in rad of a bearing, as a sensor may have it: returns that all lie in one place show none.

    spread: of all returns, in m; what lies in a millimetre has smaller errors than ships have.
    """
    least = min(1e-3, 1e-6 * spread) or 1e-3
    return tuple(
        float(np.clip(sigma, *limits)) for sigma, limits in zip(sigmas, ((least, np.inf), (1e-6, 1.0)), strict=False)
    )
