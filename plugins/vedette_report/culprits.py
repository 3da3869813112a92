"""Which of Q and R is likely wrong, and by how much: what innovations say of it, in words."""

from __future__ import annotations

from collections.abc import Sequence
from itertools import combinations, combinations_with_replacement
from typing import Any, ClassVar, final

import numpy as np
from attrs import evolve, frozen

from vedette import WrappedMotion, WrappedSensor, fields
from vedette.errors import VedetteError
from vedette.roles import Estimator, MotionModel, Sensor
from vedette.space import Array
from vedette.testing.correlations import BEYOND_3, modes_verdict
from vedette.testing.montecarlo import Runs, World, play
from vedette.testing.truth import modes_of, motion_of
from vedette.testing.verdicts import lost_runs
from vedette.tracking import Tracker
from vedette.types import Gaussian

LAGS = (1, 2, 3)
"""Products of innovations of the same scan, of the next, and of those after tell Q from R."""
FIRST = 3
"""The scans in which the start shows."""
TOLERATED = 0.02
"""What a moment may be off beside chance, as a part of a variance: no filter is exact whose models are not linear."""
MOST = 4
"""More noises than this are not said to be wrong at once."""
STEPS = 3
"""Of Newton's, where the tracker is not linear."""
FARTHEST = 1e4
"""No factor is larger."""
SHAPES = {
    "distance": "errors of {} change with the distance of the target: R should say so",
    "tails": "errors of {} have heavy tails: many are far larger than R says",
    "lag": "errors of {} are correlated in time: a bias that drifts is among them",
}
CHAIN = ("transition", "interval", "rates")


@final
@frozen
class Restless(WrappedMotion):
    """A motion with `factor` times the noise of another."""

    kind: ClassVar[str] = "kit_restless"

    of: MotionModel = fields.part("the motion")
    factor: float = fields.quantity("1", "factor of its noise", above=0)

    def noise(self, x: Array, dt: float) -> Array:
        noisier: Array = self.factor * self.of.noise(x, dt)
        return noisier


@final
@frozen(eq=False)
class Noisy(WrappedSensor):
    """A sensor without clutter, with `factors` (m,) times the variance of another along each axis that it measures.

    `twist` (m, m), symmetric and 0 on its diagonal, is added to the correlations.
    """

    kind: ClassVar[str] = "kit_noisy"

    of: Sensor = fields.part("the sensor")
    factors: Array = fields.array("1", "factors of the variances", ndim=1)
    twist: Array = fields.array("1", "what is added to the correlations", ndim=2)

    def noise(self, x: Array) -> Array:
        root = np.sqrt(self.factors)
        R = self.of.noise(x)
        spread = np.sqrt(np.diagonal(R, axis1=-2, axis2=-1))
        noisier: Array = (R + self.twist * spread[..., :, None] * spread[..., None, :]) * (root[:, None] * root)
        return noisier

    def clutter(self, z: Array) -> Array:
        return np.zeros(())


def _restless(estimator: Estimator[Any], factor: float) -> Estimator[Any]:
    motion = motion_of(estimator)
    if motion is not None:
        return evolve(estimator, motion=Restless(motion, factor))  # type: ignore[misc]
    return evolve(estimator, modes=tuple(_restless(mode, factor) for mode in modes_of(estimator)))  # type: ignore[misc]


@frozen(eq=False)
class Knob:
    """A noise of the world that may be turned: Q, the start, or what a sensor's R has along an axis, or between two."""

    name: str
    sensor: str = ""
    axes: tuple[int, ...] = ()

    @property
    def turned(self) -> float:
        """How far it is turned to see what changes: a variance is doubled, a correlation changes by a quarter."""
        return 0.25 if len(self.axes) == 2 else 1.0


def _knobs(world: World) -> list[Knob]:
    knobs = [Knob("Q")]
    for name, sensor in world.sensors.items():
        axes = sensor.measurement.names
        knobs += [Knob(f"R of {name} along {axis}", name, (i,)) for i, axis in enumerate(axes)]
        pairs = combinations(range(len(axes)), 2)
        knobs += [Knob(f"R of {name} between {axes[i]} and {axes[j]}", name, (i, j)) for i, j in pairs]
    return [*knobs, Knob("the covariance of the start", "start")]


