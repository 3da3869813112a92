"""The summary in words."""

import json
import re

import numpy as np
import pytest
from attrs import evolve

import vedette
from support.paths import EXAMPLES
from support.results import result, still, track
from vedette import metrics
from vedette_files import write_recording
from vedette_report.figures import figures
from vedette_report.summary.words import summary


def told(experiment, done):
    return summary(experiment, done, metrics.judge(done.tracks, done.recording.truth, done.scans, experiment.judge))


@pytest.mark.parametrize(
    ("variance", "verdict"),
    [
        (1.0, "the covariance fits the errors to within a factor of 2"),
        (0.1, "the covariance is 10 times too small for the errors"),
        (20.0, "the covariance is 20 times too large for the errors"),
    ],
)
def test_the_summary_says_how_nees_stands(variance, verdict, scene):
    done = result(
        [track(range(5), np.tile([1.0, 1.0, 0.0, 0.0], (5, 1)), variance * np.eye(4))],
        [still("buoy", [0, 9], (0.0, 0.0))],
        range(5),
    )
    text = told(scene[0], done)
    assert verdict in text
    ratios = dict(re.findall(r"^  (NEES of .*?)  +([\d.e+-]+)  ", text, re.MULTILINE))
    assert {name: float(ratio) for name, ratio in ratios.items()} == {
        "NEES of the position": pytest.approx(1 / variance, rel=0.01),
        "NEES of x, y, vx, vy": pytest.approx(0.5 / variance, rel=0.01),
    }


@pytest.mark.parametrize("ratio", [0.0, 1e-4])
@pytest.mark.by_turns
def test_data_without_noise_get_no_verdict(ratio, scene):
    """Neither on the errors nor on the innovations: no covariance can fit what is drawn without noise."""
    error = np.sqrt(ratio)
    done = result(
        [track(range(200), np.tile([error, error, 0.0, 0.0], (200, 1)), np.eye(4), nis=max(ratio, 1e-5))],
        [still("buoy", [0, 199], (0.0, 0.0))],
        range(200),
    )
    text = told(scene[0], done)
    assert text.count("not judged") == 2
    assert "times" not in text.split("Are the covariances right?")[1]


def test_frames_get_no_verdict_on_their_nis():
    experiment = vedette.load(EXAMPLES / "flir.toml", overrides=["source.frames=60"])
    done = experiment.run()
    score = done.score()
    words = summary(experiment, done, score)
    assert f"{score.nis:.3g}" in words
    assert "the innovations fit" not in words
    assert words.count("not judged") == 1


@pytest.mark.parametrize("truths", [0, 30])
@pytest.mark.by_turns
def test_a_brief_summary_fits_a_screen_and_a_whole_one_has_more(truths, scene):
    away = [(40.0 * k, 0.0) for k in range(30)]
    tracks = [track(range(20), np.tile([*place, 0.0, 0.0], (20, 1)), np.eye(4), number=k) for k, place in enumerate(away)]
    done = result(tracks, [still(f"buoy {k}", [0, 19], place) for k, place in enumerate(away[:truths])], range(20))
    score = metrics.judge(done.tracks, done.recording.truth, done.scans, scene[0].judge)
    brief, whole = (summary(scene[0], done, score, brief=short).splitlines() for short in (True, False))
    assert len(brief) <= 36 < len(whole)
    assert sum("1 is right" in line for line in whole) == 1


@pytest.mark.parametrize(
    ("nis", "verdict"),
    [
        (2.0, "the innovations fit the models"),
        (8.0, "the squared innovations are 4 times larger"),
        (0.2, "the squared innovations are 10 times smaller"),
        (1.7, "the squared innovations are 15 % smaller"),
    ],
)
def test_the_summary_says_how_nis_stands(nis, verdict, scene):
    done = result([track(range(200), np.zeros((200, 4)), np.eye(4), nis=nis)], times=range(200))
    assert verdict in " ".join(told(scene[0], done).split())


