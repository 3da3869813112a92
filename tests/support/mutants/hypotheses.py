"""Associators that keep hypotheses, with one thing wrong."""

import numpy as np
from attrs import evolve

from support.mutants.parts import CALLS
from vedette.hypotheses import LeafScores
from vedette_standard.associators.k_best import KBest
from vedette_standard.associators.lmb import LabelledMultiBernoulli, Mixtures
from vedette_standard.associators.n_scan import NScan
from vedette_standard.associators.variational import Variational

LMB = LabelledMultiBernoulli


def branched(base, change):
    """With something changed in what a scan leaves."""
    return {"branch": lambda s, h, a, b: change(base.branch(s, h, a, b), b)}


def table_of(scores):
    """The table (l, 1+k) of leaves' scores, column 0 the miss, -inf outside the gate."""
    table = np.full((len(scores.miss), 1 + scores.k), -np.inf)
    table[:, 0], table[scores.leaf, 1 + scores.returns] = scores.miss, scores.scores
    return table


def asked(base, change):
    """With other scores, as a table, or other places where tracks may begin."""

    def branch(self, hypotheses, scores, begins):
        table, places = change(table_of(scores), begins)
        return base.branch(self, hypotheses, LeafScores.of(table), places)

    return {"branch": branch}


def tempered(scores, begins):
    return 0.5 * scores, begins


def a_return_for_all(self, hypotheses, scores, begins):
    """As PDA: every leaf branches by itself."""
    table = table_of(scores)
    share = np.exp(table - table.max(axis=-1, keepdims=True))
    share /= share.sum(axis=-1, keepdims=True)
    parent, choice = np.nonzero(share)
    count = int(hypotheses.track.max()) + 1
    news = np.flatnonzero(begins)
    return evolve(
        LMB.branch(self, hypotheses, scores, begins),
        parent=np.concatenate([parent, np.full(len(news), -1)]),
        choice=np.concatenate([choice, 1 + news]),
        hypotheses=Mixtures(
            np.concatenate([hypotheses.track[parent], count + np.arange(len(news))]),
            np.concatenate([share[parent, choice], np.ones(len(news))]),
        ),
    )


def flat(hypotheses):
    count = np.bincount(hypotheses.cluster)
    return evolve(hypotheses, weights=1.0 / count[hypotheses.cluster])


def lightest(hypotheses):
    last = np.flatnonzero(np.diff(np.append(hypotheses.cluster, -1)))
    return np.sort(hypotheses.leaves[np.isin(hypotheses.rows, last)])


def keeps_one_fewer(self, hypotheses, alive):
    spared = np.array(alive)
    spared[-1:] = False
    return KBest.keep(self, hypotheses, spared if len(alive) > 1 else alive)


def keeps_the_dead(self, hypotheses, alive):
    return KBest.keep(self, hypotheses, np.ones_like(alive))


def dead_take_their_share(self, hypotheses, alive):
    left, rows = LMB.keep(self, hypotheses, alive)
    return Mixtures(left.track, 0.5 * left.weights if len(rows) < len(alive) else left.weights), rows


def stale(self, hypotheses, scores, begins):
    after = KBest.branch(self, hypotheses, scores, begins)
    return evolve(after, hypotheses=flat(after.hypotheses)) if len(hypotheses.weights) > 1 else after


def overwrites(self, hypotheses, scores, begins):
    after = KBest.branch(self, hypotheses, scores, begins)
    hypotheses.weights[...] = 0.5
    return after


def merged(change):
    def merge(self, hypotheses, estimate, existence, state):
        made = Variational.merge(self, hypotheses, estimate, existence, state)
        return evolve(made, shares=change(made.shares))

    return {"merge": merge}


