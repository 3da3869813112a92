"""The kernels of a scan: scores from likelihoods, weights from scores, existence from weights.

Shapes as in `reference`. Column 0 of `1+k` is the miss.
"""

from __future__ import annotations

import numpy as np

from vedette.kernels.reference import evaluate_returns, exp_or_zero, normal_or_zero, predict, safe_log, weighted_update
from vedette.kernels.results import Passed, Seen
from vedette.space import Array, Mask, Periods


def is_plain(z: Array, valid: Mask, axes: int, limit: float) -> bool:
    """Return whether z is (*b, k, axes), valid (*b, k), every return valid, and all numbers finite and within `limit`."""
    return z.shape == (*valid.shape, axes) and valid.ndim > 0 and bool(np.all(valid)) and bool(np.all(np.abs(z) <= limit))


def gate_threshold(axes: Array | int, probability: Array | float) -> Array:
    """Return the largest squared distance inside a gate of this probability: the quantile of chi2_m, m of any shape."""
    from scipy.special import gammaincinv

    return 2.0 * gammaincinv(np.asarray(axes) / 2.0, probability)


def sample_density(distance: Array, valid: Mask, limit: float | Array, log_volume: Array, log_ball: float) -> Array:
    """Return the log of the number of returns in each gate, no less than 1, over its volume (*b, t, 1).

    distance (*b, t, k), valid (*b, k), log_volume log sqrt|S| (*b, t), log_ball the log volume of the gate where |S| = 1.
    """
    count = np.maximum(np.sum((distance <= limit) & valid[..., None, :], axis=-1), 1)
    density: Array = np.log(count) - log_ball - log_volume
    return density[..., None]


def gate_scores(
    loglik: Array,
    distance: Array,
    valid: Mask,
    existence: Array,
    limit: float | Array,
    log_density: Array,
    evidence: Array | None,
    sure: Mask | None,
) -> Array:
    """Return log scores (*b, t, 1+k) relative to clutter, of tracks of existence (*b, t); -inf outside the gate.

    loglik (*b, t, 1+k), distance (*b, t, k), valid (*b, k); limit () or (*b, 1, k), the largest squared distance inside;
    log_density broadcasts to (*b, t, k); evidence (*b, 1, k). Of tracks that are `sure` (*b, t) a return beyond the limit is
    inside, too, if its score is above that of the miss; None: of no track.
    """
    gain = loglik[..., 1:] - log_density
    if evidence is not None:
        gain = gain + evidence
    scores = np.empty_like(loglik)
    scores[..., 0] = safe_log(1.0 - existence + existence * np.exp(loglik[..., 0]))
    taken = gain + safe_log(existence)[..., None]
    inside = distance <= limit
    if sure is not None:
        inside = inside | (sure[..., None] & (taken > scores[..., :1]))
    inside = inside & valid[..., None, :]
    scores[..., 1:] = np.where(inside, taken, -np.inf)
    return scores


def softmax(scores: Array) -> Array:
    """Return exp(scores) over their sum on the last axis; 0 where a score is -inf, or where it would be subnormal."""
    likely = exp_or_zero(scores - np.max(scores, axis=-1, keepdims=True))
    likely /= np.sum(likely, axis=-1, keepdims=True)
    return normal_or_zero(likely)


def scan_step(
    x: Array,
    P: Array,
    F: Array,
    Q: Array,
    z: Array,
    H: Array,
    R: Array,
    p_detect: float,
    p_gate: float,
    limit: float,
    log_density: Array,
    best: bool,
    periods: Periods,
) -> Passed:
    """`predict`, `evaluate_returns`, `gate_scores`, `softmax` or for the best alone `one_hot`, `weighted_update`: in one.

    Of tracks x (*b, t, n) that surely exist, with the returns z (*b, k, m) = H x + v of a scan, R (m, m).
    """
    ahead = predict(x, P, F, Q)
    expected = (H @ ahead.mean[..., None])[..., 0]
    seen = evaluate_returns(ahead.cov, z, expected, H, R[..., None, :, :], p_detect, p_gate, periods)
    every, sure = np.ones(z.shape[:-1], dtype=bool), np.ones(x.shape[:-1])
    scores = gate_scores(seen.loglik, seen.distance, every, sure, limit, log_density, None, None)
    weights = one_hot(scores) if best else softmax(scores)
    after = weighted_update(ahead.mean, ahead.cov, seen.detail.shift, seen.detail.post, weights, ())
    return Passed(after, weights, seen.distance)


