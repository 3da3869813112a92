"""Filter and smooth one object at uneven times."""

from __future__ import annotations

from collections.abc import Iterator
from functools import cache
from typing import Any

import numpy as np

import vedette
from benchmarks.problems import MODES, Array, make
from benchmarks.whole_jobs import CV, Run, built
from vedette import Detections, Gaussian, Scan

POSITIONS = 1_000


@cache
def uneven() -> tuple[Array, Array, Array, Array]:
    """Return the times (s,) of an object, positions as measured (s, 2), and its prior."""
    rng = np.random.default_rng(1)
    times = np.cumsum(rng.uniform(0.5, 1.5, POSITIONS))
    z = np.outer(times, [12.0, -5.0]) + 5.0 * rng.standard_normal((POSITIONS, 2))
    return times, z, np.array([0.0, 0.0, 12.0, -5.0]), np.diag([100.0, 100.0, 25.0, 25.0])


def by_vedette() -> Run:
    times, z, x, P = uneven()
    tracker = built({"kind": "kalman", "motion": CV}, {"kind": "cartesian_position", "sigma": 5.0})
    scans = [Scan(float(time), "radar", Detections.of(row[None])) for time, row in zip(times, z, strict=True)]

    def states() -> Iterator[Any]:
        state = tracker.start(Gaussian(x[None], P[None]), 0.0)
        for scan in scans:
            state = tracker.step(state, scan)
            yield state

    def run() -> Array:
        whole = [tracker.estimate(state) for state in vedette.smoothed(tracker, states())]
        return whole[0].mean[0, :2]

    return run


def by_filterpy() -> Run:
    from filterpy.kalman import KalmanFilter

    times, z, x, P = uneven()
    made = KalmanFilter(dim_x=4, dim_z=2)
    made.H, made.R = np.eye(2, 4), 25.0 * np.eye(2)

    def run() -> Array:
        made.x, made.P = x.copy(), P.copy()
        xs, Ps, Fs, Qs, before = [], [], [], [], 0.0
        for time, row in zip(times.tolist(), z, strict=True):
            dt, before = time - before, time
            q = MODES[0][0] ** 2
            F = np.array([[1, 0, dt, 0], [0, 1, 0, dt], [0, 0, 1, 0], [0, 0, 0, 1]], dtype=float)
            a, b, c = q * dt**3 / 3, q * dt**2 / 2, q * dt
            Q = np.array([[a, 0, b, 0], [0, a, 0, b], [b, 0, c, 0], [0, b, 0, c]])
            made.predict(F=F, Q=Q)
            made.update(row)
            xs.append(made.x.copy()), Ps.append(made.P.copy()), Fs.append(F), Qs.append(Q)
        # step k of rts_smoother moves from k to k + 1 by the matrices of k + 1
        smooth, _, _, _ = made.rts_smoother(np.array(xs), np.array(Ps), Fs=Fs, Qs=Qs)
        return smooth[0, :2]

    return run


def by_stonesoup() -> Run:
    from datetime import timedelta

    from stonesoup.smoother.kalman import KalmanSmoother
    from stonesoup.types.hypothesis import SingleHypothesis
    from stonesoup.types.track import Track

    from benchmarks.contenders import stonesoup as peer

    problem = make("kf")
    motion, sensor = peer.parts(problem)
    predictor, updater, smoother = peer.KalmanPredictor(motion), peer.KalmanUpdater(sensor), KalmanSmoother(motion)
    times, z, x, P = uneven()
    seen = [
        peer.detection(problem, sensor, row, peer.BEGIN + timedelta(seconds=time))
        for time, row in zip(times.tolist(), z, strict=True)
    ]

    def run() -> Array:
        state, track = peer.start(x, P), Track()
        for one in seen:
            state = updater.update(SingleHypothesis(predictor.predict(state, timestamp=one.timestamp), one))
            track.append(state)
        return peer.gaussian([smoother.smooth(track)[0]])[0][0, :2]

    return run
