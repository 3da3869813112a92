"""Laws of associators that keep hypotheses: on problems so small that every joint association can be written down.

Where a component has `hypotheses`, `associations`, `leaves` or `scans` (most that are kept) or `least` (the weight at or
below which one is dropped), the kit gives it room for all.
"""

from __future__ import annotations

from itertools import product
from typing import Any, TypeVar

import numpy as np
from attrs import evolve, frozen

from vedette.hypotheses import Branching, HypothesisAssociator, LeafScores
from vedette.roles import Associator
from vedette.space import Array, Indices, Mask, Space
from vedette.testing.comparisons import Lacking, closed_if, demand, frozen_copy, same, varied
from vedette.testing.law import Law
from vedette.testing.laws.associator_cases import Scores
from vedette.testing.laws.lifecycle_cases import still
from vedette.tracking import pytrees
from vedette.types import Gaussian

A = TypeVar("A", bound=Associator)
ROOM = {"exact": 16, "hypotheses": 1000, "associations": 1000, "leaves": 1000, "m": 1000, "scans": 10, "least": 0.0}
"""Values of the parameters of these names under which nothing is dropped."""


def with_room(associator: A) -> A:
    """Return the associator with room for all associations of a small problem."""
    return varied(associator, **{name: value for name, value in ROOM.items() if hasattr(associator, name)})


@frozen(eq=False)
class FirstScan:
    """A scan's branching and what was asked: log scores (t, 1+k) of one leaf a track, and where tracks may begin (k,)."""

    scores: Array
    begins: Mask
    branching: Branching
    probability: Array

    @property
    def old(self) -> Mask:
        return self.branching.parent >= 0


def first_scan(associator: HypothesisAssociator, scores: Array, begins: Mask) -> FirstScan:
    """Return what becomes of given tracks in their first scan."""
    start = associator.initial_hypotheses(len(scores))
    branching = associator.branch(start, LeafScores.of(frozen_copy(scores)), np.array(begins))
    count = len(branching.parent)
    demand(len(branching.choice) == count, f"branch: {count} parents, but {len(branching.choice)} choices")
    probability = np.asarray(associator.probability(branching.hypotheses))
    demand(probability.shape == (count,), f"probability: must have shape {(count,)}, got {probability.shape}")
    return FirstScan(scores, begins, branching, probability)


def _begins(drawn: Scores) -> Mask:
    return drawn.returns % 2 == 0


def _table(scan: FirstScan) -> Array:
    """Return the probability of each track and choice (t, 1+k), and in a last row that a track begins at a return."""
    t, columns = scan.scores.shape
    table = np.zeros((t + 1, columns))
    row = np.where(scan.old, scan.branching.parent, t)
    np.add.at(table, (row, scan.branching.choice), scan.probability)
    return table


def enumerated(scores: Array, exclusive: bool = True) -> list[tuple[tuple[int, ...], float]]:
    """Return every joint association of scores (t, 1+k), what each track takes, with its probability.

    If not `exclusive`, several tracks may take the same return.
    """
    t, columns = scores.shape
    joint = []
    for choice in product(range(columns), repeat=t):
        taken = [i for i in choice if i]
        total = sum(scores[row, i] for row, i in enumerate(choice))
        if (not exclusive or len(set(taken)) == len(taken)) and total > -np.inf:
            joint.append((choice, float(total)))
    best = max(total for _, total in joint)
    weights = np.exp([total - best for _, total in joint])
    return [(choice, float(weight)) for (choice, _), weight in zip(joint, weights / weights.sum(), strict=True)]


