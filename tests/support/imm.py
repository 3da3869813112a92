"""Steps of an IMM, boats for it, and modes of unlike states."""

import numpy as np

from vedette import Gate, Gaussian
from vedette_standard.associators.pda import Pda
from vedette_standard.estimators.extended import ExtendedKalman
from vedette_standard.estimators.imm import Imm
from vedette_standard.estimators.kalman import Kalman
from vedette_standard.estimators.unscented import UnscentedKalman
from vedette_standard.motion.constant_acceleration import ConstantAcceleration
from vedette_standard.motion.constant_velocity import ConstantVelocity
from vedette_standard.motion.coordinated_turn import CoordinatedTurn

RNG = np.random.default_rng(0)
"""Asked for by the signature; these filters draw nothing."""


def step(imm, belief, sensor, seen, dt=1.0, gate=None, associator=None):
    """Prior, association weights, posterior of one scan for tracks (*b, t)."""
    gate = gate or Gate(0.99)
    prior = imm.predict(belief, dt, RNG)
    innovation = imm.evaluate(prior, sensor, seen, gate.probability)
    ones = np.ones(innovation.loglik.shape[:-1])
    scores = gate.scores(innovation, sensor, seen, ones, gate.for_sensor(sensor))
    weights = (associator or Pda()).associate(scores, None)
    return prior, innovation, weights, imm.update(prior, innovation, weights)


def pool(parts):
    """Mean and covariance of weighted Gaussians (weight, mean, covariance)."""
    mean = sum(w * x for w, x, _ in parts)
    second = sum(w * (P + np.outer(x, x)) for w, x, P in parts)
    return mean, second - np.outer(mean, mean)


def unlike(transition=None, **more):
    """CV, CA, a turn by an EKF, a turn by a UKF: states of 4, 6, 5 and 5 axes."""
    modes = (
        Kalman(ConstantVelocity(0.3)),
        ExtendedKalman(ConstantAcceleration(0.3)),
        ExtendedKalman(CoordinatedTurn(0.3, 0.01)),
        UnscentedKalman(CoordinatedTurn(0.3, 0.02)),
    )
    if transition is None and "rates" not in more:
        transition = np.full((4, 4), 0.05) + 0.8 * np.eye(4)
    return Imm(modes, transition=transition, **more)


def start(imm, *batch, seed=0):
    """Boats 1 km off, some m/s fast, hardly known to accelerate or turn."""
    rng = np.random.default_rng(seed)
    typical = {"x": (800.0, 20.0), "y": (500.0, 20.0), "vx": (-10.0, 3.0), "vy": (5.0, 3.0)}
    mean, deviation = np.array([typical.get(name, (0.0, 0.05)) for name in imm.state.names]).T
    n = len(mean)
    a = deviation[:, None] * (np.eye(n) + rng.normal(size=(*batch, n, n)) / 4)
    return imm.start(Gaussian(mean + deviation * rng.normal(size=(*batch, n)), a @ np.swapaxes(a, -1, -2)), imm.state, rng)


NESTED = Imm(
    (
        Imm((Kalman(ConstantVelocity(0.1)), ExtendedKalman(ConstantVelocity(1.0))), transition=[[0.9, 0.1], [0.1, 0.9]]),
        UnscentedKalman(CoordinatedTurn(0.3, 0.02)),
    ),
    rates=[[-0.1, 0.1], [0.2, -0.2]],
)
