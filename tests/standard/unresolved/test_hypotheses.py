"""Merged returns where hypotheses of many scans are kept: against the sum over all events, and the joint Gaussian."""

import attrs
import numpy as np
import pytest

import vedette
from support import two_boats
from vedette import Detections, Gaussian, Scan
from vedette.hypotheses import LeafScores
from vedette.tracking.association import associate
from vedette.tracking.meeting import meet
from vedette_standard.unresolved import growth
from vedette_standard.unresolved.events import Events

KINDS = ("k_best", "n_scan", "variational", "lmb")
MANY = {"k_best": {"hypotheses": 5000, "least": 0.0}, "n_scan": {"hypotheses": 5000, "least": 0.0}, "variational":
        {"hypotheses": 5000, "least": 0.0}, "lmb": {"least": 0.0, "leaves": 500}}  # fmt: skip
SEEN = [[3.0, 5.0], [-4.0, 1.0], [2.0, 11.0]]


def boats(kind, *, more=None, count=2):
    """A tracker of given targets 8 m apart whose sensor merges half of them, and its state."""
    plain = {"kind": "cartesian_position", "sigma": 4.0, "detection_probability": 0.9, "clutter_density": 1e-3}
    tracker = vedette.build(
        {
            "estimator": {"kind": "kalman", "motion": {"kind": "constant_velocity", "sigma_accel": 0.1}},
            "sensors": {"radar": {"kind": "coarse", "cells": {"x": 20.0, "y": 15.0}, "of": plain}},
            "associator": {"kind": kind, **(more or {})},
            "gate": {"probability": 0.9999},
            "lifecycle": {"kind": "single_target"},
        }
    )
    mean = np.array([[0.0, 8.0 * i, 2, 0] for i in range(count)])
    cov = np.stack([np.diag([30.0 - 5 * i, 20 + 10 * i, 4, 4]) for i in range(count)])
    return tracker, tracker.start(Gaussian(mean, cov), 0.0)


def shares(tracker, state, z):
    """The probability of what each track took, by its number: a return alone, a return with another, or nothing."""
    expected = tracker.expect(state, Scan(state.time, "radar", Detections.of(z, 2)))
    by, k = associate(expected, met := meet(expected)), len(z)
    if by.branched is None:
        part, weights, table = met[2][0], by.of_few[0][:, 0], np.zeros((len(state.ids), 1 + 2 * k))
        table[:, 0] = weights[:, 0]
        row, column = np.nonzero(part.returns >= 0)
        np.add.at(table, (row, 1 + part.returns[row, column] + k * (column >= part.close.alone)), weights[row, 1 + column])
        return table
    after = by.branched.branching
    probability = tracker.associator.probability(after.hypotheses)
    table = np.zeros((len(state.ids), 1 + 2 * k))
    ids = state.leaves.ids[after.parent]
    merged = np.zeros_like(after.choice) if after.merged is None else after.merged
    np.add.at(table, (ids, after.choice + k * (merged > 0)), probability)
    return table


@pytest.mark.parametrize("count", [2, 3])
@pytest.mark.parametrize("kind", KINDS)
def test_one_scan_is_the_sum_over_all_events(kind, count):
    tracker, state = boats(kind, more=MANY[kind], count=count)
    exact, given = boats("jpda", count=count)
    wanted = shares(exact, given, SEEN)
    assert np.max(wanted[:, 4:]) > 0.1
    np.testing.assert_allclose(shares(tracker, state, SEEN), wanted, atol=1e-4)


@pytest.mark.parametrize("kind", ["k_best", "n_scan"])
def test_pairs_that_share_nothing_are_the_product_of_their_events(kind):
    """Four targets of one hypothesis, two here and two there: the events of both are drawn apart."""
    tracker, state = boats(kind, more=MANY[kind], count=4)
    exact, given = boats("jpda", count=4)
    mean = tracker.estimate(state).mean + np.array([[0.0, 400.0 * (i > 1), 0.0, 0.0] for i in range(4)])
    prior = Gaussian(mean, tracker.estimate(state).cov)
    state, given = tracker.start(prior, 0.0), exact.start(prior, 0.0)
    alone = state.leaves.hypotheses
    one = attrs.evolve(alone, cluster=np.zeros(1, dtype=int), weights=np.ones(1), starts=np.array([0, 4]))
    state = attrs.evolve(state, leaves=attrs.evolve(state.leaves, hypotheses=one))
    seen = [[3.0, 5.0], [-4.0, 1.0], [2.0, 420.0]]
    wanted = shares(exact, given, seen)
    assert np.min(np.max(wanted[:, 4:], axis=1)) > 0.05
    np.testing.assert_allclose(shares(tracker, state, seen), wanted, atol=1e-4)


