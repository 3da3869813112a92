"""Many runs of a tracker in one batch, on truth drawn from its own models and returns drawn from its own sensors."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any, final

import numpy as np
from attrs import define, evolve, field, fields_dict, frozen

from vedette import Array, Detections, Gaussian, Mask, Recording, Scan, Sensor, Tracker
from vedette.filters import expected_return
from vedette.sampling import densities, returns, thinned
from vedette.testing import Misuse
from vedette.testing.truth import draw_moded, motion_of
from vedette.tracking import State
from vedette_report.whole_trackers.world import World, world_of
from vedette_standard import SingleTarget

OPEN_GATE = 1.0 - 1e-9
"""Without clutter the gate excludes nothing: an open gate leaves the chi-square tails whole."""
MOST_FALSE = 2_000
"""A run whose gate would hold about a tenth as many false returns has lost its target: it gets none from then on."""
LEAST = 1e-12
"""A mode that has no probability counts as one that has this."""


@frozen(eq=False)
class Looks:
    """One sensor's looks in all runs.

    The target's innovation: residual (r, s, m), its covariance (r, s, m, m), and whether it was detected (r, s). `pooled`
    (r, s, m) is the innovation that the tracker used: that of all returns, weighted. `declared` (r, s) is the detection
    probability that the tracker states; of `candidates` (r, s) for false returns `false` (r, s) became one, and `expected`
    (r, s) should have by the density that the tracker states. `distance` (r, s) is how far the target is expected to be.
    `apart` (r, s, m) is the target's return less what the tracker's sensor measures of the truth, which is `real` (r, s, m).
    `own` (r, s) is the `nis` that the estimator itself gave the target's return.
    """

    residual: Array
    cov: Array
    seen: Mask
    pooled: Array
    declared: Array
    false: Array
    candidates: Array
    expected: Array
    distance: Array
    apart: Array
    real: Array
    own: Array

    def of(self, runs: Any) -> Looks:
        """Return the looks of some runs."""
        return Looks(*(getattr(self, name)[runs] for name in fields_dict(Looks)))


@frozen(eq=False)
class Runs:
    """The result of the runs: errors (r, s, n) and covariances (r, s, n, n) at times (s,), estimates (r, s, n), and looks;
    `truth` (r, 1 + s, n) is of the start at 0 s, too.

    `exact` says whether chi-square holds for them, and `why` not. `drowned` (r,) are runs that knew so little of their
    target that there was no end to the clutter around it. `surprise` (r, s) is how many nats a mixture's probability of the
    mode that was active is short of 1; None where that is not known.
    """

    tracker: Tracker
    times: Array
    error: Array
    cov: Array
    mean: Array
    truth: Array
    looks: Mapping[str, Looks] = field(repr=False)
    exact: bool
    why: str
    drowned: Mask
    surprise: Array | None = None


def prior_of(tracker: Tracker, given: Mapping[str, tuple[float, float]] | None) -> Gaussian:
    """Return the target's prior, mean (n,) and cov (n, n): `given`, axis to [mean, standard deviation], or the birth's."""
    names = tracker.state.names
    if given is None:
        try:
            own = tracker.given(Recording(()))
        except ValueError:
            own = None
        if own is None:
            axes = ", ".join(f"{name!r}: (mean, deviation)" for name in names)
            raise Misuse(f"prior: the tracker does not say where its target starts; give prior={{{axes}}}")
        return Gaussian(own.mean[0], own.cov[0])
    for name in given:
        if name not in names:
            raise Misuse(f"prior.{name}: the tracker has no such axis; its axes are {', '.join(names)}")
    if missing := [name for name in names if name not in given and name not in tracker.estimator.zero_variance]:
        raise Misuse(f"prior: must give [mean, standard deviation] of {', '.join(missing)} too")
    mean, deviation = np.array([given.get(name, (0.0, 0.0)) for name in names], dtype=float).T
    return Gaussian(mean, np.diag(deviation**2))


def why_not_exact(tracker: Tracker, prior: Gaussian) -> str:
    """Say why chi-square does not hold for the tracker's errors on matched truth; "" if it does."""
    estimator, motion = tracker.estimator, motion_of(tracker.estimator)
    if not estimator.traits.exact_when_linear or motion is None:
        return f"the estimator {estimator.kind!r} is not exact"
    if not motion.linear:
        return f"the motion {motion.kind!r} is not linear"
    for name, sensor in tracker.sensors.items():
        x = prior.mean[tracker.state.locate(sensor.observes)]
        other = x + 100.0 * (1 + np.arange(len(x)))
        z = sensor.measure(x)
        if not sensor.linear:
            return f"the sensor {name!r} is not linear"
        if not np.array_equal(sensor.noise(x), sensor.noise(other)):
            return f"the noise of {name!r} depends on the state"
        if float(sensor.detects(x)) != float(sensor.detects(other)):
            return f"the detection probability of {name!r} depends on the state"
        if np.any(np.asarray(sensor.clutter(z)) > 0):
            return f"there is clutter on {name!r}"
    return ""


