"""Laws of associators."""

from __future__ import annotations

import numpy as np

from vedette.roles import Associator
from vedette.space import Array
from vedette.testing.comparisons import Closed, closed_if, demand, frozen_copy, same
from vedette.testing.law import Law
from vedette.testing.laws import hypotheses, trackers
from vedette.testing.laws.associator_cases import Scores
from vedette.testing.laws.hypotheses import with_room
from vedette.testing.limits import TooLong, at_most
from vedette.tracking.identity import Identity, Names, weighed

NEARLY = 0.02
"""By how much a weight may be off that is not called approximate."""
CONTESTED = 100.0
"""Nats of evidence for a return that several tracks contend for: products over four of them are still doubles."""
CROWDED = 0.5
"""CPU time in s that 8 tracks and 30 returns may take; one that enumerates is told so, not failed."""


def _weights(associator: Associator, scores: Array, evidence: Array) -> Array:
    weights = associator.associate(frozen_copy(scores), frozen_copy(evidence))
    demand(weights.shape == scores.shape, f"weights: must have shape {scores.shape}, got {weights.shape}")
    same("sum of a row", weights.sum(axis=-1), np.ones(weights.shape[:-1]), 1e-6)
    return weights


def pure(associator: Associator, drawn: Scores) -> None:
    """Calls leave their arguments and the associator as they were, and give the same again."""
    first = np.array(associator.associate(drawn.scores, drawn.evidence))
    associator.associate(drawn.scores[:, :1], drawn.evidence)
    same("weights called again", associator.associate(drawn.scores, drawn.evidence), first, 0.0)


def batches_as_it_loops(associator: Associator, drawn: Scores) -> None:
    """A batch of runs gives what each run gives alone, whatever the number of batch axes."""
    alone = [_weights(associator, scores, evidence) for scores, evidence in zip(drawn.scores, drawn.evidence, strict=True)]
    same("weights", _weights(associator, drawn.scores, drawn.evidence), np.stack(alone))
    same("weights", _weights(associator, drawn.scores[None], drawn.evidence[None]), np.stack(alone)[None])


def rows_sum_to_one(associator: Associator, drawn: Scores) -> None:
    """Weights are probabilities, and a track's sum to one, also where none may be missed; each is 0 or 1 if it decides."""
    t = drawn.scores.shape[-2]
    sure = np.random.default_rng(t).standard_normal((2, t, 1 + t)) - np.where(np.arange(1 + t) == 0, np.inf, 0.0)
    for scores, evidence in ((drawn.scores, drawn.evidence), (sure, np.zeros((2, 1, t)))):
        weights = _weights(associator, scores, evidence)
        demand(np.all(weights >= 0), f"weights: must be >= 0, got {weights.min():.6g}")
        decided = not associator.decides or bool(np.all((weights == 0) | (weights == 1)))
        demand(decided, "weights: must be 0 or 1, as it says that it decides: `decides`")
        same("sum of a row", weights.sum(axis=-1), np.ones(weights.shape[:-1]), 1e-9)


def forbidden_stays_forbidden(associator: Associator, drawn: Scores) -> None:
    """A score of -inf gets the weight 0."""
    weights = _weights(associator, drawn.scores, drawn.evidence)
    forbidden = weights[np.isneginf(drawn.scores)]
    demand(np.all(forbidden == 0), f"weights: must be 0 where the score is -inf, got {forbidden.max(initial=0.0):.6g}")


def row_constants_change_nothing(associator: Associator, drawn: Scores) -> None:
    """A constant added to a track's scores changes nothing: only their differences count."""
    shifted = drawn.scores + np.linspace(-900.0, 850.0, drawn.scores.shape[-2])[:, None]
    weights = _weights(associator, drawn.scores, drawn.evidence)
    same("weights", _weights(associator, shifted, drawn.evidence), weights, 1e-7, 1.0)


def order_of_tracks_is_free(associator: Associator, drawn: Scores) -> None:
    """Tracks in another order get their own weights."""
    weights = _weights(associator, drawn.scores, drawn.evidence)
    moved = _weights(associator, drawn.scores[:, drawn.tracks], drawn.evidence)
    same("weights", moved, weights[:, drawn.tracks], 1e-7, 1.0)


def order_of_returns_is_free(associator: Associator, drawn: Scores) -> None:
    """Returns in another order get their own weights."""
    weights = _weights(associator, drawn.scores, drawn.evidence)
    columns = np.concatenate([[0], 1 + drawn.returns])
    moved = _weights(associator, drawn.scores[..., columns], drawn.evidence[..., drawn.returns])
    same("weights", moved, weights[..., columns], 1e-7, 1.0)


def a_far_return_changes_nothing(associator: Associator, drawn: Scores) -> None:
    """A return that is forbidden to all tracks, as padding is, changes no other weight."""
    weights = _weights(associator, drawn.scores, drawn.evidence)
    more = np.concatenate([drawn.scores, np.full((*drawn.scores.shape[:-1], 1), -np.inf)], axis=-1)
    evidence = np.concatenate([drawn.evidence, np.zeros((2, 1, 1))], axis=-1)
    same("weights", _weights(associator, more, evidence)[..., :-1], weights, 1e-9, 1.0)


