"""The kinds that are given as matrices: against plain algebra, in a config, and what they refuse."""

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

import vedette
from vedette.config import to_config
from vedette_standard.motion.constant_acceleration import ConstantAcceleration
from vedette_standard.motion.constant_velocity import ConstantVelocity
from vedette_standard.motion.constant_velocity_piecewise import ConstantVelocityPiecewise
from vedette_standard.motion.known_turn import KnownTurn
from vedette_standard.motion.linear import Linear
from vedette_standard.motion.singer import Singer
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


FLOWS = [
    ConstantVelocity(0.7),
    ConstantAcceleration(0.3, axes=("x",)),
    Singer(sigma_accel=2.0, tau=3.0, axes=("x",)),
    Singer(sigma_accel=2.0, tau=0.1, axes=("x",)),  # forgets 30 times within the step
    KnownTurn(sigma_accel=0.4, turn_rate=0.9),
]


@settings(max_examples=60, deadline=None)
@given(flow=st.sampled_from(FLOWS), dt=st.floats(1e-3, 20.0))
def test_between_its_steps_it_is_the_flow_that_makes_them(flow, dt):
    step, x = 3.0, np.linspace(-5.0, 8.0, len(flow.state))
    model = Linear(flow.state.names, flow.jacobian(x, step), flow.noise(x, step), step)
    F, Q = (np.broadcast_to(one, (len(x), len(x))) for one in (flow.jacobian(x, dt), flow.noise(x, dt)))
    # What is forgotten by e^-30 is rounded in F; just after a step that is seen.
    some = 1e-5 if dt < 0.1 * step else 1e-8
    np.testing.assert_allclose(model.jacobian(x, dt), F, rtol=some, atol=some)
    np.testing.assert_allclose(model.noise(x, dt), Q, rtol=some, atol=some * np.max(Q))
    assert model.divisible


@settings(max_examples=40, deadline=None)
@given(first=st.floats(0.01, 5.0), then=st.floats(0.01, 5.0), seed=st.integers(0, 99))
def test_with_a_control_two_moves_make_one(first, then, seed):
    model, x = Linear(("p", "q"), F, Q, 2.0, B, U), np.random.default_rng(seed).standard_normal((3, 2))
    after, later = model.move(x, first), model.jacobian(x, then)
    np.testing.assert_allclose(model.move(after, then), model.move(x, first + then), rtol=1e-9, atol=1e-9)
    both = later @ model.noise(x, first) @ later.T + model.noise(x, then)
    np.testing.assert_allclose(both, model.noise(x, first + then), rtol=1e-9, atol=1e-9)


@pytest.mark.parametrize("size", [1e-12, 1.0, 1e12])
def test_the_size_of_its_noise_rounds_neither_matrix(size):
    model, x = Linear(("p", "q"), F, Q * size), np.zeros(2)
    half, noise = model.jacobian(x, 0.5), model.noise(x, 0.5)
    np.testing.assert_allclose(half @ half, F, atol=1e-14)
    np.testing.assert_allclose((half @ noise @ half.T + noise) / size, Q, atol=1e-14)


@pytest.mark.parametrize("short", [1e-3, 1e-7])
def test_of_a_turn_by_nearly_a_half_the_noise_of_a_part_is_no_larger_than_of_all(short):
    c, s = np.cos(np.pi - short), np.sin(np.pi - short)
    model = Linear(("p", "q"), np.array([[c, -s], [s, c]]), np.diag([1.0, 2.0]))
    least, most = np.linalg.eigvalsh(model.noise(np.zeros(2), 0.5))
    assert 0.1 < least < most < 2.0
    assert not model.divisible


def test_of_a_noise_that_is_held_through_a_step_a_part_is_near():
    held, x = ConstantVelocityPiecewise(1.0, axes=("x",)), np.zeros(2)
    model = Linear(held.state.names, held.jacobian(x, 1.0), held.noise(x, 1.0))
    assert not model.divisible
    white = ConstantVelocity(1.0, axes=("x",))  # of as much velocity in a step
    np.testing.assert_allclose(model.noise(x, 0.5), white.noise(x, 0.5), atol=1e-12)
    np.testing.assert_allclose(model.noise(x, 1.0), held.noise(x, 1.0), atol=1e-12)


def test_of_a_noise_that_comes_at_the_end_of_a_step_a_part_is_near():
    """No position gains at once what its velocity does."""
    white, x = ConstantVelocity(1.0, axes=("x",)), np.zeros(2)
    model = Linear(white.state.names, white.jacobian(x, 1.0), np.diag([0.0, 1.0]))
    np.testing.assert_allclose(model.noise(x, 0.5), white.noise(x, 0.5), atol=1e-12)
    assert not model.divisible


@pytest.mark.parametrize("sudden", [-0.5, 0.0])
def test_a_part_of_what_happens_at_once_lies_between(sudden):
    model, x = Linear(("p", "q"), np.diag([1.0, sudden]), Q, 2.0), np.array([1.0, -1.0])
    np.testing.assert_allclose(model.move(x, 0.5), [1.0, -0.75 - 0.25 * sudden])
    np.testing.assert_allclose(model.noise(x, 0.5), 0.25 * Q)
    assert not model.divisible


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
