"""The law that what is far away changes nothing: scenes 100 km apart give each the tracks that it has alone."""

from __future__ import annotations

from functools import cache
from typing import Any

import numpy as np
from attrs import evolve, frozen

from vedette.config import build
from vedette.roles import Associator
from vedette.space import Array, Indices, Mask
from vedette.supporting import Birth, Lifecycle
from vedette.testing.comparisons import closed_by, closed_if, demand, same
from vedette.testing.law import Law
from vedette.testing.laws.associator_cases import Scores
from vedette.testing.laws.birth_cases import Returns
from vedette.testing.laws.lifecycle_cases import Lives
from vedette.tracking.tracker import Tracker
from vedette.types import Detections, Scan

SCANS = 3
PLACES = np.array([[0.0, 0.0], [1e5, -1e5]])
"""Where the scenes are, in m."""


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


OF_ASSOCIATORS = (Law(far_scenes_change_no_association, share=3),)
OF_BIRTHS = (Law(far_scenes_change_no_birth, needs="not draws"),)
OF_LIFECYCLES = (Law(far_scenes_change_no_life, needs="not permanent"),)
