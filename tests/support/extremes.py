"""Every estimator with every motion over gaps of 1e-9 to 1e8 s and noises of 1e-9 to 1e9, drawn log-uniformly."""

import numpy as np
from attrs import evolve, fields

import vedette
from vedette import Detections, Gaussian
from vedette.config.registry import Registry
from vedette.filters import predicted
from vedette.testing.comparisons import covariance, demand, finite
from vedette.testing.states import random_gaussian
from vedette_flir.motion.constant_axes import Carrying
from vedette_standard.motion.constant_velocity import ConstantVelocity
from vedette_standard.motion.coordinated_turn import CoordinatedTurn
from vedette_standard.motion.gauss_markov import GaussMarkov
from vedette_standard.sensors.linear import LinearSensor
from vedette_standard.sensors.range_bearing import RangeBearing

GAPS, NOISES = (-9.0, 8.0), (-9.0, 9.0)
"""Exponents of gaps in s, and of deviations of returns: wider than what the kit's law asks of every estimator."""

GIVEN = {
    "carrying": lambda cls, rng: cls(ConstantVelocity(power(rng)), {"width": "px"}),
    "gauss_markov": lambda cls, rng: cls(("x", "y"), power(rng), power(rng, 8)),
    "linear": lambda cls, rng: cls(("x", "vx"), [[1.0, 0.5], [0.0, 0.9]], power(rng) * np.array([[0.2, 0.1], [0.1, 0.3]])),
    "product": lambda cls, rng: cls((CoordinatedTurn(power(rng), power(rng)), GaussMarkov(("b",), power(rng), 60.0, "rad"))),
}
"""How motion models are made that numbers alone do not make."""

HOLDING = {
    "imm": lambda cls, motion, other, rng: cls(
        tuple(REGISTRY.get("estimator", "ekf").cls(each) for each in (motion, other)), [[0.9, 0.1], [0.2, 0.8]]
    ),
    "gaussian_sum": lambda cls, motion, other, rng: cls(REGISTRY.get("estimator", "ekf").cls(motion)),
    "intermittent": lambda cls, motion, other, rng: cls(
        REGISTRY.get("estimator", "ekf").cls(motion), power(rng, 6), power(rng, 6)
    ),
    "residual_monitored": lambda cls, motion, other, rng: cls(REGISTRY.get("estimator", "ekf").cls(motion)),
    "fading_memory": lambda cls, motion, other, rng: cls(motion, 1 + power(rng, 0)),
    "least_squares": lambda cls, motion, other, rng: cls(motion, rng.choice([1.0, 0.95, 1e-6])),
    "g_h": lambda cls, motion, other, rng: cls(motion, rng.uniform(0.01, 1.0), rng.uniform(0.0, 1.9)),
    "h_infinity": lambda cls, motion, other, rng: cls(motion, power(rng), {motion.state.names[0]: power(rng)}),
    "ensemble_kalman": lambda cls, motion, other, rng: cls(motion, members=100),
    "bootstrap_particles": lambda cls, motion, other, rng: cls(motion, particles=100),
    "auxiliary_particles": lambda cls, motion, other, rng: cls(motion, particles=100),
    "whitened_filter": lambda cls, motion, other, rng: cls(motion, power(rng)),
    "template_filter": lambda cls, motion, other, rng: cls(Carrying(motion, {"width": "px", "height": "px"}), cells=8),
    "correlation_filter": lambda cls, motion, other, rng: cls(Carrying(motion, {"width": "px", "height": "px"}), cells=8),
}
"""How estimators are made that take more than a motion model."""

REGISTRY = Registry.installed()
MOTIONS = sorted(entry.kind for entry in REGISTRY if entry.role == "motion")
ESTIMATORS = sorted(entry.kind for entry in REGISTRY if entry.role == "estimator")


def power(rng, most=NOISES[1]):
    """Draw a number from 1e-9 to 10 to the power of `most`, log-uniformly."""
    return float(10.0 ** rng.uniform(NOISES[0], most))


def motion_of_kind(kind, rng):
    """Build a motion model whose numbers are drawn from 1e-9 to 1e9; ValueError if it refuses them."""
    cls = REGISTRY.get("motion", kind).cls
    if kind in GIVEN:
        return GIVEN[kind](cls, rng)
    names = [each for each in fields(cls) if each.init and "limits" in each.metadata]
    least = cls(**{each.name: 0.5 for each in names if each.default is each.default and _needed(each)})
    drawn = {each.name: power(rng) for each in names if each.name.startswith(("sigma", "tau", "beta")) or _needed(each)}
    return evolve(least, **{name: min(value, 1.0) if "rate" in name else value for name, value in drawn.items()})


