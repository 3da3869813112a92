"""Folders of radar pictures: what corrupted, lost and foreign frames do."""

import numpy as np
import pytest

import vedette
from support.radar_pictures import FRAMES, SIZE, config, judged, opened
from vedette import ConfigError, InputError, ScanRefused
from vedette_files.images.png import check_png
from vedette_marine.screen import RadarScreen
from vedette_marine.sources.pictures import RadarPictures

cv2 = pytest.importorskip("cv2")


def rewrite(path, old, new):
    path.write_text(path.read_text().replace(old, new))


# What is wrong with a folder.
@pytest.mark.parametrize(
    ("spoil", "message"),
    [
        (lambda f: (f / "003.png").write_bytes((f / "003.png").read_bytes()[:-20]), "003.png is cut off after"),
        (lambda f: _flip(f / "003.png"), "003.png is corrupted: wrong checksum"),
        (lambda f: (f / "003.png").write_bytes(b"GIF89a, not a PNG"), "003.png is not a PNG"),
        (lambda f: (f / "003.png").write_bytes(b""), "003.png is not a PNG"),
        (lambda f: (f / "003.png").unlink(), "003.png cannot be read"),
        (lambda f: cv2.imwrite(str(f / "003.png"), np.zeros((SIZE, 64), np.uint8)), "must be 128 x 128 px as"),
        (lambda f: cv2.imwrite(str(f / "003.png"), np.zeros((SIZE, SIZE), np.uint16)), "must have 8 bit, got 16"),
        (lambda f: rewrite(f / "frames.csv", "003.png,3,", "003.png,300,"), "out of order"),
        (lambda f: rewrite(f / "frames.csv", "003.png,3,", "003.png,soon,"), "time_s must be a number, got 'soon'"),
        (lambda f: rewrite(f / "frames.csv", "003.png,3,", "003.png,nan,"), "time_s must be a finite number"),
        (lambda f: rewrite(f / "frames.csv", "003.png,3,0.3", "003.png,3"), "must have 3 columns"),
        (lambda f: rewrite(f / "frames.csv", "003.png", "../003.png"), "file must be"),
        (lambda f: rewrite(f / "ais.csv", "3,211000001,54", "3,211000001,55"), "cannot be reached"),
        (lambda f: rewrite(f / "ais.csv", "3,211000001,54", "3,211000001,95"), "Latitude_degrees must be from -90 to 90"),
    ],
)  # fmt: skip
@pytest.mark.by_turns
def test_one_bad_part_is_told_and_costs_nothing_else(folder, spoil, message):
    spoil(folder)
    given = config(folder, reference="ais")
    result, score = judged(given)
    assert len(result.refused) == 1
    assert message in str(result.refused[0])
    assert len(result.scans) >= FRAMES - 2
    assert score.coverage == 1
    with pytest.raises(ScanRefused, match=r"."):
        vedette.load(given).run(strict=True)


def _flip(path):
    data = bytearray(path.read_bytes())
    data[len(data) // 2] ^= 0xFF
    path.write_bytes(bytes(data))


def test_no_flipped_bit_of_a_picture_passes(folder):
    path = folder / "003.png"
    data = path.read_bytes()
    assert check_png(path) == (SIZE, SIZE, 8)
    for at in np.random.default_rng(0).integers(0, len(data), 60).tolist():
        path.write_bytes(data[:at] + bytes([data[at] ^ 4]) + data[at + 1 :])
        with pytest.raises(ValueError, match=r"is (corrupted|cut off|not a PNG)"):
            check_png(path)


@pytest.mark.parametrize(
    ("spoil", "message"),
    [
        (lambda f: (f / "geometry.json").unlink(), "geometry.json: is missing: it states where"),
        (lambda f: (f / "frames.csv").unlink(), "frames.csv: cannot be read"),
        (
            lambda f: rewrite(f / "frames.csv", "time_s", "t"),
            "frames.csv:1: must have the columns file, time_s",
        ),
        (lambda f: (f / "frames.csv").write_text("file,time_s\n"), "holds no usable picture"),
        (
            lambda f: [p.unlink() for p in f.glob("*.png")],
            "holds no usable picture; the first problem: frames.csv:2:",
        ),
        (lambda f: (f / "ais.csv").unlink(), "ais.csv: cannot be read"),
        (lambda f: rewrite(f / "geometry.json", '"latitude": 54.0', '"latitude": null'), "lacks latitude and longitude"),
        (
            lambda f: rewrite(f / "geometry.json", '"land": ""', '"land": "chart.png"'),
            "chart.png: must be a picture of 128",
        ),
    ],
)
def test_a_folder_that_cannot_be_used_is_told(folder, spoil, message):
    spoil(folder)
    with pytest.raises(InputError) as error:
        opened(folder, reference="ais")
    assert message in str(error.value)


def test_a_picture_that_is_spoiled_after_opening_is_refused(folder):
    experiment = vedette.load(config(folder))
    source = experiment.source
    recording = source.open({"screen": RadarScreen()}, np.random.default_rng(0))
    (folder / "003.png").unlink()
    assert recording.scans[3].frame.pixels.shape == (0, 0)
    given = vedette.load(config(folder))
    rows = opened(folder)
    assert len(rows.refused) == 1
    assert len(given.run().scans) == FRAMES - 2


def test_wrong_uses_are_told(folder):
    with pytest.raises(ConfigError, match="path: is not given"):
        opened("")
    with pytest.raises(ConfigError, match="there is no file"):
        opened(folder / "none")
    with pytest.raises(ConfigError, match="need one screen behind a preprocessor"):
        RadarPictures(str(folder)).open({}, np.random.default_rng(0))
