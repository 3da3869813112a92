"""The series of smoothed tracks: those of the run, with the smoothed estimates and what the judge says of these."""

from __future__ import annotations

from collections.abc import Sequence
from io import BytesIO
from typing import Any

import numpy as np

from vedette.experiment import Experiment
from vedette.metrics import RunningJudge
from vedette.types import Gaussian, Scan, Track, Trajectory
from vedette_files import Column, Series, SeriesFile
from vedette_report.series_judged import judged


def smoothed_series(
    filtered: Series, experiment: Experiment, scans: Sequence[Scan], truth: Sequence[Trajectory], tracks: Sequence[Track]
) -> bytes:
    """Return `series.npz` of a run with smoothed estimates; returns, weights, gates and NIS stay the filter's."""
    tables = {table: dict(columns) for table, columns in filtered.tables.items()}
    entries, triangle = tables["entries"], np.triu_indices(len(experiment.tracker.state))
    entries["mean"], entries["cov"] = entries["mean"].copy(), entries["cov"].copy()
    times = np.array([scan.time for scan in scans])
    for track in tracks:
        rows = np.flatnonzero(entries["track"] == track.id)
        own = np.searchsorted(track.times, times[entries["scan"][rows]])
        held = own < len(track.times)
        held[held] = track.times[own[held]] == times[entries["scan"][rows[held]]]
        rows, own = rows[held], own[held]
        entries["mean"][rows] = track.mean[own]
        entries["cov"][rows] = track.cov[own][:, triangle[0], triangle[1]]
    told = _judged(entries, experiment, scans, truth)
    tables["entries"] = entries | told["entries"]
    tables["scans"] |= told["scans"]
    packed = BytesIO()
    file = SeriesFile(packed, filtered.about)
    file.add(tables)
    file.flush()
    return packed.getvalue()


def _judged(
    entries: dict[str, Column], experiment: Experiment, scans: Sequence[Scan], truth: Sequence[Trajectory]
) -> dict[str, dict[str, Any]]:
    """Return what the judge says of all scans, with the estimates as they are in the entries."""
    space, tracker = experiment.tracker.state, experiment.tracker
    judge = RunningJudge(truth, space, experiment.judge, tracker.gate.probability)
    cov = np.empty((len(entries["track"]), len(space), len(space)))
    rows, columns = np.triu_indices(len(space))
    cov[:, rows, columns] = cov[:, columns, rows] = entries["cov"]
    modes = entries["modes"] if entries["modes"].shape[1] else None
    first = np.searchsorted(entries["scan"], np.arange(len(scans) + 1))
    for i, scan in enumerate(scans):
        own = slice(first[i], first[i + 1])
        estimate = Gaussian(entries["mean"][own], cov[own])
        figures = (entries["nis"][own], entries["hit"][own], None if modes is None else modes[own])
        judge.add(scan, entries["track"][own], entries["confirmed"][own], estimate, *figures)
    return {
        table: dict(columns) for table, columns in judged(judge.finish_block(), len(scans), entries["confirmed"]).items()
    }
