"""What later scans say of earlier ones where hypotheses are kept: along the history that is best in the end."""

import math

import numpy as np
import pytest
from attrs import evolve

from support.leaves import FILTERS, KINDS, composed, path_to, scans, states_of
from vedette import Detections, smooth, smoothed
from vedette.sampling.seeds import NO_DRAWS
from vedette.tracking import retelling, take
from vedette.tracking.smoothing import check_smoothing
from vedette.tracking.state import next_state


@pytest.mark.parametrize("kind", ["k_best", "n_scan", "lmb"])
@pytest.mark.parametrize("name", ["kalman", "ekf"])
def test_a_track_is_smoothed_along_the_returns_that_it_took_in_the_end(name, kind):
    """Each leaf that is shown at the end is followed back, and the filter alone is given its returns and smoothed."""
    tracker, given = composed(kind, FILTERS[name][0], FILTERS[name][1]), scans(FILTERS[name][1], 10)
    states, filter_, radar = states_of(tracker, given)[1:], tracker.estimator, tracker.sensors["radar"]
    told, compared = list(smoothed(tracker, states)), 0
    for number, leaf in zip(states[-1].ids.tolist(), states[-1].leaves.shown.tolist(), strict=True):
        path = path_to([tracker.start(), *states], leaf)
        begun = len(states) - len(path)
        beliefs = [take(states[begun].leaves.belief, np.array(path[:1]), 0)]
        for i, row in enumerate(path[1:], begun + 1):
            ahead = filter_.predict(beliefs[-1], states[i].time - states[i - 1].time, NO_DRAWS)
            choice = int(states[i].leaves.choice[row])
            seen = Detections.of(given[i].detections.z[choice - 1 : choice] if choice else [], 2)
            innovation = filter_.evaluate(ahead, radar, seen, tracker.gate.probability)
            beliefs.append(filter_.update(ahead, innovation, np.array([[0.0, 1.0]]) if choice else np.ones((1, 1))))
        back = beliefs[-1]
        for i in range(len(states) - 1, begun - 1, -1):
            if i < len(states) - 1:
                back = filter_.smooth_step(beliefs[i - begun], back, states[i + 1].time - states[i].time, NO_DRAWS)
            row = told[i].ids.tolist().index(number)
            assert told[i].hit[row] == (states[i].leaves.choice[path[i - begun]] > 0)
            found, alone = take(tracker.estimate(told[i]), np.array([row]), 0), filter_.moments(back)
            np.testing.assert_allclose(found.mean, alone.mean, rtol=1e-7, atol=1e-7)
            np.testing.assert_allclose(found.cov, alone.cov, rtol=1e-6, atol=1e-8)
        compared += len(path)
    assert compared >= 4


@pytest.mark.parametrize("name", ["kalman", "ekf"])
def test_later_scans_choose_the_same_past_whatever_is_shown(name):
    """A mean over hypotheses has no past: with the ids' own existence, four tracks stood for three targets."""
    heaviest, given = composed("k_best", FILTERS[name][0], FILTERS[name][1]), scans(FILTERS[name][1], 12)
    mean = evolve(heaviest, associator=evolve(heaviest.associator, show="mean"))
    told = [list(smoothed(tracker, states_of(tracker, given)[1:])) for tracker in (heaviest, mean)]
    for one, other in zip(told[0][:-1], told[1][:-1], strict=True):
        assert one.ids.tolist() == other.ids.tolist()
        assert one.confirmed.tolist() == other.confirmed.tolist()
        np.testing.assert_array_equal(one.existence, other.existence)
        np.testing.assert_array_equal(heaviest.estimate(one).mean, mean.estimate(other).mean)
    assert not np.array_equal(heaviest.estimate(told[0][-1]).mean, mean.estimate(told[1][-1]).mean)


def test_tracks_matched_by_their_ids_alone_are_smoothed_along_another_history(monkeypatch):
    """A mutant: the leaf that was shown in each scan instead of the one that led to the end."""
    right = retelling._before

    def mutant(tracker, associator, state, later, after, left, rng):
        leaves, parent = state.leaves, later.leaves.parent.copy()
        for row in after.rows[parent[after.rows] >= 0].tolist():
            same = leaves.shown[leaves.ids[leaves.shown] == later.leaves.ids[row]]
            parent[row] = same[0] if len(same) else parent[row]
        changed = next_state(later, leaves=evolve(later.leaves, parent=parent))
        return right(tracker, associator, state, changed, after, left, rng)

    monkeypatch.setattr(retelling, "_before", mutant)
    with pytest.raises(AssertionError):
        test_a_track_is_smoothed_along_the_returns_that_it_took_in_the_end("kalman", "lmb")


