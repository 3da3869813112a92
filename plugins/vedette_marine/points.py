"""The study's scenes from points: what the picture chain would report, drawn instead of seen, all runs in lock-step."""

from __future__ import annotations

from collections.abc import Iterable, Iterator
from typing import Any

import numpy as np
from attrs import evolve, frozen

from vedette import Array, Detections, Gaussian, Recording, Scan, Tracker, load
from vedette.detection import detected
from vedette.studies import over_axes
from vedette_marine import configs
from vedette_marine.screen import RadarScreen

MARGIN = 400.0
"""m around the paths in which there are false returns."""

BOAT, LOST_BOAT = 6.0, 100.0
"""m: standard deviation of a boat's return, and the error of one that is lost."""

PIXELS = 4.0
"""m that the middle of a small boat errs, along and across."""

ALONG, ACROSS = 0.144, 0.25
"""Parts of a hull's length and width by which its middle errs on top: measured on pictures of 180 m and 29 m ships."""


@frozen(eq=False)
class Points:
    """`r` runs of one scene: times (s,), centres (t, s, 2), AIS (r, t, s, 2), announced (r, t, 4), scans; sizes (t, 2).

    AIS is interpolated to the scans; NaN before the first and after the last report.
    """

    names: tuple[str, ...]
    times: Array
    centres: Array
    ais: Array
    announced: Array
    scans: tuple[Scan, ...]


def draw(scene: dict[str, Any], runs: int, clutter_density: float, rng: np.random.Generator) -> Points:
    """The scene's paths with AIS of its own in each run, and returns: detected with .95, false ones by density, 1/m^2."""
    scene = scene | {"radar": {"metres_per_pixel": 10.0, "range": 300.0, "size": 64}, "sea": None, "buoys": []}
    opened = _source(scene, "truth").open({"screen": RadarScreen()}, rng)
    paths = opened.truth
    times = paths[0].times[paths[0].times >= opened.scans[0].time]  # no picture is made for its time's sake
    states = np.stack([[path.at(time) for time in times] for path in paths])
    names = paths[0].space.names
    centres = states[..., [names.index("x"), names.index("y")]]
    heading = states[..., names.index("heading")]
    size = states[:, 0, [names.index("length"), names.index("width")]]
    source = _source(scene, "ais")
    reported = np.stack([_reported(source, times, len(paths), each) for each in rng.spawn(runs)])
    first = np.argmax(np.all(np.isfinite(reported), axis=(0, 1, 3)))
    scans = tuple(_scans(times, centres, heading, size, runs, clutter_density, rng))
    return Points(
        tuple(path.name for path in paths),
        times[first:],
        centres[:, first:],
        reported[:, :, first:, :2],
        reported[:, :, first],
        scans[first:],
    )


def _source(scene: dict[str, Any], reference: str) -> Any:
    detector = {"kind": "radar_picture", "sensors": {"screen": {"kind": "radar_screen"}}}
    config = configs.tracker(configs.TABLE_6["CV-PDAF"], 10.0)
    return load(config | {"source": scene | {"reference": reference}, "detectors": {"radar": detector}}).source


def _reported(source: Any, times: Array, count: int, rng: np.random.Generator) -> Array:
    """What each ship's AIS says at `times`, by straight lines between the reports: x, y, vx, vy (t, s, 4)."""
    paths = source.open({"screen": RadarScreen()}, rng).truth
    if len(paths) != count:
        raise RuntimeError(f"AIS of {count} ships was expected without gaps, got {[path.name for path in paths]}")
    return np.stack(
        [
            np.stack([np.interp(times, path.times, axis, left=np.nan, right=np.nan) for axis in path.states.T[:4]], axis=-1)
            for path in paths
        ]
    )


def _scans(
    times: Array, centres: Array, heading: Array, size: Array, runs: int, density: float, rng: np.random.Generator
) -> Iterator[Scan]:
    low, high = np.min(centres, axis=(0, 1)) - MARGIN, np.max(centres, axis=(0, 1)) + MARGIN
    t = len(centres)
    along = np.hypot(ALONG * size[:, 0], PIXELS)
    across = np.hypot(ACROSS * size[:, 1], PIXELS)
    for k, time in enumerate(times.tolist()):
        cos, sin = np.cos(heading[:, k]), np.sin(heading[:, k])
        noise = rng.standard_normal((runs, t, 2)) * np.stack([along, across], axis=-1)
        turned = np.stack([cos * noise[..., 0] - sin * noise[..., 1], sin * noise[..., 0] + cos * noise[..., 1]], axis=-1)
        counts = rng.poisson(density * float(np.prod(high - low)), runs)
        false = low + (high - low) * rng.random((runs, int(counts.max(initial=0)), 2))
        valid = np.concatenate(
            [rng.random((runs, t)) < configs.PROBABILITY_DETECTION, np.arange(false.shape[1]) < counts[:, None]], axis=1
        )
        z = np.concatenate([centres[:, k] + turned, false], axis=1)
        yield Scan(time, "radar", Detections(np.where(valid[..., None], z, 0.0), valid))


