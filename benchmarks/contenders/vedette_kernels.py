"""Vedette's kernels alone: a call a stage, and fused where one kernel does the whole step."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import Any

import numpy as np

from benchmarks.job import Answer, Job
from benchmarks.problems import DENSITY, GATE, P_DETECT, P_GATE, Problem
from vedette import kernels

WHICH = f"kernels: {kernels.RUNNING}"
OWN = ((0, 1, 2, 3),) * 6
ABSENT = np.zeros((2, 4))
CHUNK = 2_000
"""Tracks that go through all stages of a scan together, where a batch is taken in chunks that stay in the cache."""


@dataclass(frozen=True)
class Pipeline:
    """A filter on arrays: its start for so many tracks (none: one target), one scan, and what of its state is checked.

    `single`: it takes one return a scan. `online`: a loop over scans, the step written out, where a call more would show.
    """

    start: Callable[[int | None], Any]
    step: Callable[[Any, Any], Any]
    read: Callable[[Any], tuple[Any, Any]] = lambda state: state
    single: bool = True
    online: Callable[[Any, list[Any]], Any] | None = None

    def job(self, problem: Problem, chunk: int | None) -> Job:
        """All tracks at once, or chunk by chunk within each scan."""
        size, step = problem.tracks, self.step
        zs = [np.ascontiguousarray(z[..., 0, :]) if self.single else z for z in problem.z]
        if size is None:
            begin, loop = self.start(None), self.online or self._loop
            return Job(lambda: loop(begin, zs), lambda state: _one(*self.read(state)))
        cuts = range(0, size, chunk or size)
        parts = [slice(cut, cut + (chunk or size)) for cut in cuts]
        begins = [self.start(len(range(*part.indices(size)))) for part in parts]
        scans = [[z[part] for part in parts] for z in zs]

        def run() -> Any:
            states = begins
            for scan in scans:
                states = [step(state, z) for state, z in zip(states, scan, strict=True)]
            return states

        def answer(states: Any) -> Answer:
            xs, Ps = zip(*map(self.read, states), strict=True)
            x, P = np.concatenate(xs).reshape(size, -1), np.concatenate(Ps)
            P = P.reshape(size, *P.shape[-2:])
            return x[list(problem.probe)], P[list(problem.probe)]

        return Job(run, answer)

    def _loop(self, state: Any, zs: list[Any]) -> Any:
        for z in zs:
            state = self.step(state, z)
        return state


def _one(x: Any, P: Any) -> Answer:
    return x.reshape(1, -1), P.reshape(1, *P.shape[-2:])


def prior(problem: Problem, size: int | None) -> tuple[Any, Any]:
    """Mean (*b, n) and covariance (*b, n, n)."""
    if size is None:
        return problem.x0.copy(), problem.P0.copy()
    return np.tile(problem.x0, (size, 1)), np.tile(problem.P0, (size, 1, 1))


def kf(problem: Problem) -> Pipeline:
    """Predict, then update."""
    F, Q, H, R, predict, update = problem.F[0], problem.Q[0], problem.H, problem.R, kernels.predict, kernels.update

    def step(state: Any, z: Any) -> Any:
        x, P = state
        x, P = predict(x, P, F, Q)
        return update(x, P, z, H, R)[:2]

    def online(state: Any, zs: list[Any]) -> Any:
        x, P = state
        for z in zs:
            x, P = predict(x, P, F, Q)
            x, P, _ = update(x, P, z, H, R)
        return x, P

    return Pipeline(lambda size: prior(problem, size), step, online=online)


def fused(problem: Problem) -> Pipeline:
    """Both in one kernel."""
    F, Q, H, R, filter_step = problem.F[0], problem.Q[0], problem.H, problem.R, kernels.filter_step

    def step(state: Any, z: Any) -> Any:
        x, P = state
        return filter_step(x, P, F, Q, z, H, R)[:2]

    def online(state: Any, zs: list[Any]) -> Any:
        x, P = state
        for z in zs:
            x, P, _ = filter_step(x, P, F, Q, z, H, R)
        return x, P

    return Pipeline(lambda size: prior(problem, size), step, online=online)


def imm(problem: Problem) -> Pipeline:
    """Interaction, a prediction and an update a mode, the modes' weights, and all together."""
    r, F, Q, H, R = problem.modes, problem.F, problem.Q, problem.H, problem.R
    change, own, modes = np.log(problem.switching), OWN[: problem.modes], range(problem.modes)

    def start(size: int | None) -> Any:
        x0, P0 = prior(problem, size)
        shape = x0.shape[:-1]
        nothing = [np.zeros((*shape, 0))] * r, [np.zeros(shape)] * r  # no returns to gate: distances, volumes
        return np.full((*shape, r), -np.log(r)), (x0,) * r, (P0,) * r, nothing, None

    def step(state: Any, z: Any) -> Any:
        log_prob, xs, Ps, (none, volumes), _ = state
        log_prob, xs, Ps = kernels.interact(log_prob, change, xs, Ps, own, ABSENT, ())
        ahead = [kernels.predict(xs[j], Ps[j], F[j], Q[j]) for j in modes]
        xs, Ps, logliks = zip(*[kernels.update(x, P, z, H, R) for x, P in ahead], strict=True)
        seen = [loglik[..., None] for loglik in logliks]
        log_prob = kernels.weigh_modes(log_prob, seen, none, volumes, none)[-1][..., 0, :]
        return log_prob, xs, Ps, (none, volumes), kernels.together(log_prob, xs, Ps, own, ABSENT, ())

    return Pipeline(start, step, lambda state: state[-1])


