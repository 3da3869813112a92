"""What smoothing adds to a run's results: its tracks, and its figures beside the filter's."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from io import BytesIO
from pathlib import Path
from typing import Any

import numpy as np
from attrs import frozen

from vedette import (
    Array,
    ConfigError,
    Experiment,
    Gaussian,
    HypothesisAssociator,
    Result,
    Scan,
    Track,
    Trajectory,
    smooth,
    smoothed,
)
from vedette.metrics import ENTRIES, SCANS, RunningJudge, Score
from vedette.tracking import from_the_start
from vedette.units import in_unit
from vedette_files import (
    Column,
    Series,
    SeriesFile,
    Terms,
    below,
    full_covariances,
    triangles,
    write_tracks_csv,
    write_tracks_jsonl,
)
from vedette_files.writing import whole_bytes
from vedette_report.series.judged import judged
from vedette_report.series.recorder import Recorded, Recorder, SmoothedSteps
from vedette_report.series.tables import together

_COMPARED = (
    ("position RMSE [{unit}]", "position_rmse_m"),
    ("velocity RMSE [{unit}/s]", "velocity_rmse_mps"),
    ("coverage", "coverage"),
    ("GOSPA [{unit}]", "gospa_m"),
    ("NEES of the position", "nees_position"),
)
"""Figures that smoothing changes; identities, existence and NIS stay the filter's."""


@frozen(eq=False)
class Smoothed:
    """Tracks that use the scans of up to `lag` s later, their score, and the content of `smoothed.npz`."""

    lag: float
    tracks: tuple[Track, ...]
    score: Score
    packed: bytes


def read_lag(text: str) -> float:
    """Return the lag in s of the command line, "" for the whole recording; ConfigError says what would be right."""
    if not text:
        return math.inf
    try:
        lag = in_unit(text, "s")
        if not 0 <= lag < math.inf:
            raise ValueError(f"must be >= 0 s, got {text!r}")
    except ValueError as error:
        raise ConfigError.at("--smooth", str(error)) from None
    return lag


def smooth_result(experiment: Experiment, recorded: Recorded, lag: float) -> Smoothed:
    """Smooth a run whose states were kept, and judge it as the filter is judged."""
    result = recorded.result
    if isinstance(experiment.tracker.associator, HypothesisAssociator):
        return _retold(experiment, result, lag)
    tracks = smooth(experiment.tracker, result.states, lag, experiment.seed)
    if experiment.retroactive:
        tracks = tuple(map(from_the_start, tracks))
    score, packed = smoothed_series(recorded.series(), experiment, result.scans, result.recording.truth, tracks)
    return Smoothed(lag, tracks, score, packed)


def _retold(experiment: Experiment, result: Result, lag: float) -> Smoothed:
    """Smooth a run that kept hypotheses: later scans say which tracks there were, too."""
    tracker, packed = experiment.tracker, BytesIO()
    before = tracker.start()
    recorder = Recorder(packed, experiment, SmoothedSteps(result.recording, before))
    told = smoothed(tracker, result.states, lag, experiment.seed)
    for scan, filtered, state in zip(result.scans, result.states, told, strict=True):
        recorder.add(scan, before, state, tracker.estimate(state), tracker.estimator.mode_prob(state.belief))
        before = filtered
    recorder.close()
    return Smoothed(lag, recorder.tracks.hand_out().tracks(), recorder.judge.score(), packed.getvalue())


def write_smoothed(folder: Path, experiment: Experiment, result: Result, smoothed: Smoothed) -> list[str]:
    """Write the tracks beside the filter's, in the terms of its recording, and their series; return the files' names."""
    folder.mkdir(parents=True, exist_ok=True)
    space, recording = experiment.tracker.state, result.recording
    write_tracks_csv(folder / "smoothed.csv", smoothed.tracks, space, Terms.of(recording.notes))
    write_tracks_jsonl(folder / "smoothed.jsonl", smoothed.tracks, space)
    with whole_bytes(folder / "smoothed.npz") as file:
        file.write(smoothed.packed)
    return ["smoothed.csv", "smoothed.jsonl", "smoothed.npz"]


