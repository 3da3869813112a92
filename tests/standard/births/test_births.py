"""Births against what their sentences say."""

import numpy as np
import pytest

from vedette import Detections, Recording, Space, Trajectory
from vedette_standard.births.from_returns import FromReturns
from vedette_standard.births.given import Given
from vedette_standard.estimators.kalman import Kalman
from vedette_standard.motion.constant_velocity import ConstantVelocity
from vedette_standard.sensors.cartesian_position import CartesianPosition

STATE = Space.of(x="m", y="m", vx="m/s", vy="m/s")
FILTER, RADAR = Kalman(ConstantVelocity(0.3)), CartesianPosition(2.0)
SPREAD = {"vx": 4.0, "vy": 5.0}


def begun(birth, z, claimed, **more):
    detections = Detections(np.array(z), np.ones(len(z), dtype=bool), **more)
    return birth.begin(None, FILTER, RADAR, "radar", detections, np.array(claimed))


def test_new_tracks_start_at_their_return_with_the_stated_spread():
    own = np.array([[[2.0, 0.5], [0.5, 1.0]]])
    newborn = begun(FromReturns(spread=SPREAD), [[3.0, 7.0]], [0.0], noise=own)
    names = FILTER.state.names
    mean = dict(zip(names, newborn.prior.mean[0], strict=True))
    assert mean == {"x": 3.0, "y": 7.0, "vx": 0.0, "vy": 0.0}
    expected = np.zeros((4, 4))
    x, y, vx, vy = (names.index(name) for name in ("x", "y", "vx", "vy"))
    expected[x, x], expected[y, y], expected[x, y], expected[y, x] = 2.0, 1.0, 0.5, 0.5
    expected[vx, vx], expected[vy, vy] = 16.0, 25.0
    np.testing.assert_array_equal(newborn.prior.cov[0], expected)
    with pytest.raises(ValueError, match=r"spread: must state the standard deviation.*'vy'"):
        begun(FromReturns(spread={"vx": 4.0}), [[3.0, 7.0]], [0.0])


def test_returns_that_tracks_claim_start_none():
    newborn = begun(
        FromReturns(spread=SPREAD, claimed=0.4, initial=0.3), [[0.0, 0.0], [9.0, 9.0], [5.0, 5.0]], [0.1, 0.6, 0.4]
    )
    assert newborn.returns.tolist() == [0]
    assert newborn.existence.tolist() == [0.3]


def test_returns_that_lack_a_component_start_none():
    missing = np.array([[False, True], [False, False]])
    newborn = begun(FromReturns(spread=SPREAD), [[0.0, 0.0], [9.0, 9.0]], [0.0, 0.0], missing=missing)
    assert newborn.returns.tolist() == [1]


@pytest.mark.parametrize(("sensors", "may"), [((), True), (("radar",), True), (("lidar",), False)])
def test_only_the_named_sensors_start_tracks(sensors, may):
    assert FromReturns(sensors=sensors).starts_from("radar") == may


def test_one_track_is_given_where_it_is_told_or_at_the_truth():
    truth = Trajectory("boat", STATE, np.array([0.0, 10.0]), np.array([[0.0, 0, 1, 2], [10.0, 20, 1, 2]]))
    recording = Recording((), (truth,))
    birth = Given(spread={"x": 3, "y": 3, "vx": 1, "vy": 1}, offset={"x": 10.0})
    prior = birth.given(STATE, recording)
    assert prior.mean.tolist() == [[10.0, 0.0, 1.0, 2.0]]
    assert np.diag(prior.cov[0]).tolist() == [9.0, 9.0, 1.0, 1.0]
    told = Given(start={"x": [5, 1], "y": [6, 2], "vx": [0, 3], "vy": [0, 3]}).given(STATE, Recording(()))
    assert told.mean.tolist() == [[5.0, 6.0, 0.0, 0.0]]
    with pytest.raises(ValueError, match="start: must state 'x', 'y', 'vx', 'vy', as the recording"):
        birth.given(STATE, Recording(()))
    with pytest.raises(ValueError, match=r"spread: must state the standard deviation.*'vy'"):
        Given(spread={"x": 3, "y": 3, "vx": 1}).given(STATE, recording)


def test_wrong_parameters_are_refused():
    with pytest.raises(ValueError, match=r"start: x: the standard deviation must.*got -1"):
        Given(start={"x": [0, -1]})
    with pytest.raises(ValueError, match=r"initial: must be > 0"):
        FromReturns(initial=0.0)
