"""How rows meet a scan of which two may give one return: by themselves, and each together with every partner."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
from attrs import evolve

from vedette import Detections, Indices, Innovation, Mask
from vedette.hypotheses import Hypotheses
from vedette.tracking import Expected, Part, take, weighed
from vedette_standard.unresolved.close import close_rows


def of_hypotheses(it: Expected, hypotheses: Hypotheses) -> Part | None:
    """Return the meeting of leaves that may give one return with another one of their hypothesis, or of another cluster."""

    def together(pairs: Indices) -> Mask:
        some, place = np.unique(pairs, return_inverse=True)
        i, j = place.reshape(-1, 2).T
        held = np.zeros((len(hypotheses.weights), len(hypotheses.track)), dtype=bool)
        held[hypotheses.rows, hypotheses.leaves] = True
        both = np.any(held[:, some[i]] & held[:, some[j]], axis=0)
        cluster = hypotheses.cluster_of[pairs]
        may: Mask = both | (cluster[:, 0] != cluster[:, 1])
        return may

    return meet_close(it, together)


def meet_close(it: Expected, together: Callable[[Indices], Mask] | None = None) -> Part | None:
    """Return the meeting of rows that may give one return with another one; None: none may.

    together: which pairs (p, 2) of rows can be of two targets at once; None: all.
    """
    observed = it.observed
    if not isinstance(observed, Detections) or it.existence.ndim > 1 or observed.missing is not None:
        return None
    plan, k = it.plan, len(observed.z)
    rate = None if it.undetected is None else it.undetected.rate
    log_density = np.broadcast_to(plan.gate.stated_density(it.sensor, observed), (1, k))[0]
    if rate is not None:
        log_density = np.logaddexp(log_density, np.log(rate))
    close = close_rows(it, observed, log_density, together)
    if close is None:
        return None
    rows, inverse = np.unique(close.pairs, return_inverse=True)
    inverse = inverse.reshape(-1, 2)
    width = k * (1 + int(np.bincount(inverse.ravel()).max()))
    z, noise = np.zeros((len(rows), width, observed.z.shape[-1])), np.zeros((len(rows), width, *close.noise.shape[-2:]))
    returns, slot = np.full((len(rows), width), -1), np.ones(len(rows), dtype=np.int64)
    own = it.plan.estimator.moments(take(it.belief, rows, 0))
    where = plan.state.locate(it.sensor.observes)
    R = it.sensor.mean_noise(own.mean[..., where], own.cov[..., where, :][..., where])
    z[:, :k], returns[:, :k] = observed.z, np.where(observed.valid, np.arange(k), -1)
    noise[...] = np.broadcast_to(R, (len(rows), *R.shape[-2:]))[:, None]
    if observed.noise is not None:
        noise[:, :k] = observed.noise
    columns = np.zeros((len(close.pairs), 2), dtype=np.int64)
    for p, pair in enumerate(inverse.tolist()):
        for side, row in enumerate(pair):
            at = slice(k * slot[row], k * slot[row] + k)
            z[row, at], noise[row, at], returns[row, at] = close.z[p, side], close.noise[p, side], returns[row, :k]
            columns[p, side], slot[row] = slot[row], slot[row] + 1
    belief = take(it.belief, rows[:, None], 0)
    innovation = plan.estimator.evaluate(belief, it.sensor, Detections(z, returns >= 0, None, noise), plan.p_gate)
    alone = Innovation(
        innovation.loglik[..., : 1 + k], innovation.distance[..., :k], innovation.log_volume, innovation.nis[..., :k], None
    )
    seen = Detections(z[:, :k], returns[:, :k] >= 0, None if observed.evidence is None else observed.evidence[None])
    scores = np.full((len(rows), 1, 1 + width), -np.inf)
    spread = None if rate is None else np.broadcast_to(rate, (len(rows), 1, k))
    scores[..., : 1 + k] = plan.gate.scores(alone, it.sensor, seen, it.existence[rows, None], it.gate, spread)
    if observed.identity is not None:
        codes, names = np.broadcast_to(observed.identity, (len(rows), k)), take(it.names, rows[:, None], 0)
        scores[..., : 1 + k] = weighed(plan.identity, names, codes, scores[..., : 1 + k])
    place = k * columns[..., None] + np.arange(k)
    inside = np.all(innovation.distance[inverse[..., None], 0, place] <= it.gate.threshold, axis=1)
    close = evolve(close, columns=columns, joint=np.where(inside, close.joint, -np.inf))
    scores[inverse[..., None], 0, 1 + place] = close.joint[:, None]
    return Part(rows, returns, belief, innovation, scores, close)
