"""Tracks of two scans and of three: speed limits by sensor and class, and what three returns say together."""

import numpy as np
import pytest

import vedette
from vedette import Detections, Scan
from vedette_standard import CartesianPosition, ConstantVelocity, Jpda, Kalman, MOfN, ThreePoint, TwoPoint
from vedette_standard.births.following import Following, Waiting
from vedette_standard.births.three_point import Chains

SENSORS = {name: CartesianPosition(sigma=2.0, clutter_density=1e-6) for name in ("coastal", "air")}
AXES = vedette.Space.of(x="m", y="m", vx="m/s", vy="m/s")


def tracker(birth):
    return vedette.Tracker(Kalman(ConstantVelocity(0.3)), SENSORS, Jpda(), MOfN(hits=1, looks=1, misses=9), birth)


def begun(birth, *scans, sensor="coastal", codes=None, every=2.0):
    """The tracker and its state after scans, 2 s apart."""
    made = tracker(birth)
    state = made.start()
    for k, z in enumerate(scans):
        seen = Detections.of(z, 2)
        if codes is not None:
            seen = Detections(seen.z, seen.valid, identity=np.full(len(seen.z), codes))
        state = made.step(state, Scan(every * k, sensor, seen))
    return made, state


BIRTHS = {
    2: lambda **given: TwoPoint(max_speed=20.0, **given),
    3: lambda **given: ThreePoint(max_speed=20.0, max_acceleration=0.5, **given),
}


def path(speed, count):
    return [[[speed * 2.0 * k, 0.0]] for k in range(count)]


@pytest.mark.parametrize("count", BIRTHS)
def test_limits_are_those_of_the_sensor_and_of_the_class(count):
    fast, slow = path(60.0, count), path(12.0, count)
    by = {"sensor_speeds": {"air": 100.0}, "class_speeds": np.array([5.0, 300.0])}
    for scans, sensor, code, tracks in (
        (fast, "coastal", None, 0), (fast, "air", None, 1), (slow, "coastal", None, 1), (fast, "air", 1, 1),
        (fast, "air", 0, 0), (slow, "coastal", 0, 0), (slow, "coastal", 7, 1), (fast, "coastal", 1, 0),
    ):  # fmt: skip
        assert len(begun(BIRTHS[count](**by), *scans, sensor=sensor, codes=code)[1].ids) == tracks, (sensor, code)


def least_squares(scans, acceleration, sigma=2.0, dt=2.0):
    """Position and velocity at the third of three returns, with their covariance: the first two, then the third."""
    z = np.array([scan[0] for scan in scans])
    mean, cov = np.zeros(4), np.zeros((4, 4))
    for i in range(2):  # position and velocity at the second, moved to the third
        A, F = np.array([[1.0, -dt], [1.0, 0.0]]), np.array([[1.0, dt], [0.0, 1.0]])
        push = np.diag([(0.5 * acceleration * dt * dt) ** 2, (acceleration * dt) ** 2])
        two = np.linalg.inv(A.T @ A) * sigma**2
        m, P = F @ np.linalg.solve(A, z[:2, i]), F @ two @ F.T + push
        gain = P[:, 0] / (P[0, 0] + sigma**2)
        m, P = m + gain * (z[2, i] - m[0]), P - np.outer(gain, P[0])
        mean[[i, 2 + i]] = m
        cov[np.ix_([i, 2 + i], [i, 2 + i])] = P
    return mean, cov


def test_three_returns_are_a_position_and_a_velocity_by_all_of_them():
    scans = [[[0.0, 0.0]], [[21.0, -9.0]], [[39.0, -21.0]]]
    made, state = begun(BIRTHS[3](), *scans)
    assert state.ids.tolist() == [0]
    at = made.state.locate(AXES)
    estimate, (mean, cov) = made.estimate(state), least_squares(scans, 0.5)
    np.testing.assert_allclose(estimate.mean[0, at], mean)
    np.testing.assert_allclose(estimate.cov[0][np.ix_(at, at)], cov, atol=1e-9)


