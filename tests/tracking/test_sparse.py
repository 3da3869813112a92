"""Many tracks and returns: taken by pairs within gates, a scan gives what it gives when all pairs are worked on."""

import attrs
import numpy as np
import pytest

import vedette
from vedette import Detections, Scan
from vedette.errors import ScanRefused
from vedette.tracking import association, births, clusters, memory_limits
from vedette.tracking.history import History
from vedette_files.tracks.text import read_tracks, write_tracks_jsonl

RADAR = {"kind": "cartesian_position", "sigma": 5.0, "detection_probability": 0.9, "clutter_density": 4e-5}
TURNING = {"kind": "range_bearing", "sigma_range": 5.0, "sigma_bearing": "0.2 deg", "detection_probability": 0.9}
KALMAN = {"kind": "kalman", "motion": {"kind": "constant_velocity", "sigma_accel": 0.5}}
IMM = {
    "kind": "imm",
    "modes": [KALMAN, {"kind": "ekf", "motion": {"kind": "coordinated_turn", "sigma_accel": 0.5, "sigma_turn_rate": 0.02}}],
    "transition": [[0.9, 0.1], [0.1, 0.9]],
}
BIRTH = {"kind": "from_returns", "spread": {"vx": 10.0, "vy": 10.0}}
POISSON = {
    "kind": "poisson",
    "appear": [
        {"at": {"x": [400.0, 300.0], "y": [400.0, 300.0], "vx": [0.0, 10.0], "vy": [0.0, 10.0]}, "initial": 30, "rate": 1}
    ],
}


def scans(seed, count=6, targets=60, axes=2, polar=False):
    rng = np.random.default_rng(seed)
    place, speed = rng.uniform(0, 800, (targets, 2)), rng.normal(0, 10, (targets, 2))
    for i in range(count):
        seen = (place + i * speed)[rng.random(targets) < 0.9]
        z = np.concatenate([seen + rng.normal(0, 5, seen.shape), rng.uniform(0, 800, (rng.poisson(30), 2))])
        if polar:
            z = z - 400.0
            z = np.column_stack([np.hypot(z[:, 0], z[:, 1]), np.arctan2(z[:, 0], z[:, 1])])
        yield Scan(1.0 + i, "radar", Detections.of(rng.permutation(z)))


def dense_weights(state, k):
    """The weights of a state with one column a return."""
    if state.returns is None:
        return state.weights
    whole = np.zeros((len(state.ids), 1 + k))
    whole[:, 0] = state.weights[:, 0]
    rows, columns = np.nonzero(state.returns >= 0)
    whole[rows, 1 + state.returns[rows, columns]] = state.weights[rows, 1 + columns]
    return whole


def run(monkeypatch, config, given, least):
    monkeypatch.setattr(memory_limits, "LEAST_PAIRS", least)
    monkeypatch.setattr(births, "LEAST_PAIRS", least)
    tracker = vedette.build(config)
    state, states = tracker.start(seed=1), []
    history = History(tracker)
    for scan in given:
        state = tracker.step(state, scan)
        states.append(state)
        history.add(state)
    return tracker, states, history.tracks()


def config(associator="gnn", estimator=KALMAN, radar=RADAR, birth=BIRTH, lifecycle="existence", **more):
    parts = {"estimator": estimator, "sensors": {"radar": radar}, "associator": {"kind": associator}, "birth": birth}
    return {**parts, "lifecycle": {"kind": lifecycle}, **more}


SCENES = {
    "gnn": (config(), False),
    "jpda": (config("jpda"), False),
    "pda shares returns": (config("pda"), False),
    "nearest": (config("nearest"), False),
    "m of n": (config("gnn", lifecycle="m_of_n"), False),
    "unknown clutter": (config("jpda", gate={"clutter": "nonparametric"}), False),
    "poisson": (config("jpda", birth=POISSON), False),
    "imm": (config("jpda", IMM, birth={**BIRTH, "spread": {"vx": 10.0, "vy": 10.0, "turn_rate": 0.05}}), False),
    **{
        f"{kind}, bearings": (config("jpda", {**KALMAN, "kind": kind}, TURNING | {"clutter_density": 1e-2}), True)
        for kind in ("ekf", "ukf", "ckf", "srkf")
    },
}


