"""Which of Q and R is likely wrong, and by how much: what innovations say of it, in words."""

from __future__ import annotations

from typing import Any, ClassVar, final

import numpy as np
from attrs import evolve, frozen

from vedette import fields
from vedette.errors import VedetteError
from vedette.roles import Estimator, MotionModel, Sensor
from vedette.space import Array
from vedette.testing.montecarlo import Runs, World, play
from vedette.testing.truth import modes_of, motion_of
from vedette.testing.verdicts import lost_runs
from vedette.tracking.tracker import Tracker
from vedette.types import Gaussian
from vedette.wrapping import WrappedMotion, WrappedSensor

LAGS = 3
"""Products of innovations of the same scan, of the next, and of the one after tell Q from R."""


@final
@frozen
class Restless(WrappedMotion):
    """A motion with `factor` times the noise of another."""

    kind: ClassVar[str] = "kit_restless"

    of: MotionModel = fields.part("the motion")
    factor: float = fields.quantity("1", "factor of its noise", above=0)

    def noise(self, x: Array, dt: float) -> Array:
        noisier: Array = self.factor * self.of.noise(x, dt)
        return noisier


@final
@frozen(eq=False)
class Noisy(WrappedSensor):
    """A sensor without clutter, with `factors` (m,) times the variance of another along each axis that it measures."""

    kind: ClassVar[str] = "kit_noisy"

    of: Sensor = fields.part("the sensor")
    factors: Array = fields.array("1", "factors of the variances", ndim=1)

    def noise(self, x: Array) -> Array:
        root = np.sqrt(self.factors)
        noisier: Array = self.of.noise(x) * (root[:, None] * root)
        return noisier

    def clutter(self, z: Array) -> Array:
        return np.zeros(())


def _restless(estimator: Estimator[Any], factor: float) -> Estimator[Any]:
    motion = motion_of(estimator)
    if motion is not None:
        return evolve(estimator, motion=Restless(motion, factor))  # type: ignore[misc]
    return evolve(estimator, modes=tuple(_restless(mode, factor) for mode in modes_of(estimator)))  # type: ignore[misc]


def _moments(played: Runs) -> Array:
    """Return each run's mean products of innovations (r, d) by sensor, lag and axis, in their stated deviations."""
    found = []
    for looks in played.looks.values():
        u = looks.residual / np.sqrt(np.diagonal(looks.cov, axis1=-2, axis2=-1))
        seen = looks.seen[..., None]
        u = np.where(seen, u - np.sum(u * seen, axis=0) / np.maximum(seen.sum(axis=0), 1), 0.0)
        for lag in range(LAGS):
            pairs = np.sum(seen[:, : seen.shape[1] - lag] & seen[:, lag:], axis=1)
            found.append(np.sum(u[:, : u.shape[1] - lag] * u[:, lag:], axis=1) / np.maximum(pairs, 1))
    products: Array = np.concatenate(found, axis=-1)
    return products


def _right(played: Runs) -> Array:
    """Return what is expected of these products (d,): 1 of the same scan, 0 of others."""
    sizes = [looks.residual.shape[-1] for looks in played.looks.values()]
    return np.concatenate([np.repeat([1.0] + [0.0] * (LAGS - 1), m) for m in sizes])


def _quiet(sensor: Sensor, louder: int | None = None) -> Noisy:
    """Return the sensor without clutter, with twice the variance along one measured axis if that is given."""
    factors = np.ones(len(sensor.measurement))
    if louder is not None:
        factors[louder] = 2.0
    return Noisy(sensor, factors)


