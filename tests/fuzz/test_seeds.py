"""What the fuzzers have found, kept: each case as it was."""

import io
import json
import shutil
import struct
import tomllib
import zipfile
from functools import reduce
from operator import xor

import numpy as np
import pytest

import vedette
from fuzz import cases, folders, results, samples
from fuzz.readers import RADAR, camera, read_clip, read_csv_source, read_radar_pictures
from support.faulty import CONFIG, spoiled, with_plugin
from vedette import InputError, Problem
from vedette_files import open_series, read_frame, read_tracks
from vedette_files.images.png import check_png
from vedette_files.tables.columnar import header_and_rows
from vedette_flir.sources.video import VideoSource
from vedette_marine.ais.nmea import read_nmea
from vedette_report.page.skeleton import page
from vedette_study.plan import by_point

pytest.importorskip("cv2")

GOOD = samples.png(np.zeros((12, 16)))
SHIFTED = GOOD[:33] + b"\xa0" + GOOD[33:]
"""A byte too many before a part: OpenCV reads its length as 2.7 GB, and does not come back."""


def written(folder, files):
    for name, data in files.items():
        (folder / name).parent.mkdir(exist_ok=True, parents=True)
        (folder / name).write_bytes(data)
    return folder


def test_a_png_with_a_byte_too_many_does_not_hang_a_radar(tmp_path):
    files = samples.radar_pictures() | {"land.png": SHIFTED}
    with cases.limited(20.0), pytest.raises(InputError, match=r"land.png: must be a picture of 16 x 12 px"):
        read_radar_pictures(written(tmp_path, files), files, False)


def test_a_png_with_a_byte_too_many_costs_a_frame_of_a_clip(tmp_path):
    files = samples.clip() | {"clip/1.png": SHIFTED}
    with cases.limited(20.0):
        read_clip(written(tmp_path, files), files, False)
        recording = VideoSource(path=str(tmp_path / "clip")).open(camera(), np.random.default_rng(0))
    assert [scan.time for scan in recording.scans] == [0.0, 2 / 30, 3 / 30]
    assert recording.refused == (Problem("frame 1", f"1.png is cut off after {len(SHIFTED)} bytes"),)


@pytest.mark.parametrize("cut", [0, 7, 8, 12, 20, 33, 40, -1])
def test_a_png_that_is_cut_off_is_told(tmp_path, cut):
    (tmp_path / "a.png").write_bytes(GOOD[:cut])
    with pytest.raises(ValueError, match=r"is (not a PNG|cut off)"):
        check_png(tmp_path / "a.png")


def test_a_png_without_its_header_first_is_told(tmp_path):
    (tmp_path / "a.png").write_bytes(GOOD[:8] + GOOD[33:])
    with pytest.raises(ValueError, match="does not begin"):
        check_png(tmp_path / "a.png")
    (tmp_path / "a.png").write_bytes(GOOD[:8] + struct.pack(">I4sI", 0, b"IHDR", 0xA8A1AE0A))
    with pytest.raises(ValueError, match="header has 0 bytes"):
        check_png(tmp_path / "a.png")


def test_a_name_of_ten_thousand_characters_is_not_told_whole(tmp_path):
    files = samples.csv_files()
    files["d.csv"] = (
        files["d.csv"].replace(b"sonar", b"x" * 10_000).replace(b"0,0,0,radar,0", b"3,0,0,radar," + b"9" * 9_999)
    )
    read_csv_source(written(tmp_path, files), files, True)
    assert RADAR


@pytest.mark.parametrize(
    ("payload", "text"),
    [("33P;Tw0tjBQO2", "reports no position"), ("\x0033P;Tw0tjBQO22:E7dm66DrB20UP", "characters that no sentence has")],
)
def test_a_sentence_that_is_cut_or_has_a_zero_in_it_is_refused(tmp_path, payload, text):
    """A zero changes no checksum; a payload that ends early decodes to a message without a place."""
    body = f"AIVDM,1,1,,A,{payload},0"
    (tmp_path / "ais.txt").write_text(f"1 !{body}*{reduce(xor, body.encode()):02X}\n")
    ships, (problem,), _ = read_nmea(tmp_path / "ais.txt")
    assert not ships
    assert text in problem.text


