"""A report names the parameter that is likely wrong, and by how much."""

import re

import numpy as np
import pytest
from attrs import evolve, frozen

import vedette
from vedette.testing import consistency
from vedette_report.whole_trackers.culprits.drawn import Stated, told
from vedette_standard import Displaced
from vedette_standard.estimators.kalman import Kalman

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


def filtering(estimator):
    """A tracker of a radar whose errors, of 10 m, tell little of its Q; its gate is open."""
    slow = {"x": [2000, 20], "y": [0, 20], "vx": [0, 2], "vy": [5, 2]}
    turning = {axis: [0, 0.3] for axis in ("ax", "ay") if "singer" in str(estimator)}
    radar = {"kind": "cartesian_position", "sigma": 10.0, "detection_probability": 0.9}
    return vedette.build(
        {
            "estimator": estimator, "sensors": {"radar": radar}, "gate": "off", "associator": {"kind": "pda"},
            "birth": {"kind": "given", "start": slow | turning},
            "lifecycle": {"kind": "single_target"},
        }
    )  # fmt: skip


def straight(sigma):
    return {"kind": "kalman", "motion": {"kind": "constant_velocity", "sigma_accel": sigma}}


RIGHT_R = "; not R of radar along x, R of radar along y"


@pytest.mark.parametrize("factor", [0.5, 2.0])
@pytest.mark.costly
def test_a_q_of_which_innovations_tell_little_is_named_by_the_truth(factor):
    """They are 4 % too large or too small: all of Q and R were once excluded, for innovations were as they should be."""
    for seed in range(3):
        cause = consistency(filtering(straight(0.3 * factor**0.5)), world=filtering(straight(0.3)), seed=seed).cause
        assert size(cause, "Q") == pytest.approx(1 / factor, rel=0.05)
        assert cause.endswith(RIGHT_R)


@frozen
class Louder(vedette.WrappedMotion):
    """A motion with `factor` times the noise of another."""

    kind = "louder"
    of: vedette.MotionModel
    factor: float

    def noise(self, x, dt):
        return self.factor * self.of.noise(x, dt)


@frozen
class Own(Kalman):
    """Filters with another Q than its motion states."""

    kind = "own_noise"
    factor: float = 1.0

    def predict(self, belief, dt, rng=None):
        return Kalman(Louder(self.motion, self.factor)).predict(belief, dt, rng)


@pytest.mark.parametrize("factor", [0.5, 2.0])
@pytest.mark.costly
def test_an_estimator_that_filters_with_another_q_is_named_not_its_motion(factor):
    right = filtering(straight(0.3))
    cause = consistency(evolve(right, estimator=Own(right.estimator.motion, factor=factor))).cause
    assert cause.startswith("what the estimator makes of its models, not what they state: Q is ")
    assert size(cause, "Q") == pytest.approx(1 / factor, rel=0.3)
    assert cause.endswith(RIGHT_R)


JUMPS = {"kind": "imm", "modes": [straight(0.1), straight(3.0)], "transition": [[0.95, 0.05], [0.1, 0.9]]}
SINGER = {"kind": "kalman", "motion": {"kind": "singer", "tau": 20.0, "sigma_accel": 0.3}}


@pytest.mark.parametrize(
    ("sigma", "world", "words"),
    [
        (0.1, JUMPS, "the target manoeuvres: .* times too small"),
        (0.5, JUMPS, "the target manoeuvres: .* times too small"),
        (0.3, SINGER, "the target's motion is another: what moves it goes on, by 0.9"),
    ],
    ids=["quiet", "louder", "turns that last"],
)
@pytest.mark.costly
def test_a_manoeuvre_is_no_correlated_error_of_a_sensor(sigma, world, words):
    """The returns less the truth are white, which can be seen: only innovations were once asked."""
    cause = consistency(filtering(straight(sigma)), world=filtering(world)).cause
    assert re.match(words, cause)
    assert cause.endswith(RIGHT_R)


def test_errors_as_stated_are_called_right_and_others_by_their_size():
    rng = np.random.default_rng(0)
    cov = np.array([[4.0, 1.0], [1.0, 1.0]])
    error = rng.multivariate_normal([0, 0], cov, (200, 50))
    seen = rng.random((200, 50)) < 0.8
    right = Stated.of("R of radar", ("x", "y"), error, cov, seen, np.ones((200, 50)), "radar")
    assert told(right) == ([], ["R of radar along x", "R of radar along y"])
    assert max(off for *_, off in right.shapes().values()) < 1
    wrong = Stated.of("R of radar", ("x", "y"), error, np.diag([1.0, 1.0]), seen, np.ones((200, 50)), "radar")
    said, cleared = told(wrong)
    assert re.match(r"R of radar along x is (3.9|4|4.1) \+- 0.0\d times too small", said[0])
    assert re.match(r"R of radar between x and y is correlated by 0.(49|5|51), not by 0 ", said[1])
    assert cleared == ["R of radar along y"]


@pytest.mark.parametrize(
    ("sigma", "real", "cause"),
    [
        (0.0, 0.0, "R of radar along x is 1.* times too small, R of radar along y is 1.* times too small$"),
        (20.0, 0.0, "Q is far too large"),
        (0.0, 20.0, "Q along x is 0, and the truth's is not, Q along y is 0"),
    ],
    ids=["both rest", "the truth rests", "the tracker's rests"],
)
def test_of_what_rests_there_is_no_q(sigma, real, cause):
    """Its Q was once nan times too large, and a truth that rests an error."""

    def resting(sigma, error):
        radar = {"kind": "cartesian_position", "sigma": error}
        return vedette.build(
            {
                "estimator": {"kind": "kalman", "motion": {"kind": "random_walk", "sigma": sigma}},
                "sensors": {"radar": radar}, "gate": "off", "associator": {"kind": "pda"},
                "birth": {"kind": "given", "start": {"x": [0, 7], "y": [0, 7]}}, "lifecycle": {"kind": "single_target"},
            }
        )  # fmt: skip

    assert re.match(cause, consistency(resting(sigma, 5.0), world=resting(real, 7.0), scans=20).cause)
