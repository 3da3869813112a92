"""The same figures on a recording with truth: reported, not judged, as no recording is drawn from a filter's models."""

from __future__ import annotations

import numpy as np
from attrs import frozen

from vedette.experiment import Experiment, Result
from vedette.metrics.consistency import Credibility, autocorrelation, free_axes, nees, noncredibility, pooled_nis
from vedette.space import Array, Mask, Space
from vedette.testing.judging import Misuse
from vedette.testing.montecarlo import innovation
from vedette.types import Gaussian, Track, Trajectory


@frozen(eq=False)
class Recorded:
    """What one track states about itself, compared with the truth that it followed.

    `anees` and `nis` are scaled so that 1 is expected; `whiteness` is the correlation of innovations at lag 1 by the
    sensors' own noise, None if no two successive scans have a return; `credibility` in dB, from the scans of this one run.
    """

    truth: str
    track: int
    scans: int
    anees: float
    nis: float
    whiteness: float | None
    credibility: Credibility

    @property
    def text(self) -> str:
        """One line."""
        white = "unknown" if self.whiteness is None else f"{self.whiteness:.2f}"
        return (
            f"{self.truth}: track {self.track}, {self.scans} scans, ANEES {self.anees:.2f} and NIS {self.nis:.2f} of what "
            f"is expected, innovations correlate by {white}, noncredibility {self.credibility.index:.1f} dB "
            f"(inclination {self.credibility.inclination:+.1f} dB)"
        )


def recorded_consistency(experiment: Experiment) -> tuple[Recorded, ...]:
    """Run an experiment whose source has truth, and report the track nearest to each object. Misuse without truth."""
    result = experiment.run()
    if not result.recording.truth:
        raise Misuse("source: has no truth, so errors are not known; give a recording that has")
    white = _whiteness(experiment, result)
    found = []
    for path in result.recording.truth:
        tracks = [(i, track) for i, track in enumerate(result.tracks) if _shared(track, path).any()]
        near = [(float(np.mean(_distance(track, path))), i) for i, track in tracks]
        if not near:
            continue
        track = result.tracks[min(near)[1]]
        told = _told(path, track, white.get(track.id))
        if told is not None:
            found.append(told)
    return tuple(found)


def _shared(track: Track, path: Trajectory) -> Mask:
    """Return the track's scans that lie within the object's life (s,)."""
    shared: Mask = (track.times >= path.times[0]) & (track.times <= path.times[-1])
    return shared


def _common(track: Track, path: Trajectory) -> Space:
    return Space(tuple(axis for axis in track.space.axes if axis in path.space.axes))


def _errors(track: Track, path: Trajectory) -> tuple[Array, Array]:
    """Return errors (s, n) and covariances (s, n, n) over the common axes, at the shared scans."""
    common, keep = _common(track, path), _shared(track, path)
    own, theirs = track.space.locate(common), path.space.locate(common)
    states = [state[theirs] for time in track.times[keep] if (state := path.at(float(time))) is not None]
    error = common.difference(np.array(states), track.mean[keep][:, own])
    return error, track.cov[keep][:, own][:, :, own]


def _distance(track: Track, path: Trajectory) -> Array:
    """Return the distance over the common axes in m (s,)."""
    error, _ = _errors(track, path)
    metres = [i for i, axis in enumerate(_common(track, path).axes) if axis.unit == "m"]
    distance: Array = np.linalg.norm(error[:, metres], axis=-1)
    return distance


def _told(path: Trajectory, track: Track, white: tuple[float | None, Array] | None) -> Recorded | None:
    error, cov = _errors(track, path)
    if len(error) <= error.shape[-1]:
        return None
    anees = float(np.mean(nees(error, cov) / free_axes(cov)))
    correlation, axes = white if white is not None else (None, np.full(len(track.times), 2.0))
    nis = float(pooled_nis(track.nis, track.hit, axes))
    return Recorded(path.name, track.id, len(error), anees, nis, correlation, noncredibility(error, cov))


def _whiteness(experiment: Experiment, result: Result) -> dict[int, tuple[float | None, Array]]:
    """Return by track id the correlation at lag 1 of its most used sensor's innovations, and the axes measured per scan."""
    tracker = experiment.tracker
    _, seed = np.random.SeedSequence(experiment.seed).spawn(2)
    given = tracker.given(result.recording)
    begin = result.scans[0].time if given is not None and result.scans else -np.inf
    state = tracker.start(given, begin, seed)
    seen: dict[int, dict[str, list[tuple[Array, Array] | None]]] = {}
    axes: dict[int, list[int]] = {}
    for scan in result.scans:
        sensor = tracker.sensors[scan.sensor] if scan.pose is None else tracker.sensors[scan.sensor].at(scan.pose)
        predicted = tracker.estimator.moments(tracker.predict(state, scan.time))
        before = state.ids.tolist()
        state = tracker.step(state, scan)
        for row, (track, weights) in enumerate(zip(state.ids.tolist(), state.weights, strict=True)):
            axes.setdefault(track, []).append(len(sensor.measurement))
            best = int(np.argmax(weights))
            entry = None
            if track in before and best and weights[best] > 0.5:
                at = before.index(track)
                prior = Gaussian(predicted.mean[at], predicted.cov[at])
                own = best - 1 if state.returns is None else state.returns[row, best - 1]
                entry = innovation(tracker, sensor, prior, scan.detections.z[own])
            seen.setdefault(track, {}).setdefault(scan.sensor, []).append(entry)
    return {track: (_correlation(looks), np.array(axes[track], dtype=float)) for track, looks in seen.items()}


def _correlation(looks: dict[str, list[tuple[Array, Array] | None]]) -> float | None:
    entries = max(looks.values(), key=lambda rows: sum(row is not None for row in rows))
    first = next((row for row in entries if row is not None), None)
    if first is None or len(entries) < 3:
        return None
    rows = [first if row is None else row for row in entries]
    valid = np.array([row is not None for row in entries])
    rho, count = autocorrelation(np.array([row[0] for row in rows]), np.array([row[1] for row in rows]), 1, valid)
    return float(rho[0]) if count[0] else None
