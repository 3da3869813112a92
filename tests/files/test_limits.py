"""Inputs that are no recordings: each ends `vedette run` with one clear line and code 2, soon and without a traceback."""

import json
import os
import struct
import subprocess
import sys
import tomllib
import zlib
from pathlib import Path

import numpy as np
import pytest

import vedette
from vedette.cli import main
from vedette.errors import ConfigError, InputError
from vedette_files import input_files
from vedette_files.images.header import MOST_PIXELS, picture_size

ROOT = Path(__file__).parents[2]
RADAR = {
    "estimator": {"kind": "kalman", "motion": {"kind": "constant_velocity", "sigma_accel": 1}},
    "sensors": {"radar": {"kind": "cartesian_position", "sigma": 1}},
    "associator": {"kind": "pda"},
    "birth": {"kind": "from_returns", "spread": {"vx": 1, "vy": 1}},
    "lifecycle": {"kind": "m_of_n"},
}
COLUMNS = {"time": "t", "columns": {"x": "x", "y": "y"}}
CSV = {"kind": "csv", "detections": COLUMNS}
IN_FOLDER = {"kind": "csv", "detections": {"file": "d.csv"} | COLUMNS}
TRUTH = {"truth": {"file": "truth.csv", "time": "t", "columns": {"x": "x", "y": "y"}}}
ROWS = "t,x,y\n0,1,2\n1,2,3\n"
SCENE = '{"format": "vedette", "version": 1, "sensors": {"radar": {"x": "m", "y": "m"}}}\n'
SCENE += '{"time": 0, "sensor": "radar", "z": []}\n'


def told(tmp_path, capsys, source, config=RADAR):
    """What `vedette run` says of a source that it refuses: one line."""
    (tmp_path / "config.json").write_text(json.dumps(config | {"source": source}))
    assert main(["run", str(tmp_path / "config.json"), "--out", str(tmp_path / "out")]) == 2
    (line,) = capsys.readouterr().err.splitlines()
    assert len(line) < 600
    return line


def picture_config(path, kind="radar_pictures"):
    if kind == "video":
        text = (ROOT / "examples" / "flir_clip.toml").read_text()

        return tomllib.loads(text) | {"source": {"kind": "video", "path": str(path), "box": [1, 1, 9, 9]}}
    return {
        **RADAR,
        "preprocessors": {"radar": {"kind": "radar_picture", "sensors": {"screen": {"kind": "radar_screen"}}}},
        "source": {"kind": "radar_pictures", "path": str(path)},
    }


SOURCES = [
    CSV,
    IN_FOLDER,
    {"kind": "jsonl"},
    {"kind": "autoferry", "scenario": 1},
]


@pytest.mark.parametrize("source", SOURCES)
@pytest.mark.parametrize("path", ["~nosuchuser/x", "~nosuchuser", "x" * 5000, "a\0b", "\udcff", "no/such"])
def test_a_path_that_leads_nowhere(tmp_path, capsys, source, path):
    assert "source.path: " in told(tmp_path, capsys, source | {"path": path})


@pytest.mark.parametrize("kind", ["video", "radar_pictures"])
@pytest.mark.parametrize("path", ["~nosuchuser/x", "x" * 5000, "a\0b", "/dev/zero"])
def test_a_path_of_pictures_that_leads_nowhere(tmp_path, capsys, kind, path):
    config = picture_config(path, kind)
    if kind == "radar_pictures":
        config["sensors"] = {"radar": {"kind": "cartesian_position", "sigma": 1}}
    told(tmp_path, capsys, config["source"], config)


@pytest.mark.parametrize("source", SOURCES)
@pytest.mark.parametrize("path", ["/dev/zero", "/dev/null", "fifo"])
def test_only_regular_files_are_read(tmp_path, capsys, source, path):
    os.mkfifo(tmp_path / "fifo")
    assert "file" in told(tmp_path, capsys, source | {"path": str(tmp_path / path)})


@pytest.mark.parametrize("name", ["/dev/zero", "fifo"])
def test_a_file_in_the_folder_that_is_none(tmp_path, name):
    """Where the folder is given, what lies in it under the right name may still be a FIFO or a device."""
    os.mkfifo(tmp_path / "fifo")
    (tmp_path / "d.csv").symlink_to(tmp_path / name)
    source = IN_FOLDER | {"path": str(tmp_path)}
    with pytest.raises((InputError, ConfigError), match=r"no regular file|out of the folder|no such file"):
        vedette.load(RADAR | {"source": source}).run()


@pytest.mark.parametrize("name", ["d.toml", "d.json"])
def test_a_config_that_is_no_regular_file(tmp_path, capsys, name):
    os.mkfifo(tmp_path / name)
    assert main(["run", str(tmp_path / name)]) == 2
    assert "no regular file" in capsys.readouterr().err


