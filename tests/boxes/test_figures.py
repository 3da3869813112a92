"""HOTA, MOTA and IDF1 of boxes equal those of trackeval, and what can be counted by hand."""

import contextlib
import importlib.util
import io
from itertools import permutations

import numpy as np
import pytest

from vedette_boxes.figures import Frames, judged
from vedette_boxes.rows import overlap
from vedette_standard.whole_tracks import idf1


def drawn(seed, frames=None):
    """Objects that move, tracks of them that break, change and are false, and frames without the ones or the others."""
    rng, made, n_new = np.random.default_rng(seed), Frames(), 500
    n = int(rng.integers(1, 7))
    xy, wh, v = rng.uniform(0, 200, (n, 2)), rng.uniform(20, 60, (n, 2)), rng.normal(0, 5, (n, 2))
    name = list(range(100, 100 + n))
    for _ in range(frames or int(rng.integers(2, 40))):
        xy = xy + v
        for j in range(n):
            if rng.random() < 0.15:
                name[j], n_new = n_new, n_new + 1
            k = int(rng.integers(n))
            if rng.random() < 0.1:
                name[j], name[k] = name[k], name[j]
        held = np.flatnonzero(rng.random(n) < (0.85 if rng.random() > 0.05 else 0.0))
        false = rng.poisson(1)
        places = np.concatenate([xy[held] + rng.normal(0, 6, (len(held), 2)), rng.uniform(0, 200, (false, 2))])
        sides = np.concatenate([wh[held] + rng.normal(0, 6, (len(held), 2)), rng.uniform(20, 60, (false, 2))])
        tracks = np.array([*(name[j] for j in held), *range(n_new, n_new + false)], dtype=int)
        n_new += false
        there = np.flatnonzero(rng.random(n) < (0.9 if rng.random() > 0.05 else 0.0))
        estimates = np.concatenate([places, np.maximum(sides, 3.0)], axis=1)
        made.add(there + 1, np.concatenate([xy, wh], axis=1)[there], tracks, estimates)
    return made


@pytest.mark.skipif(importlib.util.find_spec("trackeval") is None, reason="needs trackeval")
@pytest.mark.parametrize("seed", range(10))
def test_they_are_those_of_trackeval(seed):
    from trackeval import metrics

    frames = drawn(seed)
    truth, tracks = (np.unique(np.concatenate(ids)) for ids in (frames.truth, frames.tracks))
    data = {
        "num_timesteps": len(frames.truth),
        "num_gt_ids": len(truth), "num_tracker_ids": len(tracks),
        "num_gt_dets": sum(map(len, frames.truth)), "num_tracker_dets": sum(map(len, frames.tracks)),
        "gt_ids": [np.searchsorted(truth, ids) for ids in frames.truth],
        "tracker_ids": [np.searchsorted(tracks, ids) for ids in frames.tracks],
        "similarity_scores": frames.alike,
    }  # fmt: skip
    with contextlib.redirect_stdout(io.StringIO()):
        higher, clear, same = (made().eval_sequence(data) for made in (metrics.HOTA, metrics.CLEAR, metrics.Identity))
    wanted = {"hota": "HOTA", "detection": "DetA", "association": "AssA", "localisation": "LocA"}
    found = judged(frames)
    assert {name: found[name] for name in wanted} == pytest.approx(
        {name: float(np.mean(higher[theirs])) for name, theirs in wanted.items()}, abs=1e-9
    )
    assert found["mota"] == pytest.approx(float(clear["MOTA"]), abs=1e-9)
    assert found["idf1"] == pytest.approx(float(same["IDF1"]), abs=1e-9)


# Printed by trackeval 1.3.0 for the same frames.
TRACKEVAL = {
    0: {"hota": 0.17196552733892792, "association": 0.09929521706100705, "mota": -0.359375, "idf1": 0.1696113074204947},
    1: {"hota": 0.21005913568979198, "association": 0.16298342404655888, "mota": -0.4, "idf1": 0.2773722627737226},
    2: {
        "hota": 0.263635122519344,
        "association": 0.18805835157569067,
        "mota": -0.14545454545454545,
        "idf1": 0.2809917355371901,
    },
    3: {
        "hota": 0.40114170955448436,
        "association": 0.4543224732538089,
        "mota": 0.22727272727272727,
        "idf1": 0.6086956521739131,
    },
}


