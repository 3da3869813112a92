"""The page of a run as a file: whole, without a request, its columns as exact as they are said to be."""

import hashlib
import json
import re
import zlib
from base64 import b64decode
from importlib.resources import files
from itertools import pairwise

import numpy as np
import pytest

from support.results import config
from vedette import Recording, Scan, Space
from vedette.cli import main
from vedette.errors import InputError
from vedette.types import Frame, LazyScans
from vedette_files import read_series, write_recording
from vedette_files.geodesy import Origin
from vedette_files.series import SeriesFile
from vedette_report.page.build import write_page
from vedette_report.page.frames import frames
from vedette_report.page.geography import east_north, graticule, read_origin, read_underlay
from vedette_report.page.packing import pack, single

UPLOT = {
    "uPlot.iife.min.js": "19c8d4c6ad88929a79f4ae49d6f7161566dfd0ba3d15cc495e974f787eb78f1f",
    "uPlot.min.css": "df630c6a8d6f8eeaff264b50f73ce5b114f646ffd9a0bb74f049b0a00135fa04",
}
"""Of uplot 1.6.32 in the npm registry."""


@pytest.fixture(scope="module")
def folder(tmp_path_factory):
    folder = tmp_path_factory.mktemp("run")
    (folder / "config.json").write_text(json.dumps(config(title="A </script> & <b>test</b>")))
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr("vedette_report.drawing.brought.can_draw", lambda: False)
        assert main(["run", str(folder / "config.json"), "--out", str(folder / "out"), "--report"]) == 0
    return folder / "out"


def unpacked(text, kind):
    raw = np.frombuffer(zlib.decompress(b64decode(text)), np.uint8)
    dtype = np.dtype("<" + kind)
    return raw.reshape(dtype.itemsize, -1).T.copy().view(dtype)[:, 0]


def page_columns(page):
    found = re.findall(
        r'<script type="text/plain" class="column" data-run="0" data-name="(.*?)" data-type="(.*?)">(.*?)</script>', page
    )
    return {name: unpacked(text, kind) for name, kind, text in found}


@pytest.mark.parametrize("dtype", ["f8", "f4", "u4", "i2", "u1"])
def test_a_packed_column_reads_back_to_the_last_bit(dtype):
    values = (np.random.default_rng(1).normal(size=100) * 50).astype(dtype)
    packed = pack("table.column", values)
    assert packed.type == dtype
    np.testing.assert_array_equal(unpacked(packed.text, dtype), values)
    assert not len(unpacked(pack("table.none", values[:0]).text, dtype))


def test_rounding_keeps_what_is_promised_and_what_is_no_number():
    values = np.random.default_rng(2).normal(size=10_000) * 10.0 ** np.random.default_rng(3).integers(-8, 8, 10_000)
    assert np.max(np.abs(single(values) / values - 1)) < 2**-17 * 1.01
    special = np.array([0.0, -0.0, np.nan, np.inf, -np.inf, 3.4e38])
    np.testing.assert_array_equal(np.isnan(single(special)), np.isnan(special))
    np.testing.assert_allclose(single(special)[3:], special[3:], rtol=1e-5)


def test_the_page_holds_the_series(folder):
    series, columns = read_series(folder / "series.npz"), page_columns((folder / "report.html").read_text(encoding="utf-8"))
    order = np.lexsort((series["entries"]["scan"], series["entries"]["track"]))
    for name in ("nees", "nis_given_hit", "position_error", "existence"):
        np.testing.assert_allclose(columns[f"entries.{name}"], series["entries"][name][order], rtol=2**-17 * 1.01)
    np.testing.assert_array_equal(columns["scans.time"], series["scans"]["time"])
    np.testing.assert_array_equal(columns["entries.object"], series["entries"]["object"][order])
    start = np.concatenate([[0], np.cumsum(columns["tracks.count"], dtype=int)])
    scans = np.concatenate([np.cumsum(columns["entries.gap"][i:j]) for i, j in pairwise(start)])
    np.testing.assert_array_equal(scans, series["entries"]["scan"][order])


