"""Metrics: set distances against enumeration and their laws, matching against enumeration, small scenes worked by hand."""

import json
from itertools import combinations, permutations

import numpy as np
import pytest
from attrs import evolve
from hypothesis import given, settings
from hypothesis import strategies as st
from hypothesis.extra.numpy import arrays

from vedette import Detections, InputError, Scan, Space, Track, Trajectory
from vedette.metrics import Judge, covering, distances, gospa, is_lost, judge, ospa, rmse, rmse_over_runs, switches
from vedette.metrics.histories import truth_at

PLANE = Space.of(x="m", y="m", vx="m/s", vy="m/s")

law = settings(derandomize=True, max_examples=150, deadline=None)
# A coarse grid makes ties, zeros and distances equal to the cutoff common.
spots = st.integers(0, 4).flatmap(lambda n: arrays(float, (n, 2), elements=st.integers(-6, 6).map(float)))
cutoffs, orders = st.sampled_from([0.5, 3.0, 5.0, 20.0]), st.sampled_from([1.0, 2.0, 3.5])


def pairings(rows, columns):
    """Every one-to-one pairing of some rows with some columns."""
    for size in range(min(rows, columns) + 1):
        for some in combinations(range(rows), size):
            for others in permutations(range(columns), size):
                yield list(zip(some, others, strict=True))


# Set distances


@given(spots, spots, cutoffs, orders)
@law
def test_gospa_is_the_least_over_all_pairings(a, b, cutoff, order):
    apart = distances(a, b)
    best = min(
        sum(apart[i, j] ** order for i, j in pairs) + cutoff**order / 2 * (len(a) + len(b) - 2 * len(pairs))
        for pairs in pairings(len(a), len(b))
    )
    found = gospa(apart, cutoff, order)
    assert found.value == pytest.approx(best ** (1 / order), rel=1e-12, abs=1e-12)
    assert found.localisation + found.missed + found.false == pytest.approx(best, rel=1e-12, abs=1e-12)
    assert found.missed - found.false == pytest.approx(cutoff**order / 2 * (len(a) - len(b)), abs=1e-9)
    assert found.localisation >= 0
    assert found.missed >= 0
    assert found.false >= 0


@given(spots, spots, cutoffs, orders)
@law
def test_ospa_is_the_least_over_all_assignments(a, b, cutoff, order):
    apart = np.minimum(distances(a, b), cutoff)
    apart = apart if len(a) <= len(b) else apart.T
    few, many = apart.shape
    best = min(sum(apart[i, j] ** order for i, j in enumerate(p)) for p in permutations(range(many), few))
    expected = ((best + cutoff**order * (many - few)) / many) ** (1 / order) if many else 0.0
    assert ospa(distances(a, b), cutoff, order) == pytest.approx(expected, rel=1e-12, abs=1e-12)


@given(spots, spots, spots, cutoffs, orders)
@law
def test_set_distances_are_metrics(a, b, c, cutoff, order):
    for metric in (
        lambda p, q: gospa(distances(p, q), cutoff, order).value,
        lambda p, q: ospa(distances(p, q), cutoff, order),
    ):
        assert metric(a, a) == 0
        assert metric(a, b) == pytest.approx(metric(b, a), rel=1e-12)
        assert metric(a, c) <= metric(a, b) + metric(b, c) + 1e-9
        assert (metric(a, b) == 0) == (sorted(a.tolist()) == sorted(b.tolist()))


def test_gospa_counts_each_miss_where_ospa_averages():
    nothing = np.zeros((3, 0))
    assert gospa(nothing, 20.0).value == pytest.approx(20 * np.sqrt(3 / 2))
    assert ospa(nothing, 20.0) == 20
    assert gospa(np.zeros((0, 0)), 20.0).value == ospa(np.zeros((0, 0)), 20.0) == 0


@pytest.mark.parametrize(("cutoff", "order"), [(0.0, 2.0), (-1.0, 2.0), (10.0, 0.5), (np.nan, 2.0)])
def test_set_distances_refuse_what_makes_no_metric(cutoff, order):
    for metric in (gospa, ospa):
        with pytest.raises(ValueError, match=r"^cutoff: must be > 0 m, and order >= 1"):
            metric(np.ones((1, 1)), cutoff, order)


# Matching


