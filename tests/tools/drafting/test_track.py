"""From Python: a file or a data frame to tracks, data frames, pictures; what a notebook shows."""

import io
from pathlib import Path

import numpy as np
import pytest

import vedette
from support.foreign_files import shuffled
from support.paths import EXAMPLES
from vedette.errors import ConfigError, InputError

pd = pytest.importorskip("pandas")
FILE = shuffled()


@pytest.fixture(scope="module")
def result(tmp_path_factory):
    folder = tmp_path_factory.mktemp("track")
    (folder / "plots.csv").write_text(FILE.text)
    states = [(p.name, t, *s[:2]) for p in FILE.truth for t, s in zip(p.times, p.states, strict=True)]
    rows = [f"{t};{name};{x};{y}" for name, t, x, y in states]
    (folder / "truth.csv").write_text("\n".join(["t;who;x;y", *rows]) + "\n")
    (folder / "hand.toml").write_text(FILE.by_hand)
    truth = 'source.truth={ file = "truth.csv", time = "t", object = "who", columns = { x = "x", y = "y" } }'
    return vedette.track(folder / "plots.csv", folder / "hand.toml", [truth])


def equal(first, second):
    return all(np.array_equal(a.mean, b.mean) for a, b in zip(first.tracks, second.tracks, strict=True))


@pytest.mark.costly
def test_a_file_a_frame_and_a_draft_give_the_same_tracks(result, tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    frame = pd.read_csv(io.StringIO(FILE.text), sep=";")
    Path("hand.toml").write_text(FILE.by_hand)
    assert equal(vedette.track(frame, "hand.toml"), result)
    Path("plots.csv").write_text(FILE.text)
    assert equal(vedette.track(frame), vedette.track("plots.csv"))


@pytest.mark.costly
def test_what_cannot_be_tracked_is_said(result):
    scene = vedette.to_config(vedette.load(EXAMPLES / "harbour.toml"))
    with pytest.raises(ConfigError, match=r"source\.kind: must be 'csv'"):
        vedette.track(pd.DataFrame({"t": [0.0]}), scene)
    with pytest.raises(ConfigError, match="source: must be of a kind"):
        vedette.track("plots.csv", scene)
    with pytest.raises(InputError, match="data frame: no column looks"):
        vedette.track(pd.DataFrame({"a": [0.0]}))
    with pytest.warns(RuntimeWarning, match="no track was"):
        vedette.track({"t": [0, 1, 2], "x": [1, 2, 30], "y": [2, 3, -9]})
    with pytest.raises(ConfigError, match=r"trucks: there is no such table.*'tracks'"):
        result.to_dataframe("trucks")


@pytest.mark.costly
def test_data_frames_of_a_result_hold_what_it_holds(result):
    tracks, seen = result.to_dataframe(), result.to_dataframe("detections")
    assert tracks["x"].tolist() == [x for track in result.tracks for x in track.mean[:, 0].tolist()]
    assert sorted(set(tracks["track"])) == sorted(track.id for track in result.tracks)
    assert len(seen) == result.intake.returns == FILE.text.count("\n") - 1
    np.testing.assert_array_equal(seen[["x", "y"]], np.concatenate([scan.detections.z for scan in result.scans]))
    truth = result.to_dataframe("truth")
    assert truth.groupby("object").size().tolist() == [240, 240]
    metrics = result.to_dataframe("metrics")
    assert metrics["position_rmse_m"].tolist() == [result.score().position_rmse_m]


def test_a_result_is_drawn_on_axes_of_ones_own(result):
    figure = pytest.importorskip("matplotlib.figure").Figure()
    axes = figure.add_subplot()
    assert result.plot(axes) is axes
    assert len(axes.lines) > 5
    assert axes.get_xlabel() == "x [m]"
    with pytest.raises(vedette.InputError, match=r"axes: must be axes.*'map.png'"):
        result.plot("map.png")


def test_values_show_themselves_in_short(result):
    experiment = result.experiment
    assert repr(result) == f"Result({len(result.tracks)} tracks, 240 scans, {result.intake.returns} returns, 0 refused)"
    assert repr(experiment.tracker) == (
        "Tracker(kalman(constant_velocity), jpda, from_returns, m_of_n; sensors lidar: cartesian_position)"
    )
    assert len(repr(experiment)) < 200
    for value in (result, experiment, experiment.tracker, experiment.tracker.estimator, experiment.tracker.sensors["lidar"]):
        html = value._repr_html_()
        assert html.startswith("<table><caption>")
        assert len(html) < 10_000
    assert "<th>sigma</th><td>3 m</td>" in experiment.tracker.sensors["lidar"]._repr_html_()
    assert "<th>position rmse m</th>" in result._repr_html_()


def test_html_of_a_users_text_is_text():
    experiment = vedette.load(EXAMPLES / "harbour.toml", overrides=['title="<script>"'])
    assert "<script>" not in experiment._repr_html_()
    assert "&lt;script&gt;" in experiment._repr_html_()
