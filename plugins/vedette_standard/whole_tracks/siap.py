"""The attributes of a single integrated air picture: completeness, ambiguity, spuriousness, accuracy, continuity."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from attrs import frozen

from vedette.metrics import NONE, Near, near
from vedette.space import Array, Indices, Mask


@frozen
class Siap:
    """See docs/metrics.md; None where a ratio has nothing below.

    `position` in m, `velocity` in m/s, `changes` in 1/s, the others of unit 1.
    """

    completeness: float | None
    ambiguity: float | None
    spuriousness: float | None
    position: float | None
    velocity: float | None
    changes: float | None
    longest: float | None


def assigned(apart: Array | Near, radius: float) -> Indices:
    """Return the nearest object of each track within `radius` in m, NONE where there is none: (j, t) -> (t,).

    Several tracks may have the same object: that is what `ambiguity` counts.
    """
    pairs = near(apart, radius)
    order = np.lexsort((pairs.truth, pairs.distance, pairs.track))[::-1]  # of each track the nearest is written last
    owner = np.full(apart.shape[1], NONE)
    owner[pairs.track[order]] = pairs.truth[order]
    return owner


def siap(
    owners: Sequence[Indices],
    present: Sequence[Indices],
    alive: Mask,
    times: Array,
    position: Array,
    velocity: Array | None = None,
) -> Siap:
    """Return the attributes over all scans, at `times` (s,) in s.

    `owners`: per scan the object that each track is `assigned` to, (t,); `present`: which tracks these are; `alive` (s, j);
    `position` (q,) in m and `velocity` (q,) in m/s: the errors of all assigned tracks of all scans.
    Votruba, Nisley, Rothrock, Zombro, Single Integrated Air Picture (SIAP) Metrics Implementation, 2001.
    """
    held = [[set[int]() for _ in range(alive.shape[1])] for _ in owners]
    for sets, owner, tracks in zip(held, owners, present, strict=True):
        for j, track in zip(owner.tolist(), tracks.tolist(), strict=True):
            if j != NONE:
                sets[j].add(track)
    objects, followed = int(np.count_nonzero(alive)), sum(bool(one) for sets in held for one in sets)
    pairs, entries = len(position), sum(map(len, owners))
    fates = [_fate([sets[j] for sets in held], times) for j in range(alive.shape[1])]
    return Siap(
        completeness=_ratio(followed, objects),
        ambiguity=_ratio(pairs, followed),
        spuriousness=_ratio(entries - pairs, entries),
        position=_ratio(float(np.sum(position)), pairs),
        velocity=None if velocity is None else _ratio(float(np.sum(velocity)), pairs),
        changes=_ratio(sum(max(needed - 1, 0) for needed, _, _ in fates), sum(total for _, total, _ in fates)),
        longest=_ratio(sum(longest for _, _, longest in fates), sum(_span(row, times) for row in alive.T)),
    )


def _fate(held: Sequence[set[int]], times: Array) -> tuple[int, float, float]:
    """Return, of an object with these tracks at each scan: the fewest tracks in turn, time with any, longest with one.

    It has a track between two scans if one track has it at both.
    """
    needed, total, longest, candidates = 0, 0.0, 0.0, set[int]()
    since: dict[int, float] = {}
    before, last = set[int](), 0.0
    for now, time in zip(held, times.tolist(), strict=True):
        if now:
            candidates &= now
            if not candidates:
                needed, candidates = needed + 1, set(now)
            since = {track: since.get(track, time) for track in now}
            longest = max(longest, *(time - begin for begin in since.values()))
            total += time - last if before & now else 0.0
        else:
            since = {}
        before, last = now, time
    return needed, total, longest


def _span(there: Mask, times: Array) -> float:
    """Return the time from the first to the last scan at which an object is there."""
    at = times[there]
    return float(at[-1] - at[0]) if len(at) else 0.0


def _ratio(above: float, below: float) -> float | None:
    return float(above / below) if below else None
