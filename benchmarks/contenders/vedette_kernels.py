"""Vedette's kernels alone: one call per stage, and fused where one kernel does the whole step."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import Any

import numpy as np

from benchmarks.job import Answer, Job
from benchmarks.problems import DENSITY, GATE, P_DETECT, P_GATE, POLAR, Problem
from vedette import kernels
from vedette_standard.sensors.range_bearing import RangeBearing

WHICH = f"kernels: {kernels.RUNNING}"
CHUNK = 2_000
"""Tracks that pass through all stages of a scan together, where a batch is split into chunks that stay in the cache."""


@dataclass(frozen=True)
class Pipeline:
    """A filter on arrays: its start for a number of tracks (None: one target), one scan, and the checked part of its state.

    `single`: it takes one return a scan. `online`: a loop over scans with the step inlined, where a call more would show.
    """

    start: Callable[[int | None], Any]
    step: Callable[[Any, Any], Any]
    read: Callable[[Any], tuple[Any, Any]] = lambda state: state
    single: bool = True
    online: Callable[[Any, list[Any]], Any] | None = None

    def job(self, problem: Problem, chunk: int | None) -> Job:
        """Run all tracks at once, or chunk by chunk within each scan."""
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
            states = list(begins)
            for scan in scans:
                for i, z in enumerate(scan):
                    states[i] = step(states[i], z)
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
    """Return mean (*b, n) and covariance (*b, n, n)."""
    if size is None:
        return problem.x0.copy(), problem.P0.copy()
    return np.tile(problem.x0, (size, 1)), np.tile(problem.P0, (size, 1, 1))


def kf(problem: Problem) -> Pipeline:
    """Predict, then update."""
    F, Q, H, R, predict, update = problem.F[0], problem.Q[0], problem.H, problem.R, kernels.predict, kernels.update

    def step(state: Any, z: Any) -> Any:
        ahead = predict(*state, F, Q)
        return update(ahead.mean, ahead.cov, z, H, R)[:2]

    def online(state: Any, zs: list[Any]) -> Any:
        x, P = state
        for z in zs:
            ahead = predict(x, P, F, Q)
            x, P, _ = update(ahead.mean, ahead.cov, z, H, R)
        return x, P

    return Pipeline(lambda size: prior(problem, size), step, online=online)


def fused(problem: Problem) -> Pipeline:
    """Predict and update in one kernel."""
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


def ekf(problem: Problem) -> Pipeline:
    """Predict, what the sensor's twin says of the return, and the update by it."""
    twin = RangeBearing(*POLAR).twin
    if twin is None:
        raise LookupError("has no compiled sensors")
    F, Q, sure, periods = problem.F[0], problem.Q[0], np.array([0.0, 1.0]), ((1, 2 * np.pi),)
    predict, evaluate, update = kernels.predict, kernels.evaluate_twin, kernels.weighted_update

    def step(state: Any, z: Any) -> Any:
        ahead = predict(*state, F, Q)
        seen = evaluate(ahead.mean, ahead.cov, z, None, twin.function, twin.parameters, (0, 1), P_GATE, periods)
        after = update(ahead.mean, ahead.cov, seen.detail.shift, seen.detail.post, sure, ())
        return after.mean, after.cov

    def start(size: int | None) -> Any:
        x, P = prior(problem, size or 1)
        return x[:, None], P[:, None]

    return Pipeline(start, step, single=False)


def ekf_fused(problem: Problem) -> Pipeline:
    """Run all of a scan in one kernel."""
    twin = RangeBearing(*POLAR).twin
    if twin is None:
        raise LookupError("has no compiled sensors")
    F, Q, certain, none = problem.F[0], problem.Q[0], 1.0 - 1e-12, np.array(0.0)
    look, rest = (twin.function, twin.parameters, (0, 1)), (certain, np.inf, none, False, ((1, 2 * np.pi),))
    scan_step = kernels.scan_step_twin

    def step(state: Any, z: Any) -> Any:
        found = scan_step(*state, F, Q, z, *look, *rest)
        assert found is not None
        return found.after.mean, found.after.cov

    return Pipeline(ekf(problem).start, step, single=False)


def imm(problem: Problem) -> Pipeline:
    """Mix, predict, update, and combine all modes, which are an axis of the arrays."""
    F, Q, H, R, change = np.stack(problem.F), np.stack(problem.Q), problem.H, problem.R, np.log(problem.switching)
    mix, predict, update, combine = kernels.imm_mix, kernels.predict, kernels.update, kernels.imm_combine

    def step(state: Any, z: Any) -> Any:
        log_prob, xs, Ps, _, _ = state
        log_prob, xs, Ps = mix(log_prob, change, xs, Ps)
        ahead = predict(xs, Ps, F, Q)
        xs, Ps, loglik = update(ahead.mean, ahead.cov, z, H, R)
        log_prob, x, P, _ = combine(log_prob, loglik, xs, Ps)
        return log_prob, xs, Ps, x, P

    return Pipeline(lambda size: modes_of(problem, size), step, lambda state: state[-2:], single=False)


def imm_pdaf(problem: Problem) -> Pipeline:
    """Run the same with the returns of a scan."""
    F, Q, H, R, change = np.stack(problem.F), np.stack(problem.Q), problem.H, problem.R, np.log(problem.switching)
    mix, predict, update, combine = kernels.imm_mix, kernels.predict, kernels.pda_update, kernels.imm_combine
    log_density = float(np.log(DENSITY))

    def step(state: Any, z: Any) -> Any:
        log_prob, xs, Ps, _, _ = state
        log_prob, xs, Ps = mix(log_prob, change, xs, Ps)
        ahead = predict(xs, Ps, F, Q)
        xs, Ps, loglik = update(ahead.mean, ahead.cov, z, H, R, P_DETECT, P_GATE, GATE, log_density)
        log_prob, x, P, _ = combine(log_prob, loglik, xs, Ps)
        return log_prob, xs, Ps, x, P

    return Pipeline(lambda size: modes_of(problem, size), step, lambda state: state[-2:], single=False)


def modes_of(problem: Problem, size: int | None) -> Any:
    """Return log_prob (*b, r), xs (*b, r, n), Ps (*b, r, n, n), and no mixture yet."""
    x0, P0 = prior(problem, size)
    r, shape = problem.modes, x0.shape[:-1]
    xs, Ps = np.repeat(x0[..., None, :], r, axis=-2), np.repeat(P0[..., None, :, :], r, axis=-3)
    return np.full((*shape, r), -np.log(r)), xs, Ps, x0, P0


def levels(pipeline: Callable[[Problem], Pipeline], name: str) -> dict[str, Callable[[Problem], Job]]:
    """Return the level of this name, and the same in chunks."""
    return {
        name: lambda problem: pipeline(problem).job(problem, None),
        f"{name} in chunks": lambda problem: pipeline(problem).job(problem, CHUNK),
    }


LEVELS: dict[str, dict[str, Any]] = {
    "ekf": levels(ekf, "kernels") | levels(ekf_fused, "fused"),
    "kf": levels(kf, "kernels") | levels(fused, "fused"),
    "imm": levels(imm, "kernels"),
    "imm_pdaf": levels(imm_pdaf, "kernels"),
}
