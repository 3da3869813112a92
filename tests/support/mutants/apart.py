"""Associators, births and lifecycles in which what is far away counts."""

import numpy as np
from attrs import evolve

from vedette import kernels
from vedette_standard.associators.jpda import Jpda
from vedette_standard.associators.k_best import KBest
from vedette_standard.associators.m_best_jpda import MBestJpda
from vedette_standard.births.from_returns import FromReturns
from vedette_standard.lifecycles.existence import Existence


def best_of_all(self, scores, evidence):
    """The best associations of all tracks together, as published."""
    t = scores.shape[-2]
    weights = np.zeros(scores.shape)
    _, choice, total = kernels.best_joint(np.array(scores), np.arange(t)[None], np.array([4]))
    for taken, share in zip(choice, np.exp(total - total.max()) / np.sum(np.exp(total - total.max())), strict=True):
        weights[np.arange(t), taken] += share
    return weights


def shares_what_it_keeps(self, hypotheses, scores, begins):
    """All clusters together have so many hypotheses."""
    few = max(1, 6 // (1 + int(hypotheses.cluster.max(initial=0))))
    return KBest.branch(evolve(KBest(), hypotheses=few), hypotheses, scores, begins)


def first_two(self, found, estimator, sensor, name, detections, claimed):
    begun = FromReturns.begin(self, found, estimator, sensor, name, detections, claimed)
    rows = slice(2)
    prior = evolve(begun.prior, mean=begun.prior.mean[rows], cov=begun.prior.cov[rows])
    return evolve(begun, returns=begun.returns[rows], prior=prior, existence=begun.existence[rows])


def more_for_more(self, found, estimator, sensor, name, detections, claimed):
    begun = FromReturns.begin(self, found, estimator, sensor, name, detections, claimed)
    return evolve(begun, existence=0.09 * begun.existence * min(10, len(begun.existence)))


def against_the_mean(self, own, scan):
    return Existence.judge(self, own, evolve(scan, existence=scan.existence - 0.3 * np.mean(scan.existence)))


def merged_twice(self, it):
    """Each event in which two give one return counts twice."""
    part = Jpda.meet_close(self, it)
    return evolve(part, close=evolve(part.close, scores=part.close.scores + np.log(2.0)))


def never_resolved(self, it):
    """The sensor's cells are as wide as the scene."""
    return Jpda.meet_close(self, evolve(it, sensor=evolve(it.sensor, cells={"x": 1e6, "y": 1e6})))


ASSOCIATION = "far_scenes_change_no_association"
ASSOCIATORS = [
    ("the best of all tracks together", MBestJpda, ASSOCIATION, {"associate": best_of_all}),
    ("hypotheses are shared by all clusters", KBest, ASSOCIATION, {"branch": shares_what_it_keeps}),
    ("the number of tracks counts", Jpda, ASSOCIATION,
     {"associate": lambda s, a, e: Jpda.associate(s, a / (1.0 + 0.1 * a.shape[-2]), e)}),
    ("a return is of one target", Jpda, "one_return_may_be_of_two", {"meet_close": lambda s, it: None}),
    ("hypotheses in which a return is of one target", KBest, "one_return_may_be_of_two", {"meet_close": lambda s, it: None}),
    ("the middle for two however far apart", Jpda, "one_return_may_be_of_two", {"meet_close": never_resolved}),
    ("returns of two count twice", Jpda, "one_return_may_be_of_two", {"meet_close": merged_twice}),
]  # fmt: skip
BIRTHS = [
    ("two tracks a scan", FromReturns, "far_scenes_change_no_birth", {"begin": first_two}),
    ("each track exists the more the more there are", FromReturns, "far_scenes_change_no_birth",
     {"begin": more_for_more, "initial_existence": property(lambda s: None)}),
]  # fmt: skip
LIFECYCLES = [("judged beside the others", Existence, "far_scenes_change_no_life", {"judge": against_the_mean})]
