"""Poses, states and times from a user's hand: converted where they enter, refused with their name."""

import numpy as np
import pytest

import vedette
from support.paths import EXAMPLES
from vedette import Detections, Frame, Gaussian, Pose, Scan


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
    with pytest.raises(TypeError, match=r"^a state: must be the first"):
        tracker().predict(wrong, 1.0)


@pytest.mark.parametrize("wrong", [None, "x", [1.0]])
def test_what_is_no_time_cannot_be_predicted_to(wrong):
    own = tracker()
    state = own.step(own.start(seed=1), Scan(0.0, "radar", Detections.of([[1000.0, 0.1]])))
    with pytest.raises(ValueError, match=r"^time: must be a number of s, got "):
        own.predict(state, wrong)


def camera():
    own = vedette.load(EXAMPLES / "flir_clip.toml").tracker
    start = Gaussian(np.array([[20.0, 20.0, 0.0, 0.0, 8.0, 8.0]]), np.eye(6)[None])
    return own, own.start(start, 0.0, seed=1)


PIXELS = np.random.default_rng(0).normal(60.0, 5.0, (48, 64))


def test_lists_of_pixels_and_of_a_corner_are_what_their_arrays_are():
    own, state = camera()
    after = [
        own.step(state, Scan.image(1.0, "camera", Frame(pixels, corner)))
        for pixels, corner in [(PIXELS, np.array([1.0, 2.0])), (PIXELS.tolist(), [1, 2]), (tuple(PIXELS.tolist()), (1, 2))]
    ]
    for each in after[1:]:
        np.testing.assert_array_equal(own.estimate(each).mean, own.estimate(after[0]).mean)


@pytest.mark.parametrize(
    ("pixels", "corner", "told"),
    [
        (PIXELS, [1], r"^frame: corner must be finite"),
        (PIXELS, 5, r"^frame: corner must be finite"),
        (PIXELS, [1, np.nan], r"^frame: corner must be finite"),
        (PIXELS, "x", r"^corner: must be numbers.*got 'x'"),
        ([[1, 2], [3]], None, r"^frame: pixels must be.*got list"),
        ([["a"]], None, r"^frame: pixels must be.*got <U1"),
        ("x", None, r"^frame: pixels must be.*got str"),
        (
            np.zeros((2, 3, 48, 64)),
            None,
            r"^pixels: must have shape \(height, width\).*got \(",
        ),
    ],
)
def test_a_frame_that_cannot_be_taken_is_refused_with_what_is_right(pixels, corner, told):
    own, state = camera()
    with pytest.raises(ValueError, match=told):
        own.step(state, Scan.image(1.0, "camera", Frame(pixels, corner)))