def test_the_summary_counts_and_names_what_was_read_and_refused(scene):
    refused = [vedette.Problem(f"line {i}", "is no good") for i in range(8)]
    text = told(scene[0], result(times=range(3), returns_per_scan=4, refused=refused, notes={"recording": "of 1999"}))
    assert "3 scans, 12 returns" in text
    assert "8 parts of the input left out" in text
    assert "line 4: is no good" in text
    assert "line 5: is no good" not in text
    assert "and 3 more" in text
    assert "recording: of 1999" in text


def test_what_was_read_and_not_used_whole_is_accounted_for(scene):
    experiment, done = scene[0], result(times=range(3))
    rows = {"detections": vedette.Rows(1_010, 1_007, 2, 1), "truth": vedette.Rows(1, 1, 0)}
    done = evolve(done, recording=evolve(done.recording, rows=rows))
    text = told(experiment, done)
    assert "detections: 1,007 of 1,010 rows used, 2 refused, 1 left out\n" in text
    assert "truth: " not in text
    found = figures(experiment, done, metrics.judge(done.tracks, done.recording.truth, done.scans, experiment.judge))
    assert found["rows"] == {"detections": {"total": 1_010, "used": 1_007, "refused": 2, "left_out": 1}}


def test_figures_hold_no_number_that_json_lacks(scene):
    experiment, done = scene
    score = metrics.judge(done.tracks, done.recording.truth, done.scans, experiment.judge)
    found = figures(experiment, done, evolve(score, nis=float("nan"), bias_m=(1.0, float("inf"))))
    assert found["nis"] is None
    assert found["bias_m"] == [1.0, None]
    assert json.loads(json.dumps(found, allow_nan=False)) == found


@pytest.mark.costly
def test_a_figure_that_would_cost_too_much_is_told():
    experiment = vedette.load(EXAMPLES / "fleet.toml", overrides=["judge.largest_program=1"])
    result = experiment.run()
    score = result.score()
    assert score.trajectory_gospa_m is None
    assert score.hota is not None
    (told,) = (line for line in summary(experiment, result, score).splitlines() if "whole tracks" in line)
    assert "largest_program" in told


def test_where_nobody_is_there_all_tracks_are_false_and_the_recording_says_so(tmp_path):
    area = {axis: {"low": 0.0, "high": 500.0} for axis in "xy"}
    scene = {"kind": "simulation", "duration": 59.0, "looks": {"radar": {"interval": 1.0, "clutter": area}}}
    tracker = {
        "estimator": {"kind": "kalman", "motion": {"kind": "constant_velocity", "sigma_accel": 1.0}},
        "sensors": {"radar": {"kind": "cartesian_position", "sigma": 20.0, "clutter_density": 4e-5}},
        "associator": {"kind": "gnn"},
        "birth": {"kind": "from_returns", "spread": {"vx": 30.0, "vy": 30.0}},
        "lifecycle": {"kind": "m_of_n", "hits": 2, "looks": 4},
    }
    path = tmp_path / "recording.jsonl"
    for source in (scene, {"kind": "jsonl", "path": str(path)}):
        experiment = vedette.load({**tracker, "source": source, "seed": 2})
        done = experiment.run()
        confirmed = sum(int(own.confirmed.sum()) for own in done.tracks)
        score = done.score()
        assert confirmed > 20
        assert score.false_tracks == pytest.approx(confirmed / 60)
        assert score.coverage is None
        assert "nobody" in summary(experiment, done, score)
        write_recording(path, done.recording, {"radar": experiment.tracker.sensors["radar"].measurement})
    assert evolve(done, recording=evolve(done.recording, nobody=False)).score().false_tracks is None
    text = path.read_text().replace('"truth": {}', '"truth": {"a": {"x": "m", "y": "m"}}', 1)
    path.write_text(text)
    with pytest.raises(vedette.InputError, match="nobody"):
        experiment.run()
