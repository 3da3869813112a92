"""The contract: the four roles and their laws. Those that support them are in `vedette.supporting`.

A component is a final frozen attrs class that holds parameters only and names its `kind`. Its methods are pure functions of
arrays with any leading batch axes `*b`; randomness comes from the Generator passed in. A result that does not depend on
the state may lack the batch axes: it broadcasts. Time steps `dt` are in s and never negative.
"""

from __future__ import annotations

from abc import ABC, abstractmethod
from collections.abc import Mapping, Sequence
from functools import cached_property
from typing import Any, ClassVar, Generic, TypeVar

import attrs
import numpy as np
from attrs import frozen

from vedette.display import parameters_html
from vedette.kernels.derivative import numerical_jacobian
from vedette.kernels.twins import Twin
from vedette.space import NO_AXES, Array, Mask, Space
from vedette.types import Detections, Frame, Gaussian, Innovation, Mixtures, Pose
from vedette.values import held

CONTRACT = 2
"""The version of this contract. A plugin module states `VEDETTE_CONTRACT = 2`; the registry sets any other aside."""

B = TypeVar("B")
"""An estimator's belief: attrs values, tuples and arrays, every array leading with (*b, t)."""


class Component(ABC):
    """Anything that a config names by its `kind`."""

    kind: ClassVar[str]

    abbreviations: ClassVar[tuple[str, ...]] = ()
    """What the field calls it in short where the letters of the kind do not say it, in small letters without underscores."""

    misprint: ClassVar[str] = ""
    """What a paper misprints, if the component exists only to show it; listings name such components separately."""

    known_failures: ClassVar[Mapping[str, str]] = {}
    """Laws of its role that it breaks on purpose, each with why: the conformance kit expects these to fail, and says so."""

    def _repr_html_(self) -> str:
        return parameters_html(self)


def components_in(value: Any) -> tuple[Component, ...]:
    """Return the components that a component's parameters hold, alone or in tables and tuples; not those within these."""
    cls = type(value)
    parts = [getattr(value, each.name) for each in attrs.fields(cls) if each.init] if attrs.has(cls) else held(value)
    return tuple(part for one in parts for part in ((one,) if isinstance(one, Component) else components_in(one)))


class MotionModel(Component):
    """How a state moves, x' = f(x, dt) + w, w ~ N(0, Q(x, dt)), over its own axes only.

    Laws: move(x, 0) = x. noise is symmetric, PSD, and 0 at dt = 0. jacobian is the derivative of move.
    If divisible, two steps make one: F(a+b) = F(b) F(a), Q(a+b) = F(b) Q(a) F(b)' + Q(b).
    A model that defines `reframe` declares `reframes`: the caller of `move` then calls `reframe` first. A class states
    `linear = True`; one that depends on its parameters defines a property.
    """

    @property
    def divisible(self) -> bool:
        """Whether two steps make one."""
        return False

    @property
    def linear(self) -> bool:
        """Whether `move` is F x, with F and Q that do not depend on x."""
        return False

    @property
    def reframes(self) -> bool:
        """Whether its frame turns with its target, by `reframe`."""
        return False

    @property
    def twin(self) -> Twin | None:
        """Its compiled twin, which gives what `move`, `jacobian` and `noise` give, all at once; None: it has none."""
        return None

    @property
    @abstractmethod
    def state(self) -> Space:
        """The axes of this model."""

    @property
    def zero_variance(self) -> Space:
        """The part of `state` that has no variance and is set by rules: a heading, a last position."""
        return NO_AXES

    @abstractmethod
    def move(self, x: Array, dt: float) -> Array:
        """Return the state `dt` s later: (*b, n) -> (*b, n)."""

    def jacobian(self, x: Array, dt: float) -> Array:
        """Return F, the derivative of `move`: (*b, n) -> (*b, n, n) or (n, n); by differences, around 0 if linear."""
        return numerical_jacobian(lambda y: self.move(y, dt), 0 * x if self.linear else x, self.state.difference)

    @abstractmethod
    def noise(self, x: Array, dt: float) -> Array:
        """Return Q: (*b, n) -> (*b, n, n) or (n, n)."""

    def mean_noise(self, x: Array, cov: Array, dt: float) -> Array:
        """Return the mean of Q over a belief: (*b, n), (*b, n, n) -> (*b, n, n) or (n, n); by default Q at its mean.

        Filters whose belief is a mean and a covariance ask for this one. It is `noise` where the covariance is 0.
        """
        return self.noise(x, dt)

    def reframe(self, own: Gaussian, combined: Gaussian) -> Gaussian:
        """Return the belief `own` in the frame of the `combined` estimate, for models whose frame turns with their target.

        Called before each prediction with dt > 0 if the model `reframes`. `combined` is that of the enclosing mixture, over
        this model's axes; without a mixture it is `own`.
        """
        return own


