"""The multi-Bernoulli closest to the k best joint associations."""

from __future__ import annotations

from typing import ClassVar, Literal, final

from attrs import frozen

from vedette import fields
from vedette_standard.associators.growing import Growing


@final
@frozen
class Variational(Growing):
    """Keeps independent tracks, as `jpda` does, but lets their identities change where that loses least.

    The best joint associations of a scan are a mixture. The filter replaces it by the product of independent tracks with the
    smallest Kullback-Leibler divergence from it, where each association may give any target any track's id. So two tracks
    that met part again as two targets, and not as two averages of both (coalescence). Leaves are merged by their
    moments, those of an IMM mode by mode.
    Williams, An Efficient, Variational Approximation of the Best Fitting Multi-Bernoulli Filter, IEEE T-SP 63, 2015.
    Hypotheses take the place of the paper's marginals.

    >>> import numpy as np
    >>> from vedette import Gaussian, Space
    >>> from vedette.hypotheses import LeafScores
    >>> kind, state, log = Variational(), Space.of(x="m"), np.log
    >>> scores = LeafScores.of(np.array([[-50.0, log(0.55), log(0.45)], [-50.0, log(1.0), log(1.0)]]))  # either way around
    >>> found = kind.branch(kind.initial_hypotheses(2), scores, np.zeros(2, dtype=bool))
    >>> found.parent.tolist(), found.choice.tolist(), found.hypotheses.weights.round(9).tolist()
    ([0, 0, 1, 1], [1, 2, 1, 2], [0.55, 0.45])
    >>> at = Gaussian(100.0 * (found.choice[:, None] - 1.0), np.full((4, 1, 1), 25.0))
    >>> merged = kind.merge(found.hypotheses, at, np.ones(4), state)  # one target at 0, one at 100 m, and none at 45 and 55
    >>> (merged.table(4) @ at.mean).ravel().round(9).tolist(), merged.table(4).round(9).tolist()
    ([0.0, 100.0], [[0.55, 0.0, 0.45, 0.0], [0.0, 0.45, 0.0, 0.55]])
    """

    kind: ClassVar[str] = "variational"
    merges: ClassVar[Literal["kept"]] = "kept"
    """Leaves of all associations are merged into one a track."""

    hypotheses: int = fields.integer(
        "largest number of joint associations of a cluster that are computed", default=200, at_least=1
    )
    least: float = fields.probability("weight at or below which a joint association is dropped", default=1e-4, below=1)
