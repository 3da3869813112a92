"""Joint probabilistic data association by the best joint associations alone."""

from __future__ import annotations

from typing import ClassVar, final

from attrs import frozen

from vedette import Array, Associator, fields, kernels


@final
@frozen
class MBestJpda(Associator):
    """Returns the marginal probabilities of the m best joint associations of a scan, as if there were no others.

    They are found by Murty's algorithm. If there are no more than `m`, this equals `jpda`; otherwise the least likely
    associations are left out, and the weights of the others normalised.
    Hamid Rezatofighi et al., Joint Probabilistic Data Association Revisited, ICCV 2015.
    """

    kind: ClassVar[str] = "m_best_jpda"
    exclusive: ClassVar[bool] = True

    m: int = fields.integer("number of joint associations", default=200, at_least=1)

    def associate(self, scores: Array, evidence: Array | None) -> Array:
        """Return the association weights: (*b, t, 1+k) -> (*b, t, 1+k)."""
        return kernels.best_marginals(scores, self.m)
