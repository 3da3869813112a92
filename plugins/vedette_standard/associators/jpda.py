"""Joint probabilistic data association."""

from __future__ import annotations

from typing import Any, ClassVar, final

import numpy as np
from attrs import frozen

from vedette import Array, Associator, Indices, Mask, fields, kernels
from vedette.tracking import Expected, Meeting, Pairs
from vedette_standard.associators.of_pairs import MOST_MESSAGES, marginals_of_pairs, propagated
from vedette_standard.unresolved.clusters import associate_close
from vedette_standard.unresolved.meeting import meet_close


@final
@frozen
class Jpda(Associator):
    """Returns the marginal probabilities of all joint associations in which no two tracks share a return.

    P(a) ~ prod_t exp(score of t's part in a). Tracks that share returns, directly or through others, are a cluster; a track
    that shares none is PDA. A cluster is summed exactly, over sets of at most `exact` tracks or returns, however many it
    has; where more would be kept apart at once, or some four million sets in all, by belief propagation, which is exact
    only on trees and overconfident where two targets are close (weights off by .05 on average there, by .35 at worst), in
    so many sweeps as take 200,000 messages. Where targets stay close, their tracks come to lie between them (coalescence).
    Fortmann, Bar-Shalom, Scheffe, Sonar Tracking of Multiple Targets Using JPDA, IEEE J. Oceanic Engineering 8, 1983.

    >>> from itertools import product
    >>> scores = np.array([[-1.0, 0.5, -0.2, -np.inf], [-0.6, 0.3, 0.8, -0.1], [0.2, -np.inf, -np.inf, 1.1]])
    >>> events = [e for e in product(range(4), repeat=3) if len({*e} - {0}) == np.count_nonzero(e)]  # no return twice
    >>> p = np.exp([sum(scores[range(3), e]) for e in events])
    >>> wanted = [[p @ [e[t] == i for e in events] / np.sum(p) for i in range(4)] for t in range(3)]
    >>> np.allclose(Jpda().associate(scores, None), wanted)
    True
    >>> np.allclose(Jpda(exact=2).associate(scores, None), wanted, atol=0.05)  # by belief propagation
    True
    >>> crowd = np.full((2, 3, 4), 0.5)  # all three share all three returns
    >>> Jpda(exact=3).approximated(crowd)[0].tolist(), Jpda(exact=2).approximated(crowd)[0].tolist()
    ([False, False, False], [True, True, True])
    >>> tree = scores[:2, :2]  # two that share one return: belief propagation is exact
    >>> np.allclose(Jpda(exact=0).associate(tree, None), Jpda().associate(tree, None))
    True
    """

    kind: ClassVar[str] = "jpda"
    by_cluster: ClassVar[bool] = True
    exclusive: ClassVar[bool] = True
    takes_merged: ClassVar[bool] = True
    approximates: ClassVar[bool] = True
    """Whether it approximates: clusters that are too wide are solved by belief propagation."""

    exact: int = fields.integer(
        "most tracks, or else most returns, that exact sums keep apart at once: each takes twice the time",
        default=14,
        at_most=16,
    )
    tolerance: float = fields.quantity("1", "largest relative change of a message at which to stop", default=1e-9, above=0)
    sweeps: int = fields.integer("most sweeps of belief propagation", default=1000, at_least=1)

    @property
    def solves(self) -> str:
        return "marginals" if self.exact >= 4 else ""

    def approximated(self, scores: Array) -> Mask:
        """Return the tracks (*b, t) of clusters that are too wide for exact sums."""
        if min(scores.shape[-2], scores.shape[-1] - 1) <= self.exact:
            return np.zeros(scores.shape[:-1], dtype=bool)
        return kernels.wide_clusters(scores, self.exact)

    def associate(self, scores: Array, evidence: Array | None) -> Array:
        """Return the association weights: (*b, t, 1+k) -> (*b, t, 1+k)."""
        weights, wide = kernels.joint_weights(scores, self.exact)
        for run in {index[:-1] for index in zip(*np.nonzero(wide), strict=True)}:
            own, rows = scores[run], np.flatnonzero(wide[run])
            tracks, returns = np.nonzero(np.isfinite(own[rows, 1:]))
            at = rows[tracks], 1 + returns
            found, misses = self._propagated(tracks, returns, own[at], own[rows, 0], own.shape[-1] - 1)
            weights[run][rows, 0], weights[run][at] = misses, found
        return weights

    def associate_pairs(self, pairs: Pairs) -> tuple[Array, Array, Mask]:
        """Return the weights of pairs (p,) and misses (t,), and the tracks of clusters that are too wide."""
        return marginals_of_pairs(
            pairs.tracks, pairs.returns, pairs.scores, pairs.miss, pairs.k, self.exact, self.tolerance, self.sweeps
        )

    def _propagated(self, tracks: Indices, returns: Indices, scores: Array, miss: Array, k: int) -> tuple[Array, Array]:
        return propagated(tracks, returns, scores, miss, k, self.tolerance, float(self.sweeps), float(MOST_MESSAGES))

    def meet_close(self, expected: Expected) -> Meeting | None:
        """Return the meeting of rows that may give one return with another one; None: none may."""
        return meet_close(expected)

    def associate_close(self, expected: Expected, pairs: Pairs, meeting: Meeting, places: Any) -> Any:
        """Return the weights of pairs where two rows may give one return, by the sum over all joint events."""
        return associate_close(expected, pairs, meeting, places)
