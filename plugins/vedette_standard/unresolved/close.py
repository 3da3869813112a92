"""Targets that a sensor cannot tell apart: two rows that may give one return, and what it says of each of them."""

from __future__ import annotations

from collections.abc import Callable
from functools import cached_property
from typing import Any

import numpy as np
from attrs import frozen

from vedette import Array, Detections, Indices, Mask, Space
from vedette.tracking import Expected, Meeting, take
from vedette_standard.unresolved.neighbours import around, within

LIKELY = 1e-3
"""Two rows are close if both exist and merge by more than this probability."""

SURE = 1e-9
"""No two rows are taken to merge more surely than 1 less this."""


@frozen(eq=False)
class Close:
    """Pairs (p, 2) of rows that may give one return.

    pair and returns (q,), ascending: which pair may give which of k returns; scores (q,): the log scores of one return for
    both; z (q, 2, m) and noise (q, 2, m, m): what that says of each row, as a return of its own. apart: of some pairs (s,)
    and returns (w,) or (s, w), the log of the probability (s, w, w) that they were resolved, if each gave one of its own.
    places (q, 2): where each row meets its return; alone: how many returns it meets alone, before those; met_z (r, w, m) and
    met_noise (r, w, m, m): all that it meets.
    """

    pairs: Indices
    pair: Indices
    returns: Indices
    k: int
    scores: Array
    z: Array
    noise: Array
    apart: Callable[[Indices, Indices], Array]
    places: Indices | None = None
    alone: int = 0
    met_z: Array | None = None
    met_noise: Array | None = None

    @cached_property
    def ends(self) -> Indices:
        """Where the returns of each pair (p,) end."""
        return np.searchsorted(self.pair, np.arange(len(self.pairs)), side="right")

    @cached_property
    def usable(self) -> Mask:
        """Whether each pair (p,) may give any return."""
        return np.bincount(self.pair, minlength=len(self.pairs)) > 0

    @cached_property
    def _codes(self) -> Indices:
        return np.append(self.pair * self.k + self.returns, -1)

    def returned(self, pairs: Indices) -> Indices:
        """Return what pairs may give, ascending."""
        ends = self.ends
        every = [self.returns[ends[one - 1] if one else 0 : ends[one]] for one in pairs.tolist()]
        return np.unique(np.concatenate([np.zeros(0, dtype=np.int64), *every]))

    def joint(self, pair: Indices, returns: Indices) -> Array:
        """Return the log scores (*b) of one return for both of a pair, -inf where it is too far away."""
        place = self._at(pair, returns)
        return np.append(self.scores, -np.inf)[place]

    def column(self, pair: Indices | int, side: Indices | int, returns: Indices) -> Indices:
        """Return the place of a return for both among those that one of a pair meets, -1: none."""
        assert self.places is not None
        return np.concatenate([self.places, [[-1, -1]]])[self._at(pair, returns), side]

    def _at(self, pair: Indices | int, returns: Indices) -> Indices:
        """Return the place (*b) of a pair's return among all, q: it is none of these."""
        wanted, q = pair * self.k + returns, len(self.pair)
        place = np.searchsorted(self._codes[:-1], wanted)
        return np.where(self._codes[place] == wanted, place, q)

    def updated(
        self, it: Expected, meeting: Meeting, at: Indices, choice: Indices, merged: Indices | None, leaves: Indices
    ) -> Any:
        """Return the belief of `leaves` that continue rows `at` of the meeting, by what each took: `choice` (l, 1), alone or
        as the column `merged` of the row, both from 1.

        The one return is met again: of all that a row met, moments of the belief would be copied for each leaf.
        """
        assert self.met_z is not None
        assert self.met_noise is not None
        column = np.argmax(meeting.returns[at, : self.alone] == choice - 1, axis=1) if self.alone else np.zeros_like(at)
        if merged is not None:
            column = np.where(merged[leaves] > 0, merged[leaves] - 1, column)
        belief, hit = take(meeting.belief, at, 0), choice > 0
        seen = Detections(self.met_z[at, column][:, None], hit, None, self.met_noise[at, column][:, None])
        innovation = it.plan.estimator.evaluate(belief, it.sensor, seen, it.plan.p_gate)
        sure = np.concatenate([~hit, hit], axis=1)[:, None].astype(float)
        return it.plan.estimator.update(belief, innovation, sure)


