"""Events in which two tracks give one return: against their definition, one by one, and against the joint Gaussian."""

from itertools import product

import attrs
import numpy as np
import pytest

import vedette
from support import two_boats
from vedette import Detections, Gaussian, Scan, kernels
from vedette.tracking.meeting import meet
from vedette_standard.unresolved.close import Close, close_rows
from vedette_standard.unresolved.events import Events, of_pairs


def by_definition(scores, pairs, joint, apart):
    """The weights of single and of merged returns, from all assignments of options to tracks."""
    t, k = scores.shape[0], scores.shape[1] - 1
    partners = {(i, j): p for p, (i, j) in enumerate(pairs)}
    options = [[("alone", n) for n in range(k + 1)] + [(p, n) for p in range(len(pairs)) for n in range(1, k + 1)]] * t
    single, merged, total = np.zeros(scores.shape), np.zeros(joint.shape), 0.0
    for event in product(*options):
        weight, used = 0.0, []
        for i, (how, n) in enumerate(event):
            if how == "alone":
                weight += scores[i, n]
                used += [n] if n else []
            else:
                members = pairs[how]
                other = members[1] if members[0] == i else members[0]
                if i not in members or event[other] != (how, n):
                    weight = -np.inf
                    break
                if i == members[0]:
                    weight += joint[how, n - 1]
                    used.append(n)
        if weight == -np.inf or len(set(used)) < len(used):
            continue
        for (i, j), p in partners.items():
            (a, n), (b, o) = event[i], event[j]
            if n and o and n != o:
                weight += apart[p, n - 1, o - 1]
            assert a is not None
            assert b is not None
        share = np.exp(weight)
        total += share
        for i, (how, n) in enumerate(event):
            if how == "alone":
                single[i, n] += share
            elif i == pairs[how][0]:
                merged[how, n - 1] += share
    return single / total, merged / total


def case(seed, t=3, k=3):
    rng = np.random.default_rng(seed)
    scores = rng.normal(0, 2, (t, 1 + k))
    scores[:, 1:][rng.random((t, k)) < 0.2] = -np.inf
    pairs = np.array([(0, 1), (1, 2)])
    joint = rng.normal(0, 2, (2, k))
    joint[rng.random((2, k)) < 0.2] = -np.inf
    return scores, pairs, joint, np.log(rng.random((2, k, k)))


@pytest.mark.parametrize("seed", range(6))
def test_weights_are_sums_over_all_events(seed):
    drawn = case(seed)
    single, merged = Events.of(*drawn).marginals(drawn[0].shape, drawn[2].shape)
    wanted = by_definition(drawn[0], drawn[1].tolist(), *drawn[2:])
    np.testing.assert_allclose(single, wanted[0], atol=2e-6)
    np.testing.assert_allclose(merged, wanted[1], atol=2e-6)


@pytest.mark.parametrize("seed", range(3))
def test_events_of_pairs_at_once_are_those_of_each(seed):
    scores, _, joint, apart = case(seed, t=2)
    weight = of_pairs(scores[None, :, 0], scores[None, :, 1:], joint[:1], apart[:1])[0]
    share = np.exp(weight - kernels.log_sum(weight))
    single, merged = by_definition(scores, [(0, 1)], joint[:1], apart[:1])
    table = share[:16].reshape(4, 4)
    np.testing.assert_allclose([table.sum(axis=1), table.sum(axis=0)], single, atol=1e-12)
    np.testing.assert_allclose(share[16:], merged[0], atol=1e-12)


def test_without_pairs_they_are_those_of_jpda():
    scores = case(1)[0]
    single, _ = Events.of(scores, np.zeros((0, 2), dtype=int), np.zeros((0, 3)), np.zeros((0, 3, 3))).marginals(
        (3, 4), (0, 3)
    )
    np.testing.assert_allclose(single, kernels.joint_weights(scores, 14).weights, atol=2e-6)


@pytest.mark.parametrize("wrong", ["shared twice", "apart forgotten"])
def test_a_wrong_sum_is_found(wrong):
    scores, pairs, joint, apart = case(2)
    broken = Events.of(scores, pairs, joint + (np.log(2) if wrong == "shared twice" else 0.0), 0.0 * apart)
    single, _ = broken.marginals(scores.shape, joint.shape)
    assert np.max(np.abs(single - by_definition(scores, pairs.tolist(), joint, apart)[0])) > 1e-3