def test_the_page_holds_the_four_largest_weights_above_a_hundredth(folder):
    series, columns = read_series(folder / "series.npz"), page_columns((folder / "report.html").read_text(encoding="utf-8"))
    order = np.lexsort((series["entries"]["scan"], series["entries"]["track"]))
    first = np.concatenate([[0], np.cumsum(columns["weights.count"], dtype=int)])
    weights = series["weights"]
    for place in range(0, len(order), 7):
        own = np.flatnonzero(weights["entry"] == order[place])
        own = own[weights["weight"][own] > 0.01]
        wanted = own[np.argsort(-weights["weight"][own], kind="stable")][:4]
        found = slice(first[place], first[place + 1])
        np.testing.assert_array_equal(columns["weights.return"][found], weights["return"][wanted])
        np.testing.assert_allclose(columns["weights.weight"][found], weights["weight"][wanted], rtol=1e-5)


def test_it_asks_for_nothing_and_no_title_can_break_out(folder):
    page = (folder / "report.html").read_text(encoding="utf-8")
    assert not re.findall(r"""(?:src|href)\s*=\s*["']?\s*(?:https?:)?//""", page)
    assert "default-src 'none'" in page
    assert "<b>test</b>" not in page
    assert page.count("</script>") == page.count("<script")


def test_equal_runs_give_equal_pages(folder, tmp_path):
    write_page(folder, tmp_path / "again.html")
    assert (tmp_path / "again.html").read_bytes() == (folder / "report.html").read_bytes()


def test_the_vendored_script_is_the_registry_s_and_has_its_licence():
    vendored = files("vedette_report.page") / "uplot"
    for name, wanted in UPLOT.items():
        assert hashlib.sha256((vendored / name).read_bytes()).hexdigest() == wanted
    assert "MIT License" in (vendored / "LICENSE").read_text()


def test_a_folder_that_no_run_wrote_is_told(tmp_path, capsys):
    assert main(["report", str(tmp_path)]) == 2
    assert "series.npz: there is no such file; `vedette run`" in capsys.readouterr().err
    assert not (tmp_path / "report.html").exists()


def earth_centred(phi, longitude):
    """The place of a point on the ellipsoid WGS 84, its angles in rad, from the centre of the Earth."""
    major, eccentricity = 6_378_137.0, 6.694379990141316e-3
    flat = major / np.sqrt(1.0 - eccentricity * np.sin(phi) ** 2)
    up = (1.0 - eccentricity) * flat * np.sin(phi)
    return np.stack([flat * np.cos(phi) * np.cos(longitude), flat * np.cos(phi) * np.sin(longitude), up], axis=-1)


@pytest.mark.parametrize("origin", [Origin(63.4, 10.4), Origin(-33.9, 151.2, 40.0)])
def test_places_on_the_tangent_plane_agree_with_the_closed_form(origin):
    """The Earth-centred place of each point, less that of the origin, turned into the origin's east and north."""
    rng = np.random.default_rng(4)
    latitude, longitude = origin.latitude + rng.normal(size=50) * 0.3, origin.longitude + rng.normal(size=50) * 0.5
    phi, away = np.radians(origin.latitude), np.radians(longitude - origin.longitude)
    raised = earth_centred(np.radians(latitude), away)
    raised += origin.altitude * np.stack(
        [
            np.cos(np.radians(latitude)) * np.cos(away),
            np.cos(np.radians(latitude)) * np.sin(away),
            np.sin(np.radians(latitude)),
        ],
        -1,
    )
    x, y, z = (raised - earth_centred(phi, 0.0)).T
    wanted = np.stack([y, z * np.cos(phi) - x * np.sin(phi)], axis=-1)
    np.testing.assert_allclose(east_north(latitude, longitude, origin), wanted, atol=1e-6)


@pytest.mark.parametrize("origin", [Origin(63.4, 10.4), Origin(-33.9, 151.2), Origin(0.0, 0.0)])
def test_the_graticule_crosses_the_map_with_few_lines(origin):
    lines = graticule(origin, np.array([-4e3, -3e3]), np.array([4e3, 3e3]))
    assert 2 <= len(lines) <= 24
    through = [line for line in lines if np.any(np.all(np.abs(np.array(line["points"])) < [4e3, 3e3], axis=1))]
    assert len(through) >= 2
    assert any(line["label"][-1] in "NS" for line in through)
    assert any(line["label"][-1] in "EW" for line in through)