@pytest.mark.costly
def test_velocity_errors_of_new_tracks_are_as_stated():
    """The mean NEES of 400 tracks that began by three returns of a steady target: 4 +- .64 in all but one run of 100,000."""
    rng, nees = np.random.default_rng(4), []
    v = np.array([6.0, -3.0])
    while len(nees) < 400:
        scans = [[v * 2.0 * k + rng.normal(0, 2.0, 2)] for k in range(3)]
        made, state = begun(ThreePoint(max_speed=20.0, max_acceleration=0.0, deviations=50.0), *scans)
        at = made.state.locate(AXES)
        estimate = made.estimate(state)
        error = estimate.mean[0, at] - np.array([*(4.0 * v), *v])
        nees.append(error @ np.linalg.solve(estimate.cov[0][np.ix_(at, at)], error))
    assert abs(np.mean(nees) - 4.0) < 4.5 * np.sqrt(8.0 / 400)


@pytest.mark.parametrize(("off", "tracks"), [(0.0, 1), (14.0, 1), (17.0, 0)])
def test_a_return_off_the_line_starts_nothing(off, tracks):
    """S = 5 x 4 + 4 + 1 = 25 m^2 across: three deviations are 15 m."""
    scans = [[[0.0, 0.0]], [[20.0, 0.0]], [[40.0, off]]]
    assert len(begun(BIRTHS[3](), *scans)[1].ids) == tracks


def false_starts(birth, seed=1):
    """How many tracks begin in forty scans of ten false returns in a square of 400 m."""
    rng = np.random.default_rng(seed)
    return begun(birth, *(rng.uniform(-200, 200, (10, 2)) for _ in range(40)))[1].born


def test_three_scans_start_fewer_tracks_at_false_returns_than_two():
    assert false_starts(BIRTHS[3]()) < 0.3 * false_starts(BIRTHS[2]())


def test_without_a_limit_of_the_velocity_more_begin(monkeypatch):
    """The mutant of the limits: what is too fast for its sensor starts a track."""
    monkeypatch.setattr(Following, "limit", lambda birth, detections, most: np.full(len(detections.z), 1e9))
    assert len(begun(BIRTHS[3](), *path(60.0, 3))[1].ids) == 1


@pytest.mark.filterwarnings("error")
@pytest.mark.parametrize("gap", [1e-9, 1e3, 3e7])
def test_a_third_return_after_any_time_leaves_a_covariance(gap):
    """What an acceleration does in a year is 1e15 times the noise of a return."""
    made = tracker(BIRTHS[3]())
    state = made.start()
    for time, x in ((0.0, 0.0), (2.0, 10.0), (2.0 + gap, 10.0)):
        state = made.step(state, Scan(time, "coastal", Detections.of([[x, 0.0]])))
    assert len(state.ids) == 1
    assert np.linalg.eigvalsh(made.estimate(state).cov[0]).min() > 0


@pytest.mark.parametrize("place", [-100.0, 5000.0, None])
def test_a_chain_of_long_ago_which_may_be_anywhere_takes_no_return_of_a_fresh_one(place):
    """By distances in deviations alone the widest won: beside a radar that looked forty times as often, tracks began so."""
    noise = np.diag([4.0, 4.0, 4.0, 4.0])
    fresh, old = [20.0, 0.0, 10.0, 0.0], [] if place is None else [[place, 0.0, 0.0, 0.0]]
    ends = [*old, fresh]
    chains = Waiting(np.array(ends), np.array([noise] * len(ends)), np.array([300.0] * len(old) + [2.0]), np.ones(len(ends)))
    now = vedette.Gaussian(np.array([[40.5, 0.0]]), noise[None, :2, :2])
    rows, found = BIRTHS[3]().followers(now, Chains(chains, chains), np.array([20.0]))
    assert rows.tolist() == [0]
    assert found.mean[:, 2] == pytest.approx([10.0], abs=1.0)


def test_no_chain_goes_on_farther_than_targets_move():
    noise = np.eye(4)[None]
    chains = Waiting(np.array([[9000.0, 0.0, 0.0, 0.0]]), noise, np.array([300.0]), np.ones(1))
    now = vedette.Gaussian(np.array([[0.0, 0.0], [3100.0, 0.0]]), np.array([np.eye(2)] * 2))
    assert BIRTHS[3]().followers(now, Chains(chains, chains), np.full(2, 20.0))[0].tolist() == [1]
