"""What births need for many returns: as much for each, however many there are."""

import tracemalloc

import numpy as np
import pytest

import vedette

RETURNS = 4000
ENOUGH = 8_000
"""Bytes a return. A table of all pairs of 4,000 returns has 32,000 for each number that it holds."""

SPREAD = {"vx": 10.0, "vy": 10.0}
BIRTHS = {
    "from_returns": {"spread": SPREAD},
    "two_point": {"max_speed": 20.0},
    "three_point": {"max_speed": 20.0, "max_acceleration": 1.0},
    "poisson": {
        "lifetime": 60.0,
        "appear": [
            {"at": {"x": [5e4, 5e4], "y": [5e4, 5e4], "vx": [0, 10], "vy": [0, 10]}, "rate": 10.0, "initial": 4000.0}
        ],
    },
    "uniform": {
        "view": {"x": {"low": 0, "high": 1e5}, "y": {"low": 0, "high": 1e5}},
        "spread": SPREAD,
        "initial": 4000.0,
        "rate": 10.0,
    },
}


def built(kind):
    return vedette.build({
        "estimator": {"kind": "kalman", "motion": {"kind": "constant_velocity", "sigma_accel": 0.1}},
        "sensors": {"radar": {"kind": "cartesian_position", "sigma": 5.0, "clutter_density": 1e-8}},
        "associator": {"kind": "gnn"},
        "birth": {"kind": kind, **BIRTHS[kind]},
        "lifecycle": {"kind": "existence", "delete": 1e-6},
    })  # fmt: skip


@pytest.mark.parametrize("kind", BIRTHS)
def test_memory_grows_with_the_returns_not_with_their_pairs(kind):
    tracker = built(kind)
    birth, estimator, sensor = tracker.birth, tracker.estimator, tracker.sensors["radar"]
    rng, claimed = np.random.default_rng(1), np.zeros(RETURNS)
    places, memory = rng.uniform(0, 1e5, (RETURNS, 2)), birth.initial_memory(estimator, rng)
    for time in range(3):
        memory = birth.predict(memory, estimator, 1.0, rng) if time else memory
        seen = vedette.Detections.of(places + 10.0 * time + rng.normal(0, 5.0, places.shape))
        tracemalloc.start()
        _, sources = birth.reveal(memory, estimator, sensor, seen, 0.99)
        new = birth.begin(sources, estimator, sensor, "radar", seen, claimed)
        memory = birth.update(memory, estimator, sensor, seen, claimed, 0.99)
        _, peak = tracemalloc.get_traced_memory()
        tracemalloc.stop()
        assert peak < ENOUGH * RETURNS
    assert len(new.returns) > 0.9 * RETURNS
