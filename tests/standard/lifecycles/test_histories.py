"""Score-based and coast-limited lifecycles against their rules, counted by hand, and Wald's error rates."""

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from vedette.types import Review
from vedette_standard.lifecycles.coast_limited import CoastLimited
from vedette_standard.lifecycles.score import Score


def scored(life, log_ratios, initial=0.1):
    """Confirmed and alive (scans, tracks) under likelihood ratios (scans, tracks), existence brought up to date by Bayes."""
    count = log_ratios.shape[1]
    existence = np.full(count, initial)
    memory, told = life.start(existence), []
    for log_ratio in log_ratios:
        existence = life.predict(existence, 1.0)
        odds = existence / (1 - existence) * np.exp(log_ratio)
        existence = odds / (1 + odds)
        memory, confirmed, alive = life.review(memory, Review(1.0, existence, np.ones(count), np.ones(count)))
        told.append((confirmed, alive))
    return np.array([c for c, _ in told]), np.array([a for _, a in told])


def decided(life, log_ratios, initial):
    """Whether each track was confirmed before it ended."""
    confirmed, alive = scored(life, log_ratios, initial)
    first = np.argmax(confirmed | ~alive, axis=0)
    assert (confirmed | ~alive).any(axis=0).all(), "every test comes to its end"
    return confirmed[first, range(confirmed.shape[1])]


@pytest.mark.parametrize(("alpha", "beta"), [(0.01, 0.1), (0.1, 0.02)])
@pytest.mark.costly
def test_walds_error_rates_are_kept(alpha, beta):
    """Ratios of unit Gaussians half a deviation apart; 20,000 tests of each kind. By Wald the rates are at most
    alpha/(1-beta) and beta/(1-alpha); overshoot makes them smaller. 5.2 standard errors: a false alarm in 1e7.
    """
    rng = np.random.default_rng(1)
    seen = rng.standard_normal((400, 20_000))
    life = Score(false_tracks=alpha, lost_targets=beta)
    ratio = 0.5
    false = decided(life, ratio * seen - ratio**2 / 2, 0.2).mean()
    lost = 1 - decided(life, ratio * seen + ratio**2 / 2, 0.2).mean()
    for rate, bound in ((false, alpha / (1 - beta)), (lost, beta / (1 - alpha))):
        assert rate < bound + 5.2 * np.sqrt(bound / 20_000)
        assert rate > 0.4 * bound


def test_the_score_does_not_depend_on_the_initial_odds():
    rng = np.random.default_rng(2)
    log_ratios = rng.normal(0.1, 1.0, (40, 300))
    one, other = (scored(Score(), log_ratios, initial) for initial in (0.01, 0.6))
    np.testing.assert_array_equal(one[0], other[0])
    np.testing.assert_array_equal(one[1], other[1])


def test_a_confirmed_track_ends_once_its_score_has_dropped():
    """Up by 8, then down by 1.5 a scan: it lives while it is less than 5 below its best."""
    life = Score(drop=5.0)
    confirmed, alive = scored(life, np.array([[8.0]] + [[-1.5]] * 5))
    assert confirmed.all()
    assert alive[:, 0].tolist() == [True, True, True, True, False, False]


def test_even_a_sure_track_can_end():
    confirmed, alive = scored(Score(drop=5.0), np.array([[50.0]] * 10 + [[-2.0]] * 4))
    assert confirmed.all()
    assert alive[:, 0].tolist() == [True] * 12 + [False] * 2


def coasting_by_hand(scans, hits, tentative, confirmed):
    """(confirmed, alive) after each scan, the birth being the first hit."""
    count, due, sure = 1, 0.0, hits == 1
    for hit, expected in scans:
        count, due = (count + 1, 0.0) if hit else (count, due + expected)
        sure = sure or count >= hits
        yield sure, due <= (confirmed if sure else tentative)


@settings(max_examples=200)
@given(
    st.lists(st.tuples(st.booleans(), st.sampled_from([0.0, 0.25, 0.5, 1.0])), max_size=25),
    st.integers(1, 4),
    st.sampled_from([0.75, 2.0]),
    st.sampled_from([1.0, 3.0]),
)
@pytest.mark.costly
def test_coasting_counts_what_was_due(scans, hits, tentative, confirmed):
    life = CoastLimited(hits=hits, tentative=tentative, confirmed=confirmed)
    memory = life.start(np.ones(1))
    rule = coasting_by_hand(scans, hits, tentative, confirmed)
    for (hit, expected), (sure, alive) in zip(scans, rule, strict=True):
        memory, is_sure, is_alive = life.review(
            memory, Review(1.0, np.ones(1), np.array([float(hit)]), np.array([expected]))
        )
        assert (is_sure[0], is_alive[0]) == (sure, alive)


def test_a_track_that_cannot_be_seen_coasts_on():
    life = CoastLimited(hits=1, confirmed=2.0)
    memory = life.start(np.ones(2))
    for _ in range(50):
        memory, _, alive = life.review(memory, Review(1.0, np.ones(2), np.zeros(2), np.array([0.0, 0.9])))
    assert alive.tolist() == [True, False]
