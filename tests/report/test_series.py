"""The series of a run: what it writes for its page agrees with its tracks, its figures and its gates."""

import json
import re
from io import BytesIO

import numpy as np
import pytest
from scipy.stats import chi2

import vedette
from support.paths import DOCS
from support.results import config
from vedette.cli import main
from vedette.metrics import judge
from vedette_files import read_recording, read_series, read_tracks
from vedette_report.running.streaming import stream
from vedette_report.series.recorder import Recorder


def recorded(folder, **changes):
    experiment = vedette.load(config(**changes))
    packed, steps = BytesIO(), experiment.steps()
    recorder = Recorder(packed, experiment, steps)
    result = experiment.finish(steps, watch=recorder.add)
    recorder.close()
    (folder / "series.npz").write_bytes(packed.getvalue())
    return experiment, result, read_series(folder / "series.npz")


@pytest.fixture(scope="module")
def run(tmp_path_factory):
    return recorded(tmp_path_factory.mktemp("run"))


def test_the_entries_are_the_histories_of_the_tracks_and_of_tentative_ones(run):
    _, result, series = run
    entries = series["entries"]
    assert len(np.unique(entries["track"])) == result.begun
    upper = np.triu_indices(4)
    for track in result.tracks:
        own = entries["track"] == track.id
        np.testing.assert_array_equal(series["scans"]["time"][entries["scan"][own]], track.times)
        np.testing.assert_array_equal(entries["mean"][own], track.mean)
        np.testing.assert_array_equal(entries["cov"][own], track.cov[:, upper[0], upper[1]])
        for name, wanted in (("existence", track.existence), ("nis", track.nis), ("modes", track.mode_prob)):
            np.testing.assert_array_equal(entries[name][own], wanted)


def test_the_weights_are_those_of_the_tracks_without_zeros(run):
    _, result, series = run
    entries, weights = series["entries"], series["weights"]
    assert (weights["weight"] > 0).all()
    for track in result.tracks:
        for row, wanted in zip(np.flatnonzero(entries["track"] == track.id), track.weights, strict=True):
            own = weights["entry"] == row
            found = np.zeros(len(wanted) - 1)
            found[weights["return"][own]] = weights["weight"][own]
            np.testing.assert_array_equal(found, wanted[1:])


def test_the_errors_are_those_of_the_figures(run):
    experiment, result, series = run
    score = judge(result.tracks, result.recording.truth, result.scans, experiment.judge, experiment.tracker.gate.probability)
    entries, scans = series["entries"], series["scans"]
    paired = entries["object"] >= 0
    assert np.sqrt(np.mean(entries["position_error"][paired] ** 2)) == pytest.approx(score.position_rmse_m, rel=1e-12)
    assert np.sqrt(np.mean(entries["velocity_error"][paired] ** 2)) == pytest.approx(score.velocity_rmse_mps, rel=1e-12)
    assert np.mean(entries["nees"][paired]) == pytest.approx(2 * score.nees_position, rel=1e-12)
    assert np.count_nonzero(scans["judged"]) == score.scans
    for j, true in enumerate(result.recording.truth):
        for row in np.flatnonzero(entries["object"] == j):
            where = true.at(scans["time"][entries["scan"][row]])[:2]
            assert np.hypot(*(entries["mean"][row, :2] - where)) == pytest.approx(entries["position_error"][row])


def test_a_scan_has_the_mean_over_its_tracks_and_the_band_of_that_mean(run):
    _, _, series = run
    entries, scans = series["entries"], series["scans"]
    for name, column in (("nees", "nees"), ("nis", "nis_given_hit")):
        for i, count in enumerate(scans[f"{name}_count"].tolist()):
            own = entries[column][entries["scan"] == i]
            own = own[np.isfinite(own)]
            assert len(own) == count
            if count:
                assert scans[name][i] == pytest.approx(own.mean())
                band = chi2.ppf([0.025, 0.975], 2 * count) / count
                np.testing.assert_allclose([scans[f"{name}_low"][i], scans[f"{name}_high"][i]], band)
    assert max(scans["nees_count"]) == 2, "two ships at once: a mean of more than one"


