"""What the laws of estimators are tried on, and what several of them do with it."""

from __future__ import annotations

from typing import Any

import numpy as np
from attrs import frozen
from hypothesis import strategies as st

from vedette.filters import predicted
from vedette.roles import Estimator, MotionModel, Sensor
from vedette.space import Array, Space
from vedette.testing.comparisons import Closed, frozen_copy, same_moments
from vedette.testing.law import Profile
from vedette.testing.sensors import Watch
from vedette.testing.states import SEEDS, random_covariance, random_gaussian, sizes, without_variance
from vedette.testing.truth import modes_of, motion_of
from vedette.types import Detections, Gaussian, Innovation

P_GATE = 0.98


@frozen(eq=False)
class Scene:
    """Two runs of two tracks: a prior (2, 2, n), two sensors, two returns (2, 2, m) of each sensor, time steps in s."""

    prior: Gaussian
    watch: Watch
    other: Watch
    seen: Detections
    others: Detections
    dt: float
    later: float
    seed: int
    runs: int
    steps: int
    alpha: float

    def rng(self) -> np.random.Generator:
        """A generator that always starts the same."""
        return np.random.default_rng(self.seed)


_TIME = st.sampled_from([0.1, 0.5, 1.0, 2.0])
_GIVEN = st.tuples(_TIME, _TIME, st.sampled_from([0.5, 0.9, 1.0]), SEEDS)
"""Two time steps, the detection probability, a seed."""


def free_axes(estimator: Estimator[Any]) -> Space:
    return Space(tuple(axis for axis in estimator.state.axes if axis.name not in estimator.zero_variance))


def drawn(draw: st.DrawFn, estimator: Estimator[Any], profile: Profile) -> Scene:
    """What every law of an estimator is given."""
    dt, later, p_detect, seed = draw(_GIVEN)
    rng = np.random.default_rng(seed)
    free, state = free_axes(estimator), estimator.state
    prior = without_variance(random_gaussian(state, rng, (2, 2)), state, estimator.zero_variance)
    watches = [_watch(free, rng, p_detect, mixed) for mixed in (False, True)]
    returns = []
    for watch in watches:
        centre = watch.measure(prior.mean[:, :1, state.locate(watch.observes)])
        spread = np.sqrt(np.diagonal(watch.R + watch.H @ np.diag((0.02 * sizes(watch.observes)) ** 2) @ watch.H.T))
        z = watch.measurement.canonical(centre + spread * rng.standard_normal((2, 2, len(spread))))
        returns.append(Detections(frozen_copy(z), np.ones((2, 2), dtype=bool)))
    belief = Gaussian(frozen_copy(prior.mean), frozen_copy(prior.cov))
    given = dt, later, seed, profile.runs, profile.steps, profile.alpha
    return Scene(belief, watches[0], watches[1], returns[0], returns[1], *given)


def _watch(free: Space, rng: np.random.Generator, p_detect: float, mixed: bool) -> Watch:
    """A sensor over one or two free axes, those of position where there are; or over a mix of two axes that do not wrap."""
    plain = [axis for axis in free.axes if axis.period is None]
    places = [axis for axis in plain if axis.unit == "m"] or plain or list(free.axes)
    if mixed and len(plain) > 1:
        chosen = [plain[i] for i in sorted(rng.choice(len(plain), 2, replace=False))]
        size = sizes(Space(tuple(chosen)))
        mix = rng.standard_normal((1, 2)) * size[0] / size
        return Watch(Space(tuple(chosen)), np.array([[(0.02 * size[0]) ** 2]]), p_detect, mix=mix)
    observes = Space(tuple(places[: int(rng.integers(1, 3))]))
    return Watch(observes, random_covariance(observes, rng), p_detect)


def not_refused(estimator: Estimator[Any], sensor: Sensor, what: str = "linear sensor") -> None:
    """Closed if an estimator refuses one of the kit's sensors."""
    if (reason := estimator.refuses(sensor)) is not None:
        raise Closed(f"it refuses the kit's {what}: {reason}")


def started(estimator: Estimator[Any], scene: Scene, rng: np.random.Generator) -> Any:
    for watch in (scene.watch, scene.other):
        not_refused(estimator, watch)
    return estimator.start(scene.prior, estimator.state, rng)


