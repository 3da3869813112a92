"""How rows meet a scan of which two may give one return: by themselves, and each together with every partner."""

from __future__ import annotations

import numpy as np
from attrs import evolve

from vedette import Detections, Indices, Innovation, kernels
from vedette.hypotheses import JointHypotheses
from vedette.tracking import Expected, Meeting, scores_of_few, take
from vedette_standard.unresolved.close import close_rows


def of_hypotheses(it: Expected, hypotheses: JointHypotheses) -> Meeting | None:
    """Return the meeting of leaves that may give one return with another one of their hypothesis, or of another cluster."""
    from scipy.sparse import csr_array

    held = csr_array(
        (np.ones(len(hypotheses.leaves)), hypotheses.leaves, hypotheses.starts),
        shape=(len(hypotheses.weights), len(hypotheses.track)),
    )

    within = (held.T @ held).tocoo()
    known = np.stack([within.row, within.col], axis=-1).astype(np.int64)
    return meet_close(it, hypotheses.cluster_of, known[known[:, 0] < known[:, 1]])


def meet_close(it: Expected, group: Indices | None = None, known: Indices | None = None) -> Meeting | None:
    """Return the meeting of rows that may give one return with another one; None: none may.

    group, known: as in `close_rows`.
    """
    observed = it.observed
    if not isinstance(observed, Detections) or it.existence.ndim > 1 or observed.missing is not None:
        return None
    plan, k = it.plan, len(observed.z)
    log_density = np.broadcast_to(plan.gate.stated_density(it.sensor, observed), (1, k))[0]
    if it.rate is not None:
        log_density = np.logaddexp(log_density, kernels.safe_log(it.rate))
    close = close_rows(it, observed, log_density, group, known)
    if close is None:
        return None
    rows, inverse = np.unique(close.pairs, return_inverse=True)
    inverse = inverse.reshape(-1, 2)
    own, alone = _singles(it, observed, rows)
    both = inverse[close.pair].ravel()
    place = alone + kernels.places(both, len(rows))
    width = max(alone, int(np.max(place, initial=0)) + 1)
    z, noise = np.zeros((len(rows), width, observed.z.shape[-1])), np.zeros((len(rows), width, *close.noise.shape[-2:]))
    returns = np.full((len(rows), width), -1)
    x = it.plan.estimator.moments(take(it.belief, rows, 0))
    where = plan.state.locate(it.sensor.observes)
    R = it.sensor.mean_noise(x.mean[..., where], x.cov[..., where, :][..., where])
    z[:, :alone], returns[:, :alone] = observed.z[own], own
    noise[...] = np.broadcast_to(R, (len(rows), *R.shape[-2:]))[:, None]
    if observed.noise is not None:
        noise[:, :alone] = observed.noise[own]
    returns[both, place] = np.repeat(close.returns, 2)
    z[both, place], noise[both, place] = close.z.reshape(-1, z.shape[-1]), close.noise.reshape(-1, *noise.shape[-2:])
    belief = take(it.belief, rows[:, None], 0)
    innovation = plan.estimator.evaluate(belief, it.sensor, Detections(z, returns >= 0, None, noise), plan.p_gate)
    parts = innovation.loglik[..., : 1 + alone], innovation.distance[..., :alone], innovation.nis[..., :alone]
    seen = Detections(z[:, :alone], own >= 0, None if observed.evidence is None else observed.evidence[own])
    scores = np.full((len(rows), 1, 1 + width), -np.inf)
    single = Innovation(parts[0], parts[1], innovation.log_volume, parts[2], None)
    scores[..., : 1 + alone] = scores_of_few(it, rows, own, single, seen)
    inside = np.all((innovation.distance[both, 0, place] <= it.gate.threshold).reshape(-1, 2), axis=1)
    inside &= np.isfinite(close.scores)
    scores[both, 0, 1 + place] = np.repeat(np.where(inside, close.scores, -np.inf), 2)
    close = evolve(
        close,
        pair=close.pair[inside],
        returns=close.returns[inside],
        scores=close.scores[inside],
        z=close.z[inside],
        noise=close.noise[inside],
        places=place.reshape(-1, 2)[inside],
        alone=alone,
        met_z=z,
        met_noise=noise,
    )
    return Meeting(rows, returns, belief, innovation, scores, close)


def _singles(it: Expected, observed: Detections, rows: Indices) -> tuple[Indices, int]:
    """Return the returns (r, w) that may be in the gates of rows, ascending, -1 for none, and w."""
    k, estimator = len(observed.z), it.plan.estimator
    if not estimator.traits.bounded or not np.isfinite(it.gate.threshold):
        row, returns = np.divmod(np.arange(len(rows) * k), k)
    else:
        limit = np.broadcast_to(it.reach, (len(it.existence), 1))[rows]
        low, high = estimator.extent(take(it.belief, rows, 0), it.sensor, observed, limit)
        row, returns = kernels.pairs_in_boxes(low, high, observed.z, it.sensor.measurement.periods, len(rows) * k)
    counts = np.broadcast_to(observed.valid, k)[returns]
    row, returns = row[counts], returns[counts]
    place = kernels.places(row, len(rows))
    width = int(np.max(place, initial=-1)) + 1
    own = np.full((len(rows), width), -1)
    own[row, place] = returns
    return own, width