class Sensor(Component):
    """How a state is measured, z = h(x) + v, v ~ N(0, R(x)), over the state axes that it observes.

    Laws: noise is positive definite. jacobian is the derivative of measure, residuals unwrapped. 0 <= detects <= 1.
    `x` (*b, n) holds the axes of `observes` in their order, whatever else the estimator carries.
    """

    @property
    def linear(self) -> bool:
        """Whether `measure` is H x, with H and R that do not depend on x."""
        return False

    @property
    def claims(self) -> bool:
        """Whether its returns were found in frames that are tracked themselves: they start tracks, and tell no more."""
        return False

    @property
    def twin(self) -> Twin | None:
        """Its compiled twin, which gives what `measure`, `jacobian`, `noise` and `detects` give, all at once; None: none."""
        return None

    @property
    @abstractmethod
    def observes(self) -> Space: ...

    @property
    @abstractmethod
    def measurement(self) -> Space: ...

    @abstractmethod
    def measure(self, x: Array) -> Array:
        """Return the expected measurement h(x): (*b, n) -> (*b, m)."""

    def jacobian(self, x: Array) -> Array:
        """Return H, the derivative of `measure`: (*b, n) -> (*b, m, n) or (m, n); by differences, around 0 if linear."""
        return numerical_jacobian(self.measure, 0 * x if self.linear else x, self.measurement.difference)

    @abstractmethod
    def noise(self, x: Array) -> Array:
        """Return R: (*b, n) -> (*b, m, m) or (m, m)."""

    def mean_noise(self, x: Array, cov: Array) -> Array:
        """Return the mean of R over a belief: (*b, n), (*b, n, n) -> (*b, m, m) or (m, m); as `MotionModel.mean_noise`."""
        return self.noise(x)

    @abstractmethod
    def detects(self, x: Array) -> Array:
        """Return the detection probability: (*b, n) -> (*b) or ()."""

    @abstractmethod
    def clutter(self, z: Array) -> Array:
        """Return the clutter density per scan in 1 / volume of the measurement space: (*b, k, m) -> (*b, k) or ()."""

    def unresolved(self, x: Array) -> Array | None:
        """Return C, (*b, n) -> (*b, m, m); None: it resolves all.

        Two targets that are detected and differ by d in h(x) give one return, over the middle of both, with the probability
        exp(-d' C^-1 d / 2).
        """
        return None

    def covers(self, z: Array) -> Mask:
        """Return whether a false return may lie at z, i.e. in its field of view: (*b, k, m) -> (*b, k) or (); no law binds
        `clutter` elsewhere, where noise may put a target's return: it is to be finite, so that clutter there is possible.
        """
        return np.ones((), dtype=bool)

    @property
    def optional(self) -> Mapping[str, float]:
        """Measured axes that a return may lack, each with the length of the interval over which clutter is uniform there.

        The gate multiplies the clutter density by it. A likelihood is that of the components that a return has, without it.
        """
        return {}

    def invert(self, z: Array, noise: Array | None = None) -> Gaussian:
        """Return the moments of `observes` given one return, all finite: (*b, m) -> mean (*b, n), cov (*b, n, n)."""
        raise NotImplementedError(f"one return of {self.kind!r} does not give a position, so it cannot start a track")

    def at(self, pose: Pose) -> Sensor:
        """Return the same sensor placed at `pose`, whose arrays lead with runs (*b) where states lead with (*b, t)."""
        raise NotImplementedError(f"sensor {self.kind!r} cannot be placed on a moving platform")

    def placed(self, pose: Pose | None) -> Sensor:
        """Return it at the pose of a scan, which may have none."""
        return self if pose is None else self.at(pose)


