"""The posterior Cramer-Rao bound: Riccati's solution where all is linear, sequences of detections, and no filter below."""

from itertools import product

import numpy as np
import pytest

import vedette
from support.scenes import Polar
from vedette import ConfigError, Scan, Space, Trajectory
from vedette.metrics import Bound, Judge, judge
from vedette.sampling import draw_states
from vedette.types import Detections
from vedette_standard.motion.constant_velocity import ConstantVelocity
from vedette_standard.sensors.cartesian_position import CartesianPosition
from vedette_standard.sensors.range_bearing import RangeBearing
from vedette_standard.whole_tracks import bound_along, enumerated_bound, information, reduced_bound
from vedette_study.plan import plan
from vedette_study.study import perform

CV = ConstantVelocity(0.5)
START = {"x": 20.0, "y": 20.0, "vx": 3.0, "vy": 3.0}
P0 = np.diag([400.0, 400.0, 9.0, 9.0])
H = np.eye(2, 4)


def linear(scans: int, p: float, sigma: float = 5.0, dt: float = 2.0):
    """F, Q, I and P_D of a position sensor."""
    x = np.zeros(4)
    F = np.stack([np.eye(4), *[CV.jacobian(x, dt)] * (scans - 1)])
    Q = np.stack([np.zeros((4, 4)), *[CV.noise(x, dt)] * (scans - 1)])
    return F, Q, np.broadcast_to(H.T @ H / sigma**2, (scans, 4, 4)), np.full(scans, p)


def riccati(seen: tuple[bool, ...], sigma: float = 5.0, dt: float = 2.0):
    """Covariances by Riccati's equation, for a given sequence of detections."""
    P, found = P0, []
    for k, hit in enumerate(seen):
        if k:
            P = CV.jacobian(np.zeros(4), dt) @ P @ CV.jacobian(np.zeros(4), dt).T + CV.noise(np.zeros(4), dt)
        if hit:
            P = P - P @ H.T @ np.linalg.inv(H @ P @ H.T + sigma**2 * np.eye(2)) @ H @ P
        found.append(P)
    return np.stack(found)


def test_without_misses_both_are_riccatis_solution():
    expected = riccati((True,) * 12)
    np.testing.assert_allclose(reduced_bound(P0, *linear(12, 1.0)), expected, rtol=1e-9)
    np.testing.assert_allclose(enumerated_bound(P0, *linear(12, 1.0)), expected, rtol=1e-9)
    np.testing.assert_allclose(reduced_bound(P0, *linear(5, 0.0)), riccati((False,) * 5), rtol=1e-9)


def test_the_enumeration_is_the_mean_over_all_sequences():
    p, expected = 0.7, 0.0
    for seen in product((True, False), repeat=7):
        expected = expected + np.prod([p if hit else 1 - p for hit in seen]) * riccati(seen)
    np.testing.assert_allclose(enumerated_bound(P0, *linear(7, p)), expected, rtol=1e-9)


@pytest.mark.parametrize("p", [0.2, 0.5, 0.9])
def test_the_information_reduction_is_tichavskys_recursion_and_below_the_enumeration(p):
    F, Q, info, p_detect = linear(8, p)
    J, found = np.linalg.inv(P0) + p * info[0], [np.linalg.inv(np.linalg.inv(P0) + p * info[0])]
    for k in range(1, 8):
        inverse = np.linalg.inv(Q[k])
        D11, D12, D22 = F[k].T @ inverse @ F[k], -F[k].T @ inverse, inverse + p * info[k]
        J = D22 - D12.T @ np.linalg.inv(J + D11) @ D12
        found.append(np.linalg.inv(J))
    reduced = reduced_bound(P0, F, Q, info, p_detect)
    np.testing.assert_allclose(reduced, found, rtol=1e-7)
    above = np.linalg.eigvalsh(enumerated_bound(P0, F, Q, info, p_detect) - reduced)
    assert np.all(above > -1e-9)
    assert np.max(above) > 0.1


