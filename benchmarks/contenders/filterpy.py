"""FilterPy, used as in its documentation. It keeps its state in the filter, so a run begins by setting x and P."""

from __future__ import annotations

from collections.abc import Callable
from importlib.metadata import version
from typing import Any

import numpy as np
from filterpy.kalman import ExtendedKalmanFilter, IMMEstimator, JulierSigmaPoints, KalmanFilter, UnscentedKalmanFilter

from benchmarks.contenders.textbook import polar, polar_slope, wrapped
from benchmarks.job import Job
from benchmarks.problems import KAPPA, Problem

VERSION = f"FilterPy {version('filterpy')}"


def linear(problem: Problem, mode: int) -> KalmanFilter:
    """Return its Kalman filter with the matrices of a mode."""
    made = KalmanFilter(dim_x=4, dim_z=2)
    made.x, made.P, made.F, made.Q = problem.x0.copy(), problem.P0.copy(), problem.F[mode], problem.Q[mode]
    made.H, made.R = problem.H, problem.R
    return made


def looped(problem: Problem, made: Any, update: Callable[[Any], None]) -> Job:
    """Predict and update through all scans."""
    zs = list(problem.z[:, 0])

    def run() -> Any:
        made.x, made.P = problem.x0.copy(), problem.P0.copy()
        for z in zs:
            made.predict()
            update(z)
        return made

    return Job(run, lambda found: (found.x[None].copy(), found.P[None].copy()))


def kf(problem: Problem) -> Job:
    made = linear(problem, 0)
    return looped(problem, made, made.update)


def ekf(problem: Problem) -> Job:
    made = ExtendedKalmanFilter(dim_x=4, dim_z=2)
    made.F, made.Q, made.R = problem.F[0], problem.Q[0], problem.R

    def residual(a: Any, b: Any) -> Any:
        return wrapped(a - b)

    return looped(problem, made, lambda z: made.update(z, polar_slope, polar, residual=residual))


def ukf(problem: Problem) -> Job:
    def moved(x: Any, dt: float) -> Any:
        return problem.F[0] @ x

    def residual(a: Any, b: Any) -> Any:
        return wrapped(a - b)

    points = JulierSigmaPoints(4, KAPPA)
    made = UnscentedKalmanFilter(4, 2, dt=1.0, hx=polar, fx=moved, points=points, residual_z=residual)
    made.Q, made.R = problem.Q[0], problem.R
    return looped(problem, made, made.update)


def imm(problem: Problem) -> Job:
    r, zs = problem.modes, list(problem.z[:, 0])
    bank = [linear(problem, j) for j in range(r)]
    made = IMMEstimator(bank, np.full(r, 1 / r), problem.switching)

    def run() -> Any:
        for one in bank:
            one.x, one.P = problem.x0.copy(), problem.P0.copy()
        made.mu = np.full(r, 1 / r)
        made._compute_mixing_probabilities()
        for z in zs:
            made.predict()
            made.update(z)
        return made

    return Job(run, lambda found: (found.x[None].copy(), found.P[None].copy()))


ENTRIES = {"kf": {"": kf}, "ekf": {"": ekf}, "ukf": {"": ukf}, "imm": {"": imm}}
