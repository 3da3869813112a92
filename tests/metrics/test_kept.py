"""Distances that do not fit into memory are made anew: the figures stay the same. How figures of whole tracks fit."""

import numpy as np
import pytest

import vedette
from support.paths import EXAMPLES
from vedette.metrics import judge
from vedette.metrics.kept import Remade, kept


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


def test_the_figures_are_the_same_bit_for_bit(fleet, monkeypatch):
    before = judged(fleet, far=200, ospa2_scans=5)
    monkeypatch.setattr("vedette.metrics.kept.MOST_KEPT", 0)
    assert judged(fleet, far=200, ospa2_scans=5) == before
    assert before.trajectory_gospa_m is not None


def test_they_are_made_only_beyond_the_limit_and_in_parts_too():
    made = []

    def make(i):
        made.append(i)
        return np.full(2, float(i))

    assert isinstance(kept(3, make, 6), tuple)
    assert made == [0, 1, 2]
    every = kept(5, make, 10**9)
    assert isinstance(every, Remade)
    assert made == [0, 1, 2]
    assert [each[0] for each in every[1:4][1:]] == [2.0, 3.0]
    assert every[-1][0] == 4.0


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
    assert judged(fleet, largest_program=0).trajectory_gospa_m is None
    assert judged(fleet, gospa_cutoff=20).hota < score.hota


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
