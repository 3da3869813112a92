"""The problems that are timed: arrays only, the same for every contender and in every process.

State x, y, vx, vy in m and m/s; 1 s between scans; P_D 0.9 where there is clutter.
"""

from __future__ import annotations

import zlib
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.floating[Any]]

SIGMA = 5.0  # m, of a measured position
POLAR = (10.0, 0.01)  # m and rad, of a measured range and bearing
P_DETECT, P_GATE, DENSITY = 0.9, 0.99, 1e-4  # per m^2
GATE = -2.0 * np.log(1.0 - P_GATE)  # the chi-square quantile for two axes
KAPPA = 1.0  # of the unscented transform
MODES = ((0.5, 0.0), (3.0, 0.0), (0.5, 0.05), (0.5, -0.05), (1.5, 0.1), (1.5, -0.1))  # sigma_accel, turn rate


def transition(dt: float, turn_rate: float = 0.0) -> Array:
    """Return F of a velocity that turns at a constant rate."""
    return _discrete(dt, 1.0, turn_rate)[0]


def noise(dt: float, sigma_accel: float, turn_rate: float = 0.0) -> Array:
    """Return Q of its white-noise acceleration."""
    return _discrete(dt, sigma_accel, turn_rate)[1]


def _discrete(dt: float, sigma_accel: float, turn_rate: float) -> tuple[Array, Array]:
    """Return F and Q by Van Loan's block exponential."""
    A, G = np.zeros((4, 4)), np.diag([0.0, 0.0, 1.0, 1.0]) * sigma_accel**2
    A[0, 2] = A[1, 3] = 1.0
    A[2, 3], A[3, 2] = -turn_rate, turn_rate
    block = np.block([[-A, G], [np.zeros((4, 4)), A.T]]) * dt
    term = total = np.eye(8)
    for k in range(1, 30):
        term = term @ block / k
        total = total + term
    F = total[4:, 4:].T
    return F, F @ total[:4, 4:]


def switching(modes: int) -> Array:
    """Return the mode transition probabilities (r, r)."""
    if modes == 1:
        return np.ones((1, 1))
    change = 0.1 / (modes - 1)
    return np.full((modes, modes), change) + np.eye(modes) * (0.9 - change)


@dataclass(frozen=True)
class Problem:
    """`tracks` None: one target online, z (steps, k, 2); else a batch, z (steps, tracks, k, 2); `probe`: what is checked.

    Family gnn: one scan z (1, k, 2) of all `tracks`, whose predictions start from x0 (tracks, 4) and share P0.
    F, Q (r, 4, 4), one a mode.
    """

    family: str
    modes: int
    tracks: int | None
    F: Array
    Q: Array
    x0: Array
    P0: Array
    z: Array
    probe: tuple[int, ...]

    @property
    def steps(self) -> int:
        return len(self.z)

    @property
    def H(self) -> Array:
        n = self.x0.shape[-1]
        return np.eye(n // 2, n)

    @property
    def R(self) -> Array:
        return (
            np.diag(np.square(POLAR))
            if self.family in ("ekf", "ukf", "foreign")
            else SIGMA**2 * np.eye(self.x0.shape[-1] // 2)
        )

    @property
    def switching(self) -> Array:
        return switching(self.modes)

    @property
    def work(self) -> int:
        """What the time of one run is divided by: filter steps; scans for gnn."""
        return self.steps if self.tracks is None or self.family == "gnn" else self.steps * self.tracks


def make(
    family: str, modes: int = 1, tracks: int | None = None, returns: int = 1, steps: int = 50, axes: int = 2
) -> Problem:
    """Make the problem of these figures, which alone determine the random numbers. `axes` other than 2: only for kf."""
    seed = zlib.crc32(repr((family, modes, tracks, returns, steps, axes)).encode())
    rng = np.random.default_rng(seed)
    common: dict[str, Any] = {
        "family": family,
        "modes": modes,
        "F": np.array([transition(1.0, turn) for _, turn in MODES[:modes]]),
        "Q": np.array([noise(1.0, accel, turn) for accel, turn in MODES[:modes]]),
    }
    P0 = np.diag([100.0, 100.0, 25.0, 25.0])
    if family == "gnn":
        assert tracks is not None
        return _crowd(rng, tracks, returns, common)
    x0 = np.array([4000.0, 3000.0, 12.0, -5.0])
    if family in ("ekf", "ukf", "foreign"):
        where, _ = _flown(rng, x0, steps, tracks or 1)
        polar = np.stack([np.hypot(where[..., 0], where[..., 1]), np.arctan2(where[..., 1], where[..., 0])], axis=-1)
        z = polar + rng.standard_normal(polar.shape) * POLAR
        if tracks is None:
            return Problem(tracks=None, x0=x0, P0=P0, z=z, probe=(), **common)
        return Problem(tracks=tracks, x0=x0, P0=P0, z=z[:, :, None], probe=_probe(tracks), **common)
    if axes != 2:
        common["F"] = np.kron(np.array([[1.0, 1.0], [0.0, 1.0]]), np.eye(axes))[None]
        common["Q"] = np.kron(noise(1.0, MODES[0][0])[::2, ::2], np.eye(axes))[None]
        x0, P0 = np.repeat([4000.0, 12.0], axes), np.diag(np.repeat([100.0, 25.0], axes))
    count = 1 if tracks is None else tracks
    where, scatter = _flown(rng, x0, steps, count, returns)
    z = where[:, :, None, :] + scatter
    z[:, :, 0] = where + SIGMA * rng.standard_normal(where.shape)  # the first is the target's, the others are clutter
    if tracks is None:
        return Problem(tracks=None, x0=x0, P0=P0, z=z[:, 0], probe=(), **common)
    return Problem(tracks=tracks, x0=x0, P0=P0, z=z, probe=_probe(tracks), **common)


def _probe(tracks: int) -> tuple[int, ...]:
    """Return the tracks of a batch that are checked."""
    return 0, min(1, tracks - 1), tracks // 2, tracks - 1


def _flown(rng: np.random.Generator, x0: Array, steps: int, count: int, returns: int = 1) -> tuple[Array, Array]:
    """Draw true positions (steps, count, 2), and returns up to 20 m off on each axis (steps, count, returns, 2)."""
    axes = len(x0) // 2
    speed = x0[axes:] + 0.5 * np.cumsum(rng.standard_normal((steps, count, axes)), axis=0)
    return x0[:axes] + np.cumsum(speed, axis=0), rng.uniform(-20, 20, (steps, count, returns, axes))


def _crowd(rng: np.random.Generator, tracks: int, returns: int, common: dict[str, Any]) -> Problem:
    """Draw targets 250 m apart; nine in ten are detected once, the other returns are clutter over the whole area."""
    side = int(np.ceil(np.sqrt(tracks)))
    grid = 250.0 * np.stack(np.divmod(np.arange(tracks), side), axis=-1)
    x0 = np.concatenate([grid, rng.normal(0, 10, (tracks, 2))], axis=-1)
    seen = int(0.9 * tracks)
    true = x0[:seen, :2] + x0[:seen, 2:] + SIGMA * rng.standard_normal((seen, 2))
    clutter = rng.uniform(-125.0, 250.0 * side - 125.0, (returns - seen, 2))
    z = rng.permutation(np.concatenate([true, clutter]))[None]
    return Problem(tracks=tracks, x0=x0, P0=np.diag([50.0, 50.0, 9.0, 9.0]), z=z, probe=tuple(range(tracks)), **common)
