"""Laws of estimators by linear sensors: in closed form where they are exact, and of returns that lack a component."""

from __future__ import annotations

from typing import Any

import numpy as np

from vedette.filters import predicted
from vedette.roles import Estimator
from vedette.space import Space
from vedette.testing.comparisons import closed_if, frozen_copy, same
from vedette.testing.law import Law
from vedette.testing.laws import estimator_cases as cases
from vedette.testing.laws.estimator_cases import P_GATE, Scene, alike
from vedette.testing.sensors import Watch
from vedette.testing.states import sizes
from vedette.testing.truth import motion_of
from vedette.types import Detections, Gaussian

SCALE = 1000.0
"""What is measured, per usual size of an axis: a deviation is some 20, so that a 1 in the place of what lacks shows."""


def equals_joint_conditioning(estimator: Estimator[Any], drawn: Scene) -> None:
    """If exact when linear: two predictions and scans equal conditioning the joint Gaussian of states and returns.

    So do distances and volumes.
    """
    motion = motion_of(estimator) or cases.linear_motion(estimator)  # which says that there is none
    pace = float(motion.linear)  # one that moves by curves is tried without time
    belief, state = cases.started(estimator, drawn, drawn.rng()), estimator.state
    own = motion.state.locate(state)
    scans = ((pace * drawn.dt, drawn.watch, drawn.seen), (pace * drawn.later, drawn.other, drawn.others))
    seen = []
    for dt, watch, detections in scans:
        belief = predicted(estimator, belief, dt, drawn.rng())
        innovation = estimator.evaluate(belief, watch, detections, P_GATE)
        seen.append(innovation)
        belief = estimator.update(belief, innovation, cases.sure(innovation.loglik, 1))
    found = estimator.moments(belief)
    for b, t in np.ndindex(2, 2):
        mean, cov = drawn.prior.mean[b, t], drawn.prior.cov[b, t]
        n, zs, mean_z, cross, square = len(mean), np.zeros(0), np.zeros(0), np.zeros((len(mean), 0)), np.zeros((0, 0))
        before = half = 0.0
        for (dt, watch, detections), innovation in zip(scans, seen, strict=True):
            F = motion.jacobian(mean[own], dt)[np.ix_(own, own)] if own != list(range(n)) else motion.jacobian(mean, dt)
            Q = motion.noise(mean, dt)
            mean, cov, cross = F @ mean, F @ cov @ F.T + Q, F @ cross
            H = np.zeros((len(watch.R), n))
            H[:, state.locate(watch.observes)] = watch.H
            corner = H @ cross
            square = np.block([[square, corner.T], [corner, H @ cov @ H.T + watch.R]])
            cross = np.concatenate([cross, cov @ H.T], axis=1)
            zs, mean_z = np.concatenate([zs, detections.z[b, 0]]), np.concatenate([mean_z, H @ mean])
            off, whole = zs - mean_z, 0.5 * float(np.linalg.slogdet(square)[1])
            squares, volume = float(off @ np.linalg.solve(square, off)), np.asarray(whole - half)
            distance, size = np.asarray(squares - before), 1.0 + abs(whole) + squares
            log = np.log(watch.probability) - distance / 2 - volume - 0.5 * len(watch.R) * np.log(2 * np.pi)
            for name, i, goal in (("loglik", 1, log), ("distance", 0, distance), ("nis", 0, distance)):
                same(name, getattr(innovation, name)[b, t, i], goal, 1e-7, size)
            same("log_volume", innovation.log_volume[b, t], volume, 1e-7, size)
            before, half = squares, whole
        gain = np.linalg.solve(square, cross.T).T
        wanted = Gaussian(mean + gain @ (zs - mean_z), cov - gain @ cross.T)
        alike(estimator, Gaussian(found.mean[b, t], found.cov[b, t]), wanted, 1e-6)


def missing_components_say_nothing(estimator: Estimator[Any], drawn: Scene) -> None:
    """A return that lacks a component counts as one of a sensor that has none, however little is known of the state."""
    rng, free = drawn.rng(), cases.free_axes(estimator)
    plain = Space(tuple(axis for axis in free.axes if axis.period is None))
    mix = SCALE * rng.uniform(0.4, 1.2, (3, len(plain))) * rng.choice([-1.0, 1.0], (3, len(plain))) / sizes(plain)
    root = 10.0 * (np.eye(3) + 0.3 * rng.standard_normal((3, 3)))
    R, kept = root @ root.T, np.delete(np.arange(3), int(rng.integers(3)))
    whole = Watch(plain, R, 0.8, mix=mix)
    part = Watch(plain, R[np.ix_(kept, kept)], 0.8, mix=mix[kept])
    closed_if(not len(plain), "all of its axes wrap")
    for sensor in (whole, part):
        cases.not_refused(estimator, sensor)
    start = estimator.start(drawn.prior, estimator.state, drawn.rng())
    x = drawn.prior.mean[..., estimator.state.locate(plain)]
    z = whole.measure(x) + 30.0 * rng.standard_normal((*x.shape[:-1], 3))
    lacks = np.broadcast_to(~np.isin(np.arange(3), kept), z.shape)
    own = frozen_copy(R * rng.uniform(0.3, 3.0, (*z.shape[:-1], 1, 1)))
    valid = np.ones(z.shape[:-1], dtype=bool)
    for what, noise in (("", None), (", own noise", own)):
        some = None if noise is None else noise[..., kept, :][..., kept]
        scans = (
            Detections(frozen_copy(z), valid, None, noise, lacks),
            Detections(frozen_copy(z[..., kept]), valid, None, some),
        )
        found, wanted = (estimator.evaluate(start, of, scan, P_GATE) for of, scan in zip((whole, part), scans, strict=True))
        reach = 1.0 + np.abs(wanted.distance)
        for name in ("distance", "nis"):
            same(f"{name}{what}", getattr(found, name) / reach, getattr(wanted, name) / reach, 1e-3, 1.0)
        same(f"loglik{what}", found.loglik[..., 1:] / reach, wanted.loglik[..., 1:] / reach, 1e-3, 1.0)
        if estimator.traits.draws:  # its update may draw, from whichever of the two is updated first
            continue
        weights = frozen_copy(cases.soft(wanted.loglik, drawn.seed))
        after = estimator.moments(estimator.update(start, wanted, weights))
        alike(estimator, estimator.update(start, found, weights), after, 1e-3, f"updated{what}: ")


LAWS = (
    Law(equals_joint_conditioning, needs="traits.exact_when_linear"),
    Law(missing_components_say_nothing),
)
