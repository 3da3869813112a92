"""A clip is decoded frame by frame: neither the source nor the run holds it in memory."""

import gc
import tracemalloc
from pathlib import Path

import cv2
import numpy as np
import pytest

import vedette
from vedette import InputError, LazyScans
from vedette.cli import main

EXAMPLE = Path(__file__).parents[2] / "examples" / "flir_clip.toml"

SIZE, FRAMES = (200, 320), 60


def images(frames=FRAMES):
    y, x = np.mgrid[: SIZE[0], : SIZE[1]]
    noise = np.random.default_rng(0)
    for k in range(frames):
        disc = (x - 40 - 1.5 * k) ** 2 + (y - 60) ** 2 <= 25
        yield (np.where(disc, 180, 40) + noise.normal(0, 1.5, SIZE)).astype(np.uint8)


@pytest.fixture(params=["folder", "video"])
def clip(tmp_path, request):
    if request.param == "folder":
        path = tmp_path / "clip"
        path.mkdir()
        for k, image in enumerate(images()):
            cv2.imwrite(str(path / f"{k:03d}.png"), image)
        return path
    path = tmp_path / "clip.avi"
    writer = cv2.VideoWriter(str(path), cv2.VideoWriter_fourcc(*"MJPG"), 30, SIZE[::-1])
    for image in images():
        writer.write(cv2.cvtColor(image, cv2.COLOR_GRAY2BGR))
    writer.release()
    return path


def experiment(path):
    return vedette.load(EXAMPLE, overrides=[f"source.path={path}", "source.box=[36, 56, 11, 11]"])


@pytest.mark.costly
def test_a_run_holds_few_frames(clip):
    for _ in range(2):  # what is imported on the way, and what is cached: an import empties caches of isinstance
        experiment(clip).run()
    tracemalloc.start()
    result = experiment(clip).run()
    gc.collect()
    held = tracemalloc.get_traced_memory()[0]
    tracemalloc.stop()
    assert len(result.scans) == len(result.framed) == FRAMES
    assert held < 0.3 * FRAMES * SIZE[0] * SIZE[1]
    assert all(scan.frame is None for scan in result.scans)


@pytest.mark.by_turns
def test_frames_are_the_same_in_any_order(clip):
    scans = experiment(clip).run().recording.scans
    assert isinstance(scans, LazyScans)
    forwards = [scan.frame.pixels for scan in scans]
    for k in (40, 3, 3, 59, 0):
        np.testing.assert_array_equal(scans[k].frame.pixels, forwards[k])


def test_a_frame_that_goes_away_is_told(tmp_path):
    path = tmp_path / "clip"
    path.mkdir()
    for k, image in enumerate(images(3)):
        cv2.imwrite(str(path / f"{k:03d}.png"), image)
    recording = experiment(path).run().recording
    (path / "001.png").unlink()
    with pytest.raises(InputError, match="frame 1: cannot be read any"):
        recording.scans[1]


@pytest.mark.costly
def test_a_recording_of_a_video_says_where_its_frames_are(clip, tmp_path, monkeypatch, capsys):
    monkeypatch.chdir(tmp_path)
    run = ["run", str(EXAMPLE), "--set", f"source.path={clip}", "--set", "source.box=[36, 56, 11, 11]"]
    assert main([*run, "--out", "first"]) == 0
    capsys.readouterr()
    again = "source={kind='jsonl', path='first/recording.jsonl'}"
    assert main(["run", "first/config.json", "--set", again, "--out", "second"]) == 2
    told = capsys.readouterr().err
    assert "holds none of the frames of 'camera'" in told
    assert "config.json" in told
    assert not (tmp_path / "second").exists()