def play(
    tracker: Tracker,
    prior: Gaussian,
    times: Array,
    runs: int,
    rng: np.random.Generator,
    world: Tracker | World | None = None,
) -> Runs:
    """Run the tracker on `runs` targets in lock-step: each starts at times[0] from the prior, scans follow from times[1] on.

    The target is given at the start and kept to the end, so that the figures are the filter's, not its lifecycle's.
    `world` is that from whose motion and sensors the truth and the returns are drawn: by default the tracker itself.
    """
    why = why_not_exact(tracker, prior)
    world = world_of(tracker, world, prior)
    assert world.start is not None
    clutter = _sees_clutter(tracker, prior) or _sees_clutter(world, world.start)
    gate = tracker.gate if clutter else evolve(tracker.gate, probability=OPEN_GATE, clutter="sensor")
    tracker = evolve(tracker, lifecycle=SingleTarget(), birth=None, gate=gate)
    wide, active = draw_moded(world.estimator, world.start, times, rng, runs)
    truth = wide[..., world.estimator.state.locate(tracker.state)]
    n = len(tracker.state)
    many = Gaussian(np.broadcast_to(prior.mean, (runs, 1, n)), np.broadcast_to(prior.cov, (runs, 1, n, n)))
    state = tracker.start(many, float(times[0]), rng.spawn(1)[0])
    means, covs, surprise = [], [], []
    drawn, false = _Returns(world, rng), _False(world, rng, np.zeros(runs, dtype=bool)) if clutter else None
    looks: dict[str, list[tuple[Array, ...]]] = {name: [] for name in tracker.sensors}
    for k, time in enumerate(times[1:].tolist(), 1):
        for name in tracker.sensors:
            state, look = _look(tracker, state, Scan(time, name, drawn.of(name, wide[:, k])), truth[:, k], false)
            looks[name].append(look)
        estimate = tracker.estimate(state)
        means.append(estimate.mean[:, 0])
        covs.append(estimate.cov[:, 0])
        if active is not None and (believed := tracker.estimator.mode_prob(state.belief)) is not None:
            chance = np.take_along_axis(believed[:, 0], np.minimum(active[:, k, None], believed.shape[-1] - 1), -1)
            surprise.append(-np.log(np.maximum(chance[:, 0], LEAST)))
    mean, cov = np.stack(means, axis=1), np.stack(covs, axis=1)
    gathered = {name: Looks(*(np.stack(part, axis=1) for part in zip(*rows, strict=True))) for name, rows in looks.items()}
    error = tracker.state.difference(truth[:, 1:], mean)
    surprised = np.stack(surprise, axis=1) if surprise else None
    drowned = np.zeros(runs, dtype=bool) if false is None else false.drowned
    return Runs(tracker, times[1:], error, cov, mean, truth, gathered, not why, why, drowned, surprised)


def _sees_clutter(of: Tracker | World, start: Gaussian) -> bool:
    """Return whether a sensor states clutter where the target starts."""
    places = ((sensor, start.mean[of.estimator.state.locate(sensor.observes)]) for sensor in of.sensors.values())
    return any(np.any(np.asarray(sensor.clutter(sensor.measure(x))) > 0) for sensor, x in places)


def _look(
    tracker: Tracker, state: State, scan: Scan, target: Array, false: _False | None
) -> tuple[State, tuple[Array, ...]]:
    """Take a scan of the targets (r, n), with clutter if there is any; return the state and the fields of a look (r, ..)."""
    sensor, z, seen = tracker.sensors[scan.sensor], scan.detections.z[:, 0], scan.detections.valid[:, 0]
    moments = tracker.estimator.moments(tracker.predict(state, scan.time))
    residual, S = innovation(tracker, sensor, Gaussian(moments.mean[:, 0], moments.cov[:, 0]), z)
    expected = sensor.measurement.displace(z, -residual)
    counts: Array = np.zeros((3, len(z)))
    if false is not None:
        scan, counts = false.added(tracker, scan, expected, S)
    state = tracker.step(state, scan)
    apart = sensor.measurement.difference(scan.detections.z, expected[:, None])
    pooled = np.sum(state.weights[:, 0, 1:, None] * apart, axis=-2)
    x = _looked_at(tracker, sensor, target)
    declared = np.broadcast_to(sensor.detects(x), (len(z),))
    far = distances(sensor, _looked_at(tracker, sensor, moments.mean[:, 0]))
    real = sensor.measure(x)
    off = sensor.measurement.difference(z, real)
    return state, (residual, S, seen, pooled, declared, *counts, far, off, real, state.distances[:, 0, 0])


