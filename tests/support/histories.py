"""Looks, truth and tracks of small scenes."""

import numpy as np

from vedette import Detections, Scan, Space, Track, Trajectory

PLANE = Space.of(x="m", y="m", vx="m/s", vy="m/s")


# Scenes
def looks(times, sensor="radar", axes=2):
    return [Scan(float(time), sensor, Detections.of([], axes)) for time in times]


def path(name, times, xy, v=(0.0, 0.0)):
    states = np.hstack([np.asarray(xy, dtype=float), np.broadcast_to(v, (len(times), 2))])
    return Trajectory(name, PLANE, np.asarray(times, dtype=float), states)


def history(number, times, xy, *, v=(0.0, 0.0), cov=None, confirmed=None, nis=None, hit=None, mode_prob=None):
    s = len(times)
    return Track(
        id=number,
        space=PLANE,
        times=np.asarray(times, dtype=float),
        mean=np.hstack([np.asarray(xy, dtype=float), np.broadcast_to(v, (s, 2))]),
        cov=np.broadcast_to(np.eye(4) if cov is None else cov, (s, 4, 4)),
        confirmed=np.ones(s, dtype=bool) if confirmed is None else np.array(confirmed, dtype=bool),
        existence=np.ones(s),
        mode_prob=mode_prob,
        weights=(np.array([0.0, 1.0]),) * s,
        nis=np.zeros(s) if nis is None else np.array(nis),
        hit=np.ones(s) if hit is None else np.array(hit),
    )


def still(times, x=0.0, y=0.0):
    return np.tile([x, y], (len(times), 1))


TEN = np.arange(10.0)
BOAT = path("boat", TEN, still(TEN))
