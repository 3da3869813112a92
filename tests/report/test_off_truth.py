"""Returns that lie beside the truth, or are late, are told, and told apart; right ones and noisier ones are not."""

import re

import numpy as np
import pytest

import vedette
from vedette import Space
from vedette_report.detector_errors.off_truth import Returns, beside
from vedette_report.recorded import beside_truth, recorded

PLANE = Space.of(x="m", y="m")
COURSES = {"a": (20, 7.0), "b": (140, 8.0), "c": (260, 9.0)}


def told(seed, **wrong):
    """Return what is said of ships whose returns are not as the tracker believes."""
    radar = {"kind": "cartesian_position", "sigma": 8.0, "detection_probability": 0.9}
    ships = {
        name: {"start": [20.0 * angle - 2800, 900.0], "course": f"{angle} deg", "speed": speed,
               "legs": [{"do": "straight", "seconds": 200}]}
        for name, (angle, speed) in COURSES.items()
    }  # fmt: skip
    source = {"kind": "simulation", "duration": 200.0, "ships": ships, "looks": {"radar": {"interval": 2.0}}}
    if wrong:
        source["sensors"] = {"radar": {"kind": "displaced", **wrong, "of": radar}}
    experiment = vedette.load(
        {
            "seed": seed,
            "source": source,
            "sensors": {"radar": radar},
            "estimator": {"kind": "kalman", "motion": {"kind": "constant_velocity", "sigma_accel": 0.1}},
            "associator": {"kind": "jpda"},
            "birth": {"kind": "from_returns", "spread": {"vx": 8, "vy": 8}},
            "lifecycle": {"kind": "m_of_n"},
        }
    )
    result = experiment.run(keep_states=True)
    return list(beside_truth(experiment.tracker, recorded(experiment, result, ())))


@pytest.mark.parametrize("wrong", [{"add": {"x": 8.0}}, {"lag": 1.0}, {"add": {"x": 8.0}, "lag": 1.0}], ids=str)
@pytest.mark.costly
def test_a_bias_and_a_lag_are_told_with_their_deviations(wrong):
    (found,) = told(0, **wrong)
    (x, y), lag = found.bias, found.lag
    assert np.isfinite([x, y, lag]).tolist() == ["add" in wrong, False, "lag" in wrong]
    assert "add" not in wrong or abs(x - 8.0) < 4 * found.bias_error[0] < 4.0
    assert "lag" not in wrong or abs(lag - 1.0) < 4 * found.lag_error < 0.5
    assert str(found).startswith("radar: ")
    assert ("off along x" in str(found), "lag = " in str(found)) == ("add" in wrong, "lag" in wrong)


@pytest.mark.parametrize("seed", range(3))
@pytest.mark.by_turns
def test_of_right_returns_nothing_is_told(seed):
    assert told(seed) == []


def drawn(rates, bias, lag, seed=0):
    """Return 400 returns in 20 groups, of deviation 5 m."""
    rng = np.random.default_rng(seed)
    apart = rng.normal(0, 5.0, (400, 2)) + bias - lag * rates
    return Returns(apart, rates, np.broadcast_to(25.0 * np.eye(2), (400, 2, 2)), np.arange(400) // 20)


def test_one_course_tells_no_bias_from_a_lag():
    rates = np.broadcast_to([20.0, 0.0], (400, 2))
    found = beside("radar", PLANE, drawn(rates, [6.0, 0.0], 0.0))
    assert found.either
    assert found.bias[0] == pytest.approx(6.0, abs=1.5)
    assert found.lag == pytest.approx(-0.3, abs=0.08)
    assert re.search(r" off along x, or where targets were 0.[23]\d? \+- \S+ s later: ", str(found))


def test_what_stands_still_tells_a_bias():
    found = beside("radar", PLANE, drawn(np.zeros((400, 2)), [0.0, -6.0], 0.0))
    assert (found.either, np.isnan(found.lag), np.isfinite(found.bias).tolist()) == (False, True, [False, True])


def test_errors_that_go_on_are_no_bias():
    """Each group is off by a number of its own."""
    seen = drawn(np.zeros((400, 2)), np.repeat(np.random.default_rng(1).normal(0, 6.0, (20, 2)), 20, axis=0), 0.0)
    assert beside("radar", PLANE, seen) is None
