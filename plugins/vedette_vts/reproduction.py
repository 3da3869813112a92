"""The study of the paper on the radar of a vessel traffic service."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any, ClassVar, final

import numpy as np
from attrs import frozen

from vedette import Array, Detections, Experiment, Gaussian, Progress, Reproduction, Scan, Space, load
from vedette.metrics import nees
from vedette.progress import silent
from vedette.sampling import returns
from vedette.tracking import preprocessed, raw_sensors
from vedette_report.findings import Claim, Element, Findings, Keep, afresh, squared_distances
from vedette_study.lockstep import run_together
from vedette_study.panels import mean_over_runs
from vedette_study.starts import over_axes, two_point
from vedette_vts import outcome, verdicts
from vedette_vts.configs import FILTERS, NOISES, STAYS, SURGES, filters
from vedette_vts.elements import ELEMENTS
from vedette_vts.gating import watch
from vedette_vts.outcome import Record, Scene

PLANE = Space.of(x="m", y="m", vx="m/s", vy="m/s")
REST = {"ax": (0.0, 0.5), "ay": (0.0, 0.5)}
"""What two returns do not determine: axis to [mean, standard deviation]."""
LOST = 200.0
"""In m; a run whose last error is larger has lost its target."""


@final
@frozen
class VtsReproduction(Reproduction):
    """Four filters on one manoeuvring vessel: errors by leg, whether returns lie in the gate, and the influence of Q.

    Kim, Kim, Lee, design of a manoeuvring target tracking algorithm for VTS (in Korean).
    """

    kind: ClassVar[str] = "vts"
    title: ClassVar[str] = "Manoeuvring vessels seen by the radar of a vessel traffic service: IMM against single filters"
    default_runs: ClassVar[int] = 500
    full_runs: ClassVar[int] = 5000
    grid_runs: ClassVar[int] = 200
    unsaid: ClassVar[Mapping[str, Mapping[str, float]]] = {
        "speeding up and slowing down": SURGES,
        "q of all filters": NOISES,
        "IMM": STAYS,
    }
    elements: ClassVar[tuple[Element, ...]] = ELEMENTS

    def run(self, runs: int, seed: int, progress: Progress, keep: Keep = afresh) -> Findings:
        """Run all filters on the same draws."""
        scene, records = _records(FILTERS, runs, seed, progress)
        tables = outcome.tables(scene, records)
        claims = verdicts.claims(verdicts.figures(records), runs)
        return Findings(self.title, runs, seed, tables, claims, outcome.charts(scene, records, tables[0], claims))

    def claims_at(self, point: Mapping[str, str], runs: int, seed: int) -> tuple[Claim, ...]:
        """Return the claims with their verdicts at one point of the grid."""
        surges, noise, stay = (values[point[name]] for name, values in self.unsaid.items())
        _, records = _records(filters(int(surges), noise, stay), runs, seed, silent)
        return verdicts.claims(verdicts.figures(records), runs)


def _records(
    configs: Mapping[str, Mapping[str, Any]], runs: int, seed: int, progress: Progress
) -> tuple[Scene, dict[str, Record]]:
    experiments = {name: load(config) for name, config in configs.items()}
    scene = draw(next(iter(experiments.values())), runs, np.random.default_rng(seed))
    return scene, {name: record(experiments[name], scene) for name in progress(list(configs), "filters")}


def draw(experiment: Experiment, runs: int, rng: np.random.Generator) -> Scene:
    """Draw the vessel's trajectory, and the radar's returns in each run."""
    ((name, radar),) = raw_sensors(experiment.preprocessors, experiment.tracker.sensors).items()
    assert experiment.source is not None
    recording = experiment.source.open({name: radar}, rng)
    times = np.array([scan.time for scan in recording.scans])
    path = recording.truth[0]
    truth = path.states[np.searchsorted(path.times, times)]
    x = np.broadcast_to(truth[:, :2], (runs, len(truth), 2))
    z, _ = returns(radar, x, rng.random(x.shape[:-1]), rng.standard_normal(x.shape))
    valid = np.ones((runs, 1), dtype=bool)
    raw = [Scan(float(time), name, Detections(z[:, [i]], valid)) for i, time in enumerate(times)]
    return Scene(times, truth, tuple(preprocessed(raw, experiment.preprocessors)))


def record(experiment: Experiment, scene: Scene) -> Record:
    """Run one filter on one batch of runs from the first two returns; its errors count from the third scan."""
    tracker, scans = experiment.tracker, scene.scans[2:]
    first, second = [Gaussian(scan.detections.z[:, 0], _noise(scan)) for scan in scene.scans[:2]]
    prior = two_point(first, second, scene.times[1] - scene.times[0])
    given = over_axes(prior, PLANE, tracker.state, REST)
    (sensor,) = tracker.sensors.values()
    free = watch(tracker.estimator, sensor, given, scene.times[1], scans)
    gated = run_together(tracker, given, scene.times[1], scans)
    axes = tracker.state.locate(PLANE)
    error = free.mean[..., axes] - scene.truth[2:]
    modes = (None, None) if free.mode_prob is None else mean_over_runs(free.mode_prob)
    return Record(
        squares=squared_distances(error),
        distance=free.distance,
        nis=free.nis,
        nees=nees(error, free.cov[..., axes, :][..., axes]),
        lost=np.sqrt(squared_distances(gated.mean[:, -1, axes] - scene.truth[-1])) > LOST,
        path=free.mean[0][:, axes[:2]],
        modes=modes[0],
        modes_doubt=modes[1],
    )


def _noise(scan: Scan) -> Array:
    assert scan.detections.noise is not None
    return scan.detections.noise[:, 0]
