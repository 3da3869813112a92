"""The study of the paper on Bayes-risk detection."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from functools import cache, partial
from typing import ClassVar, TypeVar, final

import numpy as np
from attrs import frozen

from vedette import Array, Experiment, Gaussian, Mask, Progress, Reproduction, Scan, Space, Trajectory, load
from vedette.metrics import nees
from vedette.tracking import preprocessed, raw_sensors
from vedette_bayes_risk import outcome, verdicts
from vedette_bayes_risk.configs import BEYOND, CONTESTED, FILTERS, SENSORS, UNGATED, Choice
from vedette_bayes_risk.elements import ELEMENTS
from vedette_bayes_risk.outcome import LOST, Contest, Record
from vedette_report.findings import Claim, Element, Findings, Keep, afresh, squared_distances
from vedette_study.lockstep import run_together
from vedette_study.panels import mean_over_runs
from vedette_study.scenes import around_path
from vedette_study.starts import over_axes, two_point

R = TypeVar("R")
PLANE = Space.of(x="m", y="m", vx="m/s", vy="m/s")
REST = {"ax": (0.0, 2.0), "ay": (0.0, 2.0)}
REACH, DENSE_REACH, ALL = 1000.0, 300.0, 3976.0
"""In m; clutter is drawn this far around the target on each axis: farther returns reach no gate. Without one, over
63 km^2, as much as the scene's clutter has."""


@final
@frozen
class BayesRiskReproduction(Reproduction):
    """Seven sensors on one target: the proposed filter, an IMM with multi-sensor PDA, the printed forms in dense clutter.

    Kim, Choi, Ahn, Ko, on using Bayes risk for data association (in Korean).
    """

    kind: ClassVar[str] = "bayes_risk"
    title: ClassVar[str] = "Detection over seven sensors by Bayes risk, and parallel Kalman filters, against IMM/MSPDA"
    default_runs: ClassVar[int] = 500
    full_runs: ClassVar[int] = 5000
    grid_runs: ClassVar[int] = 150
    unsaid: ClassVar[Mapping[str, Mapping[str, float]]] = {
        "sigma": {"5 m": 5.0, "6.7 m": 6.7, "9 m": 9.0},
        "process noises": {"half": 0.5, "as chosen": 1.0, "double": 2.0},
        "threshold": {"3 sigma": 3.0, "4 sigma": 4.0, "5 sigma": 5.0},
    }
    elements: ClassVar[tuple[Element, ...]] = ELEMENTS

    def run(self, runs: int, seed: int, progress: Progress, keep: Keep = afresh) -> Findings:
        """Run all filters of a part on the same draws; a tenth of the runs without a gate, half of them in dense clutter."""
        first, second, third = np.random.default_rng(seed).spawn(3)
        parts = {"sparse": FILTERS | BEYOND, "no gate": UNGATED, "dense": CONTESTED}
        experiments = {name: load(config) for part in parts.values() for name, config in part.items()}
        decision = {"decision": load(Choice().proposed("bayes_risk_decision", "kalman"))}
        dense = max(2, runs // 2)
        drawn = {
            "sparse": cache(lambda: draw(experiments["proposed"], runs, REACH, first)),
            "no gate": cache(lambda: draw(experiments["proposed"], max(2, runs // 10), ALL, third)),
            "dense": cache(lambda: draw(experiments[next(iter(CONTESTED))], dense, DENSE_REACH, second)),
        }
        records: dict[str, Record] = {}
        contests: dict[str, Contest] = {}
        work = [(part, name) for part, configs in parts.items() for name in configs]
        for part, name in progress(work, "filters"):
            made, scene = experiments[name], drawn[part]
            if part == "dense":
                contests[name] = keep(name, Contest, partial(_called, contest, made, scene))
            else:
                records[name] = keep(name, Record, partial(_called, record, made, scene))
        free = {name: records.pop(name) for name in UNGATED}
        tables = outcome.tables(records, free, contests, experiments | decision)
        claims = verdicts.claims(verdicts.figures(records, contests, experiments), runs, dense)
        charts = outcome.charts(path(experiments["proposed"], np.random.default_rng(0)).states, records, tables, claims)
        return Findings(self.title, runs, seed, tables, claims, charts)

    def claims_at(self, point: Mapping[str, str], runs: int, seed: int) -> tuple[Claim, ...]:
        """Return the claims with their verdicts at one point of the grid."""
        sigma, noise, reach = (values[point[name]] for name, values in self.unsaid.items())
        choice = Choice(sigma, reach, noise)
        first, second = np.random.default_rng(seed).spawn(2)
        clear, crowded = choice.filters(), choice.contested()
        judged = [f"{weights} weights, {form}" for weights in ("printed", "corrected") for form in verdicts.FORMS]
        experiments = {name: load(config) for name, config in (clear | crowded).items()}
        scene = draw(experiments["proposed"], runs, REACH, first)
        crowd = draw(experiments[judged[0]], runs, DENSE_REACH, second)
        records = {name: record(experiments[name], *scene) for name in clear}
        contests = {name: contest(experiments[name], *crowd) for name in judged}
        return verdicts.claims(verdicts.figures(records, contests, experiments), runs, runs)


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
    moments = around_path(flown, {name: sensors[name] for name in SENSORS}, runs, reach, rng)
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
