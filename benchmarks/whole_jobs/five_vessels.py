"""Track five vessels by a radar with clutter."""

from __future__ import annotations

from functools import cache
from typing import Any

import numpy as np

from benchmarks.problems import POLAR, Array, make
from benchmarks.whole_jobs import Run, built
from vedette import Detections, Scan

SCANS = 100


@cache
def harbour() -> list[Array]:
    """Return ranges and bearings (k, 2) of each scan, every 2 s: five vessels, nine looks in ten, and 20 false returns."""
    rng, scans = np.random.default_rng(1), []
    x, v = rng.uniform(-3000, 3000, (5, 2)), rng.uniform(-8, 8, (5, 2))
    for _ in range(SCANS):
        x = x + 2.0 * v
        seen, k = x[rng.random(5) < 0.9], rng.poisson(20)
        polar = np.stack([np.hypot(*seen.T), np.arctan2(seen[:, 1], seen[:, 0])], axis=-1)
        polar = polar + rng.standard_normal(polar.shape) * POLAR
        false = np.stack([5000 * np.sqrt(rng.random(k)), rng.uniform(-np.pi, np.pi, k)], axis=-1)
        scans.append(rng.permutation(np.concatenate([polar, false])))
    return scans


def watch(estimator: Any, associator: str) -> Run:
    """Return a run over all scans."""
    sensor = {"kind": "range_bearing", "sigma_range": POLAR[0], "sigma_bearing": POLAR[1], "detection_probability": 0.9}
    birth = {"kind": "from_returns", "spread": {"vx": 10.0, "vy": 10.0}}
    limits = {"max_range": 5000.0, "clutter_per_scan": 20.0}
    tracker = built(estimator, sensor | limits, associator, birth=birth, lifecycle={"kind": "existence"})
    scans = [Scan(2.0 * i, "radar", Detections.of(z)) for i, z in enumerate(harbour())]

    def run() -> None:
        state = tracker.start(seed=0)
        for scan in scans:
            state = tracker.step(state, scan)

    return run


def by_stonesoup() -> Run:
    """Run its GNN, starting a track at each return that is left over; ten scans stand for all."""
    from datetime import timedelta

    from stonesoup.deleter.time import UpdateTimeStepsDeleter
    from stonesoup.initiator.simple import SimpleMeasurementInitiator

    from benchmarks.contenders import stonesoup as peer

    problem = make("ekf")
    motion, sensor = peer.parts(problem)
    predictor, updater = peer.ExtendedKalmanPredictor(motion), peer.ExtendedKalmanUpdater(sensor)
    hypotheses = peer.DistanceHypothesiser(predictor, updater, peer.Mahalanobis(), missed_distance=3)
    associator = peer.GNNWith2DAssignment(hypotheses)
    prior = peer.start(np.zeros(4), np.diag([1e-9, 1e-9, 100.0, 100.0]))
    initiator, deleter = SimpleMeasurementInitiator(prior, sensor), UpdateTimeStepsDeleter(3)
    scans = [
        (time, {peer.detection(problem, sensor, row, time) for row in z})
        for i, z in enumerate(harbour()[: SCANS // 10])
        for time in [peer.BEGIN + timedelta(seconds=2 * i)]
    ]

    def run() -> None:
        tracks: set[Any] = set()
        for time, scan in scans:
            found, used = associator.associate(tracks, scan, time), set()
            for track, one in found.items():
                if one:
                    track.append(updater.update(one))
                    used.add(one.measurement)
                else:
                    track.append(one.prediction)
            tracks -= deleter.delete_tracks(tracks)
            tracks |= initiator.initiate(scan - used, time)

    return run