def one_hot(scores: Array) -> Array:
    """Return 1 where a score is the first of the largest on the last axis, else 0."""
    chosen = np.zeros_like(scores)
    np.put_along_axis(chosen, np.argmax(scores, axis=-1)[..., None], 1.0, axis=-1)
    return chosen


def existence(scores: Array, weights: Array, prior: Array, loglik: Array, p_gate: float, exclusive: bool) -> Seen:
    """Return the probability of detection, the existence after the scan from `prior`, and P_D; all (*b, t).

    scores and weights (*b, t, 1+k); column 0 of loglik is log (1 - P_D P_G). Where the associator lets two tracks share a
    return (not `exclusive`), the older one, which comes first, claims it first: else a new track would live off its
    neighbour's returns. Other tracks only take returns away, so the odds of a hit are at most those of the track alone:
    these bound what a hard assignment, or one of few associations, states.
    """
    miss = exp_or_zero(loglik[..., 0])
    missed = normal_or_zero(prior * miss)
    absent = 1.0 - prior + missed
    unseen = np.divide(missed, absent, out=np.zeros_like(absent), where=absent > 0)
    taken = weights[..., 1:]
    odds = np.sum(np.exp(np.where(taken > 0, scores[..., 1:] - scores[..., :1], -np.inf).clip(max=600)), axis=-1)
    if not exclusive and taken.shape[-2] > 1:
        free = np.ones_like(taken)
        free[..., 1:, :] = np.cumprod(1.0 - taken[..., :-1, :], axis=-2)
        taken = taken * free
    hit = np.sum(taken, axis=-1)
    seen = np.minimum(hit, odds / (1.0 + odds))
    return Seen(normal_or_zero(hit), normal_or_zero(seen + (1.0 - seen) * unseen), (1.0 - miss) / p_gate)


def claimed(weights: Array, exclusive: bool) -> Array:
    """Return the probability (*b, k) that a return is some track's, from the tracks' weights (*b, t, 1+k).

    If no two tracks share a return, the events exclude each other and add; else they are taken as independent.
    """
    shares = weights[..., 1:]
    return np.minimum(np.sum(shares, axis=-2), 1.0) if exclusive else 1.0 - np.prod(1.0 - shares, axis=-2)


def if_existing(scores: Array, miss: Array, existence: Array) -> Array:
    """Return the scores (*b, t, 1+k) that tracks have if they exist, from those of a probability `existence` (*b, t).

    miss (*b, t) is log (1 - P_D P_G). A row of a track that does not exist stays as it is.
    """
    doubted = (existence > 0.0) & (existence < 1.0)
    sure = np.array(scores)
    sure[..., 0] = np.where(doubted, miss, scores[..., 0])
    sure[..., 1:] -= np.where(doubted, safe_log(existence), 0.0)[..., None]
    return sure


def given_existence(weights: Array, scores: Array, loglik: Array, existence: Array) -> Array:
    """Return weights (*b, t, 1+k) given existence, from those of a track of probability `existence` (*b, t).

    A miss means that the target was not detected or that there is none: only the first's share of its weight,
    exp(log e + loglik_0 - score_0), is kept, and the row sums to 1 again. A row with nothing left stays as it is.
    """
    with np.errstate(invalid="ignore"):
        kept = exp_or_zero(safe_log(existence) + loglik[..., 0] - scores[..., 0])
    doubted = (existence < 1.0) & np.isfinite(kept)
    alive = np.array(weights)
    alive[..., 0] *= np.where(doubted, np.minimum(kept, 1.0), 1.0)
    total = np.sum(alive, axis=-1)
    changed = doubted & (total > 0.0)
    alive /= np.where(changed, total, 1.0)[..., None]
    return np.where(changed[..., None], normal_or_zero(alive), weights)
