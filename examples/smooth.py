"""A recorded run smoothed: what the later scans say about the earlier ones, and what a lag of ten seconds gives at sea."""

import numpy as np

import vedette

tracker = vedette.build(
    {
        "estimator": {"kind": "ukf", "motion": {"kind": "constant_velocity", "sigma_accel": 0.1}},
        "sensors": {"radar": {"kind": "range_bearing", "sigma_range": 10.0, "sigma_bearing": "0.3 deg"}},
        "associator": {"kind": "gnn"},
        "birth": {"kind": "from_returns", "spread": {"vx": 10.0, "vy": 10.0}},
        "lifecycle": {"kind": "m_of_n"},
    }
)
rng = np.random.default_rng(1)
times = np.arange(0.0, 90.0, 3.0)
ship = np.stack([2000.0 - 8.0 * times, 1000.0 + 0.02 * times**2], axis=-1)
states = [tracker.start(seed=1)]
for time, (x, y) in zip(times, ship, strict=True):
    seen = [np.hypot(x, y) + rng.normal(0, 10.0), np.arctan2(y, x) + rng.normal(0, 0.005)]
    states.append(tracker.step(states[-1], vedette.Scan(time, "radar", vedette.Detections.of([seen]))))

for title, lag in (("filter", 0.0), ("10 s later", 10.0), ("all scans", np.inf)):
    (track,) = vedette.smooth(tracker, states, lag)
    error = np.sqrt(np.mean(np.sum((track.mean[:, :2] - ship) ** 2, axis=1)))
    print(f"{title:<10}  position RMSE {error:4.1f} m")
