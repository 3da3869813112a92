"""Laws of estimators that mix modes."""

from __future__ import annotations

from typing import Any

import numpy as np
from attrs import evolve, fields

from vedette.filters import predicted
from vedette.roles import Estimator
from vedette.testing.comparisons import Unlike, closed_by, closed_if, demand, same
from vedette.testing.law import Law
from vedette.testing.laws import estimator_cases as cases
from vedette.testing.laws.estimator_cases import P_GATE, Scene, ahead, alike, innovation_of
from vedette.testing.truth import chain_of, initial_of, modes_of
from vedette.types import Gaussian, Innovation


def _modes(estimator: Estimator[Any]) -> tuple[Estimator[Any], ...]:
    closed_if(not (modes := modes_of(estimator)), Unlike("it is no mixture of modes"))
    return modes


def _like_modes(estimator: Estimator[Any]) -> tuple[Estimator[Any], ...]:
    modes = _modes(estimator)
    closed_if(any(mode.state != estimator.state for mode in modes), "its modes have unlike states")
    return modes


def modes_follow_their_chain(estimator: Estimator[Any], drawn: Scene) -> None:
    """If a mixture: predicted mode probabilities are those of the Markov chain."""
    modes = _modes(estimator)
    found = estimator.mode_prob(ahead(estimator, drawn, drawn.rng()))
    demand(found is not None, "mode_prob: must be the probabilities of the modes, got None")
    wanted = initial_of(estimator) @ chain_of(estimator, drawn.dt)
    same("mode probabilities", np.asarray(found), np.broadcast_to(wanted, (2, 2, len(modes))), 1e-9, 1.0)


def _alone(modes: tuple[Estimator[Any], ...], drawn: Scene) -> tuple[list[Any], list[Innovation]]:
    """Return the prediction of each mode from the prior, and how the scan compares with it."""
    parts = [predicted(mode, mode.start(drawn.prior, mode.state, drawn.rng()), drawn.dt, drawn.rng()) for mode in modes]
    return parts, [mode.evaluate(part, drawn.watch, drawn.seen, P_GATE) for mode, part in zip(modes, parts, strict=True)]


def modes_share_their_innovations(estimator: Estimator[Any], drawn: Scene) -> None:
    """If a mixture: the distance is the least over modes, the volume the largest, the NIS the modes' given the return."""
    modes = _like_modes(estimator)
    belief = ahead(estimator, drawn, drawn.rng())
    found, (_, each) = innovation_of(estimator, belief, drawn), _alone(modes, drawn)
    prob = estimator.mode_prob(belief)
    demand(prob is not None, "mode_prob: must be the probabilities of the modes, got None")
    distance = np.stack([one.distance for one in each])
    log = np.stack([one.loglik[..., 1:] for one in each]) + np.log(np.moveaxis(np.asarray(prob), -1, 0))[..., None]
    share = np.exp(log - log.max(axis=0))
    nis = np.sum(share * distance, axis=0) / share.sum(axis=0)
    least = distance.min(axis=0)
    same("distance", found.distance, least, 1e-6, 1.0 + least)
    same("log_volume", found.log_volume, np.max([one.log_volume for one in each], axis=0), 1e-6, 1.0)
    same("nis", found.nis, nis, 1e-6, 1.0 + nis)


def first_scan_is_the_exact_mixture(estimator: Estimator[Any], drawn: Scene) -> None:
    """If a mixture: up to the first scan nothing was merged, so modes and moments are Bayes' rule over the modes."""
    modes = _like_modes(estimator)
    belief = ahead(estimator, drawn, drawn.rng())
    c = initial_of(estimator) @ chain_of(estimator, drawn.dt)
    parts, innovations = _alone(modes, drawn)
    c_all = np.broadcast_to(c, (2, 2, len(modes)))
    priors = [mode.moments(part) for mode, part in zip(modes, parts, strict=True)]
    alike(estimator, belief, cases.mixture_moments(estimator.state, c_all, priors), 1e-8, "predicted ")
    likely = np.stack([innovation.loglik[..., 1] for innovation in innovations], axis=-1)
    joint = c * np.exp(likely - likely.max(axis=-1, keepdims=True))
    share = joint / joint.sum(axis=-1, keepdims=True)
    innovation = innovation_of(estimator, belief, drawn)
    total = np.log(joint.sum(axis=-1)) + likely.max(axis=-1)
    same("log-likelihood of a return", innovation.loglik[..., 1], total, 1e-9, np.abs(total) + 1)
    after = estimator.update(belief, innovation, cases.sure(innovation.loglik, 1))
    same("mode probabilities", np.asarray(estimator.mode_prob(after)), share, 1e-9, 1.0)
    chosen = cases.sure(innovations[0].loglik, 1)
    updated = zip(modes, parts, innovations, strict=True)
    ends = [mode.moments(mode.update(part, each, chosen)) for mode, part, each in updated]
    alike(estimator, after, cases.mixture_moments(estimator.state, share, ends), 1e-8, "updated ")


