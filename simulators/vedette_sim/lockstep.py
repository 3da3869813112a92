"""Draw a scene of one object for many runs at once: each run's numbers come in blocks from its own generator."""

from __future__ import annotations

from collections.abc import Mapping, Sequence

import numpy as np
from attrs import frozen

from vedette import Array, Detections, Mask, MotionModel, Pose, Scan, Sensor, kernels
from vedette.sampling import (
    Bounds,
    ceiling,
    common_state,
    corners,
    follow,
    follow_modes,
    returns,
    switch,
    thinned,
    union_state,
)
from vedette_sim.ships import PLANE, Ship

Generators = Sequence[np.random.Generator]


@frozen(eq=False)
class Gaze:
    """One sensor's scans: name, times (s,), the sensor at each time, the platform's poses, and where clutter falls."""

    name: str
    times: Array
    placed: tuple[Sensor, ...]
    poses: tuple[Pose | None, ...]
    clutter: Mapping[str, Bounds] | None


def ship_states(ship: Ship, times: Array, rngs: Generators) -> Array:
    """Repeat the same path for every run: (r, s, 4)."""
    return np.broadcast_to(ship.states(times), (len(rngs), len(times), len(PLANE)))


def drawn_states(
    models: Sequence[MotionModel],
    start: Mapping[str, tuple[float, float]],
    transition: Array,
    times: Array,
    rngs: Generators,
) -> Array:
    """Draw a random path in each run over the axes that all models have: (r, s, n); see `Drawn`."""
    space, steps = union_state(models), len(times) - 1
    mean, deviation = np.array([start[name] for name in space.names]).T
    many = len(models) > 1
    normal = kernels.normals(rngs, (1 + steps * (1 + many), len(space)))
    uniform = kernels.uniforms(rngs, (steps * many,))
    x0, standard = mean + deviation * normal[:, 0], normal[:, 1 : 1 + steps]
    if not many:
        return follow(models[0], x0, times, standard)
    modes = switch(transition, 0, times, uniform)
    fresh = mean + deviation * normal[:, 1 + steps :]
    return follow_modes(models, modes, x0, times, standard, fresh)[..., space.locate(common_state(models))]


def look_together(gaze: Gaze, x: Array, rngs: Generators) -> list[Scan]:
    """Draw the scans of one sensor of objects x (r, s, n) over the axes that it observes."""
    r, s, m = len(rngs), len(gaze.times), len(gaze.placed[0].measurement)
    normal, uniform = kernels.normals(rngs, (s, m)), kernels.uniforms(rngs, (s,))
    if gaze.poses[0] is None:
        z, seen = returns(gaze.placed[0], x, uniform, normal)
        seen = np.broadcast_to(seen, (r, s))
    else:
        pairs = [returns(p, x[:, i], uniform[:, i], normal[:, i]) for i, p in enumerate(gaze.placed)]
        z, seen = np.stack([one[0] for one in pairs], axis=1), np.stack([one[1] for one in pairs], axis=1)
    if gaze.clutter is None:
        scans = [Detections(z[:, i, None], seen[:, i, None]) for i in range(s)]
    else:
        scans = _among_clutter(gaze, gaze.clutter, z, seen, rngs)
    return [
        Scan(time, gaze.name, seen, pose) for time, seen, pose in zip(gaze.times.tolist(), scans, gaze.poses, strict=True)
    ]


def _among_clutter(gaze: Gaze, region: Mapping[str, Bounds], z: Array, seen: Mask, rngs: Generators) -> list[Detections]:
    """Put each scan's return z (r, s, m) in a random place among clutter, which is thinned from a uniform process."""
    r, s, m = z.shape
    lows, highs = corners(gaze.placed[0].measurement, region)
    volume = float(np.prod(highs - lows))
    alike = gaze.poses[0] is None
    bound = np.array([ceiling(sensor, lows, highs) for sensor in (gaze.placed[:1] if alike else gaze.placed)])
    rate = np.broadcast_to(bound * volume, (s,))
    counts, places, blocks = np.empty((r, s), dtype=np.intp), np.empty((r, s)), []
    for i, rng in enumerate(rngs):
        counts[i] = rng.poisson(rate)
        rng.random(out=places[i])
        blocks.append(rng.random((int(np.sum(counts[i])), m + 1)))
    k = int(np.max(counts, initial=0))
    false, chance = np.zeros((s, r, k, m)), np.ones((s, r, k))
    kept = np.arange(k) < counts.T[..., None]
    block = np.concatenate(blocks) if blocks else np.zeros((0, m + 1))
    run, look, slot = np.nonzero(np.arange(k) < counts[..., None])
    false[look, run, slot] = lows + (highs - lows) * block[:, :m]
    chance[look, run, slot] = block[:, m]
    scans = []
    for i in range(s):
        sensor = gaze.placed[0 if alike else i]
        there = thinned(sensor, false[i], chance[i], float(bound[0 if alike else i]), kept[i])
        every = np.concatenate([z[:, i, None], sensor.measurement.canonical(false[i])], axis=1)
        valid = np.concatenate([seen[:, i, None], there], axis=1)
        scans.append(_mixed(every, valid, places[:, i]))
    return scans


def _mixed(z: Array, valid: Mask, place: Array) -> Detections:
    """Put the valid returns first, the object's own, which is at 0, in a random place among them; pad with 0."""
    order = np.argsort(~valid, axis=-1, kind="stable")[:, : max(1, int(np.max(np.sum(valid, axis=-1), initial=0)))]
    valid, z = np.take_along_axis(valid, order, -1), np.take_along_axis(z, order[..., None], -2)
    rows = np.arange(len(z))
    other = np.floor(place * np.maximum(np.sum(valid, axis=-1), 1)).astype(np.intp)
    first = z[:, 0].copy()
    z[:, 0] = z[rows, other]
    z[rows, other] = first
    return Detections(np.where(valid[..., None], z, 0.0), valid)
