"""Higher order tracking accuracy: detection and association in one figure, over thresholds of similarity."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from attrs import frozen

from vedette.metrics.coverage import Indices
from vedette.space import Array, Mask

THRESHOLDS = np.arange(1, 20) / 20
"""Similarities above which a pair may match, .05 to .95; the figures are means over them."""
_ROUNDING = 1e-12


@frozen
class Hota:
    """`value` is the mean over the thresholds of sqrt(detection * association); all of unit 1, at best 1."""

    value: float
    detection: float
    association: float
    localisation: float


def hota(apart: Sequence[Array], present: Sequence[Indices], alive: Mask, tracks: int, cutoff: float) -> Hota:
    """Return HOTA with the similarity max(0, 1 - d / c) of points.

    At each scan objects and tracks are matched one to one at the greatest sum of similarity times alignment, the Jaccard
    index of object and track over the whole run, as the authors' evaluation code does. At a threshold a matched pair counts
    if it is at least that similar. detection = TP / (TP + FN + FP); association = mean over the TP of
    TPA / (TPA + FNA + FPA), with TPA the TP of the same pair; localisation = mean similarity of the TP.
    `apart`: per scan the distances (j, t) in m, infinite for an object that is not there; `present`: which of the `tracks`
    its columns are; `alive` (s, j).
    Luiten, Osep, Dendorfer, Torr, Geiger, Leal-Taixe, Leibe, HOTA: A Higher Order Metric for Evaluating Multi-Object
    Tracking, Int. J. Computer Vision 129, 2021.
    """
    from scipy.optimize import linear_sum_assignment

    if not cutoff > 0:
        raise ValueError(f"cutoff: must be > 0 m, got {cutoff:g}")
    objects = np.count_nonzero(alive, axis=0)
    entries = np.bincount(np.concatenate([*present, np.zeros(0, dtype=np.intp)]).astype(np.intp), minlength=tracks)
    alignment = np.zeros((alive.shape[1], tracks))
    for each, columns in zip((np.maximum(1.0 - far / cutoff, 0.0) for far in apart), present, strict=True):
        rows = np.flatnonzero(each.any(axis=1))
        own = each[rows]
        either = np.sum(own, axis=1)[:, None] + np.sum(each, axis=0) - own
        alignment[np.ix_(rows, columns)] += np.divide(own, either, out=np.zeros_like(own), where=either > 0)
    alignment /= np.maximum(objects[:, None] + entries - alignment, _ROUNDING)
    found = []
    for each, columns in zip((np.maximum(1.0 - far / cutoff, 0.0) for far in apart), present, strict=True):
        rows, picked = linear_sum_assignment(alignment[:, columns] * each, maximize=True)
        near = each[rows, picked] > 0
        found.append(np.stack([rows[near], columns[picked[near]], each[rows[near], picked[near]]]))
    truth, track, similar = np.concatenate([*found, np.zeros((3, 0))], axis=1)
    return _over_thresholds(truth.astype(np.intp), track.astype(np.intp), similar, objects, entries)


def _over_thresholds(truth: Indices, track: Indices, similar: Array, objects: Indices, entries: Indices) -> Hota:
    """Return the means over the thresholds, of matched pairs (q,) and how often each object and track is there."""
    rows = []
    for threshold in THRESHOLDS:
        kept = similar >= threshold - _ROUNDING
        positives = int(np.count_nonzero(kept))
        total = int(np.sum(objects) + np.sum(entries)) - positives
        detection = positives / total if total else 1.0
        key, again, count = np.unique(truth[kept] * len(entries) + track[kept], return_inverse=True, return_counts=True)
        own = objects[key // max(len(entries), 1)] + entries[key % max(len(entries), 1)] - count
        association = float(np.mean((count / own)[again.reshape(-1)])) if positives else float(not total)
        rows.append([np.sqrt(detection * association), detection, association, np.mean(similar[kept]) if positives else 1.0])
    return Hota(*np.mean(rows, axis=0).tolist())
