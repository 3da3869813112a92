"""Vedette's kernels alone: a call a stage, and fused where one kernel does the whole step."""

from __future__ import annotations

from typing import Any

import numpy as np

from benchmarks.job import Answer, Job
from benchmarks.problems import DENSITY, GATE, P_DETECT, P_GATE, Problem
from vedette import kernels

WHICH = f"kernels: {kernels.RUNNING}"
OWN = ((0, 1, 2, 3),) * 6
ABSENT = np.zeros((2, 4))


def start_of(problem: Problem) -> tuple[tuple[Any, Any], list[Any]]:
    """Mean (*b, n) and covariance (*b, n, n) at the start, and the one return of each scan, (*b, m)."""
    shape = () if problem.tracks is None else (problem.tracks,)
    start = np.tile(problem.x0, (*shape, 1)), np.tile(problem.P0, (*shape, 1, 1))
    if problem.tracks is None:
        start = problem.x0.copy(), problem.P0.copy()
    return start, [np.ascontiguousarray(z[..., 0, :]) for z in problem.z]


def chosen(problem: Problem, found: tuple[Any, Any]) -> Answer:
    x, P = found
    if problem.tracks is None:
        return x.reshape(1, -1), P.reshape(1, *P.shape[-2:])
    x, P = x.reshape(problem.tracks, -1), P.reshape(problem.tracks, *P.shape[-2:])
    return x[list(problem.probe)], P[list(problem.probe)]


def kf(problem: Problem) -> Job:
    """Predict, then update."""
    F, Q, H, R = problem.F[0], problem.Q[0], problem.H, problem.R
    start, zs = start_of(problem)

    def run() -> tuple[Any, Any]:
        x, P = start
        for z in zs:
            x, P = kernels.predict(x, P, F, Q)
            x, P, _ = kernels.update(x, P, z, H, R)
        return x, P

    return Job(run, lambda found: chosen(problem, found))


def kf_fused(problem: Problem) -> Job:
    """Both in one kernel."""
    F, Q, H, R = problem.F[0], problem.Q[0], problem.H, problem.R
    start, zs = start_of(problem)

    def run() -> tuple[Any, Any]:
        x, P = start
        for z in zs:
            x, P, _ = kernels.filter_step(x, P, F, Q, z, H, R)
        return x, P

    return Job(run, lambda found: chosen(problem, found))


def imm(problem: Problem) -> Job:
    """Interaction, a prediction and an update a mode, the modes' weights, and all together."""
    r, F, Q, H, R, change, own = *matrices(problem), OWN[: problem.modes]
    (x0, P0), zs = start_of(problem)
    even, none = np.full((*x0.shape[:-1], r), -np.log(r)), [np.zeros((*x0.shape[:-1], 0))] * r
    volumes = [np.zeros(x0.shape[:-1])] * r

    def run() -> tuple[Any, Any]:
        log_prob, xs, Ps = even, (x0,) * r, (P0,) * r
        for z in zs:
            log_prob, xs, Ps = kernels.interact(log_prob, change, xs, Ps, own, ABSENT, ())
            ahead = [kernels.predict(xs[j], Ps[j], F[j], Q[j]) for j in range(r)]
            xs, Ps, logliks = zip(*[kernels.update(x, P, z, H, R) for x, P in ahead], strict=True)
            seen = [loglik[..., None] for loglik in logliks]
            log_prob = kernels.weigh_modes(log_prob, seen, none, volumes, none)[-1][..., 0, :]
            found = kernels.together(log_prob, xs, Ps, own, ABSENT, ())
        return found

    return Job(run, lambda found: chosen(problem, found))


def imm_pdaf(problem: Problem) -> Job:
    """The same with eight returns: scores by the gate, weights of the whole, and each mode's share of them."""
    r, F, Q, H, R, change, own = *matrices(problem), OWN[: problem.modes]
    (x0, P0), _ = start_of(problem)
    x0, P0, R = x0[..., None, :], P0[..., None, :, :], R[None, None]  # the axis of tracks
    even, exists = np.full((*x0.shape[:-1], r), -np.log(r)), np.ones(x0.shape[:-1])
    valid, log_density = np.ones(problem.z[0].shape[:-1], dtype=bool), np.log(DENSITY)

    def run() -> tuple[Any, Any]:
        log_prob, xs, Ps = even, (x0,) * r, (P0,) * r
        for z in problem.z:
            log_prob, xs, Ps = kernels.interact(log_prob, change, xs, Ps, own, ABSENT, ())
            ahead = [kernels.predict(xs[j], Ps[j], F[j], Q[j]) for j in range(r)]
            parts = [kernels.innovate_returns(P, z, x[..., :2], H, R, P_DETECT, P_GATE, ()) for x, P in ahead]
            logliks, distances, volumes = ([part[i] for part in parts] for i in range(3))
            loglik, distance, _, _, share = kernels.weigh_modes(log_prob, logliks, distances, volumes, distances)
            weights = kernels.softmax(kernels.gate_scores(loglik, distance, valid, exists, GATE, log_density, None))
            log_prob, each = kernels.split_weights(weights, share)
            after = [
                kernels.absorb(x, P, part[3], part[4], w, ()) for (x, P), part, w in zip(ahead, parts, each, strict=True)
            ]
            xs, Ps = tuple(x for x, _ in after), tuple(P for _, P in after)
            found = kernels.together(log_prob, xs, Ps, own, ABSENT, ())
        return found

    return Job(run, lambda found: chosen(problem, found))


def matrices(problem: Problem) -> tuple[int, Any, Any, Any, Any, Any]:
    """r, F, Q, H, R and the logarithms of the switching probabilities."""
    return problem.modes, problem.F, problem.Q, problem.H, problem.R, np.log(problem.switching)


LEVELS: dict[str, dict[str, Any]] = {
    "kf": {"kernels": kf, "fused": kf_fused},
    "imm": {"kernels": imm},
    "imm_pdaf": {"kernels": imm_pdaf},
}
