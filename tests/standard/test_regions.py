"""Areas in which targets appear and survive."""

import numpy as np
import pytest

import vedette
import vedette_standard as standard
from vedette import Detections, Scan
from vedette_standard.regions import Polygon

FRONT = Polygon([[0.0, -100.0], [500.0, -100.0], [500.0, 100.0], [0.0, 100.0]])
CONFIG = {
    "sensors": {"radar": {"kind": "cartesian_position", "sigma": 1.0, "clutter_density": 1e-7}},
    "estimator": {"kind": "kalman", "motion": {"kind": "constant_velocity", "sigma_accel": 0.1}},
    "associator": {"kind": "jpda"},
    "lifecycle": {"kind": "existence"},
    "birth": {"kind": "from_returns", "spread": {"vx": 5.0, "vy": 5.0}},
}
AREA = [{"corners": FRONT.corners.tolist()}]
BIRTHS = {
    "from_returns": {"spread": {"vx": 5.0, "vy": 5.0}},
    "two_point": {"max_speed": 20.0},
    "uniform": {
        "view": {"x": {"low": -500.0, "high": 500.0}, "y": {"low": -200.0, "high": 200.0}},
        "spread": {"vx": 5.0, "vy": 5.0}, "rate": 0.1,
    },
}  # fmt: skip


def run(config, path):
    tracker = vedette.load(config).tracker
    state = tracker.start()
    for second, places in enumerate(path):
        state = tracker.step(state, Scan(float(second), "radar", Detections.of(places)))
    return tracker, state


@pytest.mark.parametrize("kind", BIRTHS)
def test_tracks_start_within_the_areas_alone(kind):
    path = [[[50.0 + t, 10.0], [-50.0 - t, 10.0]] for t in range(4)]
    config = CONFIG | {"birth": {"kind": kind, **BIRTHS[kind]}}
    assert len(run(config, path)[1].ids) >= 2
    config["birth"] |= {"appears_in": AREA}
    tracker, state = run(config, path)
    assert len(state.ids) >= 1
    assert np.all(tracker.estimate(state).mean[:, 0] > 0)


def test_unseen_targets_that_appear_in_half_the_box_are_twice_as_dense_there():
    view = {"x": vedette.sampling.Bounds(-500.0, 500.0), "y": vedette.sampling.Bounds(-100.0, 100.0)}
    sensor = standard.CartesianPosition(1.0, detection_probability=0.9)
    seen = Detections.of([[50.0, 0.0], [-50.0, 0.0]])
    densities = [
        standard.Uniform(view=view, spread={}, rate=1.0, appears_in=areas).reveal(
            np.full((1, 1, 1), 3.0), None, sensor, seen, 1.0
        )[0]
        for areas in ((), (FRONT,))
    ]
    np.testing.assert_allclose(densities[0], 3 * 0.9 / 2e5, rtol=1e-12)
    np.testing.assert_allclose(densities[1], [3 * 0.9 / 1e5, 0.0], rtol=1e-12)


@pytest.mark.parametrize("kind", ["existence", "m_of_n", "score", "coast_limited"])
def test_a_track_ends_where_targets_do_not_survive(kind):
    path = [[[450.0 + 5 * t, 10.0]] for t in range(20)]
    config = CONFIG | {"lifecycle": {"kind": kind}}
    tracker, state = run(config, path)
    assert np.any(tracker.estimate(state).mean[:, 0] > 530)
    config["lifecycle"] = {"kind": kind, "survives_in": AREA}
    tracker, state = run(config, path[:9])
    assert np.any(state.confirmed)
    tracker, state = run(config, path)
    assert not np.any(tracker.estimate(state).mean[:, 0] > 501)


def test_areas_ask_for_a_position_in_the_state_and_for_a_part_of_the_box():
    other = {"kind": "kalman", "motion": {"kind": "constant_velocity", "sigma_accel": 1.0, "axes": ["x"]}}
    sensors = {"gauge": {"kind": "linear", "axes": ["x"], "R": [[1.0]]}}
    config = CONFIG | {"estimator": other, "sensors": sensors, "birth": {"kind": "from_returns", "spread": {"vx": 1.0}}}
    config["lifecycle"] = {"kind": "existence", "survives_in": AREA}
    with pytest.raises(vedette.ConfigError) as error:
        vedette.load(config)
    assert [problem.place for problem in error.value.problems] == ["lifecycle"]