class Associator(Component):
    """Which return belongs to which track, as probabilities.

    Laws: rows sum to 1. A score of -inf gets weight 0. A constant added to a row, or a permutation of tracks or
    returns, changes nothing. If exclusive, the weights of a return over all tracks sum to 1 at most.
    """

    exclusive: ClassVar[bool] = False
    by_cluster: ClassVar[bool] = False
    """Whether tracks affect each other only through shared returns: clusters may then be associated separately."""

    decides: ClassVar[bool] = False
    """Whether it gives each track one return or none for certain. It is then given the scores of tracks that exist: one
    whose existence is in doubt would lose to clutter every return that could make it sure.
    """

    takes_merged: ClassVar[bool] = False
    """Whether it weighs events in which two tracks give one return: `meet_close` and `associate_close` then do."""

    @property
    def solves(self) -> str:
        """What it solves exactly up to 4 tracks and 4 returns: the "marginals" or the "best" of all associations, or ""."""
        return ""

    @property
    def approximates(self) -> bool:
        """Whether some weights may be less exact than the kind promises; `approximated` then states which."""
        return False

    def approximated(self, scores: Array) -> Mask:
        """Return the tracks (*b, t) whose weights `associate` only approximates for these scores."""
        return np.zeros(scores.shape[:-1], dtype=bool)

    @abstractmethod
    def associate(self, scores: Array, evidence: Array | None) -> Array:
        """Return weights (*b, t, 1+k) from log scores (*b, t, 1+k), the miss first, which hold the evidence (*b, 1, k)."""

    def associate_pairs(self, pairs: Any) -> Any:
        """Return weights (p,), misses (t,) and the tracks (t,) that are not exact, as `associate` would of a table of these
        `vedette.tracking.Pairs` without evidence; None: it needs tables. Only where no two tracks share a return.
        """
        return None

    def meet_close(self, expected: Any) -> Any:
        """Return the meeting, a `vedette.tracking.Part`, of rows that may give one return with another; None: none may."""
        raise NotImplementedError(f"{self.kind!r} takes no merged returns")

    def associate_close(self, expected: Any, pairs: Any, meeting: Any, places: Any) -> Any:
        """Return what `vedette.tracking.by_cluster` does, of `pairs` of which those at `places` are the meeting's."""
        raise NotImplementedError(f"{self.kind!r} takes no merged returns")


@frozen
class Traits:
    """What an estimator can do that not every one can, or does that its callers must know."""

    exact_when_linear: bool = False
    """With linear models it equals conditioning the joint Gaussian of all states."""
    draws: bool = False
    """It takes numbers from `rng`; any other estimator gets a generator that raises."""
    reframes: bool = False
    """`reframe` is to be called before each prediction."""
    takes_frames: bool = False
    """`evaluate` takes a camera's frame."""
    bounded: bool = False
    """`extent` says where a track's returns can lie."""
    conservative: bool = False
    """Its covariance is larger than that of its errors on purpose."""
    per_scan: bool = False
    """Each scan changes it, however short the time since the one before."""
    hides: bool = False
    """A target may be out of sight: it is detected with the sensor's probability at most."""

    @classmethod
    def combined(cls, parts: Sequence[Traits]) -> Traits:
        """Return the traits of what is made of `parts`: it can do what all of them can, and does what any does."""
        rules = {trait: all if trait in ("exact_when_linear", "takes_frames", "bounded") else any for trait in TRAITS}
        return cls(**{trait: rule(getattr(part, trait) for part in parts) for trait, rule in rules.items()})


TRAITS = tuple(trait.name for trait in attrs.fields(Traits))


@frozen(eq=False)
class GatedScan:
    """A scan of few returns z (*b, k, m) of a sensor, `dt` > 0 s after the belief, as `Estimator.scan_step` takes it.

    p_gate: the gate's probability, limit: the squared distance at which it ends; log_density: that of clutter, per unit of
    the measurement; best: whether the likeliest association counts alone, and not all of them by their probabilities.
    """

    dt: float
    sensor: Sensor
    z: Array
    p_gate: float
    limit: float
    log_density: Array
    best: bool


