"""Wrong motion models: the linear ones."""

from functools import partial

import numpy as np

import vedette_standard as standard
from mutants.foreign.base import INHERITED, Mutant, mutant

CV = partial(standard.ConstantVelocity, sigma_accel=0.5)
CA = partial(standard.ConstantAcceleration, sigma_jerk=0.3)
PIECEWISE = partial(standard.ConstantVelocityPiecewise, sigma_accel=0.5)
SINGER = partial(standard.Singer, tau=20.0, sigma_accel=1.0)
OU = partial(standard.OrnsteinUhlenbeck, tau=20.0, sigma_speed=2.0)
MARKOV = partial(standard.GaussMarkov, axes=("bias",), sigma=0.5, tau=10.0)
WALK = partial(standard.RandomWalk, sigma=1.5)
BLOCKS = partial(standard.Product, models=(CV(axes=("x",)), standard.ConstantVelocity(2.0, axes=("y",))))


def _half(right):
    """Return how many of the axes are positions, of a model of positions and velocities."""
    return len(right.state) // 2


def _backwards(right, x, dt):
    n = _half(right)
    return np.concatenate([x[..., :n] - dt * x[..., n:], x[..., n:]], axis=-1)


def _without_cross_terms(right, x, dt):
    return right.noise(x, dt) * np.eye(len(right.state))


def _axis_by_axis(right, x, dt):
    order = np.arange(len(right.state)).reshape(2, -1).T.ravel()  # as if the state were x, vx, y, vy
    return right.noise(x, dt)[..., order, :][..., order]


def _no_half(right, x, dt):
    n = len(right.state) // 3
    moved = right.move(x, dt)
    moved[..., :n] += dt**2 / 2 * x[..., 2 * n :]
    return moved


def _white_velocity_noise(right, x, dt):
    density = np.sqrt(2 / right.tau) * right.sigma_speed
    return standard.ConstantVelocity(density, axes=right.axes).noise(x, dt)


def _in_place(right, x, dt):
    n = _half(right)
    x[..., :n] += dt * x[..., n:]
    return x


def _first_block_everywhere(right, x, dt):
    n = len(right.models[0].state)
    first, noise = right.models[0].noise(x[..., :n], dt), np.array(right.noise(x, dt))
    for i, model in enumerate(right.models):
        here = right.state.locate(model.state)
        if i and len(here) == n:
            noise[..., here[0] : here[0] + n, here[0] : here[0] + n] = first
    return noise


def _jittered(right, x, dt):
    return right.noise(x, dt) * np.random.default_rng().uniform(0.9, 1.1)


def _cached_once():
    """Return a derivative that remembers the first one it was asked for, whatever the step."""
    kept = {}

    def jacobian(right, x, dt):
        if right.state not in kept:
            kept[right.state] = right.jacobian(x, dt)
        return kept[right.state]

    return jacobian


def _faster_is_noisier(right, x, dt):
    speed = np.linalg.norm(x[..., 2:4], axis=-1)
    return right.noise(x, dt) * (1.0 + speed / 20.0)[..., None, None]


motion = partial(mutant, "motion")

MUTANTS: tuple[Mutant, ...] = (
    motion("cv_backwards", "The position moves against the velocity.", CV, move=_backwards, jacobian=INHERITED),
    motion("cv_dt_twice", "Q is multiplied by dt once too often.", CV, noise=lambda r, x, dt: r.noise(x, dt) * dt),
    motion("cv_no_cross_terms", "Q lacks the covariance of position and velocity.", CV, noise=_without_cross_terms),
    motion("cv_axis_by_axis", "Q is ordered x, vx, y, vy, the state is x, y, vx, vy.", CV, noise=_axis_by_axis),
    motion(
        "cv_lower_triangle_lost",
        "Only the upper triangle of Q is filled.",
        CV,
        noise=lambda r, x, dt: np.triu(r.noise(x, dt)),
    ),
    motion(
        "cv_moves_in_minutes",
        "The motion takes dt in minutes, the noise in s.",
        CV,
        move=lambda r, x, dt: r.move(x, dt / 60),
        jacobian=lambda r, x, dt: r.jacobian(x, dt / 60),
    ),
    motion(
        "cv_noise_floor",
        "1e-6 is added to the diagonal of Q to be safe.",
        CV,
        noise=lambda r, x, dt: r.noise(x, dt) + 1e-6 * np.eye(len(r.state)),
    ),
    motion("cv_in_place", "The state that is passed in is moved itself.", CV, move=_in_place),
    motion(
        "cv_float32",
        "The motion is computed in single precision.",
        CV,
        move=lambda r, x, dt: r.move(x.astype(np.float32), dt).astype(np.float32),
    ),
    motion("cv_random_noise", "Q is jittered by an unseeded generator.", CV, noise=_jittered),
    motion(
        "cv_first_jacobian_kept", "The derivative is kept from the first call, whatever dt is.", CV, jacobian=_cached_once()
    ),
    motion(
        "cv_sigma_as_density",
        "The standard deviation is taken as the spectral density: not squared.",
        CV,
        label="other_model",
        noise=lambda r, x, dt: r.noise(x, dt) / r.sigma_accel,
    ),
    motion(
        "cv_faster_is_noisier",
        "The noise grows with the speed, as nothing says.",
        CV,
        label="other_model",
        divisible=False,
        linear=False,
        noise=_faster_is_noisier,
    ),
    motion(
        "piecewise_divisible",
        "Noise held through each step is declared divisible, which it is not.",
        PIECEWISE,
        divisible=True,
    ),
    motion(
        "piecewise_gain_linear",
        "The gain of the acceleration on the position is dt, not dt^2/2.",
        PIECEWISE,
        noise=lambda r, x, dt: np.kron(dt**2 * np.ones((2, 2)), np.eye(_half(r))) * r.sigma_accel**2,
    ),
    motion(
        "ca_no_half",
        "The position gains a dt^2 instead of a dt^2 / 2.",
        CA,
        move=_no_half,
        jacobian=INHERITED,
        divisible=False,
    ),
    motion(
        "ca_transposed",
        "The derivative is transposed.",
        CA,
        jacobian=lambda r, x, dt: np.swapaxes(r.jacobian(x, dt), -1, -2),
    ),
    motion(
        "singer_noise_of_small_dt",
        "Q is its limit for dt much below tau, that of white jerk, at all dt.",
        SINGER,
        noise=lambda r, x, dt: standard.ConstantAcceleration(np.sqrt(2 / r.tau) * r.sigma_accel, axes=r.axes).noise(x, dt),
    ),
    motion(
        "ou_white_noise", "Q is that of a velocity that does not decay.", OU, noise=_white_velocity_noise, divisible=False
    ),
    motion(
        "markov_euler",
        "e = 1 - dt / tau, which is negative for long steps, with the exact Q.",
        MARKOV,
        move=lambda r, x, dt: (1 - dt / r.tau) * x,
        jacobian=INHERITED,
        divisible=False,
    ),
    motion(
        "markov_square_forgotten",
        "Q = sigma^2 (1 - e), not (1 - e^2).",
        MARKOV,
        noise=lambda r, x, dt: r.sigma**2 * (1 - np.exp(-dt / r.tau)) * np.eye(len(r.state)),
    ),
    motion(
        "walk_deviation_linear",
        "The standard deviation, not the variance, grows with time.",
        WALK,
        noise=lambda r, x, dt: (r.sigma * dt) ** 2 * np.eye(len(r.state)),
    ),
    motion("product_first_noise", "Every block has the first model's Q.", BLOCKS, noise=_first_block_everywhere),
)
