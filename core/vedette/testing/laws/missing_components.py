"""The law of estimators for returns that lack a component."""

from __future__ import annotations

from typing import Any

import numpy as np

from vedette.roles import Estimator
from vedette.space import Space
from vedette.testing.comparisons import closed_if, frozen_copy, same
from vedette.testing.law import Law
from vedette.testing.laws.estimator_cases import P_GATE, Scene, alike, free_axes, not_refused, soft
from vedette.testing.linear_sensor import Watch
from vedette.testing.states import sizes
from vedette.types import Detections

SCALE = 1000.0
"""What is measured, per usual size of an axis: a deviation is some 20, so that a 1 in the place of what lacks shows."""


def missing_components_say_nothing(estimator: Estimator[Any], drawn: Scene) -> None:
    """A return that lacks a component counts as one of a sensor that has none, however little is known of the state."""
    rng, free = drawn.rng(), free_axes(estimator)
    plain = Space(tuple(axis for axis in free.axes if axis.period is None))
    mix = SCALE * rng.uniform(0.4, 1.2, (3, len(plain))) * rng.choice([-1.0, 1.0], (3, len(plain))) / sizes(plain)
    root = 10.0 * (np.eye(3) + 0.3 * rng.standard_normal((3, 3)))
    R, kept = root @ root.T, np.delete(np.arange(3), int(rng.integers(3)))
    whole = Watch(plain, R, 0.8, mix=mix)
    part = Watch(plain, R[np.ix_(kept, kept)], 0.8, mix=mix[kept])
    closed_if(not len(plain), "all of its axes wrap")
    for sensor in (whole, part):
        not_refused(estimator, sensor)
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
        weights = frozen_copy(soft(wanted.loglik, drawn.seed))
        after = estimator.moments(estimator.update(start, wanted, weights))
        alike(estimator, estimator.update(start, found, weights), after, 1e-3, f"updated{what}: ")


LAWS = (Law(missing_components_say_nothing, needs="not traits.draws"),)
