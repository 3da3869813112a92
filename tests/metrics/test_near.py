"""Near pairs give the figures of all distances, and the best choice among them. How figures of whole tracks fit."""

import tracemalloc

import numpy as np
import pytest
from scipy.optimize import linear_sum_assignment
from scipy.sparse import coo_matrix
from scipy.sparse.csgraph import connected_components

import vedette
from support.many import problem
from support.paths import EXAMPLES
from vedette import kernels
from vedette.metrics import covering, distances, gospa, judge
from vedette.metrics.near_pairs import near, near_points, one_to_one
from vedette_standard.whole_tracks import clear_mot, hota, ospa2, trajectory_gospa


@pytest.fixture(scope="module")
def fleet():
    experiment = vedette.load(EXAMPLES / "fleet.toml", overrides=["source.duration=100", "judge.far=200"])
    return experiment, experiment.run()


def judged(fleet, **changes):
    _, result = fleet
    options = vedette.load(
        EXAMPLES / "fleet.toml", overrides=[f"judge.{name}={value}" for name, value in changes.items()]
    ).judge
    return judge(result.tracks, result.recording.truth, result.scans, options)


@pytest.mark.parametrize("seed", range(12))
def test_near_points_are_those_of_all_distances_bit_for_bit(seed, monkeypatch):
    rng = np.random.default_rng(seed)
    monkeypatch.setattr("vedette.metrics.near_pairs._AT_ONCE", 1 + 40 * (seed % 3))
    truth = rng.normal(0.0, 20.0, (30, 1 + seed % 3)) + 1e5 * (seed % 2)
    tracks = truth[rng.integers(0, 30, 50)] + rng.integers(-3, 4, (50, truth.shape[1]))
    alive, reach = rng.random(30) < 0.8, (0.0, 3.0, 40.0, np.inf)[seed % 4]
    found = near_points(truth, tracks, reach, alive)
    apart = np.where(alive[:, None], distances(truth, tracks), np.inf)
    slow = near(apart, reach)
    for one, other in ((found.truth, slow.truth), (found.track, slow.track), (found.distance, slow.distance)):
        np.testing.assert_array_equal(one, other)
    np.testing.assert_array_equal(found.nearest, np.where(apart.min(axis=0) <= reach, apart.min(axis=0), np.inf))
    some, few = rng.random(30) < 0.5, rng.random(50) < 0.5
    part, whole = found.among(some, few), near(apart[some][:, few], reach)
    assert part.shape == whole.shape
    assert (part.truth.tolist(), part.track.tolist()) == (whole.truth.tolist(), whole.track.tolist())


@pytest.mark.parametrize(("small", "few"), [(0, 0), (0, 4), (2**14, 0)])
@pytest.mark.parametrize("seed", range(30))
def test_the_best_pairs_are_those_of_the_whole_table(seed, small, few, monkeypatch):
    """Stars, chains and knots of pairs, in one table and divided; ties and pairs that cost as much as none."""
    monkeypatch.setattr("vedette.metrics.near_pairs._SMALL", small)
    monkeypatch.setattr("vedette.metrics.near_pairs._FEW", few)
    rng = np.random.default_rng(seed)
    table = np.where(rng.random((12, 9)) < (0.08, 0.15, 0.3)[seed % 3], rng.choice([0.0, 0.1, 0.5, 0.9, 1.0], (12, 9)), 1.0)
    truth, track = np.nonzero(rng.permuted(table < 1.0, axis=1) | (table < 1.0))
    cost = table[truth, track]
    best = one_to_one(truth, track, cost, 1.0)
    assert np.all(np.diff(best) > 0)
    assert np.all(cost[best] < 1.0)
    for side in (truth, track):
        assert len(set(side[best].tolist())) == len(best)
    assert np.sum(cost[best] - 1.0) == pytest.approx(np.sum(table[linear_sum_assignment(table)] - 1.0), abs=1e-12)