@pytest.mark.parametrize("kind", KINDS)
def test_a_lag_of_nothing_changes_nothing_and_one_beyond_the_end_is_all(kind):
    tracker = composed(kind)
    states = states_of(tracker, scans(FILTERS["kalman"][1], 10))[1:]
    for state, same in zip(states, smoothed(tracker, states, 0.0), strict=True):
        np.testing.assert_array_equal(state.ids, same.ids)
        np.testing.assert_array_equal(tracker.estimate(state).mean, tracker.estimate(same).mean)
        np.testing.assert_array_equal(state.links, same.links)
    for one, other in zip(smoothed(tracker, states), smoothed(tracker, states, 100.0), strict=True):
        np.testing.assert_array_equal(tracker.estimate(one).mean, tracker.estimate(other).mean)


@pytest.mark.parametrize("kind", KINDS)
def test_what_a_lag_tells_is_what_the_last_scan_within_it_would(kind):
    tracker = composed(kind)
    states = states_of(tracker, scans(FILTERS["kalman"][1], 10))[1:]
    told = list(smoothed(tracker, states, 3.0))
    for i in range(len(states) - 3):
        alone = list(smoothed(tracker, states[: i + 4]))[i]
        np.testing.assert_array_equal(told[i].ids, alone.ids)
        np.testing.assert_array_equal(tracker.estimate(told[i]).mean, tracker.estimate(alone).mean)
        np.testing.assert_array_equal(told[i].links, alone.links)


@pytest.mark.parametrize("kind", KINDS)
def test_scans_in_which_there_was_no_track_yet_stay_without_one(kind):
    tracker, seen = composed(kind), scans(FILTERS["kalman"][1], 8)
    given = [evolve(scan, detections=Detections.of([], 2)) for scan in seen[:2]] + seen[2:]
    told = list(smoothed(tracker, states_of(tracker, given)[1:]))
    assert [len(state.ids) > 0 for state in told] == [False] * 2 + [True] * 6


@pytest.mark.parametrize("kind", KINDS)
def test_what_is_told_keeps_the_laws_of_a_state(kind):
    tracker = composed(kind)
    states = states_of(tracker, scans(FILTERS["kalman"][1], 12))[1:]
    seen = 0
    for state in smoothed(tracker, states):
        assert np.all(np.diff(state.ids) > 0)
        assert np.all((state.existence >= 0) & (state.existence <= 1))
        took = state.returns[:, 0] if state.returns is not None else np.argmax(state.weights, axis=-1) - 1
        took = took[took >= 0]
        assert len(np.unique(took)) == len(took) or kind in ("lmb", "variational")
        np.testing.assert_allclose(state.weights.sum(axis=-1), 1.0)
        known = state.links[~np.isnan(state.links)]
        assert np.all((known >= 0) & (known <= 1))
        assert np.all(np.isnan(state.links[state.hit == 0]))
        seen += len(known)
    assert seen > 15


def test_a_link_is_as_probable_as_the_leaves_that_hold_it():
    """Each leaf's returns are followed back by hand, not by what the state keeps of them."""
    tracker = composed("k_best")
    states = states_of(tracker, scans(FILTERS["kalman"][1], 6))
    leaves = states[-1].leaves
    probability, pairs = tracker.associator.probability(leaves.hypotheses), []
    if leaves.lost is not None:
        probability = probability * (1.0 - tracker.associator.unlikelier * leaves.lost)
    for leaf in range(len(leaves.ids)):
        path = path_to(states, leaf)
        took = [(i, int(states[i].leaves.choice[row])) for i, row in enumerate(path, len(states) - len(path))]
        took = [one for one in took if one[1]]
        pairs.append(tuple(took[-2:]) if leaves.choice[leaf] and len(took) > 1 else None)
    asked = 0
    for row, link in zip(leaves.shown.tolist(), leaves.links.tolist(), strict=True):
        if pairs[row] is None:
            assert math.isnan(link)
            continue
        same = [i for i, pair in enumerate(pairs) if pair == pairs[row]]
        assert link == pytest.approx(float(np.sum(probability[same] * leaves.existence[same])), rel=1e-9)
        asked += 1
    assert asked >= 2


def test_later_scans_tell_of_targets_before_they_were_confirmed():
    tracker = composed("k_best")
    states = states_of(tracker, scans(FILTERS["kalman"][1], 10))[1:]
    told = list(smoothed(tracker, states))
    first = [sum(int(state.confirmed.sum()) for state in some[:2]) for some in (states, told)]
    assert first[1] > first[0]
    tracks = smooth(tracker, states)
    assert len(tracks) >= 2
    assert all(track.link is not None for track in tracks)


@pytest.mark.parametrize("kind", KINDS)
def test_trackers_that_keep_hypotheses_are_smoothed(kind):
    check_smoothing(composed(kind))
