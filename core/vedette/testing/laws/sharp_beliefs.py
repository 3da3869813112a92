"""Laws of estimators in the limit of a sharp belief, where every filter equals the linearised update.

There a bent sensor of three axes, one of them a bearing that wraps, with noise and detection that depend on the state,
decides what the kit's linear sensor cannot see.
"""

from __future__ import annotations

from typing import Any

import numpy as np
from attrs import evolve, frozen

from vedette.filters import predicted
from vedette.roles import Estimator
from vedette.sampling import psd_root
from vedette.space import Array, Space
from vedette.testing.comparisons import (
    Closed,
    closed_by,
    closed_if,
    demand,
    deviations,
    frozen_copy,
    products,
    same,
    whitened,
)
from vedette.testing.law import Law
from vedette.testing.laws.estimator_cases import P_GATE, Scene, alike, free_axes, not_refused, soft, started, sure
from vedette.testing.sensors import MEASURED, Bent, Tangent, Watch
from vedette.testing.states import random_covariance, sizes
from vedette.testing.truth import motion_of
from vedette.types import Detections, Gaussian

SHARP = 1e-5
"""Deviations of a sharp belief, as a share of each axis' usual size."""


@frozen(eq=False)
class Sharp:
    """Two runs of two tracks far apart with sharp beliefs (2, 2, n), an unlike sensor, and returns (2, 2, 3)."""

    prior: Gaussian
    sensor: Bent | Watch
    z: Array

    def scan(self, noise: Array | None = None) -> Detections:
        """Return the scan, its returns with noises of their own or not."""
        return Detections(self.z, np.ones(self.z.shape[:-1], dtype=bool), None, noise)


def sharp(estimator: Estimator[Any], drawn: Scene) -> Sharp:
    """Return what the laws of the limit are tried on: an unlike sensor, or a linear one if the estimator takes no other."""
    rng, state, free = drawn.rng(), estimator.state, free_axes(estimator)
    n = len(free)
    size, where = sizes(free), state.locate(free)
    mean = np.array(drawn.prior.mean)
    for i, axis in enumerate(state.axes):
        if axis.period is not None:  # on the wrap, where mistakes show
            mean[..., i] = axis.period / 2 - 0.3 * SHARP * axis.period * rng.random((2, 2))
    mean[:, 1] = state.displace(mean[:, 0], 0.1 * sizes(state) * rng.uniform(-1, 1, (2, len(state))))
    mean = state.canonical(mean)
    cov = np.zeros((2, 2, len(state), len(state)))
    cov[..., np.array(where)[:, None], where] = random_covariance(free, rng, (2, 2), SHARP)
    centre = state.canonical(mean[0, 0])[where]
    A, B = rng.uniform(0.4, 1.2, (3, n)) * rng.choice([-1.0, 1.0], (3, n)), 0.3 * rng.standard_normal((3, n))
    root = SHARP * (np.eye(3) + 0.3 * rng.standard_normal((3, 3)))
    sensor = Bent(free, centre, size, A, B, root @ root.T, float(np.pi - 0.5 * SHARP))
    spread = SHARP * np.sqrt(np.sum(A**2, axis=-1) + 1.0)
    prior = Gaussian(frozen_copy(mean), frozen_copy(cov))
    if estimator.refuses(sensor) is None:
        z = MEASURED.canonical(sensor.measure(mean[..., where]) + 0.7 * spread * rng.standard_normal((2, 2, 3)))
        return Sharp(prior, sensor, frozen_copy(z))
    plain = [i for i, axis in enumerate(free.axes) if axis.period is None]
    flat = Watch(Space(tuple(free.axes[i] for i in plain)), sensor.C, 0.8, mix=(A / size)[:, plain])
    not_refused(estimator, flat, "sensors of three axes")
    closed_if(not plain, "all of its axes wrap")
    z = flat.measure(mean[..., state.locate(flat.observes)]) + 0.7 * spread * rng.standard_normal((2, 2, 3))
    return Sharp(prior, flat, frozen_copy(z))


def an_unlike_sensor_is_linearised(estimator: Estimator[Any], drawn: Scene) -> None:
    """Where a belief is sharp, a bent sensor with a bearing on the wrap changes it as its tangent does.

    One that refuses it is tried with a linear one. A return's own noise counts as if it were the sensor's.
    """
    given = sharp(estimator, drawn)
    where = estimator.state.locate(given.sensor.observes)
    start = estimator.start(given.prior, estimator.state, drawn.rng())
    R = np.asarray(given.sensor.noise(given.prior.mean[0, 0, where]))
    own = frozen_copy(R * drawn.rng().uniform(0.3, 3.0, (2, 2, 1, 1)))
    for what, scan in (("", given.scan()), (", own noise", given.scan(own))):
        found = estimator.evaluate(start, given.sensor, scan, P_GATE)
        weights = soft(found.loglik, drawn.seed)
        weights[:, 0, 2] = weights[:, 1, 1] = 0.0  # the other track's return lies where the sensor has bent
        weights /= weights.sum(axis=-1, keepdims=True)
        after = estimator.moments(estimator.update(start, found, weights))
        for b, t in np.ndindex(2, 2):
            tangent = Tangent(given.sensor, given.prior.mean[b, t, where], own[b, t] if what else None)
            wanted = estimator.evaluate(start, tangent, evolve(scan, noise=None), P_GATE)
            there = estimator.moments(estimator.update(start, wanted, weights))
            reach = 1.0 + np.abs(wanted.distance[b, t, t])
            for name, i in (("distance", t), ("nis", t), ("loglik", 0), ("loglik", 1 + t)):
                one, goal = (getattr(each, name)[b, t, i] / reach for each in (found, wanted))
                same(f"{name}{', of a miss' if name == 'loglik' and not i else what}", one, goal, 2e-2, 1.0)
            if not what:  # it is that of the sensor's own noise
                same("log_volume", found.log_volume[b, t], wanted.log_volume[b, t], 2e-2, 1.0)
            alike(estimator, _one(after, b, t), _one(there, b, t), 2e-2, f"updated{what}: ")
    canonical = estimator.state.canonical(after.mean)
    same("mean, canonical", after.mean, canonical, 1e-9, np.abs(canonical) + 1.0)


