"""A coarse sensor: how likely two targets merge, in its measured axes and in range and bearing; scenes draw it."""

import numpy as np
import pytest

import vedette
from vedette import Pose
from vedette.sampling import returns
from vedette_sim.resolution import merged_returns
from vedette_standard.sensors.biased import Biased
from vedette_standard.sensors.cartesian_position import CartesianPosition
from vedette_standard.sensors.coarse import Coarse
from vedette_standard.sensors.polar_position import PolarPosition
from vedette_standard.sensors.range_bearing import RangeBearing

RADAR = RangeBearing(sigma_range=1.0, sigma_bearing=0.01)


def merging(C, d):
    return np.exp(-0.5 * d @ np.linalg.solve(C, d))


def test_at_one_cell_half_of_the_pairs_merge():
    C = Coarse(RADAR, {"range": 20.0, "bearing": 0.05}).unresolved(np.array([300.0, 10.0]))
    assert merging(C, np.array([20.0, 0.0])) == pytest.approx(0.5)
    assert merging(C, np.array([0.0, 0.05])) == pytest.approx(0.5)
    assert merging(C, np.array([20.0, 0.05])) == pytest.approx(0.25)


def test_an_axis_without_a_cell_tells_nothing_apart():
    C = Coarse(RADAR, {"range": 20.0}).unresolved(np.array([300.0, 10.0]))
    assert merging(C, np.array([0.0, 3.0])) == pytest.approx(1.0)


def test_cells_in_range_and_bearing_are_turned_where_x_and_y_are_measured():
    sensor = Coarse(PolarPosition(sigma_range=1.0, sigma_bearing=0.01), {"range": 20.0, "bearing": 0.05})
    placed = sensor.at(Pose(np.array([50.0, 0.0])))
    along = np.array([np.cos(0.7), np.sin(0.7)])
    C = placed.unresolved(np.array([50.0, 0.0]) + 300.0 * along)
    assert merging(C, 20.0 * along) == pytest.approx(0.5)
    assert merging(C, 15.0 * np.array([-along[1], along[0]])) == pytest.approx(0.5)


def test_wrappers_hand_it_on():
    coarse = Coarse(RADAR, {"range": 20.0, "bearing": 0.05})
    x = np.array([300.0, 10.0, 0.02])
    np.testing.assert_array_equal(Biased(coarse, {"bearing": "b"}).unresolved(x), coarse.unresolved(x[:2]))
    assert Biased(RADAR, {"bearing": "b"}).unresolved(x) is None


@pytest.mark.parametrize(
    ("of", "cells"),
    [(RADAR, {}), (RADAR, {"x": 3.0}), (RADAR, {"range": 0.0}), (PolarPosition(1.0, 0.01), {"x": 3.0, "range": 4.0})],
)
def test_cells_that_make_no_sense_are_refused(of, cells):
    with pytest.raises(ValueError, match=r"^cells"):
        Coarse(of, cells)


@pytest.mark.costly
def test_scenes_merge_as_often_as_it_states():
    sensor, count, rng = Coarse(CartesianPosition(1.0), {"x": 10.0}), 3000, np.random.default_rng(1)
    x, seen = np.array([[0.0, 0.0], [10.0, 0.0]]), []
    for _ in range(count):
        z, valid = merged_returns(sensor, x, np.zeros(2), rng.standard_normal((2, 2)), None, rng)
        seen.append(np.count_nonzero(valid))
        assert len(z) == 2
    assert abs(np.mean(np.array(seen) == 1) - 0.5) < 5.3 * np.sqrt(0.25 / count)  # false alarms at 1e-7


def test_a_merged_return_is_over_the_middle():
    sensor, rng = Coarse(CartesianPosition(1.0), {"x": 1e6, "y": 1e6}), np.random.default_rng(2)
    x, standard = np.array([[0.0, 0.0], [10.0, 4.0]]), rng.standard_normal((2, 2))
    z, valid = merged_returns(sensor, x, np.zeros(2), standard, None, rng)
    alone, _ = returns(sensor, x, np.zeros(2), standard)
    assert valid.tolist() == [True, False]
    np.testing.assert_allclose(z[0], alone[0] + [5.0, 2.0])


def test_a_simulation_draws_it():
    """Two ships side by side for 100 scans give fewer returns than two of a sensor that resolves them."""

    def returned(sensor):
        ship = {"course": 0.0, "speed": 1.0, "legs": [{"do": "straight", "seconds": 100}]}
        ships = {"one": {"start": [0.0, 100.0], **ship}, "other": {"start": [0.0, 105.0], **ship}}
        source = {"kind": "simulation", "duration": 100, "looks": {"radar": {"interval": 1.0}}, "ships": ships}
        scene = vedette.load(
            {
                "source": source, "sensors": {"radar": sensor}, "associator": {"kind": "jpda"},
                "estimator": {"kind": "ekf", "motion": {"kind": "constant_velocity", "sigma_accel": 1.0}},
                "lifecycle": {"kind": "m_of_n"}, "birth": {"kind": "from_returns", "spread": {"vx": 1.0, "vy": 1.0}},
            }
        )  # fmt: skip
        recording = scene.source.open(scene.tracker.sensors, np.random.default_rng(0))
        return sum(np.count_nonzero(scan.detections.valid) for scan in recording.scans)

    plain = {"kind": "cartesian_position", "sigma": 1.0}
    coarse = {"kind": "coarse", "cells": {"y": 5.0, "x": 5.0}, "of": plain}
    assert returned(plain) == 202
    assert 120 < returned(coarse) < 185
