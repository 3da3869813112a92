"""Records: what the page gets scan by scan is what the file of the run holds."""

import json
from base64 import b64decode
from itertools import pairwise

import numpy as np
import pytest

import vedette
from support.results import PLANE, config
from vedette import Recording, Trajectory
from vedette_files import read_series
from vedette_report.map.plane import Plane
from vedette_report.page.columns import arrays, middle
from vedette_report.running.streaming import stream
from vedette_report.series.rows import ScanRows
from vedette_report.watching import records
from vedette_report.watching.records import Records, Seen
from vedette_report.watching.truth import TrueObjects


def decoded(record, columns):
    """One record as the page reads it."""
    raw = b64decode(record, validate=True)
    count = 6 + len(columns)
    size, first, scans, came, *rest = np.frombuffer(raw, "<f8", count)
    assert size == len(raw)
    assert len(raw) % 24 == 0
    found, at = {}, 8 * count
    for (name, kind), length in zip(columns, rest[2:], strict=True):
        found[name] = np.frombuffer(raw, "<" + kind, int(length), at)
        at += -(-found[name].nbytes // 8) * 8
    return {"first": first, "scans": scans, "came": came, "centre": rest[:2], **found}


def watched(together, folder, *, judged=True, **changes):
    """A run that was written, and its records, so many scans in each; `judged` by the one who writes, or by the records."""
    experiment = vedette.load(config(**changes))
    steps = experiment.steps()
    modes = experiment.tracker.estimator.mode_prob(steps.state.belief)
    made = Records(experiment, steps.recording, 0 if modes is None else modes.shape[-1])
    waiting, found = [], []

    def watch(*told):
        waiting.append(Seen(1e9 + len(found), *(told if judged else told[:-1])))
        if len(waiting) == together:
            found.append(decoded(made.record(waiting), made.columns))
            waiting.clear()

    stream(experiment, folder, steps=steps, shown=watch)
    if waiting:
        found.append(decoded(made.record(waiting), made.columns))
    return found, read_series(folder / "series.npz")


def of_entries(columns, first):
    """The rows of tracks by scan and id: {(scan, id): {column: value}}."""
    ids = np.repeat(columns["tracks.id"], columns["tracks.count"])
    begin = np.concatenate([[0], np.cumsum(columns["tracks.count"])]).astype(int)
    scans = [np.cumsum(columns["entries.gap"][i:j], dtype=int) for i, j in pairwise(begin)]
    scan = np.concatenate([np.zeros(0, int), *scans]) + int(first)
    names = [name for name in columns if name.startswith("entries.") and name != "entries.gap"]
    return {
        (int(s), int(t)): {name: float(columns[name][i]) for name in names}
        for i, (s, t) in enumerate(zip(scan, ids, strict=True))
    }


@pytest.mark.parametrize("judged", [True, False])
@pytest.mark.parametrize("together", [1, 7])
@pytest.mark.by_turns
def test_records_hold_what_the_file_holds(together, judged, tmp_path, monkeypatch):
    monkeypatch.setattr(records, "_SHARE", 1.0)
    monkeypatch.setattr(records, "_PAUSE", np.inf)
    found, series = watched(together, tmp_path, judged=judged)
    np.testing.assert_array_equal(np.diff([each["first"] for each in found]), [each["scans"] for each in found[:-1]])
    assert len({tuple(each["centre"]) for each in found}) == 1
    whole = dict(arrays(series, np.array(found[0]["centre"])))
    for name in ("scans.time", "scans.sensor", "scans.position_rmse", "scans.nis", "scans.nis_high", "scans.covered"):
        np.testing.assert_array_equal(np.concatenate([each[name] for each in found]), whole[name], err_msg=name)
    for name in ("returns.x", "returns.y"):
        np.testing.assert_array_equal(np.concatenate([each[name] for each in found]), whole[name])
    wanted, told = of_entries(whole, 0), {}
    for each in found:
        told |= of_entries(each, each["first"])
    assert wanted.keys() == told.keys()
    for key, values in wanted.items():
        np.testing.assert_array_equal(list(told[key].values()), list(values.values()), err_msg=str(key))


def test_where_comparing_is_slow_it_is_left_out_and_nothing_is_claimed(tmp_path, monkeypatch):
    monkeypatch.setattr(records, "_SHARE", 1e-9)
    monkeypatch.setattr(records, "_LONGEST", 1e9)
    found, _ = watched(1, tmp_path, judged=False)
    compared = [np.isfinite(each["scans.covered"][0]) for each in found]
    assert sum(compared) == 0, "the columns' names were found by a comparison of none"
    assert np.isnan(np.concatenate([each["entries.nees"] for each in found])).all()


def test_the_centre_stays_once_a_place_is_known(tmp_path):
    found, series = watched(3, tmp_path)
    assert len({tuple(each["centre"]) for each in found}) == 1
    assert np.abs(np.array(found[0]["centre"]) - middle(series)).max() < 500.0


def test_facts_are_plain_data(tmp_path):
    experiment = vedette.load(config())
    made = Records(experiment, experiment.steps().recording, 2)
    json.dumps(made.about | {"columns": made.columns}, allow_nan=False)


@pytest.mark.parametrize("most", [None, 12.0])
def test_true_objects_are_where_the_file_says_that_they_are(most):
    rng = np.random.default_rng(4)
    truth = []
    for i in range(6):
        times = np.sort(rng.choice(np.arange(40.0), rng.integers(0 if i else 1, 20), replace=False)) + rng.uniform(0, 1)
        truth.append(Trajectory(f"object {i}", PLANE, times, rng.normal(size=(len(times), 4)) * 100))
    experiment = vedette.load(config(judge={} if most is None else {"truth_gap": most}))
    recording = Recording((), tuple(truth))
    rows, plane = ScanRows(experiment, recording), Plane.of(PLANE, recording)
    now = TrueObjects(recording, plane, experiment.judge.truth_gap)
    seen = 0
    for times in np.split(np.sort(np.concatenate([rng.uniform(-2, 45, 60), truth[0].times])), [5, 6, 30]):
        wanted, found = rows.true(times), now.true(times.tolist())
        for name in ("scan", "object"):
            np.testing.assert_array_equal(found[name], wanted[name])
        np.testing.assert_array_equal(found["position"], wanted["position"])
        seen += len(found["object"])
    assert seen > 20
