"""The posterior Cramer-Rao bound where detections may fail: what no filter can do better than, on average.

>>> flat = np.eye(1)
>>> float(reduced_bound(4.0 * flat, flat[None], 0.0 * flat[None], flat[None], np.array([0.5]))[0, 0, 0])
1.3333333333333333
>>> float(enumerated_bound(4.0 * flat, flat[None], 0.0 * flat[None], flat[None], np.array([0.5]))[0, 0, 0])
2.4
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence

import numpy as np

from vedette import Array, Indices, Scan, Sensor, Space, Trajectory
from vedette.kernels import numerical_jacobian, propagate, symmetric
from vedette.metrics import Bound, positions, truth_at

ENUMERATED = 12
"""Scans that may miss, from the first, over which sequences of detections are enumerated: 2^12 of them."""


def information(sensor: Sensor, x: Array) -> Array:
    """Return the Fisher information about the observed axes that one return gives: (*b, n) -> (*b, n, n).

    H' R^-1 H, and 1/2 tr(R^-1 dR/dx_i R^-1 dR/dx_j) where the noise depends on the state.
    """
    H, R, m = sensor.jacobian(x), sensor.noise(x), len(sensor.measurement)
    inverse = np.linalg.inv(R)
    fisher = np.swapaxes(H, -1, -2) @ inverse @ H
    if R.ndim > 2:

        def flat(y: Array) -> Array:
            return sensor.noise(y).reshape(*y.shape[:-1], m * m)

        slope = np.moveaxis(numerical_jacobian(flat, x, np.subtract), -1, -2).reshape(*x.shape, m, m)
        part = inverse[..., None, :, :] @ slope
        fisher = fisher + 0.5 * np.einsum("...iab,...jba->...ij", part, part)
    return symmetric(np.broadcast_to(fisher, (*x.shape, x.shape[-1])))


def reduced_bound(start: Array, transition: Array, noise: Array, info: Array, p_detect: Array) -> Array:
    """Return the bound (s, *b, n, n) by information reduction: J_k = (Q + F J_(k-1)^-1 F')^-1 + P_D I.

    `start` (n, n): the covariance before the first scan; `transition` and `noise` (s, *b, n, n): F and Q of the step to each
    scan; `info` (s, *b, n, n): the information I of a return, or its mean over truth; `p_detect` (s, *b). It lies below the
    bound by enumeration, as the inverse is convex, and equals it for P_D = 1: the covariance of Riccati's equation.
    Tichavsky, Muravchik, Nehorai, Posterior Cramer-Rao Bounds for Discrete-Time Nonlinear Filtering, IEEE T-SP 46, 1998;
    Hernandez, Ristic, Farina, Timmoneri, A Comparison of Two Cramer-Rao Bounds for Nonlinear Filtering with P_D < 1,
    IEEE T-SP 52, 2004.
    """
    P, bounds = start, []
    for F, Q, gained, p in zip(transition, noise, info, p_detect, strict=True):
        P = _informed(propagate(P, F, Q), gained * np.asarray(p)[..., None, None])
        bounds.append(P)
    return np.stack(bounds)


def enumerated_bound(start: Array, transition: Array, noise: Array, info: Array, p_detect: Array) -> Array:
    """Return the bound (s, n, n) by enumeration: the mean over all sequences of detections of the bound given each.

    Arguments as in `reduced_bound`, with no batch axes. After the first ENUMERATED scans that may or may not detect, the
    information of each sequence is reduced instead, which leaves a bound, if a lower one.
    Farina, Ristic, Timmoneri, Cramer-Rao Bound for Nonlinear Filtering with P_D < 1 and Its Application to Target
    Tracking, IEEE T-SP 50, 2002.
    """
    branches, chance, bounds = start[None], np.ones(1), []
    for F, Q, gained, p in zip(transition, noise, info, p_detect.tolist(), strict=True):
        branches = propagate(branches, F, Q)
        if 0 < p < 1 and len(branches) < 2**ENUMERATED:
            branches = np.concatenate([_informed(branches, gained), branches])
            chance = np.concatenate([p * chance, (1.0 - p) * chance])
        else:
            branches = _informed(branches, p * gained)
        bounds.append(np.einsum("q,qij->ij", chance, branches))
    return np.stack(bounds)


def bound_along(
    bound: Bound, sensors: Mapping[str, Sensor], scans: Sequence[Scan], states: Array, space: Space
) -> Array | None:
    """Return the bound (s, *b, n, n) over the motion's axes after each of `scans`; the truth there is `states` (s, *b, m).

    `space`: the axes of `states`. Matrices that depend on the state are taken at the truth:
    exact where motion and sensors are linear. Q and P_D are taken as constant there. None where `space` lacks an axis of
    the motion.
    """
    motion = bound.motion
    if any(axis not in space.axes for axis in motion.state.axes):
        return None
    x = states[..., space.locate(motion.state)]
    n, batch = x.shape[-1], x.shape[1:-1]
    full = np.broadcast_to
    F, Q = np.empty((*x.shape, n)), np.zeros((*x.shape, n))
    info, p_detect = np.zeros((*x.shape, n)), np.empty(x.shape[:-1])
    F[0] = np.eye(n)
    for k, scan in enumerate(scans):
        if k:
            dt = scan.time - scans[k - 1].time
            F[k], Q[k] = full(motion.jacobian(x[k - 1], dt), F[k].shape), full(motion.noise(x[k - 1], dt), F[k].shape)
        sensor = sensors[scan.sensor].placed(scan.pose)
        where = motion.state.locate(sensor.observes)
        observed = x[k][..., where]
        info[k][..., np.array(where)[:, None], where] = information(sensor, observed)
        p_detect[k] = full(sensor.detects(observed), batch)
    if bound.method == "information_reduction":
        return reduced_bound(bound.covariance, F, Q, info, p_detect)
    every = [(slice(None), *i) for i in np.ndindex(*batch)]  # all scans of one trajectory each
    bounds = [enumerated_bound(bound.covariance, F[of], Q[of], info[of], p_detect[of]) for of in every]
    return np.stack(bounds, axis=1).reshape(F.shape)


def _informed(P: Array, info: Array) -> Array:
    """Return (P^-1 + I)^-1 = P - P I (1 + P I)^-1 P, for singular P too: (*b, n, n)."""
    eye: Array = np.eye(P.shape[-1])
    return symmetric(np.linalg.solve(eye + P @ info, P))


def position_bound(
    bound: Bound, sensors: Mapping[str, Sensor], truth: Sequence[Trajectory], scans: Sequence[Scan], judged: Indices
) -> float | None:
    """Return the root of the mean bound of the squared position error over the judged scans and objects, in m.

    None where the truth lacks an axis of the bound's motion, or where none is there.
    """
    space = bound.motion.state
    if any(axis not in path.space.axes for path in truth for axis in space.axes):
        return None
    real = truth_at(truth, np.array([scan.time for scan in scans]), space)
    lives, life = np.unique(real.alive, axis=1, return_inverse=True)
    spot, squares = positions(space), list[Array]()
    for i, there in enumerate(lives.T):
        alive_at = np.flatnonzero(there)
        if not len(alive_at):
            continue
        members, looks = real.states[alive_at][:, life.reshape(-1) == i], [scans[k] for k in alive_at.tolist()]
        P = bound_along(bound, sensors, looks, members, space)
        if P is None:
            return None
        squares.append(np.sum(P[np.isin(alive_at, judged)][..., spot, spot], axis=-1).ravel())
    every = np.concatenate([*squares, np.zeros(0)])
    return float(np.sqrt(np.mean(every))) if every.size else None
