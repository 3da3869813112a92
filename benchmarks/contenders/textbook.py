"""Textbook numpy, one track at a time, written straight from the equations. The oracle of every other contender."""

from __future__ import annotations

from collections.abc import Callable, Iterator

import numpy as np
from numpy.linalg import cholesky, det, inv

from benchmarks.job import Answer, Job
from benchmarks.problems import DENSITY, GATE, KAPPA, P_DETECT, P_GATE, Array, Problem

VERSION = f"numpy {np.__version__}"
MISS = 1 - P_DETECT * P_GATE


def predict(x: Array, P: Array, F: Array, Q: Array) -> tuple[Array, Array]:
    """Return the moments one scan later."""
    return F @ x, F @ P @ F.T + Q


def update(x: Array, P: Array, nu: Array, H: Array, R: Array) -> tuple[Array, Array, float]:
    """Return the posterior and the likelihood."""
    S = H @ P @ H.T + R
    inverse = inv(S)
    K = P @ H.T @ inverse
    likelihood = np.exp(-0.5 * nu @ inverse @ nu) / np.sqrt(det(2 * np.pi * S))
    return x + K @ nu, (np.eye(len(x)) - K @ H) @ P, likelihood


def pda(x: Array, P: Array, z: Array, inside: Array, H: Array, R: Array) -> tuple[Array, Array, float]:
    """Run probabilistic data association of the returns (k, 2) `inside` the gate; likelihood relative to clutter."""
    S = H @ P @ H.T + R
    inverse = inv(S)
    K = P @ H.T @ inverse
    nu = z - H @ x
    likely = inside * P_DETECT / DENSITY * np.exp(-0.5 * np.sum(nu @ inverse * nu, axis=1)) / np.sqrt(det(2 * np.pi * S))
    total = MISS + likely.sum()
    beta = likely / total
    mean = beta @ nu
    spread = (beta * nu.T) @ nu - np.outer(mean, mean)
    return x + K @ mean, P - beta.sum() * K @ S @ K.T + K @ spread @ K.T, total


def distances(x: Array, P: Array, z: Array, H: Array, R: Array) -> Array:
    """Return the squared Mahalanobis distances of the returns (k,)."""
    nu = z - H @ x
    return np.sum(nu @ inv(H @ P @ H.T + R) * nu, axis=1)


def moments(weights: Array, xs: list[Array], Ps: list[Array]) -> tuple[Array, Array]:
    """Return mean and covariance of a mixture."""
    mean = sum(w * x for w, x in zip(weights, xs, strict=True))
    return mean, sum(w * (P + np.outer(x - mean, x - mean)) for w, x, P in zip(weights, xs, Ps, strict=True))


def polar(x: Array) -> Array:
    """Return range and bearing."""
    return np.array([np.hypot(x[0], x[1]), np.arctan2(x[1], x[0])])


def polar_slope(x: Array) -> Array:
    """Return their derivative (2, 4)."""
    r = np.hypot(x[0], x[1])
    return np.array([[x[0] / r, x[1] / r, 0, 0], [-x[1] / r**2, x[0] / r**2, 0, 0]])


def wrapped(nu: Array) -> Array:
    """Return a residual of range and bearing, wrapped."""
    return np.array([nu[0], (nu[1] + np.pi) % (2 * np.pi) - np.pi])


def kf(problem: Problem, zs: Array) -> tuple[Array, Array]:
    x, P = problem.x0, problem.P0
    for z in zs:
        x, P = predict(x, P, problem.F[0], problem.Q[0])
        x, P, _ = update(x, P, z[0] - problem.H @ x, problem.H, problem.R)
    return x, P


def ekf(problem: Problem, zs: Array) -> tuple[Array, Array]:
    x, P = problem.x0, problem.P0
    for z in zs:
        x, P = predict(x, P, problem.F[0], problem.Q[0])
        x, P, _ = update(x, P, wrapped(z[0] - polar(x)), polar_slope(x), problem.R)
    return x, P


def ukf(problem: Problem, zs: Array) -> tuple[Array, Array]:
    x, P = problem.x0, problem.P0
    n = len(x)
    weights = np.full(2 * n + 1, 0.5 / (n + KAPPA))
    weights[0] = KAPPA / (n + KAPPA)

    def points(x: Array, P: Array) -> Array:
        root = cholesky((n + KAPPA) * P).T
        return np.concatenate([x[None], x + root, x - root])

    for z in zs:
        moved = points(x, P) @ problem.F[0].T
        x = weights @ moved
        P = (weights * (moved - x).T) @ (moved - x) + problem.Q[0]
        spread = points(x, P)
        seen = np.array([polar(point) for point in spread])
        expected = weights @ seen
        dz = np.array([wrapped(one - expected) for one in seen])
        S = (weights * dz.T) @ dz + problem.R
        K = (weights * (spread - x).T) @ dz @ inv(S)
        x, P = x + K @ wrapped(z[0] - expected), P - K @ S @ K.T
    return x, P