@given(spots, spots, st.sampled_from([2.0, 5.0, 9.0]))
@law
def test_a_first_scan_is_matched_by_most_pairs_then_least_distance(a, b, radius):
    apart = distances(a, b)
    allowed = [pairs for pairs in pairings(len(a), len(b)) if all(apart[i, j] <= radius for i, j in pairs)]
    best = min((-len(pairs), sum(apart[i, j] for i, j in pairs)) for pairs in allowed)
    cover = covering([apart], [np.arange(len(b))], len(b), radius)[0]
    covered = np.flatnonzero(cover >= 0)
    assert len(set(cover[covered])) == len(covered)
    assert len(covered) == -best[0]
    assert apart[covered, cover[covered]].sum() == pytest.approx(best[1], abs=1e-9)


@given(st.lists(st.tuples(spots, st.integers(0, 15)), min_size=2, max_size=5), st.sampled_from([3.0, 6.0]))
@law
def test_a_matching_is_one_to_one_within_the_radius_and_keeps_what_it_can(scenes, radius):
    """Four tracks, some present at each scan by the bits of a number; two truths walk among them."""
    apart, present = [], []
    for spot, bits in scenes:
        there = np.array([i for i in range(4) if bits >> i & 1], dtype=int)
        places = np.array([[0.0, 0.0], [4.0, 0.0], [0.0, 4.0], [4.0, 4.0]]) + spot.sum()
        truth = np.zeros((2, 2)) + (spot[:2] if len(spot) >= 2 else [[1.0, 1.0], [3.0, 3.0]])
        apart.append(distances(truth, places[there]))
        present.append(there)
    cover = covering(apart, present, 4, radius)
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
    cover = covering(apart, [np.arange(2)] * 6, 2, 5.0)[:, 0]
    assert cover.tolist() == [0, 0, -1, 0, 1, 1]
    assert switches(cover) == 1


def test_a_track_belongs_to_the_truth_that_it_covered_last():
    """Track 0 covers the first truth, then the second; when both are near it stays with the second."""
    apart = [np.array([[1.0], [np.inf]]), np.array([[9.0], [1.0]]), np.array([[1.0], [3.0]])]
    cover = covering(apart, [np.arange(1)] * 3, 1, 5.0)
    assert cover.tolist() == [[0, -1], [-1, 0], [-1, 0]]


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
        ("", True),
    ],
)
def test_lost_is_three_scans_in_a_row_after_it_was_found(covered, lost):
    assert is_lost(np.array([c == "1" for c in covered], dtype=bool), 3) == lost


# Errors


def test_rmse_adds_the_axes_and_averages_the_rest():
    assert rmse(np.array([[[3.0, 4.0]], [[0.0, 0.0]]])) == pytest.approx(np.sqrt(12.5))
    with pytest.raises(ValueError, match=r"^error: holds no vector"):
        rmse(np.zeros((0, 2)))


def test_rmse_over_runs_takes_the_run_as_the_unit():
    error = np.sqrt(np.array([1.0, 3.0]))[:, None, None] * np.ones((2, 7, 1))
    both = rmse_over_runs(error)
    assert both.value == pytest.approx(np.sqrt(2))
    assert both.error == pytest.approx(1 / (2 * np.sqrt(2)))
    assert rmse_over_runs(error[:1]).error is None
    assert rmse_over_runs(np.zeros((3, 2, 2))).error == 0


def test_the_standard_error_of_an_rmse_is_its_spread():
    """Over 4,000 studies of 100 runs whose scans are copies of one another; false-alarm rate about 1e-7."""
    rng = np.random.default_rng(1)
    studies = [rmse_over_runs(np.repeat(rng.normal(size=(100, 1, 2)), 3, axis=1)) for _ in range(4000)]
    spread = np.std([study.value for study in studies])
    assert np.mean([study.error for study in studies]) == pytest.approx(spread, rel=5.33 / np.sqrt(8000) + 0.02)


# Scenes


def looks(times, sensor="radar", axes=2):
    return [Scan(float(time), sensor, Detections.of([], axes)) for time in times]


def path(name, times, xy, v=(0.0, 0.0)):
    states = np.hstack([np.asarray(xy, dtype=float), np.broadcast_to(v, (len(times), 2))])
    return Trajectory(name, PLANE, np.asarray(times, dtype=float), states)


