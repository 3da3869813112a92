"""Maps and tables of tracks that are written as a run goes: piece by piece what a run that keeps all writes at once."""

import json

import pytest

from support.results import PLANE
from vedette.cli import main
from vedette_files.geodesy import Origin
from vedette_files.georeference import Terms
from vedette_files.tracks.pieces import geojson_pieces, parquet_pieces
from vedette_report.series import recorder as series

CONFIG = """
estimator = { kind = "kalman", motion = { kind = "constant_velocity", sigma_accel = 0.1 } }
associator = { kind = "gnn" }
birth = { kind = "from_returns", spread = { vx = 10, vy = 10 } }
lifecycle = { kind = "m_of_n", hits = 2, looks = 3, misses = 2 }
sensors = { ais = { kind = "cartesian_position", sigma = 10.0 } }
[source]
kind = "csv"
path = "PATH"
detections = { time = "when", columns = { latitude = "lat", longitude = "lon" } }
"""


@pytest.fixture(scope="module")
def both(tmp_path_factory):
    """The folders of a run that keeps all, and of one that writes as it goes, on a Parquet file with latitudes."""
    pd = pytest.importorskip("pandas", reason="needs pandas, which is not installed")
    pytest.importorskip("pyarrow", reason="needs pyarrow, which is not installed")
    pytest.importorskip("pymap3d", reason="needs pymap3d, which is not installed")
    folder = tmp_path_factory.mktemp("pieces")
    rows = [(i, 59 + 1e-4 * i, 10.5) for i in range(40)] + [(i, 59.1, 10.6 - 1e-4 * i) for i in range(11, 23)]
    table = pd.DataFrame(sorted(rows), columns=["when", "lat", "lon"])
    table["when"] = pd.Timestamp("2026-11-22", tz="UTC") + pd.to_timedelta(table["when"], unit="s")
    table.to_parquet(folder / "d.parquet")
    (folder / "c.toml").write_text(CONFIG.replace("PATH", str(folder / "d.parquet")))
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr("vedette_report.drawing.brought.can_draw", lambda: False)
        patch.setattr(series, "SCANS", 6)
        for name, options in (("kept", []), ("streamed", ["--stream"])):
            assert main(["run", str(folder / "c.toml"), "--out", str(folder / name), *options]) == 0
    return folder / "kept", folder / "streamed"


def test_the_pieces_of_each_track_make_its_line(both):
    kept, streamed = (json.loads((folder / "tracks.geojson").read_text())["features"] for folder in both)
    assert len(kept) == 2 < len(streamed)
    for whole in kept:
        own = [each for each in streamed if each["properties"]["track"] == whole["properties"]["track"]]
        points, times = [], []
        for piece in own:
            line = piece["geometry"]["coordinates"]
            line = [line] if piece["geometry"]["type"] == "Point" else line
            if points:
                assert line[0] == points[-1], "it begins where the last one ended"
                assert len(line) > 1
            points += line[1:] if points else line
            times += piece["properties"]["times"][1:] if times else piece["properties"]["times"]
        assert points == whole["geometry"]["coordinates"]
        assert times == whole["properties"]["times"]


def test_the_groups_of_rows_make_the_table(both):
    pd = pytest.importorskip("pandas")
    kept, streamed = (pd.read_parquet(folder / "tracks.parquet") for folder in both)
    pd.testing.assert_frame_equal(streamed.sort_values(["track", "time"], ignore_index=True), kept)
    assert not streamed["track"].is_monotonic_increasing


def test_a_run_without_tracks_leaves_whole_files(tmp_path):
    parquet = pytest.importorskip("pyarrow.parquet", reason="needs pyarrow, which is not installed")
    with geojson_pieces(tmp_path / "a.geojson", Terms(Origin(1.0, 2.0))) as write:
        write([])
    with parquet_pieces(tmp_path / "a.parquet", PLANE, Terms()) as write:
        write([])
    assert json.loads((tmp_path / "a.geojson").read_text())["features"] == []
    assert parquet.read_table(tmp_path / "a.parquet").num_rows == 0


def test_what_goes_wrong_leaves_no_file(tmp_path):
    with pytest.raises(ZeroDivisionError), geojson_pieces(tmp_path / "a.geojson", Terms(Origin(1.0, 2.0))):
        raise ZeroDivisionError
    assert list(tmp_path.iterdir()) == []