def close_rows(
    it: Expected, observed: Detections, log_density: Array, group: Indices | None = None, known: Indices | None = None
) -> Close | None:
    """Return the pairs of rows that may give one of the returns; None where there is none. log_density (k,): of clutter.

    group (t,), from 0 without gaps: rows of one are never of two targets at once, but for the `known` pairs (p, 2), i < j.
    """
    sensor, state, e = it.sensor, it.plan.state, it.existence
    x = it.plan.estimator.moments(it.belief)
    where = state.locate(sensor.observes)
    C = sensor.unresolved(x.mean[..., where])
    if C is None or len(e) < 2 or not len(observed.z):
        return None
    h, S, _ = it.returns_of(x, np.zeros((m := len(sensor.measurement), m)))
    C = np.broadcast_to(C, S.shape)
    space, variance = sensor.measurement, np.einsum("...ii->...i", S) + 0.5 * np.einsum("...ii->...i", C)
    i, j = within(h, np.sqrt(-2.0 * np.log(LIKELY) * variance), space, group, known)
    d, wide = space.difference(h[j], h[i]), C[i] + S[i] + S[j]
    log_merge = _log_merge(C[i], wide, d)
    near = (log_merge + np.log(np.maximum(e[i] * e[j], 1e-300)) > np.log(LIKELY)) & observed.valid.any()
    if not near.any():
        return None
    i, j, d, wide, C, log_merge = i[near], j[near], d[near], wide[near], C[i[near]], log_merge[near]
    pairs = np.stack([i, j], axis=-1)
    R = np.broadcast_to(sensor.mean_noise(x.mean[..., where], x.cov[..., where, :][..., where]), S.shape)
    detects = np.broadcast_to(sensor.detects(x.mean[..., where]), e.shape)

    # The middle, given that both are in one cell: c = h_i + d / 2, its covariance with d is (S_j - S_i) / 2.
    half = 0.5 * (S[j] - S[i]) @ _inverse(wide)
    middle = 0.5 * d - (half @ d[..., None])[..., 0]
    cov = 0.25 * (S[i] + S[j]) - half @ (0.5 * (S[j] - S[i])) + R[i]
    pair, returns = around(space.displace(h[i], middle), cov, observed, it.gate.threshold, space)
    seen = space.difference(observed.z[returns], h[i][pair])
    with np.errstate(divide="ignore"):
        both = log_merge + np.log(e[i] * e[j] * detects[i] * detects[j])
    score = both[pair] + _log_normal(seen - middle[pair], cov[pair]) - log_density[returns]
    if observed.evidence is not None:
        score = score + observed.evidence[returns]
    z, noise = np.empty((len(pair), 2, m)), np.empty((len(pair), 2, m, m))
    for side, (own, other, sign) in enumerate(((i, j, 1.0), (j, i, -1.0))):
        seen = space.difference(observed.z[returns], h[own][pair])
        step, noise[:, side] = _told(S[other], R[own], C, sign * d, seen, pair)
        z[:, side] = space.displace(h[own][pair], step)

    gain = S @ _inverse(S + R)
    left = S - gain @ S

    def apart(some: Indices, of: Indices) -> Array:
        z = observed.z[np.broadcast_to(of, (len(some), of.shape[-1]))]
        return _apart(gain, left, C[some], h, z, pairs[some], space)

    return Close(pairs, pair, returns, len(observed.z), score, z, noise, apart)