def test_a_whole_number_without_end_in_a_track(tmp_path):
    line = samples.TRACK.replace("[10, 20]", f"[1{'0' * 400}, 20]")
    (tmp_path / "t.jsonl").write_bytes(samples.tracks()["t.jsonl"].partition(b"\n")[0] + b"\n" + line.encode())
    with pytest.raises(InputError, match=r"t.jsonl:2: mean must be numbers"):
        read_tracks(tmp_path / "t.jsonl")


def test_a_picture_of_a_name_that_no_disk_takes(tmp_path):
    files = samples.radar_pictures()
    files["frames.csv"] = files["frames.csv"].replace(b"1.png", b"x" * 10_000)
    read_radar_pictures(written(tmp_path, files), files, False)


@pytest.mark.parametrize("name", ["config.json", "summary.txt"])
@pytest.mark.parametrize("content", [b"{", b"\xff\xfe", b"[1]"])
@pytest.mark.by_turns
def test_what_a_page_shows_besides_series_may_be_anything(tmp_path, monkeypatch, name, content):
    """Found by the fuzzer of folders: tracebacks of JSON and of UTF-8."""
    folders.made()
    shutil.copytree(folders.made() / "run", tmp_path / "run")
    (tmp_path / "run" / name).write_bytes(content)
    code, told = folders.quiet(["report", str(tmp_path / "run")])
    assert code == 0 or (code == 2 and name in told)


def test_a_study_of_one_point_has_a_table():
    """Found by the fuzzer of folders: numpy reshapes to no axes only if it is told of them as one."""
    assert by_point(np.ones(1), {}).shape == ()


def test_the_series_of_a_killed_run_in_a_zip_of_an_unknown_version_is_told(tmp_path):
    path = tmp_path / ".run-1" / "series.npz"
    path.parent.mkdir()
    content = results._series()
    at = content.index(b"PK\x01\x02")
    path.write_bytes(content[: at + 6] + b"\xe4\x00" + content[at + 8 :])
    with pytest.raises(InputError, match="version"), open_series(path):
        pass


def test_a_parquet_file_with_bytes_that_are_no_text_is_told(tmp_path):
    parquet = pytest.importorskip("pyarrow.parquet")
    path = tmp_path / "a.parquet"
    parquet.write_table(pytest.importorskip("pyarrow").table({"tttt": [1.0]}), path)
    path.write_bytes(path.read_bytes().replace(b"tttt", b"\xf8ttt"))
    with pytest.raises(InputError, match="cannot be read as Parquet"):
        list(header_and_rows(path, {"tttt"})[1])


def test_a_header_of_many_digits_is_refused_at_once(tmp_path):
    content = io.BytesIO()
    np.lib.format.write_array(content, np.arange(5.0))
    head, _, rest = content.getvalue().partition(b"(5,)")
    long = head[:8] + struct.pack("<H", 1000) + (head[10:] + b"(" + b"9" * 900)[:1000].ljust(1000) + rest
    with zipfile.ZipFile(tmp_path / "frame.npz", "w") as archive:
        archive.writestr("pixels.npy", long)
    with cases.limited(5.0), pytest.raises(ValueError, match="header"):
        read_frame({"file": "frame.npz"}, tmp_path)


def test_a_platform_of_which_no_row_can_be_read_is_no_pose(tmp_path):
    files = samples.csv_files() | {"own.csv": b"t,x,y,h\nt1,1,0,0.1\n"}
    with pytest.raises(InputError, match="own"):
        read_csv_source(written(tmp_path, files), files, False)


@pytest.mark.parametrize(
    ("truths", "code"), [("a text", 0), (["near"], 0), ([{"name": {}}], 0), ([{"name": "near", "lost": True}], 0)]
)
def test_a_summary_whose_objects_are_none_is_reported_without_them(truths, code, tmp_path):
    shutil.copytree(folders.made() / "run", tmp_path / "run")
    place = tmp_path / "run" / "summary.json"
    place.write_text(json.dumps(json.loads(place.read_text()) | {"truths": truths}))
    assert folders.quiet(["report", str(tmp_path / "run")])[0] == code


def test_a_page_with_a_number_that_is_none_is_refused():
    with pytest.raises(InputError, match="nan"):
        page("a run", {"unit": float("inf")}, ())


def test_ragged_returns_of_a_plugins_birth_are_named():
    registry = with_plugin(vedette.Registry.installed(), spoiled("Unclaimed", "reveal", "return given, given"))
    with pytest.raises(vedette.PluginError, match=r"vedette_x\.Unclaimed\)\.reveal must return density"):
        vedette.load(tomllib.loads(CONFIG), registry).run()
