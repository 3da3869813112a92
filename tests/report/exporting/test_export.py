"""Exports read back by readers that know nothing of Vedette: places, times and ellipses are those of the run."""

import csv
import json
from datetime import UTC, datetime
from pathlib import Path
from xml.etree import ElementTree as ET

import numpy as np
import pytest
from attrs import evolve

from support.results import PLANE, config, track
from vedette.cli import main
from vedette_files import read_series, read_tracks
from vedette_files.geodesy import Origin
from vedette_files.georeference import Terms
from vedette_report.exporting.run import CHI_SQUARE_95, Run, chosen, read_epoch

ORIGIN = Origin(63.4, 10.4)
KML, GX = "{http://www.opengis.net/kml/2.2}", "{http://www.google.com/kml/ext/2.2}"
PLACED = ("--origin", "63.4,10.4")
EPOCH = "2024-05-01T12:00:00Z"


@pytest.fixture(scope="module")
def folder(tmp_path_factory):
    pytest.importorskip("pymap3d", reason="needs pymap3d, which is not installed")
    folder = tmp_path_factory.mktemp("run")
    (folder / "given.json").write_text(json.dumps(config(title="A <test> & more")))
    assert main(["run", str(folder / "given.json"), "--out", str(folder), "--stream"]) == 0
    return folder


@pytest.fixture(scope="module")
def tracks(folder):
    found = [each for each in read_tracks(folder / "tracks.jsonl") if each.confirmed.any()]
    assert len(found) == 2
    return {each.id: np.flatnonzero(np.maximum.accumulate(each.confirmed)) for each in found}, {
        each.id: each for each in found
    }


def export(folder, target, *options):
    assert main(["export", str(folder), "--to", str(target), *options]) == 0
    return target


def in_plane(points):
    """East and north in m of longitudes and latitudes (k, 2)."""
    points = np.array(points)
    east, north, _ = ORIGIN.to_plane(points[:, 1], points[:, 0])
    return np.stack([east, north], axis=-1)


def squared(points, mean, cov):
    """Squared distances of places (k, 2) from an estimate."""
    away = points - mean[:2]
    return np.einsum("ki,ij,kj->k", away, np.linalg.inv(cov[:2, :2]), away)


def is_ellipse(ring, own, time, tolerance=1e-3):
    """Whether places lie where 95 % of a track's estimate at a time lie within; several scans may share a time."""
    around = [squared(ring, own.mean[i], own.cov[i]) for i in np.flatnonzero(np.abs(own.times - time) < 1e-5)]
    return any(np.allclose(values, CHI_SQUARE_95, rtol=tolerance) for values in around)


def test_kml_is_well_formed_and_says_where_and_when_each_track_was(folder, tracks, tmp_path):
    rows, whole = tracks
    root = ET.parse(export(folder, tmp_path / "a.kml", *PLACED, "--epoch", EPOCH, "--ellipses", "7")).getroot()
    assert root.tag == f"{KML}kml"
    (document,) = root
    order = ["name", "description", "Style", "Schema", "Folder"]
    tags = [child.tag.removeprefix(KML) for child in document]
    assert tags == sorted(tags, key=order.index)
    assert document.findtext(f"{KML}name") == "A <test> & more"
    styles = {f"#{style.get('id')}" for style in document.findall(f"{KML}Style")}
    assert {url.text for url in document.iter(f"{KML}styleUrl")} <= styles
    folders = document.findall(f"{KML}Folder")
    assert [each.findtext(f"{KML}name") for each in folders] == [f"track {number}" for number in rows]
    begin = datetime.fromisoformat(EPOCH).timestamp()
    for each, (number, own) in zip(folders, rows.items(), strict=True):
        moving = each.find(f"{KML}Placemark/{GX}Track")
        times = [datetime.fromisoformat(when.text).timestamp() - begin for when in moving.findall(f"{KML}when")]
        np.testing.assert_allclose(times, whole[number].times[own], atol=1e-5)
        places = [list(map(float, coord.text.split(" "))) for coord in moving.findall(f"{GX}coord")]
        np.testing.assert_allclose(in_plane(places), whole[number].mean[own, :2], atol=1e-3)
        values = {one.get("name"): [float(v.text) for v in one] for one in moving.iter(f"{GX}SimpleArrayData")}
        assert {len(column) for column in values.values()} == {len(times)}
        np.testing.assert_allclose(values["existence"], whole[number].existence[own], rtol=1e-5)
        assert (np.array(values["long"]) >= np.array(values["short"])).all()
        ellipses = each.findall(f"{KML}Placemark/{KML}Polygon/..")
        assert len(ellipses) == 7
        for one in ellipses:
            at = datetime.fromisoformat(one.findtext(f"{KML}TimeSpan/{KML}begin")).timestamp() - begin
            text = one.findtext(f".//{KML}coordinates").split(" ")
            assert text[0] == text[-1]
            ring = [list(map(float, point.split(","))) for point in text]
            assert is_ellipse(in_plane(ring), whole[number], at)


