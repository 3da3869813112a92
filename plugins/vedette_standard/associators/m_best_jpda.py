"""Joint probabilistic data association by the best joint associations alone."""

from __future__ import annotations

from typing import Any, ClassVar, final

from attrs import frozen

from vedette import Array, Associator, Mask, fields
from vedette.tracking import Expected, Meeting, Pairs
from vedette_standard.associators.marginals import left_out, marginals_of_table, of_each_pair
from vedette_standard.unresolved.clusters import associate_close
from vedette_standard.unresolved.meeting import meet_close


@final
@frozen
class MBestJpda(Associator):
    """Returns the marginal probabilities of the m best joint associations of each cluster, as if there were no others.

    Tracks that share returns, directly or through others, are a cluster. Its best associations are found by Murty's
    algorithm. If there are no more than `m`, this equals `jpda`; otherwise the least likely ones are left out, and the
    weights of the others normalised. A track counts as approximated if that leaves out more than `LOST`.
    Hamid Rezatofighi et al., Joint Probabilistic Data Association Revisited, ICCV 2015.

    >>> import numpy as np
    >>> from itertools import product
    >>> scores = np.array([[-1.0, 0.5, -0.2, -np.inf], [-0.6, 0.3, 0.8, -0.1], [0.2, -np.inf, -np.inf, 1.1]])
    >>> events = [e for e in product(range(4), repeat=3) if len({*e} - {0}) == np.count_nonzero(e)]  # no return twice
    >>> p = np.exp([sum(scores[range(3), e]) for e in events])
    >>> for m in (3, 200):
    ...     best = np.where(p >= np.sort(p)[::-1][: min(m, len(p))][-1], p, 0.0)
    ...     wanted = [[best @ [e[t] == i for e in events] / np.sum(best) for i in range(4)] for t in range(3)]
    ...     np.allclose(MBestJpda(m).associate(scores, None), wanted), MBestJpda(m).approximated(scores).tolist()
    (True, [True, True, True])
    (True, [False, False, False])
    """

    kind: ClassVar[str] = "m_best_jpda"
    by_cluster: ClassVar[bool] = True
    exclusive: ClassVar[bool] = True
    takes_merged: ClassVar[bool] = True
    approximates: ClassVar[bool] = True
    """Whether it approximates: associations beyond the `m` best are left out."""

    m: int = fields.integer("number of joint associations of a cluster", default=200, at_least=1)

    def approximated(self, scores: Array) -> Mask:
        """Return the tracks (*b, t) of clusters whose other associations are too probable."""
        return left_out(scores, self.m)

    def associate(self, scores: Array, evidence: Array | None) -> Array:
        """Return the association weights: (*b, t, 1+k) -> (*b, t, 1+k)."""
        return marginals_of_table(scores, self.m)[0]

    def associate_pairs(self, pairs: Pairs) -> tuple[Array, Array, Mask]:
        """Return the weights of pairs (p,) and misses (t,), and the tracks (t,) of which too much is left out."""
        return of_each_pair(pairs, self.m)

    def meet_close(self, expected: Expected) -> Meeting | None:
        """Return the meeting of rows that may give one return with another one; None: none may."""
        return meet_close(expected)

    def associate_close(self, expected: Expected, pairs: Pairs, meeting: Meeting, places: Any) -> Any:
        """Return the weights of pairs where two rows may give one return, by the `m` best joint events."""
        return associate_close(expected, pairs, meeting, places, self.m)