def of_histories(tracker, state, z):
    """The probability of each hypothesis before a scan given it, as the associator has it and by its own events."""
    expected = tracker.expect(state, Scan(state.time, "radar", Detections.of(z, 2)))
    by, k = associate(expected, met := meet(expected)), len(z)
    part, before, after = met[2][0], state.leaves.hypotheses, by.branched.branching
    found, log = {}, []
    for h, weight in enumerate(after.hypotheses.weights.tolist()):
        rows = after.hypotheses.leaves[after.hypotheses.starts[h] : after.hypotheses.starts[h + 1]]
        key = tuple(sorted(after.parent[rows].tolist()))
        found[key] = found.get(key, 0.0) + weight
    histories = [tuple(before.leaves[i:j].tolist()) for i, j in zip(before.starts, before.starts[1:], strict=False)]
    for own, weight in zip(histories, before.weights.tolist(), strict=True):
        scores = part.scores[np.searchsorted(part.rows, own), 0, : 1 + k]
        pairs = np.flatnonzero(np.all(np.isin(part.close.pairs, own), axis=1))
        members, joint = np.searchsorted(own, part.close.pairs[pairs]), part.close.joint(pairs[:, None], np.arange(k))
        events = Events.of(scores, members, joint, part.close.apart(pairs, np.arange(k)))
        log.append(np.log(weight) + np.log(np.sum(np.exp(events.weight))))
    wanted = np.exp(np.array(log) - np.max(log))
    return np.array([found.get(own, 0.0) for own in histories]), wanted / np.sum(wanted)


def test_a_return_that_neither_gives_alone_is_still_one_of_both():
    tracker, state = boats("k_best", more=MANY["k_best"])
    part = meet(tracker.expect(state, Scan(0.0, "radar", Detections.of(SEEN[:1], 2))))[2][0]
    scores = LeafScores.of(np.array([[-2.0, -np.inf], [-1.0, -np.inf]]))
    after = growth.grown_close(state.leaves.hypotheses, scores, np.zeros(1, dtype=bool), part.close, 100, 0.0)
    both, none = np.exp(part.close.scores[0]), np.exp(-3.0)
    np.testing.assert_allclose(after.hypotheses.probability[after.merged > 0], both / (both + none), atol=1e-9)


def second_scan():
    tracker, state = boats("k_best", more=MANY["k_best"])
    return tracker, tracker.step(state, Scan(0.0, "radar", Detections.of(SEEN[:2], 2))), [[2.0, 3.0], [0.0, 9.0]]


def test_a_second_scan_weighs_the_histories_by_all_their_events():
    found, wanted = of_histories(*second_scan())
    assert len(wanted) > 5
    np.testing.assert_allclose(found, wanted, atol=1e-4)


def test_events_that_forget_what_their_history_scores_are_found(monkeypatch):
    """The mutant of the test above."""
    own = growth._scores_of
    monkeypatch.setattr(growth, "_scores_of", lambda every, takes, score, scores: own(every, takes, 0.0 * score, scores))
    found, wanted = of_histories(*second_scan())
    assert np.max(np.abs(found - wanted)) > 0.01


