"""Smoothing while a run goes: what it says is what is said afterwards, it is there on the way, and it keeps little."""

import json

import numpy as np
import pytest

import vedette
from support.ships import AROUND, RADAR, radar_and_beacon
from vedette.cli import main
from vedette.tracking import smoothed
from vedette_files import read_series, read_tracks
from vedette_report.running import lagging
from vedette_report.running.lagging import FixedLag
from vedette_report.running.streaming import stream
from vedette_report.series import recorder as series

LAG = 5.0
CONFIG = radar_and_beacon(
    {
        "one": {"start": [0.0, 0.0], "speed": 5.0},
        "two": {"start": [300.0, -200.0], "speed": 8.0, "appears": 20.0, "disappears": 45.0},
    },
    duration=60.0,
    radar=RADAR | {"detection_probability": 0.9},
    looks={"radar": AROUND, "beacon": {"interval": 2.0}},
    title="Ships that come and go",
    seed=3,
)
KINDS = {"jpda": {}, "k_best": {"lifecycle": {"kind": "existence"}, "associator": {"kind": "k_best"}}}


def ran(kind):
    experiment = vedette.load(CONFIG | KINDS[kind])
    return experiment, [state for _, state in experiment.steps()]


@pytest.mark.parametrize("kind", KINDS)
@pytest.mark.by_turns
def test_states_come_back_as_soon_as_a_later_one_is_beyond_the_lag(kind):
    experiment, states = ran(kind)
    lagged, out, most = FixedLag(experiment.tracker, LAG, experiment.seed), [], 0
    for state in states:
        out += lagged.push(state)
        most = max(most, len(lagged._window))
        assert all(each.time + LAG < state.time for each in out)
        assert len(out) == sum(each.time + LAG < state.time for each in states)
    assert most <= 1 + max(sum(t.time <= s.time <= t.time + LAG for s in states) for t in states)
    out += lagged.finish()
    wanted = list(smoothed(experiment.tracker, states, LAG, experiment.seed))
    assert len(out) == len(wanted) == len(states)
    for told, of in zip(out, wanted, strict=True):
        assert told.time == of.time
        np.testing.assert_array_equal(told.ids, of.ids)
        estimates = [experiment.tracker.estimate(each) for each in (told, of)]
        np.testing.assert_array_equal(estimates[0].mean, estimates[1].mean)
        np.testing.assert_array_equal(estimates[0].cov, estimates[1].cov)


@pytest.fixture(scope="module", params=KINDS)
def both(request, tmp_path_factory):
    """One run that keeps all and smooths at its end, and the same smoothed as it goes, in many small pieces."""
    folder = tmp_path_factory.mktemp("runs")
    (folder / "config.json").write_text(json.dumps(CONFIG | KINDS[request.param]))
    given = [str(folder / "config.json"), "--smooth", f"{LAG} s", "--out"]
    assert main(["run", *given, str(folder / "kept")]) == 0
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(series, "SCANS", 7)
        assert main(["run", *given, str(folder / "streamed"), "--stream"]) == 0
    return folder / "kept", folder / "streamed"


@pytest.mark.costly
def test_the_lines_and_figures_are_those_of_a_run_that_keeps_all(both):
    kept, streamed = both
    for name in ("smoothed.csv", "smoothed.jsonl", "tracks.csv"):
        wanted, found = ((folder / name).read_text().splitlines() for folder in both)
        assert sorted(found) == sorted(wanted)
    figures = [json.loads((folder / "summary.json").read_text())["smoothed"] for folder in both]
    assert figures[1]["lag_s"] == LAG
    for name, value in figures[0].items():
        assert figures[1][name] == pytest.approx(value, rel=1e-9)
    assert "up to 5 s later" in (streamed / "summary.txt").read_text()
    tables = [read_series(folder / "smoothed.npz").tables["entries"] for folder in both]
    ever = np.unique(tables[0]["track"][tables[0]["confirmed"]])  # a kept run leaves tentative tracks the filter's
    means = [table["mean"][np.isin(table["track"], ever)] for table in tables]
    np.testing.assert_array_equal(*means)
    assert (kept / "tracks.geojson").exists() == (streamed / "tracks.geojson").exists()


@pytest.mark.costly
def test_what_is_smoothed_is_there_while_the_run_goes(tmp_path, monkeypatch):
    monkeypatch.setattr(series, "SCANS", 4)
    seen = []

    def look(scan, *_):
        for path in [path for path in tmp_path.rglob("smoothed.jsonl") if path.stat().st_size]:
            times = [time for track in read_tracks(path) for time in track.times.tolist()]
            seen.append((scan.time, max(times, default=-np.inf)))

    experiment = vedette.load(CONFIG)
    stream(experiment, tmp_path / "out", shown=look, lag=LAG)
    behind = [now - then for now, then in seen if np.isfinite(then)]
    assert len(behind) > 10
    assert min(behind) > LAG


@pytest.mark.costly
def test_a_lag_that_waits_for_the_end_is_found(tmp_path, monkeypatch):
    """The mutant of the test above: nothing is told before the end."""
    own = FixedLag.push
    monkeypatch.setattr(lagging.FixedLag, "push", lambda self, state: [own(self, state), []][1])
    with pytest.raises(AssertionError):
        test_what_is_smoothed_is_there_while_the_run_goes(tmp_path, monkeypatch)


def test_all_later_scans_are_refused_where_nothing_is_kept(tmp_path, capsys):
    path = tmp_path / "config.json"
    path.write_text(json.dumps(CONFIG))
    assert main(["run", str(path), "--stream", "--smooth", "--out", str(tmp_path / "out")]) == 2
    assert "--stream:" in capsys.readouterr().err
