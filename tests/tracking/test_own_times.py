"""Returns with times of their own: what a tracker makes of them is what a filter does that steps through them one by one."""

import itertools

import numpy as np
import pytest

import vedette
from vedette import Detections, Gaussian, Scan
from vedette.errors import ScanRefused
from vedette.tracking import own_times

Q, SIGMA, P_D, CLUTTER, P_GATE = 2.0, 5.0, 0.9, 1e-5, 0.999
SPREAD = {"vx": 30.0, "vy": 30.0}
H, R = np.eye(2, 4), SIGMA**2 * np.eye(2)
KALMAN = {"kind": "kalman", "motion": {"kind": "constant_velocity", "sigma_accel": Q}}
CERTAIN = {"kind": "single_target"}


def tracker(associator="pda", **changes):
    radar = {"kind": "cartesian_position", "sigma": SIGMA, "detection_probability": P_D, "clutter_density": CLUTTER}
    return vedette.build({
        "estimator": KALMAN,
        "sensors": {"radar": radar},
        "associator": {"kind": associator},
        "lifecycle": CERTAIN,
        "birth": {"kind": "from_returns", "spread": SPREAD, "sensors": ["none"]},
        "gate": {"probability": P_GATE},
    } | changes)  # fmt: skip


def scan(time, z, times):
    z = np.reshape(z, (-1, 2))
    return Scan(time, "radar", Detections(z, np.ones(len(z), dtype=bool), time=times))


def ahead(x, P, dt):
    """The textbook's prediction of a nearly constant velocity."""
    F = np.kron([[1.0, dt], [0.0, 1.0]], np.eye(2))
    noise = Q**2 * np.kron([[dt**3 / 3, dt**2 / 2], [dt**2 / 2, dt]], np.eye(2))
    return F @ x, F @ P @ F.T + noise


def given(x, P, z):
    """The textbook's posterior, and log N(z; H x, S)."""
    S = H @ P @ H.T + R
    K, nu = P @ H.T @ np.linalg.inv(S), z - H @ x
    log = -0.5 * (nu @ np.linalg.solve(S, nu) + np.linalg.slogdet(2 * np.pi * S)[1])
    return x + K @ nu, (np.eye(4) - K @ H) @ P, log


def stepped(x, P, dt, z, at):
    """A filter that goes to the return's time, takes it, and goes on; and the return's log-likelihood."""
    x, P, log = given(*ahead(x, P, at), z)
    return *ahead(x, P, dt - at), log


START = (np.array([0.0, 0.0, 40.0, -20.0]), np.diag([100.0, 100.0, 25.0, 25.0]))


def test_a_single_return_is_taken_as_a_filter_does_that_steps_to_it():
    one, rng = tracker(), np.random.default_rng(1)
    state = one.start(Gaussian(START[0][None], START[1][None]), 0.0)
    stepping = state
    x, P = START
    for turn in range(1, 12):
        at, time = rng.uniform(-0.9, 0.0) * 3.0, 3.0 * turn
        z = H @ ahead(x, P, 3.0 + at)[0] + rng.normal(0, SIGMA, 2)
        state = one.step(state, scan(time, z, [time + at]))
        stepping = one.step(stepping, scan(time + at, z, None))
        weight = state.weights[0, 1]
        np.testing.assert_allclose(weight, stepping.weights[0, 1], rtol=1e-9)
        taken, missed = stepped(x, P, 3.0, z, 3.0 + at)[:2], ahead(x, P, 3.0)
        x, P = moments([missed, taken], [1 - weight, weight])
        np.testing.assert_allclose(one.estimate(state).mean[0], x, rtol=1e-9, atol=1e-9)
        np.testing.assert_allclose(one.estimate(state).cov[0], P, rtol=1e-9, atol=1e-9)
        alone = one.estimate(stepping, time)
        np.testing.assert_allclose(alone.mean[0], x, rtol=1e-9, atol=1e-9)
        np.testing.assert_allclose(alone.cov[0], P, rtol=1e-9, atol=1e-9)


def moments(parts, shares):
    mean = sum(share * x for share, (x, _) in zip(shares, parts, strict=True))
    return mean, sum(s * (P + np.outer(x - mean, x - mean)) for s, (x, P) in zip(shares, parts, strict=True))


