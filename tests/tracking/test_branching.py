"""A tracker that keeps hypotheses: each leaf is what its filter makes of the leaf's own returns, whatever the filter."""

import numpy as np
import pytest

import vedette
from support.leaves import FILTERS, KINDS, MOTION, RADAR, composed, path_to, scans, states_of
from vedette import Detections, Gaussian, Mixtures, Scan
from vedette.filters import merged
from vedette.sampling.seeds import NO_DRAWS, NotInLockStep
from vedette.tracking import take


@pytest.mark.parametrize("kind", ["k_best", "n_scan", "lmb"])
@pytest.mark.parametrize("name", FILTERS)
def test_a_leaf_is_what_the_filter_makes_of_its_own_returns(name, kind):
    """Each leaf at the end is followed back to where it began, and its returns are given to the filter alone."""
    estimator, sensor = FILTERS[name]
    tracker, given = composed(kind, estimator, sensor), scans(sensor)
    states, filter_, radar = states_of(tracker, given), tracker.estimator, tracker.sensors["radar"]
    leaves = states[-1].leaves
    estimates = filter_.moments(leaves.belief)
    assert len(leaves.ids) > 3
    for leaf in range(len(leaves.ids)):
        path = path_to(states, leaf)
        begun = len(states) - len(path)
        belief = take(states[begun].leaves.belief, np.array(path[:1]), 0)
        for i, row in enumerate(path[1:], begun + 1):
            belief = filter_.predict(belief, states[i].time - states[i - 1].time, NO_DRAWS)
            choice = int(states[i].leaves.choice[row])
            seen = Detections.of(given[i - 1].detections.z[choice - 1 : choice] if choice else [], 2)
            innovation = filter_.evaluate(belief, radar, seen, tracker.gate.probability)
            belief = filter_.update(belief, innovation, np.array([[0.0, 1.0]]) if choice else np.ones((1, 1)))
        alone = filter_.moments(belief)
        np.testing.assert_allclose(estimates.mean[leaf], alone.mean[0], rtol=1e-9, atol=1e-9)
        np.testing.assert_allclose(estimates.cov[leaf], alone.cov[0], rtol=1e-9, atol=1e-9)


@pytest.mark.parametrize("kind", KINDS)
def test_what_is_reported_is_one_leaf_a_track(kind):
    tracker = composed(kind)
    born = 0
    for state in states_of(tracker, scans(RADAR, 12))[1:]:
        assert len(np.unique(state.ids)) == len(state.ids)
        assert np.all(np.diff(state.ids) > 0)
        assert state.born >= born
        assert np.all(state.ids < state.born)
        assert np.all((state.existence >= 0) & (state.existence <= 1))
        np.testing.assert_allclose(state.weights.sum(axis=-1), 1.0)
        assert state.distances.shape == (len(state.ids), state.weights.shape[-1] - 1)
        assert tracker.estimate(state).mean.shape == (len(state.ids), 4)
        born = state.born
    confirmed = state.ids[state.confirmed]
    assert len(confirmed) == 2


@pytest.mark.parametrize("kind", KINDS)
def test_a_step_taken_twice_is_the_same(kind):
    tracker, given = composed(kind), scans(RADAR, 6)
    first, second = states_of(tracker, given)[-1], states_of(tracker, given)[-1]
    np.testing.assert_array_equal(first.ids, second.ids)
    np.testing.assert_array_equal(tracker.estimate(first).mean, tracker.estimate(second).mean)
    np.testing.assert_array_equal(first.existence, second.existence)


@pytest.mark.parametrize("kind", KINDS)
def test_quiet_scans_and_given_tracks(kind):
    tracker = composed(kind)
    state = tracker.start(Gaussian(np.array([[50.0, 60.0, 0.0, 0.0]]), np.eye(4)[None]))
    expected, missed = 1.0, 1.0 - 0.9 * 0.99
    for time in range(4):
        state = tracker.step(state, Scan(float(time), "radar", Detections.of([], 2)))
        expected *= np.exp(-1.0 / 200.0) if time else 1.0
        expected *= missed / (1.0 - expected + expected * missed)
        np.testing.assert_allclose(state.existence, [expected])
    assert state.ids.tolist() == [0]


