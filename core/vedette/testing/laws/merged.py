"""The law of returns that may be of two targets: the events of two targets and one return, in closed form."""

from __future__ import annotations

from functools import cache

import numpy as np
from attrs import evolve

from vedette.config import build
from vedette.hypotheses import HypothesisAssociator
from vedette.roles import Associator
from vedette.testing.comparisons import demand, same
from vedette.testing.law import Law
from vedette.testing.laws.associator_cases import Scores
from vedette.testing.laws.hypotheses import with_room
from vedette.tracking.tracker import Tracker
from vedette.types import Detections, Gaussian, Scan

CLUTTER, VARIANCE = 1e-3, 16.0
PRIOR, APART = np.array([30.0, 12.0]), np.array([24.0, 8.0])
"""The variances of the positions of two targets, and from the first to the second in m."""


def one_return_may_be_of_two(associator: Associator, drawn: Scores) -> None:
    """If it takes merged returns: two targets that are seldom or never resolved move towards a return as all events say.

    None is detected and the return is false, each alone is, or both: then the return is of the middle between them, and
    they are as close as the sensor's cell says. Of twelve that are too many for all events it says how many at most.
    """
    rng = np.random.default_rng(drawn.scores.size + int(drawn.tracks @ drawn.tracks))
    sure = rng.random() < 0.3
    p_d, part = 1.0 - 1e-6 if sure else 0.8, with_room(associator)
    tracker = evolve(_seldom_resolved(float(rng.choice([30.0, 1e6])), p_d), associator=part)
    x = np.array([[0.0, 0.0], APART])
    z = APART * rng.uniform(-0.3, 1.3) + (np.array([-15.0, 45.0]) if sure else rng.uniform(-4.0, 4.0, 2))
    cov = np.zeros((2, 4, 4))
    cov[:, range(4), range(4)] = np.stack([PRIOR, PRIOR, np.ones(2), np.ones(2)], axis=-1)
    state = tracker.start(Gaussian(np.concatenate([x, np.zeros((2, 2))], axis=-1), cov), 0.0)
    after = tracker.step(state, Scan(0.0, "radar", Detections.of([z], 2)))
    mean = tracker.estimate(after).mean[:, :2]
    if isinstance(part, HypothesisAssociator):
        share = part.probability(after.leaves.hypotheses)[:, None]
        mean = np.zeros((2, 2))
        np.add.at(mean, after.leaves.ids, share * tracker.estimator.moments(after.leaves.belief).mean[:, :2])
    C = np.diagonal(np.asarray(tracker.sensors["radar"].unresolved(x[:1])))
    # Of an axis, what is seen if both merge: that the second less the first is nearly 0, and the return at their middle.
    seen = np.stack([-APART, z - x.mean(axis=0)], axis=-1)[..., None]
    skew = 0.5 * (PRIOR[1] - PRIOR[0])
    S = np.array([[[PRIOR.sum() + c, skew], [skew, PRIOR.sum() / 4 + VARIANCE]] for c in C])
    white = np.linalg.solve(S, seen)
    log = 0.5 * np.sum(np.log(C / (2 * np.pi) / np.linalg.det(S)) - (np.swapaxes(seen, -1, -2) @ white)[:, 0, 0])
    both = p_d**2 * np.exp(log)
    spread = PRIOR + VARIANCE
    alone = p_d * (1.0 - p_d) * np.exp(-0.5 * np.sum((z - x) ** 2, axis=-1) / spread) / (2 * np.pi * spread)
    total = (1.0 - p_d) ** 2 * CLUTTER + np.sum(alone) + both
    towards = np.stack([-PRIOR, 0.5 * PRIOR], axis=-1) * [[1.0, 1.0], [-1.0, 1.0]]
    own = (alone / total * PRIOR / spread)[:, None]
    crowd = tracker.start(Gaussian(np.zeros((12, 4)), np.broadcast_to(np.eye(4), (12, 4, 4))), 0.0)
    told = tracker.step(crowd, Scan(0.0, "radar", Detections.of([z], 2))).approximated
    demand(0 <= told <= 12, f"approximated: must be a number of the 12 tracks, got {told}")
    same("mean position", mean, x + own * (z - x) + both / total * (towards @ white[..., 0].T), 5e-3, 1.0)


@cache
def _seldom_resolved(cell: float, p_d: float) -> Tracker:
    """Return the tracker of given targets that is tried with an associator in another's place."""
    sensor = {"kind": "cartesian_position", "sigma": VARIANCE**0.5, "detection_probability": p_d, "clutter_density": CLUTTER}
    return build({
        "estimator": {"kind": "kalman", "motion": {"kind": "constant_velocity", "sigma_accel": 0.5}},
        "sensors": {"radar": {"kind": "coarse", "cells": {"x": cell, "y": cell}, "of": sensor}},
        "associator": {"kind": "jpda"},
        "gate": "off",
        "lifecycle": {"kind": "single_target"},
    })  # fmt: skip


OF_ASSOCIATORS = (Law(one_return_may_be_of_two, needs="takes_merged", share=3),)
