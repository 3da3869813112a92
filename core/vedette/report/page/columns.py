"""The series of a run as the page needs them: track by track, in single precision, with the largest weights."""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import NDArray

from vedette.io import Series
from vedette.report.page.packing import EXACT, Packed, pack, single
from vedette.space import Array

MOST, LEAST = 4, 0.01
"""The page holds of each track after each scan the largest so many weights, of those above so much."""

Rows = NDArray[np.intp]


def columns(series: Series, centre: Array | None = None) -> tuple[list[Packed], dict[str, Any]]:
    """Return the packed columns, and the place that is the origin of the page's map: `centre`, or one in the middle."""
    entries = series["entries"]
    order = np.lexsort((entries["scan"], entries["track"]))
    places = [entries["mean"][:, _axes(series)], series["truth"]["position"], series["returns"]["position"]]
    centre = _centre([place for place in places if place.shape[-1] == 2]) if centre is None else centre
    packed = [*_scans(series, centre), *_returns(series, centre), *_entries(series, order, centre)]
    packed += [*_weights(series, order), *_truth(series, centre)]
    return packed, {"centre": centre.tolist()}


def _axes(series: Series, prefix: str = "") -> list[int]:
    """Return where the state has the map's axes, or their rates with the prefix `v`; none if it lacks one."""
    names, shown = list(series.about["axes"]), series.about["map"]
    wanted = [prefix + name for name in shown["axes"]] if shown else []
    return [names.index(name) for name in wanted] if all(name in names for name in wanted) else []


def _centre(places: list[Array]) -> Array:
    """Return a round place in the middle, so that single precision is fine around it."""
    known = [place[np.isfinite(place).all(axis=1)] for place in places]
    spots = np.concatenate([np.zeros((0, 2)), *known])
    return np.round(np.median(spots, axis=0), -2) if len(spots) else np.zeros(2)


def _scans(series: Series, centre: Array) -> list[Packed]:
    scans = series["scans"]
    numbers = ("position_rmse", "nees", "nees_low", "nees_high", "nis", "nis_low", "nis_high")
    return [
        pack("scans.time", scans["time"]),
        pack("scans.sensor", scans["sensor"].astype(np.uint8)),
        pack("scans.returns", scans["returns"].astype(np.uint32)),
        pack("scans.covered", scans["covered"].astype(np.uint32)),
        pack("scans.platform", single(scans["platform"] - centre, EXACT)),
        pack("scans.heading", single(scans["heading"])),
        *(pack(f"scans.{name}", single(scans[name])) for name in numbers),
    ]


def _returns(series: Series, centre: Array) -> list[Packed]:
    place = single(series["returns"]["position"] - centre, EXACT)
    packed = [pack("returns.x", place[:, 0]), pack("returns.y", place[:, 1])]
    rays = _rays(series)
    return packed if rays is None else [*packed, pack("returns.ray", single(rays))]


def _rays(series: Series) -> Array | None:
    """Return the directions (r, 2) on the map of returns that are bearings alone; None if there are none."""
    scans, returns, shown = series["scans"], series["returns"], series.about["map"]
    sensor = scans["sensor"][returns["scan"]]
    rays = np.full((len(sensor), 2), np.nan)
    for i, told in enumerate(series.about["sensors"].values()):
        if list(told["axes"])[:1] == ["bearing"] and shown and sorted(shown["axes"]) == ["x", "y"]:
            own = sensor == i
            angle = returns["z"][own, 0] + np.nan_to_num(scans["heading"][returns["scan"][own]])
            ray = np.stack([np.cos(angle), np.sin(angle)], axis=-1)
            rays[own] = ray[:, [("x", "y").index(name) for name in shown["axes"]]]
    return rays if np.isfinite(rays).any() else None


def _entries(series: Series, order: Rows, centre: Array) -> list[Packed]:
    entries = {name: values[order] for name, values in series["entries"].items()}
    ids, first, count = np.unique(entries["track"], return_index=True, return_counts=True)
    gap = np.diff(entries["scan"], prepend=0)
    gap[first] = entries["scan"][first]
    packed = [
        pack("tracks.id", ids.astype(np.uint32)),
        pack("tracks.count", count.astype(np.uint32)),
        pack("entries.gap", gap.astype(np.uint32)),
        pack("entries.confirmed", entries["confirmed"].astype(np.uint8)),
        pack("entries.object", entries["object"].astype(np.int16)),
    ]
    place, rate = _axes(series), _axes(series, "v")
    if place:
        i, j = place
        n = len(series.about["axes"])
        where = np.zeros((n, n), dtype=int)
        where[np.triu_indices(n)] = range(n * (n + 1) // 2)
        cov = [where[i, i], where[min(i, j), max(i, j)], where[j, j]]
        spot = entries["mean"][:, place] - centre
        packed += [pack(f"entries.{name}", values) for name, values in zip("xy", single(spot, EXACT).T, strict=True)]
        packed += _three("cov", entries["cov"][:, cov])
        off = single(entries["gate_position"] - entries["mean"][:, place])
        packed += [pack("entries.gateX", off[:, 0]), pack("entries.gateY", off[:, 1]), *_three("gate", entries["gate_cov"])]
    if rate:
        speed = single(entries["mean"][:, rate])
        packed += [pack("entries.vx", speed[:, 0]), pack("entries.vy", speed[:, 1])]
    packed.append(pack("entries.miss", single(1.0 - entries["hit"])))  # small ones are told in their own digits
    judged = ("existence", "position_error", "position_sigma", "nees", "nis_given_hit")
    packed += [pack(f"entries.{name}", single(entries[name])) for name in judged]
    return packed + [pack(f"entries.mode{i}", single(values)) for i, values in enumerate(entries["modes"].T)]


def _three(name: str, values: Array) -> list[Packed]:
    return [pack(f"entries.{name}{part}", column) for part, column in zip(("XX", "XY", "YY"), single(values).T, strict=True)]


def _weights(series: Series, order: Rows) -> list[Packed]:
    """Return the largest weights of each entry, the largest first, and how many each has."""
    weights, place = series["weights"], np.empty(len(order), dtype=np.intp)
    place[order] = np.arange(len(order))
    kept = np.flatnonzero(weights["weight"] > LEAST)
    entry = place[weights["entry"][kept]]
    by_size = np.lexsort((-weights["weight"][kept], entry))
    kept, entry = kept[by_size], entry[by_size]
    rank = np.arange(len(entry)) - np.searchsorted(entry, entry, "left")
    kept, entry = kept[rank < MOST], entry[rank < MOST]
    return [
        pack("weights.count", np.bincount(entry, minlength=len(order)).astype(np.uint8)),
        pack("weights.return", weights["return"][kept].astype(np.uint32)),
        pack("weights.weight", single(weights["weight"][kept])),
    ]


def _truth(series: Series, centre: Array) -> list[Packed]:
    truth = series["truth"]
    order = np.lexsort((truth["scan"], truth["object"]))
    scan, which = truth["scan"][order], truth["object"][order]
    gap = np.diff(scan, prepend=0)
    begin = np.flatnonzero(np.diff(which, prepend=-1))
    gap[begin] = scan[begin]
    place = single(truth["position"][order] - centre, EXACT)
    count = np.bincount(which, minlength=len(series.about["objects"])).astype(np.uint32)
    return [
        pack("truth.count", count),
        pack("truth.gap", gap.astype(np.uint32)),
        pack("truth.x", place[:, 0]),
        pack("truth.y", place[:, 1]),
    ]
