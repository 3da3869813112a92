"""Higher order tracking accuracy: detection and association in one figure, over thresholds of similarity."""

from __future__ import annotations

from collections.abc import Sequence
from itertools import pairwise

import numpy as np
from attrs import frozen

from vedette.metrics import Near, one_to_one
from vedette.space import Array, Indices, Mask
from vedette_standard.whole_tracks.near_in_scans import near_in_scans

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


def hota(apart: Sequence[Array | Near], present: Sequence[Indices], alive: Mask, tracks: int, cutoff: float) -> Hota:
    """Return HOTA with the similarity max(0, 1 - d / c) of points.

    At each scan objects and tracks are matched one to one at the greatest sum of similarity times alignment, the Jaccard
    index of object and track over the whole run, as the authors' evaluation code does. At a threshold a matched pair counts
    if it is at least that similar. detection = TP / (TP + FN + FP); association = mean over the TP of
    TPA / (TPA + FNA + FPA), with TPA the TP of the same pair; localisation = mean similarity of the TP.
    `apart`: per scan the distances (j, t) in m, infinite for an object that is not there, or those of near pairs; `present`:
    which of the `tracks` its columns are; `alive` (s, j).
    Luiten, Osep, Dendorfer, Torr, Geiger, Leal-Taixe, Leibe, HOTA: A Higher Order Metric for Evaluating Multi-Object
    Tracking, Int. J. Computer Vision 129, 2021.
    """
    if not cutoff > 0:
        raise ValueError(f"cutoff: must be > 0 m, got {cutoff:g}")
    objects = np.count_nonzero(alive, axis=0)
    entries = np.bincount(np.concatenate([*present, np.zeros(0, dtype=np.intp)]).astype(np.intp), minlength=tracks)
    scan, truth, track, distance = near_in_scans(apart, present, cutoff)
    like = np.maximum(1.0 - distance / cutoff, 0.0)
    pair, where = np.unique(truth * tracks + track, return_inverse=True)
    shared = np.bincount(where.reshape(-1), _jaccard(scan, truth, track, like), len(pair))
    alignment = shared / np.maximum(objects[pair // max(tracks, 1)] + entries[pair % max(tracks, 1)] - shared, _ROUNDING)
    worth = alignment[where.reshape(-1)] * like
    edges = np.searchsorted(scan, np.arange(len(apart) + 1))
    best = [i + one_to_one(truth[i:k], track[i:k], -worth[i:k], 0.0) for i, k in pairwise(edges.tolist())]
    matched = np.concatenate([np.zeros(0, dtype=np.intp), *best])
    return _over_thresholds(truth[matched], track[matched], like[matched], objects, entries)


def _jaccard(scan: Indices, truth: Indices, track: Indices, like: Array) -> Array:
    """Return the similarity (q,) of each pair over all those of either at its scan: (q,) -> (q,)."""
    sums = []
    for side in (truth, track):
        member = np.unique(scan * (1 + np.max(side, initial=0)) + side, return_inverse=True)[1].reshape(-1)
        sums.append(np.bincount(member, like, 1)[member])
    either: Array = sums[0] + sums[1] - like
    return np.divide(like, either, out=np.zeros_like(like), where=either > 0)


def _over_thresholds(truth: Indices, track: Indices, similar: Array, objects: Indices, entries: Indices) -> Hota:
    """Return the means over the thresholds, of matched pairs (q,) and how often each object and track is there."""
    rows = []
    for threshold in THRESHOLDS:
        kept = similar >= threshold - _ROUNDING
        positives = int(np.count_nonzero(kept))
        total = int(np.sum(objects) + np.sum(entries)) - positives
        detection = positives / total if total else 1.0
        key, again, count = np.unique(truth[kept] * len(entries) + track[kept], return_inverse=True, return_counts=True)
        either = objects[key // max(len(entries), 1)] + entries[key % max(len(entries), 1)] - count
        association = float(np.mean((count / either)[again.reshape(-1)])) if positives else float(not total)
        rows.append([np.sqrt(detection * association), detection, association, np.mean(similar[kept]) if positives else 1.0])
    return Hota(*np.mean(rows, axis=0).tolist())
