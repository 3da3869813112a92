"""Laws of estimators: point filters, mixtures, particles; tried with the kit's own linear sensor."""

from __future__ import annotations

from functools import partial
from itertools import product
from typing import Any

import numpy as np

from vedette import kernels
from vedette.filters import predicted
from vedette.roles import Estimator, GatedScan
from vedette.space import Array, Axis, Space
from vedette.testing.comparisons import Closed, closed_if, demand, frozen_copy, same
from vedette.testing.law import Law
from vedette.testing.laws import credibility, draws, exact, frames, gaps, mixture, reframing, sharp_beliefs, twins
from vedette.testing.laws import estimator_cases as cases
from vedette.testing.laws.estimator_cases import P_GATE, Scene, alike, innovation_of
from vedette.testing.sensors import Watch
from vedette.testing.truth import modes_of
from vedette.tracking import pytrees
from vedette.types import Detections, Gaussian


def pure(estimator: Estimator[Any], drawn: Scene) -> None:
    """With equal generators calls give the same again, and leave beliefs and returns as they were."""
    first: dict[str, Any] = {}
    for _ in range(2):
        rng = drawn.rng()
        start = cases.started(estimator, drawn, rng)
        before = estimator.moments(start)
        kept = Gaussian(np.array(before.mean), np.array(before.cov))
        belief = predicted(estimator, start, drawn.dt, rng)
        innovation = innovation_of(estimator, belief, drawn)
        after = estimator.update(belief, innovation, frozen_copy(cases.soft(innovation.loglik, drawn.seed)))
        same("start after predict: mean", estimator.moments(start).mean, kept.mean, 0.0)
        same("start after predict: cov", estimator.moments(start).cov, kept.cov, 0.0)
        moments = estimator.moments(after)
        found = {"loglik": innovation.loglik, "mean": moments.mean, "cov": moments.cov}
        for name, value in found.items():
            same(f"{name} again", value, first.setdefault(name, np.array(value)), 0.0)


def batches_as_it_loops(estimator: Estimator[Any], drawn: Scene) -> None:
    """Runs and tracks in one batch give what each gives alone."""
    whole, innovation, weights = cases.weighed(estimator, drawn)
    after = estimator.moments(estimator.update(whole, innovation, weights))
    for run in range(2):
        detections = Detections(drawn.seen.z[run], drawn.seen.valid[run])
        for track in range(2):
            prior = Gaussian(drawn.prior.mean[run, track : track + 1], drawn.prior.cov[run, track : track + 1])
            rng = drawn.rng()
            belief = predicted(estimator, estimator.start(prior, estimator.state, rng), drawn.dt, rng)
            alone = estimator.evaluate(belief, drawn.watch, detections, P_GATE)
            chosen = weights[run, track : track + 1]
            wanted = estimator.moments(estimator.update(belief, alone, chosen))
            scale = np.abs(alone.loglik) + 1.0
            same("log-likelihood", innovation.loglik[run, track : track + 1], alone.loglik, 1e-10, scale)
            alike(estimator, Gaussian(after.mean[run, track : track + 1], after.cov[run, track : track + 1]), wanted, 1e-9)


def tracks_come_and_go(estimator: Estimator[Any], drawn: Scene) -> None:
    """Tracks and runs of a belief and an innovation can be taken, and tracks joined; what one takes is nothing to another.

    So every array leads with the batch axes and the tracks. Those that begin join what was predicted, and updated.
    """
    belief, innovation, weights = cases.weighed(estimator, drawn)
    new, updated = cases.started(estimator, drawn, drawn.rng()), estimator.update(belief, innovation, weights)
    for name, value in (("start", new), ("evaluate", innovation), ("update", updated)):
        pytrees.mapped(partial(_leads, name, weights.shape[:2]), value)
    for name, old in (("predict", belief), ("update", updated)):
        kinds = type(new).__name__, type(old).__name__
        demand(type(old) is type(new), f"{name}: must give {kinds[0]}, as `start` does, whose tracks join, got {kinds[1]}")
        apart = pytrees.join(estimator.moments(old), estimator.moments(new), 1)
        alike(estimator, pytrees.join(old, new, 1), apart, 1e-9, "where new tracks join: ")
    after = estimator.moments(updated)
    for own, axis in product(map(np.array, ([0], [1], [1, 0], [1, 0, 1])), (0, 1)):
        of_some: Any = (pytrees.take(one, own, axis) for one in (belief, innovation, weights))
        taken = estimator.update(*of_some)
        if not estimator.traits.draws:  # what it draws in an update may depend on which tracks there are
            alike(estimator, taken, pytrees.take(after, own, axis), 1e-9)
    taking = cases.sure(weights, 1)
    wanted = estimator.moments(estimator.update(belief, innovation, taking))
    taking[:, 1] = cases.sure(weights, 0)[:, 1]
    found = estimator.moments(estimator.update(belief, innovation, taking))
    first, still = (Gaussian(one.mean[:, 0], one.cov[:, 0]) for one in (wanted, found))
    alike(estimator, still, first, 1e-9, "where another track takes no return: ")
    swapped = np.array([1, 0])
    alike(estimator, pytrees.take(belief, swapped, 1), pytrees.take(estimator.moments(belief), swapped, 1), 1e-12)


