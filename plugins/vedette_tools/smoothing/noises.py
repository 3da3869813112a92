"""What a sample of paths shows of errors and agility: the model that all paths of a table are smoothed by."""

from __future__ import annotations

import numpy as np
from attrs import evolve, field, frozen

from vedette.space import Array, Indices
from vedette_tools.smoothing.modes import bank, smoothed_modes
from vedette_tools.smoothing.paths import Paths

SIGMAS = np.geomspace(1e-3, 1e3, 13)
"""m: the deviations of positions along an axis that are tried."""

SPREAD = (0.1, 0.5, 0.9)
"""Parts of the objects with less noise, at which noises are paired with those of velocities."""

FINER = 10.0 ** np.array([-0.375, -0.25, -0.125, 0.0, 0.125])
"""Factors by which those that fit are varied."""

PACES = np.geomspace(0.03, 10.0, 6)
"""m/s: those of velocities."""

ACCELS = np.geomspace(1e-4, 100.0, 7)
"""m/s^1.5: the roots of densities of acceleration."""

SWITCHES = (0.02, 0.1, 0.3)
"""Probabilities that a mode changes from one report to the next."""

LEAST_SHARE, MOST_NOISES = 0.01, 6
"""A noise or a mode that accounts for less of a sample is left out, and of noises those beyond the best. The mode above
those that are kept is kept with this share: a sample need not show the hardest manoeuvre.
"""

ROUNDS, SETTLED = 30, 1e-4
"""Of expectation and maximisation at most, by which no share changes more when they end."""


@frozen(eq=False)
class Model:
    """The noises (s,) of which one is each object's, how common each is, the modes (m,), their share, how they change."""

    sigmas: Array = field(factory=lambda: SIGMAS)
    sigmas_velocity: Array = field(factory=lambda: np.full(len(SIGMAS), 1.0))
    common: Array = field(factory=lambda: np.full(len(SIGMAS), 1 / len(SIGMAS)))
    accels: Array = field(factory=lambda: ACCELS)
    share: Array = field(factory=lambda: np.full(len(ACCELS), 1 / len(ACCELS)))
    switch: float = 0.1
    swell: float = 1.0
    """By which factor the accelerations are larger than the modes say."""
    told: bool = True
    """Whether any object has the three reports that tell errors from motion."""


def fitted(paths: Paths, objects: Indices, speed: Array, roundings: Array) -> Model:
    """Return the model of greatest likelihood, over stated grids, of sample paths; objects (p,): whose each piece is.

    No deviation of positions is below the one of `roundings` (o,), in m, that is their object's.
    """
    still = evolve(paths, velocities=np.full_like(paths.velocities, np.nan))
    coarse = np.unique(np.maximum.outer(SIGMAS, np.unique(roundings)))
    model = _shared(still, objects, speed, roundings, _of_noises(Model(), coarse, np.ones(len(coarse))))
    finer = np.unique(np.maximum.outer(np.outer(model.sigmas, FINER).round(9), np.unique(roundings)))
    model = _shared(still, objects, speed, roundings, _of_noises(model, finer, np.ones(len(finer))))
    if np.isfinite(paths.velocities).any():
        best = np.unique(np.searchsorted(np.cumsum(model.common), SPREAD))
        pairs = [(sigma, pace) for sigma in model.sigmas[best] for pace in PACES]
        sigmas, paces = np.array(pairs).T
        wider = _of_noises(model, sigmas, paces)
        all_accels = evolve(wider, accels=ACCELS, share=np.full(len(ACCELS), 1 / len(ACCELS)))
        model = _shared(paths, objects, speed, roundings, all_accels)
    tried = [(_likely(paths, objects, speed, roundings, each), each) for each in (evolve(model, switch=s) for s in SWITCHES)]
    return _shared(paths, objects, speed, roundings, max(tried, key=lambda pair: pair[0])[1])


def _of_noises(model: Model, sigmas: Array, paces: Array) -> Model:
    """Return the model with other noises, each as common as any."""
    return evolve(model, sigmas=sigmas, sigmas_velocity=paces, common=np.full(len(sigmas), 1 / len(sigmas)))


def of_objects(loglik: Array, paths: Paths, objects: Indices, roundings: Array, sigmas: Array) -> Array:
    """Return the log-likelihoods (o, s) of objects under noises, of those (n, s) of rows; -inf of noises smaller than their
    digits leave, if any is larger.
    """
    of_all = np.zeros((int(objects.max(initial=0)) + 1, len(sigmas)))
    np.add.at(of_all, np.repeat(objects, paths.lengths), loglik)
    small = (sigmas < (1 - 1e-9) * roundings[: len(of_all), None]) & (sigmas < sigmas.max())
    return np.where(small, -np.inf, of_all)


def _of_objects(
    paths: Paths, objects: Indices, speed: Array, roundings: Array, model: Model
) -> tuple[Array, Array, Indices]:
    """Return log-likelihoods (o, s) of objects; the mode probabilities (n, m) under the best noise of each row's object."""
    banked = bank(paths, model.accels, model.share, model.switch, model.sigmas, model.sigmas_velocity, speed)
    loglik = of_objects(banked.loglik, paths, objects, roundings, model.sigmas)
    best = np.argmax(loglik + np.log(model.common), axis=-1)[np.repeat(objects, paths.lengths)]
    rows = np.arange(len(paths))
    prob = smoothed_modes(paths, banked.prob[rows, best], banked.prior[rows, best], model.share, model.switch)
    return loglik, prob, best


def _likely(paths: Paths, objects: Indices, speed: Array, roundings: Array, model: Model) -> float:
    loglik, _, _ = _of_objects(paths, objects, speed, roundings, model)
    joint = loglik + np.log(model.common)
    top = joint.max(axis=-1, keepdims=True)
    return float(np.sum(np.log(np.exp(joint - top).sum(axis=-1)) + top[:, 0]))


def _shared(paths: Paths, objects: Indices, speed: Array, roundings: Array, model: Model) -> Model:
    """Return the model with the shares of its noises and modes that the sample has, without those that are rare."""
    for _ in range(2):
        loglik, prob, _ = _of_objects(paths, objects, speed, roundings, model)
        common = model.common
        likely = np.exp(loglik - loglik.max(axis=-1, keepdims=True))
        for _ in range(ROUNDS):
            before, common = common, common * ((1.0 / (likely @ common)) @ likely) / len(likely)
            if np.abs(common - before).max() < SETTLED:
                break
        kept = np.sort(np.argsort(-common)[:MOST_NOISES])
        kept = kept[common[kept] >= min(LEAST_SHARE, float(common.max()))]
        share = prob.mean(axis=0)
        modes = np.flatnonzero(share >= LEAST_SHARE)
        modes = np.union1d(modes, np.minimum(modes[-1] + 1, len(share) - 1))
        share = np.maximum(share, LEAST_SHARE)
        model = evolve(
            model, sigmas=model.sigmas[kept], sigmas_velocity=model.sigmas_velocity[kept],
            common=common[kept] / common[kept].sum(), accels=model.accels[modes], share=share[modes] / share[modes].sum(),
        )  # fmt: skip
    return model
