"""What a report sees beyond means: correlations, the world's own start, mode probabilities, errors that are not white."""

import re

import numpy as np
import pytest
from attrs import evolve, frozen

import vedette
from testing.test_assert_consistent import IMM, LINEAR
from testing.test_culprit import START, tracker
from vedette.testing import Errors, Misuse, World, consistency


def mixed(R, start=START, **more):
    """A tracker whose sensor measures x and y with the covariance R."""
    sensor = {"kind": "linear", "axes": ["x", "y"], "R": R, "H": [[1.0, 0.0], [0.0, 1.0]]}
    return vedette.build(LINEAR | {"sensors": {"radar": sensor}, "birth": {"kind": "given", "start": start}} | more)


PLAIN, TILTED = [[25.0, 0.0], [0.0, 25.0]], [[25.0, 22.5], [22.5, 25.0]]


def wrong(report):
    return {verdict.name for verdict in report.verdicts if not verdict.inside}


@pytest.mark.costly
def test_noise_that_is_correlated_is_seen_though_each_variance_is_right():
    report = consistency(mixed(PLAIN), world=mixed(TILTED))
    assert {"innovation covariance", "error covariance"} <= wrong(report)
    assert "NIS of radar" not in wrong(report)
    assert report.cause.startswith("R of radar between x and y is correlated by 0.9, not by ")
    assert "; not Q, R of radar along x, R of radar along y" in report.cause
    (told,) = (verdict for verdict in report.verdicts if verdict.name == "innovation covariance")
    assert "x and y" in told.text
    assert consistency(mixed(TILTED)).consistent


@frozen
class OfScans(vedette.WrappedMotion):
    """A motion that adds the noise of 1 s in every scan, however long after the last."""

    kind = "of_scans"
    of: vedette.MotionModel

    def noise(self, x, dt):
        return self.of.noise(x, 1.0)


@pytest.mark.costly
def test_a_noise_of_scans_shows_at_uneven_times():
    right, uneven = mixed(PLAIN), (0.2, 4.0)
    of_scans = evolve(right, estimator=evolve(right.estimator, motion=OfScans(right.estimator.motion)))
    assert consistency(of_scans, world=right).consistent
    assert "NEES by time" in wrong(consistency(of_scans, world=right, interval=uneven))
    report = consistency(right, interval=uneven)
    assert report.consistent
    assert consistency(right, interval=(1.0, 1.0)).text == consistency(right).text


def test_uneven_times_are_of_the_whole_range_in_an_order_of_the_seed():
    """They once took turns, so that for .2 to 4 s only .2 and 4 s were tried."""
    steps = [np.diff(consistency(LINEAR, runs=30, interval=(0.2, 4.0), seed=seed).times, prepend=0.0) for seed in (1, 1, 2)]
    for one in steps:
        np.testing.assert_allclose(np.sort(one), np.geomspace(0.2, 4.0, 50))
    np.testing.assert_array_equal(steps[0], steps[1])
    assert not np.allclose(steps[0], steps[2])


@pytest.mark.costly
def test_a_world_starts_where_it_says():
    sharp = {name: [mean, deviation / 10] for name, (mean, deviation) in START.items()}
    report = consistency(mixed(PLAIN, sharp), world=mixed(PLAIN))
    assert "NEES by time" in wrong(report)
    assert report.cause.startswith("the covariance of the start is ")
    assert "small" in report.cause


def switching(stay):
    return vedette.build(IMM | {"estimator": IMM["estimator"] | {"transition": [[stay, 1 - stay], [1 - stay, stay]]}})


@pytest.mark.costly
def test_a_wrong_transition_is_named():
    report = consistency(switching(0.5), world=switching(0.95), runs=400)
    assert "modes" in wrong(report)
    assert report.cause.startswith("the chain by which the modes switch")
    (told,) = (
        verdict for verdict in consistency(switching(0.95), world=switching(0.95)).verdicts if verdict.name == "modes"
    )
    assert told.inside
    assert told.figure == pytest.approx(0.0, abs=1e-12)


@pytest.mark.costly
def test_one_culprit_is_named_where_one_explains():
    """A bearing ten times too sharp once made the range's noise look 1.5 times too large."""
    for seed in range(3):
        cause = consistency(tracker(bearing=0.01), world=tracker(bearing=1.0), seed=seed).cause
        assert re.fullmatch(
            r"R of radar along bearing is (9[0-9]|100) \+- [12] times too small; not Q, R of radar along range", cause
        )


