"""One case of a fuzzer: seeded, with a limit on its time, and what came of it."""

from __future__ import annotations

import gc
import math
import signal
import traceback
import warnings
from collections import Counter
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from pathlib import Path
from time import process_time

import numpy as np
from attrs import define, field, frozen

from vedette import InputError, PluginError
from vedette.errors import ConfigError

ALLOWED = (ConfigError, InputError, PluginError)
"""What a wrong config or input may raise."""

SECONDS = 15.0
"""A case that takes more CPU time hangs. The slowest, a draft that imports pandas, takes 5 s on two slow cores."""

ASLEEP = 4.0
"""One that waits for what never comes hangs once it took next to none in so many times as long."""

NUMBERS = [0, 1, -1, 2, 1e308, -1e308, 1e-320, 5e-324, 1e15, 1.1e15, math.nan, math.inf, -math.inf, 10**400, -(2**63)]
WORDS = [
    " ",
    "nan",
    "inf",
    "-inf",
    "1e999",
    "0x10",
    "1_0",
    "5 kg",
    "1.5 deg",
    "m",
    "\0",
    "\ud800",
    "..",
    "../x",
    "/dev/zero",
]
WORDS += [
    "/dev/zero",
    "~nosuchuser/x",
    "\u202e",
    "true",
    '"',
    "'",
    "[",
    "{",
    "\u0663",
    "--1",
    "+",
    "1e",
    "kind",
    "",
    ",",
    "x" * 10_000,
]
PARTS = [None, True, False, [], {}, [[]], [None], [1, "a"], {"": 1}, {"kind": "kalman"}, [[1, 2], [3]], [math.nan] * 3]
NASTY = [*NUMBERS, *WORDS, *PARTS]
"""Values that have broken readers somewhere."""


class Hang(BaseException):
    """A case that was stopped as it took too long; no `except Exception` holds it."""


@frozen
class Found:
    """A fault: the number of its case and what escaped."""

    case: int
    text: str

    def __str__(self) -> str:
        return f"case {self.case}: {self.text}"


@define
class Outcome:
    """What came of the cases: how many were accepted and refused, and what escaped."""

    cases: int = 0
    came: Counter[str] = field(factory=Counter)
    found: list[Found] = field(factory=list)

    def __str__(self) -> str:
        parts = ", ".join(f"{count:,} {name}" for name, count in sorted(self.came.items()))
        return f"{self.cases:,} cases: {parts}; {len(self.found)} escapes"


@contextmanager
def limited(seconds: float) -> Iterator[None]:
    """Stop what takes more CPU time, or next to none in ASLEEP times as long, with Hang; the main thread only.

    No garbage is collected meanwhile: that of a whole test run takes seconds, and what is raised in it is swallowed.
    """
    used = process_time()

    def stop(*_: object) -> None:
        raise Hang(f"took more than {seconds:g} s of CPU time, or next to none in {ASLEEP * seconds:g} s")

    def awake(*_: object) -> None:
        nonlocal used
        if process_time() - used < 0.01 * seconds:
            stop()
        used = process_time()

    clocks = ((signal.ITIMER_PROF, signal.SIGPROF, seconds), (signal.ITIMER_REAL, signal.SIGALRM, ASLEEP * seconds))
    before = [signal.signal(number, look) for (_, number, _), look in zip(clocks, (stop, awake), strict=True)]
    gc.disable()
    for clock, _, limit in clocks:
        signal.setitimer(clock, limit, limit)
    try:
        yield
    finally:
        gc.enable()
        for (clock, number, _), handler in zip(clocks, before, strict=True):
            signal.setitimer(clock, 0.0)
            signal.signal(number, handler)


Case = Callable[[np.random.Generator, Path], str]
"""Draws a case, runs it in a folder of its own, and returns a word for what came of it."""


def carry_out(
    case: Case, seed: int, numbers: range, folder: Path, note: Callable[[int], None] = lambda i: None, most: int = 20
) -> Outcome:
    """Run cases by their numbers; case i of a seed is the same whatever the others are. Stops after `most` faults."""
    outcome = Outcome()
    for i in numbers:
        note(i)
        outcome.cases += 1
        try:
            with limited(SECONDS), warnings.catch_warnings(), np.errstate(all="ignore"):
                warnings.simplefilter("ignore")
                outcome.came[case(np.random.default_rng([seed, i]), folder)] += 1
        except ALLOWED as error:
            outcome.came["refused"] += 1
            if not str(error) or len(str(error)) > 100_000:
                outcome.found.append(Found(i, f"an error of {len(str(error))} characters"))
        except (Exception, Hang) as error:
            last = traceback.extract_tb(error.__traceback__)[-1]
            place = f"{Path(last.filename).name}:{last.lineno}"
            outcome.found.append(Found(i, f"{type(error).__name__} at {place}: {str(error)[:200]}"))
        if len(outcome.found) >= most:
            break
    return outcome


def pick(rng: np.random.Generator, options: list):  # type: ignore[no-untyped-def, type-arg]
    """Return one of some options, as it is: numpy would make an array of them."""
    return options[int(rng.integers(len(options)))]