def smoothed_figures(lag: float, score: Score) -> dict[str, Any]:
    """Return `lag_s`, null for the whole recording, and the figures that smoothing changes."""
    return {"lag_s": None if math.isinf(lag) else lag, **{name: getattr(score, name) for _, name in _COMPARED}}


def smoothed_summary(filtered: Score, smoothed: Score, lag: float, unit: str) -> str:
    """Return lines of text that compare the filter and the smoother; `unit` is that of positions."""
    later = "all later scans" if math.isinf(lag) else f"the scans of up to {lag:g} s later"
    lines = ["", f"Smoothed by {later}"]
    if filtered.coverage is None:
        return "\n".join([*lines, "  no truth to judge it by"]) + "\n"
    lines.append(f"  {'':<22}{'filtered':>10}{'smoothed':>10}")
    for title, name in _COMPARED:
        values = (getattr(score, name) for score in (filtered, smoothed))
        told = "".join(f"{'-' if value is None else format(value, '.3g'):>10}" for value in values)
        lines.append(f"  {title.format(unit=unit):<22}{told}")
    return "\n".join(lines) + "\n"


def smoothed_series(
    filtered: Series, experiment: Experiment, scans: Sequence[Scan], truth: Sequence[Trajectory], tracks: Sequence[Track]
) -> tuple[Score, bytes]:
    """Return the smoothed tracks' score, and `series.npz` of the run with their estimates.

    Returns, weights, gates, NIS and tentative tracks stay the filter's. `tracks` have the filter's scans.
    """
    tables: dict[str, dict[str, Column]] = {table: {**columns} for table, columns in filtered.tables.items()}
    n = len(experiment.tracker.state)
    entries, back = tables["entries"], tables["below"]
    mean, cov = entries["mean"].copy(), full_covariances(entries["cov"], back["entry"], back["place"], back["value"])
    for track in tracks:
        rows = np.flatnonzero(entries["track"] == track.id)
        mean[rows], cov[rows] = track.mean, track.cov
    flat = cov.reshape(-1, n * n)
    halves = below(flat, *triangles(n))
    entries |= {"mean": mean, "cov": flat[:, triangles(n)[0]]}
    tables["below"] = {"entry": halves.row, "place": halves.key.astype(np.int32), "value": halves.value}
    score, told = _judged(entries, cov, experiment, scans, truth)
    for table, columns in told.items():
        tables[table] |= columns
    packed = BytesIO()
    file = SeriesFile(packed, filtered.about)
    file.add(tables)
    file.flush()
    return score, packed.getvalue()


def _judged(
    entries: Mapping[str, Column], cov: Array, experiment: Experiment, scans: Sequence[Scan], truth: Sequence[Trajectory]
) -> tuple[Score, dict[str, dict[str, Column]]]:
    """Return the score of the estimates, and what the judge says of all scans, block by block."""
    tracker = experiment.tracker
    judge = RunningJudge(truth, tracker.state, experiment.judge, tracker.gate.probability)
    modes = entries["modes"] if entries["modes"].shape[1] else None
    first, parts, begin = np.searchsorted(entries["scan"], np.arange(len(scans) + 1)).tolist(), [], 0
    for i, scan in enumerate(scans):
        rows = slice(first[i], first[i + 1])
        estimate = Gaussian(entries["mean"][rows], cov[rows])
        figures = (entries["nis"][rows], entries["hit"][rows], None if modes is None else modes[rows])
        judge.add(scan, entries["track"][rows], entries["confirmed"][rows], estimate, *figures)
        if i + 1 - begin >= SCANS or first[i + 1] - first[begin] >= ENTRIES or i + 1 == len(scans):
            parts.append(judged(judge.finish_block(), i + 1 - begin, entries["confirmed"][first[begin] : first[i + 1]]))
            begin = i + 1
    return judge.score(), together(parts or [judged(None, 0, entries["confirmed"])])