def leaves_are_of_the_scan(associator: HypothesisAssociator, drawn: Scores) -> None:
    """If it keeps hypotheses: leaves continue leaves, each in its own way, or begin, and take what they may."""
    scan = first_scan(associator, drawn.scores[0], _begins(drawn))
    parent, choice, (t, columns) = scan.branching.parent, scan.branching.choice, scan.scores.shape
    demand(np.all((parent >= -1) & (parent < t)), f"branch: parents must be rows of {t} leaves or -1, got {parent}")
    demand(np.all((choice >= 0) & (choice < columns)), f"branch: choices must be 0 to {columns - 1}, got {choice}")
    demand(np.all(scan.old[:-1] >= scan.old[1:]), f"branch: leaves that continue others come first, parents are {parent}")
    ways = list(zip(parent.tolist(), choice.tolist(), strict=True))
    demand(len(set(ways)) == len(ways), f"branch: a leaf continues another twice in the same way: {ways}")
    taken = scan.scores[parent[scan.old], choice[scan.old]]
    demand(np.all(taken > -np.inf), "branch: a leaf takes a return that its score forbids")
    new = choice[~scan.old]
    demand(np.all(new > 0), "branch: a track begins at no return")
    demand(np.all(scan.begins[new[new > 0] - 1]), f"branch: tracks begin at returns {new}, where none may")
    demand(np.all((scan.probability > 0) & (scan.probability < 1 + 1e-9)), "probability: of a leaf must be > 0 and <= 1")


def given_tracks_are_somewhere(associator: HypothesisAssociator, drawn: Scores) -> None:
    """If it keeps hypotheses: a given track's leaves have probability 1, or less without room; a return is taken once."""
    for kept in (associator, with_room(associator)):
        table = _table(first_scan(kept, drawn.scores[0], _begins(drawn)))
        for what, total in (
            ("a track's leaves are there", table[:-1].sum(axis=-1)),
            ("a return is taken", table.sum(axis=0)[1:]),
        ):
            most = float(total.max(initial=0.0))
            demand(most <= 1 + 1e-9, f"probability: {what} {most:.6g} times in total, allowed 1")
    same("probability of a track's leaves, in sum", table[:-1].sum(axis=-1), np.ones(len(table) - 1), 1e-9)


def first_scan_is_enumerated(associator: HypothesisAssociator, drawn: Scores) -> None:
    """If it keeps hypotheses: with room for all, leaves have the probabilities of all joint associations, written down."""
    scores, begins = drawn.scores[0], _begins(drawn)
    table = _table(first_scan(with_room(associator), scores, begins))
    same("probability of (track, choice), beginning tracks last", table, _wanted(enumerated(scores), begins), 1e-6, 1.0)


def _wanted(joint: list[tuple[tuple[int, ...], float]], begins: Mask) -> Array:
    """Return what the table must be by joint associations and their probabilities."""
    wanted = np.zeros((1 + len(joint[0][0]), 1 + len(begins)))
    for choice, weight in joint:
        wanted[range(len(choice)), choice] += weight
        wanted[-1, [i for i in range(1, 1 + len(begins)) if begins[i - 1] and i not in choice]] += weight
    return wanted


def histories_multiply(associator: HypothesisAssociator, drawn: Scores) -> None:
    """If it keeps hypotheses: with room, a lone track's leaf weighs the product of its scores, and the heaviest is shown."""
    kept = with_room(associator)
    closed_if(kept.merges == "kept", "it merges leaves after each scan")
    rng = np.random.default_rng(int(drawn.tracks.sum()) + 5 * drawn.scores.shape[-1])
    hypotheses, logs = kept.initial_hypotheses(1), np.zeros(1)
    paths: list[tuple[int, ...]] = [()]
    for _ in range(3):
        scores = 2.0 * rng.standard_normal((len(logs), 3))
        scores[0, 1 + int(rng.integers(2))] = -np.inf
        branching = kept.branch(hypotheses, LeafScores.of(frozen_copy(scores)), np.zeros(2, dtype=bool))
        logs = logs[branching.parent] + scores[branching.parent, branching.choice]
        paths = [(*paths[i], j) for i, j in zip(branching.parent.tolist(), branching.choice.tolist(), strict=True)]
        hypotheses, rows = kept.keep(branching.hypotheses, np.ones(len(logs), dtype=bool))
        logs, paths = logs[rows], [paths[i] for i in rows.tolist()]
        wanted = np.exp(logs - logs.max())
        wanted /= wanted.sum()
        same("probability of a lone track's leaves", np.asarray(kept.probability(hypotheses)), wanted, 1e-6, 1.0)
        two = np.sort(wanted)[-2:]
        shown = np.asarray(kept.reported(hypotheses, np.ones(len(logs)))).tolist()
        demand(len(shown) == 1, f"reported: a lone track is shown {len(shown)} times")
        if two[-1] - two[0] > 1e-6:
            best = int(np.argmax(wanted))
            demand(shown == [best], f"reported: must be the leaf of history {paths[best]}, got that of {paths[shown[0]]}")


