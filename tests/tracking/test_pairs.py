"""Pairs of track and return are a batch whose runs are tracks, and leaves are rows that are taken: the contract has both."""

from typing import Any

import attrs
import numpy as np
import pytest

import vedette
from vedette import Detections, Scan
from vedette.tracking import take

CV = {"kind": "constant_velocity", "sigma_accel": 0.5}
CT = {"kind": "coordinated_turn", "sigma_accel": 0.5, "sigma_turn_rate": 0.02}
ESTIMATORS = {
    "kalman": {"kind": "kalman", "motion": CV},
    "ekf": {"kind": "ekf", "motion": CT},
    "ukf": {"kind": "ukf", "motion": CT},
    "imm": {
        "kind": "imm",
        "modes": [{"kind": "ekf", "motion": CV}, {"kind": "ekf", "motion": CT}],
        "transition": [[0.9, 0.1], [0.2, 0.8]],
        "absent": {"turn_rate": [0.0, 0.02]},
    },
}
SENSORS = {
    "kalman": {"kind": "cartesian_position", "sigma": 5.0, "detection_probability": 0.9},
    "ekf": {"kind": "range_bearing", "sigma_range": 5.0, "sigma_bearing": 0.01, "detection_probability": 0.9},
}
P_GATE, T, K = 0.99, 4, 5


@pytest.fixture(params=ESTIMATORS)
def scene(request):
    """Four tracks that have met a scan, predicted, and five returns: of each track one that may be it, and one of none."""
    sensor = SENSORS.get(request.param, SENSORS["ekf"])
    tracker = vedette.build(
        {
            "estimator": ESTIMATORS[request.param],
            "sensors": {"radar": sensor},
            "associator": {"kind": "pda"},
            "birth": {"kind": "given"},
            "lifecycle": {"kind": "single_target"},
        }
    )
    rng, n = np.random.default_rng(5), len(tracker.state)
    mean = rng.normal(0.0, 1.0, (T, n)) * ([300.0, 300.0, 10.0, 10.0, 0.02][:n])
    prior = vedette.Gaussian(mean, np.broadcast_to(np.diag([400.0, 300.0, 20.0, 30.0, 1e-3][:n]), (T, n, n)).copy())
    radar = tracker.sensors["radar"]
    where = tracker.state.locate(radar.observes)

    def returns(at):
        near = radar.measure(at[:, where]) + rng.normal(0.0, 1.0, (T, 2)) * ([5.0, 5.0] if n == 4 else [5.0, 0.01])
        return radar.measurement.canonical(np.concatenate([near, near[:1] + near[1:2]]))

    state = tracker.step(tracker.start(prior, time=0.0), Scan(1.0, "radar", Detections.of(returns(mean))))
    belief = tracker.predict(state, 3.0)
    return tracker.estimator, belief, radar, Detections.of(returns(tracker.estimator.moments(belief).mean))


def assert_equal(one, other):
    """Compare trees of arrays to 1e-12, relative to the largest entry of each."""
    if isinstance(one, np.ndarray):
        assert one.shape == other.shape
        np.testing.assert_allclose(one, other, rtol=1e-12, atol=1e-12 * max(1.0, np.abs(other).max(initial=0.0)))
    elif one is not None:
        parts = one if isinstance(one, tuple) else attrs.astuple(one, recurse=False)
        others = other if isinstance(other, tuple) else attrs.astuple(other, recurse=False)
        for part, another in zip(parts, others, strict=True):
            assert_equal(part, another)


def pairs_of(belief, detections, tracks, returns):
    """Return the pairs (p,) as runs (p, 1) of one track and one return each."""
    return take(belief, tracks[:, None], 0), Detections.of(detections.z[returns[:, None]])