@pytest.mark.costly
@pytest.mark.parametrize(
    ("errors", "words"),
    [
        (Errors(correlation=0.7), "correlated in time"),
        (Errors(wild=0.06), "heavy tails"),
        (Errors(growth=1.5), "change with the distance"),
    ],
    ids=["correlated", "wild", "distance"],
)
@pytest.mark.parametrize("bearing", [None, 1.0], ids=["linear", "polar"])
def test_errors_that_are_not_white_are_named(errors, words, bearing):
    right = tracker(bearing=bearing)
    report = consistency(right, world=World(right.estimator, right.sensors, None, {"radar": errors}))
    assert not report.consistent
    assert words in report.cause


def test_errors_that_are_drawn_have_the_size_that_is_stated():
    rng = np.random.default_rng(0)
    white, away = rng.standard_normal((20_000, 2)), np.full(20_000, 2.0)
    for errors, size in ((Errors(wild=0.1), 1.0), (Errors(growth=1.0), 2.0), (Errors(correlation=0.9), 1.0)):
        first, before = errors.shaped(white, None, away, rng)
        then, _ = errors.shaped(rng.standard_normal((20_000, 2)), before, away, rng)
        assert np.std(first) == pytest.approx(size, rel=0.05)
        assert np.std(then) == pytest.approx(size, rel=0.05)
        assert np.mean(first * then) / size**2 == pytest.approx(errors.correlation, abs=0.03)


RATED = {"kind": "range_bearing_rate", "sigma_range": 5.0, "sigma_bearing": 0.005, "sigma_rate": 1.0}
EXTENDED = {"estimator": {"kind": "ekf", "motion": {"kind": "constant_velocity", "sigma_accel": 0.5}},
            "birth": {"kind": "given", "start": START}}  # fmt: skip


@pytest.mark.parametrize(
    ("world", "place"),
    [
        (tracker(), "world.sensors.radar"),
        (vedette.build(LINEAR | EXTENDED | {"sensors": {"radar": RATED}}), "world.sensors.radar"),
        (vedette.build(LINEAR | {"sensors": {"other": {"kind": "cartesian_position", "sigma": 5.0}}}), "world.sensors"),
        (vedette.build(LINEAR | {"estimator": {"kind": "kalman", "motion": {"kind": "random_walk", "sigma": 1.0}},
                                 "birth": {"kind": "given", "start": {"x": [0, 1], "y": [0, 1]}}}), "world"),
    ],
    ids=["what is measured", "more is measured", "names", "axes"],
)  # fmt: skip
def test_a_world_that_is_another_scene_is_refused_by_its_place(world, place):
    with pytest.raises(Misuse) as refused:
        consistency(tracker(bearing=1.0), world=world)
    assert str(refused.value).split(":")[0] == place


@pytest.mark.costly
def test_a_world_may_have_axes_of_its_own():
    wider = vedette.build(
        LINEAR
        | {
            "estimator": {"kind": "kalman", "motion": {"kind": "constant_acceleration", "sigma_jerk": 0.3}},
            "birth": {"kind": "given", "start": START | {"ax": [0, 0.1], "ay": [0, 0.1]}},
        }
    )
    assert not consistency(tracker(), world=wider).consistent


@pytest.mark.costly
def test_a_worlds_sensor_may_observe_more_of_the_state():
    """It once ended in a raw ValueError."""
    add = {"kind": "biased", "add": {"range": "range_bias"}, "spread": {"range_bias": 20.0}}
    drift = {"kind": "random_walk", "axes": ["range_bias"], "unit": "m", "sigma": 0.01}
    motion = {"kind": "product", "models": [EXTENDED["estimator"]["motion"], drift]}
    parts = {"estimator": {"kind": "ekf", "motion": motion},
             "sensors": {"radar": add | {"of": {"kind": "range_bearing", "sigma_range": 5.0, "sigma_bearing": 0.005}}},
             "birth": {"kind": "given", "start": START | {"range_bias": [0, 20]}}}  # fmt: skip
    report = consistency(tracker(bearing=1.0), world=vedette.build(LINEAR | parts))
    assert "error covariance" in wrong(report)
