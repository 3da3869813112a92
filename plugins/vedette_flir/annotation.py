"""A run through images as a video: each frame with the tracks, held or lost, and the true boxes."""

from __future__ import annotations

import csv
import os
from collections import defaultdict
from collections.abc import Sequence
from itertools import pairwise
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from vedette import Array, Experiment, Result, Scan, Sensor, Track
from vedette_flir.sources.images import Grey

NAME, EPISODES = "annotated.avi", "episodes.csv"

LEAST = 320
"""Least width of a video in px: smaller frames are enlarged by a whole number."""

WIDE = 640
"""Width in px of a frame for each px of a line's, as large ones are looked at as a whole."""

HELD, LOST, BOX, TEXT = (0, 128, 255), (60, 60, 255), (0, 200, 0), (200, 200, 200)
"""Colours in OpenCV's order: blue, green, red."""

DOUBT = 0.5
"""A track that exists with a lower probability has lost its target."""

SURE = 0.95
"""Probability of a link below which a track may have become that of another target."""

TRAIL = 30
"""Frames whose positions are drawn behind a track."""

SMALL, ZOOM, ASIDE = 24.0, 3, 40
"""Targets up to this size in px are shown enlarged at least so many times, this many px of the frame around them, in a third
of its lower side.
"""


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
    times = np.unique([scan.time for scan in result.scans])
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
    """Return the counts shown as black and white: between them lie 99 % of the pixels of some twenty frames, of large ones
    of every few.
    """
    some = [scan.frame.pixels for scan in scans[:: max(1, len(scans) // 20)] if scan.frame is not None]
    every = 1 + some[0].shape[1] // WIDE
    counts = np.concatenate([pixels[::every, ::every].astype(float).ravel() for pixels in some])
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
    """Draw the frame in colour, enlarged: each track's box, red and told if lost or new, its trail, and the true boxes.

    Nothing is drawn inside a box, so that the target stays to be seen; a small one is shown enlarged in a corner.
    """
    assert scan.frame is not None
    scale = max(1, -(-LEAST // grey.shape[1]))
    image = cv2.cvtColor(np.kron(grey, np.ones((scale, scale), np.uint8)), cv2.COLOR_GRAY2BGR)
    thick = max(1, image.shape[1] // WIDE)
    corner = np.zeros(2) if scan.frame.corner is None else scan.frame.corner

    def place(point: Array) -> tuple[int, int]:
        x, y = np.rint(scale * (point - corner + 0.5)).clip(-1e4, 1e4).astype(int)
        return int(x), int(y)

    taken = []
    for truth in result.recording.truth:
        state = truth.at(scan.time)
        if state is None or not {"x", "y", "width", "height"} <= set(truth.space.names):
            continue
        at = dict(zip(truth.space.names, state, strict=True))
        middle, half = np.array([at["x"], at["y"]]), 0.5 * np.array([at["width"], at["height"]])
        taken.append((*place(middle - half), *place(middle + half)))
        cv2.rectangle(image, taken[-1][:2], taken[-1][2:], BOX, thick)
    zoomed = None
    for number, track in enumerate(result.tracks):
        k = int(np.searchsorted(track.times, scan.time))
        if k >= len(track.times) or track.times[k] != scan.time:
            continue
        points = _appears(track, slice(max(0, k - TRAIL), k + 1), experiment.tracker.sensors[scan.sensor])
        doubted = track.existence[k] < DOUBT
        colour, size = LOST if doubted else HELD, _size(track, k)
        if number == 0 and size.max() <= SMALL:
            zoomed = _enlarged(image, scale, points[-1] - corner)
        outside = np.any(np.abs(points - points[-1]) > 0.5 * size + 1.0, axis=1)
        for before, now in pairwise(points[outside]):
            cv2.line(image, place(before), place(now), colour, thick)
        half = 0.5 * size + 1.0 + thick // 2
        taken.append((*place(points[-1] - half), *place(points[-1] + half)))
        cv2.rectangle(image, taken[-1][:2], taken[-1][2:], colour, thick)
        words = [str(track.id)] * (len(result.tracks) > 1) + ["lost" if track.confirmed[k] else "new"] * int(doubted)
        _write(cv2, image, " ".join(words), (taken[-1][0], taken[-1][1] - 3 * thick), colour, thick)
    if zoomed is not None:
        _put(image, zoomed, taken)
    _write(cv2, image, f"{scan.time:.2f} s", (4 * thick, image.shape[0] - 6 * thick), TEXT, thick)
    drawn: NDArray[Any] = image
    return drawn


def _write(cv2: Any, image: NDArray[Any], text: str, at: tuple[int, int], colour: tuple[int, int, int], thick: int) -> None:
    """Write words whose lower left corner is at a place, or as near to it as they are in the image, on a dark rim."""
    font, size = cv2.FONT_HERSHEY_SIMPLEX, 0.4 * thick
    (width, height), below = cv2.getTextSize(text, font, size, thick)
    x = max(2, min(at[0], image.shape[1] - width - 2))
    y = max(height + 2, min(at[1], image.shape[0] - below))
    for shade, wide in (((0, 0, 0), 3 * thick), (colour, thick)):
        cv2.putText(image, text, (x, y), font, size, shade, wide, cv2.LINE_AA)


def episodes(folder: Path, result: Result) -> list[str]:
    """Write when tracks lost their target, found it again, or may have exchanged it, if any did; return the files' names.

    They are those of tracks.csv in the folder: a run that was written as it went has kept none.
    """
    if not result.intake.frames:
        return []
    rows, lost, met = list[tuple[int, str]](), dict[int, bool](), defaultdict[str, list[int]](list)
    with (folder / "tracks.csv").open(encoding="utf-8", newline="") as file:
        for row in csv.DictReader(file):
            track, now = int(row["track"]), float(row["existence"] or "nan") < DOUBT
            if row["confirmed"] == "0":
                continue  # a track that begins is doubted, not lost
            if now != lost.get(track, False):
                rows.append((track, f"{track},{float(row['time'])!r},{'lost' if now else 'found again'}\n"))
            lost[track] = now
            if float(row.get("link") or "nan") < SURE:
                met[row["time"]].append(track)
    for time, tracks in met.items():
        for track in tracks:
            others = " and ".join(str(other) for other in tracks if other != track)
            rows += [(track, f"{track},{float(time)!r},may have been exchanged with {others}\n")] if others else []
    if not rows:
        return []
    rows.sort(key=lambda row: (row[0], float(row[1].split(",")[1])))
    text = "".join(["track,time,event\n", *(line for _, line in rows)])
    (folder / EPISODES).write_text(text, encoding="utf-8", newline="\n")
    return [EPISODES]


def _appears(track: Track, part: slice, sensor: Sensor) -> Array:
    """Return where a camera sees a track in some scans (s, 2)."""
    return sensor.measure(track.mean[part][:, track.space.locate(sensor.observes)])[:, :2]


def _size(track: Track, k: int) -> Array:
    """Return width and height of a track's box in px; 12 where its state has none."""
    names = track.space.names
    return np.array([track.mean[k, names.index(name)] if name in names else 12.0 for name in ("width", "height")])


def _enlarged(image: NDArray[Any], scale: int, at: Array) -> NDArray[Any] | None:
    """Return what is around a place, in px of the frame, enlarged; None for a place outside the image."""
    height, width = image.shape[:2]
    middle = scale * (at + 0.5)
    if np.any(middle < 0) or np.any(middle > [width, height]):
        return None
    zoom = max(ZOOM, min(height, width) // (3 * ASIDE * scale))
    side = min(ASIDE * scale, height // (2 * zoom), width // (2 * zoom))
    x, y = np.clip(np.rint(middle - side / 2).astype(int), 0, [width - side, height - side])
    return np.kron(image[y : y + side, x : x + side], np.ones((zoom, zoom, 1), np.uint8))


def _put(image: NDArray[Any], zoomed: NDArray[Any], taken: Sequence[tuple[int, int, int, int]]) -> None:
    """Put an enlarged part, framed, into the corner farthest from the boxes in which it covers none; nowhere without one.

    `taken`: left, top, right and bottom of each box.
    """
    side = len(zoomed)
    boxes = np.array(taken)
    best, where = 0.0, None
    for x in (0, image.shape[1] - side):
        for y in (0, image.shape[0] - side):
            gaps = np.maximum([x, y] - boxes[:, 2:], boxes[:, :2] - [x + side, y + side]).max(axis=1)
            if gaps.min() > best:
                best, where = float(gaps.min()), (x, y)
    if where is None:
        return
    zoomed[[0, -1]] = zoomed[:, [0, -1]] = TEXT
    image[where[1] : where[1] + side, where[0] : where[0] + side] = zoomed