def imm_pdaf(problem: Problem) -> Pipeline:
    """The same with eight returns: scores by the gate, weights of the whole, and each mode's share of them."""
    r, F, Q, H, R = problem.modes, problem.F, problem.Q, problem.H, problem.R[None, None]
    change, own, modes, log_density = np.log(problem.switching), OWN[: problem.modes], range(problem.modes), np.log(DENSITY)

    def start(size: int | None) -> Any:
        x0, P0 = prior(problem, size)
        x0, P0 = x0[..., None, :], P0[..., None, :, :]  # the axis of tracks
        shape, count = x0.shape[:-1], problem.z.shape[-2]
        fixed = np.ones((*shape[:-1], count), dtype=bool), np.ones(shape)  # valid, existence
        return np.full((*shape, r), -np.log(r)), (x0,) * r, (P0,) * r, fixed, None

    def step(state: Any, z: Any) -> Any:
        log_prob, xs, Ps, (valid, exists), _ = state
        log_prob, xs, Ps = kernels.interact(log_prob, change, xs, Ps, own, ABSENT, ())
        ahead = [kernels.predict(xs[j], Ps[j], F[j], Q[j]) for j in modes]
        parts = [kernels.innovate_returns(P, z, x[..., :2], H, R, P_DETECT, P_GATE, ()) for x, P in ahead]
        logliks, distances, volumes, shifts, posts = zip(*parts, strict=True)
        loglik, distance, _, _, share = kernels.weigh_modes(log_prob, logliks, distances, volumes, distances)
        weights = kernels.softmax(kernels.gate_scores(loglik, distance, valid, exists, GATE, log_density, None))
        log_prob, each = kernels.split_weights(weights, share)
        after = [kernels.absorb(*ahead[j], shifts[j], posts[j], each[j], ()) for j in modes]
        xs, Ps = zip(*after, strict=True)
        return log_prob, xs, Ps, (valid, exists), kernels.together(log_prob, xs, Ps, own, ABSENT, ())

    return Pipeline(start, step, lambda state: state[-1], single=False)


def levels(pipeline: Callable[[Problem], Pipeline], name: str) -> dict[str, Callable[[Problem], Job]]:
    """The level of this name, and the same in chunks."""
    return {
        name: lambda problem: pipeline(problem).job(problem, None),
        f"{name} in chunks": lambda problem: pipeline(problem).job(problem, CHUNK),
    }


LEVELS: dict[str, dict[str, Any]] = {
    "kf": levels(kf, "kernels") | levels(fused, "fused"),
    "imm": levels(imm, "kernels"),
    "imm_pdaf": levels(imm_pdaf, "kernels"),
}