def ahead(estimator: Estimator[Any], scene: Scene, rng: np.random.Generator) -> Any:
    """The belief that starts from the scene's prior, predicted."""
    return predicted(estimator, started(estimator, scene, rng), scene.dt, rng)


def innovation_of(estimator: Estimator[Any], belief: Any, scene: Scene) -> Innovation:
    return estimator.evaluate(belief, scene.watch, scene.seen, P_GATE)


def sure(loglik: Array, column: int) -> Array:
    """Weights (*b, t, 1+k) that are sure of one column."""
    weights = np.zeros(loglik.shape)
    weights[..., column] = 1.0
    return weights


def soft(loglik: Array, seed: int) -> Array:
    """Weights (*b, t, 1+k) that are sure of nothing."""
    weights: Array = np.random.default_rng(seed).random(loglik.shape) + 0.05
    weights /= weights.sum(axis=-1, keepdims=True)
    return weights


def weighed(estimator: Estimator[Any], scene: Scene) -> tuple[Any, Innovation, Array]:
    """Return the belief before the scan, its innovation, and weights that are sure of nothing."""
    belief = ahead(estimator, scene, scene.rng())
    innovation = innovation_of(estimator, belief, scene)
    return belief, innovation, soft(innovation.loglik, scene.seed)


def after_scan(
    estimator: Estimator[Any], belief: Any, watch: Watch, seen: Detections, column: int = 1, p_gate: float = P_GATE
) -> Any:
    """The belief after a scan of which every track takes one return, or none (column 0), for sure."""
    innovation = estimator.evaluate(belief, watch, seen, p_gate)
    return estimator.update(belief, innovation, sure(innovation.loglik, column))


def forget(estimator: Estimator[Any], belief: Any, scene: Scene, rng: np.random.Generator) -> Any:
    """The belief 1 ns later, after a scan without returns: nothing that a right estimator would forget by."""
    b, t = estimator.moments(belief).mean.shape[:2]
    none = Detections(np.zeros((b, 0, scene.watch.R.shape[-1])), np.zeros((b, 0), dtype=bool))
    later = predicted(estimator, belief, 1e-9, rng)
    return estimator.update(later, estimator.evaluate(later, scene.watch, none, P_GATE), np.ones((b, t, 1)))


def in_either_order(estimator: Estimator[Any], scene: Scene) -> list[Any]:
    """The beliefs after scans of both sensors at one time, of which every track takes the first return, in either order."""
    scans = ((scene.watch, scene.seen), (scene.other, scene.others))
    ends = []
    for order in (scans, scans[::-1]):
        belief = ahead(estimator, scene, scene.rng())
        for watch, detections in order:
            belief = after_scan(estimator, predicted(estimator, belief, 0.0, scene.rng()), watch, detections)
        ends.append(belief)
    return ends


def alike(estimator: Estimator[Any], got: Any, wanted: Gaussian, tolerance: float, what: str = "") -> None:
    """Broken unless moments agree, judged against each axis' standard deviation."""
    found = got if isinstance(got, Gaussian) else estimator.moments(got)
    same_moments(what, estimator.state, found, wanted, tolerance)


def linear_motion(estimator: Estimator[Any]) -> MotionModel:
    motion = motion_of(estimator)
    if motion is None or not motion.linear:
        raise Closed("it holds no linear `motion`" if motion is None else f"its motion {motion.kind!r} is not linear")
    return motion


def holdable(estimator: Estimator[Any], prior: Gaussian) -> Gaussian:
    """The prior as an estimator can hold it: a mixture whose modes lack axes has there what it assumes of them."""
    if any(mode.state != estimator.state for mode in modes_of(estimator)):
        raise Closed("its modes have unlike states, so it cannot hold any prior")
    return prior


def mixture_moments(state: Space, weights: Array, each: list[Gaussian]) -> Gaussian:
    """Moments of Gaussians under weights (*b, t, len(each)), written out."""
    origin = each[0].mean
    apart = [state.difference(one.mean, origin) for one in each]
    mean = sum(weights[..., i, None] * apart[i] for i in range(len(each)))
    cov = sum(
        weights[..., i, None, None] * (one.cov + (apart[i] - mean)[..., :, None] * (apart[i] - mean)[..., None, :])
        for i, one in enumerate(each)
    )
    return Gaussian(state.displace(origin, np.asarray(mean)), np.asarray(cov))
