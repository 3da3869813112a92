"""Joint probabilistic data association that does not let tracks run together."""

from __future__ import annotations

from typing import ClassVar, final

import numpy as np
from attrs import frozen

from vedette import Array, Associator, Indices, Mask, fields
from vedette.hypotheses import JointHypotheses, LeafScores
from vedette.tracking import Pairs
from vedette_standard.associators.marginals import best_associations, left_out, marginals, marginals_of_table, of_each_pair


@final
@frozen
class JpdaStar(Associator):
    """Returns the marginal probabilities of joint associations, but of those that differ by an exchange only, of the best.

    Associations that detect the same tracks by the same returns, in any order, say the same of where targets are. `jpda`
    averages over them, so that the tracks of targets that stay close come to lie between these (coalescence). Here the
    likeliest order stands for all:
    P(a) ~ prod_t exp(score of t's part in a), if a is the best of its tracks and returns, or else 0.
    It is taken among the `m` best associations of each cluster of tracks that share returns; a track counts as approximated
    if the others are too probable. 20 cover 300 targets 15 m apart, sigma 5 m, as well as 200 do, in a fifth of the time.
    Blom, Bloem, Probabilistic Data Association Avoiding Track Coalescence, IEEE Trans. Automatic Control 45, 2000.

    >>> from itertools import product
    >>> scores = np.array([[-1.0, 0.5, -0.2, -np.inf], [-0.6, 0.3, 0.8, -0.1], [0.2, -np.inf, -np.inf, 1.1]])
    >>> events = [e for e in product(range(4), repeat=3) if len({*e} - {0}) == np.count_nonzero(e)]  # no return twice
    >>> p, kinds = [np.exp(sum(scores[range(3), e])) for e in events], [([i > 0 for i in e], {*e}) for e in events]
    >>> tops = [max(q for q, other in zip(p, kinds) if other == kind) for kind in kinds]  # of all exchanges
    >>> best = np.where(np.equal(p, tops), p, 0.0)
    >>> wanted = [[best @ [e[t] == i for e in events] / np.sum(best) for i in range(4)] for t in range(3)]
    >>> np.allclose(JpdaStar(m=200).associate(scores, None), wanted)
    True
    >>> JpdaStar(m=1).associate(scores, None).tolist()  # the best of all: .5 + .8 + 1.1
    [[0.0, 1.0, 0.0, 0.0], [0.0, 0.0, 1.0, 0.0], [0.0, 0.0, 0.0, 1.0]]
    >>> JpdaStar(m=200).approximated(scores).tolist(), JpdaStar(m=1).approximated(scores).tolist()
    ([False, False, False], [True, True, True])
    """

    kind: ClassVar[str] = "jpda_star"
    by_cluster: ClassVar[bool] = True
    exclusive: ClassVar[bool] = True
    approximates: ClassVar[bool] = True
    """Whether it approximates: associations beyond the `m` best are left out."""

    m: int = fields.integer("number of joint associations of a cluster that are found", default=20, at_least=1)

    def approximated(self, scores: Array) -> Mask:
        """Return the tracks (*b, t) of clusters whose other associations are too probable."""
        return left_out(scores, self.m)

    def associate(self, scores: Array, evidence: Array | None) -> Array:
        """Return the association weights: (*b, t, 1+k) -> (*b, t, 1+k)."""
        return marginals_of_table(scores, self.m, _best_of_each_exchange)[0]

    def associate_pairs(self, pairs: Pairs) -> tuple[Array, Array, Mask]:
        """Return the weights of pairs (p,) and misses (t,), and the tracks (t,) of which too much is left out."""
        return of_each_pair(pairs, self.m, _best_of_each_exchange)


def _best_of_each_exchange(scores: LeafScores, most: int) -> tuple[Array, Array, Array]:
    """Return the marginals over the best associations of each set of tracks that are detected and of their returns."""
    best = best_associations(scores, most)
    hit = best.choice > 0
    code = np.where(hit, _mixed(2 * best.parent) + _mixed(2 * best.choice + 1), 0)
    return marginals(scores, best, _of_first(best.hypotheses, code))


def _of_first(hypotheses: JointHypotheses, code: Indices) -> Array:
    """Return the probability (l,) of leaves if, of hypotheses whose codes (l,) have the same sum, the heaviest count."""
    sums = np.zeros(len(hypotheses.weights), dtype=np.int64)
    np.add.at(sums, hypotheses.rows, code[hypotheses.leaves])
    first = np.zeros(len(hypotheses.weights), dtype=bool)
    first[np.unique(np.stack([hypotheses.cluster, sums]), axis=1, return_index=True)[1]] = True
    weights = np.where(first, hypotheses.weights, 0.0)
    weights = weights / np.bincount(hypotheses.cluster, weights)[hypotheses.cluster]
    return np.bincount(hypotheses.leaves, weights[hypotheses.rows], len(hypotheses.track)).astype(float)


def _mixed(numbers: Indices) -> Indices:
    """Return whole numbers of 64 bits whose sums over different sets differ but by the rarest chance: SplitMix64."""
    x = (numbers.astype(np.uint64) + np.uint64(1)) * np.uint64(0x9E3779B97F4A7C15)
    x = (x ^ (x >> np.uint64(30))) * np.uint64(0xBF58476D1CE4E5B9)
    x = (x ^ (x >> np.uint64(27))) * np.uint64(0x94D049BB133111EB)
    return (x ^ (x >> np.uint64(31))).view(np.int64)
