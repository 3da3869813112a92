"""The common part of associators that grow the best joint associations of a scan from hypotheses that they keep."""

from __future__ import annotations

from vedette import Array, Branching, Gaussian, HypothesisAssociator, Indices, Mask, Merging, Space, kernels
from vedette_standard.associators.hypotheses import GlobalHypotheses, branched, heaviest, kept, leaf_probability
from vedette_standard.associators.recombined import merged_by_track


class Growing(HypothesisAssociator):
    """Keeps global hypotheses: at most `hypotheses`, of which those of a weight up to `least` are dropped."""

    hypotheses: int
    least: float

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
        """Return the leaves merged into one for each track, of a past that the heaviest association of the track has."""
        return merged_by_track(hypotheses, estimate, existence, state)

    def keep(self, hypotheses: GlobalHypotheses, alive: Mask) -> tuple[GlobalHypotheses, Indices]:
        """Return the hypotheses without the leaves that ended, equal ones merged."""
        return kept(hypotheses, alive)

    def probability(self, hypotheses: GlobalHypotheses) -> Array:
        """Return the probability of each leaf."""
        return leaf_probability(hypotheses)

    def reported(self, hypotheses: GlobalHypotheses, existence: Array) -> Indices:
        """Return the leaves of the heaviest hypothesis."""
        return heaviest(hypotheses)