def _leads(name: str, lead: tuple[int, ...], array: Array) -> None:
    wanted = f"its arrays must lead with the batch axes and the tracks, {lead}"
    demand(array.shape[:2] == lead, f"{name}: {wanted}, got {array.shape}")


def starts_at_its_prior(estimator: Estimator[Any], drawn: Scene) -> None:
    """Just started, moments are the prior's, also where the prior has further axes in another order."""
    own = estimator.state
    more = Space((Axis("kit_more", "m"), *own.axes[::-1]))
    where = more.locate(own)
    mean = np.full((2, 2, len(more)), 3.0)
    cov = np.broadcast_to(np.eye(len(more)), (2, 2, len(more), len(more))).copy()
    mean[..., where] = drawn.prior.mean
    cov[..., np.array(where)[:, None], where] = drawn.prior.cov
    cases.started(estimator, drawn, drawn.rng())
    wide = estimator.start(Gaussian(frozen_copy(mean), frozen_copy(cov)), more, drawn.rng())
    alike(estimator, wide, cases.holdable(estimator, drawn.prior), 1e-9)


def no_time_changes_nothing(estimator: Estimator[Any], drawn: Scene) -> None:
    """A prediction over no time returns the belief as it is, before a scan and after: the next return is as likely."""
    belief = cases.ahead(estimator, drawn, drawn.rng())
    for _ in range(2):
        again = predicted(estimator, belief, 0.0, drawn.rng())
        alike(estimator, again, estimator.moments(belief), 1e-12)
        probability, before = estimator.mode_prob(again), estimator.mode_prob(belief)
        if probability is not None and before is not None:
            same("mode probabilities", probability, before, 1e-12, 1.0)
        found, innovation = (innovation_of(estimator, one, drawn) for one in (again, belief))
        same("log-likelihood", found.loglik, innovation.loglik, 1e-9, 1.0 + np.abs(innovation.loglik))
        belief = estimator.update(belief, innovation, cases.soft(innovation.loglik, drawn.seed))


def a_short_time_forgets_nothing(estimator: Estimator[Any], drawn: Scene) -> None:
    """After a scan, steps of 1 ns and scans that miss leave the belief as it is."""
    if estimator.traits.conservative or estimator.traits.per_scan:
        raise Closed("it is conservative or `per_scan`, and may lose something at each scan")
    belief = cases.after_scan(estimator, cases.ahead(estimator, drawn, drawn.rng()), drawn.watch, drawn.seen)
    wanted = estimator.moments(belief)
    for _ in range(3):
        belief = cases.forget(estimator, belief, drawn, drawn.rng())
    alike(estimator, belief, wanted, 1e-3, "after three times 1 ns and no returns: ")


def a_missed_scan_equals_prediction(estimator: Estimator[Any], drawn: Scene) -> None:
    """Where detection does not depend on the state, a scan without returns says nothing."""
    belief = cases.ahead(estimator, drawn, drawn.rng())
    none = Detections(drawn.seen.z[:, :0], drawn.seen.valid[:, :0])
    innovation = estimator.evaluate(belief, drawn.watch, none, P_GATE)
    otherwise = f"loglik: of no returns must have shape (2, 2, 1), got {innovation.loglik.shape}"
    demand(innovation.loglik.shape == (2, 2, 1), otherwise)
    after = estimator.update(belief, innovation, np.ones((2, 2, 1)))
    alike(estimator, after, estimator.moments(belief), 1e-9)