@pytest.mark.parametrize("seed", range(20))
def test_pairs_that_hang_together_are_the_parts_of_the_graph(seed):
    """Sparse and dense graphs, and a chain through all."""
    rng = np.random.default_rng(seed)
    pairs = [rng.integers(0, (30, 25), (count, 2)) for count in (10, 25, 60)]
    chain = rng.permutation(40)
    for truth, track in [*(each.T for each in pairs), (chain, chain), (np.r_[chain, chain[1:]], np.r_[chain, chain[:-1]])]:
        links = coo_matrix((np.ones(len(truth)), (truth, 40 + track)), shape=(80, 80))
        part = connected_components(links, directed=False)[1][truth]
        found = kernels.linked_clusters(truth, track, 40, 40)[truth]
        np.testing.assert_array_equal(found[:, None] == found, part[:, None] == part)


@pytest.mark.parametrize("seed", range(10))
def test_figures_of_near_pairs_are_those_of_all_distances(seed):
    given = problem(seed, scans=12, truths=5, tracks=7)
    few = [near(apart, 5.0) for apart in given.apart]
    scans = list(zip(given.apart, few, given.alive, strict=True))
    for every, some, alive in scans:
        assert gospa(some.among(alive), 5.0) == gospa(every[alive], 5.0)
    for figure, more in ((hota, (7, 5.0)), (ospa2, (7, 5.0, 2.0, 3)), (ospa2, (7, 4.0)), (trajectory_gospa, (5.0, 3.0))):
        assert figure(few, given.present, given.alive, *more) == figure(given.apart, given.present, given.alive, *more)
    cover = covering(few, given.present, 2.5)
    np.testing.assert_array_equal(cover, covering(given.apart, given.present, 2.5))
    assert clear_mot(few, given.present, given.alive, cover) == clear_mot(given.apart, given.present, given.alive, cover)


def test_what_a_scan_costs_grows_with_the_near_pairs():
    """Five thousand objects in a square of 50 km: none but the near pairs is ever in memory."""
    rng = np.random.default_rng(1)
    truth = rng.uniform(0.0, 50_000.0, (5_000, 2))
    tracemalloc.start()
    found = near_points(truth, truth + rng.normal(0.0, 5.0, truth.shape), 50.0)
    gospa(found, 50.0)
    most = tracemalloc.get_traced_memory()[1]
    tracemalloc.stop()
    assert 5_000 < len(found.truth) < 6_000
    assert most < 20e6


@pytest.mark.costly
def test_figures_of_whole_tracks_fit_together(fleet):
    score = judged(fleet)
    parts = [getattr(score, f"trajectory_gospa_{part}") for part in ("localisation", "missed", "false", "switches")]
    assert sum(parts) == pytest.approx(score.trajectory_gospa_m**2)
    each = np.array([score.gospa_localisation, score.gospa_missed, score.gospa_false])
    assert sum(parts) >= np.sum(each) - 1e-9
    free = judged(fleet, switch_penalty=0)
    assert free.trajectory_gospa_m**2 == pytest.approx(np.sum(each))
    objects = sum(fate.scans for fate in score.truths)
    covered = sum(round(fate.coverage * fate.scans) for fate in score.truths if fate.scans)
    wrong = objects - covered + score.false_tracks * score.scans + score.id_switches
    assert score.mota == pytest.approx(1 - wrong / objects)
    assert judged(fleet, largest_program=0).trajectory_gospa_m == score.trajectory_gospa_m  # none is needed
    assert judged(fleet, gospa_cutoff=20).hota < score.hota


@pytest.mark.costly
def test_far_tracks_count_in_mota_only(fleet):
    near, every = judged(fleet, far=30), judged(fleet)
    assert near.siap_spuriousness < every.siap_spuriousness
    assert near.hota > every.hota
    assert near.trajectory_gospa_false < every.trajectory_gospa_false
    assert near.mota == every.mota
    assert judged(fleet, near=30).mota > every.mota


def test_without_tracks_there_is_nothing_but_misses(fleet):
    experiment, result = fleet
    score = judge([], result.recording.truth, result.scans, experiment.judge)
    assert (score.hota, score.mota, score.siap_completeness) == (0.0, 0.0, 0.0)
    assert (score.motp_m, score.siap_spuriousness, score.siap_position_m) == (None, None, None)
    assert score.ospa2_m == 50.0
    assert score.trajectory_gospa_m == pytest.approx(np.sqrt(score.trajectory_gospa_missed))
