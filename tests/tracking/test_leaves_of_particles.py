"""Hypotheses over many scans go with estimators whose innovations are no Gaussians."""

import numpy as np
import pytest

import vedette


@pytest.mark.parametrize("estimator", ["auxiliary_particles", "bootstrap_particles", "ensemble_kalman"])
@pytest.mark.parametrize("associator", ["k_best", "lmb"])
def test_leaves_are_of_any_estimator(associator, estimator):
    tracker = vedette.build(
        {
            "estimator": {"kind": estimator, "motion": {"kind": "constant_velocity", "sigma_accel": 0.5}},
            "sensors": {"radar": {"kind": "cartesian_position", "sigma": 5.0, "clutter_density": 1e-6}},
            "associator": {"kind": associator},
            "birth": {"kind": "from_returns", "spread": {"vx": 10.0, "vy": 10.0}},
            "lifecycle": {"kind": "existence"},
        }
    )
    state = tracker.start(seed=1)
    for time in range(6):
        returns = [[5.0 * time, 0.0], [100.0, 5.0 * time]]
        state = tracker.step(state, vedette.Scan(float(time), "radar", vedette.Detections.of(returns)))
    found = tracker.estimate(state)
    nearest = np.linalg.norm(found.mean[:, None, :2] - np.array([[25.0, 0.0], [100.0, 25.0]]), axis=-1)
    assert np.all(nearest.min(axis=0) < 15.0)
    assert state.confirmed.sum() == 2