def _set(world: World, knobs: Sequence[Knob], turns: Array) -> World:
    """Return the world without clutter, each knob turned: variances are 1 + turn times what they were."""
    sensors = {}
    for name, sensor in world.sensors.items():
        m = len(sensor.measurement)
        factors, twist = np.ones(m), np.zeros((m, m))
        for knob, turn in zip(knobs, turns, strict=True):
            if knob.sensor == name and len(knob.axes) == 1:
                factors[knob.axes] = 1.0 + turn
            elif knob.sensor == name and knob.axes:
                twist[knob.axes] = twist[knob.axes[::-1]] = turn
        sensors[name] = Noisy(sensor, factors, twist)
    by_name = {knob.name: 1.0 + turn for knob, turn in zip(knobs, turns, strict=True)}
    estimator = world.estimator if by_name.get("Q", 1.0) == 1.0 else _restless(world.estimator, by_name["Q"])
    assert world.start is not None
    start = Gaussian(world.start.mean, world.start.cov * by_name.get("the covariance of the start", 1.0))
    return World(estimator, sensors, start, world.errors)


def _moments(played: Runs) -> tuple[Array, list[str]]:
    """Return of each run (r, d) how far what innovations show is from what is right, and what each number is of.

    By sensor: products of axes of the same scan less the stated correlations, of the first scans and of the others, products
    with those of later scans; how squares grow with distance; and the share beyond 3 deviations, whatever these are.
    """
    found, kinds = [], []
    for looks in played.looks.values():
        spread = np.sqrt(np.diagonal(looks.cov, axis1=-2, axis2=-1))
        seen = looks.seen[..., None]
        u = looks.residual / spread
        u = np.where(seen, u - np.sum(u * seen, axis=0) / np.maximum(seen.sum(axis=0), 1), 0.0)
        m, scans = u.shape[-1], u.shape[1]
        for part in (slice(0, FIRST), slice(FIRST, scans)):
            count = np.maximum(looks.seen[:, part].sum(axis=1), 1)
            for i, j in combinations_with_replacement(range(m), 2):
                stated = looks.cov[:, part, i, j] / (spread[:, part, i] * spread[:, part, j])
                products = np.where(looks.seen[:, part], u[:, part, i] * u[:, part, j] - stated, 0.0)
                found.append(products.sum(axis=1) / count)
                kinds.append("same scan")
        for lag in LAGS:
            pairs = np.sum(seen[:, :-lag] & seen[:, lag:], axis=1)
            found += list((np.sum(u[:, :-lag] * u[:, lag:], axis=1) / np.maximum(pairs, 1)).T)
            kinds += ["lag"] * m
        late, mask = u[:, FIRST:], looks.seen[:, FIRST:]
        count = np.maximum(mask.sum(axis=1), 1)
        far = np.log(np.maximum(looks.distance[:, FIRST:], 1e-9))
        far = far - far[mask].mean()
        size = np.maximum(np.sum(far**2 * mask, axis=1), 1e-3 * count)
        size = np.maximum(size, size.mean())
        for i in range(m):
            relative = late[..., i] / np.sqrt(np.mean(late[..., i][mask] ** 2))
            found.append(np.sum(np.where(mask, (relative**2 - 1.0) * far, 0.0), axis=1) / size)
            found.append(10.0 * (np.sum(mask & (np.abs(relative) > 3.0), axis=1) / count - BEYOND_3))
            kinds += ["distance", "tails"]
    return np.stack(found, axis=-1), kinds


@frozen(eq=False)
class Fit:
    """What the moments of a world say: their means (d,), the noise (d, d) of these, how far each may be off by chance."""

    mean: Array
    noise: Array
    doubt: Array
    kinds: list[str]

    @classmethod
    def of(cls, played: Runs) -> Fit:
        """Return that of some runs."""
        each, kinds = _moments(played)
        noise = np.cov(each.T).reshape(each.shape[1], -1) / len(each)
        return cls(each.mean(axis=0), noise, 3.5 * np.sqrt(np.diagonal(noise)) + TOLERATED, kinds)

    def solved(self, D: Array) -> tuple[float, Array, Array]:
        """Return what is left, squared, and the turns and their standard errors (k,), of slopes D (d, k) by least squares.

        Each moment has the weight of its own noise: where a start or an R is far off, all moments of a run rise and fall
        together, and weights by their whole covariance would take what is wrong for chance.
        """
        weight = 1.0 / (np.diagonal(self.noise) + 1e-10)
        back = np.linalg.pinv((D.T * weight) @ D) @ (D.T * weight)
        turns = -back @ self.mean
        rest = self.mean + D @ turns
        return float(np.sum(weight * rest**2)), turns, np.sqrt(np.diagonal(back @ self.noise @ back.T))

    def small(self, mean: Array | None = None) -> bool:
        """Whether nothing is off by more than chance."""
        return bool(np.all(np.abs(self.mean if mean is None else mean) <= self.doubt))