def returns_of_weight_zero_change_nothing(estimator: Estimator[Any], drawn: Scene) -> None:
    """A return that is surely not the track's leaves it as a miss does."""
    belief = cases.ahead(estimator, drawn, drawn.rng())
    alike(estimator, cases.after_scan(estimator, belief, drawn.watch, drawn.seen, 0), estimator.moments(belief), 1e-9)


def a_scan_in_one_call_is_its_parts(estimator: Estimator[Any], drawn: Scene) -> None:
    """If it has one call for a whole scan, that gives what prediction, evaluation, gate, weights and update give."""
    start = pytrees.take(cases.started(estimator, drawn, drawn.rng()), np.array([0]), 1)
    belief = predicted(estimator, start, drawn.dt, drawn.rng())
    innovation, limit, log_density = innovation_of(estimator, belief, drawn), 4.0, np.array(-9.0)
    known = innovation.loglik, innovation.distance, drawn.seen.valid, np.ones((2, 1)), limit, log_density
    scores = kernels.gate_scores(*known, None, None)
    for best, weights in ((True, kernels.one_hot(scores)), (False, kernels.softmax(scores))):
        scan = GatedScan(drawn.dt, drawn.watch, drawn.seen.z, P_GATE, limit, log_density, best)
        if (given := estimator.scan_step(start, scan)) is None:
            raise Closed("it has no such call")
        after, weighted, distance = given
        same("weights", weighted, weights, 1e-9, 1.0)
        same("squared distances", distance, innovation.distance, 1e-9, 1.0 + innovation.distance)
        alike(estimator, after, estimator.moments(estimator.update(belief, innovation, weights)), 1e-9)


def order_of_returns_is_free(estimator: Estimator[Any], drawn: Scene) -> None:
    """Returns in another order, with their weights, give the same belief."""
    belief, innovation, weights = cases.weighed(estimator, drawn)
    wanted = estimator.moments(estimator.update(belief, innovation, weights))
    turned = estimator.evaluate(belief, drawn.watch, Detections(drawn.seen.z[:, ::-1], drawn.seen.valid), P_GATE)
    same("log-likelihood", turned.loglik[..., 1:], innovation.loglik[..., :0:-1], 1e-9, np.abs(innovation.loglik).max())
    alike(estimator, estimator.update(belief, turned, weights[..., [0, 2, 1]]), wanted, 1e-9)


def a_unit_of_measurement_is_free(estimator: Estimator[Any], drawn: Scene) -> None:
    """Returns in other units, with their noise, say the same: as likely per old unit, they leave the same belief."""
    observes = drawn.watch.observes
    closed_if(any(axis.period is not None for axis in observes.axes), "an angle has one unit")
    belief = cases.ahead(estimator, drawn, drawn.rng())
    size = np.diag([0.25, 3.0][: len(observes)])
    watch = Watch(observes, size @ drawn.watch.R @ size, drawn.watch.probability, mix=size)
    there = estimator.evaluate(belief, watch, Detections(drawn.seen.z @ size, drawn.seen.valid), P_GATE)
    here = innovation_of(estimator, belief, drawn)
    for name in ("distance", "nis"):
        wanted = getattr(here, name)
        same(f"{name} in other units", getattr(there, name), wanted, 1e-7, 1.0 + np.abs(wanted))
    larger, wanted = np.log(np.linalg.det(size)), here.loglik[..., 1:]
    same("log-likelihood", there.loglik[..., 1:] + larger, wanted, 1e-7, 10.0 + np.abs(wanted))
    same("log_volume in other units", there.log_volume - larger, here.log_volume, 1e-7, 10.0 + np.abs(here.log_volume))
    weights = cases.soft(here.loglik, drawn.seed)
    same_belief = estimator.moments(estimator.update(belief, here, weights))
    alike(estimator, estimator.update(belief, there, weights), same_belief, 1e-6)


def a_miss_has_its_probability(estimator: Estimator[Any], drawn: Scene) -> None:
    """Column 0 is log(1 - P_D P_G), or more if it hides: a return outside the gate is missed too."""
    miss = innovation_of(estimator, cases.ahead(estimator, drawn, drawn.rng()), drawn).loglik[..., 0]
    wanted = np.full((2, 2), np.log(1.0 - drawn.watch.probability * P_GATE))
    same("loglik of a miss", np.minimum(miss, wanted) if estimator.traits.hides else miss, wanted, 1e-9, 1.0)