def history(number, times, xy, *, v=(0.0, 0.0), cov=None, confirmed=None, nis=None, hit=None, mode_prob=None):
    s = len(times)
    return Track(
        id=number,
        space=PLANE,
        times=np.asarray(times, dtype=float),
        mean=np.hstack([np.asarray(xy, dtype=float), np.broadcast_to(v, (s, 2))]),
        cov=np.broadcast_to(np.eye(4) if cov is None else cov, (s, 4, 4)),
        confirmed=np.ones(s, dtype=bool) if confirmed is None else np.array(confirmed, dtype=bool),
        existence=np.ones(s),
        mode_prob=mode_prob,
        weights=(np.array([0.0, 1.0]),) * s,
        nis=np.zeros(s) if nis is None else np.array(nis),
        hit=np.ones(s) if hit is None else np.array(hit),
    )


def still(times, x=0.0, y=0.0):
    return np.tile([x, y], (len(times), 1))


TEN = np.arange(10.0)
BOAT = path("boat", TEN, still(TEN))


def test_a_perfect_track():
    score = judge([history(7, TEN, still(TEN))], [BOAT], looks(TEN), Judge())
    zeros = (score.position_rmse_m, score.velocity_rmse_mps, score.gospa_m, score.gospa_all_m, score.ospa_m)
    assert zeros == (0, 0, 0, 0, 0)
    assert (score.coverage, score.id_switches, score.false_tracks, score.lost) == (1, 0, 0, 0)
    assert (score.scans, score.tracks, score.confirmed_after_s, score.anees) == (10, 1, 0, 0)


def test_errors_over_covered_scans_by_hand():
    xy = still(TEN, 3, 4)
    xy[6:] = [300, 400]
    cov = np.diag([4.0, 16.0, 1.0, 4.0])
    track = history(1, TEN, xy, v=(1, 2), cov=cov)
    score = judge([track], [BOAT], looks(TEN), Judge(cover_radius=10, lost_scans=4, gospa_cutoff=10))
    assert score.position_rmse_m == pytest.approx(5)
    assert score.velocity_rmse_mps == pytest.approx(np.sqrt(5))
    assert score.bias_m == pytest.approx((3, 4))
    assert score.anees == pytest.approx(9 / 4 + 16 / 16)
    assert score.anees_state == pytest.approx(9 / 4 + 16 / 16 + 1 + 1)
    assert score.anees_state_axes == ("x", "y", "vx", "vy")
    assert score.coverage == pytest.approx(0.6)
    assert score.lost == 1
    assert score.false_tracks == pytest.approx(0.4)
    assert score.gospa_m == pytest.approx((6 * 5 + 4 * 10) / 10)
    assert score.gospa_localisation == pytest.approx(6 * 25 / 10)
    assert score.gospa_missed == pytest.approx(score.gospa_false)
    assert score.gospa_missed == pytest.approx(4 * 50 / 10)
    assert score.ospa_m == pytest.approx((6 * 5 + 4 * 10) / 10)


def test_the_radius_of_a_loss_may_differ_from_that_of_coverage():
    track = history(1, TEN, still(TEN, 8))
    assert judge([track], [BOAT], looks(TEN), Judge(cover_radius=5)).lost == 1
    held = judge([track], [BOAT], looks(TEN), Judge(cover_radius=5, lost_error=9))
    assert (held.coverage, held.lost) == (0, 0)


def test_a_known_offset_is_removed():
    track = history(1, TEN, still(TEN, -4, 8))
    score = judge([track], [BOAT], looks(TEN), Judge(offset=[-4, 8], cover_radius=1))
    assert (score.coverage, score.position_rmse_m, score.gospa_m, score.anees) == (1, 0, 0, 0)
    assert np.array_equal(track.mean[:, :2], still(TEN, -4, 8))


def test_a_switch_is_counted_across_a_gap():
    first, second = history(1, TEN[:4], still(TEN[:4])), history(5, TEN[6:], still(TEN[6:]))
    score = judge([first, second], [BOAT], looks(TEN), Judge())
    assert (score.id_switches, score.coverage, score.lost, score.tracks) == (1, 0.8, 0, 2)


