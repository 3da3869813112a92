"""The study's scenes, all runs in lock-step: returns drawn as the picture chain reports them, or found in pictures."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from functools import partial
from typing import Any

import numpy as np
from attrs import evolve, frozen

from vedette import Array, Detections, Gaussian, Mask, Progress, Scan, Space, load
from vedette.tracking import preprocessed
from vedette_marine import configs
from vedette_marine.ais.reports import Reports
from vedette_marine.ais.tracks import STATE, motion
from vedette_report.findings import Keep, afresh
from vedette_study.starts import over_axes

MARGIN = 400.0
"""Margin in m around the paths in which returns are kept: the gate of a track that is not lost is much smaller."""


@frozen(eq=False)
class Points:
    """`r` runs of one scene: times (s,), centres (t, s, 2), AIS (r, t, s, 2), announced (r, t, 4), scans.

    AIS is interpolated to the scans, of which only those are kept where all ships have reported.
    """

    names: tuple[str, ...]
    times: Array
    centres: Array
    ais: Array
    announced: Array
    scans: tuple[Scan, ...]


def draw(scene: dict[str, Any], runs: int, clutter_density: float, rng: np.random.Generator) -> Points:
    """Draw the scene's paths with AIS in each run, and returns: detected with .95, clutter by its density in 1/m^2."""
    chances = {"clutter": clutter_density, "detection_probability": configs.PROBABILITY_DETECTION}
    made = source({"kind": "radar_points_scene", "scene": scene} | chances)
    drawn = made.batch(runs, int(rng.integers(2**63)))
    return assembled(made.scene, drawn.times, drawn.ais, drawn.scans("radar"))


@frozen(eq=False)
class Returns:
    """What a detector found in one run's s pictures: how many in each (s,), and z (n, 2), evidence (n,), noise (n, 2, 2)."""

    counts: Array
    z: Array
    evidence: Array | None
    noise: Array | None

    def of_picture(self, k: int) -> Detections:
        """Return those of the k-th picture."""
        first = int(np.sum(self.counts[:k]))
        part = slice(first, first + int(self.counts[k]))
        rest = [None if column is None else column[part] for column in (self.evidence, self.noise)]
        return Detections(self.z[part], np.ones(int(self.counts[k]), dtype=bool), *rest)


def see(
    scene: dict[str, Any],
    detector: dict[str, Any],
    runs: int,
    rng: np.random.Generator,
    progress: Progress,
    about: str,
    keep: Keep = afresh,
) -> Points:
    """Return the same from pictures of a simulated radar, by the detector of a config; all runs lose the same frames."""
    made = source(scene | {"lost": 0})
    times = source(scene).times(int(rng.integers(2**63)))
    seeds = rng.integers(2**63, size=runs).tolist()
    experiment = load(_TRACKER | {"source": scene, "preprocessors": {"radar": detector}})

    def look(run: int) -> Returns:
        painter, looks = made.painter(seeds[run]), []
        for time in progress(times.tolist(), f"{about}, run {run + 1} of {runs}"):
            (scan,) = preprocessed([painter.scan(time, "screen")], experiment.preprocessors)
            looks.append(scan.detections)
        return gathered(looks)

    looked = [keep(f"{about}, pictures of run {run + 1}", Returns, partial(look, run)) for run in range(runs)]
    scans = tuple(
        Scan(time, "radar", together([each.of_picture(k) for each in looked])) for k, time in enumerate(times.tolist())
    )
    return assembled(made, times, [made.ais(seed) for seed in seeds], scans)


def gathered(pictures: Sequence[Detections]) -> Returns:
    """Gather the returns of one run's pictures, all of them valid."""
    rest = [
        None if getattr(pictures[0], name) is None else np.concatenate([getattr(one, name) for one in pictures])
        for name in ("evidence", "noise")
    ]
    counts = np.array([float(len(one.z)) for one in pictures])
    return Returns(counts, np.concatenate([one.z for one in pictures]), *rest)


_TRACKER = configs.tracker(configs.TABLE_6["CV-PDAF"], 10.0)


def source(scene: dict[str, Any]) -> Any:
    """Return a source of the simulators by its config, as this plugin does not import them."""
    return load(_TRACKER | {"source": scene}).source


def together(targets: Sequence[Detections]) -> Detections:
    """Stack the returns of runs (r,): (r, k, 2), padded; without noise or evidence if they have none."""
    counts = np.array([[len(one.z)] for one in targets])
    valid: Mask = np.arange(max(1, int(counts.max()))) < counts

    def padded(name: str, fill: Array) -> Any:
        if getattr(targets[0], name) is None:
            return None
        whole = np.broadcast_to(fill, valid.shape + fill.shape).copy()
        whole[valid] = np.concatenate([getattr(one, name) for one in targets])
        return whole

    return Detections(padded("z", np.zeros(2)), valid, padded("evidence", np.zeros(())), padded("noise", np.eye(2)))


