"""Laws of estimators that draw random numbers, and that others draw none."""

from __future__ import annotations

from typing import Any

import numpy as np
from attrs import evolve

from vedette.filters import predicted
from vedette.roles import Estimator
from vedette.sampling.seeds import NO_DRAWS
from vedette.testing.comparisons import Closed, closed_if, demand, frozen_copy
from vedette.testing.law import Law
from vedette.testing.laws.estimator_cases import Scene, ahead, linear_motion, started
from vedette.types import Gaussian

_UNHEARD = "predict: takes numbers from the generator and is the same whatever they are"


def draws_only_if_it_says_so(estimator: Estimator[Any], drawn: Scene) -> None:
    """It takes numbers from the generator only if it declares `draws`."""
    try:
        belief = ahead(estimator, drawn, NO_DRAWS)
        estimator.smooth_step(belief, belief, drawn.later, NO_DRAWS)
    except NotImplementedError:  # it cannot smooth
        return
    except TypeError as error:
        demand("declare `draws" not in str(error), str(error))
        raise


def draws_from_its_generator(estimator: Estimator[Any], drawn: Scene) -> None:
    """If it declares `draws`: from another generator it predicts otherwise, and each step draws other numbers."""
    start = started(estimator, drawn, drawn.rng())
    ends = []
    for seed in (1, 2):
        rng = np.random.default_rng(seed)
        one = predicted(estimator, start, drawn.dt, rng)
        ends += [estimator.moments(one).mean, estimator.moments(predicted(estimator, start, drawn.dt, rng)).mean]
    if all(np.array_equal(ends[0], end) for end in ends):
        rng = np.random.default_rng(1)
        belief = predicted(estimator, start, drawn.dt, rng)
        demand(rng.bit_generator.state == np.random.default_rng(1).bit_generator.state, _UNHEARD)
        raise Closed(f"its prediction draws nothing, and has mean {estimator.moments(belief).mean.ravel()[0]:.3g}")
    demand(not np.array_equal(ends[0], ends[2]), "predict: is the same whatever the generator, and declares `draws`")
    demand(not np.array_equal(ends[0], ends[1]), "predict: draws the same numbers again from a generator that has moved on")


def tracks_draw_their_own(estimator: Estimator[Any], drawn: Scene) -> None:
    """If it declares `draws`: what it draws of a track, or of a run, is not what it draws of the others."""
    shape, prior = drawn.prior.mean.shape, drawn.prior
    mean, cov = np.broadcast_to(prior.mean[:1, :1], shape), np.broadcast_to(prior.cov[:1, :1], prior.cov.shape)
    alike_all = Gaussian(frozen_copy(mean), frozen_copy(cov))
    ends = []
    for seed in (1, 2):
        rng = np.random.default_rng(seed)
        belief = started(estimator, evolve(drawn, prior=alike_all), rng)
        ends.append(estimator.moments(predicted(estimator, belief, drawn.dt, rng)))
    spread = np.sqrt(np.maximum(np.diagonal(ends[0].cov, axis1=-2, axis2=-1), 1e-300))
    other = np.max(np.abs(estimator.state.difference(ends[1].mean, ends[0].mean) / spread)[0, 0])
    apart = estimator.state.difference(ends[0].mean, ends[0].mean[:1, :1]) / spread
    closed_if(other < 1e-6, "what it draws leaves its means alone")
    for b, t in ((0, 1), (1, 0)):
        who = f"{'tracks' if t else 'runs'} that start alike"
        told = f"predict: {who} are given the same numbers; draw for each, in shape (*b, t, ...)"
        demand(np.max(np.abs(apart[b, t])) > 1e-6 * other, told)


def noise_of_steps_adds_up(estimator: Estimator[Any], drawn: Scene) -> None:
    """If it draws and its motion is linear and divisible: noises of 16 steps add up to that of one step as long."""
    motion = linear_motion(estimator)
    if not (estimator.traits.draws and motion.divisible and motion.state == estimator.state) or len(estimator.zero_variance):
        raise Closed("it draws nothing, or its motion is not divisible")
    state, rng, steps = estimator.state, drawn.rng(), 16
    started(estimator, drawn, rng)
    added = np.diagonal(motion.noise(drawn.prior.mean[0, 0], steps * drawn.dt))
    sure_of = Gaussian(
        np.broadcast_to(drawn.prior.mean[0, 0], (4, 8, len(state))),
        np.broadcast_to(np.diag(1e-6 * np.where(added > 0, added, 1.0)), (4, 8, len(state), len(state))),
    )
    once = estimator.start(sure_of, state, rng)
    belief, once = once, predicted(estimator, once, steps * drawn.dt, rng)
    for _ in range(steps):
        belief = predicted(estimator, belief, drawn.dt, rng)
    found, wanted = (np.diagonal(estimator.moments(one).cov, axis1=-2, axis2=-1).mean(axis=(0, 1)) for one in (belief, once))
    ratio = (found / np.maximum(wanted, 1e-300))[added > 0]
    demand(np.all((ratio > 1 / 3) & (ratio < 3)), f"predict: variances of 16 steps are {ratio.tolist()} times those of one")


LAWS = (
    Law(draws_only_if_it_says_so, needs="not traits.draws"),
    *(Law(law, needs="traits.draws") for law in (draws_from_its_generator, tracks_draw_their_own, noise_of_steps_adds_up)),
)
