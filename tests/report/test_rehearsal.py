"""A target played to a tracker, which never begins, never confirms, or often loses it; and tracks that lie on each other."""

import numpy as np
import pytest
from attrs import evolve

import vedette
from vedette import Detections, Scan, Track
from vedette_report.warnings.coalescence import coalesced
from vedette_report.warnings.rehearsal import rehearsed, silenced

MOTION = {"kind": "constant_velocity", "sigma_accel": 0.3}
RADAR = {"kind": "cartesian_position", "sigma": 5.0, "detection_probability": 0.9, "clutter_density": 1e-6}
RETURNS = {"kind": "from_returns", "spread": {"vx": 5.0, "vy": 5.0}}
GOOD = {"estimator": {"kind": "kalman", "motion": MOTION}, "sensors": {"radar": RADAR}, "associator": {"kind": "jpda"},
        "birth": RETURNS, "lifecycle": {"kind": "existence"}}  # fmt: skip


def scans(dt=1.0):
    rng = np.random.default_rng(3)
    return [Scan(dt * i, "radar", Detections.of(rng.uniform(0, 1000, (5, 2)))) for i in range(12)]


def said(**parts):
    return [place for place, _, _ in rehearsed(vedette.build(GOOD | parts), scans())]


@pytest.mark.parametrize("associator", ["gnn", "jpda", "k_best", "lmb"])
@pytest.mark.by_turns
def test_nothing_is_said_of_a_tracker_that_can(associator):
    assert said(associator={"kind": associator}) == []


@pytest.mark.parametrize(
    ("place", "parts"),
    [
        ("birth", {"sensors": {"radar": {**RADAR, "clutter_density": 1e-2}}}),
        ("birth", {"birth": {**RETURNS, "spread": {"vx": 3000.0, "vy": 3000.0}}}),
        ("lifecycle", {"lifecycle": {"kind": "existence", "lifetime": 3.0, "confirm": 1.0 - 1e-9}}),
        ("lifecycle", {"sensors": {"radar": {**RADAR, "detection_probability": 0.3}},
                       "lifecycle": {"kind": "m_of_n", "hits": 2, "looks": 3, "misses": 3}}),
        ("lifecycle", {"sensors": {"radar": {**RADAR, "detection_probability": 0.35}},
                       "birth": {**RETURNS, "initial": 0.95},
                       "lifecycle": {"kind": "existence", "delete": 0.9, "confirm": 0.95, "lifetime": 30.0}}),
    ],
)  # fmt: skip
def test_what_cannot_work_is_said_where_it_is(place, parts):
    assert said(**parts) == [place]


def test_named_reports_stated_of_all_targets_that_end_the_tracks_of_others_are_told():
    """Of a radar's 30 boats the six with AIS were tracked, where its P_D was stated as 1, and nothing was said."""

    def told(p=1.0, life=None, named=True, names=(7, 8), alone=False):
        ais = {**RADAR, "detection_probability": p}
        made = vedette.build(
            GOOD
            | {"sensors": {"ais": ais} if alone else {"radar": RADAR, "ais": ais}}
            | ({"lifecycle": {"kind": life}} if life else {})
        )
        codes = [np.array([names[i % len(names)]]) if named else None for i in range(30)]
        reports = [Scan(float(i), "ais", Detections([[10.0, 10.0]], [True], identity=code)) for i, code in enumerate(codes)]
        return [place for place, _, _ in silenced(made, [*([] if alone else scans(2.0)), *reports])]

    assert told() == ["sensors.ais"]
    assert told(alone=True) == ["sensors.ais"]
    assert told(alone=True, names=(7,)) == told(p=0.5) == told(named=False) == told(life="m_of_n") == []


def track(number, y, count=30):
    space = vedette.build(GOOD).state
    mean = np.zeros((count, 4))
    mean[:, 0], mean[:, list(space.names).index("y")] = np.arange(count), y
    cov, sure = np.tile(np.eye(4), (count, 1, 1)), np.ones(count, dtype=bool)
    return Track(number, space, np.arange(count, dtype=float), mean, cov, sure, np.ones(count), None,
                 (np.ones(1),) * count, np.zeros(count), np.ones(count))  # fmt: skip


@pytest.mark.costly
def test_tracks_that_lie_on_each_other_are_counted():
    assert coalesced([track(1, 0.0), track(2, 0.4), track(7, 9.0)]) == [(1, 2, 30)]
    assert coalesced([track(1, 0.0), track(2, 1.0)]) == []
    assert coalesced([track(1, 0.0), track(2, 0.1, count=9)]) == []
    assert coalesced([]) == []
    twice = track(1, 0.0)
    assert coalesced([evolve(twice, times=twice.times // 2), track(7, 9.0)]) == []  # two sensors that look at a time
    waits = [evolve(track(i, 0.1 * i), cov=np.tile(1e6 * np.eye(4), (30, 1, 1)), hit=np.zeros(30)) for i in range(3)]
    assert coalesced(waits) == []  # unseen, they may be anywhere
    crowd = [track(i, 10.0 * i) for i in range(150)]
    assert coalesced([*crowd, track(200, 70.4)]) == [(7, 200, 30)]