@frozen(eq=False)
class Culprits:
    """The knobs that explain the moments, how far the world's had to be turned, and one standard error; what is left."""

    knobs: list[Knob]
    turns: Array
    errors: Array
    left: Fit
    explained: bool


def culprits(tracker: Tracker, world: World, prior: Gaussian, times: Array, runs: int, seed: int) -> Culprits:
    """Return as few knobs as explain the innovations: those that bring each world's moments to what is right.

    The moments are linear in the world's noises: how they grow with each is seen in worlds that have more of it, drawn with
    the same numbers. One knob after the other is added, always the one that leaves least; a world with the knobs so turned
    says whether what is left is chance, and how they must be turned further where the tracker is not linear.
    After Mehra, On the Identification of Variances and Adaptive Kalman Filtering, IEEE Trans. Automatic Control 15, 1970.
    """
    calm = _set(World(tracker.estimator, tracker.sensors, prior), [], np.zeros(0)).sensors
    tracker, knobs = evolve(tracker, sensors=dict(calm)), _knobs(world)

    def seen(chosen: Sequence[Knob], turns: Array) -> Fit:
        return Fit.of(play(tracker, prior, times, runs, np.random.default_rng(seed), _set(world, chosen, turns)))

    def slopes(chosen: Sequence[Knob], turns: Array, here: Fit) -> Array:
        columns = []
        for i, knob in enumerate(chosen):
            further = np.array(turns)
            step = knob.turned if len(knob.axes) == 2 else 1.0 + turns[i]
            try:
                there = seen(chosen, further + step * (np.arange(len(chosen)) == i))
            except ValueError:  # a correlation beyond 1
                step = -step
                there = seen(chosen, further + step * (np.arange(len(chosen)) == i))
            columns.append((there.mean - here.mean) / step)
        return np.stack(columns, axis=-1)

    here = seen([], np.zeros(0))
    D = slopes(knobs, np.zeros(len(knobs)), here)
    white = np.array([kind in ("same scan", "lag") for kind in here.kinds])

    chosen: list[int] = []
    nothing = Culprits([], np.zeros(0), np.zeros(0), here, here.small())
    best = nothing
    if np.all(np.abs(here.mean[white]) <= here.doubt[white]):
        return nothing
    for _ in range(min(len(knobs), MOST)):
        ranked = sorted((k for k in range(len(knobs)) if k not in chosen), key=lambda k: here.solved(D[:, [*chosen, k]])[0])
        for k in ranked[: 2 if not chosen else 1]:
            some = [knobs[i] for i in [*chosen, k]]
            _, turns, errors = here.solved(D[:, [*chosen, k]])
            tried = _refined(some, turns, errors, seen, slopes)
            if tried is not None and (tried.explained or not best.knobs or len(tried.knobs) > len(best.knobs)):
                best = tried
            if best.explained:
                return best
        chosen.append(ranked[0])
    return best


def _refined(chosen: list[Knob], turns: Array, errors: Array, seen: Any, slopes: Any) -> Culprits | None:
    """Return how the chosen knobs must be turned, by a few steps of Newton's; None if there is no such world."""
    plain = np.array([len(knob.axes) != 2 for knob in chosen])
    try:
        for step in range(STEPS):
            turns = np.where(plain, np.maximum(turns, 1.0 / FARTHEST - 1.0), np.clip(turns, -1.99, 1.99))
            there = seen(chosen, turns)
            if there.small() or step == STEPS - 1:
                break
            _, change, errors = there.solved(slopes(chosen, turns, there))
            low = (1.0 + turns) / 30.0 - 1.0
            turns = np.where(plain, np.maximum(turns + change, low), turns + change)
    except (VedetteError, ValueError, np.linalg.LinAlgError):
        return None
    return Culprits(chosen, turns, errors, there, there.small())


