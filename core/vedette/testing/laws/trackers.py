"""Laws tried by a whole tracker with one part in another's place.

What is far away changes nothing: scenes 100 km apart give each the tracks that it has alone. And where returns may be of two
targets: the events of two targets and one return, in closed form.
"""

from __future__ import annotations

from functools import cache
from typing import Any

import numpy as np
from attrs import evolve, frozen

from vedette.config import build
from vedette.hypotheses import HypothesisAssociator
from vedette.roles import Associator
from vedette.space import Array, Indices, Mask
from vedette.supporting import Birth, Lifecycle
from vedette.testing.comparisons import closed_by, closed_if, demand, same
from vedette.testing.law import Law
from vedette.testing.laws.associator_cases import Scores
from vedette.testing.laws.birth_cases import Returns
from vedette.testing.laws.hypotheses import with_room
from vedette.testing.laws.lifecycle_cases import Lives
from vedette.tracking.tracker import Tracker
from vedette.types import Detections, Gaussian, Scan

SCANS = 3
PLACES = np.array([[0.0, 0.0], [1e5, -1e5]])
"""Where the scenes are, in m."""

CLUTTER, VARIANCE = 1e-3, 16.0
PRIOR, APART = np.array([30.0, 12.0]), np.array([24.0, 8.0])
"""The variances of the positions of two targets, and from the first to the second in m."""


@frozen(eq=False)
class Shown:
    """What a tracker shows after a scan: the means (t, n) and covariances of tracks, their existence and confirmation."""

    mean: Array
    cov: Array
    judged: Array

    def part(self, rows: Indices | Mask) -> Shown:
        """Return that of some tracks."""
        return Shown(self.mean[rows], self.cov[rows], self.judged[rows])


def far_scenes_change_no_association(associator: Associator, drawn: Scores) -> None:
    """Scenes that are far apart give each the tracks that it has alone, with the same ids but for their numbering."""
    seed = int(drawn.tracks @ drawn.tracks) + 31 * drawn.scores.shape[-1] + int(drawn.scores.size)
    for cell in (0.0, 20.0) if associator.takes_merged and seed % 3 == 0 else (0.0,):
        _judge({"associator": associator}, seed, cell)


def far_scenes_change_no_birth(birth: Birth, drawn: Returns) -> None:
    """Scenes that are far apart give each the tracks that it has alone, with the same ids but for their numbering.

    Where existence depends on the scan, and not on unseen targets that it models, tracks may share it: each has at most
    what it has alone.
    """
    shares = birth.initial_existence is None and not birth.models_unseen
    _judge({"birth": birth}, len(drawn.claimed) + int(1e3 * np.sum(drawn.claimed)), shares=shares)


def far_scenes_change_no_life(lifecycle: Lifecycle, drawn: Lives) -> None:
    """Scenes that are far apart give each the tracks that it has alone, with the same ids but for their numbering."""
    _judge({"lifecycle": lifecycle}, int(1e3 * np.sum(drawn.existence)))


@cache
def _usual(cell: float) -> Tracker:
    """Return the tracker that is tried with one part in another's place; targets within a `cell` may give one return."""
    sensor = {"kind": "cartesian_position", "sigma": 5.0, "detection_probability": 0.9, "clutter_density": 1e-5}
    return build({
        "estimator": {"kind": "kalman", "motion": {"kind": "constant_velocity", "sigma_accel": 0.5}},
        "sensors": {"radar": {"kind": "coarse", "of": sensor, "cells": {"x": cell, "y": cell}} if cell else sensor},
        "associator": {"kind": "jpda"},
        "birth": {"kind": "from_returns", "spread": {"vx": 10.0, "vy": 10.0}},
        "lifecycle": {"kind": "existence", "confirm": 0.8},
    })  # fmt: skip


def _judge(part: dict[str, Any], seed: int, cell: float = 0.0, *, shares: bool = False) -> None:
    """Compare the tracks of each scene alone with those of all together, after the first scan if they share existence."""
    with closed_by(ValueError, "it takes another tracker: {}"):
        tracker = evolve(_usual(cell), **part)
        given = len(tracker.start().ids)
    closed_if(given, "it has tracks before the first scan")
    rng = np.random.default_rng(seed)
    scenes = [_scene(rng, place)[: 1 if shares else SCANS] for place in PLACES]  # what exists less has other returns later
    together = _run(tracker, [np.concatenate(scans) for scans in zip(*scenes, strict=True)])
    for number, (place, scans) in enumerate(zip(PLACES, scenes, strict=True)):
        for time, (alone, whole) in enumerate(zip(_run(tracker, scans), together, strict=True)):
            own = whole.part(np.all(np.abs(whole.mean[:, :2] - place) < 2e4, axis=-1))
            told = f"of scene {number + 1} after scan {time + 1}, which is far from the others,"
            if shares and len(alone.mean):
                alone = alone.part(np.argmin(np.linalg.norm(own.mean[:, None] - alone.mean, axis=-1), axis=-1))
                demand(np.all(own.judged <= alone.judged + 1e-7), f"existence {told} must be at most what it has alone")
            otherwise = f"tracks {told} must be {len(alone.mean)}, as it has alone, are {len(own.mean)}"
            demand(len(own.mean) == len(alone.mean), otherwise)
            for name in ("mean", "cov", "judged")[: 2 if shares else 3]:
                same(f"{name} {told}", getattr(own, name), getattr(alone, name), 1e-7, 1.0)


def _scene(rng: np.random.Generator, place: Array) -> list[Array]:
    """Return the returns (k, 2) of each scan of some targets that are close together, and of clutter beside them."""
    targets, speed = rng.normal(0, 15.0, (int(rng.integers(1, 4)), 2)), rng.normal(0, 5.0, 2)
    scans = []
    for time in range(SCANS):
        seen = (targets + speed * time)[rng.random(len(targets)) < 0.9]
        false = rng.uniform(-60.0, 60.0, (int(rng.integers(0, 3)), 2))
        scans.append(place + np.concatenate([seen + rng.normal(0, 5.0, seen.shape), false]))
    return scans


def _run(tracker: Tracker, scans: list[Array]) -> list[Shown]:
    """Return what is shown after each scan."""
    state, shown = tracker.start(), []
    order = tracker.state.locate(tracker.sensors["radar"].observes)
    for time, z in enumerate(scans):
        state = tracker.step(state, Scan(float(time), "radar", Detections.of(z, 2)))
        estimate = tracker.estimate(state)
        others = [axis for axis in range(estimate.mean.shape[-1]) if axis not in order]
        mean = estimate.mean[:, [*order, *others]]
        shown.append(Shown(mean, estimate.cov, np.stack([state.existence, state.confirmed.astype(float)], axis=-1)))
    return shown


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


OF_ASSOCIATORS = (
    Law(far_scenes_change_no_association, share=3),
    Law(one_return_may_be_of_two, needs="takes_merged", share=3),
)
OF_BIRTHS = (Law(far_scenes_change_no_birth, needs="not draws"),)
OF_LIFECYCLES = (Law(far_scenes_change_no_life, needs="not permanent"),)
