"""Verdicts on what a paper claims: from figures and their Monte Carlo errors, by one rule."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from typing import Literal

from attrs import frozen

from vedette_report.findings.cells import DECISIVE, Cell

Verdict = Literal["reproduced", "not reproduced", "not decided", "remark", "depends"]
MOST_RUNS = 1_000_000
"""More runs than these are not named as what would decide: the figure lies on its bound."""


@frozen
class Condition:
    """A figure, and the bounds that it must keep for a claim to hold; `what` names it, with its unit.

    An error of None is unknown and decides nothing; a figure without chance has the error 0. A claim of order is `strict`:
    a figure on its bound does not hold. Where the figure has a trimmed one, both must decide alike.
    """

    what: str
    figure: Cell
    least: float = -math.inf
    most: float = math.inf
    strict: bool = False

    @property
    def margin(self) -> float | None:
        """How far the figure is within the nearer bound, negative beyond it; None if there is no figure."""
        value = self.figure.measured
        return None if value is None or math.isnan(value) else self._within(value)

    def holds(self, runs: int) -> bool | None:
        """Return whether it holds, clear of the bound by `DECISIVE` standard errors over `runs`; None while that is open."""
        verdicts = {self._decided(margin, error, runs) for margin, error in self._margins()}
        return verdicts.pop() if len(verdicts) == 1 else None

    def needed(self, runs: int) -> int | None:
        """Return the number of runs, to two digits, that would decide if the figure stayed; None if none would."""
        margins = self._margins()
        counts = [_needed(margin, error, runs) for margin, error in margins]
        if len({margin is not None and margin > 0 for margin, _ in margins}) > 1 or None in counts:
            return None
        return max(count for count in counts if count is not None)

    def _within(self, value: float) -> float:
        return min(value - self.least, self.most - value)

    def _margins(self) -> list[tuple[float | None, float | None]]:
        trimmed = self.figure.trimmed
        plain = (self.margin, self.figure.error)
        return [plain] if trimmed is None else [plain, (self._within(trimmed[0]), trimmed[1])]

    def _decided(self, margin: float | None, error: float | None, runs: int) -> bool | None:
        if margin is None or error is None or not (error == 0 or abs(margin) >= error * _factor(runs)):
            return None
        return margin > 0 if self.strict else margin >= 0


def _needed(margin: float | None, error: float | None, runs: int) -> int | None:
    if not margin or error is None or not math.isfinite(error / margin):
        return None
    many = runs * (error / margin) ** 2  # runs at which the error equals the margin
    too_few, count = 0, MOST_RUNS
    if many * _factor(count) ** 2 > count:
        return None
    while count - too_few > 1:
        middle = (too_few + count) // 2
        too_few, count = (too_few, middle) if many * _factor(middle) ** 2 <= middle else (middle, count)
    digit: int = 10 ** max(0, math.floor(math.log10(count)) - 1)
    return math.ceil(count / digit) * digit


@frozen
class Place:
    """What a paper leaves unsaid, name to value, and the verdict where it is that."""

    values: Mapping[str, str]
    verdict: Verdict


@frozen
class Claim:
    """What a paper states, the verdict, the figures that it follows from, and a word on them.

    Made by `judged`, `over` or `remark`. `runs`: how many repetitions, called `unit`, the figures rest on; `needed`: how
    many would decide what is not decided, None where none would. `places`: where it was judged, if at more than one place.
    """

    text: str
    verdict: Verdict
    why: str
    conditions: tuple[Condition, ...] = ()
    runs: int = 0
    unit: str = "runs"
    needed: int | None = None
    places: tuple[Place, ...] = ()

    @property
    def headline(self) -> str:
        """The verdict in capitals, and where it holds, or what would decide if nothing is decided yet."""
        if self.places:
            count = {name: sum(place.verdict == name for place in self.places) for name in ("reproduced", "not decided")}
            still = f", OPEN IN {count['not decided']}" if count["not decided"] else ""
            return f"HOLDS IN {count['reproduced']} OF {len(self.places)}{still}"
        head = self.verdict.upper()
        if self.verdict != "not decided":
            return head
        rest = "no number of them would decide" if self.needed is None else f"{self.needed:,} would decide"
        return f"{head} with {self.runs:,} {self.unit}, {rest}"


def judged(text: str, conditions: Sequence[Condition], runs: int, why: str = "", unit: str = "runs") -> Claim:
    """Return a claim with its verdict: not reproduced if one condition fails, reproduced if all hold, else not decided."""
    if not conditions:
        raise ValueError(f"{text!r}: no condition; what no figure decides is a remark")
    verdicts = [condition.holds(runs) for condition in conditions]
    verdict: Verdict = "not reproduced" if False in verdicts else "not decided" if None in verdicts else "reproduced"
    open_ones = [condition.needed(runs) for condition, held in zip(conditions, verdicts, strict=True) if held is None]
    known = [count for count in open_ones if count is not None]
    undecided = verdict == "not decided" and len(known) == len(open_ones)
    return Claim(text, verdict, why, tuple(conditions), runs, unit, max(known) if undecided else None)


def over(text: str, places: Sequence[Place], why: str = "", conditions: Sequence[Condition] = (), runs: int = 0) -> Claim:
    """Return a claim judged at several places: it depends on the place if it holds at some and fails at others."""
    verdicts = {place.verdict for place in places} - {"not decided"}
    verdict: Verdict = "depends" if len(verdicts) > 1 else verdicts.pop() if len(verdicts) == 1 else "not decided"
    if verdict != "depends" and any(place.verdict == "not decided" for place in places):
        verdict = "not decided"
    return Claim(text, verdict, why, tuple(conditions), runs, places=tuple(places))


def remark(text: str, why: str) -> Claim:
    """Return what can be said of a claim that no figure decides."""
    return Claim(text, "remark", why)


def _factor(runs: float) -> float:
    """Return the standard errors that are as sure over so few runs as `DECISIVE` over many: Student's, runs - 1 free."""
    from scipy.special import ndtr, stdtrit

    return float(stdtrit(max(runs, 2) - 1.0, float(ndtr(DECISIVE))))
