"""Codes as they come in the wild: changed on the way, of two objects, on clutter, on every second scan."""

import numpy as np
import pytest

import vedette
from vedette import Detections, Scan

CONFIG = {
    "estimator": {"kind": "kalman", "motion": {"kind": "constant_velocity", "sigma_accel": 0.5}},
    "sensors": {
        "radar": {"kind": "cartesian_position", "sigma": 5.0, "detection_probability": 0.95, "clutter_density": 1e-8}
    },
    "birth": {"kind": "from_returns", "spread": {"vx": 10.0, "vy": 10.0}},
    "lifecycle": {"kind": "existence"},
}
SCANS = 40


def codes_of(case, k):
    if case == "changed on the way":
        return [7 if k >= SCANS // 2 else 1, 2]
    if case == "one code of two objects":
        return [1, 1]
    return [-1, -1] if case == "from one of two sensors" and k % 2 else [1, 2]


@pytest.mark.parametrize("kind", ["jpda", "gnn", "k_best"])
@pytest.mark.parametrize("case", ["changed on the way", "one code of two objects", "from one of two sensors", "on clutter"])
def test_two_objects_have_two_tracks_whatever_their_codes(case, kind):
    rng, it = np.random.default_rng(1), vedette.build(CONFIG | {"associator": {"kind": kind}})
    state, ever = it.start(seed=1), set()
    for k in range(SCANS):
        z = np.array([[10.0 * k, 0.0], [10.0 * k, 400.0]]) + rng.normal(0, 5, (2, 2))
        codes = codes_of(case, k)
        if case == "on clutter":
            z, codes = np.vstack([z, rng.uniform(-2000, 2000, (1, 2))]), [*codes, 1]
        state = it.step(state, Scan(float(k), "radar", Detections(z, np.ones(len(z), dtype=bool), identity=np.array(codes))))
        ever |= set(state.ids[state.confirmed].tolist())
    assert len(ever) == 2
    assert ever == set(state.ids[state.confirmed].tolist())