@pytest.mark.parametrize(
    ("source", "place"),
    [
        (IN_FOLDER | {"detections": COLUMNS | {"file": "../../etc/passwd"}}, "source.detections.file"),
        (IN_FOLDER | {"detections": COLUMNS | {"file": "/etc/passwd"}}, "source.detections.file"),
        (IN_FOLDER | {"detections": COLUMNS | {"file": "inner/../../d.csv"}}, "source.detections.file"),
        (IN_FOLDER | {"detections": COLUMNS | {"file": "link.csv"}}, "source.detections.file"),
        (IN_FOLDER | {"truth": TRUTH["truth"] | {"file": "../outside.csv"}}, "source.truth.file"),
        (IN_FOLDER | {"platform": TRUTH["truth"] | {"file": "../outside.csv"}}, "source.platform.file"),
    ],
)
def test_files_that_a_source_names_stay_in_its_folder(tmp_path, capsys, source, place):
    folder = tmp_path / "given"
    folder.mkdir()
    (tmp_path / "outside.csv").write_text(ROWS)
    (folder / "d.csv").write_text(ROWS)
    (folder / "link.csv").symlink_to(tmp_path / "outside.csv")
    line = told(tmp_path, capsys, source | {"path": str(folder)})
    assert f"{place}: " in line
    assert "out of the folder" in line


def test_a_link_within_the_folder_and_a_folder_that_is_a_link_are_read(tmp_path):
    (tmp_path / "given").mkdir()
    (tmp_path / "given" / "whole.csv").write_text(ROWS)
    (tmp_path / "given" / "d.csv").symlink_to("whole.csv")
    (tmp_path / "link").symlink_to("given")
    recording = vedette.load(RADAR | {"source": IN_FOLDER | {"path": str(tmp_path / "link")}}).run().recording
    assert len(recording.scans) == 2


def test_a_scenario_stays_in_its_folder(tmp_path, capsys):
    (tmp_path / "given").mkdir()
    for name in ("scenario1_detections.json", "scenario1_groundTruth.json"):
        (tmp_path / name).write_text("[]")
        (tmp_path / "given" / name).symlink_to(tmp_path / name)
    line = told(tmp_path, capsys, {"kind": "autoferry", "scenario": 1, "path": str(tmp_path / "given")})
    assert "out of the folder" in line


@pytest.mark.parametrize(("source", "head"), [(CSV, ""), (CSV, ROWS), ({"kind": "jsonl"}, ""), ({"kind": "jsonl"}, SCENE)])
def test_a_line_that_does_not_end(tmp_path, capsys, monkeypatch, source, head):
    monkeypatch.setattr(input_files, "LONGEST_LINE", 1000)
    (tmp_path / "d.csv").write_text(head + "1" * 5000)
    assert "longer than 1,000 characters" in told(tmp_path, capsys, source | {"path": str(tmp_path / "d.csv")})


def test_a_file_that_is_read_whole_has_a_ceiling(tmp_path, capsys, monkeypatch):
    monkeypatch.setattr(input_files, "LARGEST_WHOLE", 1000)
    for name in ("scenario1_detections.json", "scenario1_groundTruth.json"):
        (tmp_path / name).write_text(f"[{' ' * 2000}]")
    line = told(tmp_path, capsys, {"kind": "autoferry", "scenario": 1, "path": str(tmp_path)})
    assert "larger than 1,000 bytes" in line


WIDE = "7" * 200_000


@pytest.mark.parametrize(
    "text",
    [f"{WIDE},t,x,y\n1,0,1,2\n", f't,x,y\n"{WIDE}",1,2\n0,1,2\n', f"t,x,y\n0,{WIDE},2\n1,2,3\n", f't,x,"{WIDE}\n1,2,3\n'],
)
def test_a_wide_cell_costs_its_row_and_is_not_shown_whole(tmp_path, text):
    (tmp_path / "d.csv").write_text(text)
    try:
        result = vedette.load(RADAR | {"source": CSV | {"path": str(tmp_path / "d.csv")}}).run()
    except InputError as error:
        said = [str(error)]
    else:
        assert len(result.scans) == 1
        said = list(map(str, result.refused))
    assert said
    assert max(map(len, said)) < 600


def header(width, height, depth=8):
    """A PNG of so many pixels that says so and holds none of them."""

    def chunk(name, data):
        return struct.pack(">I", len(data)) + name + data + struct.pack(">I", zlib.crc32(name + data))

    return (
        b"\x89PNG\r\n\x1a\n"
        + chunk(b"IHDR", struct.pack(">IIBBBBB", width, height, depth, 0, 0, 0, 0))
        + chunk(b"IDAT", zlib.compress(b"\0" * 100))
        + chunk(b"IEND", b"")
    )


GEOMETRY = {"metres_per_pixel": 6.0, "centre": [20, 20], "width": 40_000, "height": 40_000}


def radar_pictures(folder, geometry, png):
    folder.mkdir(exist_ok=True)
    (folder / "geometry.json").write_text(geometry if isinstance(geometry, str) else json.dumps(geometry))
    (folder / "frames.csv").write_text("file,time_s\na.png,0\n")
    (folder / "a.png").write_bytes(png)
    return picture_config(folder)


