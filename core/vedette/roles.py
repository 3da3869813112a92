"""The contract: four roles, and those that support them, with their laws.

A component is a final frozen attrs class that holds parameters only and names its `kind`. Its methods are pure functions of
arrays with any leading batch axes `*b`; randomness comes through the Generator handed in. A result that does not depend on
the state may lack the batch axes: it broadcasts. Time steps `dt` are in s and never negative.
"""

from __future__ import annotations

from abc import ABC, abstractmethod
from collections.abc import Mapping
from typing import Any, ClassVar, Generic, TypeVar

import numpy as np

from vedette.kernels import backward
from vedette.kernels.derivative import numerical_jacobian
from vedette.space import NO_AXES, Array, Mask, Space
from vedette.types import Detections, Frame, Gaussian, Innovation, Newborn, Pose, Recording, Review, Scan

CONTRACT = 2
"""The version of this page. A plugin module states `VEDETTE_CONTRACT = 2`; the registry sets another aside."""

B = TypeVar("B")
"""An estimator's belief: attrs values, tuples and arrays, every array leading with (*b, t)."""


class Component(ABC):
    """Anything that a config names by its `kind`."""

    kind: ClassVar[str]


class MotionModel(Component):
    """How a state moves, x' = f(x, dt) + w, w ~ N(0, Q(x, dt)), over its own axes only.

    Laws: move(x, 0) = x. noise is symmetric, PSD, and 0 at dt = 0. jacobian is the derivative of move.
    If divisible, two steps make one: F(a+b) = F(b) F(a), Q(a+b) = F(b) Q(a) F(b)' + Q(b).
    A model that defines `reframe` declares `reframes`: whoever predicts then calls it first.
    """

    divisible: ClassVar[bool] = False
    linear: ClassVar[bool] = False
    reframes: ClassVar[bool] = False

    @property
    @abstractmethod
    def state(self) -> Space:
        """The axes that this model owns."""

    @property
    def zero_variance(self) -> Space:
        """The part of `state` that has no variance and is moved by rules: a heading, a last position."""
        return NO_AXES

    @abstractmethod
    def move(self, x: Array, dt: float) -> Array:
        """(*b, n) -> (*b, n)"""

    def jacobian(self, x: Array, dt: float) -> Array:
        """(*b, n) -> (*b, n, n) or (n, n)"""
        return numerical_jacobian(lambda y: self.move(y, dt), x, self.state.difference)

    @abstractmethod
    def noise(self, x: Array, dt: float) -> Array:
        """(*b, n) -> (*b, n, n) or (n, n)"""

    def reframe(self, own: Gaussian, combined: Gaussian) -> Gaussian:
        """Return the belief `own` in the frame of the `combined` estimate, for models whose frame turns with their target.

        Called before each prediction with dt > 0 if the model `reframes`. `combined` is that of the enclosing mixture, over
        this model's axes; without a mixture it is `own`.
        """
        return own


class Sensor(Component):
    """How a state is seen, z = h(x) + v, v ~ N(0, R(x)), over the state axes that it looks at.

    Laws: noise is positive definite. jacobian is the derivative of measure, residuals unwrapped. 0 <= detects <= 1.
    `x` (*b, n) holds the axes of `observes` in their order, whatever else the estimator carries.
    """

    linear: ClassVar[bool] = False

    @property
    @abstractmethod
    def observes(self) -> Space: ...

    @property
    @abstractmethod
    def measurement(self) -> Space: ...

    @abstractmethod
    def measure(self, x: Array) -> Array:
        """(*b, n) -> (*b, m)"""

    def jacobian(self, x: Array) -> Array:
        """(*b, n) -> (*b, m, n) or (m, n)"""
        return numerical_jacobian(self.measure, x, self.measurement.difference)

    @abstractmethod
    def noise(self, x: Array) -> Array:
        """(*b, n) -> (*b, m, m) or (m, m)"""

    @abstractmethod
    def detects(self, x: Array) -> Array:
        """Detection probability (*b, n) -> (*b) or ()"""

    @abstractmethod
    def clutter(self, z: Array) -> Array:
        """Clutter density per scan in 1 / volume of the measurement space, (*b, k, m) -> (*b, k) or ()"""

    @property
    def optional(self) -> Mapping[str, float]:
        """Measured axes that a return may lack, each with the length over which clutter spreads there, uniformly."""
        return {}

    def invert(self, z: Array, noise: Array | None = None) -> Gaussian:
        """What one return alone says about `observes`: (*b, m) -> mean (*b, n), cov (*b, n, n). Starts tracks."""
        raise NotImplementedError(f"one return of {self.kind!r} does not give a position, so it cannot start a track")

    def at(self, pose: Pose) -> Sensor:
        """The same sensor standing at `pose`."""
        raise NotImplementedError(f"sensor {self.kind!r} cannot be placed on a moving platform")


