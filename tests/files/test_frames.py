"""A camera's frames beside a recording: what a run leaves behind is run again to the same tracks."""

import json

import numpy as np
import pytest

import vedette
from support.paths import EXAMPLES
from vedette import Frame, LazyScans, Recording, Scan, Space
from vedette.cli import main
from vedette_files import read_recording, write_recording

SENSORS = {"camera": Space.of(x="px", y="px")}
RNG = np.random.default_rng(0)


def written(folder, *frames):
    path = folder / "clip.jsonl"
    scans = tuple(Scan.image(float(k), "camera", frame) for k, frame in enumerate(frames))
    write_recording(path, Recording(scans), SENSORS)
    return path


@pytest.mark.parametrize(
    "pixels",
    [
        RNG.standard_normal((6, 9)),
        np.where(RNG.random((5, 4)) < 0.3, np.nan, 1e-300),
        RNG.integers(0, 2**16, (7, 5)).astype(np.uint16),
        np.asfortranarray(RNG.integers(0, 256, (7, 5)).astype(np.uint8)),
        RNG.standard_normal((3, 6, 5))[:, ::-1],
    ],
)
@pytest.mark.parametrize("corner", [None, np.array([-24.5, 3.0])])
def test_frames_read_back_to_the_last_bit_and_in_their_type(tmp_path, pixels, corner):
    path = written(tmp_path, Frame(pixels, corner), Frame(pixels[..., ::-1], corner))
    recording, _ = read_recording(path)
    assert not recording.refused
    for scan, expected in zip(recording.scans, (pixels, pixels[..., ::-1]), strict=True):
        np.testing.assert_array_equal(scan.frame.pixels, expected)
        assert scan.frame.pixels.dtype == pixels.dtype
        np.testing.assert_array_equal(scan.frame.corner, corner)
    again = tmp_path / "again"
    again.mkdir()
    assert written(again, *(scan.frame for scan in recording.scans)).read_bytes() == path.read_bytes()
    files = [sorted((folder / "clip_frames").iterdir()) for folder in (tmp_path, again)]
    assert [file.read_bytes() for file in files[0]] == [file.read_bytes() for file in files[1]]


@pytest.mark.costly
@pytest.mark.parametrize("more", [[], ["--stream"]])
def test_a_simulated_run_is_replayed_to_the_same_tracks(tmp_path, more):
    first, second = tmp_path / "first", tmp_path / "second"
    config, short = str(EXAMPLES / "flir.toml"), ["--set", "source.frames=25", "--set", "source.dead=0.02"]
    assert main(["run", config, "--out", str(first), *short, *more]) == 0
    source = f'source={{ kind = "jsonl", path = "{first / "recording.jsonl"}" }}'
    assert main(["run", config, "--out", str(second), "--set", source]) == 0
    for name in ("recording.jsonl", "tracks.csv", "tracks.jsonl"):
        assert (first / name).read_bytes() == (second / name).read_bytes()


def test_frames_that_a_video_holds_are_not_written_again(tmp_path):
    frame = Frame(np.zeros((4, 4)))
    lazy = Recording(LazyScans(2, lambda k: Scan.image(float(k), "camera", frame)))
    write_recording(tmp_path / "clip.jsonl", lazy, SENSORS)
    assert [file.name for file in tmp_path.iterdir()] == ["clip.jsonl"]


def damaged(folder, **changes):
    path = written(folder, Frame(np.ones((4, 4))), Frame(np.ones((4, 4))))
    head, first, second = path.read_text().splitlines()
    entry = json.loads(first)
    entry["frame"] = {**entry["frame"], **changes}
    path.write_text("\n".join([head, json.dumps(entry), second]) + "\n")
    return path


@pytest.mark.parametrize(
    ("changes", "told"),
    [
        ({"file": "../secret.npz"}, "leads out of the folder"),
        ({"file": "clip_frames/7.npz"}, "No such file"),
        ({"file": "clip.jsonl"}, "not a zip file"),
        ({"corner": [1.0]}, "frame.corner must be a list of 2 numbers"),
        ({"file": 3}, "frame must be an object"),
        ({"colour": "red"}, "frame must be an object"),
    ],
)
def test_a_frame_that_cannot_be_read_costs_its_scan(tmp_path, changes, told):
    recording, _ = read_recording(damaged(tmp_path, **changes))
    assert [scan.time for scan in recording.scans] == [1.0]
    assert told in str(recording.refused[0])
    assert str(recording.refused[0]).startswith("clip.jsonl:2")


