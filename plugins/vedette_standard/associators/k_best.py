"""The k best global hypotheses."""

from __future__ import annotations

from typing import ClassVar, Literal, final

from attrs import frozen

from vedette import Array, Branching, Gaussian, HypothesisAssociator, Indices, Mask, Merging, Space, fields, kernels
from vedette_standard.associators.hypotheses import GlobalHypotheses, branched, heaviest, kept, leaf_probability
from vedette_standard.associators.recombined import merged_by_track


@final
@frozen
class KBest(HypothesisAssociator):
    """Keeps the best joint associations of all scans so far: with Poisson births, the Poisson multi-Bernoulli mixture.

    A hypothesis of weight w gets the ceil(w hypotheses) best associations of the scan, found by Murty's algorithm, each
    weighted by w times the product of its scores. Those with at most `least` of all weight are dropped, and equal ones
    merged. The tracks that are shown are those of the heaviest; or, with `show = "mean"`, the independent targets that are
    closest to all hypotheses, as `variational` finds them: these err less, as they are means, but need a Gaussian belief.
    Garcia-Fernandez, Williams, Granstrom, Svensson, Poisson Multi-Bernoulli Mixture Filter: Direct Derivation and
    Implementation, IEEE T-AES 54, 2018.
    """

    kind: ClassVar[str] = "k_best"

    hypotheses: int = fields.integer("most hypotheses that are kept", default=100, at_least=1)
    least: float = fields.probability("weight at or below which a hypothesis is dropped", default=1e-4, below=1)

    show: str = fields.choice("what is shown of the hypotheses", ("heaviest", "mean"), default="heaviest")

    @property
    def merges(self) -> Literal["", "shown"]:
        """Leaves are merged to be shown, if the mean is."""
        return "shown" if self.show == "mean" else ""

    def associate(self, scores: Array, evidence: Array | None) -> Array:
        """Return the marginals of the scan's k best associations: (*b, t, 1+k) -> (*b, t, 1+k)."""
        return kernels.best_marginals(scores, self.hypotheses)

    def initial_hypotheses(self, tracks: int) -> GlobalHypotheses:
        """Return the one hypothesis that holds every given track."""
        return GlobalHypotheses.of(tracks)

    def branch(self, hypotheses: GlobalHypotheses, scores: Array, begins: Mask) -> Branching:
        """Return the leaves and hypotheses after a scan."""
        return branched(hypotheses, scores, begins, self.hypotheses, self.least)

    def merge(self, hypotheses: GlobalHypotheses, estimate: Gaussian, existence: Array, state: Space) -> Merging:
        """Return the leaves merged into one for each track."""
        return merged_by_track(hypotheses, estimate, existence, state)

    def keep(self, hypotheses: GlobalHypotheses, alive: Mask) -> tuple[GlobalHypotheses, Indices]:
        """Return the hypotheses without the leaves that ended, equal ones merged."""
        return kept(hypotheses, alive)

    def probability(self, hypotheses: GlobalHypotheses) -> Array:
        """Return the probability of each leaf."""
        return leaf_probability(hypotheses)

    def reported(self, hypotheses: GlobalHypotheses) -> Indices:
        """Return the leaves of the heaviest hypothesis."""
        return heaviest(hypotheses)