class ImagingSensor(Sensor):
    """A camera. It gives no returns: of each frame it says what the pixels tell about where the target appears.

    `measure` is the apparent position; `noise` that of one frame at best, the inverse of the information in a target that
    looks as expected. `at` and the state `x` hold the axes of `observes`, for each track (*b, t, n).
    Laws: J is symmetric PSD, and 0 where no pixel tells anything; g is the derivative of llr with respect to the apparent
    position at `at`. learn changes nothing but axes without variance.
    """

    @abstractmethod
    def information(self, x: Array, frame: Frame, at: Array) -> tuple[Array, Array, Array]:
        """Information J (*b, t, m, m), score g (*b, t, m) and log-likelihood ratio of target to background llr (*b, t).

        `x` is where the target is expected, so where to look; `at` is where the image is linearised.
        """

    def seek(self, x: Array, cov: Array, frame: Frame) -> Array:
        """Where to linearise first: (*b, t, n), cov (*b, t, n, n) -> (*b, t, n); where the target is expected."""
        return x

    def learn(self, x: Array, frame: Frame) -> Array:
        """`x` after the frame (*b, t, n), its zero-variance axes brought up to what the frame shows: amplitude, spread."""
        return x

    def clutter(self, z: Array) -> Array:
        """1: the ratio that a frame gives is relative to its background already."""
        return np.ones(())


class Associator(Component):
    """Which return belongs to which track, as probabilities.

    Laws: rows sum to 1. A score of -inf gets weight 0. A constant added to a row, or a permutation of tracks or
    returns, changes nothing. If exclusive, no return is claimed more than once in total.
    """

    exclusive: ClassVar[bool] = False

    @property
    def solves(self) -> str:
        """What it finds exactly up to 4 tracks and 4 returns: the "marginals" or the "best" of all associations, or ""."""
        return ""

    @property
    def approximates(self) -> bool:
        """Whether some weights may be less exact than the kind promises: `approximated` then says which."""
        return False

    def approximated(self, scores: Array) -> Mask:
        """Return the tracks (*b, t) whose weights `associate` only approximates for these scores."""
        return np.zeros(scores.shape[:-1], dtype=bool)

    @abstractmethod
    def associate(self, scores: Array, evidence: Array | None) -> Array:
        """Log scores (*b, t, 1+k), column 0 the miss, and evidence (*b, 1, k) -> weights (*b, t, 1+k)"""


class Estimator(Component, Generic[B]):
    """A belief about the state of each track, and how time and returns change it. It owns its motion.

    Laws: if exact_when_linear, it equals conditioning the joint Gaussian. Every covariance stays symmetric positive
    definite by construction. A scan without returns is k = 0.

    What it can do is declared, and a wrapper forwards what it wraps: `draws`, that it takes numbers from `rng` (any other is
    handed one that refuses); `reframes`, that `reframe` is to be called before each prediction; `takes_frames`, that
    `evaluate` takes a camera's frame; `gaussian_belief`, that its belief is its moments, as `vedette.filters.GaussianFilter`
    defines `start` and `moments`, which are then final.
    """

    exact_when_linear: ClassVar[bool] = False
    draws: ClassVar[bool] = False
    reframes: ClassVar[bool] = False
    takes_frames: ClassVar[bool] = False
    gaussian_belief: ClassVar[bool] = False

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
        """A belief from a Gaussian over `axes`, which hold at least those of `state`."""

    def reframe(self, belief: B, combined: Gaussian) -> B:
        """Return the belief in the frame of the `combined` estimate over `state`.

        Whoever predicts an estimator that `reframes` calls this first, for dt > 0: `vedette.filters.predicted` does both. A
        mixture does it for its modes, after they are mixed, with its own estimate from before, and declares no `reframes`.
        """
        return belief

    @abstractmethod
    def predict(self, belief: B, dt: float, rng: np.random.Generator) -> B:
        """Return the belief `dt` later; dt == 0 returns it as it is."""

    @abstractmethod
    def evaluate(self, belief: B, sensor: Sensor, observed: Detections | Frame, p_gate: float) -> Innovation:
        """What a scan says about the predicted belief; a frame is one return. Does not gate; P_D enters here."""

    @abstractmethod
    def update(self, belief: B, innovation: Innovation, weights: Array) -> B:
        """The posterior under association weights (*b, t, 1+k)."""

    @abstractmethod
    def moments(self, belief: B) -> Gaussian:
        """Mean and covariance over `state`."""

    def mode_prob(self, belief: B) -> Array | None:
        """(*b, t, r) for a mixture of modes, else None."""
        return None

    def cross_covariance(self, belief: B, dt: float) -> Array:
        """Covariance (*b, t, n, n) of the state now (rows) and `dt` s later (columns), dt > 0. Smoothing asks for it."""
        raise NotImplementedError(f"{self.kind!r} does not state how the state of one moment goes with that of another")

    def smooth_step(self, belief: B, later: B, dt: float, rng: np.random.Generator) -> B:
        """The belief of a moment by all scans, from `belief`, by the scans until then, and `later`, by all, `dt` s later.

        dt == 0 returns `later`. This is the step of Rauch, Tung and Striebel on `moments`, `predict` and
        `cross_covariance`, exact for linear models; a belief that is more than its moments needs its own.
        """
        if dt == 0:
            return later
        if self.reframes:
            raise NotImplementedError(f"the motion of {self.kind!r} turns its frame: two moments have none in common")
        now, ahead, after = self.moments(belief), self.moments(self.predict(belief, dt, rng)), self.moments(later)
        step = self.state.difference(after.mean, ahead.mean)
        shift, cov = backward.smooth_step(now.cov, ahead.cov, self.cross_covariance(belief, dt), step, after.cov)
        return self.start(Gaussian(self.state.displace(now.mean, shift), cov), self.state, rng)