class Estimator(Component, Generic[B]):
    """A belief about the state of each track, and how time and returns change it. It holds its motion model.

    Laws: if exact_when_linear, it equals conditioning the joint Gaussian. Every covariance stays symmetric positive
    definite by construction. A scan without returns is k = 0.

    `traits` says what it can do: what its class `declares`, and what the estimators and motions in its parameters give it.
    One that holds others forwards to them the method of each trait, or lists the trait in `drops`.
    """

    drops: ClassVar[tuple[str, ...]] = ()
    """Traits of the estimators and motions in its parameters that it does not have: it cannot, or has seen to it itself. To
    drop `reframes` its `predict` must turn frames; one that cannot refuses such motions by a ValueError when it is made.
    """

    @property
    def declares(self) -> Traits:
        """The traits that it has whatever it holds: of a class, or a property where they depend on parameters."""
        return Traits()

    @cached_property
    def traits(self) -> Traits:
        """All its traits; final."""
        parts = components_in(self)
        turning = any(part.reframes for part in parts if isinstance(part, MotionModel))
        every = [self.declares, Traits(reframes=turning)]
        if inner := [part.traits for part in parts if isinstance(part, Estimator)]:
            every.append(Traits.combined(inner))
        has = {trait: trait not in self.drops and any(getattr(one, trait) for one in every) for trait in TRAITS}
        return Traits(**has)

    @property
    @abstractmethod
    def state(self) -> Space:
        """The axes of `moments`."""

    @property
    def zero_variance(self) -> Space:
        """The part of `state` without variance."""
        return NO_AXES

    def refuses(self, sensor: Sensor) -> str | None:
        """Return why this estimator cannot work with a sensor, beyond axes or frames that it does not take, or None."""
        return None

    @abstractmethod
    def start(self, prior: Gaussian, axes: Space, rng: np.random.Generator) -> B:
        """Return a belief from a Gaussian over `axes`, which hold at least those of `state`."""

    def reframe(self, belief: B, combined: Gaussian) -> B:
        """Return the belief in the frame of the `combined` estimate over `state`.

        The caller of `predict` calls this first for an estimator that reframes, if dt > 0: `vedette.filters.predicted`
        does both. A mixture does so for its modes, after mixing, with its own estimate from before, and drops `reframes`.
        """
        return belief

    @abstractmethod
    def predict(self, belief: B, dt: float, rng: np.random.Generator) -> B:
        """Return the belief `dt` s later; for dt == 0, return it unchanged."""

    @abstractmethod
    def evaluate(self, belief: B, sensor: Sensor, observed: Detections | Frame, p_gate: float) -> Innovation:
        """Return the innovation of the predicted belief and a scan; a frame is one return. Does not gate; includes P_D."""

    def informed(self, belief: B, existence: Array) -> B:
        """Return the predicted belief before a frame, for estimators to which the `existence` (*b, t) of tracks matters."""
        return belief

    def extent(self, belief: B, sensor: Sensor, detections: Detections, limit: Array | float) -> tuple[Array, Array]:
        """Return the corners (*b, t, m) of a box that holds every return within the squared distance `limit`, () or (t, 1).

        Asked of a bounded estimator where there are many tracks and returns; angles go up from the first corner.
        """
        raise NotImplementedError(f"{self.kind!r} does not state where a track's returns can lie")

    @abstractmethod
    def update(self, belief: B, innovation: Innovation, weights: Array) -> B:
        """Return the posterior under association weights (*b, t, 1+k)."""

    def scan_step(self, belief: B, scan: GatedScan) -> tuple[B, Array, Array] | None:
        """Return the posterior, weights (*b, 1, 1+k) and squared distances (*b, 1, k) of a scan.

        All that a step does for runs of one track that surely exists: `predict`, `evaluate`, the gate's scores against a
        density of clutter, weights, `update`. None: it has no such call.
        """
        return None

    @abstractmethod
    def moments(self, belief: B) -> Gaussian:
        """Return mean and covariance over `state`."""

    def mode_prob(self, belief: B) -> Array | None:
        """Return the mode probabilities (*b, t, r) of a mixture, else None."""
        return None

    def merge(self, belief: B, mixtures: Mixtures) -> B:
        """Return one belief for each of some mixtures, with its moments, for associators that merge tracks or leaves.

        A filter whose belief is a Gaussian has it; a mixture merges mode by mode.
        """
        raise NotImplementedError(f"{self.kind!r} does not state how beliefs are merged")

    def cross_covariance(self, belief: B, dt: float) -> Array:
        """Return the covariance (*b, t, n, n) of the state now (rows) and `dt` s later (columns), dt > 0, for smoothing."""
        raise NotImplementedError(f"{self.kind!r} does not state the covariance of its states at two times")

    def smooth_step(self, belief: B, later: B, dt: float, rng: np.random.Generator) -> B:
        """Return the belief at one time given all scans.

        `belief` is that by the scans until then; `later`, `dt` s later, is by all scans. dt == 0
        returns `later`. `vedette.filters.OverMotion` makes the step of `cross_covariance`; a mixture needs its own.
        """
        raise NotImplementedError(f"{self.kind!r} does not state how to smooth")