def test_false_tracks_and_far_ones():
    """One good track, one beside it on the same boat, one near, one far; one tentative that never counts."""
    tracks = [
        history(0, TEN, still(TEN)),
        history(1, TEN, still(TEN, 2)),
        history(2, TEN[:5], still(TEN[:5], 60)),
        history(3, TEN, still(TEN, 500)),
        history(4, TEN, still(TEN), confirmed=np.zeros(10)),
    ]
    near = judge(tracks, [BOAT], looks(TEN), Judge(cover_radius=10, near=100, far=100, gospa_cutoff=20))
    every = judge(tracks, [BOAT], looks(TEN), Judge(cover_radius=10, gospa_cutoff=20))
    assert near.false_tracks == pytest.approx(1.5)
    assert every.false_tracks == pytest.approx(2.5)
    assert near.tracks == 4
    assert near.gospa_m == pytest.approx((20 + np.sqrt(200)) / 2)
    assert near.gospa_all_m == pytest.approx((np.sqrt(600) + 20) / 2)
    assert every.gospa_m == every.gospa_all_m == pytest.approx(near.gospa_all_m)
    assert near.gospa_false == pytest.approx(1.5 * 200)


def test_only_confirmed_scans_count_and_the_wait_is_told():
    track = history(1, TEN, still(TEN), confirmed=TEN >= 3)
    score = judge([track], [BOAT], looks(TEN), Judge(lost_scans=2))
    assert score.coverage == pytest.approx(0.7)
    assert (score.confirmed_after_s, score.lost) == (3, 0)


def test_figures_per_truth_and_their_means():
    other = path("other", TEN[5:], still(TEN[5:], 100))
    tracks = [history(1, TEN, still(TEN, 1)), history(2, TEN[8:], still(TEN[8:], 103))]
    score = judge(tracks, [BOAT, other, path("never", [50.0, 60.0], still([0, 0]))], looks(TEN), Judge(lost_scans=3))
    boat, late, never = score.truths
    assert (boat.name, boat.scans, boat.coverage, boat.position_rmse_m, boat.lost) == ("boat", 10, 1, 1, False)
    assert (late.scans, late.coverage, late.position_rmse_m, late.confirmed_after_s) == (5, 0.4, 3, 3)
    assert (never.scans, never.coverage, never.lost, never.position_rmse_m) == (0, None, None, None)
    assert score.coverage == pytest.approx(0.7)
    assert score.confirmed_after_s == pytest.approx(1.5)
    assert score.position_rmse_m == pytest.approx(np.sqrt((10 * 1 + 2 * 9) / 12))


def test_an_object_that_is_not_there_is_neither_missed_nor_near():
    short = path("short", TEN[2:5], still(TEN[2:5]))
    score = judge(
        [history(1, TEN, still(TEN))], [short, path("far", TEN, still(TEN, 900))], looks(TEN), Judge(near=50, far=50)
    )
    assert score.truths[0].scans == 3
    assert score.truths[0].coverage == 1
    assert score.false_tracks == 0
    assert score.gospa_m == pytest.approx(50 / np.sqrt(2))
    assert score.gospa_all_m == pytest.approx((3 * 50 / np.sqrt(2) + 7 * 50) / 10)


def test_scans_without_any_truth_recorded_are_not_judged():
    """Before the first and after the last; a gap within counts as an empty scene."""
    parts = [path("a", TEN[2:4], still(TEN[2:4])), path("b", TEN[6:8], still(TEN[6:8]))]
    score = judge([history(1, TEN, still(TEN))], parts, looks(TEN), Judge())
    assert score.scans == 6
    assert score.false_tracks == pytest.approx(2 / 6)
    assert score.gospa_false == pytest.approx(2 / 6 * 50**2 / 2)


def test_a_window_of_one_sensors_scans():
    """Lidar scans lie between the radar's and at their times; after the radar the track is right, after the lidar wrong."""
    scans = sorted(looks(TEN) + looks(np.arange(0.0, 10.0, 0.5), "lidar"), key=lambda scan: scan.time)
    times = np.array([scan.time for scan in scans])
    xy = np.array([[0.0 if scan.sensor == "radar" else 30.0, 0.0] for scan in scans])
    track = history(1, times, xy)
    radar = judge([track], [BOAT], scans, Judge(sensor="radar", first_scan=2, last_scan=6))
    lidar = judge([track], [BOAT], scans, Judge(sensor="lidar"))
    assert (radar.scans, radar.position_rmse_m) == (5, 0)
    assert (lidar.scans, lidar.position_rmse_m) == (19, pytest.approx(30))


