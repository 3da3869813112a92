"""OSPA(2), SIAP, CLEAR and HOTA against their definitions, written anew, and against numbers of other tools."""

from itertools import pairwise, product

import numpy as np
import pytest

from support.many import Problem, hota_by_definition, ospa2_by_definition, problem, there
from vedette.metrics import covering
from vedette_standard.whole_tracks import clear_mot, hota, ospa2, siap
from vedette_standard.whole_tracks.siap import assigned

SEEDS = range(20)


@pytest.mark.parametrize("seed", SEEDS)
@pytest.mark.parametrize("order", [1.0, 2.0])
def test_ospa2_is_its_definition(seed, order):
    given, cutoff = problem(seed), 4.0
    whole = ospa2(given.apart, given.present, given.alive, 4, cutoff, order)
    assert whole == pytest.approx(ospa2_by_definition(given, range(6), cutoff, order))
    ends = [ospa2_by_definition(given, range(max(end - 2, 0), end), cutoff, order) for end in range(1, 7)]
    assert ospa2(given.apart, given.present, given.alive, 4, cutoff, order, 2) == pytest.approx(np.mean(ends))


def siap_of(given: Problem, radius: float, times=None):
    owners = [assigned(each, radius) for each in given.apart]
    error = np.concatenate(
        [each[owner[owner >= 0], np.flatnonzero(owner >= 0)] for each, owner in zip(given.apart, owners, strict=True)]
    )
    times = np.arange(float(len(owners))) if times is None else times
    return siap(owners, given.present, given.alive, times, error, 2 * error)


@pytest.mark.parametrize("seed", SEEDS)
def test_siap_is_its_definition(seed):
    given, radius = problem(seed), 2.5
    times = np.cumsum(np.random.default_rng(seed).uniform(0.5, 2.0, 6))
    scans, truths, tracks = len(given.truth), given.truth.shape[1], given.tracks.shape[1]
    owner = {}
    for k, j in product(range(scans), range(tracks)):
        far = {i: given.distance(k, i, j) for i in range(truths) if all(there(given, k, i, j))}
        near = {i: d for i, d in far.items() if d <= radius}
        if near:
            owner[k, j] = min(near, key=near.get)
    held = {(k, i): {j for j in range(tracks) if owner.get((k, j)) == i} for k in range(scans) for i in range(truths)}
    objects, entries = int(given.alive.sum()), sum(len(row) for row in given.present)
    followed = sum(bool(each) for each in held.values())
    found = siap_of(given, radius, times)
    assert found.completeness == pytest.approx(followed / objects)
    assert found.ambiguity == pytest.approx(len(owner) / followed)
    assert found.spuriousness == pytest.approx((entries - len(owner)) / entries)
    assert found.position == pytest.approx(np.mean([given.distance(k, i, j) for (k, j), i in owner.items()]))
    assert found.velocity == pytest.approx(2 * found.position)
    changes = tracked = longest = lives = 0.0
    for i in range(truths):
        sets = [held[k, i] for k in range(scans) if held[k, i]]
        # The fewest tracks in turn: over all sequences of one track a scan, the one with the fewest changes.
        changes += min((sum(a != b for a, b in pairwise(p)) for p in product(*sets)), default=0) if sets else 0
        tracked += sum(times[k + 1] - times[k] for k in range(scans - 1) if held[k, i] & held[k + 1, i])
        runs = [
            times[b] - times[a]
            for a, b, j in product(range(scans), range(scans), range(tracks))
            if a <= b and all(j in held[k, i] for k in range(a, b + 1))
        ]
        longest += max(runs, default=0.0)
        at = times[given.alive[:, i]]
        lives += at[-1] - at[0] if len(at) else 0.0
    assert found.changes == (pytest.approx(changes / tracked) if tracked else None)
    assert found.longest == pytest.approx(longest / lives)


def test_siap_without_tracks_or_objects():
    nothing = Problem(np.zeros((2, 1, 2)), np.zeros((2, 0, 2)))
    found = siap_of(nothing, 1.0)
    assert (found.completeness, found.ambiguity, found.spuriousness, found.position) == (0.0, None, None, None)
    empty = Problem(np.full((2, 1, 2), np.nan), np.zeros((2, 1, 2)))
    found = siap_of(empty, 1.0)
    assert (found.completeness, found.spuriousness, found.changes, found.longest) == (None, 1.0, None, None)
    assert siap_of(Problem(np.zeros((2, 0, 2)), np.zeros((2, 1, 2))), 1.0).spuriousness == 1.0


