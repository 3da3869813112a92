"""The smallest piece of work: some runs of one point of the grid, in lock-step if possible, else one by one."""

from __future__ import annotations

from collections.abc import Sequence
from functools import cache

import numpy as np
from attrs import frozen

from vedette import Array, ConfigError, Detections, Experiment, Gaussian, Mask, Recording, Scan, Space, Trajectory
from vedette.config import installed_figures
from vedette.metrics import FIGURES, Figure, gate_of, gate_truncation, judge, nees, positions, velocities
from vedette.sampling import NotInLockStep
from vedette_report.figures import forgiven_figures
from vedette_standard.whole_tracks import bound_along
from vedette_study.lockstep import run_together
from vedette_study.redraw import Redraw
from vedette_study.scenes import DrawsTogether, Scenes
from vedette_study.seeds import RunSeeds, sequence

SERIES = ("square", "nees", "nis")
"""What is kept against time: squared position error in m^2, NEES over the number of axes, NIS over its expectation."""
APPROXIMATED = Figure("approximated", "1", "times that a track's weights were not exact", study="approximated")


@cache
def study_figures() -> dict[str, Figure]:
    """Return all figures of a study, by their names in studies: the judge's, those of plugins, and what was not exact."""
    return {figure.study: figure for figure in (*FIGURES, *installed_figures(), APPROXIMATED) if figure.study}


@frozen(eq=False)
class Chunk:
    """The result of some runs: `figures` name to (r,), NaN if there is none; `times` (s,) and sums over runs (3, 5, s).

    A series is a ratio of two sums, of v over e (1 but for the NIS, where it is the expectation). The five are the sums of
    v, v^2, e, e^2 and v e: enough for the ratio and its standard error, however the runs are split. `made` names the
    code that made it.
    """

    figures: dict[str, Array]
    times: Array
    sums: Array
    made: str = ""


def run_chunk(experiment: Experiment, seed: int, runs: Sequence[int], together: bool, redraw: Redraw | None = None) -> Chunk:
    """Run the runs of one point of the grid, in lock-step or one by one. ConfigError if it cannot be run.

    `redraw` is what each run draws of a recording; a source that draws is left alone.
    """
    seeds = RunSeeds(seed, tuple(runs))
    return _together(experiment, seeds) if together else _one_by_one(experiment, seeds, redraw)


def recorded(experiment: Experiment) -> bool:
    """Return whether the scans come from a recording: whatever the seed, they are the same."""
    return experiment.source is not None and not experiment.source.draws


def goes_together(experiment: Experiment) -> bool:
    """Return whether the runs of an experiment can go in lock-step. ConfigError if its scene cannot be drawn.

    Three runs are tried up to the first time step. Two would not do: an estimator may draw pairs for all runs at once.
    """
    seeds = RunSeeds(0, (0, 1, 2))
    try:
        given, scenes = _opened(experiment, seeds)
        begin = scenes.scans[0].time
        some = 1 + next((i for i, scan in enumerate(scenes.scans) if scan.time > begin), 0)
        run_together(experiment.tracker, given, begin, scenes.scans[:some], seeds.child(1))
    except NotInLockStep:
        return False
    return True


def _opened(experiment: Experiment, seeds: RunSeeds) -> tuple[Gaussian, Scenes]:
    """Return priors and scenes. NotInLockStep if a run may have several tracks or a source that draws run by run."""
    tracker, source = experiment.tracker, experiment.source
    if tracker.starters or experiment.preprocessors or not isinstance(source, DrawsTogether):
        raise NotInLockStep("several tracks, preprocessors, or a source that draws run by run")
    try:
        scenes = source.open_together(tracker.sensors, seeds.generators())
    except ConfigError as error:
        raise error.within("source") from None
    if scenes is None:
        raise NotInLockStep("a scene that is drawn run by run")
    return _given(experiment, scenes), scenes