def _one(moments: Gaussian, b: int, t: int) -> Gaussian:
    return Gaussian(moments.mean[b, t], moments.cov[b, t])


def predicts_as_its_motion_linearised(estimator: Estimator[Any], drawn: Scene) -> None:
    """Where a belief is sharp, prediction moves its mean as the motion does, and its covariance is F P F' + Q."""
    motion = motion_of(estimator)
    if motion is None or motion.state != estimator.state or estimator.traits.reframes or len(estimator.zero_variance):
        raise Closed("it holds no `motion` over its own axes alone")
    given = sharp(estimator, drawn)
    state, dt = estimator.state, drawn.dt
    ends = []
    unlike = 10.0 ** drawn.rng().uniform(-1.0, 1.0, len(state))  # axes of which much or little is known
    P = 1e4 * given.prior.cov * (unlike[:, None] * unlike)
    for scale in (1.0, 1e-6):
        prior = Gaussian(given.prior.mean, frozen_copy(scale * P))
        start = estimator.start(prior, state, drawn.rng())
        ends.append(estimator.moments(predicted(estimator, start, dt, drawn.rng())))
    x = given.prior.mean
    F = np.broadcast_to(motion.jacobian(x, dt), P.shape)
    Q = np.broadcast_to(motion.noise(x, dt), P.shape)
    wanted = F @ P @ np.swapaxes(F, -1, -2)
    spread, added = deviations(wanted), np.maximum(deviations(Q), 1e-150)
    apart = state.difference(ends[1].mean, state.canonical(motion.move(x, dt)))
    same("mean moved", apart / spread, np.zeros(apart.shape), 1e-2, 1.0)
    if not estimator.traits.exact_when_linear:  # it may be conservative, and by a share of the noise too where it says so
        left = ends[0].cov - (Q if estimator.traits.conservative else ends[1].cov)
        least_share = float(np.min(np.linalg.eigvalsh(whitened(psd_root(wanted), left))))
        demand(least_share > 0.9, f"predict: of F P F', {least_share:.3g} remains, must be at least all of it")
        short = np.diagonal(Q - ends[1].cov, axis1=-2, axis2=-1) / np.maximum(added**2, 1e-300)
        demand(np.max(short) < 0.01, f"predict: the noise Q is short by {np.max(short):.3g} of it")
        return
    same("covariance that F P F' adds", ends[0].cov - ends[1].cov, wanted, 0.02, products(spread))
    least = 1e-6 * products(spread) + products(added)
    same("covariance of a sure state, Q", ends[1].cov, Q + 1e-6 * wanted, 1e-3, np.maximum(least, 1e-300))


def smooths_as_joint_conditioning(estimator: Estimator[Any], drawn: Scene) -> None:
    """If exact when linear: smoothing equals conditioning the joint Gaussian of a moment and the next."""
    motion = motion_of(estimator)
    if motion is None or not motion.linear or motion.state != estimator.state or len(estimator.zero_variance):
        raise Closed("it holds no linear `motion` over its own axes alone")
    state, dt, rng = estimator.state, drawn.dt, drawn.rng()
    now = started(estimator, drawn, rng)
    ahead = predicted(estimator, now, dt, rng)
    innovation = estimator.evaluate(ahead, drawn.watch, drawn.seen, P_GATE)
    later = estimator.update(ahead, innovation, sure(innovation.loglik, 1))
    with closed_by(NotImplementedError, "it does not smooth"):
        cross = estimator.cross_covariance(now, dt)
        found = estimator.moments(estimator.smooth_step(now, later, dt, rng))
        at_once = estimator.moments(estimator.smooth_step(now, later, 0.0, rng))
    F = motion.jacobian(drawn.prior.mean, dt)
    P, Q = drawn.prior.cov, motion.noise(drawn.prior.mean, dt)
    wide = F @ P @ np.swapaxes(F, -1, -2) + Q
    wanted = P @ np.swapaxes(F, -1, -2)
    same("cross_covariance", cross, wanted, 1e-6, deviations(P)[..., :, None] * deviations(wide)[..., None, :])
    gain = np.swapaxes(np.linalg.solve(wide, np.swapaxes(wanted, -1, -2)), -1, -2)
    moved, end = estimator.moments(ahead), estimator.moments(later)
    shift = (gain @ state.difference(end.mean, moved.mean)[..., None])[..., 0]
    cov = P + gain @ (end.cov - wide) @ np.swapaxes(gain, -1, -2)
    alike(estimator, found, Gaussian(state.displace(drawn.prior.mean, shift), cov), 1e-5, "smoothed ")
    alike(estimator, at_once, end, 1e-9, "smoothed over no time: ")


LAWS = (
    Law(an_unlike_sensor_is_linearised),
    Law(predicts_as_its_motion_linearised, needs="not traits.draws"),
    Law(smooths_as_joint_conditioning, needs="traits.exact_when_linear"),
)