def prior(points: Points, target: int, start: float, state: Any) -> Gaussian:
    """What AIS announces of one target in each run (r, 1, n): its place within `start` m, its velocity within 1 m/s."""
    from vedette_marine.ais.tracks import STATE

    cov = np.broadcast_to(np.diag([start**2, start**2, 1.0, 1.0]), (len(points.announced), 1, 4, 4))
    return over_axes(Gaussian(points.announced[:, target, None], cov), STATE, state, {"turn_rate": (0.0, 0.01)})


def by_frame_number(points: Points) -> Points:
    """The same scans, timed as if no frame had been lost, each 1 s after the one before, and judged at those times."""
    times = points.times[0] + np.arange(len(points.times))
    flat = np.moveaxis(points.ais, 2, -1).reshape(-1, len(times))
    moved = np.array([np.interp(times, points.times, row) for row in flat]).reshape(*points.ais.shape[:2], 2, -1)
    ais = np.moveaxis(moved, -1, 2)
    flat = np.moveaxis(points.centres, 1, -1).reshape(-1, len(times))
    centres = np.array([np.interp(times, points.times, row) for row in flat]).reshape(len(points.centres), 2, -1)
    scans = tuple(evolve(scan, time=float(time)) for scan, time in zip(points.scans, times, strict=True))
    return evolve(points, times=times, scans=scans, ais=ais, centres=np.moveaxis(centres, -1, 1))


def from_pictures(
    scene: dict[str, Any],
    estimators: dict[str, dict[str, Any]],
    filters: Iterable[str],
    runs: int,
    frames: int,
    rng: np.random.Generator,
) -> tuple[dict[str, Array], dict[str, int]]:
    """Boats tracked from pictures instead: mean squared errors against AIS (r,) by filter, and how many tracks were lost.

    The pictures of a run are made once, and all filters take their returns. Tracks start at their AIS.
    """
    errors: dict[str, list[float]] = {name: [] for name in filters}
    lost = dict.fromkeys(errors, 0)
    for each in rng.spawn(runs):
        pictured = scene | {"frames": frames, "lost": min(scene["lost"], frames // 40)}
        experiment = load(configs.tracker(estimators["IMM-PDAF"], BOAT) | _pictured(pictured))
        assert experiment.source is not None
        recording = experiment.source.open({"screen": RadarScreen()}, each)
        every = detected(recording.scans, experiment.detectors)
        scans = tuple(
            scan for scan in every if all(path.times[0] <= scan.time <= path.times[-1] for path in recording.truth)
        )
        for name in errors:
            squares = _followed(load(configs.tracker(estimators[name], BOAT)).tracker, evolve(recording, scans=scans))
            lost[name] += int(np.sum(squares[-1] > LOST_BOAT**2))
            errors[name].append(float(np.mean(squares)))
    return {name: np.array(values) for name, values in errors.items()}, lost


def _followed(tracker: Tracker, recording: Recording) -> Array:
    """Squared errors (s, t) of the tracks that start at what is announced at the first scan."""
    given = tracker.lifecycle.given(tracker.state, recording)
    state, squares = tracker.start(given, recording.scans[0].time), []
    for scan in recording.scans:
        state = tracker.step(state, scan)
        true = np.array([path.states[0] if (at := path.at(scan.time)) is None else at for path in recording.truth])
        squares.append(_squared(tracker.estimate(state).mean[:, :2] - true[:, :2]))
    return np.array(squares)


def _squared(error: Array) -> Array:
    found: Array = np.sum(error**2, axis=-1)
    return found


def _pictured(scene: dict[str, Any]) -> dict[str, Any]:
    chain = {"link": 30.0, "longest": 60.0, "threshold": 130.0}
    detector = {"kind": "radar_picture", "sensors": {"screen": {"kind": "radar_screen"}}, "chain": chain, "sigma": BOAT}
    return {"source": scene | {"reference": "ais"}, "detectors": {"radar": detector}}
