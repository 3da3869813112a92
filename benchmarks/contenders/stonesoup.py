"""Stone Soup, with its predictors, updaters and associators used as in its tutorials."""

from __future__ import annotations

from collections.abc import Callable
from datetime import datetime, timedelta
from importlib.metadata import version
from typing import Any

import numpy as np
from stonesoup.dataassociator.neighbour import GNNWith2DAssignment
from stonesoup.dataassociator.probability import PDA
from stonesoup.hypothesiser.distance import DistanceHypothesiser
from stonesoup.hypothesiser.probability import PDAHypothesiser
from stonesoup.measures import Mahalanobis
from stonesoup.models.measurement.linear import LinearGaussian
from stonesoup.models.measurement.nonlinear import CartesianToBearingRange
from stonesoup.models.transition.linear import (
    CombinedLinearGaussianTransitionModel,
    ConstantVelocity,
    LinearGaussianTimeInvariantTransitionModel,
)
from stonesoup.predictor.kalman import ExtendedKalmanPredictor, KalmanPredictor, UnscentedKalmanPredictor
from stonesoup.types.angle import Bearing
from stonesoup.types.array import StateVector
from stonesoup.types.detection import Detection
from stonesoup.types.hypothesis import SingleHypothesis
from stonesoup.types.state import GaussianState
from stonesoup.types.track import Track
from stonesoup.updater.kalman import ExtendedKalmanUpdater, KalmanUpdater, UnscentedKalmanUpdater
from stonesoup.updater.probability import PDAUpdater

from benchmarks.job import Answer, Job
from benchmarks.problems import DENSITY, GATE, KAPPA, MODES, P_DETECT, P_GATE, Array, Problem

VERSION = f"Stone Soup {version('stonesoup')}"
BEGIN = datetime(2026, 1, 1)


ORDER = [0, 2, 1, 3]
"""Its models expect x, vx, y, vy: the permutation and its inverse."""


def parts(problem: Problem) -> tuple[Any, Any]:
    """Return its transition and measurement models."""
    per_axis = ConstantVelocity(MODES[0][0] ** 2)
    motion = CombinedLinearGaussianTransitionModel([per_axis, per_axis])
    if polar(problem):
        noise = problem.R[::-1, ::-1].copy()  # bearing first
        return motion, CartesianToBearingRange(ndim_state=4, mapping=(0, 2), noise_covar=noise)
    return motion, LinearGaussian(ndim_state=4, mapping=(0, 2), noise_covar=problem.R)


def polar(problem: Problem) -> bool:
    return problem.family in ("ekf", "ukf")


def detection(problem: Problem, sensor: Any, z: Array, time: datetime) -> Any:
    vector = StateVector([[Bearing(z[1])], [z[0]]] if polar(problem) else z[:, None])
    return Detection(vector, timestamp=time, measurement_model=sensor)


def start(x: Array, P: Array) -> Any:
    return GaussianState(x[ORDER][:, None], P[ORDER][:, ORDER], timestamp=BEGIN)


def gaussian(states: list[Any]) -> Answer:
    means = np.array([np.asarray(state.state_vector, dtype=float)[:, 0] for state in states])
    covs = np.array([np.asarray(state.covar, dtype=float) for state in states])
    return means[:, ORDER], covs[:, ORDER][:, :, ORDER]


def looped(problem: Problem, predictor: Any, updater: Any, sensor: Any) -> Job:
    """Predict and update through all scans."""
    times = [BEGIN + timedelta(seconds=i + 1) for i in range(problem.steps)]
    seen = [detection(problem, sensor, z[0], time) for z, time in zip(problem.z, times, strict=True)]

    def run() -> Any:
        state = start(problem.x0, problem.P0)
        for one in seen:
            state = updater.update(SingleHypothesis(predictor.predict(state, timestamp=one.timestamp), one))
        return state

    return Job(run, lambda found: gaussian([found]))


def filtered(predictor: Any, updater: Any, **options: float) -> Callable[[Problem], Job]:
    def job(problem: Problem) -> Job:
        motion, sensor = parts(problem)
        return looped(problem, predictor(motion, **options), updater(sensor, **options), sensor)

    return job


def by_matrices(problem: Problem) -> Job:
    """Run the Kalman filter with F and Q given as matrices: less general than its constant velocity, and faster."""
    F, Q = problem.F[0][ORDER][:, ORDER], problem.Q[0][ORDER][:, ORDER]
    motion = LinearGaussianTimeInvariantTransitionModel(transition_matrix=F, covariance_matrix=Q)
    sensor = parts(problem)[1]
    return looped(problem, KalmanPredictor(motion), KalmanUpdater(sensor), sensor)


def pda(problem: Problem) -> Job:
    motion, sensor = parts(problem)
    predictor, updater = KalmanPredictor(motion), PDAUpdater(sensor)
    hypotheses = PDAHypothesiser(predictor, updater, clutter_spatial_density=DENSITY, prob_detect=P_DETECT, prob_gate=P_GATE)
    associator = PDA(hypotheses)
    times = [BEGIN + timedelta(seconds=i + 1) for i in range(problem.steps)]
    scans = [{detection(problem, sensor, z, time) for z in zs} for zs, time in zip(problem.z, times, strict=True)]

    def run() -> Any:
        track = Track([start(problem.x0, problem.P0)])
        for time, scan in zip(times, scans, strict=True):
            found = associator.associate({track}, scan, time)[track]
            track.append(updater.update(found))
        return track[-1]

    return Job(run, lambda found: gaussian([found]))


def gnn(problem: Problem) -> Job:
    motion, sensor = parts(problem)
    predictor, updater = KalmanPredictor(motion), KalmanUpdater(sensor)
    hypotheses = DistanceHypothesiser(predictor, updater, Mahalanobis(), missed_distance=np.sqrt(GATE))
    associator = GNNWith2DAssignment(hypotheses)
    time = BEGIN + timedelta(seconds=1)
    tracks = [Track([start(x, problem.P0)]) for x in problem.x0]
    scan = {detection(problem, sensor, z, time) for z in problem.z[0]}

    def run() -> list[Any]:
        found = associator.associate(set(tracks), scan, time)
        return [updater.update(found[track]) if found[track] else found[track].prediction for track in tracks]

    return Job(run, gaussian)


UNSCENTED = {"alpha": 1.0, "beta": 0.0, "kappa": KAPPA}
ENTRIES = {
    "kf": {"": filtered(KalmanPredictor, KalmanUpdater), "matrices": by_matrices},
    "ekf": {"": filtered(ExtendedKalmanPredictor, ExtendedKalmanUpdater)},
    "ukf": {"": filtered(UnscentedKalmanPredictor, UnscentedKalmanUpdater, **UNSCENTED)},
    "pda": {"": pda},
    "gnn": {"": gnn},
}