def assembled(scene: Any, times: Array, ais: Sequence[Mapping[str, Reports]], scans: Sequence[Scan]) -> Points:
    """Combine scans (s,) of all runs with the true centres and each run's AIS, while it is known of all ships."""
    paths = scene.centres(times)
    centres = np.stack([np.stack([path.at(time)[:2] for time in times]) for path in paths])
    origin = (scene.latitude, scene.longitude)
    reported = np.stack([[_interpolated(run[path.name], origin, times) for path in paths] for run in ais])
    (known,) = np.nonzero(np.all(np.isfinite(reported), axis=(0, 1, 3)))
    low, high = np.min(centres, axis=(0, 1)) - MARGIN, np.max(centres, axis=(0, 1)) + MARGIN
    near = tuple(_within(scans[k], low, high) for k in known.tolist())
    return Points(
        tuple(path.name for path in paths),
        times[known],
        centres[:, known],
        reported[:, :, known, :2],
        reported[:, :, known[0]],
        near,
    )


def _interpolated(reports: Reports, origin: tuple[float, float], times: Array) -> Array:
    """Return x, y, vx, vy (s, 4) by straight lines between the reports."""
    known, place, velocity = motion(reports, origin)
    rows = np.concatenate([place, velocity], axis=-1).T
    return np.stack([np.interp(times, known, row, left=np.nan, right=np.nan) for row in rows], axis=-1)


def _within(scan: Scan, low: Array, high: Array) -> Scan:
    """Keep the scan's returns within a box, moving those of each run to the front."""
    detections = scan.detections
    valid = detections.valid & np.all((detections.z > low) & (detections.z < high), axis=-1)
    order = np.argsort(~valid, axis=-1, kind="stable")[:, : max(1, int(valid.sum(axis=-1).max()))]

    def kept(values: Any) -> Any:
        return None if values is None else values[np.arange(len(order))[:, None], order]

    return evolve(
        scan,
        detections=Detections(*(kept(column) for column in (detections.z, valid, detections.evidence, detections.noise))),
    )


def prior(points: Points, target: int, start: float, state: Space) -> Gaussian:
    """Return what AIS announces of one target in each run (r, 1, n): position within `start` m, velocity within 1 m/s."""
    cov = np.broadcast_to(np.diag([start**2, start**2, 1.0, 1.0]), (len(points.announced), 1, 4, 4))
    return over_axes(Gaussian(points.announced[:, target, None], cov), STATE, state, {"turn_rate": (0.0, 0.01)})


def first_late(points: Points, seconds: float) -> Points:
    """Return the same without returns for so many seconds from the first scan on."""
    begin = points.times[0] + seconds

    def emptied(scan: Scan) -> Scan:
        seen = scan.detections
        return evolve(scan, detections=evolve(seen, valid=np.zeros_like(seen.valid)))

    return evolve(points, scans=tuple(emptied(scan) if scan.time < begin else scan for scan in points.scans))


def near(points: Points, target: int, reach: float = 150.0) -> Array:
    """Return the returns of the first run within `reach` m of a target's centre, (n, 2)."""
    pairs = zip(points.scans, points.centres[target], strict=True)
    kept = [scan.detections.z[0][scan.detections.valid[0]] - spot for scan, spot in pairs]
    inside = [part[np.hypot(*part.T) < reach] for part in kept]
    return np.concatenate([part + spot for part, spot in zip(inside, points.centres[target], strict=True)])


def by_frame_number(points: Points) -> Points:
    """Return the same scans timed as if no frame had been lost, 1 s apart, and judged at those times."""
    times = points.times[0] + np.arange(len(points.times))
    flat = np.moveaxis(points.ais, 2, -1).reshape(-1, len(times))
    moved = np.array([np.interp(times, points.times, row) for row in flat]).reshape(*points.ais.shape[:2], 2, -1)
    ais = np.moveaxis(moved, -1, 2)
    flat = np.moveaxis(points.centres, 1, -1).reshape(-1, len(times))
    centres = np.array([np.interp(times, points.times, row) for row in flat]).reshape(len(points.centres), 2, -1)
    scans = tuple(evolve(scan, time=float(time)) for scan, time in zip(points.scans, times, strict=True))
    return evolve(points, times=times, scans=scans, ais=ais, centres=np.moveaxis(centres, -1, 1))
