"""Laws of estimators and motion models over any gap: from 1 ns to days or years, with noises from small to huge."""

from __future__ import annotations

from itertools import pairwise
from typing import Any

import numpy as np

from vedette.fields import ABSURD
from vedette.filters import predicted
from vedette.roles import Estimator, MotionModel
from vedette.testing.comparisons import closed_if, covariance, demand, deviations, finite, frozen_copy
from vedette.testing.law import Law
from vedette.testing.laws.estimator_cases import P_GATE, Scene, soft, sure
from vedette.testing.laws.motion_cases import Moves
from vedette.testing.sensors import Watch
from vedette.types import Detections

GAPS, LONGEST = (-9.0, 6.0), 8.0
"""Exponents of the gaps, in s, after which doubles hold any filter's belief; and of the longest of a motion."""
NOISES = (-3.0, 6.0)
"""Exponents of a return's deviation, in the unit of what is measured. Of sharper ones after days P^-1 is singular."""
SCANS = 4


def any_gap_leaves_a_belief(estimator: Estimator[Any], drawn: Scene) -> None:
    """After gaps of 1e-9 to 1e6 s, and returns with deviations of 1e-3 to 1e6, moments are finite and a covariance."""
    rng = drawn.rng()
    watches = [watch for watch in (drawn.watch, drawn.other) if estimator.refuses(watch) is None]
    closed_if(not watches, "it refuses the kit's linear sensors")
    belief = estimator.start(drawn.prior, estimator.state, rng)
    told = "from the start"
    for i in range(SCANS):
        watch, dt, deviation = watches[i % len(watches)], 10.0 ** rng.uniform(*GAPS), 10.0 ** rng.uniform(*NOISES)
        told += f", after {dt:.3g} s with a deviation of {deviation:.3g}"
        R = deviation**2 / watch.R[0, 0] * watch.R
        stated = bool(np.max(R) > ABSURD or i % 2)  # by the return, else by the sensor
        sensor = watch if stated else Watch(watch.observes, R, watch.probability, mix=watch.mix)
        belief = predicted(estimator, belief, dt, rng)
        moments = estimator.moments(belief)
        finite(f"mean predicted, {told}", moments.mean)
        covariance(f"covariance predicted, {told}", moments.cov, definite=False)
        where = estimator.state.locate(sensor.observes)
        H, P = sensor.H, moments.cov[..., where, :][..., where]
        S = H @ P @ np.swapaxes(H, -1, -2) + R
        spread = deviations(S)[..., :1, :]
        off = spread * rng.standard_normal((2, 2, spread.shape[-1]))
        z = sensor.measurement.canonical(sensor.measure(moments.mean[..., :1, where]) + off)
        noise = frozen_copy(np.broadcast_to(R, (2, 2, *R.shape))) if stated else None
        scan = Detections(frozen_copy(z), np.ones((2, 2), dtype=bool), None, noise)
        found = estimator.evaluate(belief, sensor, scan, P_GATE)
        demand(not np.isnan(found.loglik).any(), f"loglik, {told}: must be numbers, got nan")
        for name in ("distance", "nis"):
            least = np.min(getattr(found, name))
            demand(least >= 0, f"{name}, {told}: must be >= 0, got {least:.3g}")  # nan is not
        weights = soft(found.loglik, drawn.seed + i) if i % 2 else sure(found.loglik, 1)
        belief = estimator.update(belief, found, frozen_copy(weights))
        moments = estimator.moments(belief)
        finite(f"mean updated, {told}", moments.mean)
        covariance(f"covariance updated, {told}", moments.cov, definite=False)


def any_gap_can_be_moved_over(model: MotionModel, drawn: Moves) -> None:
    """Over gaps of 1e-9 to 1e8 s it moves to finite states, with a finite derivative and a noise that is a covariance.

    What goes on evenly until some time, between 20 and 200 s, does not stand from then on.
    """
    rng = np.random.default_rng(drawn.seed)
    places = [model.move(drawn.x, dt) for dt in np.geomspace(20.0, 200.0, 12)]
    gone = np.array([np.max(np.abs(model.state.difference(b, a)), axis=-1) for a, b in pairwise(places)])
    stands = (gone[3:] == 0.0) & (gone[1:-2] > np.maximum(0.9 * gone[:-3], 1e-6))
    demand(not np.any(stands), "move: what goes on evenly stands all at once")
    for dt in 10.0 ** np.append(rng.uniform(GAPS[0], LONGEST, 3), [GAPS[0], LONGEST]):
        finite(f"move over {dt:.3g} s", model.move(drawn.x, dt))
        finite(f"jacobian over {dt:.3g} s", model.jacobian(drawn.x, dt))
        covariance(f"noise over {dt:.3g} s", model.noise(drawn.x, dt), definite=False)


OF_ESTIMATORS = (Law(any_gap_leaves_a_belief),)
OF_MOTION = (Law(any_gap_can_be_moved_over),)
