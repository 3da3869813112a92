"""The kinds that are given as matrices: against plain algebra, in a config, and what they refuse."""

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

import vedette
from vedette.config import to_config
from vedette_standard.motion.constant_velocity import ConstantVelocity
from vedette_standard.motion.linear import Linear
from vedette_standard.sensors.linear import LinearSensor

F = np.array([[1.0, 0.5], [0.0, 0.9]])
Q = np.array([[0.2, 0.1], [0.1, 0.3]])
B = np.array([[0.5, 0.0], [1.0, -1.0]])
U = np.array([2.0, 0.3])


@settings(max_examples=40, deadline=None)
@given(steps=st.integers(0, 40), step=st.floats(0.01, 10.0), seed=st.integers(0, 99))
def test_whole_steps_are_the_recursion(steps, step, seed):
    model = Linear(("p", "q"), F, Q, step, B, U)
    x = np.random.default_rng(seed).standard_normal((3, 2))
    wanted, cov = x, np.zeros((2, 2))
    for _ in range(steps):
        wanted, cov = wanted @ F.T + B @ U, F @ cov @ F.T + Q
    np.testing.assert_allclose(model.move(x, steps * step), wanted, rtol=1e-9, atol=1e-9)
    np.testing.assert_allclose(model.noise(x, steps * step), cov, rtol=1e-9, atol=1e-12)
    np.testing.assert_allclose(model.jacobian(x, steps * step), np.linalg.matrix_power(F, steps), atol=1e-12)


def test_a_part_of_a_step_lies_between():
    model, x = Linear(("p", "q"), F, Q, 2.0), np.array([1.0, -1.0])
    np.testing.assert_allclose(model.move(x, 0.5), 0.75 * x + 0.25 * (F @ x))
    np.testing.assert_allclose(model.noise(x, 0.5), 0.25 * Q)


def test_it_is_linear_without_a_control_alone():
    assert Linear(("p", "q"), F, Q).linear
    assert not Linear(("p", "q"), F, Q, 1.0, B, U).linear


def tracked(estimator, motion, sensor):
    tracker = vedette.build(
        {
            "estimator": {"kind": estimator, "motion": motion},
            "sensors": {"s": sensor},
            "associator": {"kind": "gnn"},
            "birth": {"kind": "from_returns", "spread": {"vx": 10.0, "vy": 10.0}},
            "lifecycle": {"kind": "m_of_n"},
        }
    )
    state = tracker.start(seed=1)
    for k in range(10):
        state = tracker.step(state, vedette.Scan(2.0 * k, "s", [[100.0 + 9.0 * k, 50.0 - k**1.5]]))
    return tracker.estimate(state)


def test_constant_velocity_by_matrices_is_constant_velocity():
    known = ConstantVelocity(0.5)
    x = np.zeros(4)
    matrices = {"F": known.jacobian(x, 2.0).tolist(), "Q": known.noise(x, 2.0).tolist(), "step": "2 s"}
    by_matrix = tracked(
        "kalman",
        {"kind": "linear", "axes": ["x", "y", "vx", "vy"], **matrices},
        {"kind": "linear", "axes": ["x", "y"], "R": [[25.0, 0.0], [0.0, 25.0]]},
    )
    by_name = tracked(
        "kalman", {"kind": "constant_velocity", "sigma_accel": 0.5}, {"kind": "cartesian_position", "sigma": 5.0}
    )
    np.testing.assert_allclose(by_matrix.mean, by_name.mean, rtol=1e-12)
    np.testing.assert_allclose(by_matrix.cov, by_name.cov, rtol=1e-12)


