"""Scenes drawn for many runs at once: each run is what it would be alone, and what the sensor and the motion say it is."""

import numpy as np
import pytest

import vedette
from vedette.metrics.consistency import nees
from vedette_study.lockstep import run_together

CLUTTER = {"x": {"low": -500, "high": 500}, "y": {"low": -500, "high": 500}}
START = {"x": [0, 10], "y": [0, 10], "vx": [5, 2], "vy": [3, 2]}


def experiment(look=None, sensor=None, source=None):
    cv = {"kind": "constant_velocity", "sigma_accel": 0.5}
    return vedette.load(
        {
            "source": {
                "kind": "simulation",
                "duration": 20,
                "looks": {"radar": {"interval": 1} | (look or {})},
                "drawn": {"boat": {"models": [cv], "start": START}},
                **(source or {}),
            },
            "sensors": {"radar": {"kind": "cartesian_position", "sigma": 5.0} | (sensor or {})},
            "estimator": {"kind": "kalman", "motion": cv},
            "gate": {"probability": 0.999999},
            "associator": {"kind": "pda"},
            "birth": {"kind": "given", "start": START},
            "lifecycle": {"kind": "single_target"},
        }
    )


def generators(runs, seed=1):
    return [np.random.default_rng(np.random.SeedSequence(seed, spawn_key=(i,))) for i in runs]


def scenes(made, runs):
    return made.source.open_together(made.tracker.sensors, generators(runs))


TURNS = {
    "drawn": {
        "boat": {
            "models": [
                {"kind": "constant_velocity", "sigma_accel": 0.5},
                {"kind": "known_turn", "turn_rate": 0.1, "sigma_accel": 0.5},
            ],
            "transition": [[0.9, 0.1], [0.2, 0.8]],
            "start": START,
        }
    }
}
CASES = {
    "plain": {},
    "clutter": {"look": {"clutter": CLUTTER}, "sensor": {"clutter_density": 1e-5, "detection_probability": 0.8}},
    "jumps": {"source": TURNS},
    "ship": {"source": {"drawn": {}, "ships": {"boat": {"start": [0, 0], "course": 0.3, "speed": 5}}}},
}


@pytest.mark.parametrize("case", CASES)
def test_a_run_is_the_same_alone_and_among_others(case):
    made = experiment(**CASES[case])
    many = scenes(made, range(7))
    alone = scenes(made, [4])
    np.testing.assert_allclose(many.states[4], alone.states[0], rtol=0, atol=1e-12)
    for scan, own in zip(many.scans, alone.scans, strict=True):
        assert scan.time == own.time
        np.testing.assert_allclose(
            scan.detections.z[4][scan.detections.valid[4]], own.detections.z[0][own.detections.valid[0]], rtol=0, atol=1e-12
        )
    assert case == "ship" or not np.array_equal(many.states[3], many.states[4])


def test_returns_are_as_many_and_where_the_sensor_says():
    """20 scans of 2,000 runs: the counts and places are independent, so the bands are 4 standard errors of their means."""
    made = experiment(**CASES["clutter"])
    found = scenes(made, range(2000))
    counts = np.array([np.sum(scan.detections.valid, axis=1) for scan in found.scans], dtype=float)
    assert np.mean(counts) == pytest.approx(0.8 + 10.0, abs=4 * np.sqrt((10.0 + 0.16) / counts.size))
    z = np.concatenate([scan.detections.z[scan.detections.valid] for scan in found.scans])
    far = z[(np.abs(z) <= 500).all(axis=1) & (np.hypot(*z.T) > 300)]
    assert np.mean(far, axis=0) == pytest.approx([0, 0], abs=4 * 330 / np.sqrt(len(far)) + 1.0)


@pytest.mark.costly
def test_the_target_s_return_stands_anywhere_among_the_others():
    made = experiment(look={"clutter": CLUTTER}, sensor={"clutter_density": 4e-6})
    first = scenes(made, range(3000)).scans[0].detections
    near = np.hypot(*np.moveaxis(first.z, -1, 0)) < 60
    rank = [
        np.flatnonzero(n & v)[0] / (np.sum(v) - 1)
        for n, v in zip(near, first.valid, strict=True)
        if np.sum(v) > 1 and (n & v).any()
    ]
    assert np.mean(rank) == pytest.approx(0.5, abs=4 * np.sqrt(0.25 / len(rank)))


@pytest.mark.parametrize(("factor", "matched"), [(1.0, True), (1.3, False)])
def test_a_matched_filter_is_consistent_and_a_wrong_one_is_not(factor, matched):
    """Mean NEES of the last scan over 3,000 runs is 4 within 4 standard errors, sqrt(8 / 3000)."""
    made = experiment()
    found = scenes(made, range(3000))
    tracker = made.tracker
    given = tracker.given(vedette.Recording(()))
    prior = vedette.Gaussian(np.broadcast_to(given.mean, (3000, 1, 4)), np.broadcast_to(given.cov, (3000, 1, 4, 4)))
    runs = run_together(tracker, prior, found.scans[0].time, found.scans)
    error = factor * tracker.state.difference(found.states[:, -1], runs.mean[:, -1])
    assert (abs(np.mean(nees(error, runs.cov[:, -1])) - 4) < 4 * np.sqrt(8 / 3000)) == matched


@pytest.mark.parametrize(
    "case",
    [
        {"look": {"jitter": 0.2}},
        {"source": {"ships": {"other": {"start": [0, 0], "course": 0, "speed": 5}}}},
        {"source": {"drawn": {"boat": {"models": [{"kind": "constant_velocity"}], "start": START, "disappears": 5}}}},
    ],
)
def test_what_cannot_be_drawn_so_is_left_to_each_run(case):
    if "drawn" in case.get("source", {}):
        case["source"]["drawn"]["boat"]["models"][0]["sigma_accel"] = 0.5
    assert scenes(experiment(**case), range(3)) is None
