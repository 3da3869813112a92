"""The series of a run as the page needs them: track by track, in single precision, with the largest weights."""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import NDArray

from vedette.space import Array, Indices
from vedette_files import Series
from vedette_report.page.packing import EXACT, Packed, pack, single

MOST, LEAST = 4, 0.01
"""The page holds of each track after each scan the largest so many weights, of those above so much."""

Named = tuple[str, NDArray[Any]]


def columns(series: Series, centre: Array | None = None) -> tuple[list[Packed], dict[str, Any]]:
    """Return the packed columns, and the place that is the origin of the page's map: `centre`, or one in the middle."""
    centre = middle(series) if centre is None else centre
    return [pack(name, values) for name, values in arrays(series, centre)], {"centre": centre.tolist()}


def arrays(series: Series, centre: Array) -> list[Named]:
    """Return the page's columns, `table.name` and numbers, their places counted from `centre` (2,)."""
    entries = series["entries"]
    order = np.lexsort((entries["scan"], entries["track"]))
    made = [*_scans(series, centre), *_returns(series, centre), *_entries(series, order, centre)]
    return [*made, *_weights(series, order), *_truth(series, centre)]


def middle(series: Series) -> Array:
    """Return a round place in the middle of a run, so that single precision is fine around it."""
    places = [series["entries"]["mean"][:, _axes(series)], series["truth"]["position"], series["returns"]["position"]]
    known = [place[np.isfinite(place).all(axis=1)] for place in places if place.shape[-1] == 2]
    spots = np.concatenate([np.zeros((0, 2)), *known])
    return np.round(np.median(spots, axis=0), -2) if len(spots) else np.zeros(2)


def _axes(series: Series, prefix: str = "") -> list[int]:
    """Return where the state has the map's axes, or their rates with the prefix `v`; none if it lacks one."""
    names, shown = list(series.about["axes"]), series.about["map"]
    wanted = [prefix + name for name in shown["axes"]] if shown else []
    return [names.index(name) for name in wanted] if all(name in names for name in wanted) else []


def _scans(series: Series, centre: Array) -> list[Named]:
    scans = series["scans"]
    numbers = ("position_rmse", "nees", "nees_low", "nees_high", "nis", "nis_low", "nis_high")
    return [
        ("scans.time", scans["time"]),
        ("scans.sensor", scans["sensor"].astype(np.uint8)),
        ("scans.returns", scans["returns"].astype(np.uint32)),
        ("scans.covered", scans["covered"].astype(np.uint32)),
        ("scans.platform", single(scans["platform"] - centre, EXACT)),
        ("scans.heading", single(scans["heading"])),
        *((f"scans.{name}", single(scans[name])) for name in numbers),
    ]


def _returns(series: Series, centre: Array) -> list[Named]:
    place = single(series["returns"]["position"] - centre, EXACT)
    made = [("returns.x", place[:, 0]), ("returns.y", place[:, 1])]
    rays = _rays(series)
    return made if rays is None else [*made, ("returns.ray", single(rays))]


def _rays(series: Series) -> Array | None:
    """Return the directions (r, 2) on the map of returns that are bearings alone; None if there are none."""
    scans, returns, shown = series["scans"], series["returns"], series.about["map"]
    sensor = scans["sensor"][returns["scan"]]
    rays = np.full((len(sensor), 2), np.nan)
    for i, told in enumerate(series.about["sensors"].values()):
        if list(told["axes"])[:1] == ["bearing"] and shown and sorted(shown["axes"]) == ["x", "y"]:
            rows = sensor == i
            angle = returns["z"][rows, 0] + np.nan_to_num(scans["heading"][returns["scan"][rows]])
            ray = np.stack([np.cos(angle), np.sin(angle)], axis=-1)
            rays[rows] = ray[:, [("x", "y").index(name) for name in shown["axes"]]]
    return rays if np.isfinite(rays).any() else None


