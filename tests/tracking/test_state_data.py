"""States as plain data: back to the last bit, for every estimator, associator, birth and lifecycle; nothing else is read."""

import json

import numpy as np
import pytest
from attrs import evolve

import vedette
from vedette import Detections, InputError, Scan
from vedette.config.registry import Registry
from vedette.tracking import state_data

MOTION = {"kind": "constant_velocity", "sigma_accel": 0.5}
BASE = {
    "estimator": {"kind": "kalman", "motion": MOTION},
    "sensors": {
        "radar": {"kind": "cartesian_position", "sigma": 5.0, "detection_probability": 0.9, "clutter_density": 1e-6}
    },
    "associator": {"kind": "jpda"},
    "birth": {"kind": "from_returns", "spread": {"vx": 10.0, "vy": 10.0}},
    "lifecycle": {"kind": "existence", "lifetime": 600, "confirm": 0.99, "delete": 0.01},
}
POISSON = {
    "kind": "poisson",
    "appear": [{"axes": {"x": [0, 300], "y": [0, 300], "vx": [0, 5], "vy": [0, 5]}, "initial": 3.0, "rate": 0.01}],
}
TURN = {"kind": "coordinated_turn", "sigma_accel": 0.1, "sigma_turn": 0.01}
CHANGES = {
    **{f"associator {kind}": {"associator": {"kind": kind}} for kind in ("gnn", "pda", "k_best", "n_scan", "lmb")},
    **{
        f"estimator {kind}": {"estimator": {"kind": kind, "motion": MOTION}}
        for kind in ("ekf", "ukf", "srkf", "iekf", "bootstrap_particles", "ensemble_kalman")
    },
    "imm": {
        "estimator": {
            "kind": "imm",
            "modes": [{"kind": "kalman", "motion": MOTION}, {"kind": "kalman", "motion": {**MOTION, "sigma_accel": 5.0}}],
            "transition": [[0.95, 0.05], [0.1, 0.9]],
        }
    },
    "lifecycle m_of_n": {"lifecycle": {"kind": "m_of_n"}},
    "lifecycle score": {"lifecycle": {"kind": "score"}},
}


def scans(count, seed=2):
    rng = np.random.default_rng(seed)
    start, velocity = rng.uniform(-100, 100, (3, 2)), rng.normal(0, 3, (3, 2))
    for i in range(count):
        z = start + velocity * i + rng.normal(0, 5, (3, 2))
        z = np.concatenate([z[rng.random(3) < 0.9], rng.uniform(-200, 200, (2, 2))])
        yield Scan(float(i), "radar", Detections(z, np.ones(len(z), bool), identity=np.arange(len(z)) % 3 - 1))


def through(tracker, state, todo):
    for scan in todo:
        state = tracker.step(state, scan)
    return state


def leaves(value):
    """Return all numbers of a state in order, as text that tells apart what differs in one bit."""
    return json.dumps(state_data.to_data(value))


@pytest.mark.parametrize("changed", CHANGES.values(), ids=CHANGES)
def test_a_state_goes_on_from_its_data_to_the_last_bit(changed):
    try:
        tracker = vedette.build({**BASE, **changed})
    except vedette.ConfigError as error:
        pytest.fail(str(error))
    todo = list(scans(14))
    half = through(tracker, tracker.start(seed=5), todo[:7])
    again = tracker.state_from(json.loads(json.dumps(half.to_data(), allow_nan=False)))
    assert leaves(again) == leaves(half)
    assert leaves(through(tracker, again, todo[7:])) == leaves(through(tracker, half, todo[7:]))


@pytest.mark.parametrize(
    ("damage", "place"),
    [
        (lambda data: {}, "state"),
        (lambda data: {**data, "version": 7}, "state"),
        (lambda data: {**data, "state": []}, "state"),
        (lambda data: changed_in(data, "belief", {"value": "subprocess.Popen", "parts": {}}), "state.belief"),
        (lambda data: changed_in(data, "belief", {"value": "vedette.types.Gaussian", "parts": {}}), "state.belief"),
        (lambda data: changed_in(data, "ids", {"array": "<i8", "shape": [10**12], "bytes": ""}), "state.ids"),
        (lambda data: changed_in(data, "ids", {"array": "|O", "shape": [1], "bytes": "AAAAAAAAAAA="}), "state.ids"),
        (lambda data: changed_in(data, "ids", {"array": "<i8", "shape": [0], "bytes": ""}), "state"),
        (lambda data: changed_in(data, "ids", {"bytes": 3}), "state.ids"),
    ],
)
def test_what_is_no_state_of_this_tracker_is_refused_with_its_place(damage, place):
    tracker = vedette.build(BASE)
    data = json.loads(json.dumps(through(tracker, tracker.start(), scans(4)).to_data()))
    with pytest.raises(InputError) as refused:
        tracker.state_from(damage(data))
    assert str(refused.value).startswith(f"{place}:")


def changed_in(data, name, value):
    parts = {**data["state"]["parts"], name: value}
    return {**data, "state": {**data["state"], "parts": parts}}


def test_the_state_of_another_estimator_is_refused():
    tracker, other = vedette.build(BASE), vedette.build({**BASE, **CHANGES["imm"]})
    data = through(tracker, tracker.start(), scans(4)).to_data()
    with pytest.raises(InputError, match="state"):
        other.state_from(data)


def test_what_cannot_be_written_is_refused_with_its_place():
    tracker = vedette.build(BASE)
    with pytest.raises(TypeError, match=r"state\.memory"):
        evolve(tracker.start(), memory={1, 2}).to_data()


def test_every_kind_of_estimator_starts_with_a_belief_that_can_be_written():
    kinds = [entry.kind for entry in Registry.installed().of_role("estimator")]
    written = 0
    for kind in kinds:
        try:
            tracker = vedette.build({**BASE, "estimator": {"kind": kind, "motion": MOTION}})
        except vedette.ConfigError:
            continue
        assert state_data.read(json.loads(json.dumps(tracker.start().to_data())), tracker.start()).steps == 1
        written += 1
    assert written >= 10
