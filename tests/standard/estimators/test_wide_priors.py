"""A tracker whose prior says next to nothing of the speed keeps covariances that are some."""

import numpy as np
import pytest

import vedette


@pytest.mark.parametrize("spread", [1e3, 1e6, 1e9, 1e12])
@pytest.mark.parametrize("associator", ["gnn", "pda"])
@pytest.mark.parametrize("estimator", ["kalman", "ekf", "ukf"])
def test_a_prior_far_wider_than_the_noise(estimator, associator, spread):
    sensor = {"kind": "polar_position", "sigma_range": 1.5, "sigma_bearing": 0.0015}
    tracker = vedette.build(
        {
            "estimator": {"kind": estimator, "motion": {"kind": "constant_velocity", "sigma_accel": 0.1}},
            "sensors": {"radar": sensor | {"clutter_density": 1e-40}},
            "associator": {"kind": associator},
            "birth": {"kind": "from_returns", "spread": {"vx": spread, "vy": spread}},
            "lifecycle": {"kind": "m_of_n"},
        }
    )
    rng = np.random.default_rng(1)
    state = tracker.start(seed=1)
    for time in range(10):
        seen = [6300.0 + 3.0 * time, 6300.0] + rng.normal(0.0, 5.0, 2)
        state = tracker.step(state, vedette.Scan(float(time), "radar", vedette.Detections.of([seen])))
        cov = tracker.estimate(state).cov
        deviation = np.sqrt(np.diagonal(cov, axis1=-2, axis2=-1))
        assert np.all(deviation > 0)
        assert np.linalg.eigvalsh(cov / deviation[..., :, None] / deviation[..., None, :]).min(initial=1.0) > -1e-12
    speed = np.diagonal(tracker.estimate(state).cov, axis1=-2, axis2=-1)[..., 2:]
    assert len(speed) >= 1
    assert np.all(speed[0] < 100.0)
