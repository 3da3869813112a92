"""The figures behind `vedette explain` against independent ones: the Riccati equation, the binomial law."""

import numpy as np
import pytest
from scipy.linalg import solve_discrete_are

from vedette.config import load
from vedette_tools.explaining import situation
from vedette_tools.explaining.lifetimes import TRACKS
from vedette_tools.explaining.situation import fused
from vedette_tools.explaining.steady_state import reach

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


@pytest.mark.parametrize("limit", [40.0, 3000.0, 123456.0])
def test_the_reach_is_what_the_sensor_says(limit):
    sensor = {"kind": "polar_position", "sigma_range": 5, "sigma_bearing": 0.01, "max_range": limit}
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
