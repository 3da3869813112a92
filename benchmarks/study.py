"""What studies cost: against Stone Soup, on two threads, on a cluster, in memory, and the target-oriented paper's own.

    python -m benchmarks.study [--quick] [--only stonesoup|threads|cluster|paper|memory]

CPU times, in turns, so that other load affects all alike; ratios within a turn.
"""

from __future__ import annotations

import argparse
import json
import os
import subprocess
import sys
from collections.abc import Callable, Iterator, Sequence
from contextlib import suppress
from importlib.util import find_spec
from pathlib import Path
from time import perf_counter, process_time
from typing import Any, TypeVar

import numpy as np

import vedette
from vedette_study.plan import Plan, plan
from vedette_study.study import perform

T = TypeVar("T")
RUNS, STEPS = 100, 100
CV = {"kind": "constant_velocity", "sigma_accel": 0.5}
START = {"x": [0, 10], "y": [0, 10], "vx": [5, 2], "vy": [3, 2]}
CONFIG: dict[str, Any] = {
    "source": {
        "kind": "simulation",
        "duration": STEPS,
        "looks": {"radar": {"interval": 1, "first": 1}},
        "drawn": {"boat": {"models": [CV], "start": START}},
    },
    "sensors": {"radar": {"kind": "cartesian_position", "sigma": 5.0}},
    "estimator": {"kind": "kalman", "motion": CV},
    "gate": {"probability": 0.999999},
    "associator": {"kind": "nearest"},
    "birth": {"kind": "given", "start": START},
    "lifecycle": {"kind": "single_target"},
}


def vedette_study() -> float:
    """Return the RMS position error of the runs."""
    return vedette.monte_carlo(CONFIG, RUNS, 1, chunk=RUNS).means(0)["position_rmse"].value or 0.0


def stone_soup_study() -> float:
    """Run the same in Stone Soup: truth drawn from its model, detections from its sensor model, its Kalman filter."""
    from datetime import datetime, timedelta

    from stonesoup.models.measurement.linear import LinearGaussian
    from stonesoup.models.transition.linear import CombinedLinearGaussianTransitionModel, ConstantVelocity
    from stonesoup.predictor.kalman import KalmanPredictor
    from stonesoup.types.detection import Detection
    from stonesoup.types.groundtruth import GroundTruthState
    from stonesoup.types.hypothesis import SingleHypothesis
    from stonesoup.types.state import GaussianState
    from stonesoup.updater.kalman import KalmanUpdater

    motion = CombinedLinearGaussianTransitionModel([ConstantVelocity(0.25), ConstantVelocity(0.25)])
    sensor = LinearGaussian(ndim_state=4, mapping=(0, 2), noise_covar=np.diag([25.0, 25.0]))
    predictor, updater = KalmanPredictor(motion), KalmanUpdater(sensor)
    begin, step = datetime(2026, 1, 1), timedelta(seconds=1)
    mean, deviation = np.array([0.0, 5.0, 0.0, 3.0]), np.array([10.0, 2.0, 10.0, 2.0])
    rng, squares = np.random.default_rng(1), []
    for _ in range(RUNS):
        truth = GroundTruthState((mean + deviation * rng.standard_normal(4))[:, None], timestamp=begin)
        track: Any = GaussianState(mean[:, None], np.diag(deviation**2), timestamp=begin)
        for _ in range(STEPS):
            time = truth.timestamp + step
            truth = GroundTruthState(motion.function(truth, noise=True, time_interval=step), timestamp=time)
            seen = Detection(sensor.function(truth, noise=True), timestamp=time, measurement_model=sensor)
            track = updater.update(SingleHypothesis(predictor.predict(track, timestamp=time), seen))
            error = np.asarray(truth.state_vector - track.mean, dtype=float)[[0, 2], 0]
            squares.append(float(error @ error))
    return float(np.sqrt(np.mean(squares)))


def cpu(work: Callable[[], Any]) -> float:
    """Return the CPU seconds of this process."""
    before = process_time()
    work()
    return process_time() - before


def spread(values: list[float]) -> str:
    """Format median and quartiles."""
    low, middle, high = np.quantile(values, [0.25, 0.5, 0.75])
    return f"{middle:.3g} ({low:.3g} to {high:.3g}, {len(values)} rounds)"


def against_stone_soup(rounds: int) -> None:
    """Print the ratio, and that both solve the same problem."""
    if find_spec("stonesoup") is None:
        print("Stone Soup is not installed: left out")
        return
    print(f"RMS error: Vedette {vedette_study():.3f} m, Stone Soup {stone_soup_study():.3f} m")
    planned = plan({"experiment": CONFIG, "runs": RUNS, "seed": 1, "chunk": RUNS})
    whole, ours, theirs = [], [], []
    for _ in range(rounds):
        whole.append(np.mean([cpu(vedette_study) for _ in range(20)]))
        ours.append(np.mean([cpu(lambda: perform(planned).means(0)) for _ in range(20)]))
        theirs.append(cpu(stone_soup_study))
    print(f"{RUNS} runs x {STEPS} steps: Vedette {spread(whole)} s from the config on, of it the runs {spread(ours)} s")
    print(f"Stone Soup {spread(theirs)} s")
    for name, took in (("from the config on", whole), ("the runs alone", ours)):
        print(f"Stone Soup / Vedette, {name}: {spread([b / a for a, b in zip(took, theirs, strict=True)])}")


def queued() -> dict[str, float]:
    """Return the seconds that each thread of this process, by its id, has waited for a processor."""
    found = {}
    for task in Path("/proc/self/task").iterdir():
        with suppress(OSError):  # a thread that just ended
            found[task.name] = int((task / "schedstat").read_text().split()[1]) / 1e9
    return found


