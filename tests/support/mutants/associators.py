"""Associators with one thing wrong."""

import numpy as np

from support.mutants.parts import CALLS, changed
from vedette_standard.associators.global_nearest import GlobalNearest
from vedette_standard.associators.jpda import Jpda
from vedette_standard.associators.m_best_jpda import MBestJpda
from vedette_standard.associators.nearest import Nearest
from vedette_standard.associators.pda import Pda


def softmax(scores):
    likely = np.exp(scores - scores.max(axis=-1, keepdims=True))
    return likely / likely.sum(axis=-1, keepdims=True)


def greedy(self, scores, evidence):
    """Tracks choose one after the other."""
    weights = np.zeros_like(scores)
    for run in np.ndindex(scores.shape[:-2]):
        left = np.array(scores[run])
        for row in range(len(left)):
            best = int(np.argmax(left[row]))
            weights[run][row, best] = 1.0
            if best:
                left[row + 1 :, best] = -np.inf
    return weights


ASSOCIATORS = [
    ("weights not normalised", Pda, "rows_sum_to_one", {"associate": lambda s, a, e: 0.99 * softmax(a)}),
    ("a negative weight", Pda, "rows_sum_to_one",
     {"associate": lambda s, a, e: 1.5 * softmax(a) - 0.5 / a.shape[-1]}),
    ("no weight for a miss", Pda, "equals_brute_force",
     {"associate": lambda s, a, e: changed(softmax(a), lambda w: np.divide(w, 1 - 0.5 * w[..., :1], out=w) if w.shape[-1] > 1
                                           else None)}),
    ("scores halved", Pda, "equals_brute_force", {"associate": lambda s, a, e: softmax(0.5 * a)}),
    ("a floor under all weights", Pda, "forbidden_stays_forbidden",
     {"associate": lambda s, a, e: 0.99 * softmax(a) + 0.01 / a.shape[-1]}),
    ("claims a return twice", Nearest, "each_return_is_claimed_once", {"exclusive": True}),
    ("PDA declared exclusive", Pda, "each_return_is_claimed_once", {"exclusive": True}),
    ("tracks choose in turn", GlobalNearest, "equals_brute_force", {"associate": greedy}),
    ("the first track chooses first", GlobalNearest, "order_of_tracks_is_free", {"associate": greedy}),
    ("later returns count more", Pda, "order_of_returns_is_free",
     {"associate": lambda s, a, e: softmax(a + 0.1 * np.arange(a.shape[-1]))}),
    ("absolute scores count", Pda, "row_constants_change_nothing",
     {"associate": lambda s, a, e: softmax(np.minimum(a, 0.0))}),
    ("normalised over tracks", Pda, "rows_sum_to_one",
     {"associate": lambda s, a, e: (w := np.exp(a - a.max())) / w.sum(axis=-2, keepdims=True)}),
    ("one run's scale for all runs", Pda, "batches_as_it_loops",
     {"associate": lambda s, a, e: softmax(a / (1 + a.shape[0] * (a.ndim > 2)))}),
    ("returns counted, forbidden ones too", Pda, "a_far_return_changes_nothing",
     {"associate": lambda s, a, e: softmax(np.concatenate([a[..., :1] + np.log(a.shape[-1]), a[..., 1:]], -1))}),
    ("certain by its word alone", Nearest, "rows_sum_to_one", {"associate": lambda s, a, e: softmax(a)}),
    ("no return is ever taken", Pda, "needs_no_evidence",
     {"associate": lambda s, a, e: np.broadcast_to(np.arange(a.shape[-1]) == 0, a.shape).astype(float)}),
    ("needs a return", Pda, "no_returns_is_a_miss",
     {"associate": lambda s, a, e: softmax(a) if a[..., 1:].max() > -np.inf or a.shape[-1] > 1 else a}),
    ("writes into the scores", Pda, "pure", {"associate": lambda s, a, e: softmax(np.subtract(a, a.max(), out=a))}),
    ("keeps a state between calls", Pda, "pure", {"associate": lambda s, a, e: softmax(a / (1 + next(CALLS)))}),
    ("never called approximate", MBestJpda, "crowds_are_shared",
     {"approximated": lambda s, a: np.zeros(a.shape[:-1], dtype=bool)}),
    ("what it solves called approximate", Jpda, "crowds_are_shared",
     {"approximated": lambda s, a: np.ones(a.shape[:-1], dtype=bool)}),
    ("joint probabilities without exclusion", Jpda, "equals_brute_force", {"associate": lambda s, a, e: softmax(a)}),
]  # fmt: skip
