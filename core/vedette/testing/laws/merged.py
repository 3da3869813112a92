"""The law of returns that may be of two targets: the events of two targets and one return, in closed form."""

from __future__ import annotations

from functools import cache

import numpy as np
from attrs import evolve

from vedette.config import build
from vedette.hypotheses import HypothesisAssociator
from vedette.roles import Associator
from vedette.space import Array
from vedette.testing.comparisons import same
from vedette.testing.law import Law
from vedette.testing.laws.associator_cases import Scores
from vedette.testing.laws.hypotheses import ROOM
from vedette.tracking.tracker import Tracker
from vedette.types import Detections, Gaussian, Scan

P_D, CLUTTER, VARIANCE = 0.8, 1e-3, 16.0
PRIOR = np.array([30.0, 12.0])
"""The variances of the position of two targets."""


def one_return_may_be_of_two(associator: Associator, drawn: Scores) -> None:
    """If it takes merged returns: two targets that are never resolved move towards a return as all events say.

    None is detected and the return is false, each alone is, or both: then the return is of the middle between them.
    """
    room = {name: value for name, value in ROOM.items() if hasattr(associator, name)}
    part: Associator = evolve(associator, **room)  # type: ignore[misc]
    tracker = evolve(_never_resolved(), associator=part)
    x, z = np.array([[0.0, 0.0], [6.0, 2.0]]), np.random.default_rng(drawn.scores.size).uniform(-2.0, 8.0, 2)
    cov = np.zeros((2, 4, 4))
    cov[:, range(4), range(4)] = np.stack([PRIOR, PRIOR, np.ones(2), np.ones(2)], axis=-1)
    state = tracker.start(Gaussian(np.concatenate([x, np.zeros((2, 2))], axis=-1), cov), 0.0)
    after = tracker.step(state, Scan(0.0, "radar", Detections.of([z], 2)))
    mean = tracker.estimate(after).mean[:, :2]
    if isinstance(part, HypothesisAssociator):
        share = part.probability(after.leaves.hypotheses)[:, None]
        mean = np.zeros((2, 2))
        np.add.at(mean, after.leaves.ids, share * tracker.estimator.moments(after.leaves.belief).mean[:, :2])
    middle, spread = x.mean(axis=0), 0.25 * np.sum(PRIOR) + VARIANCE
    alone = P_D * (1.0 - P_D) * _normal(z - x, PRIOR + VARIANCE)
    both = P_D**2 * _normal(z - middle, spread)
    total = (1.0 - P_D) ** 2 * CLUTTER + np.sum(alone) + both
    own, shared = (alone / total * PRIOR / (PRIOR + VARIANCE))[:, None], (both / total * 0.5 * PRIOR / spread)[:, None]
    same("mean position", mean, x + own * (z - x) + shared * (z - middle), 2e-3, 1.0)


def _normal(d: Array, variance: Array) -> Array:
    """Return the density at d (*b, 2) of a Gaussian in the plane with this variance along each axis."""
    density: Array = np.exp(-0.5 * np.sum(d * d, axis=-1) / variance) / (2.0 * np.pi * variance)
    return density


@cache
def _never_resolved() -> Tracker:
    """Return the tracker of given targets that is tried with an associator in another's place."""
    sensor = {"kind": "cartesian_position", "sigma": VARIANCE**0.5, "detection_probability": P_D, "clutter_density": CLUTTER}
    return build({
        "estimator": {"kind": "kalman", "motion": {"kind": "constant_velocity", "sigma_accel": 0.5}},
        "sensors": {"radar": {"kind": "coarse", "cells": {"x": 1e6, "y": 1e6}, "of": sensor}},
        "associator": {"kind": "jpda"},
        "gate": "off",
        "lifecycle": {"kind": "single_target"},
    })  # fmt: skip


OF_ASSOCIATORS = (Law(one_return_may_be_of_two, needs="takes_merged"),)