HYPOTHESES = [
    ("choices counted from 0", KBest, "leaves_are_of_the_scan",
     branched(KBest, lambda b, _: evolve(b, choice=b.choice - 1))),
    ("tracks begin at any return", KBest, "leaves_are_of_the_scan", asked(KBest, lambda a, b: (a, np.ones_like(b)))),
    ("new leaves first", KBest, "leaves_are_of_the_scan",
     branched(KBest, lambda b, _: evolve(b, parent=b.parent[::-1], choice=b.choice[::-1]))),
    ("takes what is forbidden", KBest, "leaves_are_of_the_scan",
     asked(KBest, lambda a, b: (np.where(np.isfinite(a), a, 0.0), b))),
    ("each track by itself", LMB, "given_tracks_are_somewhere", {"branch": a_return_for_all}),
    ("half of the weight is lost", LMB, "given_tracks_are_somewhere",
     {"probability": lambda s, h: 0.5 * h.weights}),
    ("hypotheses weigh alike", KBest, "first_scan_is_enumerated",
     branched(KBest, lambda b, _: evolve(b, hypotheses=flat(b.hypotheses)))),
    ("scores halved", KBest, "first_scan_is_enumerated", asked(KBest, tempered)),
    ("no track begins", NScan, "first_scan_is_enumerated", asked(NScan, lambda a, b: (a, np.zeros_like(b)))),
    ("tracks begin at claimed returns", LMB, "first_scan_is_enumerated",
     branched(LMB, lambda b, _: evolve(b, hypotheses=Mixtures(
         b.hypotheses.track, np.where(b.parent < 0, 1.0, b.hypotheses.weights))))),
    ("forgets what hypotheses weighed", KBest, "histories_multiply", {"branch": stale}),
    ("shows the lightest", KBest, "histories_multiply", {"reported": lambda s, h, e: lightest(h)}),
    ("shows the first leaf", LMB, "histories_multiply",
     {"reported": lambda s, h, e: np.unique(h.track, return_index=True)[1]}),
    ("the first track first", KBest, "order_of_a_scan_is_free",
     asked(KBest, lambda a, b: (a + np.eye(*a.shape), b))),
    ("absolute scores count", LMB, "order_of_a_scan_is_free", asked(LMB, lambda a, b: (np.tanh(a) * 3.0, b))),
    ("one leaf more ends", KBest, "keeping_all_changes_nothing", {"keep": keeps_one_fewer}),
    ("ended leaves stay", KBest, "keeping_all_changes_nothing", {"keep": keeps_the_dead}),
    ("leaves fade when others end", LMB, "keeping_all_changes_nothing", {"keep": dead_take_their_share}),
    ("track by track", KBest, "one_hypothesis_is_the_best",
     asked(KBest, lambda a, b: (a - np.where(np.arange(len(a))[:, None] > 0, 3.0, 0.0) * (np.arange(a.shape[1]) > 0), b))),
    ("shows every leaf", KBest, "shown_once_oldest_first",
     {"reported": lambda s, h, e: np.arange(len(h.track))}),
    ("the youngest first", Variational, "shown_once_oldest_first",
     {"reported": lambda s, h, e: Variational.reported(s, h, e)[::-1]}),
    ("shares sum to one", Variational, "merging_keeps_every_weight",
     merged(lambda shares: shares / np.maximum(shares.sum(axis=-1, keepdims=True), 1e-300))),
    ("the heaviest alone", Variational, "merging_keeps_every_weight",
     merged(lambda shares: np.where(shares == shares.max(axis=-1, keepdims=True), shares, 0.0))),
    ("leaves of others far away", Variational, "merging_keeps_every_weight",
     {"merge": lambda s, h, e, existence, state: Variational.merge(s, h, evolve(e, mean=0.0 * e.mean), existence, state)}),
    ("merges where the heaviest are shown", KBest, "merging_keeps_every_weight",
     {"merges": property(lambda s: "shown" if s.show == "heaviest" else "")}),
    ("keeps a state between calls", KBest, "branches_purely", {"probability": lambda s, h: (
        KBest.probability(s, h) / (1 + next(CALLS) % 2))}),
    ("writes into the hypotheses", KBest, "branches_purely", {"branch": overwrites}),
]  # fmt: skip
