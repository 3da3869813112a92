"""A track's first scans count once it is confirmed, if the config says so; the estimates stay as they were."""

import csv
import json

import numpy as np
import pytest

import vedette
from support.paths import EXAMPLES
from vedette.cli import main
from vedette.metrics import judge
from vedette_files import read_tracks
from vedette_report.running.files import write_files
from vedette_report.running.smoothed import smooth_result
from vedette_report.running.streaming import stream
from vedette_report.series.recorder import recorded_run

HARBOUR = EXAMPLES / "harbour.toml"
ON = ["retroactive=true"]
SHORT = ["source.duration=60"]


def run(*overrides, **more):
    experiment = vedette.load(HARBOUR, overrides=[*SHORT, *overrides])
    return experiment, experiment.run(**more)


def write(folder, *overrides):
    """Write the files of a run; return its result."""
    experiment = vedette.load(HARBOUR, overrides=[*SHORT, *overrides])
    recorded = recorded_run(experiment, experiment.steps())
    write_files(folder, experiment, recorded, {}, "")
    return recorded.result


def figures(experiment, result):
    tracker = experiment.tracker
    truth, scans = result.recording.truth, result.scans
    return judge(result.tracks, truth, scans, experiment.judge, tracker.gate.probability, tracker.sensors)


DIPS = ["associator.kind=jpda", "lifecycle={ kind='existence', confirm=0.9, show=0.89, delete=0.01 }"]


@pytest.mark.parametrize("more", [[], DIPS, ["associator.kind=k_best", "lifecycle={ kind='existence' }"]])
def test_only_the_scans_before_the_confirmation_change(more):
    """What was estimated then stays, bit by bit; a confirmed track that is not shown for a while is not shown after all."""
    (_, before), (_, after) = run(*more), run(*more, *ON)
    assert len(before.tracks) == len(after.tracks) > 0
    early = 0
    for old, new in zip(before.tracks, after.tracks, strict=True):
        assert old.confirmed_at is None
        first = int(np.argmax(old.confirmed))
        assert new.confirmed[:first].all()
        np.testing.assert_array_equal(new.confirmed[first:], old.confirmed[first:])
        np.testing.assert_array_equal(new.confirmed_at[:first], old.times[first])
        np.testing.assert_array_equal(new.confirmed_at[first:], np.where(old.confirmed, old.times, np.nan)[first:])
        for name in ("times", "mean", "cov", "existence", "nis", "hit"):
            np.testing.assert_array_equal(getattr(new, name), getattr(old, name))
        early += first
    assert early > 0
    if more is DIPS:
        assert any(np.isnan(track.confirmed_at).any() for track in after.tracks)


def test_objects_are_covered_sooner():
    (given, before), (_, after) = run(), run(*ON)
    late, soon = figures(given, before), figures(given, after)
    assert soon.coverage > late.coverage
    assert soon.confirmed_after_s < late.confirmed_after_s


def test_files_say_when_a_scan_was_confirmed(tmp_path):
    result = write(tmp_path, *ON)
    for one, again in zip(result.tracks, read_tracks(tmp_path / "tracks.jsonl"), strict=True):
        np.testing.assert_array_equal(one.confirmed_at, again.confirmed_at)
        np.testing.assert_array_equal(one.confirmed, again.confirmed)
    rows = list(csv.DictReader((tmp_path / "tracks.csv").read_text().splitlines()))
    told = [float(row["confirmed_at"]) if row["confirmed_at"] else np.nan for row in rows]
    np.testing.assert_array_equal(told, np.concatenate([track.confirmed_at for track in result.tracks]))
    assert json.loads((tmp_path / "config.json").read_text())["retroactive"] is True
    write(tmp_path)
    assert not any("confirmed_at" in (tmp_path / name).read_text() for name in ("tracks.csv", "tracks.jsonl"))


def test_smoothed_tracks_count_from_the_same_scan():
    experiment = vedette.load(HARBOUR, overrides=[*SHORT, *ON])
    recorded = recorded_run(experiment, experiment.steps(), keep_states=True)
    smoothed = smooth_result(experiment, recorded, 10.0)
    for one, other in zip(recorded.result.tracks, smoothed.tracks, strict=True):
        np.testing.assert_array_equal(one.confirmed_at, other.confirmed_at)


def test_the_series_count_from_the_same_scan():
    """They are judged once, as the figures are: confirmed from the start, and paired with the truth from there."""
    experiment = vedette.load(HARBOUR, overrides=[*SHORT, *ON])
    recorded = recorded_run(experiment, experiment.steps())
    result, series = recorded.result, recorded.series()
    wanted = figures(experiment, result).figures()
    assert {name: value for name, value in recorded.judged.score.figures().items() if name in wanted} == wanted
    entries = series["entries"]
    for track in result.tracks:
        rows = entries["track"] == track.id
        np.testing.assert_array_equal(entries["confirmed"][rows], track.confirmed)
        np.testing.assert_array_equal(entries["confirmed_at"][rows], track.confirmed_at)
    errors = entries["position_error"][entries["object"] >= 0]
    assert np.sqrt(np.mean(errors**2)) == pytest.approx(recorded.judged.score.position_rmse_m, rel=1e-12)
    assert not entries["confirmed"][~np.isin(entries["track"], [track.id for track in result.tracks])].any()


def test_it_does_not_go_with_a_run_that_is_judged_as_it_goes(tmp_path, capsys):
    assert main(["run", str(HARBOUR), "--set", *ON, "--stream", "--out", str(tmp_path / "out")]) == 2
    assert "--stream: judges tracks as they go" in capsys.readouterr().err
    assert not (tmp_path / "out").exists()
    with pytest.raises(vedette.ConfigError, match="retroactive: must be false"):
        stream(vedette.load(HARBOUR, overrides=ON), tmp_path / "out")
