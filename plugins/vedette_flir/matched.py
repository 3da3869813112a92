"""The filter of the paper on matched truth, many runs in lock-step, and the bounds that it is compared with."""

from __future__ import annotations

from collections.abc import Iterator
from typing import Any

import numpy as np
from attrs import frozen

from vedette import Array, Frame, Gaussian, Mask, Scan, load
from vedette.metrics import nees
from vedette.montecarlo import run_together
from vedette.sampling import draw_gaussian, draw_states
from vedette_flir.motion.atmospheric_wander import AtmosphericWander
from vedette_flir.motion.jittered_wander import JitteredWander
from vedette_flir.sensors.gaussian_spot import GaussianSpot
from vedette_flir.spots import circular

RATE, FRAMES, SETTLED = 30.0, 240, 30
"""Frames per second, frames of a run, and how many at the start are not counted."""

HALF = 16
"""Pixels from the middle to the sides of a frame: the window is cut from it around the prediction."""

LOST = 4.0
"""Error of the apparent position in px: a run that ever exceeds it is lost."""


@frozen(eq=False)
class Record:
    """One filter's runs: errors of dynamics, jitter and their sum (r, s, 2), NEES / 4 and NIS / 2 (r, s), lost (r,)."""

    dynamics: Array
    jitter: Array
    apparent: Array
    nees: Array
    nis: Array
    lost: Mask


def config(passes: int, sigma_jitter: float) -> dict[str, Any]:
    """Return a tracker: `passes` linearisations of an 8 x 8 window; each run's prior is given with it."""
    motion = {"kind": "jittered_wander", "sigma_jitter": sigma_jitter}
    return {
        "estimator": {
            "kind": "iekf",
            "passes": passes,
            "motion": {
                "kind": "carrying",
                "motion": motion,
                "carries": {"amplitude": "count", "spread": "px", "background": "count"},
            },
        },
        "sensors": {"camera": {"kind": "gaussian_spot", "across": ["x", "jx"], "down": ["y", "jy"]}},
        "gate": "off",
        "associator": {"kind": "pda"},
        "lifecycle": {"kind": "single_target"},
    }


def record(passes: int, spread: float, snr: float, sigma_jitter: float, runs: int, rng: np.random.Generator) -> Record:
    """Draw truth from the third-order model and frames of unit noise, and run the filter on them."""
    truth, times = AtmosphericWander(sigma_jitter=sigma_jitter), np.arange(FRAMES) / RATE
    settled = draw_gaussian(np.zeros(8), truth.noise(np.zeros(8), 100.0), rng, (runs,))
    path = draw_states(truth, settled, times, rng)
    state = np.concatenate([path[..., :2], path[..., 2:4] + path[..., 4:6]], axis=-1)
    looks = np.broadcast_to([snr, spread, 0.0], (runs, 3))
    variance = np.repeat([0.25, sigma_jitter**2], 2)
    start = state[:, 0] + np.sqrt(variance) * rng.standard_normal((runs, 4))
    cov = np.zeros((runs, 1, 7, 7))
    cov[..., range(4), range(4)] = variance
    prior = Gaussian(np.concatenate([start, looks], axis=1)[:, None], cov)
    scans = _scans(times, state[..., :2] + state[..., 2:], looks, rng)
    found = run_together(load(config(passes, sigma_jitter)).tracker, prior, 0.0, scans)
    error = found.mean[..., :4] - state
    apparent = error[..., :2] + error[..., 2:]
    after = slice(SETTLED, None)
    return Record(
        error[:, after, :2],
        error[:, after, 2:],
        apparent[:, after],
        nees(error[:, after], found.cov[:, after, :4, :4]) / 4,
        found.nis[:, after] / 2,
        np.any(np.linalg.norm(apparent, axis=-1) > LOST, axis=1),
    )


def _scans(times: Array, seen: Array, looks: Array, rng: np.random.Generator) -> Iterator[Scan]:
    """Yield frames around the true place `seen` (r, s, 2), all runs at once."""
    camera, size = GaussianSpot(), 2 * HALF + 1
    for k, time in enumerate(times.tolist()):
        corner = np.rint(seen[:, k]) - HALF
        clean = camera.render(np.concatenate([seen[:, k] - corner, looks], axis=1), (size, size))
        yield Scan.image(time, "camera", Frame(clean + rng.standard_normal(clean.shape), corner))


def information(spread: float, snr: float, window: int = 8) -> float:
    """Return one frame's information on one axis of a spot in its middle, in 1/px^2; its inverse root is the bound."""
    steps = np.arange(window) - 0.5 * (window - 1)
    _, slopes, _ = circular(steps, steps, np.asarray(spread))
    return float(snr**2 * np.sum(slopes[0] ** 2))


def bound(spread: float, snr: float, sigma_jitter: float) -> tuple[float, float, float]:
    """Return the steady-state lower bounds (Riccati) on the standard deviations of dynamics, jitter and their sum."""
    F, Q = JitteredWander(sigma_jitter=sigma_jitter).one_axis(1.0 / RATE)
    J, seen = information(spread, snr), np.ones(2)
    P = np.diag([9.0, sigma_jitter**2])
    for _ in range(500):
        P = F @ P @ F.T + Q
        P = P - np.outer(P @ seen, P @ seen) / (1.0 / J + seen @ P @ seen)
    return float(np.sqrt(P[0, 0])), float(np.sqrt(P[1, 1])), float(np.sqrt(seen @ P @ seen))
