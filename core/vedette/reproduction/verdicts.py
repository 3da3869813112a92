"""Verdicts on what a paper claims: from figures and their Monte Carlo errors, by one rule."""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import Literal

from attrs import frozen

from vedette.reproduction.cells import DECISIVE, Cell

Verdict = Literal["reproduced", "not reproduced", "not decided", "remark"]
MOST_RUNS = 1_000_000
"""More runs than these are not named as what would decide: the figure lies on its bound."""


@frozen
class Condition:
    """A figure, and the bounds that it must keep for a claim to hold; `what` names it, with its unit.

    An error of None is unknown and decides nothing; a figure without chance has the error 0.
    """

    what: str
    figure: Cell
    least: float = -math.inf
    most: float = math.inf

    @property
    def margin(self) -> float | None:
        """How far the figure is within the nearer bound, negative beyond it; None if there is no figure."""
        value = self.figure.measured
        return None if value is None or math.isnan(value) else min(value - self.least, self.most - value)

    def holds(self, runs: int) -> bool | None:
        """Return whether it holds, clear of the bound by `DECISIVE` standard errors over `runs`; None while that is open."""
        margin, error = self.margin, self.figure.error
        if margin is None or error is None or not (error == 0 or abs(margin) >= error * _factor(runs)):
            return None
        return margin >= 0

    def needed(self, runs: int) -> int | None:
        """Return the number of runs, to two digits, that would decide if the figure stayed; None if none would."""
        margin, error = self.margin, self.figure.error
        if not margin or error is None or not math.isfinite(error / margin):
            return None
        many = runs * (error / margin) ** 2  # runs at which the error equals the margin
        too_few, count = runs, MOST_RUNS
        if many * _factor(count) ** 2 > count:
            return None
        while count - too_few > 1:
            middle = (too_few + count) // 2
            too_few, count = (too_few, middle) if many * _factor(middle) ** 2 <= middle else (middle, count)
        digit: int = 10 ** max(0, math.floor(math.log10(count)) - 1)
        return math.ceil(count / digit) * digit


@frozen
class Claim:
    """What a paper states, the verdict, the figures that it follows from, and a word on them.

    Made by `judged` or `remark`. `runs`: how many repetitions, called `unit`, the figures rest on; `needed`: how many would
    decide what is not decided, None where none would.
    """

    text: str
    verdict: Verdict
    why: str
    conditions: tuple[Condition, ...] = ()
    runs: int = 0
    unit: str = "runs"
    needed: int | None = None

    @property
    def headline(self) -> str:
        """The verdict in capitals, and what would decide if nothing is decided yet."""
        head = self.verdict.upper()
        if self.verdict != "not decided":
            return head
        rest = "no number of them would decide" if self.needed is None else f"{self.needed:,} would decide"
        return f"{head} with {self.runs:,} {self.unit}, {rest}"


def judged(text: str, conditions: Sequence[Condition], runs: int, why: str = "", unit: str = "runs") -> Claim:
    """Return a claim with its verdict: not reproduced if one condition fails, reproduced if all hold, else not decided."""
    if not conditions:
        raise ValueError(f"{text!r}: no condition; what no figure decides is a remark")
    found = [condition.holds(runs) for condition in conditions]
    verdict: Verdict = "not reproduced" if False in found else "not decided" if None in found else "reproduced"
    open_ones = [each.needed(runs) for each, held in zip(conditions, found, strict=True) if held is None]
    known = [count for count in open_ones if count is not None]
    undecided = verdict == "not decided" and len(known) == len(open_ones)
    return Claim(text, verdict, why, tuple(conditions), runs, unit, max(known) if undecided else None)


def remark(text: str, why: str) -> Claim:
    """Return what can be said of a claim that no figure decides."""
    return Claim(text, "remark", why)


def _factor(runs: float) -> float:
    """Return the standard errors that are as sure over so few runs as `DECISIVE` over many: Student's, runs - 1 free."""
    from scipy.special import ndtr, stdtrit

    return float(stdtrit(max(runs, 2) - 1.0, float(ndtr(DECISIVE))))