def boats(cells=(20.0, 15.0), apart=8.0, more=()):
    """A tracker of two given targets 8 m apart with a coarse sensor, and what it expects of one return between them."""
    plain = {"kind": "cartesian_position", "sigma": 4.0, "detection_probability": 0.9, "clutter_density": 1e-5}
    tracker = vedette.build(
        {
            "estimator": {"kind": "kalman", "motion": {"kind": "constant_velocity", "sigma_accel": 0.1}},
            "sensors": {"radar": {"kind": "coarse", "cells": {"x": cells[0], "y": cells[1]}, "of": plain}},
            "associator": {"kind": "jpda"},
            "gate": {"probability": 0.9999},
            "lifecycle": {"kind": "single_target"},
        }
    )
    mean = np.array([[0.0, 0, 2, 0], [0, apart, 2, 0]])
    cov = np.stack([np.diag([30.0, 20, 4, 4]), np.diag([10.0, 40, 4, 4])])
    cov[0, 0, 2] = cov[0, 2, 0] = 5.0
    state = tracker.start(Gaussian(mean, cov), 0.0)
    scan = Scan(0.0, "radar", Detections.of([[3.0, 5.0], *more]))
    return tracker, state, scan


def joint_posterior(tracker, state, z):
    """The two targets given that they merged and gave z, as one Gaussian (8,); and the log of the likelihood."""
    prior, sensor = tracker.estimate(state), tracker.sensors["radar"]
    mean, cov = prior.mean.ravel(), np.zeros((8, 8))
    cov[:4, :4], cov[4:, 4:] = prior.cov
    C, R = sensor.unresolved(np.zeros(2)), sensor.noise(np.zeros(2))
    log = 0.5 * np.linalg.slogdet(2 * np.pi * C)[1]
    I, O = np.eye(2), np.zeros((2, 2))  # noqa: E741
    for H, noise, seen in ((np.hstack([I, O, -I, O]), C, np.zeros(2)), (0.5 * np.hstack([I, O, I, O]), R, z)):
        S = H @ cov @ H.T + noise
        gain, nu = cov @ H.T @ np.linalg.inv(S), seen - H @ mean
        log -= 0.5 * (nu @ np.linalg.solve(S, nu) + np.linalg.slogdet(2 * np.pi * S)[1])
        mean, cov = mean + gain @ nu, cov - gain @ S @ gain.T
    return mean, cov, log


def test_a_return_for_both_updates_each_as_the_joint_gaussian_does():
    tracker, state, scan = boats()
    expected = tracker.expect(state, scan)
    (part,) = meet(expected)[2]
    weights = np.zeros((2, 1, 3))
    weights[..., 2] = 1.0
    after = tracker.estimator.update(part.belief, part.innovation, weights)
    mean, cov, log = joint_posterior(tracker, state, scan.detections.z[0])
    np.testing.assert_allclose(after.mean[:, 0].ravel(), mean, atol=1e-9)
    np.testing.assert_allclose(after.cov[0, 0], cov[:4, :4], atol=1e-9)
    np.testing.assert_allclose(after.cov[1, 0], cov[4:, 4:], atol=1e-9)
    close: Close = part.close
    np.testing.assert_allclose(close.scores, log + 2 * np.log(0.9) - np.log(1e-5))


def test_rows_far_apart_are_met_as_ever():
    tracker, state, scan = boats(apart=400.0)
    expected = tracker.expect(state, scan)
    assert close_rows(expected, scan.detections, np.full(1, np.log(1e-5))) is None
    plain = attrs.evolve(tracker, sensors={"radar": tracker.sensors["radar"].of})
    np.testing.assert_array_equal(tracker.step(state, scan).weights, plain.step(state, scan).weights)


def test_a_single_return_between_two_targets_is_both_ones():
    tracker, state, scan = boats(cells=(200.0, 200.0))
    after = tracker.step(state, scan)
    assert np.all(after.hit > 0.8)
    plain = attrs.evolve(tracker, sensors={"radar": tracker.sensors["radar"].of})
    assert np.sum(plain.step(state, scan).hit) <= 1.0


def test_two_returns_are_one_of_each_where_the_sensor_resolves():
    tracker, state, scan = boats(cells=(1.0, 1.0), apart=8.0, more=[[0.0, 8.0]])
    after = tracker.step(state, scan)
    plain = attrs.evolve(tracker, sensors={"radar": tracker.sensors["radar"].of})
    np.testing.assert_allclose(after.hit, plain.step(state, scan).hit, atol=0.05)


@pytest.mark.nightly("eighty runs: 20 s")
def test_two_boats_that_merge_half_of_the_time():
    """The issue's scene: covered .9 of the time, within 4 m of 12 m apart where resolved, ids kept in .8 of the runs."""
    told = [two_boats.run("jpda", coarse=True, seed=seed) for seed in range(40)]
    plain = [two_boats.run("jpda", coarse=False, seed=seed) for seed in range(40)]
    assert np.mean([run.covered for run in told]) > 0.9
    assert abs(np.nanmean([run.separation for run in told]) - two_boats.APART) < 4.0
    assert np.mean([run.ids for run in told]) >= 0.8
    assert np.mean([run.ids for run in plain]) < 0.5