def test_tracks_that_start_or_end_between_scans_of_one_time():
    """Three scans at each time. The first track starts at the last scan of time 1; the other ends at the first of it."""
    times = np.repeat([0.0, 1.0, 2.0], 3)
    late = history(1, times[5:], still(times[5:]))
    early = history(2, times[:4], still(times[:4]))
    truth = [path("boat", [0.0, 2.0], still([0, 2]))]
    assert judge([late], truth, looks(times), Judge(first_scan=4, last_scan=4)).coverage == 0
    assert judge([late], truth, looks(times), Judge(first_scan=5)).coverage == 1
    assert judge([early], truth, looks(times), Judge(last_scan=3)).coverage == 1
    assert judge([early], truth, looks(times), Judge(first_scan=4)).coverage == 0


def test_nis_by_hand():
    """Starts (NIS 0) and tentative scans are left out; axes are those of each scan; the gate's share is allowed for."""
    scans = looks(TEN[:2]) + looks(TEN[2:4], "camera", axes=1)
    track = history(1, TEN[:4], still(TEN[:4]), nis=[0.0, 3.0, 0.5, 2.0], hit=[1.0, 1.0, 0.5, 1.0])
    tentative = evolve(track, confirmed=np.array([True, False, False, False]))
    assert judge([track], [], scans, Judge()).nis == pytest.approx(5.5 / 3.5)
    assert judge([track], [], scans, Judge(sensor="camera")).nis == pytest.approx(2.5 / 1.5)
    assert judge([tentative], [], scans, Judge()).nis is None
    assert judge([track], [], scans, Judge(sensor="radar"), 0.9).nis > 3.0 / 2.0


def test_mode_probabilities_over_covered_scans():
    modes = np.array([[0.9, 0.1]] * 5 + [[0.5, 0.5]] * 5)
    xy = still(TEN)
    xy[5:] = 1e4
    score = judge([history(1, TEN, xy, mode_prob=modes)], [BOAT], looks(TEN), Judge())
    assert score.mode_prob == pytest.approx((0.9, 0.1))


@given(st.permutations(range(3)), st.permutations(range(2)), st.integers(0, 2**32 - 1).map(np.random.default_rng))
@settings(derandomize=True, max_examples=40, deadline=None)
def test_the_order_of_tracks_and_truths_and_the_origin_change_nothing(order, names, rng):
    truth = [path(f"t{i}", TEN, np.cumsum(rng.normal(size=(10, 2)), axis=0) + np.array([4.0 * i, 0.0])) for i in range(2)]
    tracks = []
    for i in range(3):
        begin, end = sorted(rng.choice(11, 2, replace=False))
        xy = truth[i % 2].states[begin:end, :2] + rng.normal(size=(end - begin, 2))
        tracks.append(history(i, TEN[begin:end], xy, nis=rng.uniform(size=end - begin)))
    options = Judge(cover_radius=3, gospa_cutoff=4, near=5, far=5, lost_error=2)
    score = judge(tracks, truth, looks(TEN), options)
    shuffled = judge([tracks[i] for i in order], [truth[i] for i in names], looks(TEN), options)
    move = np.array([64.0, -32.0, 0.0, 0.0])
    moved = judge(
        [evolve(track, mean=track.mean + move) for track in tracks],
        [evolve(trajectory, states=trajectory.states + move) for trajectory in truth],
        looks(TEN),
        options,
    )
    for other in (shuffled, moved):
        for name in (
            "position_rmse_m",
            "coverage",
            "id_switches",
            "false_tracks",
            "lost",
            "gospa_m",
            "gospa_all_m",
            "anees",
            "nis",
        ):
            assert getattr(other, name) == pytest.approx(getattr(score, name), rel=1e-9), name


# Where a figure does not exist


@pytest.mark.parametrize("truth", [[], [BOAT], [path("later", [99.0, 100.0], still([0, 1]))]], ids=["none", "boat", "later"])
@pytest.mark.parametrize("tracks", [[], [history(1, TEN, still(TEN))], [history(1, TEN, still(TEN), confirmed=TEN < 0)]])
@pytest.mark.parametrize("options", [Judge(), Judge(sensor="nobody"), Judge(first_scan=99), Judge(far=1, near=1)])
def test_what_does_not_exist_is_none_and_json_takes_the_rest(tracks, truth, options):
    score = judge(tracks, truth, looks(TEN), options)
    figures = json.loads(json.dumps(score.figures(), allow_nan=False))
    assert figures["tracks"] == sum(bool(track.confirmed.any()) for track in tracks)
    judged = bool(truth) and truth[0] is BOAT and bool(options.choose(looks(TEN)).size)
    for name in ("coverage", "lost", "gospa_m", "gospa_all_m", "ospa_m", "false_tracks", "id_switches"):
        assert (figures[name] is not None) == judged
    for name in ("position_rmse_m", "velocity_rmse_mps", "bias_m", "anees", "anees_state"):
        assert (figures[name] is not None) == (judged and figures["tracks"] == 1)