def valid(feature):
    """What RFC 7946 asks of a feature with these geometries."""
    assert feature["type"] == "Feature"
    assert isinstance(feature["properties"], dict)
    kind, coordinates = feature["geometry"]["type"], feature["geometry"]["coordinates"]
    points = {"Point": [coordinates], "LineString": coordinates, "Polygon": coordinates[0]}[kind]
    assert len(points) >= {"Point": 1, "LineString": 2, "Polygon": 4}[kind]
    for longitude, latitude, *_ in points:
        assert -180 <= longitude <= 180
        assert -90 <= latitude <= 90
    array = np.array(points)
    assert np.abs(np.diff(array[:, 0])).max(initial=0.0) < 180, "nothing crosses 180 deg"
    if kind == "Polygon":
        assert points[0] == points[-1]
        x, y = (array - array[0])[:, :2].T
        assert np.sum(x[:-1] * y[1:] - x[1:] * y[:-1]) > 0, "counterclockwise"


def test_geojson_keeps_the_rules_and_holds_the_tracks(folder, tracks, tmp_path):
    rows, whole = tracks
    found = json.loads(export(folder, tmp_path / "a.geojson", *PLACED, "--ellipses", "5").read_text())
    assert found["type"] == "FeatureCollection"
    for feature in found["features"]:
        valid(feature)
    lines = [each for each in found["features"] if each["geometry"]["type"] == "LineString"]
    assert [each["properties"]["track"] for each in lines] == list(rows)
    for each in lines:
        own = whole[each["properties"]["track"]]
        i = rows[own.id]
        np.testing.assert_array_equal(each["properties"]["times"], own.times[i])
        np.testing.assert_allclose(in_plane(each["geometry"]["coordinates"]), own.mean[i, :2], atol=1e-3)
        assert len(each["properties"]["ellipse_95"]) == len(i)
    areas = [each for each in found["features"] if each["geometry"]["type"] == "Polygon"]
    assert len(areas) == 10
    for each in areas:
        own = whole[each["properties"]["track"]]
        assert is_ellipse(in_plane(each["geometry"]["coordinates"][0]), own, each["properties"]["time"])


def test_a_track_across_180_deg_is_cut_there(folder, tmp_path):
    found = json.loads(export(folder, tmp_path / "b.geojson", "--origin", "10,179.999").read_text())
    for feature in found["features"]:
        valid(feature)
    longitudes = [
        point[0] for each in found["features"] for point in np.reshape(each["geometry"]["coordinates"], (-1, 2)).tolist()
    ]
    assert min(longitudes) < -179 < 179 < max(longitudes)


