"""Laws of lifecycles."""

from __future__ import annotations

from contextlib import suppress
from typing import Any

import numpy as np
from attrs import evolve

from vedette.space import Array
from vedette.supporting import Lifecycle
from vedette.testing.comparisons import Lacking, demand, same, stated
from vedette.testing.law import Law
from vedette.testing.laws import lifecycle_limits, trackers
from vedette.testing.laws.lifecycle_cases import Lives, judged, live
from vedette.tracking import pytrees
from vedette.types import Review


def pure(lifecycle: Lifecycle, drawn: Lives) -> None:
    """The same history gives the same verdicts again; arguments stay as they were."""
    for first, again in zip(live(lifecycle, drawn), live(lifecycle, drawn), strict=True):
        same("verdicts again", np.array(again), np.array(first), 0.0)


def verdicts_are_one_a_track(lifecycle: Lifecycle, drawn: Lives) -> None:
    """Confirmed and alive are true or false for every track."""
    for confirmed, alive in live(lifecycle, drawn):
        for name, verdict in (("confirmed", confirmed), ("alive", alive)):
            shape = drawn.hit.shape[1:]
            told = f"{name}: must be {shape} of true or false, got {verdict.shape} of {verdict.dtype}"
            demand(verdict.shape == shape and verdict.dtype == bool, told)


def tracks_are_judged_alone(lifecycle: Lifecycle, drawn: Lives) -> None:
    """Tracks in another order, or one alone, get their own verdicts."""
    whole = live(lifecycle, drawn)
    for tracks in (drawn.order, drawn.order[:1]):
        for part, both in zip(live(lifecycle, drawn, tracks), whole, strict=True):
            same("verdicts", np.array(part), np.array(both)[:, tracks], 0.0)


def batches_as_it_loops(lifecycle: Lifecycle, drawn: Lives) -> None:
    """Runs in one batch give what each gives alone."""
    memory = lifecycle.start(drawn.initial)
    again, _, _ = judged(lifecycle, memory, drawn.review(0))
    last = len(drawn.hit) - 1
    _, confirmed, alive = judged(lifecycle, _stacked(again), drawn.review(0, runs=(last, 0)))
    for run, scan in enumerate((last, 0)):
        _, one, living = judged(lifecycle, again, drawn.review(scan))
        same("confirmed", np.asarray(confirmed)[run], one, 0.0)
        same("alive", np.asarray(alive)[run], living, 0.0)
    rows = drawn.existence[[last, 0]]
    same("predict", lifecycle.predict(rows, drawn.dt)[1], lifecycle.predict(rows[1], drawn.dt))


def _stacked(memory: Any) -> Any:
    """The memory of two equal runs."""
    lead = pytrees.mapped(lambda array: array[None], memory)
    return pytrees.join(lead, lead, 0)


def survival_is_a_probability(lifecycle: Lifecycle, drawn: Lives) -> None:
    """Time does not make a target exist more, and no time changes nothing."""
    existence = drawn.existence[0]
    after = lifecycle.predict(existence, drawn.dt)
    told = f"predict: existence {existence} must become less over {drawn.dt:g} s, and not less than 0, got {after}"
    demand(np.all((after >= 0) & (after <= existence)), told)
    same("predict(e, 0)", lifecycle.predict(existence, 0.0), existence, 1e-12, 1.0)


def existence_stays_a_probability(lifecycle: Lifecycle, drawn: Lives) -> None:
    """However long nobody looks, existence is between 0 and 1; if targets are `shown` and `away`, they go and come so."""
    for dt in (drawn.dt, 1e3, 1e6):
        after = lifecycle.predict(drawn.existence[0], dt)
        demand(np.all((after >= 0) & (after <= 1)), f"predict: existence must be in [0, 1] after {dt:g} s, got {after}")
    for name, start, way in (("shown", 1.0, -1.0), ("away", 0.0, 1.0)):
        with suppress(Lacking):
            stay = stated(lifecycle, name, "s")
            rate = (float(lifecycle.predict(np.array([start]), 1e-6 * stay)[0]) - start) / 1e-6
            demand(abs(rate - way) < 1e-3, f"predict: of those {name}, {abs(rate):.3g} change in a mean stay, must be 1")


def two_waits_make_one(lifecycle: Lifecycle, drawn: Lives) -> None:
    """To wait twice is to wait once for as long."""
    existence, total = drawn.existence[0], drawn.dt + drawn.later
    twice = lifecycle.predict(lifecycle.predict(existence, drawn.dt), drawn.later)
    same("predict", twice, lifecycle.predict(existence, total), 1e-9, 1.0)


def certain_as_declared(lifecycle: Lifecycle, drawn: Lives) -> None:
    """If certain: time takes nothing from existence."""
    same("predict", lifecycle.predict(drawn.existence, drawn.dt), drawn.existence, 0.0)


def permanent_as_declared(lifecycle: Lifecycle, drawn: Lives) -> None:
    """If permanent: tracks surely exist, all are confirmed and all go on."""
    demand(lifecycle.certain, "certain: must be True, as its tracks are permanent")
    for confirmed, alive in live(lifecycle, drawn):
        demand(confirmed.all() and alive.all(), "review: every track must be confirmed and go on, as they are permanent")


def a_hit_never_harms(lifecycle: Lifecycle, drawn: Lives) -> None:
    """A track that is detected in each of its scans is confirmed and alive wherever one that is detected less is."""
    ones = np.ones(drawn.hit.shape)
    detected = evolve(drawn, existence=ones, hit=ones)
    gone = np.zeros(drawn.hit.shape[1], dtype=bool)
    for (confirmed, alive), (better, living) in zip(live(lifecycle, drawn), live(lifecycle, detected), strict=True):
        gone = gone | ~alive
        demand(np.all(better | ~confirmed | gone), "confirmed: a track with more hits must be confirmed no later")
        demand(np.all(living | gone), "alive: a track with more hits must live at least as long")


def unseen_tracks_end(lifecycle: Lifecycle, drawn: Lives) -> None:
    """A track that no sensor covers any more, or covers but in name, or never detects, ends, unless tracks are permanent."""
    ones, none = np.ones(2), np.zeros(2)
    found = lifecycle.start(ones)
    for _ in range(3):
        found, _, _ = judged(lifecycle, found, Review(drawn.dt, ones, ones, ones, none + 1.0))
    for chance, days, dt in ((0.0, 400, 10 * 86_400.0), (1e-6, 400, 10 * 86_400.0), (0.9, 150, 6 * 3600.0)):
        memory, alive = found, ones > 0
        existence: Array = 0.999 * ones
        for _ in range(round(days * 86_400.0 / dt)):
            existence = lifecycle.predict(existence, dt)
            existence = existence * (1.0 - chance) / (1.0 - existence * chance)  # Bayes: it was not detected
            memory, _, alive = judged(lifecycle, memory, Review(dt, existence, none, none + chance, none + 1e6))
            if not alive.any():
                break
        demand(not alive.any(), f"review: a track goes on after {days} days of scans that could detect it with {chance:g}")


LAWS: tuple[Law, ...] = (
    *map(Law, (
        pure, verdicts_are_one_a_track, tracks_are_judged_alone, batches_as_it_loops, survival_is_a_probability,
        existence_stays_a_probability, two_waits_make_one, a_hit_never_harms,
    )),
    *(Law(certain_as_declared, needs="certain"), Law(permanent_as_declared, needs="permanent")),
    Law(unseen_tracks_end, needs="not permanent"),
    *lifecycle_limits.LAWS,
    *trackers.OF_LIFECYCLES,
)  # fmt: skip
