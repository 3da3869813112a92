"""Joint probabilistic data association."""

from __future__ import annotations

from collections.abc import Iterator
from typing import Any, ClassVar, final

import numpy as np
from attrs import frozen
from numpy.typing import NDArray

from vedette import Array, Associator, Mask, fields, kernels
from vedette.tracking import Expected, Pairs, Part
from vedette_standard.unresolved.clusters import associate_close
from vedette_standard.unresolved.meeting import meet_close

MOST_MESSAGES = 200_000
"""Messages of belief propagation in a cluster and scan. Ended before it has settled, weights are off by less than
it is off by itself: in 300 targets 15 m apart, sigma 5 m, 150 sweeps and 1,000 covered as many.
"""


@final
@frozen
class Jpda(Associator):
    """Returns the marginal probabilities of all joint associations in which no two tracks share a return.

    P(a) ~ prod_t exp(score of t's part in a). Tracks that share returns, directly or through others, are a cluster; a track
    that shares none is PDA. A cluster is summed exactly, over sets of at most `exact` tracks or returns, however many it
    has; where more would be kept apart at once, or some four million sets in all, by belief propagation, which is exact
    only on trees and overconfident where two targets are close (weights off by .05 on average there, by .35 at worst), in
    so many sweeps as take 200,000 messages. Where targets stay close, their tracks come to lie between them (coalescence).
    Fortmann, Bar-Shalom, Scheffe, Sonar Tracking of Multiple Targets Using JPDA, IEEE J. Oceanic Engineering 8, 1983.
    """

    kind: ClassVar[str] = "jpda"
    by_cluster: ClassVar[bool] = True
    exclusive: ClassVar[bool] = True
    takes_merged: ClassVar[bool] = True

    exact: int = fields.integer(
        "most tracks, or else most returns, that exact sums keep apart at once: each takes twice the time",
        default=14,
        at_most=16,
    )
    tolerance: float = fields.quantity("1", "largest relative change of a message at which to stop", default=1e-9, above=0)
    sweeps: int = fields.integer("most sweeps of belief propagation", default=1000, at_least=1)

    @property
    def solves(self) -> str:
        return "marginals" if self.exact >= 4 else ""

    @property
    def approximates(self) -> bool:
        """Whether it approximates: clusters that are too wide are solved by belief propagation."""
        return True

    def approximated(self, scores: Array) -> Mask:
        """Return the tracks (*b, t) of clusters that are too wide for exact sums."""
        if min(scores.shape[-2], scores.shape[-1] - 1) <= self.exact:
            return np.zeros(scores.shape[:-1], dtype=bool)
        return kernels.wide_clusters(scores, self.exact)

    def associate(self, scores: Array, evidence: Array | None) -> Array:
        """Return the association weights: (*b, t, 1+k) -> (*b, t, 1+k)."""
        weights, wide = kernels.joint_weights(scores, self.exact)
        for run in {index[:-1] for index in zip(*np.nonzero(wide), strict=True)}:
            _propagate(scores[run], wide[run], weights[run], self.tolerance, self.sweeps)
        return weights

    def meet_close(self, expected: Expected) -> Part | None:
        """Return the meeting of rows that may give one return with another one; None: none may."""
        return meet_close(expected)

    def associate_close(self, expected: Expected, pairs: Pairs, part: Part, places: Any) -> Any:
        """Return the weights of pairs where two rows may give one return, by the sum over all joint events."""
        return associate_close(expected, pairs, part, places)


def _propagate(scores: Array, wide: Mask, weights: Array, tolerance: float, sweeps: int) -> None:
    """Replace the weights (t, 1+k) of clusters that are too wide by those of belief propagation."""
    # An impossible miss is given a finite score: its weight is still 0, unless nothing else is left.
    miss = np.maximum(scores[:, :1], np.max(scores, axis=-1, keepdims=True) - 3000.0)
    gain = np.concatenate([np.zeros_like(miss), scores[:, 1:] - miss], axis=-1)
    for tracks, returns in _clusters(np.isfinite(scores[:, 1:]) & wide[:, None]):
        weights[tracks, 0], claims = _propagated(gain[np.ix_(tracks, 1 + returns)], tolerance, sweeps)
        weights[np.ix_(tracks, 1 + returns)] = claims