def test_tables_hold_the_same_rows(folder, tracks, tmp_path):
    parquet = pytest.importorskip("pyarrow.parquet", reason="needs pyarrow, which is not installed")
    rows, whole = tracks
    with export(folder, tmp_path / "a.csv", *PLACED, "--epoch", EPOCH).open() as file:
        lines = list(csv.DictReader(file))
    table = parquet.read_table(export(folder, tmp_path / "a.parquet", *PLACED, "--epoch", EPOCH))
    assert table.column_names == list(lines[0])
    assert table.num_rows == len(lines) == sum(map(len, rows.values()))
    assert json.loads(table.schema.metadata[b"axes"]) == {"x": "m", "y": "m", "vx": "m/s", "vy": "m/s"}
    assert table.schema.metadata[b"title"] == b"A <test> & more"
    for name in ("track", "x", "sd_x", "cov_x_y", "latitude", "time"):
        np.testing.assert_array_equal(table[name].to_numpy(), [float(line[name]) for line in lines])
    first = datetime.fromisoformat(lines[0]["utc"]) - datetime.fromisoformat(EPOCH)
    assert first.total_seconds() == pytest.approx(whole[0].times[rows[0][0]])


@pytest.mark.costly
def test_rerun_reads_its_file_back(folder, tracks, tmp_path):
    pytest.importorskip("rerun", reason="needs rerun-sdk, which is not installed: pip install 'vedette[rerun]'")
    from rerun.chunk import RrdReader

    rows, whole = tracks
    reader = RrdReader(str(export(folder, tmp_path / "a.rrd")))
    parts = {}
    for chunk in reader.store().stream().to_chunks():
        batch = chunk.to_record_batch()
        for name in batch.schema.names:
            if name not in ("rerun.controls.RowId", "time"):
                times = batch["time"].to_numpy().astype(float) * 1e-9 if "time" in batch.schema.names else None
                parts[chunk.entity_path, name] = times, batch[name].to_pylist()
    about = json.loads(parts["/about", "TextDocument:text"][1][0][0])
    series = read_series(folder / "series.npz")
    assert about["title"] == "A <test> & more"
    for number, own in rows.items():
        times, positions = parts[f"/map/tracks/{number}", "Points3D:positions"]
        np.testing.assert_allclose(times, whole[number].times[own], atol=1e-6)
        places = np.array([row[0] for row in positions])[:, :2] + about["centre"]
        np.testing.assert_allclose(places, whole[number].mean[own, :2], atol=1e-3)
        strips = parts[f"/map/tracks/{number}/ellipse", "LineStrips3D:strips"][1]
        outline = np.array(strips[-1][0])[:, :2] + about["centre"]
        assert is_ellipse(outline, whole[number], whole[number].times[own[-1]], 1e-2)
        scalars = np.array(parts[f"/existence/{number}", "Scalars:scalars"][1])[:, 0]
        np.testing.assert_allclose(scalars, whole[number].existence[own])
    for j, name in enumerate(series.about["objects"]):
        truth = np.array([row[0] for row in parts[f"/map/truth/{name}", "Points3D:positions"][1]])[:, :2] + about["centre"]
        np.testing.assert_allclose(truth, series["truth"]["position"][series["truth"]["object"] == j], atol=1e-3)
    counts = [len(row) for row in parts["/map/returns/radar", "Points3D:positions"][1]]
    radar = series["scans"]["sensor"] == list(series.about["sensors"]).index("radar")
    assert counts == series["scans"]["returns"][radar].tolist()


@pytest.mark.parametrize(
    ("options", "told"),
    [
        (["--to", "x.kml"], "--to: KML needs latitudes and longitudes"),
        (["--to", "x.geojson"], "give --origin LAT,LON, or export to .csv, .parquet or .rrd"),
        (["--to", "x.gpx"], "--to: must end in one of .kml, .geojson, .csv, .parquet, .rrd, got 'x.gpx'"),
        (["--to", "nowhere/x.csv"], "--to: must be a file in a folder that exists, got 'nowhere/x.csv'"),
        (["--to", "x.kml", "--origin", "north"], "--origin: must be a latitude and a longitude"),
        (["--to", "x.csv", "--epoch", "noon"], "--epoch: must be a date and a time by ISO 8601"),
        (["--to", "x.kml", "--origin", "1,2", "--ellipses", "-1"], "--ellipses: must be a whole number of at least 0"),
        (["--to", "x.csv", "--smoothed"], "smoothed.jsonl"),
    ],
)
def test_wrong_use_is_told_and_writes_nothing(folder, options, told, tmp_path, capsys, monkeypatch):
    monkeypatch.chdir(tmp_path)
    assert main(["export", str(folder), *options]) == 2
    assert told in capsys.readouterr().err
    assert list(tmp_path.iterdir()) == []


