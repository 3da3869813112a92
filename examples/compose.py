"""A tracker composed in Python, fed with returns that a radar reports: ranges in m and bearings in rad."""

import numpy as np

import vedette

tracker = vedette.build(
    {
        "estimator": {"kind": "ekf", "motion": {"kind": "constant_velocity", "sigma_accel": 0.1}},
        "sensors": {"radar": {"kind": "range_bearing", "sigma_range": 10.0, "sigma_bearing": "0.3 deg"}},
        "associator": {"kind": "gnn"},
        "birth": {"kind": "from_returns", "spread": {"vx": 10.0, "vy": 10.0}},
        "lifecycle": {"kind": "m_of_n"},
    }
)
rng = np.random.default_rng(1)
state = tracker.start(seed=1)
for time in np.arange(0.0, 60.0, 3.0):
    ship = np.array([2000.0 - 8.0 * time, 1000.0])
    seen = [np.hypot(*ship) + rng.normal(0, 10.0), np.arctan2(ship[1], ship[0]) + rng.normal(0, 0.005)]
    state = tracker.step(state, vedette.Scan(time, "radar", vedette.Detections.of([seen])))

for track, mean in zip(state.ids, tracker.estimate(state).mean, strict=True):
    print(f"track {track}: x {mean[0]:.0f} m, y {mean[1]:.0f} m, speed {np.hypot(*mean[2:]):.1f} m/s")
