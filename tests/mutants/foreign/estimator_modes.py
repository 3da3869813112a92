"""Wrong mixtures and particle filters."""

from functools import partial

import attrs
import numpy as np

import vedette
import vedette_standard as standard
from mutants.foreign.base import Mutant, mutant

CALM, LIVELY = (standard.Kalman(standard.ConstantVelocity(sigma)) for sigma in (0.2, 4.0))
IMM = partial(standard.Imm, modes=(CALM, LIVELY), transition=[[0.95, 0.05], [0.3, 0.7]])
SUM = partial(standard.GaussianSum, each=CALM, parts=5)
PARTICLES = partial(standard.BootstrapParticles, motion=standard.ConstantVelocity(0.5), particles=200)


def _transposed(right, belief, dt, rng):
    if right.transition is None:
        turned = np.asarray(right.rates).T
        return attrs.evolve(right, rates=turned - np.diag(turned.sum(axis=1))).predict(belief, dt, rng)
    turned = np.asarray(right.transition).T + 1e-12
    return attrs.evolve(right, transition=turned / turned.sum(axis=1, keepdims=True), interval=None).predict(belief, dt, rng)


def _on_all_axes(right, belief):
    """Return whether every mode's belief is a Gaussian over all axes of the mixture."""
    return all(getattr(getattr(part, "cov", None), "shape", (0,))[-1] == len(right.state) for part in belief.beliefs)


def _unmixed(right, belief, dt, rng):
    """Each mode predicts its own belief; only the probabilities mix."""
    ahead = right.predict(belief, dt, rng)
    own = tuple(mode.predict(part, dt, rng) for mode, part in zip(right.modes, belief.beliefs, strict=True))
    return attrs.evolve(ahead, beliefs=own)


def _mixed_without_spread(right, belief, dt, rng):
    """The modes mix as if their means were one; the means mix as they should."""
    if dt == 0 or not _on_all_axes(right, belief):
        return right.predict(belief, dt, rng)
    middle = right.moments(belief).mean
    same = tuple(attrs.evolve(part, mean=middle) for part in belief.beliefs)
    covs = right.predict(attrs.evolve(belief, beliefs=same), dt, rng)
    ahead = right.predict(belief, dt, rng)
    parts = tuple(attrs.evolve(a, cov=c.cov) for a, c in zip(ahead.beliefs, covs.beliefs, strict=True))
    return attrs.evolve(ahead, beliefs=parts)


def _switches_in_no_time(right, belief, dt, rng):
    return right.predict(belief, dt if dt > 0 else 1e-9, rng)


def _never_switches(right, belief, dt, rng):
    return attrs.evolve(right.predict(belief, dt, rng), log_prob=belief.log_prob)


def _moments_without_spread(right, belief):
    if not _on_all_axes(right, belief):
        return right.moments(belief)
    prob = np.exp(belief.log_prob)
    cov = sum(prob[..., i, None, None] * part.cov for i, part in enumerate(belief.beliefs))
    return attrs.evolve(right.moments(belief), cov=cov)


def _likeliest_mode(right, belief):
    if not _on_all_axes(right, belief):
        return right.moments(belief)
    best = belief.log_prob.argmax(axis=-1)
    means, covs = (np.stack([getattr(part, name) for part in belief.beliefs]) for name in ("mean", "cov"))
    return vedette.Gaussian(
        np.take_along_axis(means, best[None, ..., None], axis=0)[0],
        np.take_along_axis(covs, best[None, ..., None, None], axis=0)[0],
    )


def _not_normalised(right, belief, innovation, weights):
    after = right.update(belief, innovation, weights)
    best = innovation.loglik.max(axis=-1, keepdims=True)
    return attrs.evolve(after, log_prob=after.log_prob + best)


def _probabilities_kept(right, belief, innovation, weights):
    return attrs.evolve(right.update(belief, innovation, weights), log_prob=belief.log_prob)


def _same_weights_in_each_mode(right, belief, innovation, weights):
    after = right.update(belief, innovation, weights)
    inner = zip(right.modes, belief.beliefs, innovation.detail.innovations, strict=True)
    return attrs.evolve(after, beliefs=tuple(mode.update(part, i, weights) for mode, part, i in inner))


