"""What a summary says of a run against its truth."""

from __future__ import annotations

from collections.abc import Iterator, Sequence

import numpy as np

from vedette import Experiment, Trajectory
from vedette.config import installed_figures
from vedette.metrics import Score
from vedette_report.columns import aligned, maybe, percent
from vedette_report.figures import MANY, WHOLE, extent

_NOISE = 1e-9
"""Anything smaller than this is the rounding of sums, and reported as 0."""


def against_truth(experiment: Experiment, score: Score, unit: str, truth: Sequence[Trajectory]) -> Iterator[tuple[str, str]]:
    """Yield each figure's name and what it says."""
    judge = experiment.judge
    offset = "" if not np.any(judge.offset) else f", the known offset {_vector(judge.offset.tolist())} {unit} removed"
    yield "coverage", f"{percent(score.coverage)} of the scans in which an object was there"
    yield "position error", maybe(score.position_rmse_m, f"{unit} RMSE while covered") + offset
    if score.bias_m is not None:
        yield "bias", f"{_vector(score.bias_m)} {unit}"
    if score.velocity_rmse_mps is not None:
        yield "velocity error", f"{score.velocity_rmse_mps:.3g} {unit}/s RMSE while covered"
    yield "identity switches", f"{score.id_switches}"
    yield "lost", f"{percent(score.lost)} of the objects, for more than {judge.lost_scans} scans in a row"
    yield "first covered", maybe(score.confirmed_after_s, "s after an object's first scan, on average")
    near = "" if judge.near is None else f" within {judge.near:g} {unit} of an object"
    yield "false tracks", f"{maybe(score.false_tracks, 'at a time')}{near}"
    how = f"cut-off {judge.gospa_cutoff:g} {unit}, order {judge.gospa_order:g}"
    error = score.position_rmse_m
    if error is not None and not error <= judge.gospa_cutoff <= max(WHOLE * extent(truth), MANY * error):
        how += f": OUT OF PROPORTION, set judge.gospa_cutoff to 3 to 10 errors of {error:.2g} {unit}"
    yield "GOSPA", f"{maybe(score.gospa_m, unit)} a scan, {how}"
    if judge.far is not None:
        yield "", f"of tracks within {judge.far:g} {unit} of an object; {maybe(score.gospa_all_m, unit)} with all"
    yield "OSPA", f"{maybe(score.ospa_m, unit)} a scan"
    yield "whole tracks", ", ".join(_whole_tracks(score, unit))
    if score.position_bound_m is not None:
        yield "lower bound", f"{score.position_bound_m:.3g} {unit}: posterior Cramer-Rao bound of the position error"
    for figure in installed_figures():
        if score.more.get(figure.name) is not None:
            value = maybe(score.more[figure.name], "" if figure.unit == "1" else figure.unit)
            yield figure.study or figure.name, f"{value}: {figure.about}"


def _whole_tracks(score: Score, unit: str) -> Iterator[str]:
    """Yield the figures of whole tracks that say most; the others are in the JSON."""
    if score.hota is None:
        yield "left out: so long a run keeps too little of them"
        return
    if score.trajectory_gospa_m is not None:
        yield f"trajectory GOSPA {score.trajectory_gospa_m:.3g} {unit} a scan"
    else:
        yield "no trajectory GOSPA, whose linear program is larger than judge.largest_program"
    shares = ", ".join(f"{name.upper()} {maybe(getattr(score, name))}" for name in ("hota", "mota", "idf1"))
    yield f"OSPA(2) {maybe(score.ospa2_m, unit)}, {shares}"


def objects(score: Score, unit: str, most: int) -> list[str]:
    """Return a table of at most so many true objects, and how many more there are."""
    titles = ("object", "scans", "coverage", f"RMSE [{unit}]", "identity switches", "lost", "first covered [s]")
    table = [
        (
            fate.name,
            f"{fate.scans:,}",
            percent(fate.coverage),
            maybe(fate.position_rmse_m),
            f"{fate.id_switches}",
            {True: "yes", False: "no", None: "-"}[fate.lost],
            maybe(fate.confirmed_after_s),
        )
        for fate in score.truths[:most]
    ]
    lines = [f"  {line}" for line in aligned((titles, *table))]
    more = len(score.truths) - most
    return [*lines, f"  and {more:,} more, which summary.json has"] if more > 0 else lines


def _vector(values: Sequence[float]) -> str:
    return f"({', '.join(f'{0.0 if abs(value) < _NOISE else value:.3g}' for value in values)})"
