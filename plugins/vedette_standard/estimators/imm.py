"""The interacting multiple model estimator over any estimators, of different states and kinds."""

from __future__ import annotations

from functools import reduce
from typing import Any, ClassVar, final

import numpy as np
from attrs import Factory, field, frozen

from vedette import (
    NO_AXES,
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
    fields,
    kernels,
    maker,
    new_innovation,
)
from vedette.filters import has_gaussian_belief, marginal, without_variance
from vedette_standard.estimators.imm_backward import (
    future_likelihood,
    gain_over_all_axes,
    log_pair_probability,
    pair_posterior,
)
from vedette_standard.estimators.transitions import Transition, rates_problem, transition_problem
from vedette_standard.estimators.unlike import velocity_problem


@frozen(eq=False)
class Modes:
    """One belief per mode, and the log probabilities of the modes (*b, t, r)."""

    beliefs: tuple[Any, ...]
    log_prob: Array


new_modes = maker(Modes)


@frozen(eq=False)
class ModeHypotheses:
    """Each mode's innovation, and the log posterior probability of the modes (*b, t, 1+k, r) under each hypothesis."""

    innovations: tuple[Innovation, ...]
    log_share: Array


new_mode_hypotheses = maker(ModeHypotheses)


def _state(self: Imm) -> Space:
    return reduce(Space.union, (mode.state for mode in self.modes), Space())


def _zero_variance(self: Imm) -> Space:
    """Return the zero-variance axes: those that are zero-variance in every mode that has them, hence in the mixture."""
    free = {name for mode in self.modes for name in mode.state.names if name not in mode.zero_variance}
    return Space(tuple(axis for axis in self.state.axes if axis.name not in free))