@final
@define(eq=False)
class _Returns:
    """Draws what the sensors of a world return of the targets; errors that last go on from scan to scan."""

    world: World
    rng: np.random.Generator
    _usual: dict[str, float] = field(factory=dict)
    _before: dict[str, Array] = field(factory=dict)

    def of(self, name: str, x: Array) -> Detections:
        """Return what a sensor returns (r, 1, m) of targets x (r, n) over the world's axes."""
        sensor, runs = self.world.sensors[name], len(x)
        there = x[..., self.world.estimator.state.locate(sensor.observes)]
        uniform = self.rng.random(runs)
        white: Array = self.rng.standard_normal((runs, len(sensor.measurement)))
        if name in self.world.errors:
            away = np.maximum(distances(sensor, there), 1e-9)
            part = away / self._usual.setdefault(name, float(np.mean(away)))
            white, self._before[name] = self.world.errors[name].shaped(white, self._before.get(name), part, self.rng)
        z, seen = returns(sensor, there, uniform, white)
        return Detections(z[:, None], seen[:, None])


def distances(sensor: Sensor, x: Array) -> Array:
    """Return how far targets (*b, n) are from the sensor, which stands where it measures a range of 0, or at the origin."""
    if "range" in sensor.measurement:
        return np.abs(sensor.measure(x)[..., sensor.measurement.names.index("range")])
    places = [i for i, axis in enumerate(sensor.observes.axes) if axis.unit == "m"]
    return np.asarray(np.linalg.norm(x[..., places], axis=-1))


def _looked_at(tracker: Tracker, sensor: Sensor, x: Array) -> Array:
    return x[..., tracker.state.locate(sensor.observes)]


def innovation(tracker: Tracker, sensor: Sensor, predicted: Gaussian, z: Array) -> tuple[Array, Array]:
    """Return a return z (*b, m) minus its prediction, and the covariance of that (*b, m, m), linearised at the mean."""
    expected, S, _ = expected_return(predicted, tracker.state, sensor)
    return sensor.measurement.difference(z, expected), S


@final
@define(eq=False)
class _False:
    """Draws the clutter of the sensors of a world. The runs that are `drowned` (r,), as there was no end of it, get none."""

    world: World
    rng: np.random.Generator
    drowned: Mask

    def added(self, tracker: Tracker, scan: Scan, expected: Array, S: Array) -> tuple[Scan, Array]:
        """Add the clutter that could fall into any gate, around `expected` (r, m) with the spread S (r, m, m), to a scan.

        Also return of each run (3, r) how many false returns there are, of how many candidates, and how many the tracker's
        own density expects of these.
        """
        z, seen = scan.detections.z, scan.detections.valid
        sensor, real = tracker.sensors[scan.sensor], self.world.sensors[scan.sensor]
        m, space = len(sensor.measurement), sensor.measurement
        with np.errstate(over="ignore"):
            reach = 3.0 * np.sqrt(tracker.gate.threshold(m) * np.diagonal(S, axis1=-2, axis2=-1))
        blind = ~self.drowned & ~np.all(reach < np.inf, axis=-1)
        reach = np.where((self.drowned | blind)[:, None], 0.0, reach)
        half = np.minimum(reach, [np.inf if axis.period is None else axis.period / 2 for axis in space.axes])
        grid = np.stack(np.meshgrid(*[np.linspace(-1.0, 1.0, 5 if m < 3 else 3)] * m), axis=-1).reshape(-1, m)
        there = expected[:, None] + half[:, None] * grid
        bound = 1.3 * max(float(np.max(each.clutter(there))) for each in (sensor, real))
        with np.errstate(over="ignore"):
            mean = bound * np.prod(2 * half, axis=-1)
        endless = blind | (mean > MOST_FALSE)
        counts = self.rng.poisson(np.where(endless, 0.0, mean))
        half = np.where(endless[:, None], 0.0, half)
        k = int(counts.max(initial=0))
        false = space.canonical(expected[:, None] + half[:, None] * self.rng.uniform(-1.0, 1.0, (len(z), k, m)))
        candidate = np.arange(k) < counts[:, None]
        kept = thinned(real, false, self.rng.random(false.shape[:-1]), bound, candidate)
        stated = np.where(candidate, np.minimum(densities(sensor, false) / max(bound, 1e-300), 1.0), 0.0)
        both = Detections(np.concatenate([z, false], 1), np.concatenate([seen, kept], 1))
        self.drowned = self.drowned | endless
        return Scan(scan.time, scan.sensor, both), np.stack([kept.sum(axis=1), counts, stated.sum(axis=1)])
