"""The figures behind `vedette explain` against independent ones: the Riccati equation, the binomial law."""

import numpy as np
import pytest
from scipy.linalg import solve_discrete_are

from vedette.config import load
from vedette_tools.explaining import findings, situation
from vedette_tools.explaining.description import lines
from vedette_tools.explaining.lifetimes import TRACKS
from vedette_tools.explaining.situation import fused
from vedette_tools.explaining.steady_state import MOST, reach, settle, together

DT, SIGMA, ACCEL = 1.5, 20.0, 0.5


def alone(**more):
    """Return a config of one position sensor, without a source."""
    return {
        "sensors": {"radar": {"kind": "cartesian_position", "sigma": SIGMA, "detection_probability": 0.9, **more}},
        "estimator": {"kind": "kalman", "motion": {"kind": "constant_velocity", "sigma_accel": ACCEL}},
        "associator": {"kind": "pda"},
        "birth": {"kind": "from_returns", "spread": {"vx": 10.0, "vy": 10.0}},
        "lifecycle": {"kind": "m_of_n", "hits": 3, "looks": 3, "misses": 60},
    }


def test_a_settled_track_has_the_covariance_of_the_riccati_equation():
    settled = situation(load(alone()), DT).sensors[0].settled
    F = np.array([[1.0, DT], [0.0, 1.0]])
    Q = ACCEL**2 * np.array([[DT**3 / 3, DT**2 / 2], [DT**2 / 2, DT]])
    H = np.array([[1.0, 0.0]])
    P = solve_discrete_are(F.T, H.T, Q, np.array([[SIGMA**2]]))
    assert settled.S[-1] == pytest.approx((P[0, 0] + SIGMA**2) * np.eye(2), rel=1e-3)
    first = SIGMA**2 + DT**2 * 100.0 + Q[0, 0]
    assert settled.S[0] == pytest.approx((first + SIGMA**2) * np.eye(2), rel=1e-9)
    assert settled.gate_volumes(4.0)[0] == pytest.approx(4 * np.pi * (first + SIGMA**2))  # an ellipse of two deviations


def test_shares_of_confirmed_tracks_follow_the_binomial_law():
    lives = situation(load(alone(clutter_density=1e-12)), DT).sensors[0].lives
    expected = (0.9 * 0.99) ** 2  # the first of three hits is the return that started the track
    assert lives.confirmed == pytest.approx(expected, abs=4 * np.sqrt(expected * (1 - expected) / TRACKS))
    assert lives.false == 0.0
    assert lives.kept == 1.0


def test_what_no_return_of_a_partial_sensor_has_is_not_counted(tmp_path):
    """A track settles, and its gate holds false returns, as of the sensor that measures the rest alone."""
    (tmp_path / "rows.csv").write_text("t,x,y,u,v\n" + "".join(f"{DT * k},{20 * k},{5 * k},,\n" for k in range(30)))
    columns = {"time": "t", "columns": {"x": "x", "y": "y", "vx": "u", "vy": "v"}}
    table = {"kind": "csv", "path": str(tmp_path / "rows.csv"), "detections": columns}
    speeds = {"kind": "position_velocity", "sigma": SIGMA, "sigma_speed": 0.1, "detection_probability": 0.9}
    partial = {"kind": "partial", "of": {**speeds, "clutter_density": 1e-12}, "optional": {"vx": 20.0, "vy": 30.0}}
    given = {"kind": "given", "start": {"x": [0, SIGMA], "y": [0, SIGMA], "vx": [0, 10], "vy": [0, 10]}}
    told = []
    for sensor, source in ((partial, {"source": table}), ({**alone()["sensors"]["radar"], "clutter_density": 6e-10}, {})):
        config = alone() | {"sensors": {"radar": sensor}, "birth": given} | source
        it = situation(load(config), DT)
        settled = it.sensors[0].settled
        told.append([settled.updated[-1], settled.S[0], settled.R, settled.density, settled.gate_volumes(9.0)])
    for one, other in zip(*told, strict=True):
        np.testing.assert_allclose(one, other, rtol=1e-9)
    said = "\n".join(lines(situation(load(config | {"sensors": {"radar": partial}, "source": table}), DT)))
    assert "vx, vy: no return" in said


@pytest.mark.parametrize("limit", [40.0, 3000.0, 123456.0])
@pytest.mark.parametrize("place", [{}, {"x": 20_000.0, "y": -2500.0}])
def test_the_reach_is_what_the_sensor_says_wherever_it_stands(limit, place):
    sensor = {"kind": "polar_position", "sigma_range": 5, "sigma_bearing": 0.01, "max_range": limit, **place}
    config = alone() | {"sensors": {"radar": sensor}}
    assert reach(load(config).tracker.sensors["radar"])[1] == pytest.approx(limit, rel=5e-3)