@pytest.mark.parametrize("kind", ["k_best", "n_scan"])
def test_leaves_that_merged_are_updated_as_the_joint_gaussian(kind):
    tracker, state = boats(kind)
    z = np.array(SEEN[0])
    after = tracker.step(state, Scan(0.0, "radar", Detections.of([z])))
    prior, sensor = tracker.estimate(state), tracker.sensors["radar"]
    mean, cov = prior.mean.ravel(), np.zeros((8, 8))
    cov[:4, :4], cov[4:, 4:] = prior.cov
    I, O = np.eye(2), np.zeros((2, 2))  # noqa: E741
    nothing = np.zeros(2)
    pairs = (np.hstack([I, O, -I, O]), sensor.unresolved(nothing), nothing), (
        0.5 * np.hstack([I, O, I, O]), sensor.noise(nothing), z
    )  # fmt: skip
    for H, noise, seen in pairs:
        S = H @ cov @ H.T + noise
        gain = cov @ H.T @ np.linalg.inv(S)
        mean, cov = mean + gain @ (seen - H @ mean), cov - gain @ S @ gain.T
    leaves = after.leaves
    moments = tracker.estimator.moments(leaves.belief)
    number = np.arange(len(leaves.ids))
    for track in (0, 1):
        off = np.abs(moments.mean - mean[4 * track : 4 * track + 4]).max(axis=1)
        assert np.min(np.where(leaves.ids == track, off, np.inf)) < 1e-9
        at = number[np.argmin(np.where(leaves.ids == track, off, np.inf))]
        np.testing.assert_allclose(moments.cov[at], cov[4 * track : 4 * track + 4, 4 * track : 4 * track + 4], atol=1e-9)


@pytest.mark.parametrize("kind", KINDS)
@pytest.mark.costly
def test_hypotheses_stay_what_they_are_over_many_scans(kind):
    tracker, state = boats(kind, count=3)
    rng = np.random.default_rng(3)
    for n in range(12):
        centre = np.array([[2.0 * n, 8.0 * i] for i in range(3)])
        z = np.concatenate([centre[rng.random(3) < 0.6] + rng.normal(0, 3, 2), rng.uniform(-20, 40, (2, 2))])
        state = tracker.step(state, Scan(float(n + 1), "radar", Detections.of(z, 2)))
        hypotheses = state.leaves.hypotheses
        total = np.bincount(hypotheses.track, tracker.associator.probability(hypotheses))
        np.testing.assert_allclose(total, 1.0, atol=1e-9)
        assert np.all(np.linalg.eigvalsh(tracker.estimator.moments(state.leaves.belief).cov) > 0)
        if kind != "lmb":
            assert all(np.all(np.diff(part) > 0) for part in np.split(hypotheses.leaves, hypotheses.starts[1:-1]))


def test_tracks_far_apart_branch_as_ever():
    for kind in KINDS:
        tracker, _ = boats(kind)
        mean, cov = np.array([[0.0, 0, 2, 0], [0, 500, 2, 0]]), np.stack([np.diag([30.0, 20, 4, 4])] * 2)
        plain = attrs.evolve(tracker, sensors={"radar": tracker.sensors["radar"].of})
        scan = Scan(0.0, "radar", Detections.of([*SEEN, [1.0, 505.0]]))
        states = [one.step(one.start(Gaussian(mean, cov), 0.0), scan) for one in (tracker, plain)]
        np.testing.assert_array_equal(*(state.leaves.choice for state in states))
        np.testing.assert_array_equal(
            *(one.estimate(state).mean for one, state in zip((tracker, plain), states, strict=True))
        )


def test_the_best_events_are_all_events_if_there_are_no_more():
    wanted = shares(*boats("jpda"), SEEN)
    np.testing.assert_allclose(shares(*boats("m_best_jpda", more={"m": 5000}), SEEN), wanted, atol=1e-9)
    one = shares(*boats("m_best_jpda", more={"m": 1}), SEEN)
    np.testing.assert_allclose(np.sort(one, axis=1)[:, -1], 1.0)


@pytest.mark.parametrize("kind", ["pda", "gnn", "nearest", "jpda_star"])
def test_others_refuse_a_sensor_that_merges(kind):
    with pytest.raises(vedette.ConfigError) as refused:
        boats(kind)
    assert [problem.place for problem in refused.value.problems] == ["associator"]


@pytest.mark.nightly("forty runs of five kinds: 2 min")
@pytest.mark.parametrize("kind", ["k_best", "n_scan", "variational", "m_best_jpda", "lmb"])
def test_two_boats_that_merge_half_of_the_time(kind):
    """The issue's scene: covered .9 of the time, within 4 m of 12 m apart where resolved."""
    told = [two_boats.run(kind, coarse=True, seed=seed) for seed in range(40)]
    assert np.mean([run.covered for run in told]) > 0.9
    assert abs(np.nanmean([run.separation for run in told]) - two_boats.APART) < 4.0
