"""The study of the paper on the target-oriented velocity."""

from __future__ import annotations

from collections.abc import Mapping
from functools import cache
from typing import Any, ClassVar, final

import numpy as np
from attrs import frozen

from vedette import Experiment, Gaussian, Progress, Reproduction, Space, load
from vedette.metrics import nees
from vedette.progress import silent
from vedette_report.findings import Claim, Element, Findings, Keep, afresh, squared_distances
from vedette_study.lockstep import run_together
from vedette_study.panels import mean_over_runs
from vedette_study.scenes import around_path
from vedette_study.starts import over_axes, two_point
from vedette_target_oriented import accelerations, outcome, processes, verdicts
from vedette_target_oriented.configs import FILTERS, filters
from vedette_target_oriented.elements import ELEMENTS
from vedette_target_oriented.outcome import Record, Scene
from vedette_target_oriented.resets import cartesian, in_frame

PLANE = Space.of(x="m", y="m", vx="m/s", vy="m/s")
REST = {"ax": (0.0, 10.0), "ay": (0.0, 10.0)}
"""What two returns do not determine: axis to [mean, standard deviation]."""
REACH = 1000.0
"""In m; clutter is drawn this far around the target on each axis: what is farther is outside every gate."""
RUNS_PER_TRAJECTORY = 15
"""Monte Carlo runs of section 4.3 per trajectory of section 4.1, whose paper has one."""


@final
@frozen
class TargetOrientedReproduction(Reproduction):
    """Section 4.1: accelerations along axes and along the velocity; section 4.3: five IMM-PDAFs on one turning aircraft.

    Yoon, Ko, a manoeuvring target tracking algorithm with a target-oriented velocity representation (in Korean).
    """

    kind: ClassVar[str] = "target_oriented"
    title: ClassVar[str] = "Target-oriented velocity in an IMM-PDAF, against Singer models and known turn rates"
    default_runs: ClassVar[int] = 1200
    full_runs: ClassVar[int] = 12000
    grid_runs: ClassVar[int] = 1200
    unsaid: ClassVar[Mapping[str, Mapping[str, float]]] = {
        "s of acceleration": {"5 s": 5.0, "10 s": 10.0, "20 s": 20.0},
        "process noises": {"half": 0.5, "as chosen": 1.0, "double": 2.0},
        "P_D": {"P_D 1": 1.0, "P_D .98": 0.98, "P_D .95": 0.95},
    }
    elements: ClassVar[tuple[Element, ...]] = ELEMENTS

    def run(self, runs: int, seed: int, progress: Progress, keep: Keep = afresh) -> Findings:
        """Run all filters on the same draws."""
        scene, records = _tracked(FILTERS, runs, seed, progress)
        count = max(2, runs // RUNS_PER_TRAJECTORY)
        moved = _moved(count, seed)
        tables = (*outcome.tables(records), *processes.tables(moved))
        tracked = verdicts.claims(verdicts.figures(records), runs)
        moving = processes.claims(processes.figures(moved), count)
        charts = (*outcome.charts(scene, records, tables[0], tracked), *processes.charts(moved, moving))
        return Findings(self.title, runs, seed, tables, (*tracked, *moving), charts)

    def claims_at(self, point: Mapping[str, str], runs: int, seed: int) -> tuple[Claim, ...]:
        """Return the claims with their verdicts at one point of the grid."""
        seconds, noise, detection = (values[point[name]] for name, values in self.unsaid.items())
        return (*_tracking(noise, detection, runs, seed), *_moving(seconds, max(2, runs // RUNS_PER_TRAJECTORY), seed))


@cache  # no parameter of section 4.1 enters section 4.3, nor the other way
def _tracking(noise: float, detection: float, runs: int, seed: int) -> tuple[Claim, ...]:
    _, records = _tracked(filters(noise, detection), runs, seed, silent)
    return verdicts.claims(verdicts.figures(records), runs)


@cache
def _moving(seconds: float, count: int, seed: int) -> tuple[Claim, ...]:
    return processes.claims(processes.figures(_moved(count, seed, seconds)), count)


def _tracked(
    configs: Mapping[str, Mapping[str, Any]], runs: int, seed: int, progress: Progress
) -> tuple[Scene, dict[str, Record]]:
    experiments = {name: load(config) for name, config in configs.items()}
    scene = draw(next(iter(experiments.values())), runs, np.random.default_rng(seed).spawn(2)[0])
    return scene, {name: record(experiments[name], scene) for name in progress(list(configs), "filters")}


def _moved(count: int, seed: int, seconds: float = 10.0) -> dict[str, accelerations.Measured]:
    rng = np.random.default_rng(seed).spawn(2)[1]
    return {name: accelerations.measured(part) for name, part in accelerations.study(count, rng, seconds).items()}


def draw(experiment: Experiment, runs: int, rng: np.random.Generator) -> Scene:
    """Draw the aircraft's trajectory and the radar's scans in each run; the first two scans hold the target alone."""
    assert experiment.source is not None
    source: Any = experiment.source
    path = experiment.source.open(experiment.tracker.sensors, rng).truth[0]
    moments = around_path(path, {"radar": source.sensors["radar"]}, runs, REACH, rng)
    return Scene(path.times, path.states, tuple(scan for (scan,) in moments))


def record(experiment: Experiment, scene: Scene) -> Record:
    """Run one filter on all runs; it starts from the first two returns."""
    tracker = experiment.tracker
    (sensor,) = tracker.sensors.values()
    first, second = [sensor.invert(scan.detections.z[:, 0]) for scan in scene.scans[:2]]
    prior = two_point(first, second, scene.times[1] - scene.times[0])
    if "heading" in tracker.state:
        given = in_frame(prior, first.mean[:, None, :])
    else:
        given = over_axes(prior, PLANE, tracker.state, REST)
    runs = run_together(tracker, given, scene.times[1], scene.scans[2:])
    estimate = cartesian(runs.space, Gaussian(runs.mean, runs.cov))
    error = estimate.mean - scene.truth[2:]
    assert runs.mode_prob is not None
    return Record(
        squared_distances(error),
        nees(error, estimate.cov),
        runs.nis,
        estimate.mean[0, :, :2],
        *mean_over_runs(runs.mode_prob),
    )
