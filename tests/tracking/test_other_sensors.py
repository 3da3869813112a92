"""A sensor that cannot see a target changes nothing for it: with every birth, associator and lifecycle."""

import attrs
import numpy as np
import pytest

import vedette
from vedette import Detections, Scan
from vedette_standard.associators import growing
from vedette_standard.births import following
from vedette_standard.births.following import Waiting
from vedette_standard.lifecycles import limited

SIDE = 1000.0
WEST, EAST = {"x": {"low": -SIDE, "high": 0}}, {"x": {"low": 0, "high": SIDE}}
ELSEWHERE = {"x": {"low": 50e3, "high": 60e3}}
RADAR = {"kind": "cartesian_position", "sigma": 5.0, "detection_probability": 0.9, "clutter_density": 1e-5}
PLACE = {"x": [0, 800], "y": [0, 500], "vx": [0, 10], "vy": [0, 10]}
BIRTHS = {
    "from_returns": {"spread": {"vx": 10.0, "vy": 10.0}},
    "two_point": {"max_speed": 20.0},
    "three_point": {"max_speed": 20.0, "max_acceleration": 1.0},
    "uniform": {
        "view": {axis: {"low": -SIDE, "high": SIDE} for axis in "xy"},
        "spread": {"vx": 10.0, "vy": 10.0},
        "initial": 2.0,
        "rate": 0.02,
    },
    "poisson": {"appear": [{"at": PLACE, "initial": 4.0}]},
}
ASSOCIATORS = ["gnn", "pda", "jpda", "k_best", "lmb", "n_scan"]
"""`variational` iterates once a scan."""
LIVES = ["existence", "m_of_n", "score", "coast_limited"]
CASES = [(birth, by, "existence") for birth in BIRTHS for by in ASSOCIATORS]
CASES += [(birth, "jpda", life) for birth in BIRTHS for life in LIVES[1:]]
CASES = [(*case, seed) for case in CASES for seed in (1, 2)]
CASES += [("from_returns", "n_scan", "existence", seed) for seed in (5, 7, 14, 18, 19)]
SLOW = [(birth, "jpda", "existence", 1, 40) for birth in BIRTHS]


def tracker(birth, by="jpda", life="existence", **sensors):
    sensors = sensors or {"west": {**RADAR, "view": WEST}, "east": {**RADAR, "view": EAST}}
    motion = {"kind": "constant_velocity", "sigma_accel": 0.3}
    estimator = {"kind": "ekf", "motion": motion}
    parts = {"estimator": estimator, "sensors": sensors, "associator": {"kind": by}, "lifecycle": {"kind": life}}
    return vedette.build({**parts, "birth": {"kind": birth, **BIRTHS[birth]}})


def scene(seed, count=14):
    """Scans of the western radar: two targets, twenty false returns, at uneven times."""
    rng = np.random.default_rng(seed)
    start, velocity, time = rng.uniform([-800, -700], [-200, 700], (2, 2)), rng.normal(0, 6, (2, 2)), 0.0
    for _ in range(count):
        time += rng.uniform(0.5, 3.0)
        z = (start + velocity * time + rng.normal(0, 5, (2, 2)))[rng.random(2) < 0.9]
        yield Scan(
            time,
            "west",
            Detections.of(rng.permutation(np.concatenate([z, rng.uniform([-990, -990], [-10, 990], (20, 2))])), 2),
        )


def states(made, scans):
    state, after = made.start(seed=1), []
    for scan in scans:
        state = made.step(state, scan)
        after.append((scan.sensor, state, made.estimate(state)))
    return after


@pytest.mark.parametrize(("birth", "by", "life", "seed", "between"), [(*case, 1) for case in CASES] + SLOW)
@pytest.mark.by_turns
def test_scans_of_other_places_change_no_track(birth, by, life, seed, between):
    """Between two scans, and at their very time; and where another radar looks forty times as often."""
    two = {"west": RADAR, "far": {**RADAR, "view": ELSEWHERE}}
    made, alone, beside = tracker(birth, by, life, **two), list(scene(seed)), []
    for k, scan in enumerate(alone):
        beside.append(scan)
        if k + 1 < len(alone):
            gap = 0.0 if k % 3 == 0 else (alone[k + 1].time - scan.time) / (between + 1)
            beside += [Scan(scan.time + gap * (i + 1), "far", Detections.of([], 2)) for i in range(between)]
    confirmed = 0
    own = [each for each in states(made, beside) if each[0] == "west"]
    for (_, state, estimate), (_, other, same) in zip(states(made, alone), own, strict=True):
        assert len(state.ids) == len(other.ids)
        assert state.confirmed.tolist() == other.confirmed.tolist()
        np.testing.assert_allclose(other.existence, state.existence, atol=1e-9)
        np.testing.assert_allclose(same.mean, estimate.mean, atol=1e-6)
        np.testing.assert_allclose(same.cov, estimate.cov, atol=1e-6)
        confirmed += int(state.confirmed.sum())
    assert confirmed > 0, "the law says something"