@pytest.mark.parametrize("scene", SCENES)
def test_it_gives_what_all_pairs_give(monkeypatch, scene):
    parts, polar = SCENES[scene]
    given = list(scans(3, polar=polar, count=4 if scene == "imm" else 6))
    _, every, _ = run(monkeypatch, parts, given, 10**9)
    tracker, few, _ = run(monkeypatch, parts, given, 1)
    for scan, dense, state in zip(given, every, few, strict=True):
        k = len(scan.detections.z)
        assert state.returns is not None
        assert dense.returns is None
        assert state.weights.shape[1] < 1 + k
        np.testing.assert_array_equal(state.ids, dense.ids)
        np.testing.assert_array_equal(state.confirmed, dense.confirmed)
        for name in ("existence", "hit", "nis"):
            np.testing.assert_allclose(getattr(state, name), getattr(dense, name), rtol=1e-9, atol=1e-10, err_msg=name)
        found, expected = tracker.estimate(state), tracker.estimate(dense)
        np.testing.assert_allclose(found.mean, expected.mean, rtol=1e-9, atol=1e-8)
        np.testing.assert_allclose(found.cov, expected.cov, rtol=1e-8, atol=1e-7)
        np.testing.assert_allclose(dense_weights(state, k), dense_weights(dense, k), atol=1e-10)
        assert (state.born, state.approximated, state.steps) == (dense.born, dense.approximated, dense.steps)
    assert len(few[-1].ids) > 40


def test_returns_that_do_not_count_and_evidence_and_noise_of_their_own(monkeypatch):
    """A target is where padding would be, at 0."""
    given = []
    for i, scan in enumerate(scans(5)):
        z, rng = np.concatenate([[[0.0, 0.0]], scan.detections.z - 400.0]), np.random.default_rng(i)
        valid, evidence = rng.random(len(z)) < np.where(np.arange(len(z)) > 0, 0.9, 1.0), rng.normal(size=len(z))
        noise = np.eye(2) * rng.uniform(4.0, 100.0, (len(z), 1, 1))
        given.append(Scan(scan.time, "radar", Detections(z, valid, evidence, noise)))
    _, every, _ = run(monkeypatch, config("jpda"), given, 10**9)
    tracker, few, _ = run(monkeypatch, config("jpda"), given, 1)
    for dense, state in zip(every, few, strict=True):
        np.testing.assert_array_equal(state.ids, dense.ids)
        np.testing.assert_allclose(tracker.estimate(state).mean, tracker.estimate(dense).mean, rtol=1e-9, atol=1e-8)


def test_tracks_and_their_files_say_which_returns_weights_are_of(monkeypatch, tmp_path):
    given = list(scans(7))
    _, _, tracks = run(monkeypatch, config(), given, 1)
    _, _, dense = run(monkeypatch, config(), given, 10**9)
    times = {scan.time: i for i, scan in enumerate(given)}
    for track, other in zip(tracks, dense, strict=True):
        assert other.returns is None
        for time, weights, returns, expected in zip(track.times, track.weights, track.returns, other.weights, strict=True):
            whole = np.zeros(1 + len(given[times[time]].detections.z))
            whole[0], whole[1 + returns] = weights[0], weights[1:]
            np.testing.assert_array_equal(whole, expected)
    write_tracks_jsonl(tmp_path / "tracks.jsonl", tracks, tracks[0].space)
    for track, again in zip(tracks, read_tracks(tmp_path / "tracks.jsonl"), strict=True):
        assert [row.tolist() for row in track.returns] == [row.tolist() for row in again.returns]


SOME = {"kind": "partial", "of": RADAR, "optional": {"y": 800.0}}