class Birth(Component):
    """Where tracks come from: the targets that no track holds yet, and the prior of a track that starts at one of them.

    Memory: what it knows of targets without a track, attrs values, tuples and arrays; None if it keeps nothing. Whatever it
    needs of the tracker's filter it asks of `estimator`, so that one kind serves all of them.
    """

    draws: ClassVar[bool] = False
    """Whether it takes numbers from `rng`: else it is handed one that refuses."""
    models_unseen: ClassVar[bool] = False
    """Whether it keeps a model of targets without a track: else `predict`, `reveal` and `miss` are never asked."""

    def initial_memory(self, estimator: Estimator[Any], rng: np.random.Generator) -> Any:
        """Return the memory before the first scan."""
        return None

    def given(self, state: Space, recording: Recording) -> Gaussian | None:
        """Return the tracks that are there before the first scan, a prior (t, n) over `state`; None: there are none."""
        return None

    def predict(self, memory: Any, estimator: Estimator[Any], dt: float, rng: np.random.Generator) -> Any:
        """Return the memory `dt` later: targets move, go and come without being seen."""
        return memory

    def starts_from(self, sensor: str) -> bool:
        """Return whether returns of the sensor of that name may start tracks."""
        return True

    def reveal(
        self, memory: Any, estimator: Estimator[Any], sensor: Sensor, detections: Detections, p_gate: float
    ) -> tuple[Array | None, Any]:
        """Return the density (k,) with which targets without a track give each return, and whatever `begin` needs of them.

        The density is in the unit of the clutter's, with which it competes in the gate; None: not stated.
        """
        return None, memory

    def miss(self, memory: Any, estimator: Estimator[Any], sensor: Sensor, p_gate: float) -> Any:
        """Return the memory after a scan: the targets without a track that were not detected in it."""
        return memory

    @abstractmethod
    def begin(
        self, found: Any, estimator: Estimator[Any], sensor: Sensor, name: str, detections: Detections, claimed: Array
    ) -> Newborn:
        """Return the tracks that start at returns of the sensor of that name.

        found: what `reveal` gave, or None. claimed (k,): the probability that a return is of a track that is there already.
        A scan without returns starts nothing, but ValueError says already what keeps the sensor from starting tracks.
        """


class Lifecycle(Component):
    """When tracks count as real and when they end; judged on existence probabilities and on what was associated.

    Memory: whatever it keeps per track, attrs values, tuples and arrays, every array leading with (*b, t).
    """

    certain: ClassVar[bool] = False
    """Whether every track is taken to exist, and judged by its detections alone: existence is 1 throughout."""

    permanent: ClassVar[bool] = False
    """Whether every track is certain, counts as real and goes on, whatever is detected: a tracker then need not ask."""

    usual_birth: ClassVar[Mapping[str, Any]] = {"kind": "from_returns"}
    """The birth that goes with it where a config names none."""

    @property
    def needs_spread(self) -> bool:
        """Whether `review` wants to know how far the positions are uncertain."""
        return False

    @abstractmethod
    def start(self, existence: Array) -> Any:
        """Return the memory of tracks that start now, with their existence (t,)."""

    def predict(self, existence: Array, dt: float) -> Array:
        """Return the existence (*b, t) that is expected `dt` later."""
        return existence

    @abstractmethod
    def review(self, memory: Any, scan: Review) -> tuple[Any, Mask, Mask]:
        """Return memory, confirmed (*b, t) and alive (*b, t) after a scan."""


class Preprocessor(Component):
    """What stands between raw returns and the tracker: it makes the scan of one of the tracker's sensors from what its own
    sensors reported at the same moment. A conversion of coordinates, a fusion of several sensors.

    Laws: what it makes is over `measurement`, finite, each noise positive definite; padding changes nothing.
    """

    @property
    @abstractmethod
    def sensors(self) -> Mapping[str, Sensor]:
        """The sensors whose scans it takes, by the names that the scans bear."""

    @property
    @abstractmethod
    def measurement(self) -> Space:
        """The space of what it makes: that of the tracker's sensor whose scans these are."""

    @abstractmethod
    def process(self, scans: Mapping[str, Scan]) -> Detections:
        """The scans of one moment, by sensor, those that came -> (*b, k, m)"""


class Source(Component):
    """Where scans come from: a recording, a simulated scene. `draws`: whether another generator gives other scans."""

    draws: ClassVar[bool] = True

    @abstractmethod
    def open(self, sensors: Mapping[str, Sensor], rng: np.random.Generator) -> Recording:
        """All scans for the tracker's sensors.

        InputError for what is unreadable as a whole, ConfigError with places in this component; bad parts are refused.
        """
