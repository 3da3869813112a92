"""Vedette: through `Tracker.step`, through its estimators' methods, and by its kernels alone."""

from __future__ import annotations

from importlib.metadata import version
from typing import Any

import attrs
import numpy as np

import vedette
from benchmarks.contenders import vedette_kernels
from benchmarks.contenders.foreign import ForeignRadar
from benchmarks.job import Answer, Job
from benchmarks.problems import DENSITY, KAPPA, MODES, P_DETECT, P_GATE, POLAR, SIGMA, Array, Problem
from vedette import Detections, Gaussian, Scan

VERSION = f"Vedette {version('vedette')}, {vedette_kernels.WHICH}"
FILTERS = {"ekf": "ekf", "foreign": "ekf", "ukf": "ukf"}
CLUTTERED = ("pda", "imm_pdaf", "gnn")
SURE = 1 - 1e-12


def tracker_of(problem: Problem) -> vedette.Tracker:
    """Build the tracker as a user does."""
    family = problem.family
    motions: list[dict[str, Any]] = [
        {"kind": "known_turn", "turn_rate": turn, "sigma_accel": accel}
        if turn
        else {"kind": "constant_velocity", "sigma_accel": accel}
        for accel, turn in MODES[: problem.modes]
    ]
    kind = FILTERS.get(family, "kalman")
    modes: list[dict[str, Any]] = [{"kind": kind, "motion": motion} for motion in motions]
    if kind == "ukf":
        modes[0]["kappa"] = KAPPA
    mixed = {"kind": "imm", "modes": modes, "transition": problem.switching.tolist()}
    sensor: dict[str, Any] = {"kind": "cartesian_position", "sigma": SIGMA}
    if family in CLUTTERED:
        sensor |= {"detection_probability": P_DETECT, "clutter_density": DENSITY}
    if family in FILTERS:
        sensor = {"kind": "range_bearing", "sigma_range": POLAR[0], "sigma_bearing": POLAR[1]}
    start = {name: [0.0, 1.0] for name in ("x", "y", "vx", "vy")}
    made = vedette.build(
        {
            "estimator": mixed if family.startswith("imm") else modes[0],
            "sensors": {"radar": sensor},
            "associator": {"kind": "gnn" if family == "gnn" else "pda"},
            "birth": {"kind": "given", "start": start},
            "lifecycle": {"kind": "single_target"},
            "gate": {"probability": P_GATE if family in CLUTTERED else SURE},
        }
    )
    return attrs.evolve(made, sensors={"radar": ForeignRadar()}) if family == "foreign" else made


def prior_of(problem: Problem) -> Gaussian:
    """Return the prior (*b, t, n)."""
    shape: tuple[int, ...] = (1,) if problem.tracks is None else (problem.tracks, 1)
    if problem.family == "gnn":
        shape = (len(problem.x0),)
    mean, cov = np.broadcast_to(problem.x0, (*shape, 4)), np.broadcast_to(problem.P0, (*shape, 4, 4))
    return Gaussian(mean.copy(), cov.copy())


def chosen(problem: Problem, found: Gaussian) -> Answer:
    """Return the answer of one target, of all targets of a crowd, or of a batch's probed tracks."""
    if problem.tracks is None or problem.family == "gnn":
        return found.mean, found.cov
    return found.mean[list(problem.probe), 0], found.cov[list(problem.probe), 0]


def step(problem: Problem) -> Job:
    """Run scan in, tracks out."""
    tracker = tracker_of(problem)
    begin = tracker.start(prior_of(problem), 0.0)
    scans = [Scan(i + 1.0, "radar", Detections.of(z)) for i, z in enumerate(problem.z)]

    def run() -> Gaussian:
        state = begin
        for scan in scans:
            state = tracker.step(state, scan)
            found = tracker.estimate(state)
        return found

    return Job(run, lambda found: chosen(problem, found))


def estimator(problem: Problem) -> Job:
    """Run predict, evaluate, update on beliefs."""
    tracker, rng = tracker_of(problem), np.random.default_rng(0)
    filtering, sensor = tracker.estimator, tracker.sensors["radar"]
    begin = filtering.start(prior_of(problem), filtering.state, rng)
    scans, certain = [Detections.of(z) for z in problem.z], np.array([[0.0, 1.0]])

    def run() -> Gaussian:
        belief = begin
        for seen in scans:
            belief = filtering.predict(belief, 1.0, rng)
            belief = filtering.update(belief, filtering.evaluate(belief, sensor, seen, SURE), certain)
        return filtering.moments(belief)

    return Job(run, lambda found: chosen(problem, found))


def stage(name: str) -> Any:
    """Run one of the three stages repeatedly on the same belief."""

    def job(problem: Problem) -> Job:
        tracker, rng = tracker_of(problem), np.random.default_rng(0)
        filtering, sensor = tracker.estimator, tracker.sensors["radar"]
        belief = filtering.start(prior_of(problem), filtering.state, rng)
        seen, certain = Detections.of(problem.z[0]), np.array([[0.0, 1.0]])
        innovation = filtering.evaluate(belief, sensor, seen, SURE)
        stages = {
            "predict": lambda: filtering.predict(belief, 1.0, rng),
            "evaluate": lambda: filtering.evaluate(belief, sensor, seen, SURE),
            "update": lambda: filtering.update(belief, innovation, certain),
        }
        return repeated(problem, stages[name])

    return job


def own(problem: Problem) -> Job:
    """Time the sensor's own functions in a step: the part of `estimator` that is not Vedette's."""
    sensor = tracker_of(problem).sensors["radar"]
    x: Array = problem.x0[None, :2]

    def once() -> None:
        sensor.measure(x)
        sensor.jacobian(x)
        sensor.noise(x)
        sensor.detects(x)

    return repeated(problem, once)


def repeated(problem: Problem, once: Any) -> Job:
    """Run it as often as the problem has steps, after checking that the whole of which it is a part solves the problem."""

    def run() -> None:
        for _ in range(problem.steps):
            once()

    whole = estimator(problem)
    return Job(run, lambda found: whole.answer(whole.run()))


STEPS = ("kf", "ekf", "ukf", "imm", "pda", "imm_pdaf", "gnn", "foreign")
ENTRIES: dict[str, dict[str, Any]] = {family: {"step": step} for family in STEPS}
for family in ("kf", "ekf", "ukf", "imm", "foreign"):
    ENTRIES[family]["estimator"] = estimator
    ENTRIES[family] |= {name: stage(name) for name in ("predict", "evaluate", "update")}
ENTRIES["foreign"]["own"] = own
for family, levels in vedette_kernels.LEVELS.items():
    ENTRIES[family] |= levels