@pytest.mark.parametrize(
    ("kind", "lacks", "whole"), [("kalman", False, False), ("iekf", False, True), ("kalman", True, True)]
)
def test_what_it_is_not_made_for_is_worked_on_whole(monkeypatch, kind, lacks, whole):
    """A filter whose gates have no box, and a scan of which a return lacks a component."""
    monkeypatch.setattr(memory_limits, "LEAST_PAIRS", 1)
    tracker = vedette.build(config("gnn", {**KALMAN, "kind": kind}, SOME))
    first, second = scans(9, count=2)
    if lacks:
        missing = np.zeros(second.detections.z.shape, dtype=bool)
        missing[0, 1] = True
        second = attrs.evolve(second, detections=attrs.evolve(second.detections, missing=missing))
    state = tracker.step(tracker.step(tracker.start(seed=1), first), second)
    assert (state.returns is None) is whole


def test_too_many_pairs_within_gates_are_refused_and_nothing_is_lost(monkeypatch):
    given = list(scans(9, count=3))
    tracker, states, _ = run(monkeypatch, config(), given[:2], 1)
    monkeypatch.setattr(memory_limits, "MOST_PAIRS", 20)
    with pytest.raises(ScanRefused, match="make more than 20 pairs within"):
        tracker.step(states[-1], given[2])
    monkeypatch.undo()
    assert len(tracker.step(states[-1], given[2]).ids)


def test_a_cluster_that_is_too_large_is_refused_and_nothing_is_lost(monkeypatch):
    """Few pairs are within gates, but one cluster holds so many tracks and returns that its table is too large."""
    given, sizes = list(scans(9, count=5, targets=250)), []
    tracker, states, _ = run(monkeypatch, config("pda", gate={"largest_distance": 9.21}), given[:4], 1)
    real = clusters.check_clusters
    monkeypatch.setattr(clusters, "check_clusters", lambda *shape: sizes.append(int(np.prod(shape))))
    pairs = np.count_nonzero(tracker.step(states[-1], given[4]).gates.returns >= 0)
    assert max(sizes) > 3 * pairs
    monkeypatch.setattr(clusters, "check_clusters", real)
    monkeypatch.setattr(memory_limits, "MOST_PAIRS", max(sizes) - 1)
    with pytest.raises(ScanRefused, match="tracks hang together by the ") as caught:
        tracker.step(states[-1], given[4])
    assert "ends doubtful tracks sooner" in str(caught.value)
    monkeypatch.undo()
    assert len(tracker.step(states[-1], given[4]).ids)


def test_jpda_takes_the_same_cluster_without_a_table(monkeypatch):
    given = list(scans(9, count=5, targets=250))
    monkeypatch.setattr(clusters, "check_clusters", lambda *shape: pytest.fail(f"a table of {shape}"))
    _, states, _ = run(monkeypatch, config("jpda", lifecycle="m_of_n"), given, 1)
    monkeypatch.undo()
    _, every, _ = run(monkeypatch, config("jpda", lifecycle="m_of_n"), given, 10**9)
    assert states[-1].approximated == every[-1].approximated > 250
    np.testing.assert_allclose(states[-1].existence, every[-1].existence, rtol=1e-9)
    np.testing.assert_allclose(dense_weights(states[-1], len(given[-1].detections.z)), every[-1].weights, atol=1e-9)


def smaller_boxes(real):
    def extent(self, belief, sensor, detections, limit):
        return real(self, belief, sensor, detections, limit / 2.0)

    return extent


def test_the_comparison_bites(monkeypatch):
    from vedette_standard.estimators.kalman import Kalman

    monkeypatch.setattr(Kalman, "extent", smaller_boxes(Kalman.extent))
    with pytest.raises(AssertionError):
        test_it_gives_what_all_pairs_give(monkeypatch, "jpda")


def test_clusters_that_are_mixed_up_are_noticed(monkeypatch):
    real = association.by_cluster

    def swapped(*given):
        weights, *rest = real(*given)
        return weights[::-1].copy(), *rest

    monkeypatch.setattr(association, "by_cluster", swapped)
    with pytest.raises(AssertionError):
        test_it_gives_what_all_pairs_give(monkeypatch, "jpda")
