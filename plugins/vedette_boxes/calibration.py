"""What a detector's score says of whether there is a target."""

from __future__ import annotations

from typing import final

import numpy as np
from attrs import frozen

from vedette import Array, Indices, Mask, fields
from vedette_boxes.rows import BoxRows, overlap

INNERMOST = 1e-6
"""Scores are taken as at least this far from 0 and 1."""
STEPS = 50


@final
@frozen
class Calibration:
    """The log-likelihood ratio of target to clutter that a score s has, slope * logit(s) + offset.

    It is fitted by logistic regression on boxes that are known to be of targets or not: the probability of a target is
    1 / (1 + exp(-slope logit(s) - c)), and offset = c - log(targets / others), which takes out how many there were.
    Platt, Probabilistic Outputs for Support Vector Machines, Advances in Large Margin Classifiers, 1999.
    """

    slope: float = fields.quantity("1", "how much a score's logit says; 0: nothing", default=0.0)
    offset: float = fields.quantity("1", "what a score of one half says", default=0.0)

    def evidence(self, score: Array) -> Array:
        """Return the log-likelihood ratio (k,) of scores (k,) from 0 to 1."""
        return self.slope * logit(score) + self.offset


def logit(score: Array) -> Array:
    """Return log(s / (1 - s)) of scores (k,)."""
    within = np.clip(score, INNERMOST, 1.0 - INNERMOST)
    return np.log(within / (1.0 - within))


def fitted(score: Array, target: Mask) -> Calibration:
    """Return the calibration of scores (k,) of targets and others; ValueError if there are not ten of each."""
    targets, others = np.count_nonzero(target), np.count_nonzero(~target)
    if min(targets, others) < 10:
        raise ValueError(f"must hold 10 boxes of targets and 10 others at least, got {targets} and {others}")
    X = np.stack([logit(score), np.ones(len(score))], axis=-1)
    w = np.zeros(2)
    for _ in range(STEPS):
        p = 1.0 / (1.0 + np.exp(-X @ w))
        slope = X.T @ (target - p) - 1e-6 * w  # a trace of a prior, so that scores that part all of them have a maximum
        step = np.linalg.solve((X * (p * (1.0 - p))[:, None]).T @ X + 1e-6 * np.eye(2), slope)
        w = w + step * min(1.0, 5.0 / max(float(np.max(np.abs(step))), 1e-300))
    return Calibration(slope=float(w[0]), offset=float(w[1] - np.log(targets / others)))


def of_targets(found: BoxRows, truth: BoxRows, least: float = 0.5) -> Indices:
    """Return the row of the true box that each detection (n,) overlaps by `least`, -1 for none; each is found once, the best
    overlaps first.
    """
    target = np.full(len(found.frame), -1)
    for number in np.unique(found.frame):
        rows, there = np.flatnonzero(found.frame == number), np.flatnonzero(truth.frame == number)
        alike = overlap(found.box[rows], truth.box[there])
        while alike.size and alike.max() >= least:
            i, j = np.unravel_index(int(np.argmax(alike)), alike.shape)
            target[rows[i]] = there[j]
            alike[i], alike[:, j] = -1.0, -1.0
    return target


def confused(named: Indices, real: Indices, classes: int) -> Array:
    """Return the matrix of confusion (c, c) of detections (k,) named from 1 to `classes`, whose objects are `real` (k,).

    One more of each pair is counted than there was, so that nothing seen is impossible.
    """
    known = (named >= 1) & (named <= classes) & (real >= 1) & (real <= classes)
    counts = np.ones((classes, classes))
    np.add.at(counts, (real[known] - 1, named[known] - 1), 1.0)
    return counts / np.sum(counts, axis=1, keepdims=True)
