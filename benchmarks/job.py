"""A problem prepared for a contender: something to run, and how to read its answer."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import Any

from benchmarks.problems import Array

Answer = tuple[Array, Array]
"""Mean (t, 4) and covariance (t, 4, 4) after the last scan: of the one target, or of a batch's probed tracks."""


@dataclass(frozen=True)
class Job:
    """`run` solves the problem once from its start and returns what `answer` reads; `many` does so a given number of times.

    `share`: the part of the problem that `run` solves, where all of it would take too long; all its tracks cost the same.
    """

    run: Callable[[], Any]
    answer: Callable[[Any], Answer]
    many: Callable[[int], Any] | None = None
    share: float = 1.0

    def repeat(self, times: int) -> Any:
        """Run `times` times; return what the last run returned."""
        if self.many is not None:
            return self.many(times)
        result = None
        for _ in range(times):
            result = self.run()
        return result
