"""The loop: pure, batched, and as it was after a scan that it refuses."""

import numpy as np
import pytest
from attrs import evolve

from vedette import Detections, Gate, Gaussian, Pose, Scan, ScanRefused, Tracker
from vedette.tracking.history import History
from vedette.tracking.intake import Intake
from vedette_standard.associators.global_nearest import GlobalNearest
from vedette_standard.associators.jpda import Jpda
from vedette_standard.associators.pda import Pda
from vedette_standard.births.from_returns import FromReturns
from vedette_standard.births.given import Given
from vedette_standard.estimators.extended import ExtendedKalman
from vedette_standard.estimators.imm import Imm
from vedette_standard.estimators.kalman import Kalman
from vedette_standard.lifecycles.existence import Existence
from vedette_standard.lifecycles.m_of_n import MOfN
from vedette_standard.lifecycles.single_target import SingleTarget
from vedette_standard.motion.constant_velocity import ConstantVelocity
from vedette_standard.sensors.cartesian_position import CartesianPosition
from vedette_study.lockstep import run_together

SPREAD = {"vx": 5.0, "vy": 5.0}
FROM_RETURNS = FromReturns(spread=SPREAD)


def compose(lifecycle, associator=None, estimator=None, birth=FROM_RETURNS, **sensor):
    radar = CartesianPosition(**({"sigma": 3.0, "detection_probability": 0.9, "clutter_density": 1e-5} | sensor))
    return Tracker(estimator or Kalman(ConstantVelocity(0.3)), {"radar": radar}, associator or Pda(), lifecycle, birth)


def imm():
    return Imm((Kalman(ConstantVelocity(0.1)), ExtendedKalman(ConstantVelocity(2.0))), transition=[[0.9, 0.1], [0.2, 0.8]])


def scene(rng, scans=30, clutter=2.0, detection=0.9):
    """Two boats that pass each other 40 m apart, and clutter over 400 m x 400 m."""
    for k in range(scans):
        boats = np.array([[-100.0 + 8 * k, 20.0], [100.0 - 8 * k, -20.0]]) + rng.normal(0, 3, (2, 2))
        boats = boats[rng.random(2) < detection]
        false = rng.uniform(-200, 200, (rng.poisson(clutter), 2))
        yield Scan(float(k), "radar", Detections.of(np.concatenate([boats, false]), 2))


def assert_same(a, b, rtol=0.0):
    for name in ("ids", "existence", "confirmed", "weights", "nis", "hit"):
        np.testing.assert_allclose(getattr(a, name), getattr(b, name), rtol=rtol, atol=rtol, err_msg=name)


LIFECYCLES = [MOfN(), Existence()]


@pytest.mark.parametrize("lifecycle", LIFECYCLES, ids=lambda x: x.kind)
@pytest.mark.parametrize("associator", [Pda(), Jpda(), GlobalNearest()], ids=lambda x: x.kind)
def test_two_boats_are_found_and_kept_apart(lifecycle, associator):
    tracker = compose(lifecycle, associator, imm())
    state = tracker.start()
    for scan in scene(np.random.default_rng(2)):
        state = tracker.step(state, scan)
    boats = tracker.estimate(state).mean[state.confirmed]
    truth = np.array([[-100.0 + 8 * 29, 20.0], [100.0 - 8 * 29, -20.0]])
    assert len(boats) == 2
    assert np.hypot(*(boats[:, None, :2] - truth).transpose(2, 0, 1)).min(axis=0).max() < 12.0


def test_a_step_is_pure():
    tracker = compose(LIFECYCLES[1], estimator=imm())
    state = tracker.start()
    for scan in scene(np.random.default_rng(3), scans=8):
        before = {name: np.copy(getattr(state, name)) for name in ("ids", "existence", "weights")}
        once, again = tracker.step(state, scan), tracker.step(state, scan)
        assert_same(once, again)
        for name, value in before.items():
            np.testing.assert_array_equal(getattr(state, name), value)
        state = once


SCAN = Scan(5.0, "radar", Detections.of([[1.0, 2.0]]))


