"""Runs that know so little of their target that there is no end to the clutter around it."""

import numpy as np
import pytest

import vedette
from vedette.types import Detections, Scan
from vedette_report.whole_trackers.judging import consistency
from vedette_report.whole_trackers.runs import MOST_FALSE, _False
from vedette_report.whole_trackers.world import World

CONFIG = {
    "estimator": {"kind": "ekf", "motion": {"kind": "target_oriented", "sigma_forward": 3.0, "sigma_side": 30.0}},
    "sensors": {
        "radar": {"kind": "cartesian_position", "sigma": 20.0, "clutter_density": 1e-4, "detection_probability": 0.8}
    },
    "gate": {"probability": 0.99966},
    "associator": {"kind": "pda"},
    "birth": {"kind": "given", "start": {"x": [0.0, 20.0], "y": [0.0, 20.0]}, "spread": {"vx": 20, "vy": 20}},
    "lifecycle": {"kind": "single_target"},
}
PRIOR = {"x": (0.0, 20.0), "y": (0.0, 20.0), "vx": (-8.3, 20.0), "vy": (-399.9, 20.0)}


@pytest.mark.parametrize("variance", [1e9, 1e200, 1.7e308, np.inf, np.nan])
def test_clutter_without_end_is_not_drawn(variance):
    tracker = vedette.build(CONFIG)
    z = np.zeros((3, 1, 2))
    scan = Scan(1.0, "radar", Detections(z, np.ones((3, 1), dtype=bool)))
    S = np.stack([np.diag([scale, scale]) for scale in (variance, 400.0, variance)])
    drawn = _False(World(tracker.estimator, tracker.sensors), np.random.default_rng(1), np.array([False, False, True]))
    both, counted = drawn.added(tracker, scan, z[:, 0], S)
    assert drawn.drowned.tolist() == [True, False, True]
    counts = both.detections.valid.sum(axis=1)
    assert np.array_equal(counted[0], counts - 1)
    assert np.all(counted[1] >= counted[0])
    assert np.allclose(counted[2], counted[1] / 1.3)  # the bound that candidates are thinned from
    assert counts[0] == counts[2] == 1
    assert 1 < counts[1] < MOST_FALSE


def test_a_tracker_that_drowns_in_clutter_is_judged_to_have_lost_its_target():
    report = consistency(CONFIG, prior=PRIOR, runs=30, scans=30)
    (lost,) = (verdict for verdict in report.verdicts if verdict.name == "lost")
    assert lost.figure > 0.5
    assert not lost.inside