def no_returns_is_a_miss(associator: Associator, drawn: Scores) -> None:
    """Without returns every track is missed for sure; without tracks nothing is wrong."""
    alone = _weights(associator, drawn.scores[..., :1], drawn.evidence[..., :0])
    same("weights of a miss", alone, np.ones(alone.shape), 1e-12)
    _weights(associator, drawn.scores[:, :0], drawn.evidence)


def each_return_is_claimed_once(associator: Associator, drawn: Scores) -> None:
    """If exclusive: no return is claimed more than once in total."""
    worst = float(_weights(associator, drawn.scores, drawn.evidence)[..., 1:].sum(axis=-2).max(initial=0.0))
    demand(worst <= 1 + 1e-9, f"weights: a return is claimed {worst:.6g} times in total, allowed 1")


def equals_brute_force(associator: Associator, drawn: Scores) -> None:
    """If exact: the weights are those of summing over, or searching, all associations one by one."""
    weights = _weights(associator, drawn.scores, drawn.evidence)
    wanted = np.stack([brute_force(scores, associator.exclusive, associator.solves == "best") for scores in drawn.scores])
    same("weights", weights, wanted, 1e-7, 1.0)


def settles_ties(associator: Associator, drawn: Scores) -> None:
    """Where scores are equal, the rows sum to one, calls give the same again, and no exclusive return is claimed twice."""
    for scores in (np.zeros_like(drawn.scores), np.round(drawn.scores.clip(-3.0, 3.0))):
        weights = _weights(associator, scores, drawn.evidence)
        same("weights of equal scores, called again", _weights(associator, scores, drawn.evidence), weights, 0.0)
        claimed = weights[..., 1:].sum(axis=-2).max(initial=0.0)
        demand(not associator.exclusive or claimed <= 1 + 1e-9, f"weights: a return is claimed {claimed:.6g} times")


def needs_no_evidence(associator: Associator, drawn: Scores) -> None:
    """Scores hold the evidence: it may be None, and more of it beside the same scores does not count again.

    One that weighs by it alone, or chooses by it, may. 3 nats more for a return never make it weigh less for a track alone;
    1000 make it take most, of several tracks, too.
    """
    weights = np.asarray(associator.associate(drawn.scores, None))
    same("sum of a row without evidence", weights.sum(axis=-1), np.ones(weights.shape[:-1]), 1e-9)
    if not weighs_by_evidence_alone(associator, drawn):
        more = 100.0 if associator.decides else 1.001  # who chooses by it chooses the same
        found, wanted = (_weights(associator, drawn.scores, factor * drawn.evidence) for factor in (more, 1.0))
        same(
            f"weights by the same scores with {more:g} times the evidence, which they hold already", found, wanted, 1e-7, 1.0
        )
    alone = drawn.scores[..., :1, :]
    for given, nats in ((alone, 2000.0), (alone, -2000.0), (drawn.scores, CONTESTED), (drawn.scores, -CONTESTED)):
        strong = np.where(np.arange(given.shape[-1] - 1) == 0, nats, drawn.evidence)
        raised = np.concatenate([given[..., :1], given[..., 1:] + strong - drawn.evidence], axis=-1)
        taken = _weights(associator, raised, strong)[np.isfinite(raised) & (raised > 1000.0)]
        demand(np.all(taken > 0.5), "weights: a track alone takes less than half of a return that is likely by 1000 nats")


def weighs_by_evidence_alone(associator: Associator, drawn: Scores) -> bool:
    """Return whether scores that rise from return to return give the weights of those that fall."""
    slope, none = 0.0 * drawn.scores.clip(0.0) + np.arange(drawn.scores.shape[-1]), np.zeros(drawn.evidence.shape)
    up, down = (_weights(associator, scores, none) for scores in (slope, -slope))
    return bool(none.size and np.array_equal(up, down))


def crowds_are_shared(associator: Associator, drawn: Scores) -> None:
    """Of many tracks and returns rows sum to one, and no exclusive return is claimed twice.

    Weights not called approximate are those that it gives with room for more; of up to 4 tracks none is, if it solves.
    """
    rng = np.random.default_rng(drawn.scores.shape[-1] + 7 * drawn.scores.shape[-2])
    scores = 2.0 + 2.0 * rng.standard_normal((1, 8, 10))
    scores[..., 1:][rng.random((1, 8, 9)) < 0.6] = -np.inf
    weights = _weights(associator, scores, np.zeros((1, 1, 9)))
    demand(np.all(weights >= -1e-9), f"weights: must be >= 0, got {weights.min():.3g}")
    claimed = float(weights[..., 1:].sum(axis=-2).max())
    demand(not associator.exclusive or claimed <= 1 + 1e-4, f"weights: of 8 tracks, a return is claimed {claimed:.6g} times")
    some, none = scores[:, :5, :7], np.zeros((1, 1, 6))
    told, few = associator.approximated(some), associator.approximated(rng.standard_normal((1, 4, 5)))
    demand(associator.approximates or not told.any(), "approximated: are some tracks, and it says that it approximates none")
    demand(not (associator.solves and few.any()), "approximated: are some of at most 4 tracks, which it says that it solves")
    if not associator.approximates:
        return
    wide = with_room(associator)
    if not wide.approximated(some).any():
        found, wanted = _weights(associator, some, none)[~told], _weights(wide, some, none)[~told]
        same("weights of tracks that are not called approximate", found, wanted, NEARLY, 1.0)