def test_of_several_returns_in_a_gate_each_association_is_such_a_filter():
    one = tracker()
    times = np.array([3.5, 5.0, 3.5, 4.25])
    path = [H @ ahead(*START, t - 2.0)[0] for t in times]
    z = np.array(path) + [[4.0, -3.0], [-6.0, 1.0], [2.0, 9.0], [900.0, 0.0]]
    state = one.step(one.start(Gaussian(START[0][None], START[1][None]), 2.0), scan(5.0, z, times))
    every = [stepped(*START, 3.0, own, t - 2.0) for own, t in zip(z[:3], times, strict=False)]
    scores = np.array([CLUTTER * (1 - P_D * P_GATE), *(P_D * np.exp(log) for *_, log in every)])
    shares = scores / scores.sum()
    np.testing.assert_allclose(state.weights[0], [*shares, 0.0], rtol=1e-9, atol=1e-15)
    x, P = moments([ahead(*START, 3.0), *(part[:2] for part in every)], shares)
    np.testing.assert_allclose(one.estimate(state).mean[0], x, rtol=1e-9, atol=1e-9)
    np.testing.assert_allclose(one.estimate(state).cov[0], P, rtol=1e-9, atol=1e-9)
    assert np.all(shares[1:] > 0.05)


def test_two_tracks_share_returns_by_the_joint_events():
    one = tracker("jpda", lifecycle={"kind": "existence", "confirm": 0.5, "delete": 1e-9, "lifetime": 1e12})
    both = [START, (START[0] + [10.0, 20.0, 3.0, 0.0], START[1])]
    state = one.start(Gaussian(np.array([x for x, _ in both]), np.array([P for _, P in both])), 0.0)
    times, dt = np.array([1.0, 2.5]), 3.0
    z = np.array([H @ ahead(*own, t)[0] + 2.0 for own, t in zip(both, times, strict=True)])
    state = one.step(state, scan(dt, z, times))
    parts = [[stepped(*own, dt, each, t) for each, t in zip(z, times, strict=True)] for own in both]
    weights = np.zeros((2, 3))
    for event in itertools.product(range(3), repeat=2):
        if event[0] == event[1] > 0:
            continue
        likely = [1 - P_D * P_GATE if i == 0 else P_D * np.exp(parts[t][i - 1][2]) / CLUTTER for t, i in enumerate(event)]
        for t, i in enumerate(event):
            weights[t, i] += np.prod(likely)
    weights /= weights.sum(axis=-1, keepdims=True)
    np.testing.assert_allclose(state.weights, weights, rtol=1e-9)
    for t, own in enumerate(both):
        x, P = moments([ahead(*own, dt), *(part[:2] for part in parts[t])], weights[t])
        np.testing.assert_allclose(one.estimate(state).mean[t], x, rtol=1e-9, atol=1e-9)
        np.testing.assert_allclose(one.estimate(state).cov[t], P, rtol=1e-9, atol=1e-9)


TURNING = {"kind": "coordinated_turn", "sigma_accel": 1.0, "sigma_turn_rate": 0.02}
ESTIMATORS = {
    "kalman": KALMAN,
    "ekf": {"kind": "ekf", "motion": TURNING},
    "ukf": {"kind": "ukf", "motion": TURNING},
    "imm": {
        "kind": "imm",
        "modes": [{"kind": "ekf", "motion": KALMAN["motion"]}, {"kind": "ekf", "motion": TURNING}],
        "rates": [[-0.02, 0.02], [0.05, -0.05]],
    },
}
EXISTENCE = {"kind": "existence", "confirm": 0.5, "delete": 1e-9}
POLAR = {"kind": "range_bearing", "sigma_range": 5.0, "sigma_bearing": 0.01, "clutter_density": CLUTTER, "x": -900.0}
BIRTH = {"kind": "from_returns", "spread": SPREAD | {"turn_rate": 0.05}}


@pytest.mark.parametrize(
    ("kind", "associator"),
    [*itertools.product(ESTIMATORS, ["nearest", "gnn"]), ("kalman", "k_best"), ("ekf", "k_best"), ("ukf", "k_best")],
)
def test_every_filter_that_merges_takes_a_return_as_it_would_at_the_time_of_that(kind, associator):
    spread = SPREAD if kind == "kalman" else SPREAD | {"turn_rate": 0.05}
    one = tracker(
        associator, estimator=ESTIMATORS[kind], lifecycle=EXISTENCE, birth={"kind": "from_returns", "spread": spread},
        sensors={"radar": {"kind": "cartesian_position", "sigma": 5.0} if kind == "kalman" else POLAR},
    )  # fmt: skip
    state, rng = one.start(), np.random.default_rng(2)
    for turn in range(6):
        time = 3.0 * turn
        at = time - rng.uniform(0, 2.9)
        spot = np.array([20.0 * at, 300.0 - 5.0 * at]) + rng.normal(0, 3.0, 2)
        z = spot if kind == "kalman" else [np.hypot(spot[0] + 900.0, spot[1]), np.arctan2(spot[1], spot[0] + 900.0)]
        then = one.step(state, scan(at, z, None))
        wanted = one.estimate(then, time)
        state = one.step(state, scan(time, z, [at]))
        np.testing.assert_array_equal(state.ids, then.ids)
        np.testing.assert_allclose(one.estimate(state).mean, wanted.mean, rtol=1e-9, atol=1e-9)
        np.testing.assert_allclose(one.estimate(state).cov, wanted.cov, rtol=1e-9, atol=1e-9)


