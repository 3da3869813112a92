"""What a tracker expected of a scan: each track's measurement, the innovation's covariance, and the gate on the map."""

from __future__ import annotations

import numpy as np
from attrs import frozen

from vedette import Array, Gaussian, ImagingSensor, Scan, Tracker
from vedette.tracking import State
from vedette_report.map.plane import Plane


@frozen(eq=False)
class GatesOnMap:
    """Of tracks (t,): the expected measurement (t, m), the covariance S (t, m, m) of its innovation, and both on the map.

    position (t, 2) and cov (t, 2, 2): the gate on the map is where (p - position)' cov^-1 (p - position) is at most the
    threshold of the sensor. All is NaN for tracks that the scan began, and on the map where a return gives no position.
    """

    expected: Array
    innovation: Array
    position: Array
    cov: Array

    @classmethod
    def unknown(cls, tracks: int, axes: int) -> GatesOnMap:
        """Return those of a scan that has none, as a camera's."""
        return cls(*(np.full((tracks, *shape), np.nan) for shape in ((axes,), (axes, axes), (2,), (2, 2))))


def gates(tracker: Tracker, scan: Scan, before: State, after: State, plane: Plane | None) -> GatesOnMap:
    """Return the gates of the tracks after a scan, from the prediction of the state before it: S = H P H' + R.

    The prediction's mean and covariance stand for the whole belief: the gate of a mixture is the union of its modes'. R is
    the sensor's, or the mean of the returns' own.
    """
    sensor = tracker.sensors[scan.sensor]
    gates = GatesOnMap.unknown(len(after.ids), len(sensor.measurement))
    known, old, new = np.intersect1d(before.ids, after.ids, assume_unique=True, return_indices=True)
    if scan.frame is not None or isinstance(sensor, ImagingSensor) or not len(known):
        return gates
    noise = scan.detections.noise
    R = None if noise is None or not len(noise) else np.mean(noise, axis=0)
    with np.errstate(all="ignore"):
        it = tracker.expect(before, scan)
        sensor, ahead = it.sensor, it.tracks
        ahead = Gaussian(ahead.mean[old], ahead.cov[old])
        gates.expected[new], S, H = it.returns_of(ahead, R)
        gates.innovation[new] = S
        if plane is not None and plane.within(sensor.observes) and len(sensor.measurement) > 1:
            x = ahead.mean[:, tracker.state.locate(sensor.observes)]
            gates.position[new] = plane.points(sensor.observes, x)
            gates.cov[new] = _on_the_map(
                S, np.broadcast_to(H, (*S.shape[:-1], H.shape[-1]))[..., sensor.observes.locate(plane.space)]
            )
    return gates


def _on_the_map(S: Array, H: Array) -> Array:
    """Return (H' S^-1 H)^-1, the gate's covariance on the map: (t, m, m), (t, m, 2) -> (t, 2, 2), NaN where singular."""
    try:
        information = np.swapaxes(H, -1, -2) @ np.linalg.solve(S, H)
    except np.linalg.LinAlgError:
        return np.full((len(S), 2, 2), np.nan)
    a, b, d = information[:, 0, 0], information[:, 0, 1], information[:, 1, 1]
    det = a * d - b * b
    inverse = np.empty_like(information)
    inverse[:, 0, 0], inverse[:, 1, 1] = d / det, a / det
    inverse[:, 0, 1] = inverse[:, 1, 0] = -b / det
    inverse[~(det > 1e-9 * a * d)] = np.nan
    return inverse
