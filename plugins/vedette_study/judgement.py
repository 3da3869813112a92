"""A regression gate: figures of a study kept draw by draw, and whether those of today are worse.

The same seeds draw the same scenes, so runs are compared one by one. A figure is worse if the mean of the differences is
beyond what chance gives in one of 740 tests, as three standard errors are, with Student's t for the number of runs and
Holm's correction for the number of tests; and if it is worse by more than its least size, a part of what it was.
Holm, A Simple Sequentially Rejective Multiple Test Procedure, Scandinavian Journal of Statistics 6, 1979.
"""

from __future__ import annotations

import json
from collections.abc import Mapping
from pathlib import Path
from typing import Any

import numpy as np
from attrs import evolve, frozen

from vedette import Array, ConfigError, InputError
from vedette_files.writing import write_text
from vedette_study.averages import averaged_plan
from vedette_study.chunk import study_figures
from vedette_study.outcome import Outcome
from vedette_study.plan import Plan
from vedette_study.statistics import difference, mean
from vedette_study.store import made_by

MORE = ("coverage", "mota", "idf1", "hota", "hota_detection", "hota_association", "siap_completeness", "siap_longest")
"""Figures of which more is better; of those that have an expected value nearer is better, of all others less."""
UNJUDGED = ("position_bound",)
"""Figures that no tracker changes."""
ALPHA = 1.349898e-3
"""What a normal variable has beyond three standard errors."""
LEAST = 1e-9
"""The least size of any figure: less is rounding."""


@frozen
class Verdict:
    """One figure at one point: before and now, by how much it is worse with its standard error, and whether that counts."""

    point: str
    figure: str
    before: float | None
    now: float | None
    worse_by: float
    error: float
    probability: float
    fails: bool

    def __str__(self) -> str:
        what = f"{self.figure}{f' of {self.point}' if self.point else ''}"
        change = f"worse by {self.worse_by:.3g} +- {self.error:.2g}" if np.isfinite(self.worse_by) else "is there no more"
        return f"{'WORSE' if self.fails else 'fine '} {what}: {_told(self.before)} before, {_told(self.now)} now, {change}"


def _told(value: float | None) -> str:
    return "none" if value is None else f"{value:.5g}"


def judgement(outcome: Outcome, before: Mapping[str, Any] | None = None) -> dict[str, Any]:
    """Return what is kept of a study: runs, seed, and each point's figures run by run.

    For each figure it says what is better, and from which part of it on a change counts: as `before` did, where it did.
    """
    kept = (before or {}).get("figures", {})
    known = study_figures()
    rules = {}
    for name in outcome.figures:
        usual = "more" if name in MORE else "less" if known[name].expected is None else "expected"
        rules[name] = kept.get(name, {"better": usual, "least": LEAST})
    points = [
        {"labels": _labels(at.labels), "figures": {name: _plain(values[i]) for name, values in outcome.figures.items()}}
        for i, at in enumerate(outcome.plan.points)
    ]
    return {"made": made_by(), "runs": outcome.runs, "seed": outcome.plan.seed, "figures": rules, "points": points}


def _labels(labels: Mapping[str, Any]) -> dict[str, str]:
    return {path: str(value) for path, value in labels.items()}


def _plain(values: Array) -> list[float | None]:
    return [float(value) if np.isfinite(value) else None for value in values]


def write_judgement(path: Path, kept: Mapping[str, Any]) -> None:
    """Write a judgement: a line for each point, so that a difference can be read."""
    points = ",\n".join(json.dumps(point) for point in kept["points"])
    head = {name: value for name, value in kept.items() if name != "points"}
    write_text(path, f'{json.dumps(head, indent=1)[:-2]},\n "points": [\n{points}\n]}}\n')