def order_of_a_scan_is_free(associator: HypothesisAssociator, drawn: Scores) -> None:
    """If it keeps hypotheses: another order of tracks or returns, or a constant on a track's scores, changes nothing."""
    kept, scores, begins = with_room(associator), drawn.scores[0], _begins(drawn)
    table = _table(first_scan(kept, scores, begins))
    columns = np.concatenate([[0], 1 + drawn.returns])
    moved = _table(first_scan(kept, scores[drawn.tracks][:, columns], begins[drawn.returns]))
    rows = np.concatenate([drawn.tracks, [len(scores)]])
    same("probability in another order", moved, table[rows][:, columns], 1e-7, 1.0)
    shifted = _table(first_scan(kept, scores + np.linspace(-400.0, 350.0, len(scores))[:, None], begins))
    same("probability with constants added", shifted, table, 1e-7, 1.0)


def keeping_all_changes_nothing(associator: HypothesisAssociator, drawn: Scores) -> None:
    """If it keeps hypotheses: with room, only leaves that ended go, and none of the others becomes less probable."""
    kept = with_room(associator)
    scan = first_scan(kept, drawn.scores[0], _begins(drawn))
    count = len(scan.probability)
    hypotheses, rows = kept.keep(scan.branching.hypotheses, np.ones(count, dtype=bool))
    same("rows kept of living leaves", np.asarray(rows, dtype=float), np.arange(count, dtype=float), 0.0)
    same("probability kept", np.asarray(kept.probability(hypotheses)), scan.probability, 1e-9, 1.0)
    alive = np.random.default_rng(int(drawn.tracks[0]) + count).random(count) < 0.6
    before = still(scan.branching.hypotheses)  # it is part of a state, which somebody may have kept
    hypotheses, rows = kept.keep(before, alive)
    same("probability of what was passed in", np.asarray(kept.probability(before)), scan.probability, 1e-12, 1.0)
    same("rows kept", np.asarray(rows, dtype=float), np.flatnonzero(alive).astype(float), 0.0)
    left = np.asarray(kept.probability(hypotheses))
    demand(left.shape == rows.shape, f"probability: of {len(rows)} leaves, got {left.shape}")
    loss = float((scan.probability[alive] - left).max(initial=0.0))
    demand(loss < 1e-9, f"probability: a leaf that goes on becomes less probable by {loss:.3g} when others end")


def one_hypothesis_is_the_best(associator: HypothesisAssociator, drawn: Scores) -> None:
    """If it has `hypotheses`: where one is kept, it is the best joint association, and it is certain."""
    kept = with_room(associator)
    closed_if(not hasattr(kept, "hypotheses"), Lacking("hypotheses"))
    alone = varied(kept, hypotheses=1)
    joint: list[tuple[tuple[int, ...], float]] = sorted(enumerated(drawn.scores[0]), key=lambda each: -each[1])
    closed_if(len(joint) > 1 and joint[0][1] < (1 + 1e-6) * joint[1][1], "two joint associations are equally good")
    table = _table(first_scan(alone, drawn.scores[0], _begins(drawn)))
    same("probability of (track, choice)", table, _wanted([(joint[0][0], 1.0)], _begins(drawn)), 1e-9, 1.0)