def test_a_filter_with_control_is_the_textbooks():
    """x- = F x + B u, P- = F P F' + Q, K = P- H' (H P- H' + R)^-1, the textbook's own lines."""
    R, H = np.array([[2.0]]), np.array([[1.0, 0.0]])
    tracker = vedette.build(
        {
            "estimator": {
                "kind": "ekf",
                "motion": {
                    "kind": "linear",
                    "axes": ["x", "vx"],
                    "F": F.tolist(),
                    "Q": Q.tolist(),
                    "B": B.tolist(),
                    "control": U.tolist(),
                },
            },
            "sensors": {"s": {"kind": "linear", "axes": ["x", "vx"], "H": H.tolist(), "R": R.tolist()}},
            "associator": {"kind": "gnn"},
            "birth": None,
            "lifecycle": {"kind": "single_target"},
            "gate": "off",
        }
    )
    x, P = np.array([1.0, 2.0]), np.diag([4.0, 9.0])
    state = tracker.start(vedette.Gaussian(x[None], P[None]), 0.0, 1)
    for k, z in enumerate((3.0, 5.5, 6.0, 9.0), 1):
        state = tracker.step(state, vedette.Scan(float(k), "s", [[z]]))
        x, P = F @ x + B @ U, F @ P @ F.T + Q
        K = P @ H.T @ np.linalg.inv(H @ P @ H.T + R)
        x, P = x + K @ (z - H @ x), P - K @ H @ P
        np.testing.assert_allclose(tracker.estimate(state).mean[0], x, rtol=1e-12)
        np.testing.assert_allclose(tracker.estimate(state).cov[0], P, rtol=1e-10)


def test_positions_in_space_with_a_full_covariance():
    R = np.array([[9.0, 2.0, 0.0], [2.0, 4.0, 1.0], [0.0, 1.0, 25.0]])
    sensor = LinearSensor(("x", "y", "z"), R)
    assert sensor.measurement == sensor.observes == vedette.Space.of(x="m", y="m", z="m")
    spot = sensor.invert(np.array([[1.0, 2.0, 3.0]]))
    np.testing.assert_array_equal(spot.mean, [[1.0, 2.0, 3.0]])
    np.testing.assert_array_equal(spot.cov, [R])
    assert sensor.at(vedette.Pose([5.0, 5.0, 5.0])) is sensor


def test_a_sensor_looks_at_the_axes_that_h_uses():
    sensor = LinearSensor(("x", "vx", "y"), np.diag([1.0, 4.0]), np.array([[1.0, 0.0, 0.0], [0.0, 0.0, 1.0]]))
    assert sensor.observes.names == sensor.measurement.names == ("x", "y")
    mixed = LinearSensor(("x", "y"), np.eye(1), np.array([[0.6, 0.8]]), ("along",))
    assert mixed.measurement.names == ("along",)
    assert mixed.measure(np.array([3.0, 4.0])).tolist() == [5.0]
    with pytest.raises(NotImplementedError, match="H cannot be inverted"):
        mixed.invert(np.zeros((1, 1)))
    with pytest.raises(NotImplementedError):
        mixed.at(vedette.Pose([0.0, 0.0]))


def test_it_is_written_back():
    model = Linear(("x", "q"), F, Q, 2.0, B, U, {"q": "rad"})
    assert model.state == vedette.Space.of(x="m", q="rad")
    config = to_config(model)
    assert Linear(**{name: value for name, value in config.items() if name != "kind"}) == model


@pytest.mark.parametrize(
    ("given", "text"),
    [
        ({"F": np.eye(3)}, "F: must be 2 x 2, as `axes` has 2, got 3 x 3"),
        ({"Q": np.array([[1.0, 2.0], [2.0, 1.0]])}, "Q: must be positive semi-definite, got the eigenvalue -1"),
        ({"Q": np.array([[1.0, 2.0], [0.0, 1.0]])}, "Q: must be symmetric"),
        ({"B": B}, "B: must be 2 x 0"),
        ({"control": U}, "B: must be 2 x 2"),
        ({"units": {"z": "m"}}, "units.z: there is no such axis; those are p, q"),
        ({"step": 0}, "step: must be > 0"),
    ],
)
def test_wrong_matrices_of_a_motion(given, text):
    with pytest.raises(ValueError, match=text.replace(".", r"\.")):
        Linear(**({"axes": ("p", "q"), "F": F, "Q": Q} | given))


@pytest.mark.parametrize(
    ("given", "text"),
    [
        ({"R": np.zeros((2, 2))}, "R: must be positive definite"),
        ({"R": np.eye(3)}, "R: must be 2 x 2, as `axes` has 2, got 3 x 3"),
        ({"H": np.eye(3)}, "H: must be 2 x 2, a row for each"),
        ({"H": np.zeros((2, 2))}, "H: must look at an axis"),
        ({"measures": ("a",)}, "measures: must name 2 axes"),
    ],
)
def test_wrong_matrices_of_a_sensor(given, text):
    with pytest.raises(ValueError, match=text):
        LinearSensor(**({"axes": ("x", "y"), "R": np.eye(2)} | given))