def _log_merge(C: Array, wide: Array, d: Array) -> Array:
    """Return the log of the mean of exp(-d' C^-1 d / 2) over N(d, wide - C), (*b, m, m) and (*b, m)."""
    half = 0.5 * (_log_det(C) - _log_det(wide))
    return half - 0.5 * _square(d, wide)


def _log_normal(d: Array, cov: Array) -> Array:
    """Return log N(d; 0, cov): (*b, m), (*b, m, m) -> (*b)."""
    return -0.5 * (_square(d, cov) + _log_det(cov) + d.shape[-1] * np.log(2 * np.pi))


def _square(d: Array, cov: Array) -> Array:
    """Return d' cov^-1 d: (*b, m), (*b, m, m) -> (*b)."""
    return np.sum(d * (_inverse(cov) @ d[..., None])[..., 0], axis=-1)


def _inverse(M: Array) -> Array:
    """Return M^-1 (*b, m, m): of two axes in closed form, which takes a tenth of the time."""
    if M.shape[-1] != 2:
        return np.linalg.inv(M)
    inverse = np.empty(M.shape)
    inverse[..., 0, 0], inverse[..., 1, 1] = M[..., 1, 1], M[..., 0, 0]
    inverse[..., 0, 1], inverse[..., 1, 0] = -M[..., 0, 1], -M[..., 1, 0]
    inverse /= (M[..., 0, 0] * M[..., 1, 1] - M[..., 0, 1] * M[..., 1, 0])[..., None, None]
    return inverse


def _log_det(M: Array) -> Array:
    """Return log |M| (*b) of positive definite M (*b, m, m)."""
    two = M.shape[-1] == 2
    return np.log(M[..., 0, 0] * M[..., 1, 1] - M[..., 0, 1] * M[..., 1, 0]) if two else np.linalg.slogdet(M)[1]


def _told(S: Array, R: Array, C: Array, d: Array, seen: Array, pair: Indices) -> tuple[Array, Array]:
    """Return what one return for both says of h(x) of one row: the step (q, m) from its mean, and covariance (q, m, m).

    S: of the other row, d (p, m): from this one to it; seen (q, m): from this one to a return for `pair` (q,). Given h, the
    other is N(h + W (d - (h - mean)), V) and the return (h + other) / 2 + noise; that they merged is a return of the other's
    mean.
    """
    near = _inverse(C + S)
    W = C @ near
    V = W @ S  # which is C - C (C + S)^-1 C, where C may be 1e18 times S
    V = 0.5 * (V + np.swapaxes(V, -1, -2))
    A = np.eye(C.shape[-1]) - 0.5 * W
    weight = np.swapaxes(A, -1, -2) @ _inverse(R + 0.25 * V)
    noise = _inverse(near + weight @ A)
    noise = 0.5 * (noise + np.swapaxes(noise, -1, -2))
    beyond = seen - 0.5 * (W @ d[..., None])[pair, :, 0]
    step = (near @ d[..., None])[pair, :, 0] + (weight[pair] @ beyond[..., None])[..., 0]
    return (noise[pair] @ step[..., None])[..., 0], noise[pair]


def _apart(gain: Array, left: Array, C: Array, h: Array, z: Array, pairs: Indices, space: Space) -> Array:
    """Return the log of the probability (p, w, w) that rows which took returns z (p, w, m) of their own were resolved.

    gain and left (t, m, m): of each row, by which it moves to a return, and its covariance then.
    """
    i, j = pairs.T
    steps = [space.difference(z, h[at][:, None]) @ np.swapaxes(gain[at], -1, -2) for at in (i, j)]
    d = space.difference(h[j], h[i])[:, None, None] + steps[1][:, None] - steps[0][:, :, None]
    wide = C + left[i] + left[j]
    factor = 0.5 * (_log_det(C) - _log_det(wide))[:, None, None]
    square = np.einsum("pabi,pij,pabj->pab", d, _inverse(wide), d)
    return np.log1p(-np.minimum(np.exp(factor - 0.5 * square), 1.0 - SURE))
