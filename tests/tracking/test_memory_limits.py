"""What a tracker takes at once: more pairs of tracks and returns than the stated number are refused, in words."""

from contextlib import nullcontext

import numpy as np
import pytest
from attrs import evolve, frozen

import vedette
from vedette import Axis, Detections, Scan, ScanRefused, Space
from vedette.experiment import Experiment
from vedette.tracking import memory_limits
from vedette.tracking.history import History
from vedette.tracking.plan import check_places

KALMAN = {"kind": "kalman", "motion": {"kind": "constant_velocity", "sigma_accel": 1.0}}
ESTIMATORS = {
    0: {**KALMAN, "kind": "iekf"},
    1: KALMAN,
    3: {"kind": "imm", "modes": [KALMAN] * 3, "transition": (np.full((3, 3), 0.05) + 0.85 * np.eye(3)).tolist()},
}


def tracker(parts):
    return vedette.build(_config(ESTIMATORS[parts]))


def _config(estimator):
    return {
        "estimator": estimator,
        "sensors": {"radar": {"kind": "cartesian_position", "sigma": 5.0, "clutter_density": 1e-6}},
        "associator": {"kind": "pda"},
        "birth": {"kind": "from_returns", "spread": {"vx": 10.0, "vy": 10.0}},
        "lifecycle": {"kind": "m_of_n"},
    }


def scan(time, count):
    spots = np.stack([np.arange(count) * 1000.0, np.zeros(count)], axis=-1)
    return Scan(float(time), "radar", Detections.of(spots, 2))


def test_a_hundred_thousand_returns_are_refused_and_nothing_is_lost():
    """By a filter that says nothing of where its gates lie: all its pairs are worked on."""
    built = tracker(0)
    state = built.step(built.start(), scan(0, 300))
    with pytest.raises(ScanRefused) as refused:
        built.step(state, scan(1, 100_000))
    told = str(refused.value)
    assert "300 tracks and 100,000 returns" in told
    assert "20,000,000 are taken" in told
    assert "birth" in told
    assert built.step(state, scan(1, 300)).ids.tolist() == list(range(300))


def test_a_hundred_thousand_returns_are_taken_by_pairs_within_gates():
    built = tracker(1)
    state = built.step(built.start(), scan(0, 3))
    assert len(built.step(state, scan(1, 100_000)).ids) == 100_000


@pytest.mark.parametrize("parts", [1, 3])
def test_the_limit_counts_tracks_modes_and_returns(parts, monkeypatch):
    built = tracker(parts)
    state = built.step(built.start(), scan(0, 80))
    monkeypatch.setattr(memory_limits, "MOST_PAIRS", 80 * 100 * parts)
    with pytest.raises(ScanRefused, match="would begin") if parts == 1 else nullcontext():
        built.step(state, scan(1, 100))
    with pytest.raises(ScanRefused, match=r"80 tracks.* and 101 returns make"):
        built.step(state, scan(1, 101))


def test_tracks_that_would_begin_count_too(monkeypatch):
    built = tracker(1)
    monkeypatch.setattr(memory_limits, "MOST_PAIRS", 100 * 100)
    assert len(built.step(built.start(), scan(0, 100)).ids) == 100
    with pytest.raises(ScanRefused, match=r"101 tracks that would begin at 101.*10,201"):
        built.step(built.start(), scan(0, 101))


def test_a_run_goes_on_without_a_scan_that_is_too_much(monkeypatch):
    monkeypatch.setattr(memory_limits, "MOST_PAIRS", 2_000)
    experiment = evolve(Experiment(tracker(0)), source=_Given())
    result = experiment.run()
    assert [scan.time for scan in result.scans] == [0.0, 1.0, 3.0, 4.0]
    (why,) = map(str, result.refused)
    assert why.startswith("scan 2, left out whole: ")
    assert len(result.tracks) == 5


@frozen
class _Given(vedette.Source):
    kind = "given"

    def open(self, sensors, rng):
        return vedette.Recording(tuple(scan(t, 500 if t == 2 else 5) for t in range(5)))


def test_the_particles_of_tracks_that_would_begin_count(monkeypatch):
    particles = {"kind": "bootstrap_particles", "motion": KALMAN["motion"], "particles": 200}
    built = vedette.build(_config(particles))
    monkeypatch.setattr(memory_limits, "MOST_STARTED", 60_000)
    state = built.step(built.start(seed=3), scan(0, 1150))
    assert len(state.ids) == 1150
    with pytest.raises(ScanRefused, match="1,210 tracks that would begin have 60,500"):
        built.step(built.start(seed=3), scan(0, 1210))
    monkeypatch.setattr("vedette.tracking.births.LEAST_STARTED", 10**9)
    np.testing.assert_array_equal(built.step(built.start(seed=3), scan(0, 1150)).belief.points, state.belief.points)


def test_leaves_count_where_a_tracker_keeps_hypotheses(monkeypatch):
    built = vedette.build(
        _config({**KALMAN, "kind": "ukf"})
        | {"associator": {"kind": "k_best"}, "lifecycle": {"kind": "existence", "delete": 1e-4}}
    )
    state = built.start()
    for time in range(3):
        state = built.step(state, scan(time, 12))
    leaves = len(state.leaves.ids)
    assert leaves > len(state.ids)
    monkeypatch.setattr(memory_limits, "MOST_PAIRS", leaves * 70 - 1)
    with pytest.raises(ScanRefused, match=rf"{leaves} leaves of tracks and 70 returns make"):
        built.step(state, scan(3, 70))


def test_a_spread_in_metres_needs_a_position_in_metres():
    life = tracker(1).lifecycle
    check_places(life, Space((Axis("u", "px"),)))
    with pytest.raises(ValueError, match=r"^lifecycle: .* as no axis"):
        check_places(evolve(life, max_spread=30.0), Space((Axis("u", "px"),)))


def test_histories_hold_the_rows_of_confirmed_tracks_alone():
    """Of a target among returns that come once each, and whose tracks are never confirmed."""
    made, rng = tracker(1), np.random.default_rng(35)
    history, state = History(made), made.start()
    for time in range(10):
        spots = np.vstack([[[5.0 * time, 0.0]], rng.uniform(1e4, 1e6, (30, 2))])
        state = made.step(state, Scan(float(time), "radar", Detections.of(spots)))
        history.add(state)
    (track,) = history.tracks()
    for column in (track.mean, track.cov, track.times):
        assert len(column if column.base is None else column.base) == len(track.times)
    assert all(each.base is None for each in track.weights)
