"""Calls of the kernels: any shapes, empty axes and wild numbers. The compiled ones do what the reference does.

Tame numbers give equal results. Wild ones (nan, inf, subnormal, huge) give results of the same shapes, or an error of the
same family; nothing is written into what was given, and shapes that do not fit are an error or an answer, never a crash.
"""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path
from typing import Any

import attrs
import numpy as np

from fuzz.cases import pick
from vedette import kernels
from vedette.kernels import association, backward, modes, reference

Array = np.ndarray[Any, Any]

WILD = np.array([np.nan, np.inf, -np.inf, 5e-324, -1e-310, 1e308, -1e308, 1e154, 0.0, -0.0, 1e-200, 1e16])

ERRORS = (ValueError, IndexError, TypeError, ZeroDivisionError, FloatingPointError, np.linalg.LinAlgError)
"""What a call of wrong shapes or numbers may raise."""

HOMES = (reference, modes, association, backward)


class Draw:
    """Arrays over one batch."""

    def __init__(self, rng: np.random.Generator) -> None:
        self.rng = rng
        self.batch = pick(rng, [(), (1,), (3,), (8,), (9,), (0,), (2, 3), (0, 2), (17,)])

    def vector(self, *shape: int) -> Array:
        """Return numbers of a usual size."""
        return self.rng.normal(size=(*self.batch, *shape))

    def cov(self, n: int, *more: int) -> Array:
        """Return covariances."""
        a = self.rng.normal(size=(*self.batch, *more, n, n))
        return a @ np.swapaxes(a, -1, -2) + 0.3 * np.eye(n)

    def simplex(self, *shape: int) -> Array:
        """Return weights that add up to one."""
        a = self.rng.random((*self.batch, *shape)) + 1e-3
        return a / a.sum(axis=-1, keepdims=True)


def calls(rng: np.random.Generator) -> dict[str, Callable[[], list[Any]]]:
    """Return kernels by name, with what draws their arguments."""
    draw = Draw(rng)
    n, m, k, r = (int(rng.integers(low, high)) for low, high in ((1, 15), (1, 6), (0, 6), (1, 5)))
    points = 2 * n + 1

    def transition() -> Array:
        return np.log(rng.dirichlet(np.ones(r), size=r))

    return {
        "predict": lambda: [draw.vector(n), draw.cov(n), draw.vector(n, n), draw.cov(n)],
        "propagate": lambda: [draw.cov(n), draw.vector(n, n), draw.cov(n)],
        "update": lambda: [draw.vector(n), draw.cov(n), draw.vector(m), draw.vector(m, n), draw.cov(m)],
        "filter_step": lambda: [
            *(draw.vector(n), draw.cov(n), rng.normal(size=(n, n)), draw.cov(n), draw.vector(m)),
            *(rng.normal(size=(m, n)), draw.cov(m)),
        ],
        "scan_step": lambda: [
            *(draw.vector(1, n), draw.cov(n, 1), rng.normal(size=(n, n)), np.eye(n), draw.vector(2, m)),
            *(rng.normal(size=(m, n)), np.diag(rng.random(m) + 0.1), 0.9, 0.99, 9.0, -2.0, pick(rng, [True, False]), ()),
        ],
        "smooth_linear": lambda: [
            *(draw.vector(n), draw.cov(n), rng.normal(size=(n, n)), draw.cov(n), draw.vector(n), draw.cov(n)),
            pick(rng, [(), ((n - 1, 6.0),)]),
        ],
        "whiten": lambda: [draw.vector(n), draw.cov(n)],
        "sigma_points": lambda: [draw.cov(n), pick(rng, [0.0, 0.5, 3.0])],
        "evaluate_points": lambda: [
            *(
                draw.vector(points, n),
                draw.vector(points, m),
                np.full(points, 1 / points),
                draw.vector(k, m),
                draw.cov(m, 1),
            ),
        ],
        "imm_mix": lambda: [np.log(draw.simplex(r)), transition(), draw.vector(r, n), draw.cov(n, r)],
        "imm_combine": lambda: [np.log(draw.simplex(r)), draw.vector(r), draw.vector(r, n), draw.cov(n, r)],
        "split_weights": lambda: [draw.simplex(1 + k), draw.vector(1 + k, r)],
        "softmax": lambda: [draw.vector(1 + k)],
        "one_hot": lambda: [draw.vector(1 + k)],
    }


