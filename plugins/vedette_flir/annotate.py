"""A run through images as a video: each frame with the tracks and the true boxes."""

from __future__ import annotations

import os
from collections.abc import Sequence
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from vedette import Array, Experiment, Result, Scan, Track
from vedette_flir.sources.images import Grey

NAME = "annotated.avi"

LEAST = 320
"""Least width of a video in px: smaller frames are enlarged by a whole number."""

CROSS, BOX, TEXT = (0, 128, 255), (0, 200, 0), (200, 200, 200)
"""Colours in OpenCV's order: blue, green, red."""


def annotated(folder: Path, experiment: Experiment, result: Result) -> list[str]:
    """Write a Motion JPEG video if the run has images in px and OpenCV is installed; return the names of the files."""
    scans = result.framed
    x = [axis for axis in experiment.tracker.state.axes if axis.name == "x"]
    if not len(scans) or not x or x[0].unit != "px":
        return []
    first = scans[0].frame
    if first is None or first.pixels.ndim != 2:
        return []
    try:
        import cv2
    except ImportError:
        return []
    low, high = _levels(scans)
    times = np.array([scan.time for scan in result.scans])
    rate = 1.0 / float(np.median(np.diff(times))) if len(times) > 1 else 30.0
    unfinished = folder / f".{os.getpid()}.{NAME}"
    writer = None
    try:
        for scan in scans:
            image = _drawn(cv2, _eight_bit(scan, low, high), scan, experiment, result)
            if writer is None:
                shape = image.shape[1::-1]
                writer = cv2.VideoWriter(str(unfinished), cv2.VideoWriter.fourcc(*"MJPG"), rate, shape)
                if not writer.isOpened():
                    return []
            writer.write(image)
        assert writer is not None
        writer.release()
        unfinished.replace(folder / NAME)
    finally:
        unfinished.unlink(missing_ok=True)
    return [NAME]


def _levels(scans: Sequence[Scan]) -> tuple[float, float]:
    """Return the counts shown as black and white: between them lie 99 % of the pixels of some twenty frames."""
    some = scans[:: max(1, len(scans) // 20)]
    counts = np.concatenate([np.asarray(scan.frame.pixels, dtype=float).ravel() for scan in some if scan.frame is not None])
    known = counts[np.isfinite(counts)]
    if not len(known):
        return 0.0, 1.0
    low, high = np.percentile(known, [0.5, 99.5])
    return float(low), float(max(high, low + 1e-6))


def _eight_bit(scan: Scan, low: float, high: float) -> Grey:
    """Return a frame in grey levels from 0 to 255; unknown pixels are black."""
    assert scan.frame is not None
    levels = 255.0 * (np.asarray(scan.frame.pixels, dtype=float) - low) / (high - low)
    return np.nan_to_num(levels, nan=0.0).clip(0, 255).astype(np.uint8)


def _drawn(cv2: Any, grey: Grey, scan: Scan, experiment: Experiment, result: Result) -> NDArray[Any]:
    """Draw the frame in colour, enlarged, with a cross where each track appears and the true boxes."""
    assert scan.frame is not None
    scale = max(1, -(-LEAST // grey.shape[1]))
    image = cv2.cvtColor(np.kron(grey, np.ones((scale, scale), np.uint8)), cv2.COLOR_GRAY2BGR)
    corner = np.zeros(2) if scan.frame.corner is None else scan.frame.corner

    def place(point: Array) -> tuple[int, int]:
        x, y = np.rint(scale * (point - corner + 0.5)).clip(-1e4, 1e4).astype(int)
        return int(x), int(y)

    for truth in result.recording.truth:
        state = truth.at(scan.time)
        if state is None or not {"x", "y", "width", "height"} <= set(truth.space.names):
            continue
        at = dict(zip(truth.space.names, state, strict=True))
        middle, half = np.array([at["x"], at["y"]]), 0.5 * np.array([at["width"], at["height"]])
        cv2.rectangle(image, place(middle - half), place(middle + half), BOX, 1)
    for track in result.tracks:
        point = _appears(track, scan, experiment)
        if point is not None:
            cv2.drawMarker(image, place(point), CROSS, cv2.MARKER_CROSS, 12, 1)
    cv2.putText(image, f"{scan.time:.2f} s", (4, image.shape[0] - 6), cv2.FONT_HERSHEY_SIMPLEX, 0.4, TEXT, 1, cv2.LINE_AA)
    drawn: NDArray[Any] = image
    return drawn


def _appears(track: Track, scan: Scan, experiment: Experiment) -> Array | None:
    """Return where the scan's camera sees a track (2,), or None if it did not exist then."""
    k = int(np.searchsorted(track.times, scan.time))
    if k >= len(track.times) or track.times[k] != scan.time:
        return None
    sensor = experiment.tracker.sensors[scan.sensor]
    return sensor.measure(track.mean[k, track.space.locate(sensor.observes)])[:2]
