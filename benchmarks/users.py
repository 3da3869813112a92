"""What users run: whole jobs, beside FilterPy and Stone Soup on the same scenes. The first table of `python -m benchmarks`.

    python -m benchmarks.users                  all jobs; --only WORDS: those whose title has these words
    python -m benchmarks.users --write          puts the table into docs/measured/speed.md

All take turns in one process and one thread, A B C A B C; the times are CPU times, the least of the rounds. Where two
solve the same equations, they must agree first. Where rules differ, as those by which tracks begin, only the scene is one.
"""

from __future__ import annotations

import argparse
import cProfile
import os
import pstats
import resource
import subprocess
import sys
import tempfile
from collections.abc import Callable, Iterator
from dataclasses import dataclass
from functools import cache
from pathlib import Path
from time import process_time
from typing import Any

import numpy as np

import vedette
from benchmarks.problems import MODES, POLAR, Array, make, noise, switching, transition
from benchmarks.table import digits, grid, quotient, verdict
from vedette import Detections, Gaussian, Scan

ROOT = Path(__file__).parent.parent
BEGIN, END = "<!-- users: begin -->", "<!-- users: end -->"
AGREE = 1e-6
CV = {"kind": "constant_velocity", "sigma_accel": MODES[0][0]}
EKF = {"kind": "ekf", "motion": CV}
TWO = [EKF, {"kind": "ekf", "motion": {"kind": "constant_velocity", "sigma_accel": MODES[1][0]}}]
IMM = {"kind": "imm", "modes": TWO, "transition": switching(2).tolist()}
UKF = {"kind": "ukf", "motion": CV}
POSITIONS, SCANS = 1_000, 100

Run = Callable[[], Any]
"""Does a job once, and returns what it found: a position (2,), or None where none is compared."""


@dataclass(frozen=True)
class Job:
    """A job by its title, what a time is of, how many of these it has, who does it, and the most that Vedette may take.

    `most`: a share of what another takes. `runs`: how often each does it in a round.
    """

    title: str
    unit: str
    count: int
    by: dict[str, Callable[[], Run]]
    most: dict[str, float]
    runs: int = 1


def built(estimator: Any, sensor: Any, associator: str = "pda", **parts: Any) -> vedette.Tracker:
    """Return a tracker of these parts; of a given track unless `parts` say otherwise."""
    start = {name: [0.0, 1.0] for name in ("x", "y", "vx", "vy")}
    usual = {"birth": {"kind": "given", "start": start}, "lifecycle": {"kind": "single_target"}}
    whole = {"estimator": estimator, "sensors": {"radar": sensor}, "associator": {"kind": associator}}
    return vedette.build(whole | usual | parts)


# One object at uneven times


@cache
def uneven() -> tuple[Array, Array, Array, Array]:
    """Return the times (s,) of an object, positions as measured (s, 2), and its prior."""
    rng = np.random.default_rng(1)
    times = np.cumsum(rng.uniform(0.5, 1.5, POSITIONS))
    z = np.outer(times, [12.0, -5.0]) + 5.0 * rng.standard_normal((POSITIONS, 2))
    return times, z, np.array([0.0, 0.0, 12.0, -5.0]), np.diag([100.0, 100.0, 25.0, 25.0])


def smoothing_by_vedette() -> Run:
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


def smoothing_by_filterpy() -> Run:
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
        found: Array = smooth[0, :2]
        return found

    return run


def smoothing_by_stonesoup() -> Run:
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


# One track by range and bearing


def _fly(estimator: Any) -> Run:
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


def _peer(name: str, family: str) -> Run:
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
        found: Array = made.x[:2].copy()
        return found

    return run


def particles_by_vedette() -> Run:
    run = _fly({"kind": "bootstrap_particles", "motion": CV, "particles": 1000})

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


# Five vessels, a radar with clutter


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


def _watch(estimator: Any, associator: str) -> Run:
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


def harbour_by_stonesoup() -> Run:
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


def command() -> Run:
    """Return the run of the whole command, from file to tracks; its CPU time is that of a process of its own."""

    def run() -> None:
        with tempfile.TemporaryDirectory() as folder:
            place = [str(ROOT / "examples" / "harbour.toml"), "--out", f"{folder}/out"]
            subprocess.run([sys.executable, "-m", "vedette", "run", *place], check=True, stdout=subprocess.DEVNULL)

    return run


JOBS = (
    Job(
        "filter and smooth one object at uneven times",
        "a position",
        POSITIONS,
        {"vedette": smoothing_by_vedette, "filterpy": smoothing_by_filterpy, "stonesoup": smoothing_by_stonesoup},
        {"filterpy": 1 / 3},
    ),
    Job(
        "EKF, range and bearing",
        "a scan",
        50,
        {
            "vedette": lambda: _fly(EKF),
            "filterpy": lambda: _peer("filterpy", "ekf"),
            "stonesoup": lambda: _peer("stonesoup", "ekf"),
        },
        {"filterpy": 1 / 5, "stonesoup": 1 / 80},
        10,
    ),
    Job(
        "UKF, range and bearing",
        "a scan",
        50,
        {"vedette": lambda: _fly(UKF | {"kappa": 1.0}), "filterpy": lambda: _peer("filterpy", "ukf")},
        {"filterpy": 1 / 15},
        10,
    ),
    Job(
        "IMM of two EKFs, range and bearing",
        "a scan",
        50,
        {"vedette": lambda: _fly(IMM), "filterpy": imm_by_filterpy},
        {"filterpy": 1 / 20},
        10,
    ),
    Job(
        "1,000 particles, range and bearing",
        "a scan",
        50,
        {"vedette": particles_by_vedette, "stonesoup": particles_by_stonesoup},
        {"stonesoup": 1 / 5},
    ),
    Job(
        "five vessels, 25 returns a scan, births and deaths: gnn",
        "a scan",
        SCANS,
        {"vedette": lambda: _watch(EKF, "gnn"), "stonesoup": harbour_by_stonesoup},
        {"stonesoup": 1 / 100},
    ),
    Job("the same: jpda", "a scan", SCANS, {"vedette": lambda: _watch(EKF, "jpda")}, {}),
    Job("the same: IMM of two EKFs, jpda", "a scan", SCANS, {"vedette": lambda: _watch(IMM, "jpda")}, {}),
    Job("the same: UKF, gnn", "a scan", SCANS, {"vedette": lambda: _watch(UKF, "gnn")}, {}),
    Job("`vedette run examples/harbour.toml`, from file to tracks", "a run", 1, {"vedette": command}, {}),
)
SHORTER = {("stonesoup", "gnn"): 10}
"""Who does only a part of a job, one in so many scans."""


