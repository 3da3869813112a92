"""Wrong lifecycles."""

from functools import partial

import attrs
import numpy as np

import vedette_standard as standard
from mutants.foreign.base import Mutant, mutant

COUNTS = partial(standard.MOfN, max_out_of_coverage=30.0, max_without_detection=20.0)
WIDE = partial(standard.MOfN, max_spread=200.0)
EXISTS = partial(standard.Existence, lifetime=100.0)
SCORE = partial(standard.Score)
COASTS = partial(standard.CoastLimited)


def _review(**change):
    """Return a `review` that takes parts of the scan for others, each a function of it."""

    def review(right, memory, scan):
        return right.review(memory, attrs.evolve(scan, **{name: f(scan) for name, f in change.items()}))

    return review


def _verdict(confirmed=lambda c, a, s: c, alive=lambda c, a, s: a):
    """Return a `review` with other verdicts, functions of the right ones and of the scan."""

    def review(right, memory, scan):
        memory, c, a = right.review(memory, scan)
        return memory, confirmed(c, a, scan), alive(c, a, scan)

    return review


def _own(change):
    """Return a `review` that changes what the kind keeps, a function of what it kept before and after."""

    def review(right, memory, scan):
        after, c, a = right.review(memory, scan)
        return attrs.evolve(after, own=change(memory.own, after.own)), c, a

    return review


def _time_not_reset(right, memory, scan):
    after, c, a = right.review(memory, scan)
    return attrs.evolve(after, detected=memory.detected + scan.dt), c, a


def _coverage_time_not_reset(right, memory, scan):
    after, c, a = right.review(memory, scan)
    return attrs.evolve(after, covered=memory.covered + scan.dt), c, a


def _first_not_counted(right, existence):
    memory = right.start(existence)
    return attrs.evolve(memory, own=attrs.evolve(memory.own, hits=np.zeros_like(memory.own.hits)))


def _confirmed_at_once(right, existence):
    memory = right.start(existence)
    return attrs.evolve(memory, own=attrs.evolve(memory.own, confirmed=np.ones_like(memory.own.confirmed)))


def _in_place(right, memory, scan):
    after, c, a = right.review(memory, scan)
    memory.covered[...], memory.detected[...] = after.covered, after.detected
    return attrs.evolve(memory, own=after.own), c, a


def _hidden_count():
    """Return a `review` that counts its calls, over all runs and tracks, and confirms after the tenth."""
    calls = []

    def review(right, memory, scan):
        calls.append(scan.dt)
        memory, c, a = right.review(memory, scan)
        return memory, c | (len(calls) > 10), a

    return review


@attrs.frozen(eq=False)
class Diary:
    """The right memory, and all hits so far: it grows with each scan."""

    inner: object
    hits: tuple[np.ndarray, ...]


def _diary(right, memory, scan):
    inner, c, a = right.review(memory.inner, scan)
    return Diary(inner, (*memory.hits, scan.hit)), c, a


def _survives_linearly(right, existence, dt):
    return existence * (1 - dt / right.lifetime)


lifecycle = partial(mutant, "lifecycle")