def _twins(estimator: Estimator[Any], modes: tuple[Estimator[Any], ...]) -> Estimator[Any]:
    """Return the mixture with its first mode in place of each."""
    changed: dict[str, Any] = {"modes": (modes[0],) * len(modes)}
    taken = {attribute.name for attribute in fields(type(estimator)) if attribute.init}  # type: ignore[arg-type]
    closed_if("modes" not in taken, "its `modes` are no parameter")
    return evolve(estimator, **changed, **({"absent": {}} if "absent" in taken else {}))  # type: ignore[misc]


def equal_modes_are_one(estimator: Estimator[Any], drawn: Scene) -> None:
    """If a mixture: were all modes the same, it would be that mode through any number of scans."""
    modes = _modes(estimator)
    twins, one = _twins(estimator, modes), modes[0]
    own = estimator.state.locate(one.state)
    prior = Gaussian(drawn.prior.mean[..., own], drawn.prior.cov[..., own, :][..., own])
    ends = []
    for each in (twins, one):
        belief = each.start(prior, one.state, drawn.rng())
        for dt in (drawn.dt, drawn.later):
            belief = predicted(each, belief, dt, drawn.rng())
            innovation = each.evaluate(belief, drawn.watch, drawn.seen, P_GATE)
            belief = each.update(belief, innovation, cases.soft(innovation.loglik, drawn.seed))
        ends.append(each.moments(belief))
    alike(one, ends[0], ends[1], 1e-7)


def switching_moves_nothing(estimator: Estimator[Any], drawn: Scene) -> None:
    """If a mixture: a mode that changes leaves its target where it is, so mixing keeps mean and covariance of all modes."""
    _like_modes(estimator)
    belief = ahead(estimator, drawn, drawn.rng())
    innovation = innovation_of(estimator, belief, drawn)
    belief = estimator.update(belief, innovation, cases.soft(innovation.loglik, drawn.seed))  # now the modes differ
    wanted = estimator.moments(belief)
    alike(estimator, predicted(estimator, belief, 1e-7, drawn.rng()), wanted, 1e-4, "after 0.1 us: ")


def modes_remember_every_scan(estimator: Estimator[Any], drawn: Scene) -> None:
    """If a mixture of modes that are exact when linear: two sensors at one time weigh the modes alike in any order."""
    modes = _like_modes(estimator)
    closed_if(not all(mode.traits.exact_when_linear for mode in modes), "its modes are not exact when linear")
    one, other = (np.asarray(estimator.mode_prob(end)) for end in cases.in_either_order(estimator, drawn))
    same("mode probabilities after two scans at one time, in the other order", other, one, 1e-7, 1.0)


def modes_smooth_as_their_pairs(estimator: Estimator[Any], drawn: Scene) -> None:
    """If a mixture that smooths: over a first scan, modes and moments are Bayes' rule over pairs of a mode and the next."""
    modes = _like_modes(estimator)
    rng, dt, prior = drawn.rng(), drawn.dt, drawn.prior
    now = cases.started(estimator, drawn, rng)
    belief = predicted(estimator, now, dt, rng)
    innovation = innovation_of(estimator, belief, drawn)
    weights = cases.soft(innovation.loglik, drawn.seed)
    later = estimator.update(belief, innovation, weights)
    own = [mode.start(prior, mode.state, rng) for mode in modes]
    likely, ends = [], []
    for mode, part in zip(modes, own, strict=True):
        ahead = predicted(mode, part, dt, rng)
        seen = mode.evaluate(ahead, drawn.watch, drawn.seen, P_GATE)
        ends.append((ahead, seen))
        likely.append(seen.loglik)
    before, chain = initial_of(estimator), chain_of(estimator, dt)
    share = (before @ chain)[:, None, None, None] * np.exp(np.stack(likely) - np.max(likely, axis=0))
    share = weights * share / share.sum(axis=0)  # of mode and return, (modes, 2, 2, 1 + returns)
    with closed_by(NotImplementedError, "it does not smooth"):
        found = estimator.smooth_step(now, later, dt, rng)
        back = [
            mode.moments(mode.smooth_step(part, mode.update(*end, each / each.sum(axis=-1, keepdims=True)), dt, rng))
            for mode, part, end, each in zip(modes, own, ends, share, strict=True)
        ]
    after = np.moveaxis(share.sum(axis=-1), 0, -1)
    alike(estimator, found, cases.mixture_moments(estimator.state, after, back), 1e-6, "smoothed ")
    wanted = np.sum(after[..., None, :] * before[:, None] * chain / (before @ chain), axis=-1)
    same("smoothed mode probabilities", np.asarray(estimator.mode_prob(found)), wanted, 1e-7, 1.0)


_WITHOUT_DRAWS = (switching_moves_nothing, modes_remember_every_scan, modes_smooth_as_their_pairs)
LAWS: tuple[Law, ...] = (
    *map(
        Law, (modes_follow_their_chain, modes_share_their_innovations, first_scan_is_the_exact_mixture, equal_modes_are_one)
    ),
    *(Law(law, needs="not traits.draws") for law in _WITHOUT_DRAWS),
)