TWO_KINDS = {
    "estimator": {"kind": "ekf", "motion": {"kind": "constant_velocity", "sigma_accel": 0.5}},
    "sensors": {
        "beacon": {"kind": "cartesian_position", "sigma": 3.0, "clutter_density": 1e-4},
        "radar": {"kind": "range_bearing", "sigma_range": 5.0, "sigma_bearing": 0.01, "x": 40.0, "y": -30.0},
    },
    "associator": {"kind": "pda"},
}


def test_the_innovation_covariance_is_that_which_the_tracker_used(tmp_path):
    """The weighted squared distance that it gives is the tracker's own NIS, of linear and of linearised sensors."""
    _, _, series = recorded(tmp_path, **TWO_KINDS)
    entries, weights, scans = series["entries"], series["weights"], series["scans"]
    first = np.concatenate([[0], np.cumsum(scans["returns"])])
    scan = entries["scan"][weights["entry"]]
    z = series["returns"]["z"][first[scan] + weights["return"]]
    off = z - entries["expected"][weights["entry"]]
    polar = scans["sensor"][scan] == list(series.about["sensors"]).index("radar")
    off[polar, 1] = (off[polar, 1] + np.pi) % (2 * np.pi) - np.pi
    a, b, d = entries["innovation"][weights["entry"]].T
    distance = (d * off[:, 0] ** 2 - 2 * b * off[:, 0] * off[:, 1] + a * off[:, 1] ** 2) / (a * d - b * b)
    known = np.isfinite(distance)
    nis = np.bincount(weights["entry"][known], (weights["weight"] * distance)[known], len(entries["nis"]))
    np.testing.assert_allclose(nis, entries["nis"], rtol=1e-9, atol=1e-12)
    assert np.count_nonzero(nis[scans["sensor"][entries["scan"]] == 1]) > 20
    limits = [sensor["gate"] for sensor in series.about["sensors"].values()]
    assert (distance[known] <= np.array(limits)[scans["sensor"][scan[known]]]).all()


def test_the_gate_on_the_map_is_the_innovation_s_where_positions_are_measured(tmp_path):
    _, _, series = recorded(tmp_path, **TWO_KINDS)
    entries, scans = series["entries"], series["scans"]
    beacon = (scans["sensor"][entries["scan"]] == 0) & np.isfinite(entries["expected"][:, 0])
    np.testing.assert_allclose(entries["gate_cov"][beacon], entries["innovation"][beacon], rtol=1e-9)
    np.testing.assert_allclose(entries["gate_position"][beacon], entries["expected"][beacon])
    polar = (scans["sensor"][entries["scan"]] == 1) & np.isfinite(entries["expected"][:, 0])
    away, bearing = entries["expected"][polar].T
    np.testing.assert_allclose(
        entries["gate_position"][polar], [40, -30] + away[:, None] * np.c_[np.cos(bearing), np.sin(bearing)].reshape(-1, 2)
    )
    ring, cross, turn = entries["innovation"][polar].T
    area = np.sqrt(ring * turn - cross**2) * away
    a, b, d = entries["gate_cov"][polar].T
    np.testing.assert_allclose(np.sqrt(a * d - b * b), area, rtol=1e-9)


def test_a_run_that_keeps_nothing_writes_the_same_series(tmp_path, run):
    stream(vedette.load(config()), tmp_path)
    found, wanted = read_series(tmp_path / "series.npz"), run[2]
    assert found.about == wanted.about
    for table, columns in wanted.tables.items():
        for name, values in columns.items():
            np.testing.assert_array_equal(found[table][name], values, err_msg=f"{table}.{name}")


def test_blocks_do_not_show(tmp_path, run, monkeypatch):
    monkeypatch.setattr("vedette_report.series.recorder.SCANS", 3)
    monkeypatch.setattr("vedette_files.series._BLOCK", 1)
    _, _, found = recorded(tmp_path)
    with np.load(tmp_path / "series.npz") as archive:
        assert "scans.time.11.npy"[:-4] in archive.files
    for table, columns in run[2].tables.items():
        for name, values in columns.items():
            np.testing.assert_array_equal(found[table][name], values, err_msg=f"{table}.{name}")