def undisturbed(planned: Plan, threads: int) -> tuple[float, float]:
    """Return the wall time, and the same less the time that the working threads waited for a processor."""
    before, after, begin = queued(), dict[str, float](), perf_counter()

    def progress(runs: Sequence[T], about: str, /) -> Iterator[T]:
        for done, run in enumerate(runs, 1):
            if done == len(runs):
                after.update(queued())
            yield run

    perform(planned, threads=threads, progress=progress)
    took = perf_counter() - begin
    fresh = [after[name] for name in after if name not in before]
    main = str(os.getpid())
    return took, took - (float(np.mean(fresh)) if threads > 1 else after[main] - before[main])


def turns(rounds: int, runs: int) -> list[list[tuple[float, float]]]:
    """Return `undisturbed` of one thread and of two, in turns, without the first turn."""
    planned = plan({"experiment": CONFIG, "runs": runs, "seed": 1})
    return [[undisturbed(planned, threads) for threads in (1, 2)] for _ in range(rounds + 1)][1:]


def on_two_threads(processes: int, rounds: int, runs: int) -> None:
    """Print one thread over two by wall time, and as if nobody else used the processors meanwhile (known on Linux).

    It uses several processes, as the placement of a process's memory makes a tenth either way for all its rounds.
    """
    code = f"from benchmarks import study; import json; print(json.dumps(study.turns({rounds}, {runs})))"
    found = [json.loads(output_of(code)) for _ in range(processes)]
    for name, i in (("without waiting for a processor", 1), ("on the wall", 0)):
        each = [[one[i] / two[i] for one, two in rounds] for rounds in found]
        text = spread([ratio for ratios in each for ratio in ratios])
        medians = ", ".join(f"{np.median(ratios):.3g}" for ratios in each)
        print(f"{runs:,} runs, one thread / two, {name}: {text}; medians of {processes} processes: {medians}")
    print(f"load {os.getloadavg()[0]:.1f}")


def output_of(code: str) -> str:
    """Return what a separate process prints."""
    return subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True).stdout


KEPT = {
    "MALLOC_MMAP_THRESHOLD_": str(2**30),
    "MALLOC_TRIM_THRESHOLD_": str(2**30),
    "DASK_DISTRIBUTED__WORKER__PROFILE__ENABLED": "False",
}
"""The C library keeps memory for the next chunk, where Dask's own setting returns it all; no profile is taken."""


def on_a_cluster(runs: int) -> None:
    """Run the same study in two threads here and on a Dask cluster of two processes: CPU of all that take part."""
    if find_spec("distributed") is None:
        print("Dask is not installed: left out")
        return
    from distributed import Client, LocalCluster

    planned = plan({"experiment": CONFIG, "runs": runs, "seed": 1})
    before, begin = process_time(), perf_counter()
    perform(planned, threads=2)
    cpu, wall = process_time() - before, perf_counter() - begin
    print(f"{runs:,} runs: {cpu:.1f} s of CPU here")
    for name, variables in (("as Dask sets them up", {}), ("as docs/studies.md has it", KEPT)):
        os.environ.update(variables)
        options = {"dashboard_address": None, "host": "127.0.0.1"}
        with LocalCluster(n_workers=2, threads_per_worker=1, **options) as made, Client(made) as client:
            perform(plan({"experiment": CONFIG, "runs": 4000, "seed": 1}), scheduler=made.scheduler_address)  # imports
            before, begin = process_time() + sum(client.run(process_time).values()), perf_counter()
            perform(planned, scheduler=made.scheduler_address)
            took = process_time() + sum(client.run(process_time).values()) - before
            ratio = (perf_counter() - begin) / wall
        print(f"  on a cluster of two processes {name}: {took / cpu:.2f} of that; on the wall {ratio:.2f} of two threads'")


def target_oriented(rounds: int) -> None:
    """Run the paper's 1,000 runs of five IMM-PDAFs."""
    from vedette_target_oriented.reproduction import TargetOrientedReproduction

    study = TargetOrientedReproduction()
    took = [cpu(lambda: study.run(1000, 1, lambda items, about: items)) for _ in range(rounds)]
    print(f"target-oriented, 1,000 runs: {spread(took)} s of CPU")


def memory(runs: int) -> None:
    """Print the peak memory of a separate process."""
    code = (
        "from benchmarks import study; import vedette, resource;"
        f"vedette.monte_carlo(study.CONFIG, {runs}, 1, threads=2);"
        "print(resource.getrusage(resource.RUSAGE_SELF).ru_maxrss)"
    )
    print(f"{runs:,} runs: {int(output_of(code)) / 1024:.0f} MB at most")


if __name__ == "__main__":
    parser = argparse.ArgumentParser("python -m benchmarks.study")
    parser.add_argument("--quick", action="store_true", help="fewer rounds and runs")
    parser.add_argument("--only", default="", choices=["", "stonesoup", "threads", "cluster", "paper", "memory"])
    given = parser.parse_args()
    few = given.quick
    jobs: dict[str, Callable[[], None]] = {
        "stonesoup": lambda: against_stone_soup(3 if few else 7),
        "threads": lambda: on_two_threads(1 if few else 7, 3 if few else 7, 10_000),
        "cluster": lambda: on_a_cluster(60_000 if few else 1_200_000),
        "paper": lambda: target_oriented(1 if few else 3),
        "memory": lambda: memory(10_000 if few else 100_000),
    }
    for name, job in jobs.items():
        if given.only in ("", name):
            job()