@pytest.mark.parametrize("associator", ["jpda", "k_best", "lmb"])
def test_the_poisson_birth_expects_its_targets_at_the_time_of_each_return(associator):
    there = {"x": [0.0, 60.0], "y": [0.0, 60.0], "vx": [50.0, 10.0], "vy": [0.0, 10.0]}
    one = tracker(
        associator, lifecycle=EXISTENCE, birth={"kind": "poisson", "appear": [{"at": there, "initial": 2.0, "rate": 0.1}]}
    )
    first, at = one.start(time=0.0), 2.0
    z = [[100.0, 30.0]]
    then, state = one.step(first, scan(at, z, None)), one.step(first, scan(3.0, z, [at]))
    assert len(state.ids) == 1
    np.testing.assert_allclose(state.existence, then.existence, rtol=1e-9)
    wanted = one.estimate(then, 3.0)
    np.testing.assert_allclose(one.estimate(state).mean, wanted.mean, rtol=1e-9, atol=1e-9)
    np.testing.assert_allclose(one.estimate(state).cov, wanted.cov, rtol=1e-9, atol=1e-9)


def test_many_targets_are_followed_return_by_return_in_one_scan():
    """40 targets far apart, each seen at its own time of a turn, among 20 false returns: as if each were alone."""
    rng = np.random.default_rng(5)
    start = np.column_stack([rng.uniform(-2e4, 2e4, (40, 2)), rng.uniform(-100, 100, (40, 2))])
    one = tracker("gnn")
    state = one.start(Gaussian(start, np.tile(START[1], (40, 1, 1))), 0.0)
    known = [(x, START[1]) for x in start]
    for time in (4.0, 8.0, 12.0):
        at = time - rng.uniform(0, 4.0, 40)
        z = np.array([x[:2] + (own - time + 4.0) * x[2:] for (x, _), own in zip(known, at, strict=True)])
        false = rng.uniform(5e4, 6e4, (20, 2))
        order = rng.permutation(60)
        every, times = np.concatenate([z, false])[order], np.concatenate([at, rng.uniform(time - 4.0, time, 20)])[order]
        state = one.step(state, scan(time, every, times))
        known = [stepped(*own, 4.0, one_z, t - time + 4.0)[:2] for own, one_z, t in zip(known, z, at, strict=True)]
    np.testing.assert_allclose(one.estimate(state).mean, [x for x, _ in known], rtol=1e-9, atol=1e-7)
    np.testing.assert_allclose(one.estimate(state).cov, [P for _, P in known], rtol=1e-9, atol=1e-9)


def test_returns_of_the_scans_time_are_as_without():
    one, rng = (
        tracker("jpda", lifecycle=EXISTENCE, birth={"kind": "from_returns", "spread": SPREAD}),
        np.random.default_rng(3),
    )
    state = same = one.start()
    for time in range(5):
        z = rng.uniform(0, 60, (4, 2))
        state, same = one.step(state, scan(time, z, [float(time)] * 4)), one.step(same, scan(time, z, None))
    np.testing.assert_array_equal(state.ids, same.ids)
    np.testing.assert_allclose(state.weights, same.weights, rtol=1e-9, atol=1e-12)
    np.testing.assert_allclose(one.estimate(state).mean, one.estimate(same).mean, rtol=1e-9)
    np.testing.assert_allclose(one.estimate(state).cov, one.estimate(same).cov, rtol=1e-9)


def test_what_has_no_time_of_its_own_is_refused_and_the_state_stays():
    one = tracker()
    state = one.start(Gaussian(START[0][None], START[1][None]), 0.0)
    for times in ([3.5], [np.nan], [-np.inf], [1.0, 2.0]):
        with pytest.raises(ScanRefused, match=r"return \[0\]|^time"):
            one.step(state, scan(3.0, [[0.0, 0.0]], times))
    draws = tracker(estimator={"kind": "bootstrap_particles", "motion": KALMAN["motion"], "particles": 100})
    state = draws.start(Gaussian(START[0][None], START[1][None]), 0.0)
    with pytest.raises(ScanRefused, match="bootstrap_particles"):
        draws.step(state, scan(3.0, [[0.0, 0.0]], [2.0]))
    after = one.step(one.start(), Scan(1.0, "radar", Detections([[9.0, 9.0]], [False], time=[np.nan])))
    assert len(after.ids) == 0