def test_beyond_the_sequences_that_are_enumerated_information_is_reduced(monkeypatch):
    monkeypatch.setattr("vedette_standard.whole_tracks.bound.ENUMERATED", 5)
    F, Q, info, p = linear(12, 0.6)
    both, reduced = enumerated_bound(P0, F, Q, info, p), reduced_bound(P0, F, Q, info, p)
    np.testing.assert_allclose(enumerated_bound(P0, F[:5], Q[:5], info[:5], p[:5]), both[:5])
    assert np.all(np.linalg.eigvalsh(both - reduced) > -1e-9)
    after = 0.0
    for seen in product((True, False), repeat=5):
        chance = np.prod([0.6 if hit else 0.4 for hit in seen])
        after = after + chance * reduced_bound(riccati(seen)[-1], F[5:], Q[5:], info[5:], p[5:])
    np.testing.assert_allclose(both[5:], after, rtol=1e-9)


def test_the_information_of_a_noise_that_depends_on_the_state():
    """Of z ~ N(x, s(x)^2), it is 1/s^2 + 2 (s'/s)^2; with a constant noise, H' R^-1 H."""

    class Growing(Polar):
        kind = "test_growing"
        observes = Space.of(x="m")
        measurement = Space.of(z="m")

        def measure(self, x):
            return 1.0 * x

        def noise(self, x):
            return (1.0 + 0.1 * x[..., None]) ** 2

    x = np.array([[0.0], [10.0], [30.0]])
    s = 1.0 + 0.1 * x[:, 0]
    np.testing.assert_allclose(information(Growing(), x)[:, 0, 0], 1 / s**2 + 2 * (0.1 / s) ** 2, rtol=1e-6)
    polar = RangeBearing(sigma_range=5.0, sigma_bearing=0.01)
    at = np.array([300.0, -100.0])
    slope = polar.jacobian(at)
    np.testing.assert_allclose(information(polar, at), slope.T @ np.diag([1 / 25, 1e4]) @ slope, rtol=1e-9)


def experiment(estimator, sensor, duration=30, **more):
    """A tracker of one given target, whose source draws the truth from the bound's own model."""
    start = {"x": [300, 20], "y": [-200, 20], "vx": [0, 3], "vy": [5, 3]}
    motion = {"kind": "constant_velocity", "sigma_accel": 0.5}
    return {
        "source": {
            "kind": "simulation",
            "duration": duration,
            "looks": {"radar": {"interval": 2.0}},
            "drawn": {"boat": {"models": [motion], "start": start}},
        },
        "sensors": {"radar": sensor},
        "estimator": estimator | {"motion": motion},
        "associator": {"kind": "nearest"},
        "gate": {"probability": 1 - 1e-9},
        "birth": {"kind": "given", "start": start},
        "lifecycle": {"kind": "single_target"},
        "judge": {"bound": {"motion": motion, "start": START}, "cover_radius": 1e4},
        **more,
    }


def done(config, runs):
    return perform(plan({"experiment": config, "runs": runs, "seed": 3}), threads=1)


POSITION = {"kind": "cartesian_position", "sigma": 5.0, "detection_probability": 0.6}
POLAR = {"kind": "range_bearing", "sigma_range": 8.0, "sigma_bearing": 0.03, "detection_probability": 0.6}


def test_in_a_study_the_kalman_filter_reaches_the_enumeration_within_three_standard_errors():
    """By enumeration the bound of a linear filter without clutter is its own mean square error."""
    outcome = done(experiment({"kind": "kalman"}, POSITION, 22), 4000)
    square, reduced = outcome.figures["position_rmse"][0], outcome.figures["position_bound"][0]
    error = np.std(square, ddof=1) / np.sqrt(len(square))
    exact = np.mean(np.trace(enumerated_bound(P0, *linear(12, 0.6))[:, :2, :2], axis1=1, axis2=2))
    assert abs(np.mean(square) - exact) < 3 * error
    assert error < 0.03 * exact
    assert np.ptp(reduced) < 1e-9
    expected = np.mean(np.trace(reduced_bound(P0, *linear(12, 0.6))[:, :2, :2], axis1=1, axis2=2))
    assert reduced[0] == pytest.approx(expected)
    assert reduced[0] < 0.95 * exact