def test_the_origin_is_the_recording_s_unless_it_is_given(folder, tmp_path):
    def labels(**given):
        write_page(folder, tmp_path / "page.html", **given)
        facts = (tmp_path / "page.html").read_text(encoding="utf-8").split('id="facts">')[1].split("</script>")[0]
        return " ".join(line["label"] for line in json.loads(facts)["graticule"])

    assert labels() == ""
    assert "63\N{DEGREE SIGN}" in labels(origin=Origin(63.4, 10.4))
    series = read_series(folder / "series.npz")
    (tmp_path / "run").mkdir()
    for name in ("config.json", "summary.txt", "recording.jsonl"):
        (tmp_path / "run" / name).write_bytes((folder / name).read_bytes())
    file = SeriesFile(tmp_path / "run" / "series.npz", series.about | {"notes": {"origin": "-33.9, 151.2, 0.0"}})
    file.add(series.tables)
    file.flush()
    write_page(tmp_path / "run", tmp_path / "placed.html")
    placed = (tmp_path / "placed.html").read_text(encoding="utf-8")
    assert "33\\u00b054\\u2032" in placed


@pytest.mark.parametrize(
    ("content", "piece"),
    [
        ("no json", "is not JSON"),
        ("[]", "must be a table of names, got list"),
        ('{"type": "Circle"}', "unknown type 'Circle'"),
        ('{"type": "LineString", "coordinates": [[1, "a"]]}', "must be GeoJSON"),
        ('{"type": "LineString", "coordinates": [[1, NaN]]}', "a coordinate is not finite"),
    ],
)
def test_a_bad_underlay_is_refused_with_its_name(tmp_path, content, piece):
    (tmp_path / "coast.geojson").write_text(content)
    with pytest.raises(InputError, match=rf"coast\.geojson: .*{re.escape(piece)}"):
        read_underlay(tmp_path / "coast.geojson", None)


def test_an_underlay_in_metres_stays_where_it_is_and_one_in_degrees_goes_round_the_origin(tmp_path):
    ring = {"type": "Polygon", "coordinates": [[[10.4, 63.4], [10.5, 63.4], [10.4, 63.5], [10.4, 63.4]]]}
    data = {"type": "FeatureCollection", "features": [{"type": "Feature", "properties": {}, "geometry": ring}]}
    (tmp_path / "coast.geojson").write_text(json.dumps(data))
    (plain,) = read_underlay(tmp_path / "coast.geojson", None)
    assert plain == {"points": [[10.4, 63.4], [10.5, 63.4], [10.4, 63.5], [10.4, 63.4]], "closed": True}
    (turned,) = read_underlay(tmp_path / "coast.geojson", Origin(63.4, 10.4))
    np.testing.assert_allclose(turned["points"][0], [0.0, 0.0])
    np.testing.assert_allclose(turned["points"][2], [0.0, 11_145.0], atol=20.0)


def test_of_an_underlay_of_the_whole_earth_the_page_has_what_a_plane_reaches(tmp_path):
    around = [[float(east), 63.4] for east in range(-180, 180, 2)]
    data = {"type": "Polygon", "coordinates": [around, [[-170, -63.4], [-169, -63.4], [-170, -63.0], [-170, -63.4]]]}
    (tmp_path / "coast.geojson").write_text(json.dumps(data))
    (line,) = read_underlay(tmp_path / "coast.geojson", Origin(63.4, 10.4))
    points = np.array(line["points"])
    assert not line["closed"]
    assert 25 < len(points) < 40
    assert np.all(np.diff(points[:, 0]) > 0)
    assert np.all(np.hypot(*points.T) < 1500e3)


@pytest.mark.parametrize("text", ["63.4", "north,east", "91,10", "10,181"])
def test_a_bad_origin_is_refused(text):
    with pytest.raises(ValueError, match="latitude"):
        read_origin(text)


def decoded(data):
    """The shades of a PNG that holds each row as differences from left to right."""
    assert data[:8] == b"\x89PNG\r\n\x1a\n"
    at, body = 8, b""
    while at < len(data):
        length, kind = int.from_bytes(data[at : at + 4], "big"), data[at + 4 : at + 8]
        part = data[at + 8 : at + 8 + length]
        assert zlib.crc32(kind + part) == int.from_bytes(data[at + 8 + length : at + 12 + length], "big")
        if kind == b"IHDR":
            width, height = int.from_bytes(part[:4], "big"), int.from_bytes(part[4:8], "big")
            assert part[8:] == bytes([8, 0, 0, 0, 0])
        body += part if kind == b"IDAT" else b""
        at += 12 + length
    rows = np.frombuffer(zlib.decompress(body), np.uint8).reshape(height, 1 + width)
    assert (rows[:, 0] == 1).all()
    return np.cumsum(rows[:, 1:], axis=1, dtype=np.uint8)


