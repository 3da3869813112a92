"""Matching of tracks to truth against enumeration, and what is lost."""

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from hypothesis.extra.numpy import arrays

from support.histories import history, looks, path
from support.pairings import pairings
from vedette.metrics import NONE, Judge, covering, distances, judge, switches
from vedette.metrics.coverage import LastCover
from vedette.metrics.tally import Fate

law = settings(max_examples=150)


# A coarse grid makes ties, zeros and distances equal to the cutoff common.
spots = st.integers(0, 4).flatmap(lambda n: arrays(float, (n, 2), elements=st.integers(-6, 6).map(float)))


# Matching
@given(spots, spots, st.sampled_from([2.0, 5.0, 9.0]))
@law
@pytest.mark.costly
def test_a_first_scan_is_matched_by_most_pairs_then_least_distance(a, b, radius):
    apart = distances(a, b)
    allowed = [pairs for pairs in pairings(len(a), len(b)) if all(apart[i, j] <= radius for i, j in pairs)]
    best = min((-len(pairs), sum(apart[i, j] for i, j in pairs)) for pairs in allowed)
    cover = covering([apart], [np.arange(len(b))], radius)[0]
    covered = np.flatnonzero(cover >= 0)
    assert len(set(cover[covered])) == len(covered)
    assert len(covered) == -best[0]
    assert apart[covered, cover[covered]].sum() == pytest.approx(best[1], abs=1e-9)


@given(st.lists(st.tuples(spots, st.integers(0, 15)), min_size=2, max_size=5), st.sampled_from([3.0, 6.0]))
@law
@pytest.mark.costly
def test_a_matching_is_one_to_one_within_the_radius_and_keeps_what_it_can(scenes, radius):
    """Four tracks, some present at each scan by the bits of a number; two truths walk among them."""
    apart, present = [], []
    for spot, bits in scenes:
        there = np.array([i for i in range(4) if bits >> i & 1], dtype=int)
        places = np.array([[0.0, 0.0], [4.0, 0.0], [0.0, 4.0], [4.0, 4.0]]) + spot.sum()
        truth = np.zeros((2, 2)) + (spot[:2] if len(spot) >= 2 else [[1.0, 1.0], [3.0, 3.0]])
        apart.append(distances(truth, places[there]))
        present.append(there)
    cover = covering(apart, present, radius)
    for s, row in enumerate(cover):
        used = row[row >= 0]
        assert len(set(used)) == len(used)
        for j, track in enumerate(row):
            near = {int(i): d for i, d in zip(present[s], apart[s][j], strict=True) if d <= radius}
            if track >= 0:
                assert track in near
            else:
                assert set(near) <= set(used.tolist())
            if s and cover[s - 1, j] in near:
                assert track == cover[s - 1, j]


def test_a_truth_keeps_its_track_while_it_covers_and_takes_it_back_after_a_gap():
    """One truth; track 0 drifts off and returns while track 1 comes closer."""
    apart = [np.array([row]) for row in ([2.0, 9.0], [4.0, 1.0], [9.0, 9.0], [4.0, 1.0], [6.0, 1.0], [1.0, 4.0])]
    cover = covering(apart, [np.arange(2)] * 6, 5.0)[:, 0]
    assert cover.tolist() == [0, 0, -1, 0, 1, 1]
    assert switches(cover) == 1


def test_a_track_belongs_to_the_truth_that_it_covered_last():
    """Track 0 covers the first truth, then the second; when both are near it stays with the second."""
    apart = [np.array([[1.0], [np.inf]]), np.array([[9.0], [1.0]]), np.array([[1.0], [3.0]])]
    cover = covering(apart, [np.arange(1)] * 3, 5.0)
    assert cover.tolist() == [[0, -1], [-1, 0], [-1, 0]]


def test_a_truth_keeps_its_track_whichever_others_are_looked_at():
    """Of three truths the last alone, then the last two: the track is nearer to the other one, which came later."""
    held = LastCover(3)
    assert covering([np.array([[4.0]])], [np.array([7])], 5.0, held, np.array([2])).tolist() == [[7]]
    assert covering([np.array([[1.0], [4.0]])], [np.array([7])], 5.0, held, np.array([1, 2])).tolist() == [[-1, 7]]


def test_crossing_objects_do_not_switch_while_their_tracks_are_near():
    times = np.arange(21.0)
    ways = [np.stack([times - 10, side * (times - 10) / 2], axis=-1) for side in (1, -1)]
    tracks = [history(i, times, way + np.array([0.3, 0.0])) for i, way in enumerate(ways)]
    score = judge(tracks, [path(f"boat {i}", times, way) for i, way in enumerate(ways)], looks(times), Judge(cover_radius=5))
    assert score.id_switches == 0
    assert score.coverage == 1
    assert score.position_rmse_m == pytest.approx(0.3)


@pytest.mark.parametrize(
    ("covered", "lost"),
    [
        ("11111", False),
        ("10011", False),
        ("10001", True),
        ("11000", True),
        ("11100", False),
        ("00011", False),
        ("00000", True),
        ("", None),
    ],
)
def test_lost_is_three_scans_in_a_row_after_it_was_found(covered, lost):
    cover, fate = np.array([0 if c == "1" else NONE for c in covered], dtype=np.intp), Fate()
    for time, label in enumerate(cover.tolist()):
        fate.follow(float(time), label, label)
    fate.squares.add(np.zeros((1, covered.count("1"))))
    assert fate.score("boat", 3).lost == lost
