"""Follow one track by range and bearing."""

from __future__ import annotations

from typing import Any

import numpy as np

from benchmarks.problems import MODES, POLAR, Array, make, noise, switching, transition
from benchmarks.whole_jobs import CV, Run, built
from vedette import Detections, Gaussian, Scan


def fly(estimator: Any) -> Run:
    """Return a run of Vedette over the whole flight."""
    problem = make("ekf")
    tracker = built(estimator, {"kind": "range_bearing", "sigma_range": POLAR[0], "sigma_bearing": POLAR[1]})
    begin = tracker.start(Gaussian(problem.x0[None], problem.P0[None]), 0.0)
    scans = [Scan(i + 1.0, "radar", Detections.of(z)) for i, z in enumerate(problem.z)]

    def run() -> Array:
        state = begin
        for scan in scans:
            state = tracker.step(state, scan)
        return tracker.estimate(state).mean[0, :2]

    return run


def by_peer(name: str, family: str) -> Run:
    """Return the same run by a peer."""
    from importlib import import_module

    job = import_module(f"benchmarks.contenders.{name}").ENTRIES[family][""](make("ekf"))
    return lambda: job.answer(job.run())[0][0, :2]


def imm_by_filterpy() -> Run:
    from filterpy.kalman import ExtendedKalmanFilter, IMMEstimator

    from benchmarks.contenders.textbook import polar, polar_slope, wrapped

    class Bound(ExtendedKalmanFilter):
        """An EKF whose update knows its sensor, as the IMM calls it without."""

        def predict(self, u: Any = None) -> None:
            super().predict()

        def update(self, z: Any) -> None:
            super().update(z, polar_slope, polar, residual=lambda a, b: wrapped(a - b))

    problem, bank = make("ekf"), []
    for accel, _ in MODES[:2]:
        one = Bound(dim_x=4, dim_z=2)
        one.F, one.Q, one.R = transition(1.0), noise(1.0, accel), problem.R
        bank.append(one)
    for one in bank:
        one.x, one.P = problem.x0.copy(), problem.P0.copy()
    made = IMMEstimator(bank, np.full(2, 0.5), switching(2))

    def run() -> Array:
        for one in bank:
            one.x, one.P = problem.x0.copy(), problem.P0.copy()
        made.mu = np.full(2, 0.5)
        made._compute_mixing_probabilities()
        for z in problem.z[:, 0]:
            made.predict()
            made.update(z)
        return made.x[:2].copy()

    return run


def particles_by_vedette() -> Run:
    run = fly({"kind": "bootstrap_particles", "motion": CV, "particles": 1000})

    def loose() -> None:
        run()

    return loose


def particles_by_stonesoup() -> Run:
    from datetime import timedelta

    from stonesoup.predictor.particle import ParticlePredictor
    from stonesoup.resampler.particle import SystematicResampler
    from stonesoup.types.array import StateVectors
    from stonesoup.types.hypothesis import SingleHypothesis
    from stonesoup.types.numeric import Probability
    from stonesoup.types.state import ParticleState
    from stonesoup.updater.particle import ParticleUpdater

    from benchmarks.contenders import stonesoup as peer

    problem = make("ekf")
    motion, sensor = peer.parts(problem)
    predictor, updater = ParticlePredictor(motion), ParticleUpdater(sensor, SystematicResampler())
    drawn = np.random.default_rng(1).multivariate_normal(problem.x0, problem.P0, 1000)[:, peer.ORDER].T
    weight = np.array([Probability(1 / 1000)] * 1000)
    seen = [peer.detection(problem, sensor, z[0], peer.BEGIN + timedelta(seconds=i + 1)) for i, z in enumerate(problem.z)]

    def run() -> None:
        state: Any = ParticleState(state_vector=StateVectors(drawn), weight=weight, timestamp=peer.BEGIN)
        for one in seen:
            state = updater.update(SingleHypothesis(predictor.predict(state, timestamp=one.timestamp), one))

    return run
