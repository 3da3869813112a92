"""A run that writes as it goes: the lines of one that keeps all, and memory that does not grow."""

import gc
import json
import tracemalloc

import numpy as np
import pytest
from attrs import evolve, frozen

import vedette
from support import registration, results
from support.ships import AROUND, RADAR, radar_and_beacon
from vedette import Detections, LazyScans, Recording, Scan, Source
from vedette.cli import main
from vedette.tracking import History
from vedette_files import SeriesTracks, read_recording, read_tracks
from vedette_report.running.streaming import estimates, stream
from vedette_report.series import recorder as series
from vedette_report.series.rows import ScanRows

MODES = [{"kind": "kalman", "motion": {"kind": "constant_velocity", "sigma_accel": s}} for s in (0.1, 1.0)]
CONFIG = radar_and_beacon(
    {
        "one": {"start": [0.0, 0.0], "speed": 5.0},
        "two": {"start": [300.0, -200.0], "speed": 8.0, "appears": 30.0, "disappears": 70.0},
    },
    duration=120.0,
    radar=RADAR | {"detection_probability": 0.9},
    looks={"radar": AROUND, "beacon": {"interval": 2.0}},
    title="Ships that come and go",
    seed=3,
    estimator={"kind": "imm", "modes": MODES, "transition": [[0.95, 0.05], [0.05, 0.95]]},
)


@pytest.fixture(scope="module")
def both(tmp_path_factory):
    """One run that keeps all, and the same with its results written as it goes, in many small pieces."""
    folder = tmp_path_factory.mktemp("runs")
    (folder / "config.json").write_text(json.dumps(CONFIG))
    assert main(["run", str(folder / "config.json"), "--out", str(folder / "kept")]) == 0
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(series, "SCANS", 7)
        assert main(["run", str(folder / "config.json"), "--out", str(folder / "streamed"), "--stream"]) == 0
    return folder / "kept", folder / "streamed"


@pytest.mark.costly
def test_the_lines_are_those_of_a_run_that_keeps_all(both):
    kept, streamed = both
    for name in ("tracks.csv", "tracks.jsonl"):
        wanted, found = ((folder / name).read_text().splitlines() for folder in both)
        assert found[0] == wanted[0]
        assert sorted(found) == sorted(wanted)
        assert found != wanted, "written track by track, so it was kept"
    for name in ("recording.jsonl", "config.json"):
        assert (streamed / name).read_bytes() == (kept / name).read_bytes()


@pytest.mark.costly
def test_the_tracks_read_back_as_they_were(both):
    wanted, found = ({track.id: track for track in read_tracks(folder / "tracks.jsonl")} for folder in both)
    assert sorted(found) == sorted(wanted)
    for number, track in wanted.items():
        np.testing.assert_array_equal(found[number].times, track.times)
        np.testing.assert_array_equal(found[number].mean, track.mean)
        np.testing.assert_array_equal(found[number].confirmed, track.confirmed)


@pytest.mark.costly
def test_the_figures_are_those_of_a_run_that_keeps_all(both):
    wanted, found = (json.loads((folder / "summary.json").read_text()) for folder in both)
    assert (found, list(found)) == (wanted, list(wanted))
    assert wanted["hota"] > 0.5
    kept, streamed = ((folder / "summary.txt").read_text() for folder in both)
    before, _, after = kept.partition("Confirmed tracks: ")  # a table made of their histories
    assert streamed == before + after.partition("\n\n")[2]


@pytest.mark.costly
def test_a_run_that_may_not_keep_enough_tells_so(tmp_path, monkeypatch):
    monkeypatch.setattr(series, "_KEPT", 100)
    done = stream(vedette.load(CONFIG), tmp_path)
    assert (done.score.hota, done.score.ospa2_m) == (None, None)
    assert done.score.gospa_m is not None
    (told,) = (line for line in done.text.splitlines() if "whole tracks" in line)
    assert "left out" in told


@pytest.mark.costly
def test_steps_are_the_run(both):
    experiment = vedette.load(CONFIG)
    result = experiment.run()
    pairs = list(experiment.steps())
    assert [scan.time for scan, _ in pairs] == [scan.time for scan in result.scans]
    last = pairs[-1][1]
    alive = {track.id: track for track in result.tracks if track.times[-1] == last.time}
    for number, mean in zip(last.ids.tolist(), experiment.tracker.estimate(last).mean, strict=True):
        if number in alive:
            np.testing.assert_array_equal(alive[number].mean[-1], mean)


