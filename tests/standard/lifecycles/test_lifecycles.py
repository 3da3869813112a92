"""Lifecycles against what their sentences say, counted by hand over random histories."""

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from vedette import Gaussian, Recording, Space, Trajectory
from vedette_standard.lifecycles.existence import Existence
from vedette_standard.lifecycles.m_of_n import MOfN
from vedette_standard.lifecycles.single_target import SingleTarget

STATE = Space.of(x="m", y="m", vx="m/s", vy="m/s")
PLACE = Space.of(x="m", y="m")


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


@settings(max_examples=300, deadline=None)
@given(
    st.lists(st.booleans(), max_size=30),
    st.integers(1, 5).flatmap(lambda m: st.tuples(st.just(m), st.integers(m, 8))),
    st.integers(1, 6),
)
def test_m_of_n_counts_hits_in_its_last_looks(seen, rule, misses):
    life = MOfN(spread={}, hits=rule[0], looks=rule[1], misses=misses)
    memory, existence = life.newborn(1)
    for hit, (confirmed, alive) in zip(seen, m_of_n_by_hand(seen, *rule, misses), strict=False):
        memory, is_confirmed, is_alive = life.review(memory, existence, np.array([float(hit)]), np.array([0.9]))
        assert (is_confirmed[0], is_alive[0]) == (confirmed, alive)


def test_m_of_n_does_not_count_scans_that_cannot_see_the_track():
    life = MOfN(spread={}, hits=2, looks=3, misses=2)
    memory, existence = life.newborn(1)
    for _ in range(20):
        memory, _, alive = life.review(memory, existence, np.zeros(1), np.array([0.05]))
        assert alive[0]
    assert memory.looks[0] == 1


def test_existence_follows_the_lifetime_and_the_thresholds():
    life = Existence(initial=0.3, lifetime=100.0, confirm=0.9, delete=0.1)
    assert life.survive(np.array([0.8]), 50.0)[0] == pytest.approx(0.8 * np.exp(-0.5))
    memory, _ = life.newborn(3)
    memory, confirmed, alive = life.review(memory, np.array([0.95, 0.5, 0.05]), np.ones(3), np.ones(3))
    assert confirmed.tolist() == [True, False, False]
    assert alive.tolist() == [True, True, False]
    _, confirmed, _ = life.review(memory, np.array([0.5, 0.5, 0.5]), np.ones(3), np.ones(3))
    assert confirmed.tolist() == [True, False, False], "once confirmed, a track stays so"


def test_new_tracks_start_at_their_return_with_the_stated_spread():
    life = MOfN(spread={"vx": 4.0, "vy": 5.0})
    seen = Gaussian(np.array([[3.0, 7.0]]), np.array([[[2.0, 0.5], [0.5, 1.0]]]))
    prior = life.prior(seen, PLACE, STATE)
    assert prior.mean.tolist() == [[3.0, 7.0, 0.0, 0.0]]
    expected = np.diag([0.0, 0.0, 16.0, 25.0])
    expected[:2, :2] = seen.cov[0]
    np.testing.assert_array_equal(prior.cov[0], expected)
    with pytest.raises(ValueError, match=r"spread: must state the standard deviation of 'vy'"):
        MOfN(spread={"vx": 4.0}).prior(seen, PLACE, STATE)


@pytest.mark.parametrize(("sensors", "may"), [((), True), (("radar",), True), (("lidar",), False)])
def test_only_the_named_sensors_start_tracks_where_nothing_claims(sensors, may):
    starts = MOfN(spread={}, sensors=sensors, claimed=0.4).starts("radar", np.array([0.1, 0.6]))
    assert starts.tolist() == [may, False]


def test_single_target_starts_where_it_is_told_or_at_the_truth():
    truth = Trajectory("boat", STATE, np.array([0.0, 10.0]), np.array([[0.0, 0, 1, 2], [10.0, 20, 1, 2]]))
    recording = Recording((), (truth,))
    life = SingleTarget(spread={"x": 3, "y": 3, "vx": 1, "vy": 1}, offset={"x": 10.0})
    prior = life.given(STATE, recording)
    assert prior.mean.tolist() == [[10.0, 0.0, 1.0, 2.0]]
    assert np.diag(prior.cov[0]).tolist() == [9.0, 9.0, 1.0, 1.0]
    told = SingleTarget(start={"x": [5, 1], "y": [6, 2], "vx": [0, 3], "vy": [0, 3]}).given(STATE, Recording(()))
    assert told.mean.tolist() == [[5.0, 6.0, 0.0, 0.0]]
    with pytest.raises(
        ValueError, match=r"lifecycle\.start: must state 'x', 'y', 'vx', 'vy', as the recording has no truth"
    ):
        life.given(STATE, Recording(()))
    with pytest.raises(ValueError, match=r"lifecycle\.spread: must state the standard deviation of 'vy'"):
        SingleTarget(spread={"x": 3, "y": 3, "vx": 1}).given(STATE, recording)


@pytest.mark.parametrize(
    ("wrong", "message"),
    [
        (lambda: MOfN(hits=4, looks=3), r"hits: must be <= looks, 3, got 4"),
        (lambda: Existence(initial=0.01, delete=0.05), r"initial: must be > delete, 0.05, got 0.01"),
        (lambda: Existence(initial=0.6, delete=0.5, confirm=0.4), r"confirm: must be > delete"),
        (lambda: SingleTarget(start={"x": [0, -1]}), r"start: x: the standard deviation must be >= 0, got -1"),
    ],
)
def test_rules_that_contradict_themselves_are_refused(wrong, message):
    with pytest.raises(ValueError, match=message):
        wrong()