@pytest.mark.parametrize("seed", TRACKEVAL)
def test_they_are_what_trackeval_printed(seed):
    found = judged(drawn(seed))
    assert {name: found[name] for name in TRACKEVAL[seed]} == pytest.approx(TRACKEVAL[seed], abs=1e-9)


@pytest.mark.parametrize("seed", range(12))
def test_idf1_is_the_best_of_all_assignments(seed):
    frames = drawn(seed, frames=4)
    objects, tracks = (np.unique(np.concatenate(ids)) for ids in (frames.truth, frames.tracks))
    shared = np.zeros((len(objects), max(len(tracks), len(objects))))
    for there, here, alike in zip(frames.truth, frames.tracks, frames.alike, strict=True):
        shared[np.ix_(np.searchsorted(objects, there), np.searchsorted(tracks, here))] += alike >= 0.5
    few = shared[: min(len(objects), 3)]  # of three objects at most, so that all assignments can be tried
    best = max(sum(few[i, j] for i, j in enumerate(picked)) for picked in permutations(range(few.shape[1]), len(few)))
    apart = []
    for there, alike in zip(frames.truth, frames.alike, strict=True):
        row = np.full((len(few), alike.shape[1]), np.inf)
        some = np.searchsorted(objects, there) < len(few)
        row[np.searchsorted(objects, there)[some]] = 1 - alike[some]
        apart.append(row)
    alive = np.array([[one in there for one in objects[: len(few)]] for there in frames.truth])
    present = [np.searchsorted(tracks, here) for here in frames.tracks]
    total = np.count_nonzero(alive) + sum(map(len, present))
    assert idf1(apart, present, alive, 0.5 + 1e-12) == pytest.approx(2 * best / total, abs=1e-12)


def test_a_perfect_run_has_one_and_one_that_breaks_in_the_middle_a_half():
    boxes = np.array([[10.0, 10.0, 8.0, 8.0]])
    perfect, broken = Frames(), Frames()
    for frame in range(10):
        perfect.add(np.array([1]), boxes, np.array([7]), boxes)
        broken.add(np.array([1]), boxes, np.array([7 + (frame >= 5)]), boxes)
    assert judged(perfect) == dict.fromkeys(judged(perfect), 1.0)
    found = judged(broken)
    assert (found["detection"], found["association"], found["mota"], found["idf1"]) == pytest.approx((1.0, 0.5, 0.9, 0.5))


def test_a_switch_counts_once_and_a_return_to_the_first_track_again():
    boxes = np.array([[10.0, 10.0, 8.0, 8.0]])
    frames = Frames()
    for track in (1, 1, 2, 2, 1, 1):
        frames.add(np.array([1]), boxes, np.array([track]), boxes)
    assert judged(frames)["mota"] == pytest.approx(1 - 2 / 6)


def test_who_was_matched_before_is_matched_again_though_another_overlaps_more():
    truth, near, nearer = np.array([[0.0, 0.0, 10.0, 10.0]]), [1.5, 0.0, 10.0, 10.0], [0.5, 0.0, 10.0, 10.0]
    frames = Frames()
    frames.add(np.array([1]), truth, np.array([5]), np.array([near]))
    frames.add(np.array([1]), truth, np.array([5, 6]), np.array([near, nearer]))
    assert judged(frames)["mota"] == pytest.approx(1 - 1 / 2)


def test_overlaps():
    a, b = np.array([[0.0, 0.0, 4.0, 2.0]]), np.array([[2.0, 0.0, 4.0, 2.0], [0.0, 0.0, 4.0, 2.0], [9.0, 0.0, 1.0, 1.0]])
    assert overlap(a, b).tolist() == [[1 / 3, 1.0, 0.0]]


def test_without_objects_there_are_no_figures_and_without_tracks_none_is_right():
    nothing, boxes = np.zeros((0, 4)), np.array([[10.0, 10.0, 8.0, 8.0]])
    none, missed = Frames(), Frames()
    none.add(np.zeros(0, dtype=int), nothing, np.array([1]), boxes)
    missed.add(np.array([1]), boxes, np.zeros(0, dtype=int), nothing)
    assert judged(none) == {}
    found = judged(missed)
    assert (found["hota"], found["mota"], found["idf1"]) == (0.0, 0.0, 0.0)
