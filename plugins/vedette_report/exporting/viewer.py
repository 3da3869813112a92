"""A run as a recording of Rerun, a viewer of things that happen in time and space. Needs rerun-sdk."""

from __future__ import annotations

import json
from collections.abc import Sequence
from itertools import pairwise
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from vedette import Array, Track
from vedette_files import read_series
from vedette_files.libraries import needed
from vedette_files.writing import whole_bytes
from vedette_report.drawing import canvas
from vedette_report.exporting.run import CHI_SQUARE_95, OUTLINE, Run
from vedette_report.page.columns import middle

SCALARS = ("existence", "nis")
"""Of a track, what is drawn against time."""


def write_rerun(path: Path, run: Run, ellipses: int) -> None:
    """Write truth, returns, tracks, their paths, ellipses and figures, on the time of the recording.

    Places are in m, or px, from a round one in the middle, which the document `about` names: Rerun keeps them in single
    precision. Latitudes and longitudes stand beside them where they are known.
    """
    rr = needed("rerun", "Rerun's files need rerun-sdk", "rerun")
    series = read_series(run.folder / "series.npz")
    centre = middle(series)
    with whole_bytes(path) as file:
        stream = rr.RecordingStream("vedette", recording_id=f"vedette {run.folder.resolve().name}", send_properties=False)
        content = stream.binary_stream()  # Rerun tells of a full disk by a traceback, and not always
        stream.send_recording_name(run.title)
        about = {"origin": str(run.terms.origin or "unknown"), "centre": centre.tolist(), **run.about}
        stream.log("about", rr.TextDocument(json.dumps(about, indent=2)), static=True)
        if run.about["map"]:
            view = rr.ViewCoordinates.RIGHT_HAND_Y_DOWN if run.about["unit"] == "px" else rr.ViewCoordinates.RIGHT_HAND_Z_UP
            stream.log("map", view, static=True)
            _points(rr, stream, run, series, centre)
        for i, track in enumerate(run.tracks):
            file.write(content.read() or b"")
            _track(rr, stream, run, track, centre, canvas.TRACKS[i % len(canvas.TRACKS)])
        file.write(content.read() or b"")
        stream.disconnect()


def _time(rr: Any, run: Run, times: Array) -> Any:
    """Return the times of rows as Rerun's: dates where they are known, else s from the recording's 0."""
    if run.terms.dated:
        return rr.TimeColumn("time", timestamp=times)
    return rr.TimeColumn("time", duration=times)


def _points(rr: Any, stream: Any, run: Run, series: Any, centre: Array) -> None:
    """Log returns and true objects, those of a scan together."""
    scans = {**series["scans"], "time": series["scans"]["time"] + run.epoch}
    for name, sensor in ((name, i) for i, name in enumerate(run.about["sensors"])):
        rows = np.flatnonzero(scans["sensor"] == sensor)
        _clouds(
            rr, stream, run, f"map/returns/{name}", scans["time"][rows], _by_scan(series["returns"], rows, centre), "#7a7a7a"
        )
    truth = series["truth"]
    for j, name in enumerate(run.about["objects"]):
        mine = np.flatnonzero(truth["object"] == j)
        times, spots = scans["time"][truth["scan"][mine]], truth["position"][mine] - centre
        _clouds(rr, stream, run, f"map/truth/{name}", times, [spot[None] for spot in spots], "#1a1a1a")


def _by_scan(table: Any, scans: NDArray[np.intp], centre: Array) -> list[Array]:
    """Return the known places (k, 2) of each of some scans."""
    edges = np.searchsorted(table["scan"], np.stack([scans, scans + 1]))
    parts = [table["position"][i:j] - centre for i, j in edges.T.tolist()]
    return [part[np.isfinite(part).all(axis=1)] for part in parts]


def _clouds(rr: Any, stream: Any, run: Run, path: str, times: Array, clouds: Sequence[Array], colour: str) -> None:
    if not len(times):
        return
    places = _flat(np.concatenate([np.zeros((0, 2)), *clouds]))
    stream.log(path, rr.Points3D.from_fields(colors=[_shade(colour)]), static=True)
    columns = rr.Points3D.columns(positions=places).partition([len(cloud) for cloud in clouds])
    stream.send_columns(path, [_time(rr, run, times)], columns)


def _track(rr: Any, stream: Any, run: Run, track: Track, centre: Array, colour: str) -> None:
    path, index = f"tracks/{track.id}", _time(rr, run, track.times)
    if run.about["map"]:
        where = [track.space.names.index(name) for name in run.about["map"]["axes"]]
        spots = track.mean[:, where] - centre
        shown = f"map/{path}"
        stream.log(shown, rr.Points3D.from_fields(colors=[_shade(colour)], labels=[str(track.id)]), static=True)
        stream.send_columns(shown, [index], rr.Points3D.columns(positions=_flat(spots)))
        strips = [_flat(outline) for outline in _outlines(spots, track.cov[:, where][:, :, where])]
        stream.log(f"{shown}/ellipse", rr.LineStrips3D.from_fields(colors=[_shade(colour)]), static=True)
        stream.send_columns(f"{shown}/ellipse", [index], rr.LineStrips3D.columns(strips=strips))
        stream.log(f"map/paths/{track.id}", rr.LineStrips3D([_flat(spots)], colors=[_shade(colour)]), static=True)
        end = track.times[-1] + _step(track.times)
        for name in (shown, f"{shown}/ellipse"):
            stream.send_columns(name, [_time(rr, run, np.array([end]))], rr.Clear.columns(is_recursive=[False]))
    if run.terms.origin is not None and run.terms.columns(run.space):
        places = run.places(track)[:, [1, 0]]
        stream.send_columns(f"earth/{path}", [index], rr.GeoPoints.columns(positions=places))
    for name in SCALARS:
        stream.send_columns(f"{name}/{track.id}", [index], rr.Scalars.columns(scalars=getattr(track, name)))


def _outlines(spots: Array, cov: Array) -> Array:
    """Return the outlines (s, k, 2) of 95 % ellipses."""
    values, vectors = np.linalg.eigh(np.where(np.isfinite(cov), cov, 0.0))
    half = vectors * np.sqrt(CHI_SQUARE_95 * np.maximum(values, 0.0))[:, None, :]
    angles = np.arange(OUTLINE + 1) * 2 * np.pi / OUTLINE
    return spots[:, None] + np.einsum("sij,jk->ski", half, np.stack([np.cos(angles), np.sin(angles)]))


def _flat(places: Array) -> Array:
    """Return places (k, 2) as (k, 3), on the ground."""
    return np.column_stack([places, np.zeros(len(places))])


def _step(times: Array) -> float:
    """Return how long it is from scan to scan, 1 s where there is only one."""
    gaps = [after - before for before, after in pairwise(times.tolist()) if after > before]
    return float(np.median(gaps)) if gaps else 1.0


def _shade(colour: str) -> list[int]:
    return [int(colour[i : i + 2], 16) for i in (1, 3, 5)]
