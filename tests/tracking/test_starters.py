"""Which sensors may start tracks: those that cannot are left out, unless a config names them."""

import pytest

import vedette
from vedette_report.summary.words import summary

RADAR, EARS = {"kind": "cartesian_position", "sigma": 5.0}, {"kind": "bearing_only", "sigma_bearing": 0.01}
BIASED = {"kind": "biased", "of": RADAR, "add": {"x": "bias"}}


def experiment(sensors, birth=None, **more):
    return vedette.load(
        {
            "estimator": {"kind": "ekf", "motion": {"kind": "constant_velocity", "sigma_accel": 1.0}},
            "sensors": sensors,
            "associator": {"kind": "gnn"},
            "birth": {"kind": "from_returns", "spread": {"vx": 5.0, "vy": 5.0}} | (birth or {}),
            "lifecycle": {"kind": "m_of_n"},
        }
        | more
    )


def test_a_sensor_that_cannot_start_tracks_is_left_out_and_told(tmp_path):
    (tmp_path / "d.csv").write_text("t,x,y\n" + "".join(f"{i},0,0\n" for i in range(5)))
    detections = {"time": "t", "columns": {"x": "x", "y": "y"}, "sensor": "radar"}
    source = {"kind": "csv", "path": str(tmp_path / "d.csv"), "detections": detections}
    made = experiment({"radar": RADAR, "ears": EARS}, source=source)
    assert made.tracker.starters == {"radar"}
    result = made.run()
    assert len(result.tracks) == 1
    assert "ears starts no tracks" in summary(made, result, result.score())


DRIFTING = {"kind": "gauss_markov", "axes": ["bias"], "tau": 3.0, "sigma": 1.0, "unit": "m"}
MOTION = {"kind": "product", "models": [{"kind": "constant_velocity", "sigma_accel": 1.0}, DRIFTING]}


@pytest.mark.parametrize(
    ("sensors", "birth", "place"),
    [
        ({"radar": RADAR, "ears": EARS}, {"sensors": ["ears"]}, "birth.sensors"),
        ({"ears": EARS}, {}, "birth"),
        ({"radar": RADAR, "other": BIASED}, {}, "sensors.other.spread"),
    ],
)
def test_what_a_config_names_or_lacks_is_refused_at_its_place(sensors, birth, place):
    spread = {"spread": {"vx": 5.0, "vy": 5.0, "bias": 1.0}}
    with pytest.raises(vedette.ConfigError) as caught:
        experiment(sensors, spread | birth, estimator={"kind": "ekf", "motion": MOTION})
    assert str(caught.value).partition(": ")[0] == place