def read_judgement(path: Path) -> dict[str, Any]:
    """Return a judgement that `write_judgement` wrote; InputError if it is none."""
    try:
        kept = json.loads(path.read_text(encoding="utf-8"))
        runs, _ = int(kept["runs"]), int(kept["seed"])
        for rule in kept["figures"].values():
            if rule["better"] not in ("more", "less", "expected") or not rule["least"] >= LEAST:
                raise ValueError(f"better must be more, less or expected, and least at least {LEAST:g}, got {rule}")
        for point in kept["points"]:
            _ = dict(point["labels"])
            for name, values in point["figures"].items():
                if name not in kept["figures"] or len(values) != runs or not np.all(np.isfinite(_array(values)[1])):
                    raise ValueError(f"{name}: must be known to `figures`, and have {runs} numbers")
    except OSError as error:
        raise InputError(f"{path}: cannot be read: {error}") from None
    except (ValueError, KeyError, TypeError, AttributeError) as error:
        raise InputError(f"{path}: is no judgement, as `vedette study --write` writes: {error}") from None
    return kept


def _array(values: list[Any]) -> tuple[Array, Array]:
    """Return the numbers with NaN for none, and those that are there."""
    all_of = np.array([np.nan if value is None else float(value) for value in values])
    return all_of, np.array([float(value) for value in values if value is not None])


def demand_comparable(planned: Plan, kept: Mapping[str, Any]) -> None:
    """Raise ConfigError unless the study has every point that was kept, and its figures are known."""
    if unknown := kept["figures"].keys() - study_figures().keys():
        text = f"there is no figure {', '.join(sorted(unknown))}: install its plugin, or write a new judgement: --write FILE"
        raise ConfigError.at("--against", text)
    now = [_labels(at.labels) for at in averaged_plan(planned).points]
    for point in kept["points"]:
        if point["labels"] not in now:
            text = f"the study has no point {json.dumps(point['labels'])}; write a new judgement: --write FILE"
            raise ConfigError.at("--against", text)


def verdicts(outcome: Outcome, kept: Mapping[str, Any]) -> list[Verdict]:
    """Return the verdict on each figure that was kept, the worse ones first."""
    now = [_labels(at.labels) for at in outcome.plan.points]
    tests: list[Verdict] = []
    for point in kept["points"]:
        i = now.index(point["labels"])
        told = ", ".join(f"{path} = {value}" for path, value in point["labels"].items())
        for name, values in point["figures"].items():
            if name not in UNJUDGED:
                before, there = _array(values)
                current = outcome.figures[name][i] if name in outcome.figures else np.full(len(before), np.nan)
                if len(there):
                    tests.append(_compared(told, name, before, current, kept["figures"][name]))
    return _holm(tests)


def _compared(point: str, name: str, before: Array, now: Array, rule: Mapping[str, Any]) -> Verdict:
    from scipy.special import stdtr

    old, new = mean(name, before), mean(name, now)
    lost = int(np.sum(np.isfinite(before) & ~np.isfinite(now))) - int(np.sum(~np.isfinite(before) & np.isfinite(now)))
    if new.value is None or old.value is None:
        return Verdict(point, name, old.value, None, np.inf, 0.0, 0.0, True)
    if rule["better"] == "expected":
        right = study_figures()[name].expected or 0.0
        change = difference(name, np.abs(now - right), np.abs(before - right))
    else:
        change = difference(name, now, before)
    if change.value is None:
        return Verdict(point, name, old.value, new.value, np.inf, 0.0, 0.0, True)
    worse, error, n = (-change.value if rule["better"] == "more" else change.value), change.error or 0.0, change.runs
    if error > 1e-12 * abs(worse):
        probability = float(stdtr(n - 1, -worse / error))
    else:
        probability = 0.0 if worse > 0 else 1.0  # one run, or all differ alike: no chance is left
    if lost > 0:
        probability = min(probability, 0.5**lost)
    counts = worse > rule["least"] * abs(old.value) or 0.5 ** max(lost, 0) < ALPHA
    return Verdict(point, name, old.value, new.value, worse, error, probability, counts)


def _holm(tests: list[Verdict]) -> list[Verdict]:
    """Return the tests with whether each fails: in order of their probabilities, as long as these are small enough."""
    done, open_still = [], True
    for rank, test in enumerate(sorted(tests, key=lambda test: test.probability)):
        open_still = open_still and test.probability <= ALPHA / (len(tests) - rank)
        done.append(evolve(test, fails=test.fails and open_still))
    return sorted(done, key=lambda test: not test.fails)
