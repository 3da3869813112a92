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

    Tracks that share returns, now or in the hypotheses kept, are a cluster, which has hypotheses of its own.
    A hypothesis of weight w gets the ceil(w hypotheses) best associations of the scan, found by Murty's algorithm, each
    weighted by w times the product of its scores. Those with at most `least` of all weight are dropped, and equal ones
    merged. The tracks shown are those of the heaviest
    hypothesis of each cluster; or, with `show = "mean"`, the independent targets that are
    closest to all hypotheses, as in `variational`: being means, these have a smaller error.
    Garcia-Fernandez, Williams, Granstrom, Svensson, Poisson Multi-Bernoulli Mixture Filter: Direct Derivation and
    Implementation, IEEE T-AES 54, 2018.
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
