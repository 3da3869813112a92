"""Which rows, and which returns, are so near to each other that they are worth a look."""

from __future__ import annotations

import numpy as np

from vedette import Array, Detections, Indices, Space, kernels
from vedette.hypotheses import firsts


def within(h: Array, reach: Array, space: Space, group: Indices | None, known: Indices | None) -> tuple[Indices, Indices]:
    """Return the pairs (p,), (p,) of rows that differ on each axis by no more than their `reach` (t, m) allows, added up.

    group (t,), from 0 without gaps: pairs within one are left out, but for the `known` pairs (p, 2).
    """
    if group is None:
        i, j = _overlapping(h, reach, space)
    else:
        order, size = np.argsort(group, kind="stable"), np.bincount(group)
        starts = np.cumsum(size) - size
        middle = h[order[starts]]
        d = space.difference(h, middle[group])
        low, high = (of.reduceat(edge[order], starts) for of, edge in ((np.minimum, d - reach), (np.maximum, d + reach)))
        a, b = _overlapping(space.displace(middle, 0.5 * (low + high)), 0.5 * (high - low), space)
        number = size[a] * size[b]
        of = np.repeat(np.arange(len(a)), number)
        place = kernels.counted(number)
        one, other = np.divmod(place, size[b][of])
        pairs = np.stack([order[starts[a][of] + one], order[starts[b][of] + other]], axis=-1)
        i, j = np.sort(pairs if known is None else np.concatenate([pairs, known]), axis=-1).T
    near = np.all(space.difference(h[i], h[j]) ** 2 <= reach[i] ** 2 + reach[j] ** 2, axis=-1)
    code = np.sort(i[near] * len(h) + j[near])
    return np.divmod(code, len(h))


def _overlapping(middle: Array, half: Array, space: Space) -> tuple[Indices, Indices]:
    """Return the pairs (p,), (p,), i < j, of boxes of half a width (t, m) about points (t, m) that overlap."""
    t, common = len(middle), 4.0 * np.median(half, axis=0)
    wide = np.any(half > common, axis=1)
    # Those that are wide find all others, which need then not be as wide as to find them.
    reach = half + np.where(wide[:, None], np.max(half, axis=0), common)
    first, second = kernels.pairs_in_boxes(middle - reach, middle + reach, middle, space.periods, t * t)
    code = np.sort(np.minimum(first, second) * t + np.maximum(first, second))
    i, j = np.divmod(code[firsts(code)], t)
    near = (i < j) & np.all(np.abs(space.difference(middle[i], middle[j])) <= half[i] + half[j], axis=-1)
    return i[near], j[near]


def around(middle: Array, cov: Array, observed: Detections, threshold: float, space: Space) -> tuple[Indices, Indices]:
    """Return the pairs (q,), (q,) of a middle (p, m) and a return about it, twice as far as the gate goes."""
    p, k = len(middle), len(observed.z)
    if not np.isfinite(threshold):
        pair, returns = np.divmod(np.arange(p * k), k)
    else:
        half = 2.0 * np.sqrt(threshold * np.einsum("...ii->...i", cov))
        pair, returns = kernels.pairs_in_boxes(middle - half, middle + half, observed.z, space.periods, p * k)
    counts = np.broadcast_to(observed.valid, k)[returns]
    return pair[counts], returns[counts]
