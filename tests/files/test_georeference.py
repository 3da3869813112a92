"""Tracks in the terms of their recording: latitude and longitude, dates, a map, Parquet."""

import csv
import json

import numpy as np
import pytest
from attrs import evolve

import vedette
from support.commands import in_json
from vedette import Space, Track
from vedette_files import write_tracks_csv
from vedette_files.geodesy import Origin
from vedette_files.georeference import PLAIN, Terms, geometry, utc, write_geojson
from vedette_files.tables.times import DATED
from vedette_files.tracks.table import table_of, write_tracks_parquet

ORIGIN = Origin(59.0, 10.0, 20.0)
FLAT, DEEP = Space.of(x="m", y="m", vx="m/s"), Space.of(y="m", x="m", z="m")
TERMS = Terms(ORIGIN, dated=True)


def track(space=FLAT, count=4, number=7, **changed):
    rng = np.random.default_rng(number)
    made = Track(
        id=number,
        space=space,
        times=1.7e9 + np.arange(count, dtype=float),
        mean=1e3 * rng.standard_normal((count, len(space))),
        cov=np.tile(np.eye(len(space)), (count, 1, 1)),
        confirmed=np.arange(count) > 0,
        existence=np.ones(count),
        mode_prob=None,
        weights=(np.ones(1),) * count,
        nis=np.full(count, np.nan),
        hit=np.zeros(count),
    )
    return evolve(made, **changed)


def test_notes_say_what_the_terms_are_and_a_broken_note_says_nothing():
    assert Terms.of({"origin": str(ORIGIN), "time": DATED, "frame": "x north, y east"}) == Terms(ORIGIN, True, True)
    assert Terms.of({}) == Terms.of({"origin": "here", "time": "noon"}) == PLAIN
    assert Terms.of({"origin": "1, 2, 3, 4"}) == Terms.of({"origin": "91, 0"}) == PLAIN


def test_a_plain_table_has_no_further_columns():
    assert list(table_of([track()], FLAT))[-1] == "nis"


@pytest.mark.parametrize("space", [FLAT, DEEP])
@pytest.mark.parametrize("north_east", [False, True])
def test_the_csv_files_last_columns_are_where_and_when(tmp_path, space, north_east):
    pytest.importorskip("pymap3d")
    given, terms = track(space), Terms(ORIGIN, north_east, True)
    write_tracks_csv(tmp_path / "t.csv", [given], space, terms)
    rows = list(csv.DictReader((tmp_path / "t.csv").read_text().splitlines()))
    height = [float(row["altitude"]) for row in rows] if space is DEEP else 0.0
    east, north, up = ORIGIN.to_plane(
        np.array([float(row["latitude"]) for row in rows]), np.array([float(row["longitude"]) for row in rows]), height
    )
    at = dict(zip(space.names, given.mean.T, strict=True))
    wanted = (at["y"], at["x"]) if north_east else (at["x"], at["y"])
    np.testing.assert_allclose((east, north), wanted, atol=1e-3)
    if space is DEEP:
        np.testing.assert_allclose(up, at["z"], atol=1e-3)
    assert [row["utc"] for row in rows][:2] == ["2023-11-14T22:13:20Z", "2023-11-14T22:13:21Z"]
    assert utc(1e15) == ""


def test_the_table_is_the_csv_file(tmp_path):
    pytest.importorskip("pymap3d")
    given = [track(), track(number=8, count=2)]
    write_tracks_csv(tmp_path / "t.csv", given, FLAT, TERMS)
    rows = list(csv.DictReader((tmp_path / "t.csv").read_text().splitlines()))
    table = table_of(given, FLAT, TERMS)
    assert list(rows[0]) == list(table)
    for title, values in table.items():
        told = [row[title] for row in rows]
        if values.dtype.kind == "U":
            assert told == values.tolist()
        else:
            np.testing.assert_array_equal([float(cell) if cell else np.nan for cell in told], values.astype(float))
    assert table_of([], FLAT, TERMS).keys() == table.keys()


def test_parquet_holds_the_table(tmp_path):
    parquet = pytest.importorskip("pyarrow.parquet")
    write_tracks_parquet(tmp_path / "t.parquet", [track()], FLAT)
    found, wanted = parquet.read_table(tmp_path / "t.parquet").to_pydict(), table_of([track()], FLAT)
    assert list(found) == list(wanted)
    assert found["x"] == wanted["x"].tolist()
    assert found["nis"] == [None] * 4


