"""The laws of motion models: each takes a model, states (*b, n) and a time step."""

from collections.abc import Callable

import numpy as np
import scipy.linalg
from hypothesis import settings
from hypothesis import strategies as st
from hypothesis.extra import numpy as hnp

from vedette import MotionModel, kernels
from vedette_standard.motion.constant_acceleration import ConstantAcceleration
from vedette_standard.motion.constant_velocity import ConstantVelocity
from vedette_standard.motion.coordinated_turn import CoordinatedTurn
from vedette_standard.motion.known_turn import KnownTurn
from vedette_standard.motion.singer import Singer

PROFILE = settings(max_examples=40)


def powers_of_ten(low: float, high: float) -> st.SearchStrategy[float]:
    return st.floats(low, high).map(lambda exponent: 10.0**exponent)


SIGMAS = powers_of_ten(-3, 2)
MODELS = {
    ConstantVelocity: st.builds(ConstantVelocity, SIGMAS),
    ConstantAcceleration: st.builds(ConstantAcceleration, SIGMAS),
    Singer: st.builds(Singer, powers_of_ten(-2, 8), SIGMAS),
    KnownTurn: st.builds(KnownTurn, st.floats(-1, 1), SIGMAS),
    CoordinatedTurn: st.builds(CoordinatedTurn, SIGMAS, SIGMAS),
}
STEPS = powers_of_ten(-3, 1.8)
SCALES = np.array([1e4, 1e4, 100, 100])
EXTRA = {"ax": 10.0, "turn_rate": 1.0}


def states(model: MotionModel) -> st.SearchStrategy[np.ndarray]:
    """(*b, n) of plausible size, for a few kinds of batch axes."""
    names, n = model.state.names, len(model.state)
    scale = np.concatenate([SCALES, [EXTRA["ax"]] * 2 if "ax" in names else [EXTRA["turn_rate"]] * (n - 4)])
    shapes = st.sampled_from([(), (1,), (3,), (2, 3), (0,)])
    return shapes.flatmap(lambda b: hnp.arrays(float, (*b, n), elements=st.floats(-1, 1))).map(lambda x: x * scale)


# The laws: each takes a model, states (*b, n) and a time step.
def a_zero_step_changes_nothing(model, x, dt):
    np.testing.assert_array_equal(model.move(x, 0.0), x)
    np.testing.assert_array_equal(model.jacobian(x, 0.0), np.broadcast_to(np.eye(x.shape[-1]), model.jacobian(x, 0.0).shape))
    assert not model.noise(x, 0.0).any()


def noise_is_a_covariance(model, x, dt):
    Q = model.noise(x, dt)
    np.testing.assert_array_equal(Q, np.swapaxes(Q, -1, -2))
    spread = np.sqrt(np.diagonal(Q, axis1=-2, axis2=-1))
    assert np.all(spread > 0)
    assert np.all(np.linalg.eigvalsh(Q / (spread[..., :, None] * spread[..., None, :])) > -1e-13)


def jacobian_is_the_derivative(model, x, dt):
    slope = kernels.numerical_jacobian(lambda y: model.move(y, dt), x, model.state.difference)
    np.testing.assert_allclose(
        np.broadcast_to(model.jacobian(x, dt), slope.shape), slope, rtol=0, atol=2e-6 * np.max(np.abs(slope), initial=1.0)
    )


def a_batch_is_a_loop(model, x, dt):
    n = x.shape[-1]
    batch = (
        model.move(x, dt),
        np.broadcast_to(model.jacobian(x, dt), (*x.shape, n)),
        np.broadcast_to(model.noise(x, dt), (*x.shape, n)),
    )
    assert batch[0].shape == x.shape
    for i in np.ndindex(x.shape[:-1]):
        single = model.move(x[i], dt), model.jacobian(x[i], dt), model.noise(x[i], dt)
        for together, alone in zip(batch, single, strict=True):
            np.testing.assert_allclose(together[i], alone, rtol=1e-12, atol=1e-12 * np.max(np.abs(alone)))


