"""The study of the paper on Bayes-risk detection."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from functools import cache, partial
from typing import ClassVar, TypeVar, final

import numpy as np
from attrs import frozen

from vedette import Array, Experiment, Gaussian, Mask, Progress, Reproduction, Scan, Space, Trajectory, load
from vedette.metrics import nees
from vedette.reproduction import Findings, Keep, afresh, squared_distances
from vedette.sampling import Bounds, draw_detections
from vedette.tracking import preprocessed, raw_sensors
from vedette_bayes_risk import outcome, verdicts
from vedette_bayes_risk.configs import CONTESTED, FILTERS, SENSORS
from vedette_bayes_risk.outcome import Contest, Record
from vedette_study.lockstep import run_together
from vedette_study.panels import mean_over_runs
from vedette_study.starts import over_axes, two_point

R = TypeVar("R")
PLANE = Space.of(x="m", y="m", vx="m/s", vy="m/s")
REST = {"ax": (0.0, 2.0), "ay": (0.0, 2.0)}
REACH, DENSE_REACH = 1000.0, 300.0
"""In m; clutter is drawn this far around the target on each axis: farther returns reach no gate."""
LOST = 100.0
"""In m; where returns compete, a run with a larger error is lost and left out."""


@final
@frozen
class BayesRiskReproduction(Reproduction):
    """Seven sensors on one target: the proposed filter, an IMM with multi-sensor PDA, the printed forms in dense clutter.

    Kim, Choi, Ahn, Ko, on using Bayes risk for data association (in Korean).
    """

    kind: ClassVar[str] = "bayes_risk"
    title: ClassVar[str] = "Detection over seven sensors by Bayes risk, and parallel Kalman filters, against IMM/MSPDA"
    default_runs: ClassVar[int] = 1000
    full_runs: ClassVar[int] = 10000
    contributions: ClassVar[Mapping[str, tuple[str, ...]]] = {
        "detection over several sensors by Bayes risk, equations 1 to 5": ("preprocessor bayes_risk_detection",),
        "the same as equations 2 and 4 are printed": ("preprocessor bayes_risk_printed",),
        "its likelihood L(k) as weight of a return, equation 5": ("associator bayes_risk",),
        "parallel Kalman filters, equation 6": ("estimator kalman",),
        "the same as equation 6 is printed": ("estimator parallel_kalman_printed",),
        "the same counts as a likelihood ratio, not in the paper": ("preprocessor count_likelihood_detection",),
        "IMM/MSPDA, what it is compared with": ("estimator imm", "associator pda"),
    }

    def run(self, runs: int, seed: int, progress: Progress, keep: Keep = afresh) -> Findings:
        """Run all filters of a part on the same draws."""
        first, second = np.random.default_rng(seed).spawn(2)
        experiments = {name: load(config) for name, config in (FILTERS | CONTESTED).items()}
        dense = max(2, runs // 2)
        scene = cache(lambda: draw(experiments["proposed"], runs, REACH, first))
        crowd = cache(lambda: draw(experiments[next(iter(CONTESTED))], dense, DENSE_REACH, second))
        records: dict[str, Record] = {}
        contests: dict[str, Contest] = {}
        for name in progress([*FILTERS, *CONTESTED], "filters"):
            made = experiments[name]
            if name in FILTERS:
                records[name] = keep(name, Record, partial(_called, record, made, scene))
            else:
                contests[name] = keep(name, Contest, partial(_called, contest, made, crowd))
        tables = outcome.tables(records, contests, experiments)
        claims = verdicts.claims(verdicts.figures(records, contests, experiments), runs, dense)
        charts = outcome.charts(path(experiments["proposed"], np.random.default_rng(0)).states, records, tables, claims)
        return Findings(self.title, runs, seed, tables, claims, charts)


Scene = tuple[Array, Array, Sequence[Sequence[Scan]]]


def _called(judge: Callable[..., R], experiment: Experiment, scene: Callable[[], Scene]) -> R:
    return judge(experiment, *scene())


def path(experiment: Experiment, rng: np.random.Generator) -> Trajectory:
    """Return the target's true trajectory."""
    assert experiment.source is not None
    return experiment.source.open(raw_sensors(experiment.preprocessors, experiment.tracker.sensors), rng).truth[0]


def draw(experiment: Experiment, runs: int, reach: float, rng: np.random.Generator) -> Scene:
    """Draw the target's states (s, 4) and times (s,), and all sensors' scans at each time; the first two without clutter."""
    sensors = raw_sensors(experiment.preprocessors, experiment.tracker.sensors)
    flown = path(experiment, rng)
    moments = []
    for i, (time, state) in enumerate(zip(flown.times, flown.states, strict=True)):
        around = {name: Bounds(spot - reach, spot + reach) for name, spot in zip("xy", state[:2], strict=True)}
        x = np.broadcast_to(state[:2], (runs, 1, 2))
        moments.append(
            [Scan(float(time), name, draw_detections(sensors[name], x, rng, around if i > 1 else None)) for name in SENSORS]
        )
    return flown.states, flown.times, moments


def _prior(experiment: Experiment, moments: Sequence[Sequence[Scan]]) -> Gaussian:
    """Return the prior from the base sensor's first two returns, the same for all filters."""
    base = next(iter(raw_sensors(experiment.preprocessors, experiment.tracker.sensors).values()))
    spots = [base.invert(scans[0].detections.z[:, 0]) for scans in moments[:2]]
    return over_axes(two_point(spots[0], spots[1], 1.0), PLANE, experiment.tracker.state, REST)


def _scans(experiment: Experiment, moments: Sequence[Sequence[Scan]]) -> list[Scan]:
    return list(preprocessed((scan for scans in moments[2:] for scan in scans), experiment.preprocessors))


def record(experiment: Experiment, truth: Array, times: Array, moments: Sequence[Sequence[Scan]]) -> Record:
    """Run one filter on all runs, judged after the last scan of each time."""
    tracker = experiment.tracker
    runs = run_together(tracker, _prior(experiment, moments), times[1], _scans(experiment, moments))
    last = np.flatnonzero(np.append(np.diff(runs.times) > 0, True))
    axes = runs.space.locate(PLANE)
    error = runs.mean[:, last][..., axes] - truth[2:]
    modes = (None, None) if runs.mode_prob is None else mean_over_runs(runs.mode_prob[:, last])
    return Record(
        squared_distances(error),
        nees(error, runs.cov[:, last][..., axes, :][..., axes]),
        runs.mean[0, last][:, axes[:2]],
        *modes,
    )


def contest(experiment: Experiment, truth: Array, times: Array, moments: Sequence[Sequence[Scan]]) -> Contest:
    """Run one variant in dense clutter: squared position errors over their covariances, and where returns competed."""
    tracker = experiment.tracker
    state = tracker.start(_prior(experiment, moments), times[1])
    error, size, rivals = [], [], []
    for scan, true in zip(_scans(experiment, moments), truth[2:], strict=True):
        state = tracker.step(state, scan)
        estimate = tracker.estimate(state)
        apart = estimate.mean[:, 0, :2] - true[:2]
        error.append(np.sum(apart**2, axis=-1))
        size.append(nees(apart, estimate.cov[:, 0, :2, :2]))
        rivals.append(np.sum(state.weights[:, 0, 1:] > 0, axis=-1))
    squares = np.stack(error, axis=1)
    kept: Mask = np.max(squares, axis=1) < LOST**2
    return Contest(np.stack(size, axis=1), np.stack(rivals, axis=1), kept)