@pytest.mark.parametrize(
    ("wrong", "message"),
    [
        (evolve(SCAN, sensor="rador"), r"sensor: must be one of 'radar', got 'rador'"),
        (evolve(SCAN, time=3.0), r"time: must not go back: 3\.000000 s is 1 s"),
        (evolve(SCAN, time=np.nan), r"time: must be a finite number.*got nan"),
        (
            evolve(SCAN, detections=Detections.of([[1.0, np.nan]])),
            r"return \[0\]: must be finite.*got \[1\.0, nan\]",
        ),
        (
            evolve(SCAN, detections=Detections.of([[1.0, 2.0, 3.0]])),
            r"z: must have shape \(\.\.\., returns, 2\), got \(1, 3\)",
        ),
        (evolve(SCAN, detections=Detections.of([1.0, 2.0])), r"z: must have shape"),
        (
            evolve(SCAN, detections=Detections(np.zeros((2, 2)), np.ones(3, bool))),
            r"valid: must have shape \(2,\) as `z`.*got \(3,\)",
        ),
        (
            evolve(SCAN, detections=evolve(SCAN.detections, noise=np.array([[[1.0, 2.0], [2.0, 1.0]]]))),
            r"return \[0\]: its noise must be",
        ),
        (
            evolve(SCAN, detections=evolve(SCAN.detections, evidence=np.array([np.inf]))),
            r"return \[0\]: its evidence must.*got inf",
        ),
        (evolve(SCAN, pose=Pose(np.array([np.nan, 0.0]))), r"pose\.position: must be finite numbers"),
    ],
)
def test_a_refused_scan_leaves_the_tracker_as_it_was(wrong, message):
    tracker = compose(LIFECYCLES[0])
    state = tracker.step(tracker.start(), Scan(4.0, "radar", Detections.of([[0.0, 0.0]])))
    expected = tracker.step(state, SCAN)
    with pytest.raises(ScanRefused, match=message):
        tracker.step(state, wrong)
    assert_same(tracker.step(state, SCAN), expected)


def test_what_is_no_scan_is_said_to_be_none():
    tracker = compose(LIFECYCLES[0])
    with pytest.raises(TypeError, match=r"a scan: must be a vedette\.Scan, .*, got"):
        tracker.step(tracker.start(), np.zeros((1, 2)))


def test_padding_is_never_looked_at():
    tracker = compose(LIFECYCLES[0])
    state = tracker.step(tracker.start(), Scan(4.0, "radar", Detections.of([[0.0, 0.0]])))
    padded = Detections(np.array([[1.0, 2.0], [np.nan, np.inf]]), np.array([True, False]))
    after = tracker.step(state, evolve(SCAN, detections=padded))
    np.testing.assert_allclose(after.weights[:, :2], tracker.step(state, SCAN).weights)
    assert np.isfinite(tracker.estimate(after).mean).all()


@pytest.mark.parametrize("estimator", [None, imm()], ids=["kalman", "imm"])
def test_the_noise_and_evidence_of_padding_are_never_looked_at(estimator):
    """Once a NaN there made every mean NaN for ever, in silence."""
    tracker = compose(LIFECYCLES[0], estimator=estimator)
    state = tracker.step(tracker.start(), Scan(4.0, "radar", Detections.of([[0.0, 0.0]])))
    noise = np.stack([4.0 * np.eye(2), np.full((2, 2), np.nan)])
    padded = Detections(np.array([[1.0, 2.0], [3.0, 4.0]]), np.array([True, False]), np.array([0.5, np.nan]), noise)
    alone = Detections(padded.z[:1], padded.valid[:1], padded.evidence[:1], noise[:1])
    after, wanted = (tracker.step(state, evolve(SCAN, detections=given)) for given in (padded, alone))
    np.testing.assert_array_equal(tracker.estimate(after).mean, tracker.estimate(wanted).mean)
    np.testing.assert_array_equal(tracker.estimate(after).cov, tracker.estimate(wanted).cov)
    assert np.isnan(noise[1]).all()


def test_scans_without_returns_only_predict():
    given = Given(start={"x": [0, 1], "y": [0, 1], "vx": [2, 1], "vy": [0, 1]})
    tracker = compose(SingleTarget(), birth=given)
    state = tracker.start(time=0.0)
    state = tracker.step(state, Scan(3.0, "radar", Detections.of([], 2)))
    np.testing.assert_allclose(tracker.estimate(state).mean, [[6.0, 0.0, 2.0, 0.0]])
    empty = compose(LIFECYCLES[0])
    state = empty.step(empty.start(), Scan(0.0, "radar", Detections.of([], 2)))
    assert len(state.ids) == 0


def test_the_track_that_a_birth_states_is_there_from_the_start():
    given = Given(start={"x": [10, 1], "y": [20, 2], "vx": [2, 1], "vy": [0, 1]})
    tracker = compose(SingleTarget(), birth=given)
    state = tracker.step(tracker.start(), SCAN)
    assert state.ids.tolist() == [0]
    unstated = compose(SingleTarget(), birth=Given(spread={"x": 3, "y": 3, "vx": 1, "vy": 1}))
    with pytest.raises(ValueError, match=r"birth\.start: must state 'x', 'y', 'vx', 'vy', as the recording"):
        unstated.start()