def _needed(each):
    from attrs import NOTHING

    return each.default is NOTHING


def estimator_of_kind(kind, motion, rng):
    """Build an estimator over a motion model; ValueError if it refuses it."""
    cls = REGISTRY.get("estimator", kind).cls
    other = CoordinatedTurn(0.5, 0.02) if {"x", "y", "vx", "vy"} <= set(motion.state.names) else motion
    return HOLDING[kind](cls, motion, other, rng) if kind in HOLDING else cls(motion)


def case(estimator_kind, motion_kind, seed, scans=4):
    """Follow two tracks over a few gaps; return "held", or why it was refused at build. AssertionError if it breaks."""
    rng = np.random.default_rng([seed, ESTIMATORS.index(estimator_kind), MOTIONS.index(motion_kind)])
    try:
        estimator = estimator_of_kind(estimator_kind, motion_of_kind(motion_kind, rng), rng)
        sensor = sensor_of(estimator, rng)
    except (ValueError, vedette.VedetteError) as refusal:
        return f"refused: {refusal}"
    if reason := estimator.refuses(sensor):
        return f"refused: {reason}"
    state = estimator.state
    prior = random_gaussian(state, rng, (2,))
    if len(estimator.zero_variance):
        where = state.locate(estimator.zero_variance)
        prior.cov[..., where, :] = prior.cov[..., :, where] = 0.0
    belief = estimator.start(Gaussian(prior.mean, prior.cov), state, rng)
    told = ""
    for i in range(scans):
        dt, R = (
            10.0 ** rng.uniform(*GAPS),
            np.diag(10.0 ** rng.uniform(2 * NOISES[0], 2 * NOISES[1], len(sensor.measurement))),
        )
        told += f" {dt:.3g} s {np.sqrt(np.diag(R))}"
        belief = predicted(estimator, belief, dt, rng)
        moments = estimator.moments(belief)
        check(f"predicted{told}", moments)
        x = moments.mean[..., state.locate(sensor.observes)]
        P = moments.cov[..., state.locate(sensor.observes), :][..., state.locate(sensor.observes)]
        H = sensor.jacobian(x)
        S = H @ P @ np.swapaxes(H, -1, -2) + R
        spread = np.sqrt(np.maximum(np.diagonal(S[:1], axis1=-2, axis2=-1), 0.0))
        z = sensor.measure(x[:1]) + spread * rng.standard_normal((2, len(R)))
        z, noise = sensor.measurement.canonical(z), np.broadcast_to(R, (2, *R.shape))
        found = estimator.evaluate(belief, sensor, Detections(z, np.ones(2, bool), None, noise), 0.99)
        demand(not np.isnan(found.loglik).any(), f"loglik nan,{told}")
        for name in ("distance", "nis"):
            demand(np.min(getattr(found, name)) >= 0, f"{name} {np.min(getattr(found, name))},{told}")
        weights = np.full(found.loglik.shape, 1 / 3) if i % 2 else np.eye(3)[np.full(2, 1)]
        belief = estimator.update(belief, found, weights)
        check(f"updated{told}", estimator.moments(belief))
    return "held"


def check(what, moments):
    finite(f"mean {what}", moments.mean)
    covariance(f"covariance {what}", moments.cov, definite=False)


def sensor_of(estimator, rng):
    """Return a radar where there is a position, or a linear sensor of one or two axes that do not wrap."""
    plane = {("x", "m"), ("y", "m")} <= {(axis.name, axis.unit) for axis in estimator.state.axes}
    if plane and rng.random() < 0.4 and estimator.refuses(radar := RangeBearing(1.0, 1.0)) is None:
        return radar
    free = [axis.name for axis in estimator.state.axes if axis.name not in estimator.zero_variance and axis.period is None]
    axes = tuple(free[: int(rng.integers(1, 3))])
    units = {axis.name: axis.unit for axis in estimator.state.axes if axis.name in axes}
    if not axes:
        raise ValueError("no axis that does not wrap")
    return LinearSensor(axes, np.eye(len(axes)), units=units)
