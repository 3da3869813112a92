"""What drawn truth says of the noises that a tracker states: it shows the errors of its start, motion and sensors."""

from __future__ import annotations

from collections.abc import Iterator
from itertools import combinations

import numpy as np
from attrs import frozen

from vedette import Array, Gaussian, Mask
from vedette.testing.truth import motion_of
from vedette_report.noises import SURE, sized
from vedette_report.whole_trackers.covariances import BEYOND_3
from vedette_report.whole_trackers.runs import Runs, distances

LEAST = 0.04
"""A variance is told as wrong that is off by such a part: by hand."""
ALIKE = 0.1
"""Q or a start is one number where those of its axes differ by no more than chance and such a part: by hand."""
TOLERATED = 0.02
"""How errors go on, or how many are far off, is told beyond this and 3.5 deviations: by hand."""
CLEARED = 0.5
"""A noise is not to blame if its variance is known this well: by hand."""
ROUNDING = 1e-6
"""Errors where none are stated are none that are smaller, in their unit."""


@frozen(eq=False)
class Stated:
    """Errors u (r, s, m) along axes, in deviations that a model states, with the correlations (r, s, m, m) that it states.

    `seen` (r, s): where there is one; `far` (r, s): how far a sensor's target is, 1 for all where that says nothing;
    `moved`: the axes along which a model states none, and there are some.
    """

    name: str
    axes: tuple[str, ...]
    u: Array
    correlations: Array
    seen: Mask
    far: Array
    sensor: str = ""
    moved: tuple[str, ...] = ()

    @classmethod
    def of(
        cls, name: str, axes: tuple[str, ...], error: Array, cov: Array, seen: Mask, far: Array, sensor: str = ""
    ) -> Stated:
        """Return errors (r, s, m) of covariances that broadcast to (r, s, m, m), along the axes that have a variance."""
        cov = np.broadcast_to(cov, (*error.shape, error.shape[-1]))
        variance = np.diagonal(cov, axis1=-2, axis2=-1)
        moves = np.abs(np.where(seen[..., None], error, 0.0)).max(axis=(0, 1)) > ROUNDING
        moved = tuple(axes[i] for i in np.flatnonzero(moves & (variance.max(axis=(0, 1)) <= 0)))
        free = np.flatnonzero(variance.min(axis=(0, 1)) > 0)
        cov = cov[..., free, :][..., free]
        spread = np.sqrt(np.diagonal(cov, axis1=-2, axis2=-1))
        u = np.where(seen[..., None], error[..., free] / spread, 0.0)
        correlations = cov / spread[..., None] / spread[..., None, :]
        return cls(name, tuple(axes[i] for i in free), u, correlations, seen, far, sensor, moved)

    def mean(self, values: Array, where: Mask) -> tuple[float, float]:
        """Return the mean of values (r, s) over scans and runs, and its error; only runs are independent."""
        count, total = where.sum(axis=1), np.sum(np.where(where, values, 0.0), axis=1)
        usual = max(float(count.mean()), 1e-300)
        mean = float(total.mean()) / usual
        return mean, float(np.std(total - mean * count, ddof=1) / np.sqrt(len(count))) / usual

    def sizes(self) -> list[tuple[float, float]]:
        """Return by axis how large the variance is over that which is stated, and its error."""
        return [self.mean(self.u[..., i] ** 2, self.seen) for i in range(len(self.axes))]

    def shapes(self) -> dict[str, tuple[float, float, float]]:
        """Return how much alike successive errors are, how many are beyond 3 of their deviations over 1, and their growth.

        Each is the figure that stands out most of all axes; with how far it is off, over what may be by chance.
        """
        pair = self.seen[:, 1:] & self.seen[:, :-1]
        far = np.log(np.maximum(self.far, 1e-9))
        far = far - np.mean(far[self.seen])
        found: dict[str, tuple[float, float, float]] = {}
        for i, (size, _) in enumerate(self.sizes()):
            u = self.u[..., i] / np.sqrt(max(size, 1e-300))
            tried = {
                "lag": self.mean(u[:, 1:] * u[:, :-1], pair),
                "tails": self.mean(10.0 * ((np.abs(u) > 3.0) - BEYOND_3), self.seen),
                "distance": self.mean((u**2 - 1.0) * far / max(float(np.mean(far[self.seen] ** 2)), 1e-3), self.seen),
            }
            for kind, (mean, error) in tried.items():
                off = (mean if kind == "tails" else abs(mean)) / (3.5 * error + TOLERATED)
                found[kind] = max(found.get(kind, (0.0, 0.0, -1.0)), (mean, error, off), key=lambda one: one[2])
        return found


def stated(played: Runs, prior: Gaussian) -> Iterator[Stated]:
    """Yield the errors of the start, of the motion if there is one that states its noise, and of each sensor."""
    tracker, truth = played.tracker, played.truth
    axes, ones = tracker.state, np.ones(truth.shape[:2])
    yield Stated.of(
        "the covariance of the start", axes.names, axes.difference(truth[:, :1], prior.mean), prior.cov,
        ones[:, :1] > 0, ones[:, :1],
    )  # fmt: skip
    motion = motion_of(tracker.estimator)
    if motion is not None and not motion.reframes and set(motion.state.names) <= set(axes.names):
        own, steps = truth[..., axes.locate(motion.state)], np.diff(played.times, prepend=0.0)
        moved = [motion.move(own[:, k], dt) for k, dt in enumerate(steps.tolist())]
        left = motion.state.difference(own[:, 1:], np.stack(moved, axis=1))
        Q = [np.broadcast_to(motion.noise(own[:, k], dt), (*left[:, k].shape, left.shape[-1])) for k, dt in enumerate(steps)]
        yield Stated.of("Q", motion.state.names, left, np.stack(Q, axis=1), ones[:, 1:] > 0, ones[:, 1:])
    for name, looks in played.looks.items():
        sensor = tracker.sensors[name]
        there = truth[:, 1:][..., axes.locate(sensor.observes)]
        far = distances(sensor, there)
        R = sensor.noise(there)
        yield Stated.of(f"R of {name}", sensor.measurement.names, looks.apart, R, looks.seen, far, name)


def told(one: Stated) -> tuple[list[str], list[str]]:
    """Return what is wrong with what a model states, in words, and which of its noises are right."""
    sizes, right = one.sizes(), []
    said = [f"{one.name} along {axis} is 0, and the truth's is not" for axis in one.moved]
    parts = [(f"{one.name} along {axis}", *size) for axis, size in zip(one.axes, sizes, strict=True)]
    if sizes and not one.sensor:
        whole, error = one.mean(np.mean(one.u**2, axis=-1), one.seen)
        if all(abs(size - whole) <= SURE * off + ALIKE * whole for size, off in sizes):
            parts = [(one.name, whole, error)]
    for name, size, off in parts:
        if text := sized(name, size, off, LEAST):
            said.append(text)
        elif SURE * off < CLEARED:
            right.append(name)
    for i, j in combinations(range(len(one.axes)), 2):
        power = np.sqrt(max(sizes[i][0] * sizes[j][0], 1e-300))
        real, error = one.mean(one.u[..., i] * one.u[..., j] / power, one.seen)
        stated = float(np.mean(one.correlations[..., i, j][one.seen]))
        if abs(real - stated) > max(SURE * error, 0.05):
            pair = f"{one.name} between {one.axes[i]} and {one.axes[j]}"
            said.append(f"{pair} is correlated by {real:.2g}, not by {stated:.2g} (+- {error:.1g})")
    return said, right
