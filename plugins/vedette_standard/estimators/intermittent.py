"""A filter of a target that is out of sight now and then."""

from __future__ import annotations

from typing import Any, ClassVar, final

import numpy as np
from attrs import evolve, frozen

from vedette import (
    Array,
    Detections,
    Estimator,
    Frame,
    Gaussian,
    Innovation,
    Mixtures,
    Sensor,
    Space,
    Traits,
    WrappedEstimator,
    fields,
    kernels,
)


@frozen(eq=False)
class InSight:
    """The belief of the filter, and the probability (*b, t) that the target, if it exists, is in sight."""

    belief: Any
    probability: Array


@frozen(eq=False)
class Seen:
    """The filter's own detail, and the probability (*b, t) that a target that is missed is in sight."""

    detail: Any
    missed: Array


@final
@frozen
class Intermittent(WrappedEstimator[InSight]):
    """Another filter, of a target that goes out of sight and comes back: it is detected only while it is in sight.

    In sight, with probability v, and hidden are the states of a Markov chain whose mean times are `in_sight` and `hidden`.
    A miss has the likelihood v (1 - P_D P_G) + 1 - v, a return v P_D p(z), and Bayes' rule changes v. So misses in a row
    say little against the target's existence, as where people walk behind a tree, or a boat's echo fades: its track waits
    for a few times `hidden`, and its identity is kept. In clutter false tracks wait, too.
    Musicki, Evans, Joint Integrated Probabilistic Data Association: JIPDA, IEEE T-AES 40, 2004 (Markov chain two).

    >>> from vedette_standard import ConstantVelocity, Kalman, LinearSensor
    >>> inner, sensor = Kalman(ConstantVelocity(0.3, axes=("x",))), LinearSensor(("x",), [[4.0]], detection_probability=0.9)
    >>> estimator, T = Intermittent(inner, in_sight=6.0, hidden=2.0), 3.0
    >>> prior = Gaussian(np.array([[100.0, 5.0]]), np.array([[[21.0, 2.0], [2.0, 4.0]]]))
    >>> ahead = estimator.predict(estimator.start(prior, estimator.state, None), T, None)
    >>> v = 6.0 / 8.0 + 2.0 / 8.0 * np.exp(-T / 6.0 - T / 2.0)  # it was in sight; of 8 s it is so in 6
    >>> np.allclose(ahead.probability, v)
    True
    >>> seen = estimator.evaluate(ahead, sensor, Detections.of([[117.0]]), 1.0)
    >>> own = inner.evaluate(ahead.belief, sensor, Detections.of([[117.0]]), 1.0)
    >>> np.allclose(np.exp(seen.loglik - own.loglik), [[(0.1 * v + 1.0 - v) / 0.1, v]])
    True
    >>> missed = 0.1 * v / (0.1 * v + 1.0 - v)
    >>> for miss in (0.0, 0.4, 1.0):  # a return was in sight
    ...     after = estimator.update(ahead, seen, np.array([[miss, 1.0 - miss]]))
    ...     same = inner.update(ahead.belief, own, np.array([[miss, 1.0 - miss]]))
    ...     np.allclose(after.probability, 1.0 - miss + miss * missed), np.array_equal(after.belief.mean, same.mean)
    (True, True)
    (True, True)
    (True, True)
    """

    kind: ClassVar[str] = "intermittent"
    declares: ClassVar[Traits] = Traits(hides=True)
    drops: ClassVar[tuple[str, ...]] = ("exact_when_linear", "takes_frames")

    of: Estimator[Any] = fields.part("the filter")
    in_sight: float = fields.quantity("s", "mean time for which a target stays in sight", above=0, tried=(2.0, 30.0))
    hidden: float = fields.quantity("s", "mean time for which it stays out of sight", above=0, tried=(0.5, 10.0))

    def start(self, prior: Gaussian, axes: Space, rng: np.random.Generator) -> InSight:
        """Start the filter with a target in sight."""
        return InSight(self.of.start(prior, axes, rng), np.ones(prior.mean.shape[:-1]))

    def reframe(self, belief: InSight, combined: Gaussian) -> InSight:
        """Return the filter's belief in the frame of the `combined` estimate."""
        return evolve(belief, belief=self.of.reframe(belief.belief, combined))

    def predict(self, belief: InSight, dt: float, rng: np.random.Generator) -> InSight:
        """Return the filter's prediction, and how probable it is then that the target is in sight."""
        if dt == 0:
            return belief
        usual = self.in_sight / (self.in_sight + self.hidden)
        left = np.exp(-dt * (1.0 / self.in_sight + 1.0 / self.hidden))
        return InSight(self.of.predict(belief.belief, dt, rng), usual + (belief.probability - usual) * left)

    def evaluate(self, belief: InSight, sensor: Sensor, observed: Detections | Frame, p_gate: float) -> Innovation:
        """Evaluate by the filter, if the target is in sight."""
        made, v = self.of.evaluate(belief.belief, sensor, observed, p_gate), belief.probability
        seen = v * np.exp(made.loglik[..., 0])
        loglik = made.loglik + kernels.safe_log(v)[..., None]
        loglik[..., 0] = kernels.safe_log(seen + 1.0 - v)
        missed = seen / np.where(seen > 0, seen + 1.0 - v, 1.0)
        return evolve(made, loglik=loglik, detail=Seen(made.detail, missed))

    def extent(self, belief: InSight, sensor: Sensor, detections: Detections, limit: Array | float) -> tuple[Array, Array]:
        return self.of.extent(belief.belief, sensor, detections, limit)

    def update(self, belief: InSight, innovation: Innovation, weights: Array) -> InSight:
        """Return the filter's posterior, and how probable it is that the target is in sight."""
        detail: Seen = innovation.detail
        after = self.of.update(belief.belief, evolve(innovation, detail=detail.detail), weights)
        return InSight(after, 1.0 - weights[..., 0] * (1.0 - detail.missed))

    def moments(self, belief: InSight) -> Gaussian:
        return self.of.moments(belief.belief)

    def mode_prob(self, belief: InSight) -> Array | None:
        """Return the filter's mode probabilities."""
        return self.of.mode_prob(belief.belief)

    def merge(self, belief: InSight, mixtures: Mixtures) -> InSight:
        """Merge as the filter does; a mixture is in sight as its parts are, by their shares."""
        probability = np.zeros(mixtures.count)
        np.add.at(probability, mixtures.into, mixtures.shares * belief.probability[mixtures.parts])
        return InSight(self.of.merge(belief.belief, mixtures), probability)

    def cross_covariance(self, belief: InSight, dt: float) -> Array:
        """Return that of the filter."""
        return self.of.cross_covariance(belief.belief, dt)

    def smooth_step(self, belief: InSight, later: InSight, dt: float, rng: np.random.Generator) -> InSight:
        """Smooth as the filter does; whether the target was in sight is told by the scans until then."""
        if dt == 0:
            return later
        return evolve(belief, belief=self.of.smooth_step(belief.belief, later.belief, dt, rng))