def spent() -> float:
    """Return the CPU seconds of this process and of those that it has waited for."""
    children = resource.getrusage(resource.RUSAGE_CHILDREN)
    return process_time() + children.ru_utime + children.ru_stime


@dataclass(frozen=True)
class Found:
    """The least seconds of each, or why it is left out; and where Vedette's time goes: its costliest functions."""

    job: Job
    seconds: dict[str, float]
    told: list[str]
    lines: list[str]


def measure(job: Job, rounds: int) -> Found:
    """Let all do a job in turns."""
    runs, told, answers = {}, [], {}
    for name, ready in job.by.items():
        try:
            runs[name] = ready()
            answers[name] = runs[name]()
        except ImportError as error:
            told.append(f"{job.title}: {name} is not there: {error}")
            continue
        right = answers.get("vedette")
        if right is not None and not np.allclose(answers[name], right, rtol=AGREE, atol=0.0):
            told.append(f"{job.title}: {name} is left out, as it finds {answers[name]}, not {right}")
            del runs[name]
    each: dict[str, float] = dict.fromkeys(runs, np.inf)
    for _ in range(rounds):
        for name, run in runs.items():
            times, share = (job.runs if name == "vedette" else 1), SHORTER.get((name, job.title.rpartition(": ")[2]), 1)
            before = spent()
            for _ in range(times):
                run()
            each[name] = min(each[name], (spent() - before) * share / (times * job.count))
    return Found(job, each, told, [] if job.by["vedette"] is command else costliest(runs["vedette"]))


def costliest(run: Run) -> list[str]:
    """Return the five functions in which most of the time is spent, with their share."""
    profile = cProfile.Profile(process_time)
    for _ in range(5):
        profile.runcall(run)
    stats: Any = pstats.Stats(profile)
    total = sum(row[2] for row in stats.stats.values())
    first = sorted(stats.stats.items(), key=lambda item: -item[1][2])[:5]
    return [f"{_named(*place)} {row[2] / total:.0%}" for place, row in first]


def _named(path: str, line: int, name: str) -> str:
    if path == "~":
        return f"`{name.removeprefix('<built-in method ').removesuffix('>')}`"
    return f"`{Path(path).stem}.{name}`"


NAMES = {"vedette": "Vedette", "filterpy": "FilterPy", "stonesoup": "Stone Soup"}


def report(found: list[Found]) -> str:
    """Return the tables."""
    rows, targets, lines = [], [], []
    for one in found:
        us = {name: 1e6 * seconds for name, seconds in one.seconds.items()}
        rows.append([f"{one.job.title}, {one.job.unit}", *(digits(us[name]) if name in us else "" for name in NAMES)])
        for name, most in one.job.most.items():
            if name in us:
                ratio = us["vedette"] / us[name]
                against = f"{one.job.title}: Vedette / {NAMES[name]}"
                targets.append([against, quotient(ratio), quotient(most), verdict(ratio <= most)])
        if one.lines:
            lines.append(f"- {one.job.title}: {', '.join(one.lines)}")
    told = "\n".join(f"- {line}" for one in found for line in one.told)
    parts = [
        grid(["us", *NAMES.values()], rows),
        grid(["what", "measured", "at most", ""], targets) if targets else "",
        "Where Vedette's time goes, by `cProfile`, which counts calls of Python too dear:\n\n" + "\n".join(lines)
        if lines
        else "",
        told,
    ]
    return "\n\n".join(part for part in parts if part)


def write(text: str, page: Path) -> None:
    """Put `text` between the markers of a page."""
    before, _, rest = page.read_text().partition(BEGIN)
    page.write_text(f"{before}{BEGIN}\n\n{text}\n\n{END}{rest.partition(END)[2]}")


def table(words: str = "", rounds: int = 7, to: Path | None = None) -> str:
    """Measure the jobs whose title has these words; return the tables, and write them into a page if one is given."""
    chosen = [job for job in JOBS if words.lower() in job.title.lower()]
    text = report([measure(job, rounds) for job in chosen]) if chosen else ""
    if to is not None and text:
        write(text, to)
    return text


if __name__ == "__main__":
    os.environ.setdefault("OPENBLAS_NUM_THREADS", "1")
    parser = argparse.ArgumentParser("python -m benchmarks.users", description=__doc__)
    parser.add_argument("--only", default="", metavar="WORDS", help="jobs whose title has these words")
    parser.add_argument("--rounds", type=int, default=7)
    parser.add_argument("--write", action="store_true", help="write the table into docs/measured/speed.md")
    options = parser.parse_args()
    print(table(options.only, options.rounds, ROOT / "docs" / "measured" / "speed.md" if options.write else None))
