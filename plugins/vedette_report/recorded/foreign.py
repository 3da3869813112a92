"""What the estimates of a filter that Vedette does not run say of its covariances: of arrays, or of a table as CSV."""

from __future__ import annotations

import csv
from collections import defaultdict
from collections.abc import Mapping, Sequence
from pathlib import Path

import numpy as np

from vedette import Array, InputError, Mask, Space, Track, Trajectory
from vedette.metrics import asymmetric, nees
from vedette_files import STATE
from vedette_files.input_files import lines
from vedette_report.recorded.tracks import Recorded, of_track
from vedette_report.recorded.used import gathered

ENOUGH = "a truth in more rows than it has axes, or innovations in three"


def of_estimates(
    space: Space,
    times: Array,
    mean: Array,
    cov: Array,
    truth: Array | None = None,
    innovation: Array | None = None,
    innovation_cov: Array | None = None,
    *,
    measured: Sequence[str] = (),
    track: int = 0,
) -> Recorded:
    """Judge estimates mean (s, n) with cov (s, n, n) over `space`, at times (s,) in s, as those of Vedette's own filters.

    By their errors from the truth (s, n), of which an axis may be NaN, and rows may; by innovations (s, m), over axes of the
    names `measured`, with their covariances (s, m, m): NaN where there was no return, and in the first row. InputError if
    these are of too few rows, or a covariance is none.
    """
    told = _judged(space, times, mean, cov, truth, innovation, innovation_cov, measured, track)
    if told is None:
        raise InputError(f"track {track}: must have {ENOUGH}")
    return told


def _judged(
    space: Space, times: Array, mean: Array, cov: Array, truth: Array | None, innovation: Array | None,
    innovation_cov: Array | None, measured: Sequence[str], track: int,
) -> Recorded | None:  # fmt: skip
    """Return what `of_estimates` does; None if it is of too few rows."""
    m = 0 if innovation is None else innovation.shape[-1]
    v, S = (np.zeros((len(times), 0)), np.zeros((len(times), 0, 0))) if innovation is None else (innovation, innovation_cov)
    if S is None:
        raise InputError("innovation_cov: must be given with innovations")
    hit: Mask = np.asarray(np.isfinite(v).all(axis=-1) & (m > 0))
    v, S = np.where(hit[:, None], v, 0.0), np.where(hit[:, None, None], S, np.eye(m))
    _check(track, times, mean, {"the covariance of the estimate": cov, "that of the innovation": S})
    nis, path = nees(v, S), None
    known: Mask | None = None
    rows = zip(times.tolist(), nis.tolist(), hit.astype(float).tolist(), v, S, strict=True)
    entries = [("returns", time, square, one, 0.0, seen, cov, np.ones(m)) for time, square, one, seen, cov in rows]
    if truth is not None and np.isfinite(truth).any():
        some = np.asarray(np.isfinite(truth).any(axis=0))
        known = np.asarray(np.isfinite(truth[:, some]).all(axis=-1))
        axes = Space(tuple(axis for axis, is_known in zip(space.axes, some.tolist(), strict=True) if is_known))
        path = Trajectory("truth", axes, times[known], truth[known][:, some])
    ones, names = np.ones(len(times)), {"returns": tuple(measured) or tuple(f"z{i + 1}" for i in range(m))}
    estimates = Track(track, space, times, mean, cov, ones > 0, ones, None, (), nis, hit.astype(float))
    seen = gathered(names, 1.0, entries)
    return None if path is not None and not len(path.times) else of_track(1.0, estimates, seen, path, known)


