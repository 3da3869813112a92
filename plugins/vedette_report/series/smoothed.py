"""The series of smoothed tracks: those of the run, with the smoothed estimates and what the judge says of these."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from io import BytesIO

import numpy as np

from vedette import Array, Experiment, Gaussian, Scan, Track, Trajectory
from vedette.metrics import ENTRIES, SCANS, RunningJudge, Score
from vedette_files import Column, Series, SeriesFile, below, full_covariances, triangles
from vedette_report.series.judged import judged
from vedette_report.series.tables import together


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
