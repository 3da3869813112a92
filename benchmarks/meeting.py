"""Exact joint association where targets meet in one point: Vedette's jpda beside Stone Soup's with EHM2, in one run.

    python -m benchmarks.meeting                                    5 and 10 targets, clutter 1e-5 and 1e-4 per m^2
    python -m benchmarks.meeting --peers-python PATH --limit 60     the interpreter that has Stone Soup, s of CPU time a scan

Targets go along straight lines through one point, 200 scans, sigma 5 m, P_D .9. Both get the same tracks and returns, and
each runs by itself; CPU times are those of association and update, the first scan left out. Every association weight of
every scan is compared. A scan that EHM2 does not end within the limit ends its run, and is told with what came before it.
"""

from __future__ import annotations

import argparse
import json
import os
import signal
import subprocess
import sys
from collections.abc import Callable, Sequence
from pathlib import Path
from time import thread_time
from typing import Any

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.floating[Any]]

ROOT = Path(__file__).parents[1]
SIGMA, P_DETECT, P_GATE, SPEED, SIGMA_ACCEL = 5.0, 0.9, 0.99, 2.0, 0.1
SCANS, SEED = 200, 7
AGREE = 1e-9


class NotEnded(Exception):
    """A scan took longer than allowed."""


def scene(targets: int, density: float) -> tuple[Array, Array, list[Array]]:
    """Return the tracks' means (t, 4) over x, y, vx, vy, the covariance (4, 4) of each, and each scan's returns (k, 2)."""
    rng, half = np.random.default_rng(SEED), SCANS / 2
    angle = 2.0 * np.pi * np.arange(targets) / targets
    course = SPEED * np.column_stack([np.cos(angle), np.sin(angle)])
    reach, scans = half * SPEED + 50.0, []
    for scan in range(SCANS):
        seen = ((scan - half) * course)[rng.random(targets) < P_DETECT]
        false = rng.uniform(-reach, reach, (rng.poisson(density * 4 * reach**2), 2))
        scans.append(rng.permutation(np.concatenate([seen + rng.normal(0, SIGMA, seen.shape), false])))
    return np.column_stack([-half * course, course]), np.diag([25.0, 25.0, 1.0, 1.0]), scans


def vedette_steps(targets: int, density: float) -> Callable[[float, Array], Array]:
    """Return a function that takes a scan and returns the weights (t, 1+k)."""
    import vedette
    from vedette import Detections, Gaussian, Scan

    tracker = vedette.build(
        {
            "estimator": {"kind": "kalman", "motion": {"kind": "constant_velocity", "sigma_accel": SIGMA_ACCEL}},
            "sensors": {
                "radar": {
                    "kind": "cartesian_position",
                    "sigma": SIGMA,
                    "detection_probability": P_DETECT,
                    "clutter_density": density,
                }
            },
            "associator": {"kind": "jpda"},
            "birth": {"kind": "given", "start": {axis: [0.0, 1.0] for axis in ("x", "y", "vx", "vy")}},
            "lifecycle": {"kind": "single_target"},
            "gate": {"probability": P_GATE},
        }
    )
    mean, cov, _ = scene(targets, density)
    state = tracker.start(Gaussian(mean, np.broadcast_to(cov, (targets, 4, 4)).copy()), 0.0)

    def step(time: float, z: Array) -> Array:
        nonlocal state
        state = tracker.step(state, Scan(time, "radar", Detections.of(z, 2)))
        if state.approximated:
            raise SystemExit(f"{targets} targets: {state.approximated} weights were not exact")
        return state.weights

    return step


def stonesoup_steps(targets: int, density: float) -> Callable[[float, Array], Array]:
    """Return the same of Stone Soup's JPDA with efficient hypothesis management."""
    from datetime import datetime, timedelta

    from stonesoup.dataassociator.probability import JPDAwithEHM2
    from stonesoup.hypothesiser.probability import PDAHypothesiser
    from stonesoup.models.measurement.linear import LinearGaussian
    from stonesoup.models.transition.linear import CombinedLinearGaussianTransitionModel, ConstantVelocity
    from stonesoup.predictor.kalman import KalmanPredictor
    from stonesoup.types.array import StateVector
    from stonesoup.types.detection import Detection
    from stonesoup.types.state import GaussianState
    from stonesoup.types.track import Track
    from stonesoup.updater.kalman import KalmanUpdater
    from stonesoup.updater.probability import PDAUpdater

    begin, order = datetime(2026, 1, 1), [0, 2, 1, 3]
    motion = CombinedLinearGaussianTransitionModel([ConstantVelocity(SIGMA_ACCEL**2) for _ in "xy"])
    radar = LinearGaussian(4, (0, 2), SIGMA**2 * np.eye(2))
    predictor, updater = KalmanPredictor(motion), PDAUpdater(radar)
    hypothesiser = PDAHypothesiser(
        predictor, KalmanUpdater(radar), clutter_spatial_density=density, prob_detect=P_DETECT, prob_gate=P_GATE
    )
    associator = JPDAwithEHM2(hypothesiser)
    mean, cov, _ = scene(targets, density)
    tracks = [Track([GaussianState(x[order][:, None], cov[order][:, order], timestamp=begin)]) for x in mean]

    def step(time: float, z: Array) -> Array:
        now = begin + timedelta(seconds=time)
        returns = [Detection(StateVector(one[:, None]), timestamp=now, measurement_model=radar) for one in z]
        found = associator.associate(set(tracks), set(returns), now)
        number, weights = {id(one): i for i, one in enumerate(returns)}, np.zeros((targets, 1 + len(z)))
        for row, track in zip(weights, tracks, strict=True):
            track.append(updater.update(found[track]))
            for hypothesis in found[track]:
                row[1 + number[id(hypothesis.measurement)] if hypothesis else 0] = float(hypothesis.probability)
        return weights

    return step


