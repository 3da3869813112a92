"""What a run through images leaves is the same whether it is kept or written as it goes; no password is told."""

import json

import cv2
import numpy as np
import pytest

import vedette
from support.paths import EXAMPLES
from vedette import ConfigError, InputError
from vedette.cli import main
from vedette.display import without_passwords
from vedette_flir.sources import stream

EXAMPLE = str(EXAMPLES / "flir_clip.toml")


def pictures(folder, frames=90, gone=range(30, 60)):
    """Write frames of noise with a square that is gone for a while."""
    folder.mkdir()
    for k in range(frames):
        pixels = np.random.default_rng(k).normal(60, 3, (48, 64))
        if k not in gone:
            pixels[20:29, 24:33] += 100
        cv2.imwrite(str(folder / f"{k:03d}.png"), pixels.clip(0, 255).astype(np.uint8))


@pytest.mark.costly
def test_a_streamed_run_says_when_its_target_was_lost_as_a_kept_one_does(tmp_path, capsys, monkeypatch):
    monkeypatch.setattr("vedette_report.drawing.brought.can_draw", lambda: False)
    pictures(tmp_path / "frames")
    given = [EXAMPLE, "--set", f"source.path={tmp_path / 'frames'}", "--set", "source.box=[25, 21, 9, 9]"]
    ways = {"kept": ["run"], "streamed": ["run", "--stream"], "watched": ["watch", "--terminal", "--speed", "max"]}
    told = {}
    for name, (command, *options) in ways.items():
        assert main([command, *given, *options, "--out", str(tmp_path / name)]) == 0
        told[name] = (tmp_path / name / "episodes.csv").read_bytes()
        assert "episodes.csv" in capsys.readouterr().out.splitlines()[-1]
    assert told["kept"].count(b"\n") >= 3
    assert told["streamed"] == told["watched"] == told["kept"]


def test_a_plugin_that_fails_after_a_streamed_run_is_told(tmp_path, capsys, monkeypatch):
    def fails(folder, result):
        raise ValueError("no ink")

    monkeypatch.setattr("vedette_flir.episodes", fails)
    pictures(tmp_path / "frames", 4, ())
    given = ["--set", f"source.path={tmp_path / 'frames'}", "--set", "source.box=[25, 21, 9, 9]"]
    assert main(["run", EXAMPLE, *given, "--stream", "--out", str(tmp_path / "out")]) == 0
    assert "its vedette_files_of_stream failed: ValueError: no ink" in capsys.readouterr().err


@pytest.mark.parametrize(
    ("given", "told"),
    [
        ("rtsp://user:pass@host:554/a", "rtsp://user:***@host:554/a"),
        ("rtsp://user:p@s:s@host/a@b", "rtsp://user:***@host/a@b"),
        ("http://:pass@host?x=1", "http://:***@host?x=1"),
        ("rtsp://host/user=admin&password=x.y&channel=1", "rtsp://host/user=admin&password=***&channel=1"),
        ("http://host/a?TOKEN=abc#d", "http://host/a?TOKEN=***#d"),
        ("rtsp://host:554/a@b", "rtsp://host:554/a@b"),
        ('{"a": "rtsp://u:p@h", "b": "rtsp://u:p@h"}', '{"a": "rtsp://u:***@h", "b": "rtsp://u:***@h"}'),
        ("token=5 of user:a@b", "token=5 of user:a@b"),
    ],
)
def test_passwords_are_masked_and_nothing_else(given, told):
    assert without_passwords(given) == told


class Camera:
    """A capture as OpenCV's, of frames that are all alike."""

    def __init__(self, address):
        self.left = 5

    def isOpened(self):  # OpenCV's name
        return True

    def get(self, what):
        return {cv2.CAP_PROP_FPS: 0.0, cv2.CAP_PROP_FRAME_WIDTH: 64.0, cv2.CAP_PROP_FRAME_HEIGHT: 48.0}[what]

    def read(self):
        self.left -= 1
        return self.left >= 0, np.full((48, 64), 60, np.uint8)

    def release(self):
        pass


ADDRESS = "rtsp://bob:secret@127.0.0.1:9/x"


def streamed(address):
    return ["--set", f'source={{kind = "video_stream", address = "{address}", box = [25, 21, 9, 9]}}']


def test_a_password_is_told_nowhere_but_in_the_config_that_runs_again(tmp_path, capsys, monkeypatch):
    monkeypatch.setattr(cv2, "VideoCapture", Camera)
    out = tmp_path / "out"
    assert main(["run", EXAMPLE, *streamed(ADDRESS), "--out", str(out), "--stream", "--report", "--json"]) == 0
    assert main(["explain", EXAMPLE, *streamed(ADDRESS)]) == 0
    printed = capsys.readouterr()
    assert "rtsp://bob:***@127.0.0.1:9/x" in printed.out
    assert "secret" not in printed.out + printed.err
    written = {file.name for file in out.iterdir() if b"secret" in file.read_bytes()}
    assert written == {"config.json"}
    with np.load(out / "series.npz") as series:
        assert b"secret" not in b"".join(bytes(series[name]) for name in series.files)
    assert json.loads((out / "config.json").read_text())["source"]["address"] == ADDRESS
    assert "secret" not in vedette.load(out / "config.json").source._repr_html_()


def test_a_camera_that_does_not_answer_is_told_without_its_password(capsys):
    with pytest.raises(InputError, match=r"^nowhere://bob:\*\*\*@127.0.0.1:9/x: is no camera"):
        vedette.load(EXAMPLE, overrides=streamed("nowhere://bob:secret@127.0.0.1:9/x")[1:]).steps()
    assert "secret" not in capsys.readouterr().err


def test_a_number_that_no_camera_has_is_a_wrong_address(tmp_path):
    for number in (str(stream.MOST_CAMERA + 1), "9" * 30):
        with pytest.raises(ConfigError, match=f'source.address: must be the number of a camera, up to 9999, got "{number}'):
            vedette.load(EXAMPLE, overrides=streamed(number)[1:]).steps()
    with pytest.raises(InputError, match="/dev/null: is no regular file"):
        vedette.load(EXAMPLE, overrides=streamed("/dev/null")[1:]).steps()
