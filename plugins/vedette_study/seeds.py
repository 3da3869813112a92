"""Randomness of many runs in lock-step: each run draws from its own stream what it draws alone."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from typing import Any, final

import numpy as np
from attrs import evolve, frozen
from numpy.random.bit_generator import ISeedSequence
from numpy.typing import NDArray

from vedette import Array, kernels
from vedette.sampling import NotInLockStep

_POOL, _WORD = 4, 0xFFFFFFFF
_LAW = "draws of runs in lock-step are `random` and `standard_normal` whose size leads with the runs"
_ROWS = {"random": "_uniforms", "standard_normal": "_normals"}
_OTHERS = {name for name in dir(np.random.Generator) if name[0] != "_"} - set(_ROWS)


def sequence(seed: int, run: int, branch: tuple[int, ...] = ()) -> np.random.SeedSequence:
    """Return the randomness of one run of a study, independent of where and with which others it is run."""
    return np.random.SeedSequence(seed, spawn_key=(run, *branch))


class Generators(np.random.Generator):
    """Draws of shape (r, ...) whose row i comes from the i-th run's stream alone, for estimators that draw in lock-step.

    NotInLockStep for any other draw: shared numbers would make a run depend on the others. `streams` makes
    the generators of the runs when they are first drawn from.
    """

    def __init__(self, runs: int, streams: Callable[[], Sequence[np.random.Generator]]) -> None:
        super().__init__(np.random.PCG64(0))
        self._runs = runs
        self._make = streams
        self._streams: Sequence[np.random.Generator] = ()

    def __getattribute__(self, name: str) -> Any:
        if name in _OTHERS:
            raise NotInLockStep(f"{name}: {_LAW}")
        return super().__getattribute__(_ROWS.get(name, name))

    def __str__(self) -> str:
        return f"generators of {self._runs} runs"

    __repr__ = __str__

    def _uniforms(self, size: Any = None) -> Array:
        """Draw uniform numbers in [0, 1)."""
        return kernels.uniforms(self._made(), self._of_a_run(size))

    def _normals(self, size: Any = None) -> Array:
        """Draw standard normal numbers."""
        return kernels.normals(self._made(), self._of_a_run(size))

    def _made(self) -> Sequence[np.random.Generator]:
        if not self._streams:
            self._streams = self._make()
        return self._streams

    def _of_a_run(self, size: Any) -> tuple[int, ...]:
        """Return the shape of what each run draws."""
        shape = tuple(size) if isinstance(size, tuple | list) else (size,)
        if not shape or shape[0] != self._runs:
            raise NotInLockStep(f"size: {_LAW}, {self._runs} of them; got {size}")
        return shape[1:]


@final
@frozen
class RunSeeds:
    """`sequence` of many runs; `branch`: the further keys that all share."""

    seed: int
    runs: tuple[int, ...]
    branch: tuple[int, ...] = ()

    def child(self, key: int) -> RunSeeds:
        """Return the seeds of what each run spawns."""
        return evolve(self, branch=(*self.branch, key))

    def generators(self) -> list[np.random.Generator]:
        """Return numpy's own generator of each run's `sequence`, to the last bit, in a quarter of the time."""
        states = _states(self.seed, np.array(self.runs, dtype=np.uint64), self.branch)
        return [np.random.Generator(np.random.PCG64(_Hashed(state))) for state in states]  # type: ignore[arg-type]

    def generator(self, step: int) -> Generators:
        """Return one generator for the runs in lock-step, each of which draws what `Seed.generator(step)` gives it alone."""
        return Generators(len(self.runs), self.child(step).generators)


class _Hashed(ISeedSequence):
    """A seed sequence whose 256 bits are known."""

    def __init__(self, state: NDArray[np.uint64]) -> None:
        self._state = state

    def generate_state(self, n_words: int, dtype: Any = np.uint32) -> NDArray[np.uint64]:
        assert (n_words, np.dtype(dtype)) == (len(self._state), self._state.dtype)
        return self._state


def _states(seed: int, runs: NDArray[np.uint64], branch: tuple[int, ...]) -> NDArray[np.uint64]:
    """Return `sequence(...).generate_state(4, np.uint64)` for all runs, a run's key below 2^32: (r, 4).

    M. E. O'Neill, Developing a seed_seq Alternative, 2015, with the constants of numpy's, which numpy promises to keep.
    """
    assert np.all(runs <= _WORD)
    words = _words(seed)
    words += [0] * (_POOL - len(words))
    constant = 0x43B0D7E5

    def hashed(value: NDArray[np.uint32]) -> NDArray[np.uint32]:
        nonlocal constant
        value = value ^ np.uint32(constant)
        constant = constant * 0x931E8875 & _WORD
        value = value * np.uint32(constant)
        return value ^ value >> np.uint32(16)

    def mixed(x: NDArray[np.uint32], y: NDArray[np.uint32]) -> NDArray[np.uint32]:
        value: NDArray[np.uint32] = np.uint32(0xCA01F9DD) * x - np.uint32(0x4973F715) * y
        return value ^ value >> np.uint32(16)

    one = np.ones(len(runs), dtype=np.uint32)
    keys = [runs.astype(np.uint32), *(one * np.uint32(word) for key in branch for word in _words(key))]
    entropy = [one * np.uint32(word) for word in words] + keys
    pool = [hashed(word) for word in entropy[:_POOL]]
    for i in range(_POOL):
        for j in range(_POOL):
            if i != j:
                pool[j] = mixed(pool[j], hashed(pool[i]))
    for word in entropy[_POOL:]:
        for j in range(_POOL):
            pool[j] = mixed(pool[j], hashed(word))
    state, constant = np.empty((len(runs), 2 * _POOL), dtype=np.uint32), 0x8B51F9DD
    for i in range(2 * _POOL):
        value = pool[i % _POOL] ^ np.uint32(constant)
        constant = constant * 0x58F38DED & _WORD
        value = value * np.uint32(constant)
        state[:, i] = value ^ value >> np.uint32(16)
    return state[:, ::2] | state[:, 1::2].astype(np.uint64) << np.uint64(32)


def _words(number: int) -> list[int]:
    """Split a whole number >= 0 into words of 32 bits, the lowest first."""
    words = [number & _WORD]
    while number := number >> 32:
        words.append(number & _WORD)
    return words