def of_table(path: Path) -> tuple[Recorded, ...]:
    """Judge the tracks of a CSV, of columns time, track, axes such as x, cov_x_y, true_x; innovations nu_x, and S_x_y.

    Those of too few rows are left out.
    """
    rows = csv.DictReader(text for _, text in lines(path))
    titles = list(rows.fieldnames or ())
    axes = [title for title in titles if f"cov_{title}_{title}" in titles]
    measured = [title.removeprefix("nu_") for title in titles if title.startswith("nu_")]
    if not axes or "time" not in titles:
        wanted = "time, and for each axis one of its name and cov_x_x, cov_x_y, ... for each pair"
        raise InputError(f"{path}: columns must be {wanted}, got {', '.join(titles)}")
    covs = [
        [_pair(path, titles, begin, a, b) for a in names for b in names] for begin, names in (("cov", axes), ("S", measured))
    ]
    truths = [title if (title := f"true_{axis}") in titles else "" for axis in axes]
    by_track = defaultdict[int, list[list[Array]]](list)
    for number, row in enumerate(rows, start=2):
        parts = [["time"], axes, covs[0], truths, [f"nu_{axis}" for axis in measured], covs[1]]
        values = [np.array([_number(path, number, row, title) for title in part]) for part in parts]
        by_track[int(np.nan_to_num(_number(path, number, row, "track")))].append(values)
    if not by_track:
        raise InputError(f"{path}: holds titles and no estimates")
    found = []
    for track, of in by_track.items():
        times, mean, cov, truth, v, S = (np.array(part) for part in zip(*of, strict=True))
        order, n, m = np.argsort(times[:, 0], kind="stable"), len(axes), len(measured)
        units = {axis.name: axis for axis in STATE.axes}
        space = Space(tuple(units[name] if name in units else Space.of(**{name: "1"}).axes[0] for name in axes))
        square = (cov.reshape(-1, n, n)[order], truth[order], v[order], S.reshape(len(of), m, m)[order])
        found.append(_judged(space, times[order, 0], mean[order], *square, measured, track))
    told = tuple(one for one in found if one is not None)
    if not told:
        raise InputError(f"{path}: one track at least must have {ENOUGH}")
    return told


def _pair(path: Path, titles: Sequence[str], begin: str, a: str, b: str) -> str:
    """Return the title of a covariance of two axes, of which either order may be there."""
    for title in (f"{begin}_{a}_{b}", f"{begin}_{b}_{a}"):
        if title in titles:
            return title
    raise InputError(f"{path}: has no column {begin}_{a}_{b}; state each pair of axes, 0 where they are not correlated")


def _number(path: Path, number: int, row: Mapping[str, str], title: str) -> float:
    """Return the number of a cell, NaN of an empty one or one without a title."""
    try:
        return float(row.get(title) or "nan")
    except ValueError:
        raise InputError(f"{path}:{number}: {title} must be a number, got {row[title]!r}") from None


def _check(track: int, times: Array, mean: Array, covs: Mapping[str, Array]) -> None:
    """Raise InputError without rows, and for the first estimate that is no number or covariance (s, n, n) that is none."""
    if not len(times):
        raise InputError(f"track {track}: has no rows")
    if len(bad := np.flatnonzero(~np.isfinite(np.column_stack([times, mean])).all(axis=-1))):
        raise InputError(f"track {track}: at {times[bad[0]]:g} s the estimate lacks numbers")
    for name, cov in covs.items():
        known: Mask = np.asarray(np.isfinite(cov).all(axis=(-1, -2)))
        if len(bad := np.flatnonzero(known & asymmetric(cov))):
            raise InputError(f"track {track}: at {times[bad[0]]:g} s {name} must be symmetric")
        free = cov + np.eye(cov.shape[-1]) * (cov == 0.0)  # an axis may have no variance
        least = np.min(np.linalg.eigvalsh(np.where(known[:, None, None], free, 0.0)), axis=-1, initial=np.inf)
        if len(bad := np.flatnonzero(~known | (least <= 0))):
            told = f"must be positive definite, its least eigenvalue is {least[bad[0]]:.3g}"
            raise InputError(f"track {track}: at {times[bad[0]]:g} s {name} {told if known[bad[0]] else 'lacks numbers'}")