CONTENDERS = {"vedette": vedette_steps, "stonesoup": stonesoup_steps}


def timed(name: str, targets: int, density: float, limit: float) -> dict[str, Any]:
    """Return the CPU times of all scans in s, their weights, and in `not_ended` the scan that took longer than `limit`."""

    def stop(*_: Any) -> None:
        raise NotEnded

    before_us = signal.signal(signal.SIGPROF, stop)
    step, seconds, weights, not_ended = CONTENDERS[name](targets, density), [], [], None
    for i, z in enumerate(scene(targets, density)[2]):
        signal.setitimer(signal.ITIMER_PROF, limit)
        before = thread_time()
        try:
            found = step(1.0 + i, z)
        except NotEnded:
            not_ended = i
            break
        finally:
            signal.setitimer(signal.ITIMER_PROF, 0)
        seconds.append(thread_time() - before)
        weights.append(found.tolist())
    signal.signal(signal.SIGPROF, before_us)
    return {"seconds": seconds, "weights": weights, "not_ended": not_ended}


def alone(python: str, name: str, targets: int, density: float, limit: float) -> dict[str, Any] | str:
    """Return `timed` in a process of its own, or why there is none."""
    command = [python, "-m", "benchmarks.meeting", "--one", name, str(targets), str(density), "--limit", str(limit)]
    known = {**os.environ, "OPENBLAS_NUM_THREADS": "1", "OMP_NUM_THREADS": "1", "PYTHONPATH": str(ROOT)}
    done = subprocess.run(command, capture_output=True, text=True, cwd=ROOT, env=known, check=False)
    if done.returncode:
        return (done.stderr.strip().splitlines() or ["it ended without a word"])[-1]
    return json.loads(done.stdout)


def told(found: dict[str, Any], limit: float) -> str:
    """Return mean and 99th percentile in ms of the scans but the first, and where the run ended early."""
    times = 1e3 * np.array(found["seconds"][1:])
    figures = f"{np.mean(times):.3f} ({np.quantile(times, 0.99):.3f})" if len(times) else "-"
    if found["not_ended"] is None:
        return figures
    return f"{figures} in {len(times)} scans; scan {found['not_ended'] + 1} did not end within {limit:g} s"


def row(targets: int, density: float, own: dict[str, Any], other: dict[str, Any] | str, limit: float) -> str:
    """Return a line of the table."""
    cells = [f"{targets}", f"{density:g}", told(own, limit)]
    if isinstance(other, str):
        return f"| {' | '.join([*cells, f'left out: {other}', '', ''])} |"
    both = len(other["seconds"])
    pairs = list(zip(own["weights"][:both], other["weights"], strict=True))
    apart = max((float(np.max(np.abs(np.array(a) - np.array(b)))) for a, b in pairs), default=0.0)
    if apart > AGREE:
        raise SystemExit(f"{targets} targets, clutter {density:g}: weights differ by {apart:.1e}, more than {AGREE:g}")
    ratio = "-"
    if both > 1:
        mine, theirs = own["seconds"][1:both], other["seconds"][1:]
        mean, tail = np.mean(theirs) / np.mean(mine), np.quantile(theirs, 0.99) / np.quantile(mine, 0.99)
        ratio = f"{mean:.0f} ({tail:.0f})"
    return f"| {' | '.join([*cells, told(other, limit), ratio, f'{apart:.0e} in {both} scans'])} |"


def main(arguments: Sequence[str] | None = None) -> None:
    """Print the table."""
    parser = argparse.ArgumentParser("python -m benchmarks.meeting", description=(__doc__ or "").split("\n")[0])
    parser.add_argument("--peers-python", default=sys.executable, metavar="PATH", help="the interpreter with Stone Soup")
    parser.add_argument("--targets", type=int, nargs="+", default=[5, 10])
    parser.add_argument("--clutter", type=float, nargs="+", default=[1e-5, 1e-4], help="false returns per m^2")
    parser.add_argument("--limit", type=float, default=30.0, help="CPU time in s that a scan may take")
    parser.add_argument("--one", nargs=3, metavar=("NAME", "TARGETS", "CLUTTER"), help=argparse.SUPPRESS)
    given = parser.parse_args(arguments)
    if given.one:
        name, targets, density = given.one
        print(json.dumps(timed(name, int(targets), float(density), given.limit)))
        return
    print("| targets | clutter per m^2 | jpda ms a scan, mean (p99) | EHM2 ms a scan | times as long | largest difference |")
    print("| --- | --- | --- | --- | --- | --- |")
    for targets in given.targets:
        for density in given.clutter:
            own = alone(sys.executable, "vedette", targets, density, given.limit)
            if isinstance(own, str):
                raise SystemExit(own)
            other = alone(given.peers_python, "stonesoup", targets, density, given.limit)
            print(row(targets, density, own, other, given.limit), flush=True)


if __name__ == "__main__":
    main()
