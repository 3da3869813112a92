"""Which number a path names, what is said where it names none, and what changes with it."""

import numpy as np
import pytest

import vedette
from vedette.errors import ConfigError
from vedette.units import in_unit
from vedette_tools.tuning.parameters import applied, read_free

CONFIG = {
    "estimator": {
        "kind": "imm",
        "transition": [[0.9, 0.08, 0.02], [0.2, 0.7, 0.1], [0.1, 0.1, 0.8]],
        "modes": [
            {"kind": "ekf", "motion": {"kind": "constant_velocity", "sigma_accel": accel}} for accel in (0.1, 1.0, 9.0)
        ],
    },
    "sensors": {
        "radar": {"kind": "range_bearing", "sigma_range": 5.0, "sigma_bearing": "1 deg", "detection_probability": 0.9},
        "fix": {"kind": "linear", "axes": ["x", "y"], "R": [[4.0, 0.0], [0.0, 9.0]]},
    },
    "associator": {"kind": "jpda"},
    "birth": {"kind": "from_returns", "spread": {"vx": 1.0, "vy": 2.0}, "sensors": ["radar"]},
    "lifecycle": {"kind": "existence"},
}


def loaded():
    return vedette.load(CONFIG)


@pytest.fixture(scope="module")
def experiment():
    return loaded()


def test_of_a_covariance_the_mirror_image_follows(experiment):
    (free,) = read_free(experiment, ["sensors.fix.R[0][1]=-3..3"])
    assert (free.kept, free.scale) == ("mirror", "linear")
    assert applied(experiment, [free], [1.5]).tracker.sensors["fix"].R.tolist() == [[4.0, 1.5], [1.5, 9.0]]
    (free,) = read_free(experiment, ["sensors.fix.R[1][1]"])
    assert applied(experiment, [free], [2.0]).tracker.sensors["fix"].R.tolist() == [[4.0, 0.0], [0.0, 2.0]]


def test_ranges_have_units_and_scales(experiment):
    accel, bearing, detected, spread = read_free(
        experiment,
        [
            "estimator.modes[1].motion.sigma_accel=0.1 m/s^2..1 g",
            "sensors.radar.sigma_bearing=0.1..5 deg",
            "sensors.radar.detection_probability",
            "birth.spread.vx",
        ],
    )
    assert (accel.low, accel.high, accel.scale) == (0.1, in_unit("1 g", "m/s^2"), "log")
    assert (bearing.low, bearing.high) == pytest.approx((np.deg2rad(0.1), np.deg2rad(5)))
    assert (detected.low, detected.high, detected.scale) == (pytest.approx(9 / 19), pytest.approx(90 / 91), "logit")
    assert (spread.low, spread.high, spread.start) == (0.1, 10.0, 1.0)
    for each in (accel, bearing, detected, spread):
        assert each.value(each.position(each.start)) == pytest.approx(each.start)
        slope = (each.value(np.array(0.4 + 1e-6)) - each.value(np.array(0.4 - 1e-6))) / 2e-6
        assert each.slope(0.4) == pytest.approx(slope, rel=1e-6)


def test_a_transition_takes_from_its_diagonal(experiment):
    free = read_free(experiment, ["estimator.transition[0][1]=0.01..0.4", "estimator.transition[0][2]=0.01..0.4"])
    assert [each.scale for each in free] == ["logit", "logit"]
    changed = applied(experiment, free, [0.3, 0.1]).tracker
    assert changed.estimator.transition[0] == pytest.approx([0.6, 0.3, 0.1])
    assert np.array_equal(changed.estimator.transition[1], experiment.tracker.estimator.transition[1])
    assert experiment.tracker.estimator.transition[0][1] == 0.08


@pytest.mark.parametrize(
    ("free", "said"),
    [
        ("estimator.modes[1].motion.sigma_acel=1..2", "did you mean 'sigma_accel'?"),
        ("estimator.modes[3].motion.sigma_accel", "has [0] to [2], there is no [3]"),
        ("sensor.radar.sigma_range", "did you mean 'sensors'?"),
        ("sensors.rader.sigma_range", "there is no sensors.rader; did you mean 'radar'?"),
        ("sensors.radar", "is the component 'range_bearing', not a number"),
        ("gate.clutter", "is the word 'sensor', not a number"),
        ("gate.largest_distance", "is nothing: state the range"),
        ("associator.exact=1..5", "is a whole number"),
        ("estimator.transition", "holds 3 x 3 numbers: name one, as estimator.transition[0][0]"),
        ("estimator.transition[0][0]", "cannot change alone: free"),
        ("estimator.transition[0][5]", "there is no [0, 5] in it"),
        ("estimator.transition[0][1]=0.1..1.5", "probabilities must be >= 0, got -0.5"),
        ("source.path", "is not in what can"),
        ("sensors.radar.sigma_range=3..1", "the range must go up, got 3 m to 1 m"),
        ("sensors.radar.sigma_range=0..1", "must begin above 0"),
        ("sensors.radar.sigma_range=1..5 deg", "must be in m or km"),
        ("sensors.radar.sigma_range=7", "must be written low..high, as in '0.01..1 m'"),
        ("sensors.radar.detection_probability=0.5..1.5", "must be >= 0 and <= 1, got 1.5"),
        ("", "must be a path.to.key"),
    ],
)
def test_what_cannot_be_tuned_is_said(experiment, free, said):
    with pytest.raises(ConfigError) as error:
        read_free(experiment, [free])
    assert said in str(error.value)
    assert str(error.value).startswith("--free")


def test_all_that_is_wrong_is_said_at_once(experiment):
    with pytest.raises(ConfigError) as error:
        read_free(experiment, ["sensors.radar.sigma=1..2", "gate.clutter", "birth.spread.vx", "birth.spread.vx"])
    assert len(error.value.problems) == 3
    assert "is given twice" in str(error.value)
    with pytest.raises(ConfigError, match="names nothing"):
        read_free(experiment, [])
