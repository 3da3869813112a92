"""A return beyond the gate of a confirmed track is weighed by its likelihood: the track's own begins no second one."""

import numpy as np
import pytest
from attrs import evolve

import vedette
from vedette import Detections, Gate, Scan
from vedette.tracking.gate import SensorGate

DT, SIGMA = 0.1, 0.2
UNIFORM = {
    "kind": "uniform",
    "view": {axis: {"low": -100.0, "high": 1100.0} for axis in "xy"},
    "spread": {"vx": 10.0, "vy": 10.0},
    "initial": 4.0,
    "rate": 0.01,
}
BIRTHS = {"from_returns": {"kind": "from_returns", "spread": {"vx": 10.0, "vy": 10.0}}, "uniform": UNIFORM}
SCENES = [(kind, "from_returns") for kind in ("nearest", "gnn", "pda", "jpda", "k_best", "lmb")] + [("jpda", "uniform")]


def tracker(kind="jpda", birth="from_returns", **more):
    motion = {"kind": "constant_velocity", "sigma_accel": 0.01}
    sensor = {"kind": "cartesian_position", "sigma": SIGMA, "detection_probability": 0.95, "clutter_density": 1e-7}
    parts = {"estimator": {"kind": "kalman", "motion": motion}, "sensors": {"lidar": sensor}, "associator": {"kind": kind}}
    return vedette.build({**parts, "birth": BIRTHS[birth], "lifecycle": {"kind": "existence"}, **more})


def straight(seed, scans=300):
    """Scans of four straight targets, 30 m apart, exactly as the tracker models them."""
    rng = np.random.default_rng(seed)
    place = np.column_stack([30.0 * np.arange(4), rng.uniform(-20, 20, 4)])
    velocity = np.column_stack([rng.uniform(-2, 2, 4), rng.uniform(5, 15, 4)])
    for k in range(scans):
        z = place + k * DT * velocity + SIGMA * rng.normal(size=(4, 2))
        yield Scan(k * DT, "lidar", Detections.of(rng.permutation(z[rng.random(4) < 0.95]), 2))


def beside(seed, apart, leaves):
    """Scans of a target, and from the 30th on of a second one, `apart` deviations beside it or leaving it at so many m/s."""
    rng = np.random.default_rng(seed)
    for k in range(60):
        own = np.array([0.0, 10.0 * k * DT])
        off = apart * (k - 30) * DT if leaves else apart * SIGMA
        places = np.array([own, own + [off, 0.0]] if k >= 30 else [own])
        z = places + SIGMA * rng.normal(size=places.shape)
        yield Scan(k * DT, "lidar", Detections.of(z[rng.random(len(z)) < 0.95], 2))


def confirmed(it, scans):
    """Return the ids of all tracks that were ever confirmed, and their number after each scan."""
    state, ids, counts = it.start(seed=0), set(), []
    for scan in scans:
        state = it.step(state, scan)
        ids |= set(state.ids[state.confirmed].tolist())
        counts.append(int(state.confirmed.sum()))
    return ids, counts


@pytest.mark.parametrize(("kind", "birth"), SCENES)
@pytest.mark.by_turns
def test_targets_as_they_are_modelled_begin_no_second_track(kind, birth):
    """As without a gate; each target's returns fall beyond it in one scan of a hundred."""
    it = tracker(kind, birth)
    for seed in range(8):
        assert len(confirmed(it, straight(seed))[0]) == 4


def test_with_the_gate_alone_second_tracks_begin(monkeypatch):
    real = SensorGate.__init__
    monkeypatch.setattr(SensorGate, "__init__", lambda *parts: real(*parts[:6], False))
    with pytest.raises(AssertionError):
        test_targets_as_they_are_modelled_begin_no_second_track("gnn", "from_returns")


@pytest.mark.parametrize(("apart", "leaves"), [(3.0, False), (5.0, False), (8.0, False), (3.0, True)])
@pytest.mark.by_turns
def test_a_second_target_near_a_track_begins_as_without_a_gate(apart, leaves):
    for seed in range(8):
        given = list(beside(seed, apart, leaves))
        found, exact = (confirmed(tracker(**more), given)[1] for more in ({}, {"gate": "off"}))
        assert found == exact
        assert found[-1] == 2


def test_what_is_beyond_counts_where_it_is_likelier_than_a_miss_and_the_track_is_confirmed():
    """At squared distances around the equal: P_D N(z; 0, S) / density = 1 - P_D P_G. A largest distance ends all."""
    it = tracker()
    state = it.start(vedette.Gaussian(np.zeros((1, 4)), np.diag([0.12, 0.12, 1.0, 1.0])[None]), 0.0)
    equal = 2 * np.log(0.95 / (2 * np.pi * 0.16) / 1e-7 / (1 - 0.95 * 0.99))
    for factor, there in ((0.99, True), (1.01, False)):
        z = [[np.sqrt(factor * equal * 0.16), 0.0]]
        taken = it.step(state, Scan(0.0, "lidar", Detections.of(z))).weights[0, 1:]
        assert (taken[0] > 0.4) == there == (taken[0] != 0)
        doubted = evolve(state, confirmed=np.array([False]))
        assert it.step(doubted, Scan(0.0, "lidar", Detections.of(z))).weights[0, 1] == 0
        ended = evolve(it, gate=Gate(largest_distance=20.0))
        assert ended.step(state, Scan(0.0, "lidar", Detections.of(z))).weights[0, 1] == 0


def test_what_counts_for_its_evidence_lies_within_reach():
    """Of many tracks those returns alone are looked at that do: evidence lets one count that is farther off."""
    it, state = tracker(), None
    for scan in straight(1, 30):
        state = it.step(it.start(seed=0) if state is None else state, scan)
    places = it.estimate(state, 3.0).mean[0, :2] + np.outer(np.arange(40), [0.1, 0.0])
    found = []
    for evidence in (None, np.full(40, 9.0)):
        detections = Detections(places, np.ones(40, dtype=bool), evidence)
        expected = it.expect(state, Scan(3.0, "lidar", detections))
        inside = np.isfinite(it.step(state, Scan(3.0, "lidar", detections)).gates.scores[0, 1:])
        found.append(np.max(expected.innovation.distance[0, inside]))
        assert expected.gate.threshold < found[-1] <= expected.reach[0, 0]
    assert found[1] > found[0] + 10.0