def assert_pairs_are_dense(estimator, belief, sensor, detections):
    dense = estimator.evaluate(belief, sensor, detections, P_GATE)
    tracks, returns = np.divmod(np.random.default_rng(1).permutation(T * K), K)
    pairs, each = pairs_of(belief, detections, tracks, returns)
    sparse = estimator.evaluate(pairs, sensor, each, P_GATE)
    assert_equal(sparse.loglik[:, 0, 0], dense.loglik[tracks, 0])
    assert_equal(sparse.loglik[:, 0, 1], dense.loglik[tracks, 1 + returns])
    assert_equal(sparse.distance[:, 0, 0], dense.distance[tracks, returns])
    assert_equal(sparse.nis[:, 0, 0], dense.nis[tracks, returns])
    assert_equal(sparse.log_volume[:, 0], dense.log_volume[tracks])


def test_pairs_evaluated_as_a_batch_are_the_dense_evaluation(scene):
    assert_pairs_are_dense(*scene)


@attrs.frozen
class Comparing:
    """A mutant: what a return says about a track depends on the other tracks."""

    inner: Any

    def evaluate(self, belief, sensor, detections, p_gate):
        found = self.inner.evaluate(belief, sensor, detections, p_gate)
        return attrs.evolve(found, loglik=found.loglik - found.loglik.max(axis=-2, keepdims=True))


def test_a_filter_that_compares_its_tracks_is_found_out(scene):
    estimator, *rest = scene
    with pytest.raises(AssertionError, match="Not equal to tolerance"):
        assert_pairs_are_dense(Comparing(estimator), *rest)


def test_pairs_updated_as_a_batch_are_the_dense_update_by_that_return(scene):
    estimator, belief, sensor, detections = scene
    dense = estimator.evaluate(belief, sensor, detections, P_GATE)
    tracks, returns = np.arange(T), np.array([0, 1, 2, 4])
    pairs, each = pairs_of(belief, detections, tracks, returns)
    sparse = estimator.update(pairs, estimator.evaluate(pairs, sensor, each, P_GATE), np.array([[[0.0, 1.0]]] * T))
    whole = estimator.update(belief, dense, np.eye(1 + K)[1 + returns])
    assert_equal(take(sparse, 0, 1), whole)


def test_leaves_are_the_branches_of_their_parents(scene):
    """Track 0 has three leaves, track 2 two: a miss among them. Each is what the track would be under that choice alone."""
    estimator, belief, sensor, detections = scene
    innovation = estimator.evaluate(belief, sensor, detections, P_GATE)
    parents, columns = np.array([0, 0, 0, 2, 2, 3]), np.array([1, 0, 3, 5, 0, 4])
    chosen = np.eye(1 + K)[columns]
    leaves = estimator.update(take(belief, parents, 0), take(innovation, parents, 0), chosen)
    for leaf, (parent, column) in enumerate(zip(parents, columns, strict=True)):
        whole = estimator.update(belief, innovation, np.eye(1 + K)[np.full(T, column)])
        assert_equal(take(leaves, [leaf], 0), take(whole, [parent], 0))


def test_the_leaves_mixed_are_the_soft_update(scene):
    """Moments of the leaves under their weights are those of one update with these weights."""
    estimator, belief, sensor, detections = scene
    innovation = estimator.evaluate(belief, sensor, detections, P_GATE)
    weights = np.random.default_rng(2).dirichlet(np.ones(1 + K), T)
    soft = estimator.moments(estimator.update(belief, innovation, weights))
    parents, columns = np.divmod(np.arange(T * (1 + K)), 1 + K)
    each = estimator.moments(
        estimator.update(take(belief, parents, 0), take(innovation, parents, 0), np.eye(1 + K)[columns])
    )
    mean, apart = estimator.state.mean(each.mean.reshape(T, 1 + K, -1), weights)
    cov = each.cov.reshape(T, 1 + K, *each.cov.shape[1:])
    mixed = np.einsum("tc,tcij->tij", weights, cov) + np.einsum("tc,tci,tcj->tij", weights, apart, apart)
    np.testing.assert_allclose(soft.mean, mean, rtol=1e-9, atol=1e-9)
    np.testing.assert_allclose(soft.cov, mixed, rtol=1e-9, atol=1e-9 * np.abs(mixed).max())