@final
@frozen
class Imm(Estimator[Modes]):
    """A bank of estimators whose modes switch by a Markov chain; they mix before each prediction.

    Mixing: c_j = sum_i p_ij mu_i, mu_i|j = p_ij mu_i / c_j, moments with the spread of the means. A track's score for a
    return i is log sum_j c_j l_ji; given the association weights W_i, the joint posterior of mode j and hypothesis i is
    W_i c_j l_ji / sum_j' c_j' l_j'i. So it is the textbook's IMM-PDAF under PDA, and as exact under any other associator.
    Modes may have different states: an axis that a mode lacks has there the mean and standard deviation stated in `absent`,
    0 and 0 by default (a constant-velocity target does not turn); where modes hold one velocity in axes of their own,
    such as vx, vy and heading, speed, they must be stated. At dt = 0 no mode switches. With `rates`, scans that tell nothing
    leave the modes' probabilities as they are; but modes switch at scans alone, so the more there are, the nearer the
    spread is to that of switches at any time.
    Blom, Bar-Shalom, The Interacting Multiple Model Algorithm, IEEE Trans. Automatic Control 33, 1988.

    >>> from vedette import Detections, Gaussian
    >>> from vedette_standard import ConstantVelocity, Kalman, LinearSensor, RandomWalk
    >>> slow, fast, p = Kalman(RandomWalk(1.0, ("x",))), Kalman(RandomWalk(3.0, ("x",))), np.array([[0.9, 0.1], [0.3, 0.7]])
    >>> estimator, sensor = Imm((slow, fast), p, initial=[0.6, 0.4]), LinearSensor(("x",), [[4.0]], [[1.0]], (), 0.8)
    >>> belief = estimator.start(Gaussian(np.array([[100.0]]), np.array([[[9.0]]])), estimator.state, None)
    >>> belief = estimator.predict(belief, 2.0, None)  # weights .6 .9 + .4 .3 = .66; variances 9 + 2, 9 + 2 9
    >>> seen = estimator.evaluate(belief, sensor, Detections.of([[106.0]]), 0.9)
    >>> S = np.array([15.0, 31.0])
    >>> likely = np.array([0.66, 0.34]) * 0.8 * np.exp(-18.0 / S) / np.sqrt(2.0 * np.pi * S)
    >>> np.allclose(seen.loglik[0], np.log([0.28, np.sum(likely)]))
    True
    >>> belief = estimator.update(belief, seen, np.array([[0.2, 0.8]]))
    >>> mu = 0.2 * np.array([0.66, 0.34]) + 0.8 * likely / np.sum(likely)
    >>> np.allclose(estimator.mode_prob(belief)[0], mu)
    True
    >>> m, P = (np.array([getattr(part, of).ravel()[0] for part in belief.beliefs]) for of in ("mean", "cov"))
    >>> whole = estimator.moments(belief)
    >>> np.allclose(whole.mean, mu @ m), np.allclose(whole.cov, mu @ (P + m**2) - (mu @ m) ** 2)
    (True, True)
    >>> ahead, share = estimator.predict(belief, 2.0, None), p * mu[:, None] / (mu @ p)
    >>> np.allclose([part.mean for part in ahead.beliefs], (m @ share)[:, None, None])
    True
    >>> mixed = (P + m**2) @ share - (m @ share) ** 2
    >>> np.allclose([part.cov.ravel()[0] for part in ahead.beliefs], mixed + [2.0, 18.0])
    True
    >>> mover, still = Kalman(ConstantVelocity(0.3, axes=("x",))), {"vx": (0.5, 0.2)}
    >>> pair = Imm((mover, slow), rates=[[-0.1, 0.1], [0.3, -0.3]], initial=[0.6, 0.4], absent=still)
    >>> belief = pair.start(Gaussian(np.array([[9.0, 4.0]]), np.diag([1.0, 0.25])[None]), pair.state, None)
    >>> pair.moments(belief).mean.round(9).tolist(), pair.moments(belief).cov[0, 1, 1].round(9).item()  # 16.25, .29; 2.6^2
    ([[9.0, 2.6]], 3.106)
    >>> np.allclose(pair.mode_prob(pair.predict(belief, 2.0, None))[0, 0], 0.75 - 0.15 * np.exp(-0.8))  # settled: 3/4
    True
    >>> scaled = Imm((slow, fast), p, interval=2.0, initial=[0.6, 0.4])
    >>> belief = scaled.start(Gaussian(np.full((1, 1), 9.0), np.ones((1, 1, 1))), scaled.state, None)
    >>> np.allclose(scaled.mode_prob(scaled.predict(belief, 4.0, None))[0], np.array([0.6, 0.4]) @ p @ p)
    True
    """

    kind: ClassVar[str] = "imm"
    abbreviations: ClassVar[tuple[str, ...]] = ("mmae",)
    drops: ClassVar[tuple[str, ...]] = ("exact_when_linear", "reframes")  # its mixing is not; it reframes the modes itself

    modes: tuple[Estimator[Any], ...] = fields.part("the estimators, one a mode")
    transition: Array | None = fields.array(
        "1", "probability of each next mode (column) given the mode (row)", ndim=2, default=None, check=transition_problem
    )
    interval: float | None = fields.quantity(
        "s", "time for which `transition` holds; default: for each scan, whatever its length", default=None, above=0
    )
    rates: Array | None = fields.array(
        "1/s", "switching rates from mode (row) to mode (column), instead of `transition`", ndim=2, default=None,
        check=rates_problem,
    )  # fmt: skip
    initial: Array | None = fields.array("1", "mode probabilities of a new track; default: equal", ndim=1, default=None)
    absent: dict[str, tuple[float, float]] = fields.table(
        "axis to [mean, standard deviation] in the modes that lack it", pairs=True
    )
    state: Space = field(init=False, repr=False, eq=False, default=Factory(_state, takes_self=True))
    zero_variance: Space = field(init=False, repr=False, eq=False, default=Factory(_zero_variance, takes_self=True))
    _own: tuple[tuple[int, ...], ...] = field(init=False, repr=False, eq=False)
    _reframing: bool = field(init=False, repr=False, eq=False)
    _gaussian: bool = field(init=False, repr=False, eq=False)
    _switch: Transition = field(init=False, repr=False, eq=False)
    _absent: Array = field(init=False, repr=False, eq=False)
    _log_initial: Array = field(init=False, repr=False, eq=False)

    @property
    def declares(self) -> Traits:
        """Return that its modes switch at each scan, unless their times to stay are stated."""
        return Traits(per_scan=self.rates is None and self.interval is None)

    @_own.default
    def _axes_of_modes(self) -> tuple[tuple[int, ...], ...]:
        return tuple(tuple(self.state.locate(mode.state)) for mode in self.modes)

    @_reframing.default
    def _any_reframes(self) -> bool:
        return any(mode.traits.reframes for mode in self.modes)

    @_gaussian.default
    def _beliefs_are_gaussians(self) -> bool:
        """Return whether every mode's belief is its moments, so that none need be asked."""
        return all(has_gaussian_belief(mode) and not mode.zero_variance for mode in self.modes)

    @_switch.default
    def _transition(self) -> Transition:
        r = len(self.modes)
        if r == 0:
            raise ValueError("modes: must hold at least one estimator, got none")
        if (self.transition is None) == (self.rates is None):
            raise ValueError("transition: give either `transition` or `rates`")
        for name, matrix in (("transition", self.transition), ("rates", self.rates), ("initial", self.initial)):
            if matrix is not None and len(matrix) != r:
                raise ValueError(f"{name}: must have one row for each of the {r} modes, got {len(matrix)}")
        if self.initial is not None and (np.any(self.initial <= 0) or abs(self.initial.sum() - 1) > 1e-6):
            raise ValueError(f"initial: must be probabilities > 0 that sum to 1, got {self.initial.tolist()}")
        for name in self.absent:
            if name not in self.state:
                raise ValueError(f"absent.{name}: no mode has this axis; the modes' axes are {self.state}")
        if self.rates is not None:
            if self.interval is not None:
                raise ValueError("interval: goes with `transition`, not with `rates`")
            return Transition(None, self.rates)
        assert self.transition is not None
        if self.interval is None:
            return Transition.per_scan(self.transition)
        return Transition.per_interval(self.transition, self.interval)

    @_log_initial.default
    def _log_of_initial(self) -> Array:
        initial = np.ones(len(self.modes)) if self.initial is None else self.initial
        return np.log(initial / initial.sum())

    @_absent.default
    def _moments_of_the_absent(self) -> Array:
        if problem := velocity_problem([mode.state for mode in self.modes], self.absent):
            raise ValueError(f"absent: {problem}")
        stated = [self.absent.get(axis.name, (0.0, 0.0)) for axis in self.state.axes]
        return np.array([[mean for mean, _ in stated], [deviation**2 for _, deviation in stated]]).reshape(2, -1)

    def refuses(self, sensor: Sensor) -> str | None:
        """Say why any mode refuses `sensor`, or lacks an axis that it observes, or return None."""
        for i, mode in enumerate(self.modes):
            if lacking := [name for name in sensor.observes.names if name not in mode.state]:
                return f"modes[{i}] of the {self.kind!r} lacks the axis {lacking[0]!r}, which it observes"
        return next((reason for mode in self.modes if (reason := mode.refuses(sensor))), None)

    def start(self, prior: Gaussian, axes: Space, rng: np.random.Generator) -> Modes:
        """Start every mode from the same prior, with the `initial` mode probabilities."""
        log_prob = np.empty((*prior.mean.shape[:-1], len(self.modes)))
        log_prob[...] = self._log_initial
        return new_modes(tuple(mode.start(prior, axes, rng) for mode in self.modes), log_prob)

    def predict(self, belief: Modes, dt: float, rng: np.random.Generator) -> Modes:
        """Mix, then predict every mode; one that reframes is told the combined estimate from before the mixing."""
        if dt == 0:
            return belief
        mixed = kernels.mix_modes(
            belief.log_prob, self._switch.log(dt), *self._each(belief), self._own, self._absent, self.state.periods
        )
        beliefs: list[Any] = []
        if self._gaussian and not self._reframing:
            for j, mode in enumerate(self.modes):
                beliefs.append(mode.predict(mixed.beliefs[j], dt, rng))
            return new_modes(tuple(beliefs), mixed.log_prob)
        combined = self.moments(belief) if self._reframing else None
        for mode, prior in zip(self.modes, mixed.beliefs, strict=True):
            part = mode.start(prior, mode.state, rng)
            if combined is not None and mode.traits.reframes:
                part = mode.reframe(part, marginal(combined, self.state, mode.state, NO_AXES))
            beliefs.append(mode.predict(part, dt, rng))
        return new_modes(tuple(beliefs), mixed.log_prob)

    def evaluate(self, belief: Modes, sensor: Sensor, observed: Detections | Frame, p_gate: float) -> Innovation:
        """Weight the modes' likelihoods by their predicted probabilities; a miss is a hypothesis like any other."""
        parts, said = [], []
        for j, mode in enumerate(self.modes):
            part = mode.evaluate(belief.beliefs[j], sensor, observed, p_gate)
            parts.append(part)
            said.append((part.loglik, part.distance, part.log_volume, part.nis))
        loglik, distance, log_volume, nis, share = kernels.weigh_modes(belief.log_prob, said)
        return new_innovation(loglik, distance, log_volume, nis, new_mode_hypotheses(tuple(parts), share))

    def extent(self, belief: Modes, sensor: Sensor, detections: Detections, limit: Array | float) -> tuple[Array, Array]:
        """Return the box around the gates of all modes."""
        extents = [
            mode.extent(part, sensor, detections, limit) for mode, part in zip(self.modes, belief.beliefs, strict=True)
        ]
        return np.minimum.reduce([low for low, _ in extents]), np.maximum.reduce([high for _, high in extents])

    def update(self, belief: Modes, innovation: Innovation, weights: Array) -> Modes:
        """Split the track's weights among the modes, and let each update its own."""
        detail: ModeHypotheses = innovation.detail
        split = kernels.split_weights(weights, detail.log_share)
        beliefs = []
        for j, mode in enumerate(self.modes):
            beliefs.append(mode.update(belief.beliefs[j], detail.innovations[j], split.weights[j]))
        return new_modes(tuple(beliefs), split.log_prob)

    def moments(self, belief: Modes) -> Gaussian:
        """Return mean and covariance of the mixture over all modes' axes, the spread of the means included."""
        means, covs = self._each(belief)
        mixed = kernels.mixture_moments(belief.log_prob, means, covs, self._own, self._absent, self.state.periods)
        if self.zero_variance:
            return Gaussian(mixed.mean, without_variance(mixed.cov, self.state.locate(self.zero_variance)))
        return mixed

    def mode_prob(self, belief: Modes) -> Array:
        return np.exp(belief.log_prob)

    def merge(self, belief: Modes, mixtures: Mixtures) -> Modes:
        """Merge mode by mode, parts counting by how probable the mode is in them; it is as probable as in the mean."""
        into, parts, shares = mixtures.into, mixtures.parts, mixtures.shares
        joint = shares[:, None] * np.exp(belief.log_prob[parts])
        prob = np.zeros((mixtures.count, len(self.modes)))
        np.add.at(prob, into, joint)
        possible = prob[into] > 0.0
        weights = np.where(possible, joint / np.where(possible, prob[into], 1.0), shares[:, None])
        each = zip(self.modes, belief.beliefs, weights.T, strict=True)
        beliefs = tuple(mode.merge(one, Mixtures(into, parts, share, mixtures.count)) for mode, one, share in each)
        return new_modes(beliefs, kernels.safe_log(prob / np.sum(prob, axis=-1, keepdims=True)))

    def smooth_step(self, belief: Modes, later: Modes, dt: float, rng: np.random.Generator) -> Modes:
        """Smooth the modes at one time, weighting each pair of a mode now and one `dt` s later by Bayes' rule.

        The formula is in `imm_backward`. Exact for linear modes where the filter's own mixtures are; it mixes as the filter
        does, so an axis that a mode lacks is taken from `absent`. r modes cost r predictions and smoothing steps of r
        beliefs each. After Nadarajah, Tharmarasa, McDonald, Kirubarajan, IMM Forward Filtering and Backward Smoothing for
        Maneuvering Target Tracking, IEEE Trans. Aerospace and Electronic Systems 48, 2012, with the likelihood of the
        future integrated rather than taken at one point.
        """
        if dt == 0:
            return later
        origin, apart, covs = kernels.stacked(*self._each(belief), self._own, self._absent, self.state.periods)
        components = Gaussian(self.state.displace(origin[..., None, :], apart), covs)
        log_switch = self._switch.log(dt)
        _, means, covs_mixed = kernels.imm_mix(belief.log_prob, log_switch, apart, covs)
        gains, joint = [], []
        for j, mode in enumerate(self.modes):
            mixed = Gaussian(self.state.displace(origin, means[..., j, :]), covs_mixed[..., j, :, :])
            forward = mode.moments(mode.predict(mode.start(mixed, self.state, rng), dt, rng))
            seen = future_likelihood(forward, mode.moments(later.beliefs[j]), mode.state)
            own = mode.start(components, self.state, rng)
            ahead, log_weight = pair_posterior(mode.moments(mode.predict(own, dt, rng)), forward.mean, seen, mode.state)
            back = mode.moments(mode.smooth_step(own, mode.start(ahead, mode.state, rng), dt, rng))
            gains.append(gain_over_all_axes(components, self.state.locate(mode.state), back, self.state))
            joint.append(later.log_prob[..., j, None] + log_pair_probability(belief.log_prob, log_switch[:, j] + log_weight))
        log_joint = np.stack(joint, axis=-1)
        log_prob = kernels.log_sum(log_joint)
        possible = np.isfinite(log_prob)[..., None]  # an impossible mode continues as if there were no future
        share = np.exp(np.where(possible, log_joint - np.where(possible, log_prob[..., None], 0.0), log_switch))
        shifts, smoothed = np.stack([gain[0] for gain in gains], axis=-2), np.stack([gain[1] for gain in gains], axis=-3)
        merged = kernels.moments(share[..., None, :], shifts, smoothed)
        after = Gaussian(self.state.displace(components.mean, merged.mean[..., 0, :]), merged.cov[..., 0, :, :])
        beliefs = tuple(
            mode.start(Gaussian(after.mean[..., i, :], after.cov[..., i, :, :]), self.state, rng)
            for i, mode in enumerate(self.modes)
        )
        return Modes(beliefs, log_prob - kernels.log_sum(log_prob)[..., None])

    def _each(self, belief: Modes) -> tuple[list[Array], list[Array]]:
        """Return the modes' means and covariances, each over its own axes."""
        parts = belief.beliefs
        if not self._gaussian:
            parts = tuple(mode.moments(part) for mode, part in zip(self.modes, parts, strict=True))
        means, covs = [], []
        for part in parts:
            means.append(part.mean)
            covs.append(part.cov)
        return means, covs