def single_pda(problem: Problem, zs: Array) -> tuple[Array, Array]:
    x, P = problem.x0, problem.P0
    H, R = problem.H, problem.R
    for z in zs:
        x, P = predict(x, P, problem.F[0], problem.Q[0])
        x, P, _ = pda(x, P, z, distances(x, P, z, H, R) <= GATE, H, R)
    return x, P


def imm(problem: Problem, zs: Array, clutter: bool = False) -> tuple[Array, Array]:
    """Run the IMM, or with `clutter` the IMM-PDAF: a return is inside the gate if it is inside that of any mode."""
    r, H, R = problem.modes, problem.H, problem.R
    mu, xs, Ps = np.full(r, 1 / r), [problem.x0] * r, [problem.P0] * r
    for z in zs:
        c = mu @ problem.switching
        mixed = [moments(problem.switching[:, j] * mu / c[j], xs, Ps) for j in range(r)]
        ahead = [predict(*mixed[j], problem.F[j], problem.Q[j]) for j in range(r)]
        if clutter:
            inside = np.min([distances(x, P, z, H, R) for x, P in ahead], axis=0) <= GATE
            after = [pda(x, P, z, inside, H, R) for x, P in ahead]
        else:
            after = [update(x, P, z[0] - H @ x, H, R) for x, P in ahead]
        xs, Ps = [one[0] for one in after], [one[1] for one in after]
        mu = c * [one[2] for one in after]
        mu /= mu.sum()
    return moments(mu, xs, Ps)


def imm_pdaf(problem: Problem, zs: Array) -> tuple[Array, Array]:
    return imm(problem, zs, clutter=True)


def gnn(problem: Problem) -> Answer:
    """Find the assignment of least total cost: one track and return at a time, then scipy's solver."""
    from scipy.optimize import linear_sum_assignment

    H, R, z = problem.H, problem.R, problem.z[0]
    ahead = [predict(x, problem.P0, problem.F[0], problem.Q[0]) for x in problem.x0]
    cost = np.full((len(ahead), len(z) + len(ahead)), 1e9)
    for t, (x, P) in enumerate(ahead):
        S = H @ P @ H.T + R
        inverse, volume = inv(S), np.sqrt(det(2 * np.pi * S))
        cost[t, len(z) + t] = -np.log(MISS)
        for i, one in enumerate(z):
            nu = one - H @ x
            if (d := nu @ inverse @ nu) <= GATE:
                cost[t, i] = 0.5 * d - np.log(P_DETECT / DENSITY / volume)
    rows, columns = linear_sum_assignment(cost)
    for t, i in zip(rows.tolist(), columns.tolist(), strict=True):
        if i < len(z):
            x, P = ahead[t]
            ahead[t] = update(x, P, z[i] - H @ x, H, R)[:2]
    return np.array([x for x, _ in ahead]), np.array([P for _, P in ahead])


Filter = Callable[[Problem, Array], tuple[Array, Array]]
FILTERS: dict[str, Filter] = {
    "kf": kf,
    "ekf": ekf,
    "foreign": ekf,
    "ukf": ukf,
    "imm": imm,
    "pda": single_pda,
    "imm_pdaf": imm_pdaf,
}


def solve(problem: Problem) -> Answer:
    """Return what every contender must find."""
    if problem.family == "gnn":
        return gnn(problem)
    tracks: Iterator[Array] = iter([problem.z] if problem.tracks is None else [problem.z[:, i] for i in problem.probe])
    solved = [FILTERS[problem.family](problem, z) for z in tracks]
    return np.array([x for x, _ in solved]), np.array([P for _, P in solved])


def _job(problem: Problem) -> Job:
    if problem.tracks is None or problem.family == "gnn":
        return Job(lambda: solve(problem), lambda found: found)
    chosen = range(min(problem.tracks, 8))  # in a loop the cost per track does not depend on their number

    def loop() -> list[tuple[Array, Array]]:
        return [FILTERS[problem.family](problem, problem.z[:, i]) for i in chosen]

    return Job(loop, lambda found: solve(problem), share=len(chosen) / problem.tracks)


ENTRIES = {family: {"": _job} for family in (*FILTERS, "gnn")}
