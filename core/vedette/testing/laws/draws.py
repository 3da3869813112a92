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
from vedette.testing.laws.estimator_cases import P_GATE, Scene, ahead, linear_motion, started
from vedette.testing.laws.reframing import PLACE, Gusts, over_the_kits
from vedette.testing.laws.sharp_beliefs import sharp
from vedette.testing.sensors import Bent, Watch
from vedette.types import Detections, Gaussian


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
    start, (rng, another) = started(estimator, drawn, drawn.rng()), map(np.random.default_rng, (1, 2))
    first, again, other = (estimator.moments(predicted(estimator, start, drawn.dt, g)).mean for g in (rng, rng, another))
    if np.array_equal(first, again) and np.array_equal(first, other):
        unheard = rng.bit_generator.state == np.random.default_rng(1).bit_generator.state
        demand(unheard, "predict: takes numbers from the generator and is the same whatever they are")
        raise Closed("its prediction draws nothing")
    demand(not np.array_equal(first, other), "predict: is the same whatever the generator, and declares `draws`")
    demand(not np.array_equal(first, again), "predict: draws the same numbers again from a generator that has moved on")


def tracks_draw_their_own(estimator: Estimator[Any], drawn: Scene) -> None:
    """If it declares `draws`: what it draws of a track, or of a run, is not what it draws of the others.

    It shows as they start to a bent sensor, and in their means as they are predicted.
    """
    shape, prior, given = drawn.prior.mean.shape, drawn.prior, sharp(estimator, drawn)
    mean, cov = np.broadcast_to(prior.mean[:1, :1], shape), np.broadcast_to(prior.cov[:1, :1], prior.cov.shape)
    alike_all = Gaussian(frozen_copy(mean), frozen_copy(cov))
    sensor = evolve(given.sensor, **{"R" if isinstance(given.sensor, Watch) else "C": np.eye(3)})  # type: ignore[arg-type]
    scan = evolve(given.scan(), z=frozen_copy(np.broadcast_to(given.z[:1], given.z.shape)))
    ends = []
    for seed in (1, 2):
        rng = np.random.default_rng(seed)
        belief = started(estimator, evolve(drawn, prior=alike_all), rng)
        seen = estimator.evaluate(belief, sensor, scan, P_GATE).loglik
        ends.append({"start": seen, "predict": estimator.moments(predicted(estimator, belief, drawn.dt, rng)).mean})
    for name, one in ends[0].items():
        other = np.abs(ends[1][name] - one)[0, 0]
        counts = other > 1e-9 * (1.0 + np.abs(one[0, 0]))
        for b, t in ((0, 1), (1, 0)):
            who, own = ("tracks" if t else "runs"), np.abs(one[b, t] - one[0, 0]) > 1e-6 * other
            told = f"{name}: {who} that start alike are given the same numbers; draw for each, in shape (*b, t, ...)"
            demand(not counts.any() or np.any(own[counts]), told)


def all_of_a_belief_counts(estimator: Estimator[Any], drawn: Scene) -> None:
    """If it declares `draws`: in runs that start alike, P_D and Q vary less than over the belief: one point is not all."""
    gusts = over_the_kits(Gusts, estimator)
    closed_if(gusts.state != PLACE, "its state is not that of its motion")
    rng, runs = drawn.rng(), drawn.runs
    start = gusts.start(Gaussian(np.zeros((runs, 1, 1)), np.ones((runs, 1, 1, 1))), PLACE, rng)
    over = rng.standard_normal((10_000, 1))
    added = gusts.moments(predicted(gusts, start, 1.0, rng)).cov[:, 0, 0, 0]
    found = {"predict: what it adds": (added, Gusts(1.0).noise(over, 1.0)[:, 0, 0])}
    sensor = Bent(PLACE, np.zeros(1), np.ones(1), np.ones((3, 1)), np.zeros((3, 1)), np.eye(3), 0.0)
    if gusts.refuses(sensor) is None:
        none = Detections(np.zeros((runs, 0, 3)), np.zeros((runs, 0), dtype=bool))
        seen = -np.expm1(gusts.evaluate(start, sensor, none, P_GATE).loglik[:, 0, 0]) / P_GATE
        found["loglik of a miss: its detection probability"] = (seen, sensor.detects(over))
    for what, several in found.items():
        by_run, whole = (float(np.std(each) / np.mean(each)) for each in several)
        demand(by_run < 0.8 * whole, f"{what} varies by {by_run:.3g} of it from run to run, over the belief by {whole:.3g}")


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
    *(
        Law(law, needs="traits.draws")
        for law in (draws_from_its_generator, tracks_draw_their_own, all_of_a_belief_counts, noise_of_steps_adds_up)
    ),
)