def test_runs_in_lock_step_equal_runs_alone():
    tracker = compose(SingleTarget(), estimator=imm(), birth=None)
    rng = np.random.default_rng(5)
    runs, n = 7, len(tracker.state)
    mean, cov = rng.normal(0, 10, (runs, 1, n)), np.broadcast_to(np.eye(n) * 25.0, (runs, 1, n, n))
    returns = rng.normal(0, 15, (12, runs, 4, 2))
    valid = rng.random((12, runs, 4)) < 0.8

    def run(which):
        state = tracker.start(Gaussian(mean[which], cov[which]), 0.0)
        for k in range(12):
            state = tracker.step(state, Scan(float(k), "radar", Detections(returns[k][which], valid[k][which])))
        return state

    together = tracker.estimate(run(slice(None)))
    for i in range(runs):
        alone = tracker.estimate(run(i))
        np.testing.assert_allclose(together.mean[i], alone.mean, rtol=1e-12, atol=1e-12)
        np.testing.assert_allclose(together.cov[i], alone.cov, rtol=1e-12, atol=1e-12)


def test_tracks_that_end_need_runs_of_their_own():
    tracker = compose(MOfN(hits=1, looks=1, misses=1))
    state = tracker.start(Gaussian(np.zeros((3, 1, 4)), np.broadcast_to(np.eye(4), (3, 1, 4, 4))), 0.0)
    own = type(state.memory.own)(*(np.broadcast_to(x, (3, 1)) for x in (1, 1, True)))
    state = evolve(state, memory=type(state.memory)(np.zeros((3, 1)), np.zeros((3, 1)), own))
    with pytest.raises(ValueError, match="lifecycle: runs in lock-step keep their"):
        tracker.step(state, Scan(1.0, "radar", Detections(np.zeros((3, 0, 2)), np.zeros((3, 0), bool))))


def test_existence_after_pda_is_that_of_ipda():
    tracker = compose(Existence(lifetime=1e9), birth=FromReturns(spread=SPREAD, initial=0.4))
    state = tracker.step(tracker.start(), Scan(0.0, "radar", Detections.of([[0.0, 0.0]])))
    scan = Scan(1.0, "radar", Detections.of([[2.0, 1.0], [-6.0, 3.0], [300.0, 0.0]]))
    predicted = tracker.predict(state, state.time + 1.0)
    S = predicted.cov[0, :2, :2] + 9.0 * np.eye(2)
    likelihood = 1 - 0.9 * 0.99
    for z in scan.detections.z[:2]:
        nu = z - predicted.mean[0, :2]
        density = np.exp(-0.5 * nu @ np.linalg.solve(S, nu)) / (2 * np.pi * np.sqrt(np.linalg.det(S)))
        likelihood += 0.9 * density / 1e-5
    expected = 0.4 * likelihood / (1 - 0.4 + 0.4 * likelihood)
    assert tracker.step(state, scan).existence[0] == pytest.approx(expected, rel=1e-9)


def test_a_hard_choice_does_not_make_a_track_certain():
    tracker = compose(Existence(confirm=0.999999), GlobalNearest(), clutter_density=3e-4)
    state = tracker.step(tracker.start(), Scan(0.0, "radar", Detections.of([[0.0, 0.0]])))
    after = tracker.step(state, Scan(1.0, "radar", Detections.of([[4.0, 0.0]])))
    assert after.hit[0] == 1.0
    assert 0.2 < after.existence[0] < 0.9


@pytest.mark.parametrize("associator", [Pda(), Jpda()], ids=lambda x: x.kind)
def test_a_newborn_does_not_live_off_its_neighbours_returns(associator):
    """A false return starts a track beside a boat's; from then on only the boat gives returns."""
    tracker = compose(MOfN(hits=3, looks=4, misses=3), associator)
    state = tracker.start()
    for k in range(6):
        state = tracker.step(state, Scan(float(k), "radar", Detections.of([[5.0 * k, 0.0]])))
    state = tracker.step(state, Scan(6.0, "radar", Detections.of([[30.0, 0.0], [30.0, 25.0]])))
    assert len(state.ids) == 2
    for k in range(7, 14):
        state = tracker.step(state, Scan(float(k), "radar", Detections.of([[5.0 * k, 0.0]])))
    assert state.ids.tolist() == [0]


def test_ids_are_never_used_twice_and_belong_to_their_tracker():
    tracker = compose(MOfN(hits=2, looks=2, misses=1))
    for _ in range(2):
        state, seen = tracker.start(), []
        for k in range(6):
            state = tracker.step(state, Scan(float(k), "radar", Detections.of([[1000.0 * k, 0.0]])))
            seen += state.ids.tolist()
        assert seen == [0, 1, 2, 3, 4, 5]


