"""Laws of estimators that are exact for linear models with Gaussian noise."""

from __future__ import annotations

from typing import Any

import numpy as np

from vedette.filters import predicted
from vedette.roles import Estimator
from vedette.space import Array
from vedette.testing.comparisons import same
from vedette.testing.law import Law
from vedette.testing.laws import estimator_cases as cases
from vedette.testing.laws.estimator_cases import P_GATE, Scene, alike
from vedette.types import Gaussian


def equals_joint_conditioning(estimator: Estimator[Any], drawn: Scene) -> None:
    """If exact when linear: two predictions and scans equal conditioning the joint Gaussian of states and returns."""
    motion = cases.linear_motion(estimator)
    belief, state = cases.started(estimator, drawn, drawn.rng()), estimator.state
    own = motion.state.locate(state)
    scans = ((drawn.dt, drawn.watch, drawn.seen), (drawn.later, drawn.other, drawn.others))
    logs = []
    for dt, watch, detections in scans:
        belief = predicted(estimator, belief, dt, drawn.rng())
        innovation = estimator.evaluate(belief, watch, detections, P_GATE)
        logs.append(innovation.loglik[..., 1])
        belief = estimator.update(belief, innovation, cases.sure(innovation.loglik, 1))
    found = estimator.moments(belief)
    for b, t in np.ndindex(2, 2):
        mean, cov = drawn.prior.mean[b, t], drawn.prior.cov[b, t]
        n, zs, mean_z, cross, square = len(mean), np.zeros(0), np.zeros(0), np.zeros((len(mean), 0)), np.zeros((0, 0))
        wanted_logs, before = [], 0.0
        for dt, watch, detections in scans:
            F = motion.jacobian(mean[own], dt)[np.ix_(own, own)] if own != list(range(n)) else motion.jacobian(mean, dt)
            Q = motion.noise(mean, dt)
            mean, cov, cross = F @ mean, F @ cov @ F.T + Q, F @ cross
            H = np.zeros((len(watch.R), n))
            H[:, state.locate(watch.observes)] = watch.H
            corner = H @ cross
            square = np.block([[square, corner.T], [corner, H @ cov @ H.T + watch.R]])
            cross = np.concatenate([cross, cov @ H.T], axis=1)
            zs, mean_z = np.concatenate([zs, detections.z[b, 0]]), np.concatenate([mean_z, H @ mean])
            joint = _log_normal(zs - mean_z, square)
            wanted_logs.append(joint - before + np.log(watch.probability))
            before = joint
        gain = np.linalg.solve(square, cross.T).T
        wanted = Gaussian(mean + gain @ (zs - mean_z), cov - gain @ cross.T)
        alike(estimator, Gaussian(found.mean[b, t], found.cov[b, t]), wanted, 1e-6)
        same("log-likelihoods", np.array([log[b, t] for log in logs]), np.array(wanted_logs), 1e-7, 1 + abs(before))


def _log_normal(x: Array, cov: Array) -> float:
    root = np.linalg.cholesky(cov)
    white = np.linalg.solve(root, x)
    return float(-0.5 * white @ white - np.log(np.diagonal(root)).sum() - 0.5 * len(x) * np.log(2 * np.pi))


def order_of_sensors_is_free(estimator: Estimator[Any], drawn: Scene) -> None:
    """If exact when linear: two independent sensors at one time may report in any order."""
    cases.linear_motion(estimator)
    one, other = (estimator.moments(end) for end in cases.in_either_order(estimator, drawn))
    alike(estimator, other, one, 1e-7)


LAWS = tuple(Law(law, needs="traits.exact_when_linear") for law in (equals_joint_conditioning, order_of_sensors_is_free))
