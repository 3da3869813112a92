"""The tracks of a run come from its series alone: whole, or piece by piece while it goes, to the last bit."""

import json
from io import BytesIO

import numpy as np
import pytest

import vedette
from support.paths import EXAMPLES
from support.results import config
from vedette.cli import main
from vedette.tracking import memory_limits
from vedette_files import SeriesTracks, TrackRows, chunks, read_series
from vedette_report.running.streaming import estimates
from vedette_report.running.track_files import TrackFiles
from vedette_report.series.recorder import Recorder

FLEET = ["source.duration=100"]
RUNS = {
    "two ships by an IMM": (config, []),
    "splits, merges and hypotheses": (EXAMPLES / "fleet.toml", [*FLEET, "associator={ kind='k_best' }"]),
    "splits and merges": (EXAMPLES / "fleet.toml", [*FLEET, "associator={ kind='gnn' }"]),
    "confirmed from the start": (EXAMPLES / "harbour.toml", ["source.duration=40", "retroactive=true"]),
    "frames": (EXAMPLES / "flir.toml", ["source.frames=20"]),
}


def opened(name):
    given, overrides = RUNS[name]
    return vedette.load(given if not callable(given) else given(), overrides=overrides)


def lines(rows):
    return "".join(chunk.jsonl() for chunk in chunks(rows)).splitlines()


def assert_equal(found, wanted):
    """Two tracks agree bit by bit."""
    assert (found.id, found.parents, found.merged) == (wanted.id, wanted.parents, wanted.merged)
    for name in ("times", "mean", "cov", "confirmed", "existence", "nis", "hit", "mode_prob", "confirmed_at", "identity"):
        one, other = getattr(found, name), getattr(wanted, name)
        assert (one is None) == (other is None), name
        if one is not None:
            assert one.tobytes() == other.tobytes(), name
    for one, other in zip(found.weights, wanted.weights, strict=True):
        assert one.tobytes() == other.tobytes()
    assert (found.returns is None) == (wanted.returns is None)
    for one, other in zip(found.returns or (), wanted.returns or (), strict=True):
        np.testing.assert_array_equal(one, other)


@pytest.mark.parametrize("pairs", [False, True])
@pytest.mark.parametrize("name", RUNS)
@pytest.mark.by_turns
def test_the_series_hold_the_tracks(name, pairs, tmp_path, monkeypatch):
    """Read from the file, they are what the run's own histories are; also where only pairs within gates are kept."""
    if pairs:
        monkeypatch.setattr(memory_limits, "LEAST_PAIRS", 1)
    experiment, packed = opened(name), BytesIO()
    steps = experiment.steps()
    recorder = Recorder(packed, experiment, steps)
    result = experiment.finish(steps, watch=recorder.add)
    recorder.close()
    reading = SeriesTracks(experiment.tracker.state)
    reading.add(read_series(BytesIO(packed.getvalue())).tables)
    rows = reading.hand_out()
    assert len(result.tracks) > 0
    for found, wanted in zip(rows.tracks(), result.tracks, strict=True):
        assert_equal(found, wanted)
    assert lines(rows) == lines(TrackRows.of(result.tracks, experiment.tracker.state))


@pytest.mark.parametrize("every", [1, 3, 7])
@pytest.mark.parametrize("name", ["two ships by an IMM", "splits, merges and hypotheses", "splits and merges"])
@pytest.mark.by_turns
def test_pieces_are_the_whole(name, every):
    """Line by line the pieces are the whole tracks, and say once what split and merged.

    A hypothesis may bring back a track that had merged: then a piece has said so, and the lines after it withdraw it.
    """
    experiment = opened(name)
    steps = experiment.steps()
    recorder, pieces = Recorder(BytesIO(), experiment, steps, kept=False), []
    for i, (scan, state) in enumerate(steps):
        recorder.add(scan, steps.before, state, *estimates(experiment.tracker, state))
        if i % every == every - 1:
            recorder.finish_block()
            pieces += lines(recorder.tracks.hand_out())
    recorder.close()
    pieces += lines(recorder.tracks.hand_out())
    whole = lines(TrackRows.of(opened(name).run().tracks, experiment.tracker.state))
    back = {line for line in pieces if "merged_into" in line} - set(whole)
    assert not back or "hypotheses" in name
    assert sorted(line for line in pieces if line not in back) == sorted(whole)
    for one in back:
        gone = json.loads(one)
        assert any(line.startswith(f'{{"track": {gone["track"]}, ') for line in pieces[pieces.index(one) + 1 :])
    if "splits" in name:
        assert any(key in line for line in pieces for key in ('"parents"', '"merged_into"'))


@pytest.mark.costly
def test_the_files_can_be_written_again_from_the_series(tmp_path):
    (tmp_path / "config.json").write_text(json.dumps(config()))
    assert main(["run", str(tmp_path / "config.json"), "--out", str(tmp_path / "out")]) == 0
    series, space = read_series(tmp_path / "out" / "series.npz"), vedette.load(config()).tracker.state
    reading = SeriesTracks(space)
    reading.add(series.tables)
    with TrackFiles(tmp_path, space, series.about["notes"], len(series.about["modes"])) as files:
        files.write(reading.hand_out())
    for name in ("tracks.csv", "tracks.jsonl"):
        assert (tmp_path / name).read_bytes() == (tmp_path / "out" / name).read_bytes()