def _clusters(linked: Mask) -> Iterator[tuple[NDArray[np.intp], NDArray[np.intp]]]:
    """Yield tracks and returns of each cluster of at least two tracks; linked (t, k)."""
    t, k = linked.shape
    tracks, returns = np.nonzero(linked)
    labels = kernels.linked_clusters(tracks, returns, t, k)
    for label in np.flatnonzero(np.bincount(labels[:t]) > 1).tolist():
        yield np.flatnonzero(labels[:t] == label), np.flatnonzero(labels[t:] == label)


def _propagated(gain: Array, tolerance: float, sweeps: int) -> tuple[Array, Array]:
    """Return misses (t,) and claims (t, k) by messages between tracks and returns, likelihood ratios l = exp(gain):
    m_ti = l_ti / (1 + sum_j!=i l_tj n_jt), n_it = 1 / (1 + sum_s!=t m_si), claims l_ti n_it / (1 + sum_j l_tj n_jt).

    It converges for every input, if slowly where as many returns as tracks are all nearly certain: a return that is
    still claimed more than once when the sweeps run out is shared out.
    Williams, Lau, Approximate Evaluation of Marginal Association Probabilities with Belief Propagation,
    IEEE Trans. Aerospace and Electronic Systems 50, 2014.
    """
    tracks, returns = np.nonzero(np.isfinite(gain))
    ratio = np.exp(np.minimum(gain[tracks, returns], 700.0))
    of_track, of_return = (tracks, _places(tracks)), (returns, _places(returns))
    # From the scarcer side: all returns free to take, or all tracks.
    first = gain.shape[0] <= gain.shape[1]
    to_track = np.ones_like(ratio) if first else 1.0 / (1.0 + _others(ratio, of_return))
    for _ in range(min(sweeps, max(1, MOST_MESSAGES // len(ratio)))):
        # Sum without the own term rather than subtract it: total - own would lose small terms to rounding.
        to_return = ratio / (1.0 + _others(ratio * to_track, of_track))
        before, to_track = to_track, 1.0 / (1.0 + _others(to_return, of_return))
        if np.max(np.abs(to_track / before - 1.0)) <= tolerance:
            break
    likely = np.zeros_like(gain)
    likely[tracks, returns] = ratio * to_track
    missed = 1.0 / (1.0 + np.sum(likely, axis=-1))
    claims = likely * missed[:, None]
    shared = claims / np.maximum(1.0, np.sum(claims, axis=-2))
    return missed + np.sum(claims - shared, axis=-1), shared


def _places(owners: NDArray[np.intp]) -> NDArray[np.intp]:
    """Return the place (p,) of each pair among those of its owner, in their order."""
    order, number = np.argsort(owners, kind="stable"), np.bincount(owners)
    places = np.empty_like(order)
    places[order] = np.arange(len(owners)) - np.repeat(np.cumsum(number) - number, number)
    return places


def _others(values: Array, at: tuple[NDArray[np.intp], NDArray[np.intp]]) -> Array:
    """Return for each pair (p,) the sum of the values of its owner's other ones; `at`: owner and place among the owner's."""
    rows = np.zeros((int(at[0].max()) + 1, int(at[1].max()) + 2))
    before, after = np.zeros_like(rows), np.zeros_like(rows)
    rows[at] = values
    before[:, 1:] = np.cumsum(rows[:, :-1], axis=-1)
    after[:, :-1] = np.cumsum(rows[:, :0:-1], axis=-1)[:, ::-1]
    return (before + after)[at]