def test_an_interrupted_run_leaves_what_it_had_done(tmp_path):
    def broken_off(scans, about):
        for i, scan in enumerate(scans):
            if i == 50:
                raise KeyboardInterrupt
            yield scan

    done = stream(vedette.load(CONFIG), tmp_path, progress=broken_off)
    assert done.result.interrupted
    assert len(read_recording(tmp_path / "recording.jsonl")[0].scans) == done.figures["scans_taken"] == 50
    assert "interrupted" in done.text


def test_streaming_and_smoothing_exclude_each_other(tmp_path, capsys):
    (tmp_path / "config.json").write_text(json.dumps(CONFIG))
    assert main(["run", str(tmp_path / "config.json"), "--stream", "--smooth"]) == 2
    assert "--stream: keeps nothing of the past" in capsys.readouterr().err


@frozen
class Traffic(Source):
    """A stream of scans without end, made when it is asked for: ships that come and go, 40 scans each, and clutter."""

    kind = "traffic"

    def open(self, sensors, rng):
        def make(i):
            dice = np.random.default_rng([7, i])
            there = [[100.0 * ship, 8.0 * (i - 20 * ship)] for ship in range(max(i // 20 - 1, 0), i // 20 + 1)]
            return Scan(float(i), "radar", Detections.of(dice.normal(there, 3.0)))

        return Recording(LazyScans(10**6, make))


@pytest.mark.costly
def test_memory_is_flat_and_no_id_comes_twice():
    """Over 4 times the scans the memory of a run does not grow; one that keeps all grows by far more than is allowed."""
    experiment = vedette.load({name: value for name, value in CONFIG.items() if name != "source"})
    experiment = evolve(experiment, source=Traffic())

    def grown(keep):
        steps, entries = experiment.steps(), 0
        rows_of, pieces = ScanRows(experiment, steps.recording), SeriesTracks(experiment.tracker.state)
        history, used, seen = History(experiment.tracker), [], {}
        for i, (scan, state) in enumerate(steps):
            told = history.add(state) if keep else estimates(experiment.tracker, state)
            if not keep:
                rows = rows_of.of(scan, steps.before, state, *told)
                for table in ("entries", "splits", "merges"):
                    rows[table]["scan"] += i
                for table in ("weights", "below"):
                    rows[table]["entry"] += entries
                entries += len(state.ids)
                pieces.add(rows)
                for track in pieces.hand_out().tracks() if i % 20 == 0 else ():
                    seen.setdefault(track.id, []).extend(track.times.tolist())
            if i in (150, 600):
                gc.collect()
                used.append(tracemalloc.get_traced_memory()[0] - sum(56 * len(times) for times in seen.values()))
            if i == 600:
                break
        return used[1] - used[0], seen

    tracemalloc.start()
    try:
        (flat, seen), (kept, _) = grown(keep=False), grown(keep=True)
    finally:
        tracemalloc.stop()
    assert flat < 20_000 < 150_000 < kept
    assert len(seen) > 20
    for times in seen.values():
        assert np.all(np.diff(times) == 1.0), "an id that was used again, or a moment told twice"
        assert len(times) < 60


@pytest.mark.costly
def test_a_radar_that_is_turned_is_told_of(tmp_path):
    drawn = {"kind": "displaced", "of": registration.RADAR, "add": {"bearing": 0.05}}
    looks = {"radar": {"interval": 2.5, "clutter": registration.CLUTTER}}
    told = vedette.load(registration.config({"radar": registration.RADAR}, looks, {"radar": drawn}, {}, []))
    text = " ".join(stream(told, tmp_path).text.split())
    assert "radar: its returns lie +2.9 +- 0.1 degrees in bearing from 6 targets" in text


def test_what_tracks_took_is_not_called_false_where_tracks_are_not_kept(tmp_path):
    """Of every run with `--stream` it was said that its clutter was too low: a return of two ships a scan."""
    assert "LOOKS WRONG" not in stream(vedette.load(results.config()), tmp_path / "out").text