@pytest.mark.parametrize("birth", BIRTHS)
@pytest.mark.by_turns
def test_each_of_two_radars_starts_the_tracks_of_its_own_half(birth):
    rng, made = np.random.default_rng(3), tracker(birth)
    state = made.start(seed=1)
    for k in range(60):
        side, name = (-1, "west") if k % 2 == 0 else (1, "east")
        z = [[side * (500.0 - 5.0 * k), 3.0 * k]] + rng.normal(0, 5, 2)
        false = rng.uniform([min(0, side * SIDE), -SIDE], [max(0, side * SIDE), SIDE], (10, 2))
        state = made.step(state, Scan(float(k), name, Detections.of(np.concatenate([z, false]))))
    assert state.confirmed.sum() == 2


@pytest.mark.parametrize("birth", BIRTHS)
def test_what_gives_no_position_stands_beside_what_does(birth):
    """Bearings start no track but with `poisson`, which knows how far off targets are; none of the radar is forgotten."""
    bearings = {"kind": "bearing_only", "sigma_bearing": 0.01, "detection_probability": 0.5, "clutter_per_scan": 1.0}
    made = tracker(birth, radar={**RADAR, "clutter_density": 1e-8}, bearings=bearings)
    state = made.start(seed=1)
    for k in range(12):
        state = made.step(state, Scan(2.0 * k, "radar", Detections.of([[-500.0 + 10.0 * k, 0.0]])))
        state = made.step(state, Scan(2.0 * k + 1.0, "bearings", Detections.of([[2.0]])))
    assert state.confirmed.sum() == 1


@pytest.mark.parametrize("birth", ["two_point", "three_point"])
@pytest.mark.parametrize(("apart", "most"), [(1.0, following.KEPT), (2.0, 600)])
@pytest.mark.by_turns
def test_what_nobody_looks_at_again_is_forgotten(apart, most, birth):
    """A ship that sails on for 700 scans remembers the newest returns, or those of ten minutes."""
    made = tracker(birth, radar={"kind": "range_bearing", "sigma_range": 5.0, "sigma_bearing": 0.01, "max_range": 100.0})
    state, largest = made.start(seed=1), 0
    for k in range(700):
        pose = vedette.Pose([300.0 * k, 0.0])
        state = made.step(state, Scan(apart * k, "radar", Detections.of([[50.0, 1.0], [60.0, 2.0]]), pose))
        (memory,) = state.unseen.values()
        largest = max(largest, len(getattr(memory, "last", memory).mean))
    assert largest == 2 + most
    assert state.born == 0


def test_decisions_after_so_many_scans_of_any_place_break_the_law(monkeypatch):
    monkeypatch.setattr(growing, "UNSEEN", -np.inf)
    for birth in ("uniform", "poisson"):
        with pytest.raises(AssertionError):
            test_scans_of_other_places_change_no_track(birth, "n_scan", "existence", 1, 1)


@pytest.mark.costly
def test_scans_that_end_what_they_cannot_see_break_the_law(monkeypatch):
    monkeypatch.setattr(limited, "UNSEEN", -1.0)
    for seed in (1, 5, 7, 14, 18, 19):
        with pytest.raises(AssertionError):
            test_scans_of_other_places_change_no_track("from_returns", "n_scan", "existence", seed, 1)


def test_decisions_made_twice_break_the_law(monkeypatch):
    decided = growing._decided
    monkeypatch.setattr(growing, "_decided", lambda found: attrs.evolve(decided(found), past=found.past))
    with pytest.raises(AssertionError):
        test_scans_of_other_places_change_no_track("three_point", "n_scan", "existence", 2, 1)


def test_births_that_forget_at_each_scan_break_the_law(monkeypatch):
    monkeypatch.setattr(Waiting, "outlasting", lambda self, sensor: self.of(slice(0)))
    for birth in ("two_point", "three_point"):
        with pytest.raises(AssertionError):
            test_scans_of_other_places_change_no_track(birth, "jpda", "existence", 1, 1)