def _together(experiment: Experiment, seeds: RunSeeds) -> Chunk:
    """Run the runs in lock-step."""
    (given, scenes), tracker, judged = _opened(experiment, seeds), experiment.tracker, experiment.judge
    runs = run_together(tracker, given, scenes.scans[0].time, scenes.scans, seeds.child(1))
    common = [name for name in scenes.space.names if name in runs.space]
    columns = [runs.space.names.index(name) for name in common]
    space = Space(tuple(runs.space.axes[i] for i in columns))
    true = scenes.states[..., [scenes.space.names.index(name) for name in common]]
    error = space.difference(true, runs.mean[..., columns])
    spot, speed = positions(space), velocities(space)
    square, fast = (np.sum(error[..., axes] ** 2, axis=-1) if axes else error[..., 0] * np.nan for axes in (spot, speed))
    axes = np.array([scan.detections.z.shape[-1] for scan in scenes.scans])
    expected = (
        runs.hit * axes * gate_truncation(axes, np.array([gate_of(scan, tracker.gate.probability) for scan in scenes.scans]))
    )
    cov = runs.cov if len(columns) == len(runs.space) else runs.cov[..., columns, :][..., columns]
    squares = _nees(error, cov) / max(len(columns), 1)
    figures = {
        "position_rmse": np.mean(square, axis=1),
        "velocity_rmse": np.mean(fast, axis=1),
        "nees": np.mean(squares, axis=1),
        "nis": _over(np.sum(runs.nis, axis=1), np.sum(expected, axis=1)),
        "lost": _lost(square > (judged.lost_error or judged.cover_radius) ** 2, judged.lost_scans),
    }
    if judged.bound is not None:
        lowest = bound_along(judged.bound, tracker.sensors, scenes.scans, np.swapaxes(scenes.states, 0, 1), scenes.space)
        if lowest is not None:
            spot = positions(judged.bound.motion.state)
            figures["position_bound"] = np.mean(np.sum(lowest[..., spot, spot], axis=-1), axis=0)
    one = np.ones_like(square)
    sums = [_sums(v, e) for v, e in ((square, one), (squares, one), (runs.nis, expected))]
    return Chunk(figures, runs.times, np.array(sums))


def _sums(v: Array, e: Array) -> list[Array]:
    """Return the five sums of Chunk: (r, s) -> five of (s,)."""
    one = np.ones_like(v)
    return [np.einsum("rs,rs->s", a, b) for a, b in ((v, one), (v, v), (e, one), (e, e), (v, e))]


def _given(experiment: Experiment, scenes: Scenes) -> Gaussian:
    """Return the tracker's prior in each run: (r, 1, n). NotInLockStep if it is not one track."""
    states = scenes.states[:, 0]
    alike = _prior(experiment, scenes, np.full_like(states[0], np.nan))
    if np.all(np.isfinite(alike.mean)) and np.all(np.isfinite(alike.cov)):  # the prior does not depend on the truth
        priors = [alike]
    else:
        priors = [_prior(experiment, scenes, state) for state in states]
    mean, cov = np.stack([one.mean for one in priors]), np.stack([one.cov for one in priors])
    r = len(states)
    return Gaussian(np.broadcast_to(mean, (r, *mean.shape[1:])), np.broadcast_to(cov, (r, *cov.shape[1:])))


def _prior(experiment: Experiment, scenes: Scenes, state: Array) -> Gaussian:
    """Return the tracker's prior if the truth starts at `state` (n,)."""
    tracker, time, sensor = experiment.tracker, scenes.scans[0].time, scenes.scans[0].sensor
    truth = Trajectory("", scenes.space, np.array([time]), state[None])
    try:
        prior = tracker.given(Recording((Scan(time, sensor, Detections.of([], 1)),), (truth,)))
    except ValueError as error:
        raise ConfigError.at("", str(error)) from None
    if prior is None or len(prior.mean) != 1:
        raise NotInLockStep("a birth that does not start with one track")
    return prior


def _nees(error: Array, cov: Array) -> Array:
    """Return the NEES (r, s); NaN where a covariance is singular."""
    try:
        return nees(error, cov)
    except ValueError:
        return np.full(error.shape[:-1], np.nan)


def _over(total: Array, expected: Array) -> Array:
    return np.divide(total, expected, out=np.full(np.shape(total), np.nan), where=expected > 0)


def _lost(far: Mask, scans: int) -> Array:
    """Return whether a run is farther off than allowed for so many successive scans (r,)."""
    counts = np.cumsum(np.pad(far, ((0, 0), (1, 0))), axis=1)
    return np.any(counts[:, scans:] - counts[:, :-scans] == scans, axis=1).astype(float)


def _one_by_one(experiment: Experiment, seeds: RunSeeds, redraw: Redraw | None) -> Chunk:
    """Run each run by itself, as `vedette run` does, judged against its truth."""
    rows, known = [], study_figures()
    redraw = redraw if recorded(experiment) else None
    for run in seeds.runs:
        result = experiment.run(seeds=sequence(seeds.seed, run), redraw=redraw)
        if result.interrupted:
            raise KeyboardInterrupt
        tracker, truth, options = experiment.tracker, result.recording.truth, experiment.judge
        gate, further = tracker.gate.probability, forgiven_figures()
        nobody = result.recording.nobody
        told = judge(result.tracks, truth, result.scans, options, gate, tracker.sensors, further, nobody).figures()
        rows.append([told.get(figure.name) for figure in known.values()][:-1] + [result.approximated])
    table = np.array([[np.nan if value is None else float(value) for value in row] for row in rows]).T
    figures = {name: row**2 if known[name].squared else row for name, row in zip(known, table, strict=True)}
    return Chunk(figures, np.zeros(0), np.zeros((3, 5, 0)))
