"""How likely a tracker found a scan before it saw it: the predictive density of a Poisson multi-Bernoulli belief."""

from __future__ import annotations

import math

import numpy as np
from attrs import evolve, frozen

from vedette import Array, Detections, Frame, HypothesisAssociator, Tracker, kernels
from vedette.tracking import Expected, State, weighed
from vedette_tools.tuning.field_of_view import Cover

NEGLIGIBLE = 40.0
"""A pair of track and return that is less likely than others of its track by this, in logarithms, is left out."""
SETS = 12
"""Joint associations are summed exactly while so many tracks, or returns, need to be kept apart at once."""
NOTHING: Array = np.zeros(1)


@frozen
class Predictive:
    """The log-likelihood of scans under what a tracker expects of each, scan by scan in order.

    log p(Z) = sum_i log c(z_i) - int c + log sum_a prod_t s(t, a_t), over the joint associations a in which no return is
    that of two tracks. c is the density of clutter, and of undetected targets if the birth states it; s(t, 0) = 1 - e + e
    (1 - P_D) and s(t, i) = e P_D p(z_i | t) / c(z_i) for a track of existence e. Names are evidence of pairs, gates take no
    part. Exact for one target that is there and a filter that is exact; else as good as the tracker's belief. A frame counts
    by its ratio to its background. Where the associator keeps hypotheses, each track's leaves are weighed by their marginal
    probabilities.
    Garcia-Fernandez, Williams, Granstrom, Svensson, Poisson Multi-Bernoulli Mixture Filter: Direct Derivation and
    Implementation, IEEE Trans. Aerospace and Electronic Systems 54, 2018.
    """

    tracker: Tracker

    def __call__(self, it: Expected, cover: Cover, density: float | None = None) -> tuple[float, float]:
        """Return the log-likelihood of a scan by what was expected of it, and the expected number of returns of no track.

        `density`: that of the clutter, where the tracker counts it itself instead of asking its sensor.
        """
        tracker, before, sensor, observed = self.tracker, it.state, it.sensor, it.observed
        existence = it.existence
        timed = isinstance(observed, Detections) and observed.time is not None
        ungated = evolve(it, plan=evolve(it.plan, p_gate=1.0), gate=evolve(it.gate, threshold=math.inf)) if timed else it
        innovation = ungated.innovation if timed else tracker.estimator.evaluate(it.belief, sensor, observed, 1.0)
        log_density: Array
        if isinstance(observed, Frame):
            expected, log_density = 0.0, NOTHING
            hits, evidence = innovation.loglik[:, 1:], None
        else:
            clutter: Array = sensor.clutter(cover.points) if density is None else np.array(density)
            expected = cover.total(clutter)
            if density is None:
                log_density = tracker.gate.stated_density(sensor, observed)[0]
            else:
                log_density = np.full(len(observed.z), math.log(max(density, 1e-300)))
            if it.rate is not None:
                log_density = np.logaddexp(log_density, kernels.safe_log(it.rate))
                expected += self._unseen(it, cover)
            hits, evidence = innovation.loglik[:, 1:] - log_density, observed.evidence
            hits = hits if evidence is None else hits + evidence
            if not observed.valid.all():
                hits = np.where(observed.valid, hits, -np.inf)
                log_density = log_density[observed.valid]
        miss = innovation.loglik[:, 0]
        scores: Array = np.empty(innovation.loglik.shape)
        scores[:, 0], scores[:, 1:] = miss, hits
        if isinstance(observed, Detections) and observed.identity is not None:
            scores = weighed(tracker.identity, it.names, observed.identity, scores)
        if not tracker.lifecycle.permanent:
            scores[:, 0] = kernels.safe_log(1.0 - existence + existence * np.exp(miss))
            scores[:, 1:] += kernels.safe_log(existence)[:, None]
        if before.leaves is not None:
            scores = self._of_tracks(before, scores)
        return float(np.sum(log_density)) - expected + joint_likelihood(scores), expected

    def _of_tracks(self, state: State, scores: Array) -> Array:
        """Return the scores of tracks from those of their leaves; a hypothesis that holds none of them holds no track."""
        associator, leaves = self.tracker.associator, state.leaves
        assert isinstance(associator, HypothesisAssociator)
        scores = scores + kernels.safe_log(associator.probability(leaves.hypotheses))[:, None]
        ids, place = np.unique(leaves.ids, return_inverse=True)
        likely = np.zeros((len(ids), scores.shape[1]))
        top = np.full(len(ids), -np.inf)
        np.maximum.at(top, place, np.max(scores, axis=-1))
        np.add.at(likely, place, np.exp(scores - top[place, None]))
        there = np.bincount(place, associator.probability(leaves.hypotheses), len(ids))
        likely[:, 0] += np.maximum(1.0 - there, 0.0) * np.exp(np.minimum(-top, 700.0))
        return kernels.safe_log(likely) + top[:, None]

    def _unseen(self, it: Expected, cover: Cover) -> float:
        """Return how many returns of undetected targets are expected."""
        if not len(cover.points):
            return 0.0
        seen = evolve(it.scan.detections, z=cover.points, valid=np.ones(len(cover.points), bool), evidence=None,
                      noise=None, missing=None)  # fmt: skip
        density = undetected_density(it, seen)
        return 0.0 if density is None else cover.total(density)


def undetected_density(it: Expected, detections: Detections) -> Array | None:
    """Return the density (k,) of returns from undetected targets at other returns than the scan's; None: not stated."""
    plan, birth = it.plan, it.plan.birth
    if birth is None or it.undetected is None:
        return None
    return birth.reveal(it.undetected.memory, plan.estimator, it.sensor, detections, plan.p_gate)[0]


def joint_likelihood(scores: Array) -> float:
    """Return log sum_a prod_t exp(scores[t, a_t]) over the joint associations a of tracks to returns (t, 1+k), 0 the miss.

    By the chain of conditional probabilities of one association, log p(a) taken from its score, track by track, or return by
    return where these are fewer. Exact up to clusters of `SETS`; beyond, older tracks claim their returns first.
    """
    if not len(scores):
        return 0.0
    if len(scores) == 1:
        return float(np.logaddexp.reduce(scores[0]))
    own = kernels.log_sum(scores)
    linked = scores[:, 1:] > own[:, None] - NEGLIGIBLE
    several = np.any(linked & (np.sum(linked, axis=0) > 1), axis=1)
    total = float(np.sum(own[~several]))
    rest = scores[several]
    rest[:, 1:][~linked[several]] = -np.inf
    while len(rest):
        taken = 1 + np.flatnonzero(np.any(np.isfinite(rest[:, 1:]), axis=0))
        weights, wide = kernels.joint_weights(rest, SETS)
        if len(rest) <= len(taken) or wide.any():  # what becomes of the first track
            best = int(np.argmax(weights[0]))
            total += float(rest[0, best]) - math.log(float(weights[0, best]))
            rest = rest[1:]
            if best:
                rest[:, best] = -np.inf
        elif len(taken):  # what becomes of the first return, as there are fewer of them
            own, free = weights[:, taken[0]], 1.0 - float(np.sum(weights[:, taken[0]]))
            best = int(np.argmax(own))
            total += float(rest[best, taken[0]]) - math.log(float(own[best])) if own[best] >= free else -math.log(free)
            rest = np.delete(rest, best, axis=0) if own[best] >= free else rest
            rest[:, taken[0]] = -np.inf
        else:
            return total + float(np.sum(rest[:, 0]))
    return total