MUTANTS: tuple[Mutant, ...] = (
    lifecycle(
        "counts_uncovered",
        "A scan that could not see the track counts as a miss.",
        COUNTS,
        review=_review(p_detect=lambda s: np.ones_like(s.p_detect)),
    ),
    lifecycle(
        "counts_any_hit",
        "A hit with any probability counts as a detection.",
        COUNTS,
        review=_review(hit=lambda s: (s.hit > 0).astype(float)),
    ),
    lifecycle(
        "counts_misses", "hit is taken as the probability of a miss.", COUNTS, review=_review(hit=lambda s: 1.0 - s.hit)
    ),
    lifecycle("counts_scans_not_seconds", "Every scan is taken to last 1 s.", COUNTS, review=_review(dt=lambda s: 1.0)),
    lifecycle(
        "counts_first_forgotten", "The return that started the track is no detection.", COUNTS, start=_first_not_counted
    ),
    lifecycle("counts_confirms_at_once", "Every track is confirmed when it starts.", COUNTS, start=_confirmed_at_once),
    lifecycle(
        "counts_time_not_reset", "The time without a detection is the age of the track.", COUNTS, review=_time_not_reset
    ),
    lifecycle(
        "counts_coverage_not_reset",
        "The time out of coverage runs while the track is covered.",
        COUNTS,
        review=_coverage_time_not_reset,
    ),
    lifecycle("counts_never_ends", "No track ever ends.", COUNTS, review=_verdict(alive=lambda c, a, s: np.ones_like(a))),
    lifecycle(
        "counts_uncovered_lives",
        "Tracks that no sensor covers live on for ever.",
        COUNTS,
        review=_verdict(alive=lambda c, a, s: a | (s.p_detect == 0)),
    ),
    lifecycle(
        "counts_ends_at_a_miss",
        "Any scan without a detection ends the track.",
        COUNTS,
        review=_verdict(alive=lambda c, a, s: a & (s.hit > 0.5)),
    ),
    lifecycle(
        "counts_together",
        "All tracks end when one of them does.",
        COUNTS,
        review=_verdict(alive=lambda c, a, s: np.full_like(a, np.all(a))),
    ),
    lifecycle(
        "counts_unconfirms",
        "A track is confirmed in scans that detect it only.",
        COUNTS,
        review=_verdict(confirmed=lambda c, a, s: c & (s.hit > 0.5)),
    ),
    lifecycle(
        "counts_one_scalar",
        "Verdicts come without the tracks' axis.",
        COUNTS,
        review=_verdict(confirmed=lambda c, a, s: np.any(c), alive=lambda c, a, s: np.any(a)),
    ),
    lifecycle(
        "counts_hidden",
        "It counts its calls in a list of its own, and confirms after the tenth.",
        COUNTS,
        review=_hidden_count(),
    ),
    lifecycle("counts_in_place", "The memory that is passed in is changed.", COUNTS, review=_in_place),
    lifecycle(
        "counts_diary", "The memory grows with each scan.", COUNTS, start=lambda r, e: Diary(r.start(e), ()), review=_diary
    ),
    lifecycle(
        "counts_not_certain",
        "It judges by detections alone, yet has existence estimated.",
        COUNTS,
        label="other_model",
        certain=False,
    ),
    lifecycle(
        "wide_variance",
        "The spread's square is held against the limit.",
        WIDE,
        review=_review(spread=lambda s: None if s.spread is None else s.spread**2),
    ),
    lifecycle("wide_needs_nothing", "It judges by the spread without asking for it.", WIDE, needs_spread=lambda r: False),
    lifecycle(
        "exists_for_ever",
        "Existence does not fade with time: `lifetime` is ignored.",
        EXISTS,
        label="other_model",
        predict=lambda r, e, dt: e,
    ),
    lifecycle(
        "exists_more_and_more",
        "The exponent's sign is lost: existence grows beyond 1.",
        EXISTS,
        predict=lambda r, e, dt: e * np.exp(dt / r.lifetime),
    ),
    lifecycle(
        "exists_per_scan", "Existence fades by scans, not by seconds.", EXISTS, predict=lambda r, e, dt: r.predict(e, 1.0)
    ),
    lifecycle("exists_linearly", "1 - dt / lifetime: negative after a long pause.", EXISTS, predict=_survives_linearly),
    lifecycle(
        "exists_confirms_by_hit",
        "The hit is held against the limits, not the existence.",
        EXISTS,
        review=_review(existence=lambda s: s.hit),
    ),
    lifecycle(
        "score_forgets_best",
        "The fall of the score is held against 0, not against its best.",
        SCORE,
        review=_own(lambda before, after: attrs.evolve(after, fell=np.maximum(-after.last, 0.0))),
    ),
    lifecycle(
        "coasts_never_reset",
        "Missed detections add up over hits.",
        COASTS,
        review=_own(lambda before, after: attrs.evolve(after, missed=np.maximum(before.missed, after.missed))),
    ),
)