def test_a_run_that_ends_before_its_first_scan_has_all_columns(tmp_path, run):
    experiment, packed = run[0], BytesIO()
    Recorder(packed, experiment, experiment.steps()).close()
    (tmp_path / "series.npz").write_bytes(packed.getvalue())
    empty = read_series(tmp_path / "series.npz")
    assert {
        table: {name: (values.dtype, values.shape[1:]) for name, values in columns.items()}
        for table, columns in empty.tables.items()
    } == {
        table: {name: (values.dtype, values.shape[1:]) for name, values in columns.items()}
        for table, columns in run[2].tables.items()
    }
    assert all(not len(values) for columns in empty.tables.values() for values in columns.values())


def test_without_truth_nothing_is_paired(tmp_path):
    head = {"format": "vedette", "version": 1, "sensors": {"beacon": {"x": "m", "y": "m"}}, "notes": {}}
    scans = [{"time": float(i), "sensor": "beacon", "z": [[8.0 * i, 1.0]]} for i in range(6)]
    (tmp_path / "seen.jsonl").write_text("".join(json.dumps(each) + "\n" for each in (head, *scans)))
    _, result, series = recorded(tmp_path, source={"kind": "jsonl", "path": str(tmp_path / "seen.jsonl")})
    entries = series["entries"]
    assert len(result.tracks) == 1
    assert set(entries["object"].tolist()) == {-1}
    assert np.isnan(entries["nees"]).all()
    assert np.isfinite(entries["nis_given_hit"]).any()
    assert len(series["truth"]["scan"]) == 0


def test_bearings_alone_have_no_place_on_the_map(tmp_path):
    sensors = {
        "beacon": {"kind": "cartesian_position", "sigma": 3.0},
        "ears": {"kind": "bearing_only", "sigma_bearing": 0.01, "x": -500.0, "y": 0.0},
    }
    looks = {"beacon": {"interval": 2.0}, "ears": {"interval": 2.0, "first": 1.0}}
    birth = {"kind": "from_returns", "spread": {"vx": 8.0, "vy": 8.0}, "sensors": ["beacon"]}
    parts = {"sensors": sensors, "birth": birth, "lifecycle": {"kind": "m_of_n"}}
    _, _, series = recorded(tmp_path, source=config()["source"] | {"looks": looks}, **parts)
    heard = series["scans"]["sensor"][series["returns"]["scan"]] == 1
    assert heard.any()
    assert np.isnan(series["returns"]["position"][heard]).all()
    assert np.isfinite(series["returns"]["position"][~heard]).all()
    own = series["scans"]["sensor"][series["entries"]["scan"]] == 1
    assert np.isnan(series["entries"]["gate_cov"][own]).all()
    assert np.isfinite(series["entries"]["innovation"][own, 0]).any()


def test_the_page_on_formats_lists_every_column(run):
    section = (DOCS / "reference" / "series.md").read_text(encoding="utf-8")
    told = dict(re.findall(r"^\*\*(\w+)\*\*(.*?)(?=^\*\*|\Z)", section, re.DOTALL | re.MULTILINE))
    assert set(told) == set(run[2].tables)
    for table, columns in run[2].tables.items():
        assert not [name for name in columns if f"`{name}`" not in told[table]]
    assert not [name for name in run[2].about if f"`{name}`" not in section]


@pytest.mark.costly
def test_the_command_writes_it_beside_the_tracks(tmp_path, capsys):
    (tmp_path / "config.json").write_text(json.dumps(config()))
    assert main(["run", str(tmp_path / "config.json"), "--out", str(tmp_path / "out")]) == 0
    assert "series.npz" in capsys.readouterr().out
    series, tracks = read_series(tmp_path / "out" / "series.npz"), read_tracks(tmp_path / "out" / "tracks.jsonl")
    assert {track.id for track in tracks} == set(series["entries"]["track"][series["entries"]["confirmed"]].tolist())
    recording, _ = read_recording(tmp_path / "out" / "recording.jsonl")
    assert [len(scan.detections.z) for scan in recording.scans] == series["scans"]["returns"].tolist()
