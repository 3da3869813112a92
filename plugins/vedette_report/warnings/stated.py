"""Whether confirmed tracks are detected, and returns are false, as often as the sensors state."""

from __future__ import annotations

from collections import defaultdict
from collections.abc import Iterator, Sequence

import numpy as np

from vedette import Array, ImagingSensor, Scan, Sensor, Track, Tracker
from vedette_report.columns import percent
from vedette_report.detector_errors.in_tracks import SURELY, first_of, rows_of, scans_at

LOOKS, OFF = 30, 0.25
"""Of so many looks, a share of detections so far from the stated one is told. By hand."""
FACTOR = 10.0
"""False returns are told where they are so many times as many as stated, or as few."""
FEWEST = 20
"""Fewer returns tell no volume. By hand."""
ENOUGH, LEAST = 20, 0.1
"""Fewer scans tell nothing of clutter, and fewer false returns a scan are as good as so few. By hand."""


def otherwise(tracker: Tracker, scans: Sequence[Scan], tracks: Sequence[Track]) -> Iterator[str]:
    """Yield a sentence for each sensor that gives false returns, or else detects, much more or less often than it states."""
    scans = first_of(scans)
    looks, taken = _looks(tracker, scans, tracks)
    for name, sensor in tracker.sensors.items():
        if isinstance(sensor, ImagingSensor) or sensor.claims:
            continue
        own = [i for i, scan in enumerate(scans) if scan.sensor == name]
        told = _false(sensor, [scans[i] for i in own], taken[own]) if tracker.gate.clutter == "sensor" else ""
        told = told or (_detected(*looks[name]) if name in looks else "")
        if told:
            yield f"{name}: {told}"


def _false(sensor: Sensor, scans: Sequence[Scan], taken: Array) -> str:
    """Return that its false returns are not those stated, of its scans and what tracks took of each (s,); "" if they are."""
    z = [scan.detections.z[scan.detections.valid] for scan in scans if scan.detections.missing is None]
    if len(z) < max(ENOUGH, len(scans)) or sum(map(len, z)) < FEWEST:
        return ""
    every = np.concatenate(z)
    low, high = np.quantile(every, (0.02, 0.98), axis=0)  # a few far ones left out, of those that came as of those stated
    near = np.count_nonzero(np.all((low <= every) & (every <= high), axis=-1))
    came, loose = len(every) / len(z), max(near - float(np.sum(taken)), 0.0) / len(z)
    expected = float(np.prod(high - low) * np.mean(sensor.clutter(every)))
    told = f"{loose:.2g} returns a scan are of no confirmed track, and where they are {expected:.2g} false ones are stated"
    if loose > FACTOR * max(expected, LEAST):
        times = f"{loose / expected:.2g} times " if expected else ""
        return f"{told}: is its clutter {times}too low, or are targets not tracked?"
    if expected > FACTOR * (came + 1):
        return f"{told}: is its clutter {expected / max(loose, 1.0):.2g} times too high?"
    return ""


def _detected(declared: Array, hit: Array) -> str:
    """Return that confirmed tracks were not detected as often as declared, by look (l,); "" if they were."""
    stated, found = float(np.mean(declared)), float(np.mean(hit))
    if len(hit) < LOOKS or abs(found - stated) < OFF:
        return ""
    told = f"confirmed tracks took a return in {percent(found)} of {len(hit):,} looks, and {percent(stated)} is stated"
    return f"{told}: is its detection probability right{'' if found > stated else ', or do tracks leave their targets'}?"


def _looks(tracker: Tracker, scans: Sequence[Scan], tracks: Sequence[Track]) -> tuple[dict[str, Array], Array]:
    """Return by sensor each look at a confirmed track: how probably it was to detect it, and did (2, l); what each scan hit.

    The looks after a track's last detection are left out: its target may be gone.
    """
    at, taken = scans_at(scans), np.zeros(len(scans))
    seen = defaultdict[tuple[str, int | None], list[tuple[float, Array]]](list)
    for track in tracks:
        last = int(np.max(np.flatnonzero(track.hit > SURELY), initial=-1))
        for row, i in rows_of(track, at):
            scan, hit = scans[i], float(track.hit[row])
            taken[i] += hit  # before it was confirmed, too
            if scan.frame is None and 0 < row <= last and track.confirmed[row - 1] and track.confirmed[row]:
                seen[scan.sensor, None if scan.pose is None else i].append((hit, track.mean[row]))
    looks = defaultdict[str, list[Array]](list)
    for (name, place), rows in seen.items():
        sensor = tracker.sensors[name].placed(None if place is None else scans[place].pose)
        hits = np.array([hit for hit, _ in rows])
        x = np.array([mean for _, mean in rows])[:, tracker.state.locate(sensor.observes)]
        looks[name].append(np.stack([np.broadcast_to(sensor.detects(x), hits.shape) * tracker.gate.probability, hits]))
    return {name: np.concatenate(parts, axis=1) for name, parts in looks.items()}, taken
