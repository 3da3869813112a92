"""Track-oriented multiple hypothesis tracking."""

from __future__ import annotations

from typing import ClassVar, final

from attrs import frozen

from vedette import fields
from vedette_standard.associators.growing import Growing


@final
@frozen
class NScan(Growing):
    """Keeps the best joint associations of all scans, and decides those of `scans` scans ago: multiple hypothesis tracking.

    Tracks are trees of leaves. The best hypotheses of each cluster of tracks that share returns are found as in `k_best`. In
    each tree only those leaves remain that descend from the leaf which the best hypothesis had `scans` scans ago; hypotheses
    with other leaves are dropped, and their probability is told as lost; no target exists more surely for it. A scan that
    cannot see a track does not count. Clusters part as in `k_best`. Where targets begin with little existence, as with
    `poisson`, early decisions take their returns for false: of twelve targets, P_D .5 and 100 false returns a scan, in five
    drawn runs 5.3 +- .9 are missed with 3 scans, 1.9 +- .2 with 8, and 1.1 +- .3 by `k_best`.
    Blackman, Multiple Hypothesis Tracking for Multiple Target Tracking, IEEE Aerospace and Electronic Systems Magazine 19,
    2004.

    >>> import numpy as np
    >>> from vedette.hypotheses import LeafScores
    >>> kind, none = NScan(scans=1), np.zeros(0, dtype=bool)
    >>> first = kind.branch(kind.initial_hypotheses(1), LeafScores.of(np.log([[0.4, 0.6]])), np.zeros(1, dtype=bool))
    >>> first.choice.tolist(), kind.probability(first.hypotheses).round(9).tolist()  # one scan later nothing is decided
    ([0, 1], [0.4, 0.6])
    >>> kept, rows = kind.keep(first.hypotheses, np.ones(2, dtype=bool))
    >>> second = kind.branch(kept, LeafScores.of(np.log([[0.9], [0.3]])), none)  # .36 and .18: that of the miss is right
    >>> kind.probability(second.hypotheses).round(9).tolist()
    [0.666666667, 0.333333333]
    >>> kept, rows = kind.keep(second.hypotheses, np.ones(2, dtype=bool))
    >>> rows.tolist(), kind.probability(kept).tolist(), second.lost.round(9).tolist()
    ([0], [1.0], [0.333333333, 0.333333333])
    """

    kind: ClassVar[str] = "n_scan"
    abbreviations: ClassVar[tuple[str, ...]] = ("mht", "tomht")

    unlikelier: ClassVar[float] = 0.4
    """What is decided differs by an association of `scans` scans ago, so it often holds the link of now. Chosen on runs 0 to
    19 of `benchmarks.horizons`, seed 2018, and 0 to 14 of seed 1.
    """

    scans: int = fields.integer("number of scans after which an association is final", default=3, at_least=1)
    hypotheses: int = fields.integer("most hypotheses that are kept of a cluster", default=100, at_least=1)
    least: float = fields.probability("weight at or below which a hypothesis is dropped", default=1e-4, below=1)

    @property
    def past(self) -> int:
        return self.scans