def test_frames_are_pictures_with_their_scan_and_place(tmp_path, monkeypatch):
    rng = np.random.default_rng(5)
    pixels = [rng.normal(size=(5, 7)) for _ in range(4)]
    pixels[1][2, 3] = np.nan
    corner = np.array([3.0, -2.0])
    images = [Scan.image(float(i), "camera", Frame(each, corner if i else None)) for i, each in enumerate(pixels)]
    seen = Scan(0.5, "radar", [[1.0, 2.0]])
    spaces = {"camera": Space.of(x="px", y="px"), "radar": Space.of(x="m", y="m")}
    write_recording(tmp_path / "recording.jsonl", Recording((images[0], seen, *images[1:])), spaces)
    found = frames(tmp_path / "recording.jsonl", np.zeros(0))
    assert [each["scan"] for each in found] == [0, 2, 3, 4]
    assert [each["corner"] for each in found] == [[0.0, 0.0]] + [[3.0, -2.0]] * 3
    assert found[0]["size"] == [7, 5]
    low, high = np.percentile(pixels[0], [1.0, 99.8])
    for each, wanted in zip(found, pixels, strict=True):
        shade = np.nan_to_num(255 * np.clip((wanted - low) / (high - low), 0, 1))
        np.testing.assert_allclose(decoded(b64decode(each["png"])), shade, atol=0.51)
    monkeypatch.setattr("vedette_report.page.frames.MOST", 2)
    assert [each["scan"] for each in frames(tmp_path / "recording.jsonl", np.zeros(0))] == [0, 3]
    monkeypatch.setattr("vedette_report.page.frames.BYTES", 10)
    assert frames(tmp_path / "recording.jsonl", np.zeros(0)) == []


def test_frames_of_a_clip_are_read_again_those_that_the_run_took(tmp_path, monkeypatch):
    """The second frame of the clip was refused; the fifth cannot be read any more."""
    rng = np.random.default_rng(6)
    pixels = [rng.normal(size=(4, 6)) for _ in range(6)]

    def make(i):
        if i == 4:
            raise InputError("cut off")
        return Scan.image(float(i), "camera", Frame(pixels[i]))

    monkeypatch.setattr("vedette_report.page.frames._clip", lambda config: LazyScans(6, make))
    found = frames(tmp_path / "recording.jsonl", np.array([0.0, 2.0, 3.0, 4.0, 5.0]), "{}")
    assert [each["scan"] for each in found] == [0, 1, 2, 4]
    low, high = np.percentile(pixels[0], [1.0, 99.8])
    for each, i in zip(found, (0, 2, 3, 5), strict=True):
        np.testing.assert_allclose(
            decoded(b64decode(each["png"])), 255 * np.clip((pixels[i] - low) / (high - low), 0, 1), atol=0.51
        )
    monkeypatch.setattr("vedette_report.page.frames.BYTES", 2 * len(found[0]["png"]) + 10)
    assert [each["scan"] for each in frames(tmp_path / "recording.jsonl", np.arange(4.0), "{}")] == [0, 2]


def test_a_fine_frame_is_made_coarser_and_keeps_its_place(tmp_path, monkeypatch):
    pixels = np.kron(np.arange(6.0).reshape(2, 3), np.ones((300, 300)))
    monkeypatch.setattr(
        "vedette_report.page.frames._clip", lambda config: LazyScans(1, lambda i: Scan.image(0.0, "c", Frame(pixels)))
    )
    (found,) = frames(tmp_path / "recording.jsonl", np.zeros(1), "{}")
    assert found["size"] == [900, 600]
    coarse = decoded(b64decode(found["png"]))
    assert coarse.shape == (200, 300)
    np.testing.assert_allclose(coarse[::100, ::100], [[0, 51, 102], [153, 204, 255]], atol=1)


def test_a_config_without_a_clip_has_no_frames(folder, tmp_path):
    assert frames(tmp_path / "recording.jsonl", np.zeros(3), (folder / "config.json").read_text()) == []
    assert frames(tmp_path / "recording.jsonl", np.zeros(3), "{}") == []