def test_no_scans_no_tracks():
    for truth in ([], [BOAT], [path("nothing", [], np.zeros((0, 2)))]):
        score = judge([], truth, [], Judge())
        assert (score.scans, score.tracks, score.coverage, score.gospa_m) == (0, 0, None, None)


def test_no_track_at_all_misses_every_truth():
    score = judge([], [BOAT], looks(TEN), Judge(gospa_cutoff=10))
    assert (score.coverage, score.lost, score.false_tracks, score.id_switches) == (0, 1, 0, 0)
    assert score.gospa_m == pytest.approx(10 / np.sqrt(2))


def test_a_singular_covariance_has_no_nees():
    cov = np.eye(4)
    cov[2:, 2:] = 1.0
    score = judge([history(1, TEN, still(TEN), cov=cov)], [BOAT], looks(TEN), Judge())
    assert (score.anees, score.anees_state) == (0, None)


def test_a_truth_of_positions_alone_gives_no_velocity_error():
    bare = Trajectory("boat", Space.of(x="m", y="m", z="m"), TEN, np.zeros((10, 3)))
    score = judge([history(1, TEN, still(TEN, 3))], [bare], looks(TEN), Judge())
    assert (score.position_rmse_m, score.velocity_rmse_mps, score.anees_state_axes) == (3, None, ("x", "y"))


# Input that is wrong


def test_truth_without_a_shared_position_is_refused():
    with pytest.raises(
        InputError, match=r"^truth 'boat': must have a position axis x, y or z of the tracks, has \(range \[m\]\)"
    ):
        judge(
            [history(1, TEN, still(TEN))],
            [Trajectory("boat", Space.of(range="m"), TEN, np.zeros((10, 1)))],
            looks(TEN),
            Judge(),
        )


def test_truth_in_another_unit_is_refused():
    pixels = Trajectory("bird", Space.of(x="px", y="px"), TEN, np.zeros((10, 2)))
    with pytest.raises(InputError, match=r"^truth 'bird': axis x \[px\] is x \[m\] elsewhere"):
        judge([history(1, TEN, still(TEN))], [pixels], looks(TEN), Judge())


def test_a_track_at_a_time_without_a_scan_is_refused():
    with pytest.raises(InputError, match=r"^tracks: track 3 has an entry at 4.500000 s, when there is no scan"):
        judge([history(3, [4.0, 4.5], still([4, 4.5]))], [BOAT], looks(TEN), Judge())


@pytest.mark.parametrize(
    ("options", "message"),
    [
        ({"cover_radius": 0}, r"^cover_radius: must be > 0, got 0 m"),
        ({"gospa_order": 0.5}, r"^gospa_order: must be >= 1 and <= 10, got 0.5"),
        ({"offset": [1.0]}, r"^offset: must be \[x, y\], got 1 numbers"),
        ({"far": -1}, r"^far: must be > 0, got -1 m"),
        ({"first_scan": 5, "last_scan": 3}, r"^last_scan: must be >= first_scan \(5\), got 3"),
        ({"lost_scans": 2.5}, r"^lost_scans: must be a whole number, got 2.5"),
    ],
)
def test_a_judge_that_cannot_be_is_refused(options, message):
    with pytest.raises(ValueError, match=message):
        Judge(**options)


# Truth at scans


@given(
    st.lists(st.floats(0, 10), min_size=1, max_size=6, unique=True).map(sorted),
    st.lists(st.floats(-1, 11), max_size=8).map(sorted),
    st.integers(0, 2**32 - 1).map(np.random.default_rng),
)
@law
def test_truth_at_all_scans_is_truth_at_each(known, times, rng):
    space = Space.of(heading="rad mod 2pi", x="m")
    trajectory = Trajectory("boat", space, np.array(known), rng.uniform(-3, 3, size=(len(known), 2)))
    times = np.array([*times, *known])
    real = truth_at([trajectory], times, None)
    for i, time in enumerate(times):
        expected = trajectory.at(float(time))
        assert real.alive[i, 0] == (expected is not None)
        if expected is not None:
            assert np.allclose(space.difference(real.states[i, 0], expected), 0, atol=1e-9)