def test_a_radar_picture_of_too_many_pixels(tmp_path, capsys):
    config = radar_pictures(tmp_path / "p", GEOMETRY, header(40_000, 40_000))
    assert f"{MOST_PIXELS:,} pixels" in told(tmp_path, capsys, config["source"], config)


@pytest.mark.parametrize(
    "geometry", ["[" * 100_000, "[" * 900 + "]" * 900, "\xff", "{}", '{"metres_per_pixel": 1e999}', "[" * 20_000_000, "[1]"]
)
def test_a_geometry_that_is_none(tmp_path, capsys, geometry):
    config = radar_pictures(tmp_path / "p", geometry, header(40, 40))
    assert "geometry.json: " in told(tmp_path, capsys, config["source"], config)


def test_a_land_picture_stays_in_its_folder_and_within_the_ceiling(tmp_path, capsys):
    small = GEOMETRY | {"width": 40, "height": 40}
    config = radar_pictures(tmp_path / "p", small | {"land": "../land.png"}, header(40, 40))
    (tmp_path / "land.png").write_bytes(header(40, 40))
    assert "out of the folder" in told(tmp_path, capsys, config["source"], config)
    (tmp_path / "p" / "land.png").write_bytes(header(40_000, 40_000))
    config = radar_pictures(tmp_path / "p", small | {"land": "land.png"}, header(40, 40))
    assert "land.png: must be a picture of 40 x 40 px, got 40000 x 40000" in told(tmp_path, capsys, config["source"], config)


@pytest.mark.parametrize(
    ("name", "data"),
    [
        ("0.png", header(40_000, 40_000)),
        ("0.bmp", b"BM" + struct.pack("<IHHIIiiHHIIiiII", 54, 0, 0, 54, 40, 40_000, -40_000, 1, 24, 0, 0, 0, 0, 0, 0)),
        ("0.pgm", b"P5\n# a picture\n40000 40000\n255\n"),
        ("0.jpg", b"\xff\xd8\xff\xe0\0\4ab\xff\xc0\0\x11\x08" + struct.pack(">HH", 40_000, 40_000) + b"\1\1\x11\0"),
        (
            "0.tif",
            b"II*\0" + struct.pack("<I", 8) + struct.pack("<H", 2)
            + struct.pack("<HHIHH", 256, 3, 1, 40_000, 0) + struct.pack("<HHII", 257, 4, 1, 40_000) + bytes(4),
        ),
    ],
)  # fmt: skip
def test_an_image_of_too_many_pixels(tmp_path, capsys, name, data):
    (tmp_path / "clip").mkdir()
    (tmp_path / "clip" / name).write_bytes(data)
    assert picture_size(tmp_path / "clip" / name) == (40_000, 40_000)
    config = picture_config(tmp_path / "clip", "video")
    line = told(tmp_path, capsys, config["source"], config)
    assert f"more than {MOST_PIXELS:,} pixels" in line


def test_images_that_are_links_out_or_no_files_are_refused(tmp_path, capsys):
    folder = tmp_path / "clip"
    folder.mkdir()
    (tmp_path / "out.png").write_bytes(header(40, 40))
    (folder / "0.png").symlink_to(tmp_path / "out.png")
    os.mkfifo(folder / "1.png")
    config = picture_config(folder, "video")
    assert "out of the folder" in told(tmp_path, capsys, config["source"], config)


def test_files_beside_a_clip_stay_beside_it(tmp_path, capsys):
    cv2 = pytest.importorskip("cv2")
    (tmp_path / "clip").mkdir()
    cv2.imwrite(str(tmp_path / "clip" / "a.png"), np.zeros((40, 40), np.uint8))
    config = picture_config(tmp_path / "clip", "video")
    for name, more in (("truth", {"truth": "/etc/passwd"}), ("segments", {"segments": "/etc/passwd", "segment": 0})):
        assert f"source.{name}: " in told(tmp_path, capsys, config["source"] | more, config)


LIMITED = """
import resource, sys
resource.setrlimit(resource.RLIMIT_AS, (3 << 30, 3 << 30))
from vedette.cli import main
sys.exit(main(sys.argv[1:]))
"""


@pytest.mark.costly
def test_a_line_of_many_gigabytes_does_not_fill_the_memory(tmp_path):
    """A file with a hole: eight GiB of zeros that take no room on the disk."""
    (tmp_path / "config.json").write_text(json.dumps(RADAR | {"source": CSV | {"path": str(tmp_path / "d.csv")}}))
    with (tmp_path / "d.csv").open("wb") as file:
        file.truncate(8 << 30)
    done = subprocess.run(
        [sys.executable, "-c", LIMITED, "run", str(tmp_path / "config.json"), "--out", str(tmp_path / "out")],
        capture_output=True,
        text=True,
        timeout=300,
        check=False,
        env={**os.environ, "OPENBLAS_NUM_THREADS": "1"},  # with many processors its threads take gigabytes of addresses
    )
    assert done.returncode == 2, done.stderr
    assert "longer than" in done.stderr
    assert "Traceback" not in done.stderr
