"""What a birth may begin tracks with is checked when the tracker is built, and said with its place."""

import pytest

import vedette
from vedette import ConfigError

CONFIG = {
    "estimator": {"kind": "kalman", "motion": {"kind": "constant_velocity", "sigma_accel": 1.0}},
    "sensors": {"radar": {"kind": "cartesian_position", "sigma": 5.0, "clutter_density": 1e-6}},
    "associator": {"kind": "pda"},
    "lifecycle": {"kind": "existence", "delete": 0.05},
    "birth": {"kind": "from_returns", "spread": {"vx": 10.0, "vy": 10.0}},
}


def built(lifecycle="existence", **birth):
    return vedette.build(CONFIG | {"lifecycle": {"kind": lifecycle}, "birth": CONFIG["birth"] | birth})


@pytest.mark.parametrize("axis", ["vx", "x"])
def test_a_negative_spread_is_refused(axis):
    spread = {"vx": 10.0, "vy": 10.0, axis: -3.0}
    with pytest.raises(ConfigError, match=rf"birth\.spread\.{axis}: must be >= 0, got -3"):
        built(spread=spread)


def test_tracks_that_would_end_at_once_are_refused():
    with pytest.raises(ConfigError, match=r"birth: must begin tracks.*got 0\.03"):
        built(initial=0.03)
    built(initial=0.05)
    built("m_of_n", initial=0.03)


def test_a_tracker_knows_its_starters():
    config = CONFIG | {"sensors": CONFIG["sensors"] | {"beacon": CONFIG["sensors"]["radar"]}}
    tracker = vedette.build(config | {"birth": CONFIG["birth"] | {"sensors": ["beacon"]}})
    assert tracker.starters == {"beacon"}
    empty = tracker.start()
    assert len(tracker.step(empty, vedette.Scan(0.0, "radar", [[1.0, 2.0]])).ids) == 0
    assert len(tracker.step(empty, vedette.Scan(0.0, "beacon", [[1.0, 2.0]])).ids) == 1
