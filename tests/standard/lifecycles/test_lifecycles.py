"""Lifecycles against what their sentences say, counted by hand over random histories."""

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from vedette.types import Review
from vedette_standard.lifecycles.coast_limited import CoastLimited
from vedette_standard.lifecycles.existence import Existence
from vedette_standard.lifecycles.m_of_n import MOfN
from vedette_standard.lifecycles.score import Score


def review(hit, p_detect, dt=1.0, spread=None):
    """What a scan said of one track that surely exists."""
    return Review(dt, np.ones(1), np.array([float(hit)]), np.array([p_detect]), spread)


def m_of_n_by_hand(seen, hits, looks, misses):
    """(confirmed, alive) after each look of one track, the birth being the first hit."""
    history = [True]
    confirmed = hits == 1
    for hit in seen:
        history.append(hit)
        confirmed = confirmed or sum(history[-looks:]) >= hits
        if confirmed:
            alive = len(history) < misses or any(history[-misses:])
        else:
            alive = (len(history) - sum(history[-looks:])) <= looks - hits
        yield confirmed, alive
        if not alive:
            return


@settings(max_examples=300)
@given(
    st.lists(st.booleans(), max_size=30),
    st.integers(1, 5).flatmap(lambda m: st.tuples(st.just(m), st.integers(m, 8))),
    st.integers(1, 6),
)
@pytest.mark.costly
def test_m_of_n_counts_hits_in_its_last_looks(seen, rule, misses):
    life = MOfN(hits=rule[0], looks=rule[1], misses=misses)
    memory = life.start(np.ones(1))
    for hit, (confirmed, alive) in zip(seen, m_of_n_by_hand(seen, *rule, misses), strict=False):
        memory, is_confirmed, is_alive = life.review(memory, review(hit, 0.9))
        assert (is_confirmed[0], is_alive[0]) == (confirmed, alive)


def test_m_of_n_does_not_count_scans_that_cannot_see_the_track():
    life = MOfN(hits=2, looks=3, misses=2)
    memory = life.start(np.ones(1))
    for _ in range(20):
        memory, _, alive = life.review(memory, review(0.0, 0.05))
        assert alive[0]
    assert memory.own.looks[0] == 1


@pytest.mark.parametrize("life", [Existence(confirm=0.6), Score(), CoastLimited(), MOfN()])
def test_a_scan_that_sees_nothing_of_a_track_changes_no_later_verdict(life):
    """Though it began above what confirms it, as beside a birth that knows how many targets there are."""
    rng, count = np.random.default_rng(2), 60
    alone, begun = life.start(np.full(count, 0.9)), np.full(count, 0.9)
    beside, lived, none, confirmed_late = alone, begun > 0, np.zeros(count), False
    for _ in range(12):
        beside, _, on = life.review(beside, Review(0.0, begun, none, none))
        lived &= on
        begun, hit = rng.uniform(0.1, 0.9, count), (rng.random(count) < 0.6).astype(float)
        alone, *verdict = life.review(alone, Review(1.0, begun, hit, none + 0.5))
        beside, *same = life.review(beside, Review(1.0, begun, hit, none + 0.5))
        np.testing.assert_array_equal(np.array(verdict)[:, lived], np.array(same)[:, lived])
        confirmed_late |= bool((~verdict[0] & lived).any())
        lived &= verdict[1]
    assert confirmed_late, "the law says something"


def test_existence_follows_the_lifetime_and_the_thresholds():
    life = Existence(lifetime=100.0, confirm=0.9, delete=0.1)
    assert life.predict(np.array([0.8]), 50.0)[0] == pytest.approx(0.8 * np.exp(-0.5))
    memory = life.start(np.ones(3))
    memory, confirmed, alive = life.review(memory, Review(1.0, np.array([0.95, 0.5, 0.05]), np.ones(3), np.ones(3)))
    assert confirmed.tolist() == [True, False, False]
    assert alive.tolist() == [True, True, False]
    _, confirmed, _ = life.review(memory, Review(1.0, np.array([0.5, 0.5, 0.5]), np.ones(3), np.ones(3)))
    assert confirmed.tolist() == [True, False, False], "once confirmed, a track stays so"


def test_a_confirmed_track_is_shown_only_as_long_as_it_likely_exists():
    life = Existence(confirm=0.9, delete=0.1, show=0.5)
    memory, told = life.start(np.ones(1)), []
    for existence in (0.6, 0.95, 0.6, 0.4, 0.3, 0.6):
        memory, confirmed, alive = life.review(memory, Review(1.0, np.array([existence]), np.ones(1), np.ones(1), None))
        told.append(bool(confirmed[0]))
        assert alive.all()
    assert told == [False, True, True, False, False, True]


@pytest.mark.parametrize(
    ("wrong", "message"),
    [
        (lambda: MOfN(hits=4, looks=3), r"hits: must be <= looks, 3, got 4"),
        (lambda: Existence(delete=0.5, confirm=0.4), r"confirm: must be > delete"),
    ],
)
def test_rules_that_contradict_themselves_are_refused(wrong, message):
    with pytest.raises(ValueError, match=message):
        wrong()


ENDING = [
    (MOfN(max_out_of_coverage=30.0), lambda t: review(0.0, 0.0, 10.0), 3),
    (CoastLimited(max_out_of_coverage=30.0), lambda t: review(0.0, 0.0, 10.0), 3),
    (Existence(max_out_of_coverage=30.0), lambda t: review(0.0, 0.0, 10.0), 3),
    (MOfN(max_out_of_coverage=30.0), lambda t: review(0.0, 0.05, 10.0), 3),
    (CoastLimited(max_out_of_coverage=30.0), lambda t: review(0.0, 1e-6, 10.0), 3),
    (Score(max_out_of_coverage=30.0), lambda t: review(0.0, 1e-6, 10.0), 3),
    (CoastLimited(confirmed=99.0, tentative=99.0, max_without_detection=25.0), lambda t: review(0.0, 0.9, 10.0), 2),
    (CoastLimited(max_spread=100.0), lambda t: review(1.0, 0.9, 10.0, np.array([30.0 * t])), 3),
]


@pytest.mark.parametrize(("life", "scan", "last"), ENDING)
def test_tracks_end_at_their_limits(life, scan, last):
    """Scans 10 s apart: (nearly) out of coverage for 30 s, undetected for 25 s, uncertain by 30 m more each up to 100 m."""
    memory, lived = life.start(np.ones(1)), []
    for t in range(1, 6):
        memory, _, alive = life.review(memory, scan(t))
        lived.append(bool(alive[0]))
    assert lived == [t <= last for t in range(1, 6)]


def test_a_look_at_the_track_starts_its_time_out_of_coverage_anew():
    life = MOfN(hits=1, max_out_of_coverage=30.0)
    memory = life.start(np.ones(1))
    for t in range(1, 40):
        memory, _, alive = life.review(memory, review(t % 3 == 0, 0.9 if t % 3 == 0 else 0.0, 10.0))
        assert alive[0]


def test_a_detection_where_none_was_likely_starts_the_time_out_of_coverage_anew():
    life = MOfN(hits=1, max_out_of_coverage=30.0)
    memory = life.start(np.ones(1))
    for t in range(1, 40):
        memory, _, alive = life.review(memory, review(t % 3 == 0, 0.001, 10.0))
        assert alive[0]
