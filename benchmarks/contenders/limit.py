"""The hardware's limit: `benchmarks/limit`, hand-written for 4 states, 2 measured axes and 3 modes, with the loop in C."""

from __future__ import annotations

import ctypes
from collections.abc import Callable
from typing import Any

import numpy as np

from benchmarks.job import Answer, Job
from benchmarks.limit.build import library
from benchmarks.problems import DENSITY, GATE, P_DETECT, P_GATE, Array, Problem

LIMIT = ctypes.CDLL(str(library()))
VERSION = "C++, for this processor"
ROWS, COLUMNS = np.tril_indices(4)
CLUTTER = np.array([P_DETECT, 1 - P_DETECT * P_GATE, DENSITY, GATE])


def aligned(values: Any) -> Array:
    """Return a copy that starts at a multiple of 64 bytes, as vectors must."""
    values = np.asarray(values, dtype=float)
    room = np.empty(values.size + 8)
    first = -room.ctypes.data // 8 % 8
    copy = room[first : first + values.size].reshape(values.shape)
    copy[...] = values
    return copy


def call(name: str, *arguments: Array | int) -> None:
    """Call a function of the library, passing arrays by address and integers as they are."""
    given = [ctypes.c_void_p(a.ctypes.data) if isinstance(a, np.ndarray) else ctypes.c_long(a) for a in arguments]
    getattr(LIMIT, name)(*given)


def packed(P: Array) -> Array:
    """Return the lower triangle: (*b, n, n) -> (*b, n (n+1) / 2)."""
    n = P.shape[-1]
    rows, columns = np.tril_indices(n)
    return P[..., rows, columns]


def unpacked(flat: Array) -> Array:
    """Return the symmetric matrix: (*b, 10) -> (*b, 4, 4)."""
    P = np.empty((*flat.shape[:-1], 4, 4))
    P[..., ROWS, COLUMNS] = P[..., COLUMNS, ROWS] = flat
    return P


def model(problem: Problem, mode: int) -> Array:
    """Return F, Q, H and R of a mode, in `Model`'s order (37,)."""
    parts = (problem.F[mode].ravel(), packed(problem.Q[mode]), problem.H.ravel(), packed(problem.R))
    return np.concatenate(parts)


def belief(problem: Problem) -> Array:
    """Return x and P (14,)."""
    return np.concatenate([problem.x0, packed(problem.P0)])


def kf(problem: Problem) -> Job:
    if problem.tracks is not None:
        return batch(problem, 1, lambda start, z, blocks, steps, state, out, loglik: call(
            "batch_kf", models, start, z, blocks, steps, state, loglik
        ), models := aligned(model(problem, 0)))  # fmt: skip
    start = aligned(np.concatenate([problem.x0, problem.P0.ravel()]))
    parts = (problem.F[0].ravel(), problem.Q[0].ravel(), problem.H.ravel(), packed(problem.R), np.zeros(5))
    models, z, out, loglik = aligned(np.concatenate(parts)), aligned(problem.z[:, 0]), aligned(np.zeros(20)), aligned([0.0])

    def many(times: int) -> Array:
        call("online_kf", start, models, z, problem.steps, times, out, loglik)
        return out

    return Job(lambda: many(1), lambda found: (found[None, :4].copy(), found[4:].reshape(1, 4, 4).copy()), many)


def ekf(problem: Problem) -> Job:
    """Run tracks by range and bearing; of one target there is no limit."""
    models = aligned(model(problem, 0))
    return batch(problem, 1, lambda start, z, blocks, steps, state, out, loglik: call(
        "batch_ekf", models, start, z, blocks, steps, state, loglik
    ), models)  # fmt: skip


def imm(problem: Problem) -> Job:
    return _imm(problem, "imm")


def imm_pdaf(problem: Problem) -> Job:
    return _imm(problem, "imm_pda")


def _imm(problem: Problem, name: str) -> Job:
    assert problem.modes == 3
    k = problem.z.shape[-2]
    each, clutter = np.array([model(problem, j) for j in range(3)]), aligned(CLUTTER)
    if problem.tracks is not None:
        change, models = aligned(problem.switching), aligned(each)
        return batch(problem, 3, lambda start, z, blocks, steps, state, out, loglik: call(
            f"batch_{name}", change, models, clutter, start, z, k, blocks, steps, state, out, loglik
        ), models)  # fmt: skip
    lanes = [0, 1, 2, 2]
    models, start = aligned(each[lanes].T), aligned(np.repeat(belief(problem), 4))
    chance = aligned([1 / 3, 1 / 3, 1 / 3, 0])
    change = aligned(problem.switching[:, lanes])
    z, out, loglik = aligned(problem.z), aligned(np.zeros(14)), aligned([0.0])

    def many(times: int) -> Array:
        call(f"online_{name}", start, chance, change, models, clutter, z, k, problem.steps, times, out, loglik)
        return out

    return Job(lambda: many(1), lambda found: (found[None, :4].copy(), unpacked(found[None, 4:14])), many)


def batch(problem: Problem, modes: int, run: Callable[..., None], keep: Array) -> Job:
    """Run tracks in blocks of eight: (blocks, 14 or 15 modes, 8), z (steps, blocks, 2 k, 8); `keep`: data of `run`."""
    if problem.tracks is None:
        raise LookupError(f"has no limit of {problem.family!r} for one target")
    blocks, k = -(-problem.tracks // 8), problem.z.shape[-2]
    spare = blocks * 8 - problem.tracks
    z = np.concatenate([problem.z, problem.z[:, :spare]], axis=1).reshape(problem.steps, blocks, 8, k * 2)
    one = np.concatenate([np.tile(belief(problem), modes), np.full(modes, 1 / modes) if modes > 1 else []])
    start = aligned(np.broadcast_to(one[:, None], (blocks, len(one), 8)))
    state, out, loglik = aligned(np.zeros(start.shape)), aligned(np.zeros((blocks, 14, 8))), aligned(np.zeros((blocks, 8)))
    z = aligned(np.swapaxes(z, -1, -2))
    final = state if modes == 1 else out

    def once() -> Array:
        run(start, z, blocks, problem.steps, state, out, loglik)
        return final

    def answer(found: Array) -> Answer:
        flat = np.array([found[i // 8, :, i % 8] for i in problem.probe])
        return flat[:, :4], unpacked(flat[:, 4:14])

    return Job(once, answer)


ENTRIES = {"kf": {"": kf}, "ekf": {"": ekf}, "imm": {"": imm}, "imm_pdaf": {"": imm_pdaf}}