def return_likelihood_is_a_density(estimator: Estimator[Any], drawn: Scene) -> None:
    """Over all measurements, the likelihood of a return integrates to the detection probability, which a miss tells."""
    belief = cases.ahead(estimator, drawn, drawn.rng())
    moments = estimator.moments(belief)
    axis = drawn.watch.observes.axes[:1]
    observes = Space(axis)
    watch = Watch(observes, drawn.watch.R[:1, :1], drawn.watch.probability)
    i = estimator.state.locate(observes)[0]
    spread = np.sqrt(float(np.max(moments.cov[..., i, i])) + float(watch.R[0, 0]))
    centres, period = moments.mean[..., i], axis[0].period
    low, high = float(centres.min()) - 9 * spread, float(centres.max()) + 9 * spread
    closed_if(period is not None and high - low > period, "the measured angle is too uncertain for an unwrapped integral")
    cells = 4000 if modes_of(estimator) else 600 if estimator.traits.draws else 1500  # particles cost 1000 times as much
    grid = np.linspace(low, high, cells)
    z = np.broadcast_to(observes.canonical(grid[:, None]), (2, cells, 1))
    loglik = estimator.evaluate(belief, watch, Detections(z, np.ones((2, cells), dtype=bool)), P_GATE).loglik
    narrow = float(np.sqrt(watch.R[0, 0]))
    closed_if((grid[1] - grid[0]) > 0.5 * narrow, "the tracks lie too far apart for one grid")
    total = np.exp(loglik[..., 1:]).sum(axis=-1) * (grid[1] - grid[0])
    same("integral of a return's likelihood", total, -np.expm1(loglik[..., 0]) / P_GATE, 1e-4, 1.0)


def gates_lie_in_their_extent(estimator: Estimator[Any], drawn: Scene) -> None:
    """If it is bounded: the box that it states for a squared distance holds every return within that."""
    belief = cases.ahead(estimator, drawn, drawn.rng())
    limit = float(np.max(innovation_of(estimator, belief, drawn).distance))
    low, high = (corner[:, :, None] for corner in estimator.extent(belief, drawn.watch, drawn.seen, limit))
    off = drawn.watch.measurement.difference(drawn.seen.z[:, None], (low + high) / 2)
    told = f"extent: for {limit:.3g}, returns lie {np.max(2 * np.abs(off) / (high - low)):.6g} times as far out as its box"
    demand(np.all(2 * np.abs(off) <= (1 + 1e-9) * (high - low)), told)


def soft_weights_give_the_mixtures_moments(estimator: Estimator[Any], drawn: Scene) -> None:
    """Under soft weights the belief has the moments of its hypotheses, the spread of their means included."""
    belief, innovation, weights = cases.weighed(estimator, drawn)
    each = [estimator.moments(estimator.update(belief, innovation, cases.sure(weights, i))) for i in range(3)]
    wanted = cases.mixture_moments(estimator.state, weights, each)
    alike(estimator, estimator.update(belief, innovation, weights), wanted, 1e-8)


LAWS: tuple[Law, ...] = (
    Law(pure),
    *draws.LAWS,
    *(Law(law, needs="not traits.draws") for law in (
        batches_as_it_loops, a_short_time_forgets_nothing, soft_weights_give_the_mixtures_moments,
    )),
    *map(Law, (
        tracks_come_and_go, starts_at_its_prior, no_time_changes_nothing,
        a_missed_scan_equals_prediction, returns_of_weight_zero_change_nothing,
        a_scan_in_one_call_is_its_parts, order_of_returns_is_free, a_unit_of_measurement_is_free, a_miss_has_its_probability,
        return_likelihood_is_a_density,
    )),
    Law(gates_lie_in_their_extent, needs="traits.bounded", share=2),
    *exact.LAWS, *credibility.LAWS, *mixture.LAWS, *sharp_beliefs.LAWS, *reframing.LAWS,
    *frames.LAWS, *gaps.OF_ESTIMATORS, *twins.OF_ESTIMATORS,
)  # fmt: skip
