"""A batch of runs in one call of the estimator is what each run is alone, and what the step's four parts make of it."""

import numpy as np
import pytest
from attrs import evolve

import vedette
from vedette import Detections, Gaussian, Scan, kernels
from vedette.tracking import tracker as home
from vedette_standard.estimators.kalman import Kalman

RUNS = 21


FLAT = {"kind": "cartesian_position", "sigma": 2.0, "clutter_density": 1e-3}
SCENES = {  # clutter over an area is not uniform in range and bearing, and needs the long way
    "linear": ("kalman", FLAT),
    "polar": ("ekf", {"kind": "range_bearing", "sigma_range": 2.0, "sigma_bearing": 0.02}),
    "flat": ("ekf", FLAT),
}


def built(associator="pda", scene="linear"):
    estimator, sensor = SCENES[scene]
    return vedette.build(
        {
            "estimator": {"kind": estimator, "motion": {"kind": "constant_velocity", "sigma_accel": 0.5}},
            "sensors": {"radar": sensor | {"detection_probability": 0.9}},
            "associator": {"kind": associator},
            "birth": {"kind": "given", "start": {axis: [0.0, 1.0] for axis in ("x", "y", "vx", "vy")}},
            "lifecycle": {"kind": "single_target"},
        }
    )


def begun(tracker, runs):
    rng = np.random.default_rng(3)
    mean = rng.normal(size=(RUNS, 1, 4)) * [50.0, 50.0, 3.0, 3.0]
    cov = np.broadcast_to(np.diag([100.0, 100.0, 9.0, 9.0]), (RUNS, 1, 4, 4))
    return tracker.start(Gaussian(mean[runs], cov[runs]), 0.0)


def scans_of(tracker, k, steps=5):
    """Returns near the tracks and far from them, at uneven times, two scans at one time."""
    rng, x = np.random.default_rng(4), np.array(begun(tracker, slice(None)).belief.mean[:, 0, :2])
    sensor = tracker.sensors["radar"]
    for i in range(steps):
        at = x[:, None] + rng.normal(size=(RUNS, k, 2)) * rng.choice([2.0, 9.0, 90.0], (RUNS, k, 1))
        yield 0.7 * (i + 1 - (i == 3)), sensor.measurement.canonical(sensor.measure(at))


def calls_of(monkeypatch):
    """Whether scans were taken in one call, in their order."""
    taken, usual = [], home.in_one_call

    def noted(*given):
        after = usual(*given)
        taken.append(after is not None)
        return after

    monkeypatch.setattr(home, "in_one_call", noted)
    return taken


@pytest.mark.parametrize("associator", ["pda", "nearest", "gnn"])
@pytest.mark.parametrize("scene", SCENES)
@pytest.mark.parametrize("k", [0, 1, 4, 5])
def test_runs_together_are_each_alone(associator, scene, k, monkeypatch):
    taken, tracker = calls_of(monkeypatch), built(associator, scene)
    state, scans = begun(tracker, slice(None)), [*scans_of(tracker, k)]
    for time, z in scans:
        state = tracker.step(state, Scan(time, "radar", Detections.of(z)))
    assert len(taken) == 5
    whole = [begun(tracker, i) for i in range(RUNS)]
    for time, z in scans:
        whole = [tracker.step(one, Scan(time, "radar", Detections.of(z[i]))) for i, one in enumerate(whole)]
    assert taken[5:] == np.repeat(taken[:5], RUNS).tolist()
    monkeypatch.setattr(home, "in_one_call", lambda *given: None)
    alone = [begun(tracker, i) for i in range(RUNS)]
    for time, z in scans:
        alone = [tracker.step(one, Scan(time, "radar", Detections.of(z[i]))) for i, one in enumerate(alone)]
    # more returns than an associator promises to solve exactly, and a scan at the time of the one before, go the long way
    has_twins = scene != "polar" or kernels.RUNNING.startswith("compiled")
    assert taken[:5] == [has_twins and k <= 4 and i != 3 for i in range(5)]
    shown = tracker.estimate(state)
    for i, (one, other) in enumerate(zip(alone, whole, strict=True)):
        found = tracker.estimate(one)
        np.testing.assert_allclose(tracker.estimate(other).cov, found.cov, rtol=1e-11, atol=1e-11)
        np.testing.assert_allclose(other.distances, one.distances, rtol=1e-10, atol=1e-12)
        np.testing.assert_allclose(shown.mean[i], found.mean, rtol=1e-11, atol=1e-11)
        np.testing.assert_allclose(shown.cov[i], found.cov, rtol=1e-11, atol=1e-11)
        np.testing.assert_allclose(state.weights[i], one.weights, rtol=1e-11, atol=1e-14)
        np.testing.assert_allclose(state.distances[i], one.distances, rtol=1e-10, atol=1e-12)
    assert (state.steps, state.time) == (alone[0].steps, alone[0].time)
    assert k == 0 or 0.0 < np.mean(state.weights[..., 0]) < 1.0


@pytest.mark.parametrize(
    "own",
    [
        {},
        {"valid": np.broadcast_to([True, False], (RUNS, 2))},
        {"noise": np.broadcast_to(9.0 * np.eye(2), (RUNS, 2, 2, 2))},
        {"evidence": np.full((RUNS, 2), 0.5)},
    ],
    ids=lambda own: "".join(own) or "nothing",
)
def test_what_returns_state_of_their_own_goes_the_long_way(own, monkeypatch):
    taken, tracker = calls_of(monkeypatch), built()
    seen = evolve(Detections.of(np.random.default_rng(5).normal(size=(RUNS, 2, 2))), **own)
    tracker.step(begun(tracker, slice(None)), Scan(1.0, "radar", seen))
    assert taken == [not own]


def test_one_run_is_one_call_and_tracks_side_by_side_go_the_long_way(monkeypatch):
    taken, tracker = calls_of(monkeypatch), built()
    tracker.step(begun(tracker, 0), Scan(1.0, "radar", Detections.of(np.zeros((1, 2)))))
    assert taken.pop()
    two = tracker.start(Gaussian(np.zeros((RUNS, 2, 4)), np.broadcast_to(np.eye(4), (RUNS, 2, 4, 4))), 0.0)
    tracker.step(two, Scan(1.0, "radar", Detections.of(np.zeros((RUNS, 1, 2)))))
    assert taken == [False]


class OwnUpdate(Kalman):
    """Takes twice the step that a Kalman filter takes."""

    kind = "test_own_update"

    def update(self, belief, innovation, weights):
        after = Kalman.update(self, belief, innovation, weights)
        return Gaussian(2.0 * after.mean - belief.mean, after.cov)


def test_a_filter_with_a_part_of_its_own_goes_the_long_way(monkeypatch):
    taken, tracker = calls_of(monkeypatch), built()
    own = evolve(tracker, estimator=OwnUpdate(tracker.estimator.motion))
    start, scan = begun(tracker, slice(None)), Scan(1.0, "radar", Detections.of(np.zeros((RUNS, 1, 2))))
    usual, twice = (one.estimate(one.step(start, scan)).mean for one in (tracker, own))
    assert taken == [True]
    ahead = tracker.estimate(start, 1.0).mean
    np.testing.assert_allclose(twice - ahead, 2.0 * (usual - ahead), rtol=1e-9, atol=1e-9)