def case(rng: np.random.Generator, folder: Path) -> str:
    """Call one kernel both ways and compare."""
    drawn = calls(rng)
    name = pick(rng, sorted(drawn))
    given = drawn[name]()
    manner = pick(rng, ["tame", "tame", "wild", "wild", "misshapen", "strided"])
    if manner == "wild":
        given = [_spoilt(rng, a) for a in given]
    elif manner == "misshapen":
        i = int(rng.integers(len(given)))
        given[i] = _misshapen(rng, given[i])
    elif manner == "strided":
        given = [np.asfortranarray(a) if isinstance(a, np.ndarray) else a for a in given]
    slow = next(getattr(home, name) for home in HOMES if hasattr(home, name))
    before = [a.tobytes() if isinstance(a, np.ndarray) else a for a in given]
    here, there = _answer(getattr(kernels, name), given), _answer(slow, given)
    if before != [a.tobytes() if isinstance(a, np.ndarray) else a for a in given]:
        raise AssertionError(f"{name}: wrote into what it was given")
    if manner in ("tame", "strided"):
        _compare(here, there, name)
    elif manner == "wild" and here is not None and there is not None:
        for one, other in zip(here, there, strict=True):
            np.broadcast_to(other, np.shape(one))  # ValueError if it is of another shape
    return "refused" if here is None else "accepted"


def _answer(kernel: Callable[..., Any], given: list[Any]) -> tuple[Any, ...] | None:
    """Return all that a kernel returns, None for an error that it may raise."""
    try:
        found = kernel(*given)
    except ERRORS:
        return None
    return _flat(found)


def _flat(found: Any) -> tuple[Any, ...]:
    if attrs.has(type(found)):
        found = attrs.astuple(found, recurse=False)
    if isinstance(found, tuple | list):
        return tuple(part for each in found for part in _flat(each))
    return (found,)


def _compare(here: tuple[Any, ...] | None, there: tuple[Any, ...] | None, name: str) -> None:
    if here is None or there is None:
        if here is not there:
            raise AssertionError(f"{name}: one of the two refused the call")
        return
    for one, other in zip(here, there, strict=True):
        expected = np.broadcast_to(other, np.shape(one))
        scale = max(1.0, float(np.max(np.abs(expected), initial=0.0, where=np.isfinite(expected))))
        np.testing.assert_allclose(one, expected, rtol=1e-6, atol=1e-7 * scale, err_msg=name)


def _spoilt(rng: np.random.Generator, a: Any) -> Any:
    """Return the array with some wild numbers in it."""
    if not isinstance(a, np.ndarray) or a.size == 0 or rng.random() < 0.5:
        return a
    found = a.copy()
    for _ in range(int(rng.integers(1, 4))):
        found.flat[int(rng.integers(found.size))] = pick(rng, WILD.tolist())
    return found * float(pick(rng, [1.0, 1.0, 1e150, 1e-160]))


def _misshapen(rng: np.random.Generator, a: Any) -> Any:
    """Return the array in a shape that may not fit."""
    if not isinstance(a, np.ndarray):
        return pick(rng, [np.nan, -1.0, 0.0, 1e300])
    if a.ndim == 0:
        return a[None]
    change = int(rng.integers(5))
    axis = int(rng.integers(a.ndim))
    if change == 0:
        return a[..., :-1]
    if change == 1:
        return np.concatenate([a, a], axis=axis)
    if change == 2:
        return np.take(a, [], axis=axis)
    return a[None] if change == 3 else (a[0] if len(a) else a.reshape(-1))