def factors(
    tracker: Tracker, world: Tracker | World, prior: Gaussian, times: Array, runs: int, seed: int
) -> tuple[list[str], Array, Array]:
    """Return the names of the noises, and by what factors the tracker's are too small (p,), with their standard errors.

    The products of innovations are linear in Q and R: how they grow with each is seen in worlds that have twice of it, drawn
    with the same numbers; where they would be right is solved for by least squares. All without clutter, where this holds.
    After Mehra, On the Identification of Variances and Adaptive Kalman Filtering, IEEE Trans. Automatic Control 15, 1970.
    """
    calm = {name: _quiet(sensor) for name, sensor in world.sensors.items()}
    names, worlds = ["Q"], [World(world.estimator, calm), World(_restless(world.estimator, 2.0), calm)]
    for name, sensor in world.sensors.items():
        for i, axis in enumerate(sensor.measurement.axes):
            names.append(f"R of {name} along {axis.name}")
            worlds.append(World(world.estimator, {**calm, name: _quiet(sensor, i)}))
    tracker = evolve(tracker, sensors={name: _quiet(sensor) for name, sensor in tracker.sensors.items()})
    played = [play(tracker, prior, times, runs, np.random.default_rng(seed), one) for one in worlds]
    here, *grown = map(_moments, played)
    D = np.stack([np.mean(one - here, axis=0) for one in grown], axis=-1)
    noise = np.cov(here.T).reshape(len(D), len(D)) / len(here)
    weight = np.linalg.inv(noise + 1e-6 * np.diag(np.diagonal(noise)) + 1e-12 * np.eye(len(D)))
    normal = np.linalg.pinv(D.T @ weight @ D)
    share = 1.0 + normal @ D.T @ weight @ (_right(played[0]) - np.mean(here, axis=0))  # the tracker's noise over the world's
    share = np.maximum(share, 0.05)
    return names, 1.0 / share, np.sqrt(np.diagonal(normal)) / share**2


def likely_cause(
    played: Runs, wrong: set[str], tracker: Tracker, world: Tracker | World, prior: Gaussian, runs: int, seed: int
) -> str:
    """Say which parameter is likely wrong, and by how much, from the names of the verdicts that are `wrong`."""
    if wrong & {"hits", "false returns"}:
        return "the detection probability or clutter density above; judge Q and R when these are right"
    if "lost" in wrong and (len(wrong) == 1 or lost_runs(played).mean() > 0.5):
        return "that it loses its targets: too much clutter for the associator, or far too small a Q; judge it in less"
    if "bias" in wrong:
        return f"a bias{_shift(played)}: `move`, `measure` or the start, before Q and R"
    try:
        times = np.concatenate([[2 * played.times[0] - played.times[1]], played.times])
        names, factor, error = factors(tracker, world, prior, times, runs, seed)
    except (VedetteError, ValueError, TypeError, np.linalg.LinAlgError):  # the models cannot be made noisier
        return ""
    share = 1.0 / factor  # what is solved for: its error is even, that of a large factor is not
    off = (np.abs(share - 1.0) > 4 * error * share**2) & (np.abs(factor - 1.0) > 0.04)
    if not off.any():
        return (
            "neither Q nor R, for innovations are as they should be: an axis that is not measured, the covariance that is "
            "reported, or the start"
        )
    parts = [_sized(name, f, e) for name, f, e, out in zip(names, factor, error, off, strict=True) if out]
    rest = [name for name, out in zip(names, off, strict=True) if not out]
    return ", ".join(parts) + (f"; not {', '.join(rest)}" if rest else "")


def _sized(name: str, factor: float, error: float) -> str:
    if factor > 1:
        return f"{name} is {factor:.2g} +- {error:.1g} times too small" if factor < 15 else f"{name} is far too small"
    return f"{name} is {1 / factor:.2g} +- {error / factor**2:.1g} times too large"


def _shift(played: Runs) -> str:
    """Say when and along which measured axis innovations are shifted most, if any are plainly."""
    most, text = 6.0, ""
    for name, looks in played.looks.items():
        u = np.where(looks.seen[..., None], looks.residual / np.sqrt(np.diagonal(looks.cov, axis1=-2, axis2=-1)), 0.0)
        mean, error = u.mean(axis=0), u.std(axis=0, ddof=1) / np.sqrt(len(u))
        k, i = np.unravel_index(int(np.argmax(np.abs(mean) / np.maximum(error, 1e-300))), mean.shape)
        if abs(mean[k, i]) > most * error[k, i]:
            most, axis = abs(mean[k, i]) / error[k, i], played.tracker.sensors[name].measurement.names[i]
            text = f", innovations of {name} are {mean[k, i]:+.2g} deviations off along {axis} at {played.times[k]:g} s"
    return text