@pytest.mark.parametrize(
    ("pixels", "told"),
    [
        (np.array([["a"]]), "must be an image of 8 or 16 bit or of floats"),
        (np.ones(4), "must be an image"),
        (np.ones((7, 4, 4)), "at most 4 channels"),
        (np.array([[None]], dtype=object), "must be an image"),
        (np.ones((0, 3)), "must have 1 pixel or more"),
    ],
)
def test_an_archive_that_holds_no_image_is_told(tmp_path, pixels, told):
    path = written(tmp_path, Frame(np.ones((4, 4))))
    np.savez(tmp_path / "clip_frames" / "000000.npz", pixels=pixels)
    recording, _ = read_recording(path)
    assert not recording.scans
    assert told in str(recording.refused[0])


def test_a_frame_that_is_cut_off_is_told(tmp_path):
    path = written(tmp_path, Frame(np.ones((40, 40))))
    file = tmp_path / "clip_frames" / "000000.npz"
    file.write_bytes(file.read_bytes()[:3000])
    assert not read_recording(path)[0].scans


def test_a_batch_of_runs_is_no_frame_of_a_recording(tmp_path):
    with pytest.raises(ValueError, match="must be one image"):
        written(tmp_path, Frame(np.ones((2, 3, 4, 4))))
    assert not (tmp_path / "clip.jsonl").exists()


def test_what_is_replayed_is_a_config(tmp_path):
    """The written config, with the recording as its source, builds the same tracker."""
    config = vedette.load(EXAMPLES / "flir.toml")
    path = written(tmp_path, Frame(np.ones((30, 30))))
    replay = vedette.load(EXAMPLES / "flir.toml", overrides=[f'source={{kind="jsonl", path="{path}"}}'])
    assert replay.tracker == config.tracker


@pytest.mark.parametrize("place", [0.3, 0.5, 0.7, 0.9])
def test_an_altered_byte_costs_one_scan_and_not_the_run(tmp_path, place):
    """A flipped byte of a deflated frame once ended the run as a plugin's error."""
    path = written(tmp_path, Frame(np.random.default_rng(0).integers(0, 255, (40, 40), dtype=np.uint8)))
    file = tmp_path / "clip_frames" / "000000.npz"
    data = bytearray(file.read_bytes())
    data[int(place * len(data))] ^= 0x55
    file.write_bytes(bytes(data))
    recording, _ = read_recording(path)
    assert len(recording.refused) == 1
    assert "clip_frames/000000.npz" in str(recording.refused[0])


@pytest.mark.parametrize("content", [b"", b"PK\x03\x04", b"no picture", "cut", "flipped"])
@pytest.mark.by_turns
def test_one_corrupt_frame_is_one_refused_scan(tmp_path, content):
    """Once it ended the whole run as the fault of a plugin."""
    config, short = str(EXAMPLES / "flir.toml"), ["--set", "source.frames=12", "--set", "source.dead=0.02"]
    assert main(["run", config, "--out", str(tmp_path / "first"), *short, "--stream"]) == 0
    frame = sorted((tmp_path / "first" / "recording_frames").iterdir())[5]
    data = bytearray(frame.read_bytes())
    data[len(data) // 2] ^= 255
    frame.write_bytes(content if isinstance(content, bytes) else data[: len(data) // 2] if content == "cut" else data)
    source = f'source={{ kind = "jsonl", path = "{tmp_path / "first" / "recording.jsonl"}" }}'
    assert main(["run", config, "--out", str(tmp_path / "second"), "--set", source, "--stream"]) == 0
    first, second = (json.loads((tmp_path / name / "summary.json").read_text()) for name in ("first", "second"))
    assert (second["scans_taken"], second["refused"]) == (first["scans_taken"] - 1, first["refused"] + 1)
    assert frame.name in second["first_refused"][0]
