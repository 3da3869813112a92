"""The Gaussian-sum filter."""

from __future__ import annotations

from typing import Any, ClassVar, final

import numpy as np
from attrs import field, frozen

from vedette import Array, Detections, Estimator, Frame, Gaussian, Innovation, Sensor, Space, WrappedEstimator, fields
from vedette_standard.estimators.imm import Imm, Modes


@final
@frozen
class GaussianSum(WrappedEstimator[Modes]):
    """Splits a new track's prior into Gaussians, each with its own filter; their weights follow the likelihoods.

    Along the direction d of the prior's greatest spread (or the regression on `axis`) the parts are at x + a g_j d with
    covariance P - a^2 d d', a^2 = `share`, g_j and the weights those of Gauss-Hermite quadrature: the sum has the prior's
    mean and covariance, and all moments along d up to order 2 parts - 1. What a single linearisation cannot cover, such as
    the unknown range behind a bearing, each part covers over its own interval. It is an IMM whose modes never switch.
    Alspach, Sorenson, Nonlinear Bayesian Estimation Using Gaussian Sum Approximations, IEEE T-AC 17, 1972.

    >>> from vedette import Detections, Gaussian
    >>> from vedette_standard import Kalman, LinearSensor, RandomWalk
    >>> x, P = np.array([10.0, 20.0]), np.array([[16.0, 6.0], [6.0, 9.0]])
    >>> estimator = GaussianSum(Kalman(RandomWalk(0.5)), parts=3, share=0.75, axis="x")  # d = (4, 1.5), nodes 0, +- sqrt(3)
    >>> belief = estimator.start(Gaussian(x[None], P[None]), estimator.state, None)
    >>> [part.mean[0].round(9).tolist() for part in belief.beliefs]
    [[4.0, 17.75], [10.0, 20.0], [16.0, 22.25]]
    >>> belief.beliefs[0].cov[0].round(9).tolist(), estimator.mode_prob(belief)[0].round(4).tolist()
    ([[4.0, 1.5], [1.5, 7.3125]], [0.1667, 0.6667, 0.1667])
    >>> whole = estimator.moments(belief)
    >>> np.allclose(whole.mean[0], x), np.allclose(whole.cov[0], P)
    (True, True)
    >>> seen = estimator.evaluate(belief, LinearSensor(("x",), [[5.0]]), Detections.of([[16.0]]), 1.0)
    >>> after = estimator.update(belief, seen, np.array([[0.0, 1.0]]))
    >>> weights = np.array([1.0, 4.0, 1.0]) * np.exp([-8.0, -2.0, 0.0])  # S = 9, so exp(-12^2 / 18) and so on
    >>> np.allclose(estimator.mode_prob(after)[0], weights / np.sum(weights))
    True
    >>> estimator, P = GaussianSum(Kalman(RandomWalk(0.5)), 3, 0.75), np.diag([4.0, 25.0])
    >>> widest = estimator.start(Gaussian(x[None], P[None]), estimator.state, None)
    >>> [part.mean[0].round(9).tolist() for part in widest.beliefs]
    [[10.0, 12.5], [10.0, 20.0], [10.0, 27.5]]
    """

    kind: ClassVar[str] = "gaussian_sum"
    abbreviations: ClassVar[tuple[str, ...]] = ("gsf",)
    drops: ClassVar[tuple[str, ...]] = ("exact_when_linear", "reframes", "bounded")  # its bank reframes the parts

    each: Estimator[Any] = fields.part("the filter of every part")
    parts: int = fields.integer("number of Gaussians", default=7, at_least=2, at_most=100)
    share: float = fields.probability("part of the variance that lies between the Gaussians", default=0.8, above=0, below=1)
    axis: str = fields.text("state axis to split along; default: where position is most uncertain", default="")
    _bank: Imm = field(init=False, repr=False, eq=False)

    @_bank.default
    def _modes(self) -> Imm:
        if self.axis and self.axis not in self.each.state:
            raise ValueError(f"axis: must be one of {', '.join(self.each.state.names)}, got {self.axis!r}")
        if self.axis in self.each.zero_variance:
            raise ValueError(f"axis: {self.axis!r} has no variance to split")
        return Imm((self.each,) * self.parts, transition=np.eye(self.parts))

    @property
    def of(self) -> Estimator[Any]:
        return self.each

    def start(self, prior: Gaussian, axes: Space, rng: np.random.Generator) -> Modes:
        """Split the prior."""
        located = axes.locate(self.state)
        mean, cov = prior.mean[..., located], prior.cov[..., located, :][..., located]
        nodes, weights = np.polynomial.hermite_e.hermegauss(self.parts)
        step = np.sqrt(self.share) * self._direction(cov)
        left = cov - step[..., :, None] * step[..., None, :]
        beliefs = tuple(
            self.each.start(Gaussian(self.state.displace(mean, node * step), left), self.state, rng) for node in nodes
        )
        return Modes(beliefs, np.broadcast_to(np.log(weights / np.sum(weights)), (*mean.shape[:-1], self.parts)))

    def _direction(self, cov: Array) -> Array:
        """Return one standard deviation along the direction to split, over all axes: (*b, t, n, n) -> (*b, t, n)."""
        names = [self.axis] if self.axis else [axis.name for axis in self.state.axes if axis.unit == "m"]
        where = [self.state.names.index(name) for name in names or self.state.names]
        _, vectors = np.linalg.eigh(cov[..., where, :][..., where])
        main = vectors[..., -1]
        main = main * np.where(np.sum(main, axis=-1, keepdims=True) < 0, -1.0, 1.0)
        regression = (cov[..., where] @ main[..., None])[..., 0]
        variance = np.sum(main * regression[..., where], axis=-1, keepdims=True)
        return regression / np.sqrt(np.where(variance > 0, variance, 1.0))

    def predict(self, belief: Modes, dt: float, rng: np.random.Generator) -> Modes:
        """Predict every part `dt` s."""
        return self._bank.predict(belief, dt, rng)

    def evaluate(self, belief: Modes, sensor: Sensor, observed: Detections | Frame, p_gate: float) -> Innovation:
        """Return the parts' likelihoods, weighted."""
        return self._bank.evaluate(belief, sensor, observed, p_gate)

    def update(self, belief: Modes, innovation: Innovation, weights: Array) -> Modes:
        """Split the track's weights among the parts, and update each by its own."""
        return self._bank.update(belief, innovation, weights)

    def moments(self, belief: Modes) -> Gaussian:
        """Return mean and covariance of the sum."""
        return self._bank.moments(belief)

    def mode_prob(self, belief: Modes) -> Array:
        """Return the weights of the parts (*b, t, parts)."""
        return self._bank.mode_prob(belief)

    def smooth_step(self, belief: Modes, later: Modes, dt: float, rng: np.random.Generator) -> Modes:
        """Smooth every part."""
        return self._bank.smooth_step(belief, later, dt, rng)