@pytest.mark.parametrize("seed", SEEDS)
def test_clear_is_its_definition(seed):
    given = problem(seed)
    cover = covering(given.apart, given.present, 2.5)
    found = clear_mot(given.apart, given.present, given.alive, cover)
    missed = false = changed = 0
    errors, last = [], {}
    for k, row in enumerate(cover.tolist()):
        missed += sum(given.alive[k, i] and j < 0 for i, j in enumerate(row))
        false += len(set(given.present[k].tolist()) - set(row))
        for i, j in enumerate(row):
            if j >= 0:
                errors.append(given.distance(k, i, j))
                changed += last.get(i, j) != j
                last[i] = j
    assert (found.missed, found.false, found.switches) == (missed, false, changed)
    assert found.mota == pytest.approx(1 - (missed + false + changed) / given.alive.sum())
    assert found.motp == (pytest.approx(np.mean(errors)) if errors else None)
    assert clear_mot(given.apart, given.present, given.alive, cover, 0).mota > found.mota - 1e-12


def hota_of(given: Problem, cutoff: float):
    return hota(given.apart, given.present, given.alive, given.tracks.shape[1], cutoff)


@pytest.mark.parametrize("seed", SEEDS)
def test_hota_is_its_definition(seed):
    given = problem(seed)
    found = hota_of(given, 5.0)
    expected = hota_by_definition(given, 5.0)
    assert [found.value, found.detection, found.association, found.localisation] == pytest.approx(expected)


def test_hota_of_perfect_of_split_and_of_no_tracks():
    truth = np.zeros((10, 1, 2))
    assert hota_of(Problem(truth, truth), 5.0).value == 1.0
    halves = np.full((10, 2, 2), np.nan)
    halves[:5, 0], halves[5:, 1] = 0.0, 0.0
    split = hota_of(Problem(truth, halves), 5.0)
    assert (split.detection, split.association) == (1.0, 0.5)
    assert hota_of(Problem(truth, np.zeros((10, 0, 2))), 5.0).value == 0.0
    with pytest.raises(ValueError, match="cutoff: must be > 0 m, got 0"):
        hota_of(Problem(truth, truth), 0.0)


# problem(seed, scans=30, truths=4, tracks=6) at the radius 2.5 m and the cut-off 5 m.
TRACKEVAL = {  # trackeval 1.3.0: HOTA, DetA, AssA, LocA
    0: (0.2690542919453329, 0.37249778836326397, 0.19554132881240832, 0.817952452994106),
    1: (0.2201275368712117, 0.3787659442149278, 0.12925836800818144, 0.7919766775841689),
    3: (0.2632823188470123, 0.3110141218822316, 0.223428525272271, 0.8039666873163049),
}
MOTMETRICS = {  # motmetrics 1.4.0: MOTA, MOTP, misses, false positives, switches
    0: (0.0, 1.0654354283958503, 27, 48, 23),
    2: (-0.10476190476190483, 1.12086780413525, 38, 52, 26),
    3: (-0.12149532710280364, 1.1522173152469326, 40, 62, 18),
}
STONE_SOUP = {  # Stone Soup 1.9.1: completeness, ambiguity, spuriousness, position accuracy
    0: (0.7040816326530612, 1.391304347826087, 0.19327731092436976, 1.0626341352522914),
    1: (0.7142857142857143, 1.52, 0.10236220472440945, 1.2571051636927848),
    2: (0.638095238095238, 1.4477611940298507, 0.18487394957983194, 1.194365290873498),
}


@pytest.mark.parametrize("seed", range(4))
def test_other_tools_say_the_same(seed):
    given = problem(seed, scans=30, truths=4, tracks=6)
    if seed in TRACKEVAL:
        found = hota_of(given, 5.0)
        assert (found.value, found.detection, found.association, found.localisation) == pytest.approx(TRACKEVAL[seed])
    if seed in MOTMETRICS:
        mot = clear_mot(given.apart, given.present, given.alive, covering(given.apart, given.present, 2.5))
        assert (mot.mota, mot.motp, mot.missed, mot.false, mot.switches) == pytest.approx(MOTMETRICS[seed])
    if seed in STONE_SOUP:
        air = siap_of(given, 2.5)
        assert (air.completeness, air.ambiguity, air.spuriousness, air.position) == pytest.approx(STONE_SOUP[seed])


def test_stone_soup_says_the_same_of_continuity():
    """Stone Soup 1.9.1, of three objects 100 m apart with these spans of tracks: R = .037037, LS = .754386."""
    spans = [[(0, 7), (6, 12), (13, 19)], [(2, 19), (4, 9)], [(0, 19)]]
    truth = np.zeros((20, 3, 2))
    truth[..., 0] = 100 * np.arange(3)
    tracks = np.full((20, 6, 2), np.nan)
    for column, (i, begin, end) in enumerate((i, *span) for i, own in enumerate(spans) for span in own):
        tracks[begin : end + 1, column] = [100 * i + 1, 0]
    found = siap_of(Problem(truth, tracks), 5.0)
    assert found.changes == pytest.approx(0.037037037037037035)
    assert found.longest == pytest.approx(0.7543859649122807)
    assert found.ambiguity == pytest.approx(1.1379310344827587)