def shown_once_oldest_first(associator: HypothesisAssociator, drawn: Scores) -> None:
    """If it keeps hypotheses: at most one leaf of each track is shown, the oldest track first."""
    scan = first_scan(associator, drawn.scores[0], _begins(drawn))
    shown: Indices = np.asarray(associator.reported(scan.branching.hypotheses, np.ones(len(scan.probability))))
    demand(np.all((shown >= 0) & (shown < len(scan.probability))), f"reported: must be rows of leaves, got {shown}")
    parent, choice = scan.branching.parent[shown], scan.branching.choice[shown]
    track = np.where(parent >= 0, parent, len(scan.scores) + choice)
    demand(np.all(np.diff(track) > 0), f"reported: tracks must come once each and oldest first, got {track}")


def merging_keeps_every_weight(associator: HypothesisAssociator, drawn: Scores) -> None:
    """If it merges leaves: what a leaf gives to all that it is merged into is its probability, and those far away get none.

    If it has `show`: it merges those shown where that is "mean", and else not.
    """
    kept = with_room(associator)
    if isinstance(show := getattr(kept, "show", None), str):
        demand((show == "mean") == (kept.merges == "shown"), f"merges: is {kept.merges!r}, and it shows the {show}")
    closed_if(not kept.merges, "it merges no leaves")
    scan = first_scan(kept, drawn.scores[0], _begins(drawn))
    hypotheses, count = scan.branching.hypotheses, len(scan.probability)
    rng, state = np.random.default_rng(count), Space.of(x="m", y="m")
    estimate = Gaussian(10.0 * rng.standard_normal((count, 2)), np.broadcast_to(4.0 * np.eye(2), (count, 2, 2)))
    existence = np.where(scan.old, rng.uniform(0.5, 1.0, count), 0.3)
    merging = kept.merge(hypotheses, estimate, existence, state)
    shares = merging.table(count)
    demand(np.all(shares >= -1e-12), "merge: shares must be >= 0")
    same("what a leaf gives in all", shares.sum(axis=0), scan.probability, 1e-6, 1.0)
    sums = shares.sum(axis=-1)
    demand(np.all(sums <= 1 + 1e-6), f"merge: shares of a new leaf sum to {sums.max(initial=0.0):.6g}, at most 1")
    track = np.where(scan.old, scan.branching.parent, len(scan.scores) + scan.branching.choice)
    apart = evolve(estimate, mean=estimate.mean + 1e3 * track[:, None])
    away = kept.merge(hypotheses, apart, existence, state)
    strange = (track[away.own][:, None] != track) & (away.table(count) > 1e-6)
    demand(not strange.any(), f"merge: tracks 1 km apart share leaves {np.flatnonzero(strange.any(axis=0)).tolist()}")
    after = np.asarray(kept.probability(merging.hypotheses))
    demand(len(after) == len(merging.own), f"merge: hypotheses are over {len(after)} leaves, must be {len(merging.own)}")


def branches_purely(associator: HypothesisAssociator, drawn: Scores) -> None:
    """If it keeps hypotheses: branching again gives the same, and leaves the hypotheses as they were."""
    start, scores = associator.initial_hypotheses(drawn.scores.shape[-2]), drawn.scores[0]
    before = np.array(associator.probability(start))
    same("probability of given tracks", before, np.ones(len(scores)), 1e-12)
    found: list[Any] = []
    for _ in range(2):
        branching = associator.branch(start, LeafScores.of(scores), _begins(drawn))
        found.append(np.concatenate([branching.parent, branching.choice, associator.probability(branching.hypotheses)]))
    same("branched again", found[1], found[0], 0.0)
    again = pytrees.take(start, slice(None), 0)  # its arrays without what it may have computed of them
    same("probability before, afterwards", np.asarray(associator.probability(again)), before, 0.0)
    none = first_scan(associator, scores[:, :1], np.zeros(0, dtype=bool))
    same("probability after a scan without returns", _table(none)[:-1, 0], before, 1e-9)


LAWS: tuple[Law, ...] = tuple(map(Law, (
    leaves_are_of_the_scan, given_tracks_are_somewhere, first_scan_is_enumerated, histories_multiply,
    order_of_a_scan_is_free, keeping_all_changes_nothing, one_hypothesis_is_the_best, shown_once_oldest_first,
    merging_keeps_every_weight, branches_purely,
)))  # fmt: skip
