"""Tracks that one sensor alone covers, between its looks: others that look elsewhere meanwhile say nothing of them."""

import json

import numpy as np
import pytest

import vedette
from vedette import Detections, Scan


def lives(life, times, until, associator="jpda", written=False, tracks=1):
    """When the last track of a target ends that a sensor saw at some times, beside one that looks elsewhere each second."""
    views = {name: {"x": {"low": low, "high": low + 3e3}, "y": {"low": 0.0, "high": 3e3}} for name, low in SENSORS.items()}
    sensor = {"kind": "cartesian_position", "sigma": 5.0, "detection_probability": 0.95, "clutter_density": 1e-9}
    tracker = vedette.build(
        {
            "sensors": {name: sensor | {"view": view} for name, view in views.items()},
            "estimator": {"kind": "kalman", "motion": {"kind": "constant_velocity", "sigma_accel": 0.01}},
            "associator": {"kind": associator},
            "birth": {"kind": "from_returns", "spread": {"vx": 2.0, "vy": 2.0}},
            "lifecycle": {"kind": life, "max_out_of_coverage": 60.0},
        }
    )
    state, nothing, last = tracker.start(seed=1), Detections.of([], 2), 0.0
    ids = set()
    looks = [(float(t), "slow") for t in times] + [(t + 0.25, "quick") for t in range(until)]
    for time, name in sorted(looks):
        seen = Detections.of([[500.0 + time, 1000.0]]) if name == "slow" else nothing
        state = tracker.step(state, Scan(time, name, seen))
        if written:
            state = tracker.state_from(json.loads(json.dumps(state.to_data())))
        last, ids = time if len(state.ids) else last, ids | set(state.ids.tolist())
    assert len(ids) == tracks
    return last


SENSORS = {"slow": 0.0, "quick": 5e3}


@pytest.mark.parametrize(("life", "associator"), [
    ("existence", "jpda"), ("m_of_n", "jpda"), ("score", "gnn"), ("coast_limited", "pda"), ("existence", "k_best"),
])  # fmt: skip
@pytest.mark.by_turns
def test_a_track_waits_for_the_next_look_of_its_sensor_and_ends_where_that_does_not_come(life, associator):
    """It is out of coverage from when the look was due, 90 s after the last, and 60 s later it ends."""
    assert lives(life, range(0, 600, 90), 600, associator) == 599.25
    assert lives(life, range(0, 300, 90), 600, associator) == pytest.approx(270 + 90 + 60, abs=2)


def test_looks_at_uneven_times_and_in_two_parts_are_waited_for_and_an_outage_is_forgotten():
    uneven = np.cumsum([0, 80, 0, 95, 1, 90, 1, 90, 0, 89])
    assert lives("m_of_n", uneven, 600, written=True) == pytest.approx(446 + 89 + 60, abs=2)
    late = [*range(0, 20, 2), *range(1000, 1200, 2)]
    assert lives("m_of_n", late, 1300, tracks=2) == pytest.approx(1198 + 2 + 60, abs=2)
