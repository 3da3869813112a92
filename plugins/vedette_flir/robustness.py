"""What the paper says its filter must bear, one at a time: unknown brightness, several spots, coloured noise, manoeuvres."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from typing import Any

import numpy as np
from attrs import frozen

from vedette import Array
from vedette_flir.camera import Camera
from vedette_flir.matched_truth import (
    FRAMES,
    RATE,
    TRUTH,
    Noise,
    Record,
    Truth,
    config,
    follow,
    offset,
    shown,
    wander,
    white,
)
from vedette_flir.sensors.gaussian_spot import GaussianSpot
from vedette_flir.sensors.hot_spots import HotSpots, Spot
from vedette_flir.sensors.image_model import FittedImage

JITTER = 0.2
"""Standard deviation of the jitter in px."""

PAPER = {"kind": "jittered_acceleration", "jerk_density": 1e5, "sigma_jitter": JITTER}
"""The paper's motion. It prints no jerk density: this one follows a wandering position, whose velocity is white."""

QUIET = {**PAPER, "jerk_density": 1e3}
"""The same for a target that hardly manoeuvres."""

SPOTS = (Spot(1.5, 1.5), Spot(1.0, 1.0, peak=0.7, x=3.0, y=1.0))
"""A target with two hot spots."""

HALF = 12
"""Pixels from the middle to the sides of a frame whose noise has a memory of its own pixels."""

CALM = {"3 px, 2 s": Truth(), "3 px, 10 s": Truth(tau=10.0), "1 px, 2 s": Truth(sigma=1.0)}
"""The paper's truth as chosen, and two that are slower; it gives none."""

DYNAMICS = ["x", "y", "vx", "vy", "ax", "ay"]
BLOCKS = {"gain": 0.5, "most": 20.0, "largest": 1e4, "blocks": DYNAMICS}
"""How the noise of the dynamics follows the residuals; chosen on 60 runs of other seeds."""

MEMORY = 0.2
"""Correlation time in s of the pixels' noise where it has one; chosen."""

GAINS = {"gain_amplitude": 0.1, "gain_spread": 0.1}
MANOEUVRE = slice(120, 180)
"""Frames during which a target accelerates."""


