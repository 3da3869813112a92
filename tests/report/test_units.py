"""Words and axes of a report: the unit that is meant, and no rounding told as a figure."""

import numpy as np
import pytest
from attrs import evolve

import vedette
from vedette.metrics import Score
from vedette.testing.counterexamples import way_of
from vedette_report.summary.words import summary

CONFIG = {
    "estimator": {"kind": "kalman", "motion": {"kind": "constant_velocity", "sigma_accel": 1.0}},
    "sensors": {"radar": {"kind": "cartesian_position", "sigma": 5.0}},
    "associator": {"kind": "gnn"},
    "birth": {"kind": "from_returns", "spread": {"vx": 10.0, "vy": 10.0}},
    "lifecycle": {"kind": "m_of_n"},
    "source": {
        "kind": "simulation",
        "duration": 10.0,
        "looks": {"radar": {"interval": 1.0}},
        "ships": {"one": {"start": [0.0, 0.0]}},
    },
}


def test_rounding_is_no_bias():
    experiment = vedette.load(CONFIG)
    score = Score(10, 1, position_rmse_m=1.0, coverage=1.0, bias_m=(-3.6e-15, 0.25), id_switches=0)
    assert "(0, 0.25) m" in summary(experiment, experiment.run(), score)


@pytest.mark.costly
def test_axes_of_errors_have_the_unit_of_the_tracks(monkeypatch):
    pytest.importorskip("matplotlib")
    from vedette_report.drawing import errors as page

    experiment = vedette.load(CONFIG)
    result = experiment.run()
    for unit in ("m", "px"):
        monkeypatch.setattr(page, "length_unit", lambda _, unit=unit: unit)
        labels = [axes.get_ylabel() for axes in page.errors(experiment, result).axes]
        assert labels[:2] == [f"position error [{unit}]", f"velocity error [{unit}/s]"]


def test_an_error_is_told_with_the_method_that_raised_it():
    sensor = vedette.load(CONFIG).tracker.sensors["radar"]
    with pytest.raises((ValueError, IndexError)) as raised:
        sensor.invert(np.zeros((2, 5)), np.zeros(3))
    assert way_of(raised.value)[0] == "cartesian_position.invert "
    assert way_of(ValueError("of nobody")) == ("", "")
    assert evolve(sensor).kind == "cartesian_position"
