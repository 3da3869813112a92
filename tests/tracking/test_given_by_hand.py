"""Poses, states and times from a user's hand: converted where they enter, refused with their name."""

import numpy as np
import pytest

import vedette
from vedette import Detections, Pose, Scan


def tracker():
    return vedette.build(
        {
            "estimator": {"kind": "ekf", "motion": {"kind": "constant_velocity", "sigma_accel": 0.1}},
            "sensors": {"radar": {"kind": "range_bearing", "sigma_range": 10.0, "sigma_bearing": 0.01}},
            "associator": {"kind": "gnn"},
            "birth": {"kind": "from_returns", "spread": {"vx": 5.0, "vy": 5.0}},
            "lifecycle": {"kind": "m_of_n"},
        }
    )


@pytest.mark.parametrize("wrong", [None, "x", "", {}, object(), 1j])
def test_a_heading_that_is_no_number_is_refused_where_it_is_given(wrong):
    with pytest.raises(ValueError, match=r"^heading: must be "):
        Pose([0.0, 0.0], heading=wrong)


@pytest.mark.parametrize("given", [0.25, np.float32(0.25), np.float64(0.25), "0.25", np.array(0.25)])
def test_a_heading_is_a_number_however_it_is_given(given):
    heading = Pose([0.0, 0.0], heading=given).heading
    assert type(heading) is float
    assert heading == 0.25


def test_headings_of_runs_are_an_array():
    many = np.array([0.0, 1.0])
    assert Pose(np.zeros((2, 2)), heading=many).heading is many
    np.testing.assert_array_equal(Pose(np.zeros((2, 2)), heading=[0, 1]).heading, many)


@pytest.mark.parametrize("wrong", [None, 5, "x", []])
def test_what_is_no_state_cannot_be_predicted(wrong):
    with pytest.raises(TypeError, match=r"^a state: must be the first argument"):
        tracker().predict(wrong, 1.0)


@pytest.mark.parametrize("wrong", [None, "x", [1.0]])
def test_what_is_no_time_cannot_be_predicted_to(wrong):
    own = tracker()
    state = own.step(own.start(seed=1), Scan(0.0, "radar", Detections.of([[1000.0, 0.1]])))
    with pytest.raises(ValueError, match=r"^time: must be a number of s, got "):
        own.predict(state, wrong)