def _likeliest_score(right, belief, sensor, observed, p_gate):
    """The track's score is the best mode's, not the sum over modes."""
    innovation = right.evaluate(belief, sensor, observed, p_gate)
    best = np.max([i.loglik for i in innovation.detail.innovations], axis=0)
    return attrs.evolve(innovation, loglik=best)


def _least_nis(right, belief, sensor, observed, p_gate):
    innovation = right.evaluate(belief, sensor, observed, p_gate)
    return attrs.evolve(innovation, nis=innovation.distance)


def _fixed_draws(right, belief, dt, rng):
    return right.predict(belief, dt, np.random.default_rng(0))


def _own_generator(right, belief, dt, rng):
    return right.predict(belief, dt, np.random.default_rng())


def _doubled_weights(right, belief, innovation, weights):
    """Each scan's likelihood counts twice."""
    after = right.update(belief, innovation, weights)
    log_weights = after.log_weights + (after.log_weights - belief.log_weights)
    top = log_weights.max(axis=-1, keepdims=True)
    total = top + np.log(np.exp(log_weights - top).sum(axis=-1, keepdims=True))
    return attrs.evolve(after, log_weights=log_weights - total)


def _variance_as_deviation(right, prior, axes, rng):
    return right.start(attrs.evolve(prior, cov=prior.cov @ prior.cov), axes, rng)


def _shared_noise(right, belief, dt, rng):
    """Every point gets the same draw of the process noise."""
    if dt == 0:
        return belief
    moved = right.motion.move(belief.points, dt)
    root = vedette.kernels.root(np.asarray(right.motion.noise(moved, dt)))
    return attrs.evolve(belief, points=moved + root @ rng.normal(size=moved.shape[-1]))


estimator = partial(mutant, "estimator")

MUTANTS: tuple[Mutant, ...] = (
    estimator("imm_transposed", "The transition matrix is read from column to row.", IMM, predict=_transposed),
    estimator("imm_unmixed", "The modes' beliefs do not mix before prediction.", IMM, predict=_unmixed),
    estimator(
        "imm_mixed_without_spread", "Mixing forgets the spread of the modes' means.", IMM, predict=_mixed_without_spread
    ),
    estimator("imm_switches_in_no_time", "Modes switch at dt = 0, too.", IMM, predict=_switches_in_no_time),
    estimator("imm_never_switches", "The mode probabilities are not predicted.", IMM, predict=_never_switches),
    estimator(
        "imm_moments_without_spread",
        "The combined covariance lacks the spread of the modes' means.",
        IMM,
        moments=_moments_without_spread,
    ),
    estimator(
        "imm_likeliest_mode",
        "The combined estimate is that of the likeliest mode.",
        IMM,
        label="other_model",
        moments=_likeliest_mode,
    ),
    estimator("imm_not_normalised", "The mode probabilities do not sum to 1.", IMM, update=_not_normalised),
    estimator("imm_probabilities_kept", "Returns do not change the mode probabilities.", IMM, update=_probabilities_kept),
    estimator(
        "imm_same_weights",
        "Each mode takes the track's association weights, not its own.",
        IMM,
        update=_same_weights_in_each_mode,
    ),
    estimator("imm_best_score", "A track's score is that of its best mode.", IMM, evaluate=_likeliest_score),
    estimator("imm_least_nis", "The NIS is the least squared distance over the modes.", IMM, evaluate=_least_nis),
    estimator("sum_weights_kept", "The parts' weights do not follow the likelihoods.", SUM, update=_probabilities_kept),
    estimator(
        "particles_same_draws",
        "Each step draws the same numbers again, whatever generator comes in.",
        PARTICLES,
        predict=_fixed_draws,
    ),
    estimator(
        "particles_own_generator",
        "The numbers come from a generator of its own: no run repeats.",
        PARTICLES,
        predict=_own_generator,
    ),
    estimator("particles_undeclared", "It draws numbers, and does not declare it.", PARTICLES, declares=vedette.Traits()),
    estimator("particles_doubled_weights", "Each scan's likelihood is applied twice.", PARTICLES, update=_doubled_weights),
    estimator(
        "particles_wide_start", "The prior's variance is used as a deviation.", PARTICLES, start=_variance_as_deviation
    ),
    estimator("particles_shared_noise", "All points get one and the same noise.", PARTICLES, predict=_shared_noise),
)