@pytest.mark.parametrize("kind", ["ekf", "ukf"])
@pytest.mark.by_turns
def test_no_filter_beats_the_bound_over_drawn_truth_by_three_standard_errors(kind):
    """Of a nonlinear sensor: the bound with the information's mean over the drawn truth."""
    rng = np.random.default_rng(1)
    sensor = RangeBearing(sigma_range=8.0, sigma_bearing=0.03, detection_probability=0.6)
    times = 2.0 * np.arange(16)
    x0 = np.array([300.0, -200.0, 0.0, 5.0]) + np.sqrt(np.diag(P0)) * rng.standard_normal((5000, 4))
    states = draw_states(CV, x0, times, rng)
    F, Q, _, p = linear(16, 0.6)
    info = np.zeros((16, 4, 4))
    info[:, :2, :2] = np.mean(information(sensor, states[..., :2]), axis=0)
    bound = np.trace(reduced_bound(P0, F, Q, info, p)[:, :2, :2], axis1=1, axis2=2)
    outcome = done(experiment({"kind": kind}, POLAR), 2000)
    square = outcome.figures["position_rmse"][0]
    error = np.std(square, ddof=1) / np.sqrt(len(square))
    assert np.mean(square) > np.mean(bound) - 3 * error
    exact = np.trace(enumerated_bound(P0, F, Q, info, p)[:, :2, :2], axis1=1, axis2=2)
    assert np.mean(exact) - 3 * error < np.mean(square) < 1.1 * np.mean(exact)
    assert np.mean(outcome.figures["position_bound"][0]) == pytest.approx(np.mean(bound), rel=0.1)


def test_in_a_run_the_bound_is_that_along_each_object_from_its_first_scan():
    sensor = {"radar": CartesianPosition(5.0, 0.8)}
    paths = [np.array([0.0, 2.0, 4.0, 6.0]), np.array([4.0, 6.0])]
    truth = [Trajectory(str(i), CV.state, times, np.zeros((len(times), 4))) for i, times in enumerate(paths)]
    scans = [Scan(time, "radar", Detections.of([], 2)) for time in paths[0].tolist()]
    expected = [np.trace(reduced_bound(P0, *linear(len(times), 0.8))[:, :2, :2], axis1=1, axis2=2) for times in paths]
    found = judge([], truth, scans, Judge(bound=Bound(CV, START)), sensors=sensor)
    assert found.position_bound_m == pytest.approx(np.sqrt(np.mean(np.concatenate(expected))))
    late = judge([], truth, scans, Judge(bound=Bound(CV, START), first_scan=3), sensors=sensor)
    assert late.position_bound_m == pytest.approx(np.sqrt(np.mean([each[-1] for each in expected])))
    every = judge([], truth, scans, Judge(bound=Bound(CV, START, "enumeration")), sensors=sensor)
    assert every.position_bound_m > found.position_bound_m
    assert judge([], truth, scans, Judge(), sensors=sensor).position_bound_m is None
    flat = [Trajectory("0", Space.of(x="m", y="m"), paths[0], np.zeros((4, 2)))]
    assert judge([], flat, scans, Judge(bound=Bound(CV, START)), sensors=sensor).position_bound_m is None


def test_several_trajectories_at_once_are_each_alone():
    rng = np.random.default_rng(0)
    states = draw_states(CV, np.array([300.0, -200.0, 0.0, 5.0]), np.arange(6.0), rng, (3,))
    scans = [Scan(float(k), "radar", Detections.of([], 2)) for k in range(6)]
    sensors = {"radar": RangeBearing(sigma_range=8.0, sigma_bearing=0.03, detection_probability=0.6)}
    for method in ("information_reduction", "enumeration"):
        bound = Bound(CV, START, method)
        together = bound_along(bound, sensors, scans, np.swapaxes(states, 0, 1), CV.state)
        for i in range(3):
            np.testing.assert_allclose(together[:, i], bound_along(bound, sensors, scans, states[i], CV.state), rtol=1e-12)


def test_what_is_wrong_is_told():
    with pytest.raises(ValueError, match=r"start: must give the axes x, y.*got x"):
        Bound(CV, {"x": 1.0})
    with pytest.raises(ValueError, match=r"start: vx: the standard deviation.*got -3"):
        Bound(CV, START | {"vx": -3.0})
    turning = {"kind": "gauss_markov", "axes": ["x", "vx"], "sigma": 1.0, "tau": 1.0}
    config = experiment({"kind": "kalman"}, POSITION, judge={"bound": {"motion": turning, "start": {"x": 1.0, "vx": 1.0}}})
    with pytest.raises(ConfigError, match=r"judge.bound.motion: must have the axis y.*'radar'"):
        vedette.load(config)