def test_all_sensors_together_are_told_by_the_covariance_of_both():
    """Of two that measure an axis each none alone told where a target is, and nothing said that both do."""
    config = alone()
    along = {"kind": "linear", "axes": ["x"], "R": [[SIGMA**2]]}
    config["birth"]["sensors"] = ["radar"]
    config["sensors"] = {"radar": config["sensors"]["radar"], "along": along, "across": {**along, "axes": ["y"]}}
    one, all_three = fused(situation(load(alone()), DT)), fused(situation(load(config), DT))
    assert one is None
    F, H = np.array([[1.0, DT], [0.0, 1.0]]), np.array([[1.0, 0.0]])
    Q = ACCEL**2 * np.array([[DT**3 / 3, DT**2 / 2], [DT**2 / 2, DT]])
    P = solve_discrete_are(F.T, H.T, Q, np.array([[SIGMA**2 / 2]]))  # along each axis two look at once
    settled = np.linalg.inv(np.linalg.inv(P) + 2 * H.T @ H / SIGMA**2)
    assert all_three["position_error_m"] == pytest.approx(np.sqrt(settled[0, 0]), rel=1e-3)
    assert all_three["after_s"] == 60 * DT


RADAR = {"kind": "range_bearing", "sigma_range": 5.0, "sigma_bearing": 0.01}


def settled_by(name, returns=(), **sensors):
    """Return the tracker of some sensors, the first of which begins tracks, and how a track of one of them settles."""
    config = alone() | {"sensors": sensors}
    config["estimator"], config["birth"]["sensors"] = {**config["estimator"], "kind": "ekf"}, [next(iter(sensors))]
    tracker = load(config).tracker
    return tracker, settle(tracker, name, DT, None, np.reshape(returns, (-1, 2)), None)


@pytest.mark.parametrize(("near", "far", "middle"), [(100.0, 10_000.0, 1000.0), (100.0, None, 1000.0), (1e4, None, 1e4)])
def test_without_data_a_target_is_in_the_middle_of_the_reach(near, far, middle):
    """And the clutter is told as it is there: even over the area, as much more as the circle is longer."""
    clutter = {} if far is None else {"max_range": far, "clutter_per_scan": 20.0}
    _, settled = settled_by("radar", radar=RADAR | {"min_range": near} | clutter)
    assert np.linalg.norm(settled.start.mean[0, :2]) == pytest.approx(middle, rel=1e-3)
    even = 0.0 if far is None else 20.0 / (np.pi * (far**2 - near**2))
    assert settled.density == pytest.approx(even * np.linalg.norm(settled.mean[-1, :2]), rel=1e-6)


def test_a_track_that_another_sensor_begins_is_where_both_see_it():
    """And not at what would be a return of the one that begins tracks, but was measured by the other."""
    lidar = {"kind": "cartesian_position", "sigma": 0.1, "max_range": 60.0, "detection_probability": 0.9}
    given = {"radar": RADAR | {"min_range": 10.0, "max_range": 10_000.0}, "lidar": lidar}
    _, settled = settled_by("lidar", **given)
    assert np.linalg.norm(settled.start.mean[0, :2]) < 60.0
    assert settled.detects == 0.9
    np.testing.assert_array_equal(settled_by("lidar", (25.0, 1.0), **given)[1].start.mean, settled.start.mean)


def test_many_sensors_that_look_often_are_taken_for_so_many_scans_in_all():
    tracker, settled = settled_by("radar", radar=RADAR)
    time, _ = together(tracker, [(tracker.sensors["radar"], 0.1, None)] * 20, settled.start)
    assert time == pytest.approx(MOST * 0.1 / 20)


@pytest.mark.parametrize("kind", ["range_only", "bearing_only", "range_bearing_elevation"])
def test_a_height_that_no_sensor_observes_is_told(kind):
    """Of sensors of the plane over a motion in space; beside one that observes it nothing is."""
    errors = {"range": "sigma_range", "bearing": "sigma_bearing", "elevation": "sigma_elevation"}
    sensor = {"kind": kind, **{sigma: 0.5 for name, sigma in errors.items() if name in kind}}
    axes = ["x", "y", "z"]
    start = {axis: [300.0, 20.0] for axis in axes} | {f"v{axis}": [0.0, 3.0] for axis in axes}
    config = alone() | {
        "sensors": {"one": sensor},
        "estimator": {"kind": "ekf", "motion": {"kind": "constant_velocity", "sigma_accel": ACCEL, "axes": axes}},
        "birth": {"kind": "given", "start": start},
        "lifecycle": {"kind": "single_target"},
    }
    it = situation(load(config), DT)
    told = [found for found in findings(it) if found.place == "sensors"]
    assert [" z:" in found.text for found in told] == ([] if kind == "range_bearing_elevation" else [True])
