"""A report names the parameter that is likely wrong, and by how much."""

import re

import pytest
from attrs import evolve

import vedette
from vedette.testing import consistency
from vedette_standard import Displaced

START = {"x": [1000, 20], "y": [0, 20], "vx": [12, 2], "vy": [0, 2]}


def tracker(q=1.0, r=1.0, detects=1.0, clutter=0.0, bearing=None, offset=0.0):
    radar = {"kind": "cartesian_position", "sigma": 5.0 * r**0.5}
    if bearing is not None:
        radar = {"kind": "range_bearing", "sigma_range": 5.0 * r**0.5, "sigma_bearing": 0.005 * bearing**0.5}
    if offset:
        radar["x"] = offset
    return vedette.build(
        {
            "estimator": {
                "kind": "kalman" if bearing is None else "ekf",
                "motion": {"kind": "constant_velocity", "sigma_accel": 0.5 * q**0.5},
            },
            "sensors": {"radar": radar | {"detection_probability": detects, "clutter_density": clutter}},
            "associator": {"kind": "pda"},
            "birth": {"kind": "given", "start": START},
            "lifecycle": {"kind": "single_target"},
        }
    )


def judged(wrong, right):
    return consistency(tracker(**wrong), world=tracker(**right))


def size(cause, name):
    """The factor by which the report calls a parameter too small."""
    found = re.search(rf"{name} is ([0-9.]+) \+- [0-9.]+ times too (small|large)", cause)
    assert found, cause
    return float(found[1]) ** (1 if found[2] == "small" else -1)


NOISY = {"detects": 0.9, "clutter": 1e-4}


@pytest.mark.parametrize(
    ("wrong", "right", "name", "factor"),
    [
        ({"q": 0.5}, {}, "Q", 2.0),
        ({"q": 4.0}, {}, "Q", 0.25),
        ({"q": 1 / 3} | NOISY, NOISY, "Q", 3.0),
        ({"r": 0.5}, {}, "R of radar along x", 2.0),
        ({"r": 1.5}, {}, "R of radar along y", 1 / 1.5),
        ({"bearing": 0.5}, {"bearing": 1.0}, "R of radar along bearing", 2.0),
    ],
)
@pytest.mark.costly
def test_the_noise_that_is_wrong_is_named_with_its_size(wrong, right, name, factor):
    report = judged(wrong, right)
    assert size(report.cause, name) == pytest.approx(factor, rel=0.25)
    wrongly, _, acquitted = report.cause.partition("; not ")
    assert ("Q" in acquitted) == (name != "Q")
    assert ("R of radar" in wrongly) == (name != "Q")
    assert report.text.splitlines()[-1] == f"  likely {report.cause}"


@pytest.mark.parametrize("q", [1 / 9, 1 / 36])
@pytest.mark.by_turns
def test_a_q_that_is_far_too_small_is_named(q):
    """Its factor is known badly, as the filter hardly reacts to it; that it is not 1 is known well."""
    cause = judged({"q": q}, {}).cause
    assert re.match(r"Q is (far|[0-9.]+ \+- [0-9.]+ times) too small \(.*\); not R of radar along x, R", cause)


@pytest.mark.costly
def test_both_are_named_where_both_are_wrong():
    cause = judged({"q": 0.5, "r": 1.5}, {}).cause
    assert size(cause, "Q") == pytest.approx(2.0, rel=0.25)
    assert size(cause, "R of radar along x") == pytest.approx(1 / 1.5, rel=0.1)


@pytest.mark.parametrize(
    ("wrong", "right", "name", "words"),
    [
        ({"detects": 0.9}, {"detects": 0.7}, "hits", "the detection probability is too large"),
        (NOISY, NOISY | {"detects": 0.7}, "hits", "the detection probability is too large"),
        (NOISY, NOISY | {"clutter": 2e-4}, "false returns", "the density is 2(.0[0-9])? times too small"),
        (NOISY | {"clutter": 0.0}, NOISY, "false returns", "it declares none"),
    ],
)
@pytest.mark.costly
def test_detection_and_clutter_are_counted(wrong, right, name, words):
    report = judged(wrong, right)
    (verdict,) = (verdict for verdict in report.verdicts if verdict.name == name)
    assert not verdict.inside
    assert re.search(words, verdict.text), verdict.text
    assert report.cause.startswith("the detection probability or clutter density")


def test_a_station_at_the_wrong_place_is_a_bias():
    cause = judged({"bearing": 1.0, "offset": 50.0}, {"bearing": 1.0}).cause
    assert re.match(r"a bias: returns of radar lie \+(49|5[01])(\.\d+)? m \+- [.\d]+ m off along range", cause)


@pytest.mark.parametrize(
    ("wrong", "words"),
    [
        ({"add": {"x": 3.0}}, r"a bias: returns of radar lie \+(2.9|3|3.0)\d? m \+- \S+ m off along x: "),
        ({"lag": 0.5}, r"wrong times: returns of radar lie where targets were 0.(49?|5) \+- \S+ s earlier: "),
        ({"add": {"x": 3.0}, "lag": 0.5}, "a bias and wrong times: .* off along x, and where targets were 0.(49?|5) "),
    ],
)
@pytest.mark.costly
def test_a_bias_and_late_times_are_named_and_told_apart(wrong, words):
    """Targets go to all sides, so that late times are no mean error."""
    right = tracker()
    right = evolve(right, birth=evolve(right.birth, start=START | {"vx": [0, 12], "vy": [0, 12]}))
    world = evolve(right, sensors={"radar": Displaced(right.sensors["radar"], **wrong)})
    assert re.match(words, consistency(right, world=world).cause)


def test_a_right_tracker_has_no_culprit():
    assert judged({}, {}).cause == ""