def every_return_counts(associator: Associator, drawn: Scores) -> None:
    """Of one track and sixty returns, the order is free, whichever is best; of 8 tracks and 30, rows sum to one."""
    rng = np.random.default_rng(drawn.scores.shape[-1] + 7 * drawn.scores.shape[-2])
    scores, evidence = rng.standard_normal((1, 1, 61)), rng.standard_normal((1, 1, 60))
    try:
        with at_most(CROWDED):
            weights = _weights(associator, scores, evidence)
            for shift in (1, 30, 59):
                columns = np.concatenate([[0], 1 + np.roll(np.arange(60), shift)])
                moved = _weights(associator, scores[..., columns], evidence[..., columns[1:] - 1])
                same("weights of sixty returns in another order", moved, weights[..., columns], 1e-7, 1.0)
            _weights(associator, rng.standard_normal((1, 8, 31)), np.zeros((1, 1, 30)))
    except (TooLong, MemoryError, ValueError) as most:
        if isinstance(most, ValueError) and "too big" not in str(most):  # as numpy says of what no memory could hold
            raise
        raise Closed(f"60 returns, or 8 tracks and 30, take more memory than there is, or {CROWDED:g} s of CPU") from None


def one_track_is_a_softmax(associator: Associator, drawn: Scores) -> None:
    """If it solves marginals, or approximates them: one track alone has them exactly."""
    closed_if(associator.solves != "marginals", "it does not say that it solves marginals")
    rng = np.random.default_rng(drawn.scores.shape[-1])
    scores = np.concatenate([drawn.scores[:1, :1], rng.standard_normal((1, 1, 5))], axis=-1)
    share = np.exp(scores - scores.max(axis=-1, keepdims=True))
    weights = _weights(associator, scores, np.zeros((1, 1, scores.shape[-1] - 1)))
    same("weights of a track alone", weights, share / share.sum(axis=-1, keepdims=True), 1e-6, 1.0)


def names_tell_pairs_apart(associator: Associator, drawn: Scores) -> None:
    """If it weighs scores: where pairs differ by the codes of returns alone, a track takes most of the one with its own."""
    t, k = drawn.scores.shape[-2], drawn.scores.shape[-1] - 1
    closed_if(weighs_by_evidence_alone(associator, drawn), "it weighs returns by their evidence alone")
    names = Names(np.stack([np.arange(t), *2 * [np.full(t, -1)]], axis=-1), np.tile([0.9, 0.0, 0.0], (t, 1)))
    scores = weighed(Identity(wrong=0.1, codes=50), names, drawn.returns, np.zeros((1, t, 1 + k)))
    weights = _weights(associator, scores, np.zeros((1, 1, k)))[0, :, 1:]
    own = np.equal.outer(np.arange(t), drawn.returns)
    others = np.max(np.where(own, 0.0, weights), axis=-1, initial=0.0)
    lost = own.any(axis=-1) & (np.sum(weights * own, axis=-1) <= others)
    demand(not lost.any(), f"weights: track {np.argmax(lost)} takes no more of the return with its code than of another")


def brute_force(scores: Array, exclusive: bool, best: bool) -> Array:
    """Weights (t, 1+k) from all associations of scores (t, 1+k): their marginals, or those of the best one alone."""
    joint = hypotheses.enumerated(scores, exclusive)
    if best:
        most = max(weight for _, weight in joint)
        first = [choice for choice, weight in joint if weight == most]
        joint = [(choice, 1.0 / len(first)) for choice in first]
    weights = np.zeros(scores.shape)
    for choice, weight in joint:
        weights[range(len(scores)), choice] += weight
    return weights


LAWS: tuple[Law, ...] = (
    *map(Law, (
        pure, batches_as_it_loops, rows_sum_to_one, forbidden_stays_forbidden, row_constants_change_nothing,
        order_of_tracks_is_free, order_of_returns_is_free, a_far_return_changes_nothing, no_returns_is_a_miss,
    )),
    *(Law(each_return_is_claimed_once, needs="exclusive"), Law(equals_brute_force, needs="solves")),
    *map(Law, (
        settles_ties, needs_no_evidence, crowds_are_shared,
        every_return_counts, one_track_is_a_softmax, names_tell_pairs_apart,
    )),
    *hypotheses.LAWS, *trackers.OF_ASSOCIATORS,
)  # fmt: skip