def test_the_mean_of_the_hypotheses_can_be_shown():
    """Where one hypothesis is left it is that one; else the same tracks and more."""
    given = scans(RADAR, 6)
    heaviest, mean = composed("k_best"), composed({"kind": "k_best", "show": "mean"})
    one, other = states_of(heaviest, given)[-1], states_of(mean, given)[-1]
    np.testing.assert_array_equal(one.leaves.ids, other.leaves.ids)
    assert set(one.ids.tolist()) <= set(other.ids.tolist())
    single = [composed({"kind": "k_best", "hypotheses": 1, "show": show}) for show in ("heaviest", "mean")]
    one, other = (states_of(tracker, given)[-1] for tracker in single)
    np.testing.assert_array_equal(one.ids, other.ids)
    np.testing.assert_allclose(single[0].estimate(one).mean, single[1].estimate(other).mean, rtol=1e-12)


@pytest.mark.parametrize("associator", [{"kind": "variational"}, {"kind": "k_best", "show": "mean"}], ids=str)
@pytest.mark.by_turns
def test_merging_mode_by_mode_changes_nothing_where_modes_are_alike(associator):
    """An IMM of one filter twice is that filter, merged or not; one of two filters is not."""
    mode, given = FILTERS["kalman"][0], scans(RADAR)
    one = composed(associator)
    twice = composed(associator, {"kind": "imm", "modes": [mode, mode], "transition": [[0.9, 0.1], [0.1, 0.9]]})
    other = composed(associator, FILTERS["imm"][0])
    merged = 0
    for a, b in zip(states_of(one, given), states_of(twice, given), strict=True):
        np.testing.assert_array_equal(a.ids, b.ids)
        np.testing.assert_allclose(a.existence, b.existence, rtol=1e-9, atol=1e-12)
        np.testing.assert_allclose(one.estimate(a).mean, twice.estimate(b).mean, rtol=1e-7, atol=1e-9)
        np.testing.assert_allclose(one.estimate(a).cov, twice.estimate(b).cov, rtol=1e-6, atol=1e-9)
        merged += len(a.ids)
    assert merged > 10
    modes = other.estimator.mode_prob(states_of(other, given)[-1].belief)
    np.testing.assert_allclose(modes.sum(axis=-1), 1.0)
    assert np.ptp(modes[:, 0]) > 0.0


def test_merged_modes_keep_the_moments_of_the_mixture():
    tracker = composed("k_best", FILTERS["imm"][0])
    leaves, filter_ = states_of(tracker, scans(RADAR))[-1].leaves, tracker.estimator
    count = len(leaves.ids)
    into, parts = np.repeat([0, 1], count), np.tile(np.arange(count), 2)
    shares = np.random.default_rng(1).dirichlet(np.ones(count), 2)
    mixtures = Mixtures(into, parts, shares.ravel(), 2)
    found = filter_.moments(filter_.merge(leaves.belief, mixtures))
    expected = merged(filter_.moments(leaves.belief), mixtures, tracker.state)
    np.testing.assert_allclose(found.mean, expected.mean, rtol=1e-10)
    np.testing.assert_allclose(found.cov, expected.cov, rtol=1e-8)


@pytest.mark.parametrize(
    ("parts", "said"),
    [
        ({"lifecycle": {"kind": "m_of_n"}}, "lifecycle: must keep existence probabilities"),
        (
            {"estimator": {"kind": "ensemble_kalman", "motion": MOTION}, "associator": "variational"},
            "estimator: must merge beliefs",
        ),
    ],
)
def test_parts_that_do_not_go_together_are_refused(parts, said):
    with pytest.raises(vedette.ConfigError, match=said):
        composed(**{"associator": "k_best"} | parts)


def test_runs_of_a_study_go_one_by_one():
    with pytest.raises(NotInLockStep, match="'k_best' keeps hypotheses"):
        composed("k_best").start(Gaussian(np.zeros((3, 1, 4)), np.tile(np.eye(4), (3, 1, 1, 1))))
