"""The filter of the paper on matched truth, many runs in lock-step, and the bounds that it is compared with."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Iterator, Mapping
from typing import Any

import numpy as np
from attrs import frozen

from vedette import Array, Frame, Gaussian, Mask, Scan, load
from vedette.metrics import nees
from vedette.sampling import draw_gaussian, draw_states
from vedette_flir.motion.atmospheric_wander import AtmosphericWander
from vedette_flir.motion.jittered_wander import JitteredWander
from vedette_flir.sensors.gaussian_spot import GaussianSpot
from vedette_flir.sensors.image_model import FittedImage
from vedette_flir.spots import circular
from vedette_study.lockstep import run_together

RATE, FRAMES, SETTLED = 30.0, 240, 30
"""Frames per second, frames of a run, and how many at the start are not counted."""

HALF = 16
"""Pixels from the middle to the sides of a frame: the window is cut from it around the prediction."""

LOST = 4.0
"""Error of the apparent position in px: a run that ever exceeds it is lost."""


@frozen(eq=False)
class Record:
    """One filter's runs: errors of dynamics, jitter and their sum (r, s, 2), NEES / 4 and NIS / 2 (r, s), lost (r,).

    `sigma` (s, 4): what the first run's filter says are the standard deviations of x, y, jx, jy.
    """

    dynamics: Array
    jitter: Array
    apparent: Array
    nees: Array
    nis: Array
    lost: Mask
    sigma: Array


LOOKS = {"amplitude": "count", "spread": "px", "background": "count"}
"""What the tracker's state holds of a circular spot."""

SPREADS = {"x": 0.5, "y": 0.5, "vx": 20.0, "vy": 20.0, "ax": 200.0, "ay": 200.0}
"""Standard deviations at the start, where a filter has these axes; that of the jitter is its own."""


def config(
    passes: int,
    sigma_jitter: float,
    motion: Mapping[str, Any] | None = None,
    sensor: Mapping[str, Any] | None = None,
    carries: Mapping[str, str] = LOOKS,
) -> dict[str, Any]:
    """Return a tracker: `passes` linearisations of a window, by default of 8 x 8 pixels; each run's prior is given with it.

    `motion`: what moves, default the matched model; `sensor`: what the camera's model has beyond its axes.
    """
    moving = {"kind": "jittered_wander", "sigma_jitter": sigma_jitter} if motion is None else motion
    model = {"kind": "gaussian_spot"} if sensor is None else sensor
    return {
        "estimator": {
            "kind": "iekf",
            "passes": passes,
            "motion": {"kind": "carrying", "motion": moving, "carries": carries},
        },
        "sensors": {"camera": {**model, "across": ["x", "jx"], "down": ["y", "jy"]}},
        "gate": "off",
        "associator": {"kind": "pda"},
        "birth": {"kind": "given"},
        "lifecycle": {"kind": "single_target"},
    }


@frozen
class Truth:
    """What the paper leaves unsaid of its truth: standard deviation and correlation time of the dynamics, in px and s."""

    sigma: float = 3.0
    tau: float = 2.0


TRUTH = Truth()


def record(
    passes: int,
    spread: float,
    snr: float,
    sigma_jitter: float,
    runs: int,
    rng: np.random.Generator,
    truth: Truth = TRUTH,
) -> Record:
    """Draw truth from the third-order model and frames of unit noise, and run the filter on them."""
    state, times = wander(sigma_jitter, runs, rng, truth)
    start = offset(sigma_jitter, runs, rng)
    looks = np.array([snr, spread, 0.0])
    scans = shown(times, state[..., :2] + state[..., 2:], GaussianSpot(), looks, white(runs, rng))
    motion = {"kind": "jittered_wander", "sigma_jitter": sigma_jitter, "sigma": truth.sigma, "tau": truth.tau}
    return follow(config(passes, sigma_jitter, motion), state, start, sigma_jitter, looks, scans)


def wander(sigma_jitter: float, runs: int, rng: np.random.Generator, truth: Truth = TRUTH) -> tuple[Array, Array]:
    """Draw the paper's truth: x, y, jx, jy (r, s, 4), and return it with its times (s,)."""
    model = AtmosphericWander(truth.sigma, truth.tau, sigma_jitter)
    times = np.arange(FRAMES) / RATE
    settled = draw_gaussian(np.zeros(8), model.noise(np.zeros(8), 1000.0), rng, (runs,))
    path = draw_states(model, settled, times, rng)
    return np.concatenate([path[..., :2], path[..., 2:4] + path[..., 4:6]], axis=-1), times


