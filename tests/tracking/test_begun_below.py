"""A track that begins with less existence than ends one is not ended for that: where births are rare, all begin so."""

import numpy as np
import pytest

import vedette
from vedette import Detections, Scan
from vedette_standard.lifecycles import existence

SIGMA, CLUTTER, SIDE = 1.0, 3e-3, 60.0
VIEW = {axis: {"low": -SIDE, "high": SIDE} for axis in "xy"}
BIRTHS = {
    "uniform": {"view": VIEW, "spread": {"vx": 4.0, "vy": 4.0}, "rate": 0.01},
    "poisson": {"appear": [{"at": {axis: [0.0, SIDE] for axis in "xy"} | {"vx": [0, 4], "vy": [0, 4]}, "rate": 0.01}]},
}


def confirmed(birth, by, delete, seed):
    """Return how many tracks are confirmed after 40 scans of three targets among some forty false returns each."""
    radar = {"kind": "cartesian_position", "sigma": SIGMA, "detection_probability": 0.9, "clutter_density": CLUTTER}
    motion = {"kind": "constant_velocity", "sigma_accel": 0.15}
    life = {"kind": "existence", "confirm": 0.9, "delete": delete}
    parts = {"estimator": {"kind": "kalman", "motion": motion}, "sensors": {"radar": radar}, "associator": {"kind": by}}
    made = vedette.build({**parts, "birth": {"kind": birth, **BIRTHS[birth]}, "lifecycle": life})
    rng, state = np.random.default_rng(seed), made.start(seed=0)
    start = np.array([[-30.0, 0.0], [0.0, 30.0], [20.0, -20.0]])
    begun = 1.0
    for k in range(40):
        z = start + [[0.5 * k, 0.2 * k]] + SIGMA * rng.normal(size=start.shape)
        false = rng.uniform(-SIDE, SIDE, (rng.poisson(CLUTTER * (2 * SIDE) ** 2), 2))
        state = made.step(state, Scan(float(k), "radar", Detections.of(np.concatenate([z[rng.random(3) < 0.9], false]))))
        begun = min(begun, *state.existence[state.ids >= state.born - 1], 1.0)
    assert begun < 0.01
    return int(state.confirmed.sum())


@pytest.mark.parametrize("birth", BIRTHS)
@pytest.mark.parametrize("by", ["gnn", "jpda", "lmb"])
@pytest.mark.by_turns
def test_rare_births_confirm_targets_whatever_ends_a_track(birth, by):
    for seed in range(3):
        assert confirmed(birth, by, 0.05, seed) == confirmed(birth, by, 1e-4, seed) == 3


def test_ended_below_delete_they_do_not(monkeypatch):
    monkeypatch.setattr(
        existence.Existence, "start_own", lambda self, e: existence.Known(e < 0, np.full(e.shape, self.delete))
    )
    assert confirmed("uniform", "jpda", 0.05, 0) == 0