@pytest.mark.parametrize(("name", "smoothed"), [("smoothed.npz", True), ("series.npz", False)])
def test_a_file_of_a_run_names_its_folder_and_what_else_is_to_be_said(name, smoothed, tmp_path, capsys):
    for one in ("tracks.jsonl", name):
        (tmp_path / one).write_bytes(b"")
    assert main(["export", str(tmp_path / name), "--to", str(tmp_path / "x.csv")]) == 2
    told = capsys.readouterr().err
    assert f"'{tmp_path}'" in told
    assert ("--smoothed" in told) == smoothed


def made(cov, north_east=False, units=("m", "m"), times=(0.0, 1.0)):
    """A run of one track that stands at 100 m along x."""
    axes = dict(zip(("x", "y"), units, strict=True)) | {"vx": "m/s", "vy": "m/s"}
    full = np.eye(4)
    full[:2, :2] = cov
    own = track(times, [[100.0, 0.0, 0.0, 0.0]] * len(times), full)
    about = {"title": "", "axes": axes, "notes": {}, "map": None, "unit": "m"}
    return Run(Path("here"), about, (own,), PLANE, Terms(ORIGIN, north_east)), own


@pytest.mark.parametrize(("north_east", "bearing", "east"), [(False, 90.0, 100.0), (True, 0.0, 0.0)])
def test_the_long_axis_points_where_the_place_is_least_known(north_east, bearing, east):
    run, own = made([[9.0, 0.0], [0.0, 1.0]], north_east)
    long, short, found = run.axes(own)[0]
    assert (long, short) == pytest.approx((3 * np.sqrt(CHI_SQUARE_95), np.sqrt(CHI_SQUARE_95)))
    assert found % 180 == pytest.approx(bearing)
    assert in_plane(run.places(own))[0] == pytest.approx((east, 100.0 - east), abs=1e-3)


def test_pixels_are_not_put_on_the_earth():
    from vedette.errors import ConfigError

    run, _ = made(np.eye(2), units=("px", "px"))
    with pytest.raises(ConfigError, match="made of x and y in m"):
        run.check_placed("KML")


def test_dates_are_asked_for_only_where_there_are_none(folder, tmp_path):
    from vedette.errors import ConfigError

    run, own = made(np.eye(2), times=(1e9, 1e9 + 1))
    assert evolve(run, terms=Terms(ORIGIN, False, True)).dates(own)[0] == "2001-09-09T01:46:40Z"
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr("vedette_report.exporting.run.read_about", lambda path: {**run.about, "notes": {"time": "utc"}})
        patch.setattr("vedette_report.exporting.run.Terms.of", lambda notes, *tracks: Terms(None, False, True))
        with pytest.raises(ConfigError, match="--epoch: is for times without a date"):
            Run.read(folder, None, 0.0)


def test_few_of_many_are_chosen_evenly_with_the_last():
    assert chosen(10, 3).tolist() == [0, 4, 9]
    assert chosen(3, 50).tolist() == [0, 1, 2]
    assert chosen(5, 1).tolist() == [4]
    assert len(chosen(5, 0)) == len(chosen(0, 5)) == 0


def test_an_epoch_without_a_zone_is_utc():
    assert read_epoch("2024-05-01T12:00:00") == read_epoch(EPOCH) == datetime(2024, 5, 1, 12, tzinfo=UTC).timestamp()