def _entries(series: Series, order: Indices, centre: Array) -> list[Named]:
    entries = {name: values[order] for name, values in series["entries"].items()}
    ids, first, count = np.unique(entries["track"], return_index=True, return_counts=True)
    gap = np.diff(entries["scan"], prepend=0)
    gap[first] = entries["scan"][first]
    made: list[Named] = [
        ("tracks.id", ids.astype(np.uint32)),
        ("tracks.count", count.astype(np.uint32)),
        ("entries.gap", gap.astype(np.uint32)),
        ("entries.confirmed", entries["confirmed"].astype(np.uint8)),
        ("entries.object", entries["object"].astype(np.int16)),
    ]
    place, rate = _axes(series), _axes(series, "v")
    if place:
        i, j = place
        n = len(series.about["axes"])
        where = np.zeros((n, n), dtype=int)
        where[np.triu_indices(n)] = range(n * (n + 1) // 2)
        cov = [where[i, i], where[min(i, j), max(i, j)], where[j, j]]
        spot = entries["mean"][:, place] - centre
        made += [(f"entries.{name}", values) for name, values in zip("xy", single(spot, EXACT).T, strict=True)]
        made += _three("cov", entries["cov"][:, cov])
        off = single(entries["gate_position"] - entries["mean"][:, place])
        made += [("entries.gateX", off[:, 0]), ("entries.gateY", off[:, 1]), *_three("gate", entries["gate_cov"])]
    names = list(series.about["axes"])
    sizes = [name for name in ("width", "height") if name in names]
    made += [(f"entries.{name}", single(entries["mean"][:, names.index(name)])) for name in sizes]
    if rate:
        speed = single(entries["mean"][:, rate])
        made += [("entries.vx", speed[:, 0]), ("entries.vy", speed[:, 1])]
    made.append(("entries.miss", single(1.0 - entries["hit"])))  # small ones are told in their own digits
    judged = ("existence", "position_error", "position_sigma", "nees", "nis_given_hit")
    made += [(f"entries.{name}", single(entries[name])) for name in (*judged, *(["link"] if "link" in entries else []))]
    return made + [(f"entries.mode{i}", single(values)) for i, values in enumerate(entries["modes"].T)]


def _three(name: str, values: Array) -> list[Named]:
    return [(f"entries.{name}{part}", column) for part, column in zip(("XX", "XY", "YY"), single(values).T, strict=True)]


def _weights(series: Series, order: Indices) -> list[Named]:
    """Return the largest weights of each entry, the largest first, and how many each has."""
    weights, place = series["weights"], np.empty(len(order), dtype=np.intp)
    place[order] = np.arange(len(order))
    scan = series["entries"]["scan"][weights["entry"]]
    kept = np.flatnonzero((weights["weight"] > LEAST) & (weights["return"] < series["scans"]["returns"][scan]))
    entry = place[weights["entry"][kept]]
    by_size = np.lexsort((-weights["weight"][kept], entry))
    kept, entry = kept[by_size], entry[by_size]
    rank = np.arange(len(entry)) - np.searchsorted(entry, entry, "left")
    kept, entry = kept[rank < MOST], entry[rank < MOST]
    return [
        ("weights.count", np.bincount(entry, minlength=len(order)).astype(np.uint8)),
        ("weights.return", weights["return"][kept].astype(np.uint32)),
        ("weights.weight", single(weights["weight"][kept])),
    ]


def _truth(series: Series, centre: Array) -> list[Named]:
    truth = series["truth"]
    order = np.lexsort((truth["scan"], truth["object"]))
    scan, which = truth["scan"][order], truth["object"][order]
    gap = np.diff(scan, prepend=0)
    begin = np.flatnonzero(np.diff(which, prepend=-1))
    gap[begin] = scan[begin]
    place = single(truth["position"][order] - centre, EXACT)
    count = np.bincount(which, minlength=len(series.about["objects"])).astype(np.uint32)
    return [
        ("truth.count", count),
        ("truth.gap", gap.astype(np.uint32)),
        ("truth.x", place[:, 0]),
        ("truth.y", place[:, 1]),
    ]