@frozen(eq=False)
class Variation:
    """One row: the truth and its frames, and the filters that see them: name to a tracker and the looks it starts with.

    `fewer`: how many times fewer runs than the others, as this one takes so much longer.
    """

    label: str
    draw: Callable[[int, np.random.Generator], tuple[Array, Array]]
    camera: FittedImage
    looks: Array
    noise: Callable[[int, np.random.Generator], Noise]
    filters: Mapping[str, tuple[dict[str, Any], Array]]
    half: int = HALF
    fewer: int = 1

    def record(self, name: str, runs: int, seed: tuple[int, ...]) -> Record:
        """Run one filter; all filters see the same truth and frames."""
        runs, (built, looks) = max(4, runs // self.fewer), self.filters[name]
        state, times = self.draw(runs, np.random.default_rng([*seed, 0]))
        start = offset(JITTER, runs, np.random.default_rng([*seed, 1]))
        noise = self.noise(runs, np.random.default_rng([*seed, 2]))
        scans = shown(times, state[..., :2] + state[..., 2:], self.camera, self.looks, noise, self.half)
        return follow(built, state, start, JITTER, looks, scans)


def _wander(truth: Truth) -> Callable[[int, np.random.Generator], tuple[Array, Array]]:
    return lambda runs, rng: wander(JITTER, runs, rng, truth)


def _flight(acceleration: float) -> Callable[[int, np.random.Generator], tuple[Array, Array]]:
    """Draw flights at constant velocity that accelerate across for two seconds, behind the paper's jitter."""

    def draw(runs: int, rng: np.random.Generator) -> tuple[Array, Array]:
        state, times = wander(JITTER, runs, rng)
        pull = np.zeros(FRAMES)
        pull[MANOEUVRE] = acceleration
        speed = 10.0 * rng.standard_normal((runs, 1, 2)) + np.stack([np.cumsum(pull) / RATE, np.zeros(FRAMES)], axis=-1)
        state[..., :2] = np.cumsum(speed, axis=1) / RATE
        return state, times

    return draw


def over_space(runs: int, rng: np.random.Generator) -> Noise:
    """Return noise of which .8 is correlated over distance d as e^(-d / 2 px), anew in each frame."""
    root = np.linalg.cholesky(Camera(window=2 * HALF + 1, correlated=0.8, length=2.0).covariance())
    return lambda k, shape, corner: (rng.standard_normal((shape[0], len(root))) @ root.T).reshape(shape)


def over_time(runs: int, rng: np.random.Generator) -> Noise:
    """Return noise that is white over the camera's pixels, each correlated over time as e^(-t / MEMORY)."""
    keep, side = np.exp(-1.0 / RATE / MEMORY), 96
    whole = rng.standard_normal((runs, side, side))
    steps, each = np.arange(2 * HALF + 1), np.arange(runs)[:, None, None]

    def noise(k: int, shape: tuple[int, ...], corner: Array) -> Array:
        nonlocal whole
        if k:
            whole = keep * whole + np.sqrt(1.0 - keep**2) * rng.standard_normal(whole.shape)
        first = corner.astype(int)
        columns, rows = ((first[:, i, None] + steps) % side for i in (0, 1))
        found: Array = whole[each, rows[:, :, None], columns[:, None, :]]
        return found

    return noise


def variations(truth: Truth = TRUTH, acceleration: float = 300.0) -> tuple[Variation, ...]:
    """Return all rows: SNR 10, a spread of 2 px and the given truth where they do not say otherwise."""
    spot, known = GaussianSpot(), np.array([10.0, 2.0, 0.0])
    once, three = config(1, JITTER, PAPER), config(3, JITTER, PAPER)
    plain = {"one pass": (once, known), "three passes": (three, known)}

    def learnt(start: list[float]) -> dict[str, tuple[dict[str, Any], Array]]:
        adaptive = config(3, JITTER, PAPER, {"kind": "gaussian_spot", **GAINS})
        return {"fixed": (three, np.array(start)), "adaptive": (adaptive, np.array(start))}

    def seen_by(snr: float) -> dict[str, tuple[dict[str, Any], Array]]:
        full = {"kind": "gaussian_spot", "camera": {"correlated": 0.8, "length": 2.0}}
        looks = np.array([snr, 2.0, 0.0])
        return {"white R": (three, looks), "full R": (config(3, JITTER, PAPER, full), looks)}

    def monitored(more: Mapping[str, Any]) -> dict[str, Any]:
        built = config(3, JITTER, QUIET)
        return {**built, "estimator": {"kind": "residual_monitored", "of": built["estimator"], **more}}

    def whitened(snr: float) -> dict[str, tuple[dict[str, Any], Array]]:
        looks = np.array([snr, 2.0, 0.0])
        white_over_time = {**three["estimator"], "kind": "whitened_filter", "memory": MEMORY}
        return {"three passes": (three, looks), "whitened": ({**three, "estimator": white_over_time}, looks)}

    several = {"kind": "hot_spots", "spots": SPOTS, "camera": {"window": 10}}
    carries = {"amplitude": "count", "turn": "rad mod 2pi", "background": "count"}
    one = {"kind": "gaussian_spot", "camera": {"window": 10}, **GAINS}
    shape = {
        "one spot, adaptive": (config(3, JITTER, PAPER, one), known),
        "two spots": (config(3, JITTER, PAPER, several, carries), np.array([10.0, 0.0, 0.0])),
    }
    manoeuvre = {
        "Q for 1e3": (config(3, JITTER, QUIET), known),
        "all monitored from 1e3": (monitored({}), known),
        "dynamics monitored from 1e3": (monitored(BLOCKS), known),
        "Q for 1e5": (three, known),
    }
    hot, pose = HotSpots(spots=SPOTS), np.array([10.0, 0.0, 0.0])
    faint = np.array([3.0, 2.0, 0.0])
    drawn, thin = _wander(truth), [10.0, 1.0, 0.0]
    narrow = [
        Variation(f"spread 1, {label}", _wander(each), spot, np.array(thin), white, _with(plain, thin))
        for label, each in (CALM.items() if truth == TRUTH else [("", truth)])
    ]
    return (
        *narrow,
        Variation("wander", drawn, spot, known, white, plain),
        Variation("brightness and spread unknown", drawn, spot, known, white, learnt([20.0, 1.2, 0.0])),
        Variation("two hot spots", drawn, hot, pose, white, shape, 8, 10),
        Variation("noise correlated over space, SNR 10", drawn, spot, known, over_space, seen_by(10.0)),
        Variation("noise correlated over space, SNR 3", drawn, spot, faint, over_space, seen_by(3.0)),
        Variation("noise correlated over time, SNR 10", drawn, spot, known, over_time, whitened(10.0)),
        Variation("noise correlated over time, SNR 3", drawn, spot, faint, over_time, whitened(3.0)),
        Variation("white noise, SNR 3", drawn, spot, faint, white, {"three passes": (three, faint)}),
        Variation("flight at constant velocity", _flight(0.0), spot, known, white, manoeuvre),
        Variation("manoeuvre", _flight(acceleration), spot, known, white, manoeuvre),
    )


def _with(
    filters: Mapping[str, tuple[dict[str, Any], Array]], looks: list[float]
) -> dict[str, tuple[dict[str, Any], Array]]:
    return {name: (built, np.array(looks)) for name, (built, _) in filters.items()}
