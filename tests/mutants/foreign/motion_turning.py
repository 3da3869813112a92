"""Wrong motion models: those that turn."""

from functools import partial

import attrs
import numpy as np

import vedette_standard as standard
import vedette_target_oriented as target_oriented
from mutants.foreign.base import INHERITED, Mutant, mutant

KNOWN = partial(standard.KnownTurn, turn_rate=0.1, sigma_accel=0.5)
TURN = partial(standard.CoordinatedTurn, sigma_accel=0.5, sigma_turn_rate=0.02)
CURVE = partial(standard.Curvilinear, sigma_tangential=0.2, sigma_normal=0.3)
ORIENTED = partial(target_oriented.TargetOriented, sigma_forward=0.5, sigma_side=1.5, side_accel=0.4)


def _euler_turn(right, x, dt):
    moved = right.move(x, dt)
    moved[..., :2] = x[..., :2] + dt * x[..., 2:4]
    return moved


def _divides_by_turn_rate(right, x, dt):
    px, py, vx, vy, w = (x[..., i] for i in range(5))
    with np.errstate(divide="ignore", invalid="ignore"):
        s, c = np.sin(w * dt), np.cos(w * dt)
        return np.stack(
            [px + (s * vx - (1 - c) * vy) / w, py + ((1 - c) * vx + s * vy) / w, c * vx - s * vy, s * vx + c * vy, w],
            axis=-1,
        )


def _first_ones_turn(right, x, dt):
    y = np.array(x)
    y[..., 4] = x.reshape(-1, 5)[0, 4] if x.size else 0.0
    moved = right.move(y, dt)
    moved[..., 4] = x[..., 4]
    return moved


def _small_rates_only(right, x, dt):
    limited = np.array(x)
    limited[..., 4] = np.clip(x[..., 4], -0.05, 0.05)
    moved = right.move(limited, dt)
    moved[..., 4] = x[..., 4]
    return moved


def _swapped_accelerations(right, x, dt):
    order = [0, 1, 2, 3, 5, 4]
    return right.move(x[..., order], dt)[..., order]


def _body_axes_swapped(right, x, dt):
    swapped = attrs.evolve(right, sigma_forward=right.sigma_side, sigma_side=right.sigma_forward)
    return swapped.noise(x, dt)


motion = partial(mutant, "motion")

MUTANTS: tuple[Mutant, ...] = (
    motion(
        "known_turn_other_way",
        "The motion turns from y to x, the noise from x to y.",
        KNOWN,
        move=lambda r, x, dt: attrs.evolve(r, turn_rate=-r.turn_rate).move(x, dt),
        jacobian=INHERITED,
    ),
    motion(
        "known_turn_degrees",
        "The rate in rad/s is taken as deg/s, throughout.",
        KNOWN,
        label="other_model",
        move=lambda r, x, dt: attrs.evolve(r, turn_rate=np.radians(r.turn_rate)).move(x, dt),
        jacobian=INHERITED,
        noise=lambda r, x, dt: attrs.evolve(r, turn_rate=np.radians(r.turn_rate)).noise(x, dt),
    ),
    motion(
        "turn_jacobian_ahead",
        "The derivative is taken at the moved state.",
        TURN,
        jacobian=lambda r, x, dt: r.jacobian(r.move(x, dt), dt),
    ),
    motion(
        "turn_rate_column_lost",
        "The derivative lacks the column of the turn rate.",
        TURN,
        jacobian=lambda r, x, dt: r.jacobian(x, dt) * [1, 1, 1, 1, 0] + np.diag([0.0, 0, 0, 0, 1]),
    ),
    motion("turn_divides_by_rate", "At a turn rate of 0 it divides by it.", TURN, move=_divides_by_turn_rate),
    motion(
        "turn_of_the_first", "All tracks turn with the first one's rate.", TURN, move=_first_ones_turn, jacobian=INHERITED
    ),
    motion("turn_declared_linear", "The coordinated turn declares itself linear.", TURN, linear=True),
    motion("turn_rate_clipped", "Turn rates beyond .05 rad/s turn as .05 does, silently.", TURN, move=_small_rates_only),
    motion(
        "turn_euler",
        "The position moves straight, the velocity turns: Euler's step.",
        TURN,
        label="other_model",
        move=_euler_turn,
        jacobian=INHERITED,
    ),
    motion(
        "curve_swapped",
        "Tangential and normal acceleration change places in the motion alone.",
        CURVE,
        move=_swapped_accelerations,
        jacobian=INHERITED,
    ),
    motion(
        "oriented_noise_swapped",
        "Forward and side noise change places.",
        ORIENTED,
        label="other_model",
        noise=_body_axes_swapped,
    ),
    motion(
        "oriented_noise_at_mean_of_tracks",
        "The heading of the noise is that of the mean over all tracks.",
        ORIENTED,
        noise=lambda r, x, dt: r.noise(np.broadcast_to(x.reshape(-1, 4).mean(axis=0), x.shape) if x.size else x, dt),
    ),
)
