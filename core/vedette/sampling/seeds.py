"""Seeds: values that give the same generator at every request, for one run or for many."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any, final

import numpy as np
from attrs import evolve, frozen
from numpy.random.bit_generator import ISeedSequence
from numpy.typing import NDArray

from vedette.sampling.generators import Generators
from vedette.units import short

_POOL, _WORD = 4, 0xFFFFFFFF


@final
@frozen
class Seed:
    """All randomness of one run: entropy and spawn key as numpy's SeedSequence has them, and a generator for each step."""

    entropy: int | tuple[int, ...]
    key: tuple[int, ...] = ()

    @classmethod
    def of(cls, seed: int | np.random.Generator | np.random.SeedSequence | Seed | Seeds) -> Seed | Seeds:
        """Return the seed meant: of a Generator, the next whole number that it draws; a seed as it is."""
        if isinstance(seed, Seed | Seeds):
            return seed
        if isinstance(seed, np.random.Generator):
            return cls(int(seed.integers(2**63)))
        try:
            given = seed if isinstance(seed, np.random.SeedSequence) else np.random.SeedSequence(seed)
        except (TypeError, ValueError):
            raise ValueError(f"seed: must be a whole number >= 0, or a Generator of numpy, got {short(seed)}") from None
        entropy = given.entropy
        whole = tuple(map(int, entropy)) if isinstance(entropy, Sequence) else int(entropy or 0)
        return cls(whole, tuple(given.spawn_key))

    def generator(self, step: int) -> np.random.Generator:
        """Return the generator of one step, from its beginning; this takes some 12 us."""
        return np.random.Generator(np.random.PCG64(np.random.SeedSequence(self.entropy, spawn_key=(*self.key, step))))


def sequence(seed: int, run: int, branch: tuple[int, ...] = ()) -> np.random.SeedSequence:
    """Return the randomness of one run of a study, independent of where and with which others it is run."""
    return np.random.SeedSequence(seed, spawn_key=(run, *branch))


@final
@frozen
class Seeds:
    """`sequence` of many runs; `branch`: the further keys that all share."""

    seed: int
    runs: tuple[int, ...]
    branch: tuple[int, ...] = ()

    def child(self, key: int) -> Seeds:
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
