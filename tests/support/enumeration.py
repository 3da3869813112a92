"""All mode sequences of a short run, and the smoothed IMM beside them."""

import itertools

import numpy as np
from attrs import evolve

from support.smoothing import estimates, tracker_of
from vedette import Detections, Gaussian
from vedette.sampling import draw_jump_markov
from vedette.tracking.smoothing import smoothed

RNG = np.random.default_rng(0)
"""Asked for by the signature; these estimators draw nothing."""


def enumerated(models, transition, sensor, prior, dts, zs):
    """Smoothed moments of jump-Markov models over every sequence of modes; zs (runs, s, m), NaN where nothing came.

    A Kalman filter and its step back for each sequence, weighed by its prior and likelihood. Mean (runs, 1+s, n), cov,
    and the probability of each mode after each step (runs, s, r).
    """
    r, s = len(models), len(dts)
    sequences = np.array(list(itertools.product(range(r), repeat=s)))
    start = np.full(r, 1 / r) @ transition
    log_w = np.log(start[sequences[:, 0]]) + np.log(transition[sequences[:, :-1], sequences[:, 1:]]).sum(axis=1)
    runs, n = len(zs), prior.mean.shape[-1]
    m = np.broadcast_to(prior.mean[0], (runs, len(sequences), n))
    P = np.broadcast_to(prior.cov[0], (runs, len(sequences), n, n))
    log_w = np.broadcast_to(log_w, (runs, len(sequences)))
    kept, H = [(m, P)], sensor.H
    ahead = []
    for k, dt in enumerate(dts):
        F = np.stack([model.jacobian(None, dt) for model in models])[sequences[:, k]]
        Q = np.stack([model.noise(None, dt) for model in models])[sequences[:, k]]
        m, P = (F @ m[..., None])[..., 0], F @ P @ np.swapaxes(F, -1, -2) + Q
        ahead.append((F, m, P))
        seen = np.isfinite(zs[:, k, 0])[:, None]
        S = H @ P @ H.T + sensor.R
        nu = np.where(seen[..., None], zs[:, None, k] - m @ H.T, 0.0)
        K = P @ H.T @ np.linalg.inv(S) * seen[..., None, None]
        step = (np.linalg.inv(S) @ nu[..., None])[..., 0]
        log_w = log_w - 0.5 * (np.sum(nu * step, -1) + np.linalg.slogdet(2 * np.pi * S)[1]) * seen
        m, P = m + (K @ nu[..., None])[..., 0], P - K @ H @ P
        kept.append((m, P))
    ms, Ps = [m], [P]
    for (F, a, A), (m, P) in zip(ahead[::-1], kept[-2::-1], strict=True):
        G = P @ np.swapaxes(F, -1, -2) @ np.linalg.inv(A)
        ms.append(m + (G @ (ms[-1] - a)[..., None])[..., 0])
        Ps.append(P + G @ (Ps[-1] - A) @ np.swapaxes(G, -1, -2))
    w = np.exp(log_w - np.logaddexp.reduce(log_w, axis=1, keepdims=True))
    ms, Ps = np.stack(ms[::-1], axis=2), np.stack(Ps[::-1], axis=2)
    mean = np.einsum("rq,rqkn->rkn", w, ms)
    apart = ms - mean[:, None]
    cov = np.einsum("rq,rqkab->rkab", w, Ps + apart[..., :, None] * apart[..., None, :])
    prob = np.stack([np.einsum("rq,qk->rk", w, sequences == j) for j in range(r)], axis=-1)
    return mean, cov, prob


def smoothed_imm(imm, sensor, prior, dts, zs):
    """Filtered and smoothed estimates (runs, 1+s, n), their covariances, and smoothed mode probabilities (runs, s, r)."""
    runs = len(zs)
    tracker = tracker_of(imm, {"s": sensor})
    given = Gaussian(
        np.broadcast_to(prior.mean, (runs, *prior.mean.shape)), np.broadcast_to(prior.cov, (runs, *prior.cov.shape))
    )
    state, time = tracker.start(given, 0.0), 0.0
    states = [state]
    for k, dt in enumerate(dts):
        time += dt
        seen = np.isfinite(zs[:, k, :1])
        # What did not come is a miss of each run alone: weight on column 0.
        moved = imm.predict(state.belief, dt, RNG)
        innovation = imm.evaluate(moved, sensor, Detections(np.nan_to_num(zs[:, k, None]), seen), 1.0)
        weights = np.stack([1.0 - seen, 1.0 * seen], axis=-1)
        state = evolve(state, time=time, belief=imm.update(moved, innovation, weights))
        states.append(state)
    before, _ = estimates(tracker, states)
    after = list(smoothed(tracker, states))
    mean, cov = estimates(tracker, after)
    prob = np.stack([imm.mode_prob(each.belief)[:, 0] for each in after[1:]], axis=1)
    return np.moveaxis(before[:, :, 0], 0, 1), np.moveaxis(mean[:, :, 0], 0, 1), np.moveaxis(cov[:, :, 0], 0, 1), prob


def drawn(models, transition, sensor, prior, dts, runs, seed, missed=0.15):
    rng = np.random.default_rng(seed)
    x0 = rng.multivariate_normal(prior.mean[0], prior.cov[0], size=runs)
    times = np.concatenate([[0.0], np.cumsum(dts)])
    _, truth = draw_jump_markov(models, transition, x0, rng.integers(len(models), size=runs), times, rng)
    zs = truth[:, 1:] @ sensor.H.T + rng.multivariate_normal(np.zeros(len(sensor.R)), sensor.R, size=(runs, len(dts)))
    zs[rng.random(zs.shape[:-1]) < missed] = np.nan
    return truth, zs
