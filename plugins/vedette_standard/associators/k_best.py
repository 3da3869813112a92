"""The k best global hypotheses."""

from __future__ import annotations

from typing import ClassVar, Literal, final

from attrs import frozen

from vedette import fields
from vedette_standard.associators.growing import Growing


@final
@frozen
class KBest(Growing):
    """Keeps the best joint associations of all scans so far: with Poisson births, the Poisson multi-Bernoulli mixture.

    Tracks that share returns, now or in the hypotheses kept, are a cluster, which has hypotheses of its own. Where
    truncation would drop much, clusters that hardly compete for a return are not joined by it (`parting.py`).
    A hypothesis of weight w gets the ceil(w hypotheses) best associations of the scan, found by Murty's algorithm, each
    weighted by w times the product of its scores. Those with at most `least` of all weight are dropped, and equal ones
    merged. The tracks shown are those of the heaviest
    hypothesis of each cluster; or, with `show = "mean"`, the independent targets that are
    closest to all hypotheses, as in `variational`: being means, these have a smaller error.
    Garcia-Fernandez, Williams, Granstrom, Svensson, Poisson Multi-Bernoulli Mixture Filter: Direct Derivation and
    Implementation, IEEE T-AES 54, 2018.

    >>> import numpy as np
    >>> from itertools import product
    >>> from vedette.hypotheses import LeafScores
    >>> scores = np.array([[-1.0, 0.5, -0.2], [-0.6, 0.3, 0.8]])
    >>> events = [e for e in product(range(3), repeat=2) if len({*e} - {0}) == np.count_nonzero(e)]  # no return twice
    >>> p = np.sort(np.exp([sum(scores[range(2), e]) for e in events]))[::-1]
    >>> for kind in (KBest(hypotheses=100, least=0.0), KBest(hypotheses=3, least=0.0), KBest(hypotheses=100, least=0.1)):
    ...     found = kind.branch(kind.initial_hypotheses(2), LeafScores.of(scores), np.zeros(2, dtype=bool))
    ...     weights, count = found.hypotheses.weights, len(found.hypotheses.weights)
    ...     shown = found.choice[kind.reported(found.hypotheses, None)].tolist()
    ...     count, np.allclose(weights, p[:count] / np.sum(p[:count])), shown
    (7, True, [1, 2])
    (3, True, [1, 2])
    (4, True, [1, 2])
    >>> later = LeafScores.of(np.array([[0.1 * leaf] for leaf in range(len(found.parent))]))  # weighted by the next scan's
    >>> after = KBest(least=0.0).branch(found.hypotheses, later, np.zeros(0, dtype=bool)).hypotheses
    >>> held = [found.hypotheses.leaves[found.hypotheses.rows == row] for row in range(count)]
    >>> wanted = found.hypotheses.weights * np.exp([0.1 * sum(leaves) for leaves in held])
    >>> np.allclose(after.weights, np.sort(wanted)[::-1] / np.sum(wanted)), KBest().merges, KBest(show="mean").merges
    (True, '', 'shown')
    """

    kind: ClassVar[str] = "k_best"
    abbreviations: ClassVar[tuple[str, ...]] = ("pmbm",)

    hypotheses: int = fields.integer("most hypotheses that are kept of a cluster", default=100, at_least=1)
    least: float = fields.probability("weight at or below which a hypothesis is dropped", default=1e-4, below=1)

    show: str = fields.choice("what is shown of the hypotheses", ("heaviest", "mean"), default="heaviest")

    @property
    def merges(self) -> Literal["", "shown"]:
        """Leaves are merged to be shown, if the mean is."""
        return "shown" if self.show == "mean" else ""
