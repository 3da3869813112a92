"""simdkalman: many series at once in numpy."""

from __future__ import annotations

from importlib.metadata import version

import numpy as np
from simdkalman import KalmanFilter

from benchmarks.job import Answer, Job
from benchmarks.problems import Problem

VERSION = f"simdkalman {version('simdkalman')}"


def kf(problem: Problem) -> Job:
    """Return filtered states and covariances of all series."""
    made = KalmanFilter(problem.F[0], problem.Q[0], problem.H, problem.R)
    # It takes the initial state as the first scan's prediction.
    x, P = problem.F[0] @ problem.x0, problem.F[0] @ problem.P0 @ problem.F[0].T + problem.Q[0]
    z = problem.z if problem.tracks is not None else problem.z[:, None]
    series = np.ascontiguousarray(np.swapaxes(z[:, :, 0], 0, 1))
    probe = list(problem.probe) or [0]

    def run() -> Answer:
        found = made.compute(
            series, 0, initial_value=x, initial_covariance=P, smoothed=False, filtered=True, observations=False
        )
        return found.filtered.states.mean, found.filtered.states.cov

    return Job(run, lambda found: (found[0][probe, -1], found[1][probe, -1]))


ENTRIES = {"kf": {"": kf}}