def offset(sigma_jitter: float, runs: int, rng: np.random.Generator) -> Array:
    """Draw the error of x, y, jx, jy that the filters start with (r, 4)."""
    error: Array = np.repeat([SPREADS["x"], sigma_jitter], 2) * rng.standard_normal((runs, 4))
    return error


def follow(
    built: Mapping[str, Any], state: Array, start: Array, sigma_jitter: float, looks: Array, scans: Iterable[Scan]
) -> Record:
    """Run a tracker on frames of the truth `state` (r, s, 4), from its first with the error `start`, and with `looks`."""
    tracker = load(built).tracker
    names, runs = tracker.state.names, len(state)
    mean, cov = np.zeros((runs, 1, len(names))), np.zeros((runs, 1, len(names), len(names)))
    columns = [names.index(name) for name in ("x", "y", "jx", "jy")]
    mean[:, 0, columns] = state[:, 0] + start
    mean[..., -len(looks) :] = looks
    for name, deviation in {**SPREADS, "jx": sigma_jitter, "jy": sigma_jitter}.items():
        if name in names:
            cov[..., names.index(name), names.index(name)] = deviation**2
    tracks = run_together(tracker, Gaussian(mean, cov), 0.0, scans)
    error = tracks.mean[..., columns] - state
    apparent = error[..., :2] + error[..., 2:]
    after = slice(SETTLED, None)
    cov_own = tracks.cov[:, after][..., columns, :][..., columns]
    return Record(
        error[:, after, :2],
        error[:, after, 2:],
        apparent[:, after],
        nees(error[:, after], cov_own) / 4,
        tracks.nis[:, after] / 2,
        np.any(np.linalg.norm(apparent, axis=-1) > LOST, axis=1),
        np.sqrt(np.diagonal(cov_own[0], axis1=-2, axis2=-1)),
    )


Noise = Callable[[int, tuple[int, ...], Array], Array]
"""Noise of the k-th frame of a shape (r, h, w), whose first pixels are at corners (r, 2)."""


def white(runs: int, rng: np.random.Generator) -> Noise:
    """Return noise that is white over pixels and frames."""
    return lambda k, shape, corner: rng.standard_normal(shape)


def shown(times: Array, seen: Array, camera: FittedImage, looks: Array, noise: Noise, half: int = HALF) -> Iterator[Scan]:
    """Yield frames around the true place `seen` (r, s, 2), all runs at once, of targets with `looks`."""
    size, appearance = 2 * half + 1, np.broadcast_to(looks, (len(seen), len(looks)))
    for k, time in enumerate(times.tolist()):
        corner = np.rint(seen[:, k]) - half
        clean = camera.render(np.concatenate([seen[:, k] - corner, appearance], axis=1), (size, size))
        yield Scan.image(time, "camera", Frame(clean + noise(k, clean.shape, corner), corner))


def information(spread: float, snr: float, window: int = 8) -> float:
    """Return one frame's information on one axis of a spot in its middle, in 1/px^2; its inverse root is the bound."""
    steps = np.arange(window) - 0.5 * (window - 1)
    _, slopes, _ = circular(steps, steps, np.asarray(spread))
    return float(snr**2 * np.sum(slopes[0] ** 2))


def bound(spread: float, snr: float, sigma_jitter: float, truth: Truth = TRUTH) -> tuple[float, float, float]:
    """Return the steady-state lower bounds (Riccati) on the standard deviations of dynamics, jitter and their sum."""
    F, Q = JitteredWander(truth.sigma, truth.tau, sigma_jitter).one_axis(1.0 / RATE)
    J, seen = information(spread, snr), np.ones(2)
    P = np.diag([truth.sigma**2, sigma_jitter**2])
    for _ in range(500):
        P = F @ P @ F.T + Q
        P = P - np.outer(P @ seen, P @ seen) / (1.0 / J + seen @ P @ seen)
    return float(np.sqrt(P[0, 0])), float(np.sqrt(P[1, 1])), float(np.sqrt(seen @ P @ seen))