def test_the_map_has_a_line_for_each_track_from_its_confirmation(tmp_path):
    pytest.importorskip("pymap3d")
    lost = track(number=9, mean=np.full((4, 3), np.nan))
    given = [track(), track(number=8, count=2), lost]
    write_geojson(tmp_path / "t.geojson", given, TERMS)
    found = json.loads((tmp_path / "t.geojson").read_text())
    assert found["type"] == "FeatureCollection"
    line, point = found["features"]
    assert (line["geometry"]["type"], point["geometry"]["type"]) == ("LineString", "Point")
    assert line["properties"] == {"track": 7, "times": [utc(1.7e9 + i) for i in (1, 2, 3)]}
    table = table_of(given[:1], FLAT, TERMS)
    wanted = np.stack([table["longitude"], table["latitude"]], axis=-1)[1:]
    np.testing.assert_allclose(line["geometry"]["coordinates"], wanted, atol=1e-9)
    write_geojson(tmp_path / "none.geojson", [], TERMS)
    assert json.loads((tmp_path / "none.geojson").read_text())["features"] == []


CONFIG = """
estimator = { kind = "kalman", motion = { kind = "constant_velocity", sigma_accel = 0.1 } }
associator = { kind = "gnn" }
birth = { kind = "from_returns", spread = { vx = 10, vy = 10 } }
lifecycle = { kind = "m_of_n", hits = 2, looks = 3 }
sensors = { ais = { kind = "cartesian_position", sigma = 10.0 } }
[source]
kind = "csv"
path = "PATH"
detections = { time = "when", columns = { latitude = "lat", longitude = "lon" } }
"""


def test_a_run_on_latitudes_and_stamps_gives_them_back_also_when_streamed_and_replayed(tmp_path, capsys, monkeypatch):
    pytest.importorskip("pymap3d")
    monkeypatch.setattr("vedette_report.drawing.brought.can_draw", lambda: False)
    rows = [f"2026-11-22T08:00:{i:02d}Z,{59 + 1e-4 * i},10.5" for i in range(12)]
    (tmp_path / "d.csv").write_text("\n".join(["when,lat,lon", *rows]) + "\n")
    (tmp_path / "c.toml").write_text(CONFIG.replace("PATH", str(tmp_path / "d.csv")))
    replay = f'source={{ kind = "jsonl", path = "{tmp_path / "a" / "recording.jsonl"}" }}'
    for name, options in (("a", []), ("b", ["--stream"]), ("c", ["--set", replay])):
        assert in_json(capsys, "run", tmp_path / "c.toml", "--out", tmp_path / name, *options)[0] == 0
    given = (tmp_path / "a" / "tracks.csv").read_bytes()
    assert given == (tmp_path / "b" / "tracks.csv").read_bytes() == (tmp_path / "c" / "tracks.csv").read_bytes()
    last = list(csv.DictReader(given.decode().splitlines()))[-1]
    assert last["utc"] == "2026-11-22T08:00:11Z"
    assert (float(last["latitude"]), float(last["longitude"])) == pytest.approx((59.0011, 10.5), abs=2e-5)
    assert len(json.loads((tmp_path / "a" / "tracks.geojson").read_text())["features"]) == 1


def test_a_run_on_parquet_writes_parquet(tmp_path, capsys, monkeypatch):
    pd = pytest.importorskip("pandas")
    pytest.importorskip("pyarrow")
    monkeypatch.setattr("vedette_report.drawing.brought.can_draw", lambda: False)
    when = pd.date_range("2026-11-22", periods=8, freq="s", tz="UTC")
    pd.DataFrame({"when": when, "e": np.arange(8.0), "n": 1.0}).to_parquet(tmp_path / "d.parquet")
    text = CONFIG.replace('latitude = "lat", longitude = "lon"', 'x = "e", y = "n"')
    (tmp_path / "c.toml").write_text(text.replace("PATH", str(tmp_path / "d.parquet")))
    code, _ = in_json(capsys, "run", tmp_path / "c.toml", "--out", tmp_path / "a")
    assert code == 0
    found = pd.read_parquet(tmp_path / "a" / "tracks.parquet")
    result = vedette.load(tmp_path / "c.toml").run()
    assert found["x"].tolist() == result.tracks[0].mean[:, 0].tolist()
    assert "latitude" not in found


def test_a_line_is_cut_where_it_crosses_180_degrees():
    east, west, ahead = [[179.8, 1.0], [179.9, 1.0]], [[-179.9, 1.0]], [[179.95, 1.0], [179.8, 1.0]]
    assert geometry(east) == {"type": "LineString", "coordinates": east}
    assert geometry(west) == {"type": "Point", "coordinates": west[0]}
    whole = geometry(east + west + ahead)  # RFC 7946: a line has two positions at least
    assert whole == {"type": "MultiLineString", "coordinates": [east, west * 2, ahead]}
    assert geometry([[-170.0, 0.0], [10.0, 0.0]])["type"] == "LineString"
