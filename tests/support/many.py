"""Random problems of several objects and tracks over several scans, and metrics of them by their definitions."""

from __future__ import annotations

from itertools import permutations, product

import numpy as np
from attrs import frozen
from scipy.optimize import linprog

from vedette import Array, Mask
from vedette.metrics import distances


@frozen(eq=False)
class Problem:
    """Objects (s, j, 2) and tracks (s, t, 2) in m, NaN where they are not there."""

    truth: Array
    tracks: Array

    @property
    def alive(self) -> Mask:
        return ~np.isnan(self.truth[..., 0])

    @property
    def present(self) -> list[Array]:
        return [np.flatnonzero(~np.isnan(row[:, 0])) for row in self.tracks]

    @property
    def apart(self) -> list[Array]:
        return [
            np.where(alive[:, None], distances(np.nan_to_num(objects), rows[columns]), np.inf)
            for objects, alive, rows, columns in zip(self.truth, self.alive, self.tracks, self.present, strict=True)
        ]

    def distance(self, k: int, i: int, j: int) -> float | None:
        """Return how far object i is from track j at scan k; None where one is lacking."""
        found = float(np.linalg.norm(self.truth[k, i] - self.tracks[k, j]))
        return None if np.isnan(found) else found


def problem(seed: int, scans: int = 6, truths: int = 3, tracks: int = 4, spread: float = 1.0) -> Problem:
    """Draw objects 4 m apart, and tracks that begin and end, each near an object at a time and now and then near another."""
    rng = np.random.default_rng(seed)
    truth = 4.0 * rng.standard_normal((truths, 2)) + np.cumsum(rng.standard_normal((scans, truths, 2)), axis=0)
    owner = np.where(rng.random((scans, tracks)) < 0.2, -1, np.arange(tracks) % truths)
    for k in range(1, scans):
        owner[k] = np.where(rng.random(tracks) < 0.75, owner[k - 1], rng.integers(0, truths, tracks))
    found = truth[np.arange(scans)[:, None], owner] + spread * rng.standard_normal((scans, tracks, 2))
    for path, first in ((truth, 0.15), (found, 0.3)):
        path[rng.random(path.shape[:2]) < first] = np.nan
    return Problem(truth, found)


def as_published(given: Problem, cutoff: float, switch: float, order: float) -> float:
    """The program over (n_X + 1) x (n_Y + 1) weights a scan, each change bounded from both sides: as the paper has it."""
    scans, rows, columns = len(given.truth), given.truth.shape[1], given.tracks.shape[1]
    cost = np.zeros((scans, rows + 1, columns + 1))
    for k, i, j in product(range(scans), range(rows + 1), range(columns + 1)):
        here = i < rows and given.alive[k, i], j < columns and not np.isnan(given.tracks[k, j, 0])
        if all(here):
            cost[k, i, j] = min(given.distance(k, i, j), cutoff) ** order
        elif any(here):
            cost[k, i, j] = cutoff**order / 2
    weight = np.arange(cost.size).reshape(cost.shape)
    change = cost.size + np.arange((scans - 1) * rows * columns).reshape(scans - 1, rows, columns)
    every = cost.size + change.size
    equal = np.zeros((scans * (rows + columns + 1), every))
    right = np.ones(len(equal))
    line = iter(range(len(equal)))
    for k in range(scans):
        for i in range(rows):
            equal[next(line), weight[k, i]] = 1
        for j in range(columns):
            equal[next(line), weight[k, :, j]] = 1
        at = next(line)
        equal[at, weight[k, rows, columns]], right[at] = 1, 0
    bounds = np.zeros((2 * change.size, every))
    for at, (k, i, j) in enumerate(np.ndindex(change.shape)):
        for side, sign in enumerate((1, -1)):
            bounds[2 * at + side, [weight[k, i, j], weight[k + 1, i, j], change[k, i, j]]] = sign, -sign, -1
    total = np.concatenate([cost.ravel(), np.full(change.size, switch**order / 2)])
    found = linprog(total, A_ub=bounds, b_ub=np.zeros(len(bounds)), A_eq=equal, b_eq=right, method="highs")
    assert found.status == 0
    return max(found.fun, 0.0) ** (1 / order)


def there(given: Problem, k: int, i: int, j: int) -> tuple[bool, bool]:
    return bool(given.alive[k, i]), not np.isnan(given.tracks[k, j, 0])


def ospa2_by_definition(given: Problem, scans: range, cutoff: float, order: float) -> float:
    """The mean over the scans of either's life, then the best of all permutations."""
    truths = [i for i in range(given.truth.shape[1]) if given.alive[scans.start : scans.stop, i].any()]
    tracks = [j for j in range(given.tracks.shape[1]) if not np.isnan(given.tracks[scans.start : scans.stop, j, 0]).all()]
    if not truths and not tracks:
        return 0.0

    def base(i, j):
        every = []
        for k in scans:
            both = there(given, k, i, j)
            if any(both):
                every.append(min(given.distance(k, i, j), cutoff) if all(both) else cutoff)
        return np.mean(np.array(every) ** order)

    few, many, of = (truths, tracks, base) if len(truths) <= len(tracks) else (tracks, truths, lambda i, j: base(j, i))
    best = min(sum(of(a, b) for a, b in zip(few, picked, strict=True)) for picked in permutations(many, len(few)))
    return ((best + cutoff**order * (len(many) - len(few))) / len(many)) ** (1 / order)


def hota_by_definition(given: Problem, cutoff: float):
    """Its loops over thresholds, with every assignment tried."""
    scans, truths, tracks = len(given.truth), given.truth.shape[1], given.tracks.shape[1]
    like = np.zeros((scans, truths, tracks))
    for k, i, j in product(range(scans), range(truths), range(tracks)):
        if all(there(given, k, i, j)):
            like[k, i, j] = max(0.0, 1 - given.distance(k, i, j) / cutoff)
    lives, entries = given.alive.sum(0), (~np.isnan(given.tracks[..., 0])).sum(0)
    shared = np.zeros((truths, tracks))
    for k, i, j in product(range(scans), range(truths), range(tracks)):
        if like[k, i, j] > 0:
            shared[i, j] += like[k, i, j] / (like[k, i].sum() + like[k, :, j].sum() - like[k, i, j])
    jaccard = shared / np.maximum(lives[:, None] + entries - shared, 1e-12)
    matches = []
    for k in range(scans):
        worth = jaccard * like[k]
        best = max(
            (tuple(zip(range(truths), picked, strict=True)) for picked in permutations(range(max(tracks, truths)), truths)),
            key=lambda pairs: sum(worth[i, j] for i, j in pairs if j < tracks),
        )
        matches += [(k, i, j) for i, j in best if j < tracks and like[k, i, j] > 0]
    rows = []
    for threshold in [n / 20 for n in range(1, 20)]:
        kept = [(i, j, like[k, i, j]) for k, i, j in matches if like[k, i, j] >= threshold]
        pairs = [(i, j) for i, j, _ in kept]
        det = len(kept) / (lives.sum() + entries.sum() - len(kept))
        each = [pairs.count((i, j)) / (lives[i] + entries[j] - pairs.count((i, j))) for i, j in pairs]
        ass = float(np.mean(each)) if each else 0.0
        rows.append([np.sqrt(det * ass), det, ass, np.mean([s for *_, s in kept]) if kept else 1.0])
    return np.mean(rows, axis=0)