def likely_cause(
    played: Runs, wrong: set[str], tracker: Tracker, world: World, prior: Gaussian, runs: int, seed: int,
    usual: Array | None = None,
) -> str:  # fmt: skip
    """Say which parameter is likely wrong, and by how much, from the names of the verdicts that are `wrong`."""
    if wrong & {"hits", "false returns"}:
        return "the detection probability or clutter density above; judge Q and R when these are right"
    if "lost" in wrong and (len(wrong) == 1 or lost_runs(played).mean() > 0.5):
        return "that it loses its targets: too much clutter for the associator, or far too small a Q; judge it in less"
    times = np.concatenate([[2 * played.times[0] - played.times[1]], played.times])
    if usual is not None and _by_transition(played, tracker, world, prior, times, runs, seed, usual):
        return "the chain by which the modes switch: with the world's own the mode probabilities are right"
    if "bias" in wrong:
        return f"a bias{_shift(played)}: `move`, `measure` or the start, before Q and R"
    try:
        found = culprits(tracker, world, prior, times, runs, seed)
    except (VedetteError, ValueError, TypeError, np.linalg.LinAlgError):  # the models cannot be made noisier
        return ""
    if shape := _not_white(found, tracker):
        return shape
    if not found.explained:
        return "neither Q nor R alone: no factors of theirs explain the innovations"
    parts = [text for part in zip(found.knobs, found.turns, found.errors, strict=True) if (text := _sized(*part, world))]
    if not parts:
        return (
            "neither Q nor R, for innovations are as they should be: an axis that is not measured, the covariance that is "
            "reported, or the start"
        )
    said = {knob.name for knob in found.knobs}
    rest = [knob.name for knob in _knobs(world) if knob.name not in said and len(knob.axes) < 2 and knob.sensor != "start"]
    return ", ".join(parts) + (f"; not {', '.join(rest)}" if rest else "")


def _not_white(found: Culprits, tracker: Tracker) -> str:
    """Say how a sensor's errors are not white, where that is what no noise explains; "" if it is not."""
    left = found.left
    owners = [name for name, sensor in tracker.sensors.items() for _ in range(_count(len(sensor.measurement)))]
    ratio = np.where(np.array(left.kinds) == "lag", left.mean, np.abs(left.mean)) / left.doubt
    shown = [k for k, kind in enumerate(left.kinds) if kind in SHAPES and (kind != "lag" or not found.explained)]
    k = max(shown, key=lambda k: ratio[k])
    return SHAPES[left.kinds[k]].format(owners[k]) if ratio[k] > 1 else ""


def _count(m: int) -> int:
    """Return how many moments there are of a sensor of m axes."""
    return m * (m + 1) + (len(LAGS) + 2) * m


def _by_transition(
    played: Runs, tracker: Tracker, world: World, prior: Gaussian, times: Array, runs: int, seed: int, usual: Array
) -> bool:
    """Return whether the tracker's mode probabilities are wrong, and right once its modes switch as the world's do."""
    if played.surprise is None or modes_verdict(played.surprise, usual, 3e-3).inside:
        return False
    own = {name: getattr(world.estimator, name) for name in CHAIN if hasattr(world.estimator, name)}
    try:
        switched = evolve(tracker, estimator=evolve(tracker.estimator, **own))  # type: ignore[misc]
        surprise = play(switched, prior, times, runs, np.random.default_rng(seed), world).surprise
    except (VedetteError, ValueError, TypeError):
        return False
    return surprise is not None and modes_verdict(surprise, usual, 3e-3).inside


def _sized(knob: Knob, turn: float, error: float, world: World) -> str:
    """Say by how much a noise of the tracker is off, "" if by nothing that counts: the world's is right if so turned."""
    if len(knob.axes) == 2:
        if abs(turn) <= max(4 * error, 0.05):
            return ""
        sensor = world.sensors[knob.sensor]
        assert world.start is not None
        R = sensor.noise(world.start.mean[world.estimator.state.locate(sensor.observes)])
        i, j = knob.axes
        real = float(R[..., i, j] / np.sqrt(R[..., i, i] * R[..., j, j]))
        return f"{knob.name} is correlated by {real:.2g}, not by {real + turn:.2g} +- {error:.1g}"
    share = 1.0 + turn
    factor = 1.0 / share
    if abs(turn) <= 4 * error or abs(factor - 1.0) <= 0.04:
        return ""
    if factor < 1:
        return f"{knob.name} is {share:.2g} +- {error:.1g} times too large"
    spread = error / share**2
    return f"{knob.name} is {factor:.2g} +- {spread:.1g} times too small" if factor < 15 else f"{knob.name} is far too small"


def _shift(played: Runs) -> str:
    """Say when and along which measured axis innovations are shifted most, if any are plainly."""
    most, text = 6.0, ""
    for name, looks in played.looks.items():
        u = np.where(looks.seen[..., None], looks.residual / np.sqrt(np.diagonal(looks.cov, axis1=-2, axis2=-1)), 0.0)
        mean, error = u.mean(axis=0), u.std(axis=0, ddof=1) / np.sqrt(len(u))
        k, i = np.unravel_index(int(np.argmax(np.abs(mean) / np.maximum(error, 1e-300))), mean.shape)
        if abs(mean[k, i]) > most * error[k, i]:
            most, axis = abs(mean[k, i]) / error[k, i], played.tracker.sensors[name].measurement.names[i]
            text = f", innovations of {name} are {mean[k, i]:+.2g} deviations off along {axis} at {played.times[k]:g} s"
    return text
