"""Vedette's kernels alone: a call a stage, and fused where one kernel does the whole step."""

from __future__ import annotations

from typing import Any

import numpy as np

from benchmarks.job import Answer, Job
from benchmarks.problems import DENSITY, GATE, P_DETECT, P_GATE, Problem
from vedette import kernels

WHICH = getattr(kernels, "WHICH", "numpy kernels")
OWN = [[0, 1, 2, 3]] * 6
ABSENT = np.zeros((2, 4))


def begin(problem: Problem) -> tuple[Any, Any]:
    """Mean and covariance (*b, t=1, n) at the start."""
    shape = (1,) if problem.tracks is None else (problem.tracks, 1)
    return np.tile(problem.x0, (*shape, 1)), np.tile(problem.P0, (*shape, 1, 1))


def chosen(problem: Problem, found: tuple[Any, Any]) -> Answer:
    x, P = found
    if problem.tracks is None:
        return x, P
    return x[list(problem.probe), 0], P[list(problem.probe), 0]


def kf(problem: Problem) -> Job:
    F, Q, H, R, start = problem.F[0], problem.Q[0], problem.H, problem.R[None, None], begin(problem)
    certain = np.array([[0.0, 1.0]])

    def run() -> tuple[Any, Any]:
        x, P = start
        for z in problem.z:
            x, P = kernels.predict(x, P, F, Q)
            _, _, _, shift, post = kernels.innovate_returns(P, z, x @ H.T, H, R, 1.0, P_GATE, ())
            x, P = kernels.absorb(x, P, shift, post, certain, ())
        return x, P

    return Job(run, lambda found: chosen(problem, found))


def imm(problem: Problem) -> Job:
    return _imm(problem, clutter=False)


def imm_pdaf(problem: Problem) -> Job:
    return _imm(problem, clutter=True)


def _imm(problem: Problem, clutter: bool) -> Job:
    r, F, Q, H, R = problem.modes, problem.F, problem.Q, problem.H, problem.R[None, None]
    x0, P0 = begin(problem)
    change = np.log(problem.switching)
    even = np.full((*x0.shape[:-1], r), -np.log(r))
    own, certain = OWN[:r], np.array([[0.0, 1.0]])
    valid = np.ones(problem.z[0].shape[:-1], dtype=bool)
    log_density, exists = np.log(DENSITY), np.ones(x0.shape[:-1])
    p_detect = P_DETECT if clutter else 1.0

    def run() -> tuple[Any, Any]:
        log_prob, xs, Ps = even, (x0,) * r, (P0,) * r
        for z in problem.z:
            log_prob, xs, Ps = kernels.interact(log_prob, change, xs, Ps, own, ABSENT, ())
            ahead = [kernels.predict(xs[j], Ps[j], F[j], Q[j]) for j in range(r)]
            parts = [kernels.innovate_returns(P, z, x @ H.T, H, R, p_detect, P_GATE, ()) for x, P in ahead]
            logliks, distances, volumes = ([part[i] for part in parts] for i in range(3))
            loglik, distance, _, _, share = kernels.weigh_modes(log_prob, logliks, distances, volumes, distances)
            weights = certain
            if clutter:
                scores = kernels.gate_scores(loglik, distance, valid, exists, GATE, log_density, None)
                weights = kernels.softmax(scores)
            log_prob, each = kernels.split_weights(weights, share)
            after = [
                kernels.absorb(x, P, part[3], part[4], w, ()) for (x, P), part, w in zip(ahead, parts, each, strict=True)
            ]
            xs, Ps = tuple(x for x, _ in after), tuple(P for _, P in after)
            found = kernels.together(log_prob, xs, Ps, own, ABSENT, ())
        return found

    return Job(run, lambda found: chosen(problem, found))


LEVELS: dict[str, dict[str, Any]] = {"kf": {"kernels": kf}, "imm": {"kernels": imm}, "imm_pdaf": {"kernels": imm_pdaf}}