def nothing_is_written_or_kept(model, x, dt):
    before = x.copy()
    first = [method(x, dt).copy() for method in (model.move, model.jacobian, model.noise)]
    for method, result in zip((model.move, model.jacobian, model.noise), first, strict=True):
        np.testing.assert_array_equal(method(x, dt), result)
    np.testing.assert_array_equal(x, before)


def two_steps_make_one(model, x, dt):
    for part in (0.01, 0.37, 0.5):
        a, b = part * dt, dt - part * dt
        F_a, F_b, F = model.jacobian(x, a), model.jacobian(x, b), model.jacobian(x, a + b)
        Q = model.noise(x, a + b)
        unit = np.sqrt(np.diagonal(Q))
        assert_close_in(1 / unit, 1 / unit, F_b @ model.noise(x, a) @ F_b.T + model.noise(x, b), Q, 1e-12)
        assert_close_in(dt ** orders(model), dt ** -orders(model), F_b @ F_a, F, 1e-12)


def moments_are_exact(model, x, dt):
    """Against the matrix exponential of the continuous model, in units in which the step is 1."""
    F, Q = discretised(*CONTINUOUS[model.kind](model), dt, orders(model))
    unit = np.sqrt(np.diagonal(Q))
    assert_close_in(1 / unit, 1 / unit, model.noise(x, dt), Q, 1e-11)
    assert_close_in(dt ** orders(model), dt ** -orders(model), model.jacobian(x, dt), F, 1e-11)
    np.testing.assert_allclose(model.move(x, dt), x @ F.T, rtol=0, atol=1e-11 * np.max(np.abs(x) @ np.abs(F).T, initial=0))


def assert_close_in(rows, columns, actual, expected, tolerance):
    """Whether two matrices agree to an absolute tolerance once rows and columns are scaled."""
    np.testing.assert_array_less(np.abs(rows[:, None] * (actual - expected) * columns), tolerance)


def orders(model):
    """How often each axis of the state was differentiated by time."""
    return np.array([0.0, 0, 1, 1, 2, 2][: len(model.state)])


# The oracle: x' = A x + w with spectral density W, discretised by Van Loan's method over a step short enough that nothing
# grows in it, and doubled up to the whole.
def shift(n):
    return np.eye(n, k=2)


def white(n, q):
    return np.diag([0.0] * (n - 2) + [q, q])


def continuous_turn(model):
    A = shift(4)
    A[2, 3], A[3, 2] = -model.turn_rate, model.turn_rate
    return A, white(4, model.sigma_accel**2)


def continuous_singer(model):
    A = shift(6)
    A[4, 4] = A[5, 5] = -1 / model.tau
    return A, white(6, 2 * model.sigma_accel**2 / model.tau)


CONTINUOUS = {
    ConstantVelocity.kind: lambda model: (shift(4), white(4, model.sigma_accel**2)),
    ConstantAcceleration.kind: lambda model: (shift(6), white(6, model.sigma_jerk**2)),
    Singer.kind: continuous_singer,
    KnownTurn.kind: continuous_turn,
}


def discretised(A, W, dt, order):
    n, unit = len(A), dt**order
    A = dt * unit[:, None] * A / unit
    W = dt * unit[:, None] * W * unit
    size = np.max(W)
    halvings = max(0, int(np.ceil(np.log2(np.max(np.abs(A))))))
    block = scipy.linalg.expm(np.block([[-A, W / size], [np.zeros((n, n)), A.T]]) / 2**halvings)
    F = block[n:, n:].T
    Q = F @ block[:n, n:]
    for _ in range(halvings):
        F, Q = F @ F, F @ Q @ F.T + Q
    return F * unit / unit[:, None], size * Q / unit / unit[:, None]


LAWS = [
    a_zero_step_changes_nothing,
    noise_is_a_covariance,
    jacobian_is_the_derivative,
    a_batch_is_a_loop,
    nothing_is_written_or_kept,
    two_steps_make_one,
    moments_are_exact,
]


def applies(law: Callable[..., None], model: type[MotionModel]) -> bool:
    return {two_steps_make_one: model.divisible is True, moments_are_exact: model.linear is True}.get(law, True)