def test_simultaneous_sensors_are_successive_steps():
    lidar = CartesianPosition(1.0)
    tracker = evolve(compose(SingleTarget(), birth=None), sensors={"radar": CartesianPosition(2.0), "lidar": lidar})
    given = Gaussian(np.array([[1.0, 2.0, 0.0, 0.0]]), 100.0 * np.eye(4)[None])
    state = tracker.start(given, 0.0)
    state = tracker.step(state, Scan(0.0, "radar", Detections.of([[3.0, 2.0]])))
    state = tracker.step(state, Scan(0.0, "lidar", Detections.of([[0.0, 4.0]])))
    precision = 1 / 100 + 1 / 4 + 1
    expected = [(1 / 100 + 3 / 4) / precision, (2 / 100 + 2 / 4 + 4) / precision]
    np.testing.assert_allclose(tracker.estimate(state).mean[0, :2], expected)


def test_histories_hold_what_each_scan_left():
    tracker = compose(LIFECYCLES[0], estimator=imm())
    state, history, states = tracker.start(), History(tracker), []
    for scan in scene(np.random.default_rng(2)):
        state = tracker.step(state, scan)
        history.add(state)
        states.append(state)
    tracks = history.tracks()
    assert [track.id for track in tracks] == sorted(track.id for track in tracks)
    for track in tracks:
        assert track.confirmed.any()
        for i, time in enumerate(track.times):
            state = states[int(time)]
            row = state.ids.tolist().index(track.id)
            np.testing.assert_array_equal(track.mean[i], tracker.estimate(state).mean[row])
            np.testing.assert_array_equal(track.weights[i], state.weights[row])
            np.testing.assert_array_equal(track.mode_prob[i], np.exp(state.belief.log_prob[row]))


@pytest.mark.parametrize(
    ("wrong", "message"),
    [
        (
            lambda: compose(MOfN(), birth=FromReturns()),
            r"birth\.spread: must state the standard deviation.*'vy'",
        ),
        (lambda: Gate(1.1), r"probability: must be > 0 and <= 1, got 1.1"),
    ],
)
def test_what_cannot_work_is_refused_when_it_is_built(wrong, message):
    with pytest.raises(ValueError, match=message):
        wrong()


def test_run_together_collects_what_each_step_left():
    tracker = compose(SingleTarget(), estimator=imm(), birth=None)
    rng = np.random.default_rng(8)
    given = Gaussian(rng.normal(0, 10, (5, 1, 4)), np.broadcast_to(25.0 * np.eye(4), (5, 1, 4, 4)))
    scans = [Scan(float(k), "radar", Detections(rng.normal(0, 9, (5, 3, 2)), rng.random((5, 3)) < 0.7)) for k in range(6)]
    runs, state = run_together(tracker, given, 0.0, scans), tracker.start(given, 0.0)
    for k, scan in enumerate(scans):
        state = tracker.step(state, scan)
        np.testing.assert_array_equal(runs.mean[:, k], tracker.estimate(state).mean[:, 0])
        np.testing.assert_array_equal(runs.cov[:, k], tracker.estimate(state).cov[:, 0])
        np.testing.assert_array_equal(runs.mode_prob[:, k], tracker.estimator.mode_prob(state.belief)[:, 0])
        np.testing.assert_array_equal(runs.nis[:, k], state.nis[:, 0])


def test_an_estimate_of_a_later_time_is_the_prediction():
    tracker = compose(Existence(lifetime=1e9), birth=FromReturns(spread=SPREAD, initial=0.4))
    state = tracker.step(tracker.start(), Scan(0.0, "radar", Detections.of([[0.0, 0.0]])))
    later, known = tracker.estimate(state, 3.0), tracker.estimator.moments(tracker.predict(state, 3.0))
    assert np.array_equal(later.mean, known.mean)
    assert np.array_equal(later.cov, known.cov)
    assert np.all(later.cov[0].diagonal() > tracker.estimate(state).cov[0].diagonal() - 1e-12)


def test_a_return_that_begins_a_track_is_no_hit_of_one():
    """Of three scans while there was a track, one is missed, and a return far off begins another."""
    it = compose(MOfN(hits=1, looks=1, misses=9))
    intake, state = Intake(it.sensors), it.start()
    for time, place in enumerate(([0.0, 0.0], [0.0, 0.0], [900.0, 900.0], [0.0, 0.0])):
        each = Scan(float(time), "radar", Detections.of([place]))
        after = it.step(state, each)
        intake.add(each, state, after)
        state = after
    assert (intake.tracked, intake.hits, len(state.ids)) == (3, 2, 2)
