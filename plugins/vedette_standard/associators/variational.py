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
    """

    kind: ClassVar[str] = "variational"

    hypotheses: int = fields.integer(
        "largest number of joint associations of a cluster that are computed", default=200, at_least=1
    )
    least: float = fields.probability("weight at or below which a joint association is dropped", default=1e-4, below=1)

    @property
    def merges(self) -> Literal["kept"]:
        """Leaves of all associations are merged into one a track."""
        return "kept"