def test_tracks_given_without_a_time_are_of_the_first_return_and_later_ones_of_the_scan_before():
    one = tracker()
    state = one.step(one.start(Gaussian(START[0][None], START[1][None])), scan(9.0, [[40.0, -20.0]], [8.0]))
    then = one.step(one.start(Gaussian(START[0][None], START[1][None]), 8.0), scan(9.0, [[40.0, -20.0]], [8.0]))
    np.testing.assert_array_equal(one.estimate(state).mean, one.estimate(then).mean)
    early = one.step(then, scan(10.0, [[80.0, -40.0]], [8.5]))
    at_once = one.step(then, scan(10.0, [[80.0, -40.0]], [9.0]))
    np.testing.assert_array_equal(one.estimate(early).mean, one.estimate(at_once).mean)


def test_the_gate_is_as_large_as_at_the_time_when_it_is_largest():
    """By its volume the density of unknown clutter is counted; a track is known worse the longer ago its last return is."""
    one = tracker()
    state = one.step(one.start(Gaussian(START[0][None], START[1][None]), 8.0), scan(9.0, [[40.0, -20.0]], [9.0]))
    it = one.expect(state, scan(10.0, [[80.0, -40.0]] * 2, [9.1, 9.9]))
    volumes = [it.at(i).returns_of(it.at(i).tracks)[1] for i in range(2)]
    ends = [0.5 * np.linalg.slogdet(S)[1][0] for S in (*volumes, it.returns_of(it.tracks)[1])]
    assert it.innovation.log_volume[0].max() == pytest.approx(max(ends))


@pytest.mark.parametrize("times", [[9.5, 9.2], [9.2, 9.5]])
def test_a_track_begins_at_the_return_that_none_claims_whichever_came_first(times):
    one = tracker("jpda", birth={"kind": "from_returns", "spread": SPREAD}, lifecycle={"kind": "existence"})
    begun = one.step(one.start(), scan(9.0, [[0.0, 0.0]], [9.0]))
    both = one.step(begun, scan(10.0, [[1.0, 1.0], [900.0, 900.0]], times))
    assert (begun.ids.tolist(), both.ids.tolist()) == ([0], [0, 1])
    assert one.estimate(both).mean[1, 0] == pytest.approx(900.0)


def test_a_track_that_begins_at_a_return_from_before_the_last_scan_begins_at_that():
    one = tracker("jpda", birth={"kind": "from_returns", "spread": SPREAD}, lifecycle={"kind": "existence"})
    before = one.step(one.start(), scan(9.0, [], []))
    early, at_once = (one.step(before, scan(10.0, [[80.0, -40.0]], [time])) for time in (8.5, 9.0))
    np.testing.assert_array_equal(one.estimate(early).cov, one.estimate(at_once).cov)


def test_what_is_expected_of_a_return_is_of_its_own_time_or_of_the_scan_before():
    one = tracker()
    state = one.step(one.start(Gaussian(START[0][None], START[1][None]), 8.0), scan(9.0, [[40.0, -20.0]], [8.0]))
    it = one.expect(state, scan(10.0, [[80.0, -40.0]] * 2, [8.5, 9.25]))
    for i, time in enumerate((9.0, 9.25)):
        then = it.at(i)
        assert (then.scan.time, then.dt) == (time, time - 9.0)
        np.testing.assert_array_equal(then.tracks.mean, one.estimate(state, time).mean)


@pytest.mark.parametrize("wrong", ["the scan's time", "no noise on the way", "begins at the scan"])
def test_mutants_that_forget_times_are_noticed(wrong, monkeypatch):
    real = own_times.predicted
    if wrong == "the scan's time":
        every = lambda scan, observed, dt: [(dt, 0.0, np.arange(len(observed.z)))]  # noqa: E731
        monkeypatch.setattr(own_times, "moments_of", every)
        with pytest.raises(AssertionError):
            test_of_several_returns_in_a_gate_each_association_is_such_a_filter()
    elif wrong == "no noise on the way":

        def quiet(estimator, belief, dt, rng):
            after = real(estimator, belief, dt, rng)
            return Gaussian(after.mean, after.cov - real(estimator, Gaussian(0 * belief.mean, 0 * belief.cov), dt, rng).cov)

        monkeypatch.setattr(own_times, "predicted", quiet)
        with pytest.raises(AssertionError):
            test_of_several_returns_in_a_gate_each_association_is_such_a_filter()
    else:
        monkeypatch.setattr("vedette.tracking.births.at_the_scan", lambda estimator, belief, ago, rng: belief)
        with pytest.raises(AssertionError):
            test_the_poisson_birth_expects_its_targets_at_the_time_of_each_return("jpda")
