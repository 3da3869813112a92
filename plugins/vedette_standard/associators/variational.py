"""The multi-Bernoulli closest to the k best joint associations."""

from __future__ import annotations

from typing import ClassVar, Literal, final

from attrs import frozen

from vedette import Array, Branching, Gaussian, HypothesisAssociator, Indices, Mask, Merging, Space, fields, kernels
from vedette_standard.associators.hypotheses import GlobalHypotheses, branched, heaviest, kept, leaf_probability
from vedette_standard.associators.recombined import merged_by_track


@final
@frozen
class Variational(HypothesisAssociator):
    """Keeps independent tracks, as `jpda` does, but lets their identities change where that loses least.

    The best joint associations of a scan are a mixture. Of all products of independent tracks the one of the smallest
    Kullback-Leibler divergence from it is sought, in which each association may call any target by any track's name: so two
    tracks that met part again as two targets, and not as two averages of both (coalescence). Leaves are merged by their
    moments, so the estimator's belief must be a Gaussian.
    Williams, An Efficient, Variational Approximation of the Best Fitting Multi-Bernoulli Filter, IEEE T-SP 63, 2015.
    Hypotheses take the place of the paper's marginals.
    """

    kind: ClassVar[str] = "variational"

    hypotheses: int = fields.integer("most joint associations of a scan that are looked at", default=200, at_least=1)
    least: float = fields.probability("weight at or below which a joint association is dropped", default=1e-4, below=1)

    @property
    def merges(self) -> Literal["kept"]:
        """Leaves of all associations are merged into one a track."""
        return "kept"

    def associate(self, scores: Array, evidence: Array | None) -> Array:
        """Return the marginals of the scan's best associations: (*b, t, 1+k) -> (*b, t, 1+k)."""
        return kernels.best_marginals(scores, self.hypotheses)

    def initial_hypotheses(self, tracks: int) -> GlobalHypotheses:
        """Return the one hypothesis that holds every given track."""
        return GlobalHypotheses.of(tracks)

    def branch(self, hypotheses: GlobalHypotheses, scores: Array, begins: Mask) -> Branching:
        """Return the leaves and hypotheses after a scan."""
        return branched(hypotheses, scores, begins, self.hypotheses, self.least)

    def merge(self, hypotheses: GlobalHypotheses, estimate: Gaussian, existence: Array, state: Space) -> Merging:
        """Return one leaf for each track, of a past that the heaviest association of the track has."""
        return merged_by_track(hypotheses, estimate, existence, state)

    def keep(self, hypotheses: GlobalHypotheses, alive: Mask) -> tuple[GlobalHypotheses, Indices]:
        """Return the one hypothesis without the leaves that ended."""
        return kept(hypotheses, alive)

    def probability(self, hypotheses: GlobalHypotheses) -> Array:
        """Return the probability of each leaf."""
        return leaf_probability(hypotheses)

    def reported(self, hypotheses: GlobalHypotheses) -> Indices:
        """Return the leaves of all tracks."""
        return heaviest(hypotheses)
