"""`vedette watch` as a user starts it: its page, its files, and how it ends."""

import json
import signal
import subprocess
import sys
import tomllib
from contextlib import contextmanager
from urllib.request import urlopen

import numpy as np
import pytest

from support.commands import files
from support.paths import EXAMPLES
from support.results import config
from vedette.cli import main

HARBOUR = str(EXAMPLES / "harbour.toml")


@contextmanager
def watching(*arguments):
    """The command in a process of its own, and the address that it prints."""
    line = [sys.executable, "-m", "vedette", "watch", *map(str, arguments)]
    process = subprocess.Popen(line, stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True)
    try:
        yield process.stdout.readline().strip(), process
    finally:
        process.kill()
        process.communicate()


@pytest.mark.costly
def test_it_waits_until_somebody_has_seen_it_and_writes_what_a_run_writes(tmp_path):
    path = tmp_path / "config.json"
    path.write_text(json.dumps(config()))
    assert main(["run", str(path), "--stream", "--out", str(tmp_path / "run")]) == 0
    with watching(path, "--speed", "max", "--out", tmp_path / "watched", "--json") as (address, process):
        assert "somebody has seen the page" in process.stderr.readline()
        with urlopen(address + "events", timeout=60) as answer:
            text = answer.read()
        output, _ = process.communicate(timeout=60)
    assert text.endswith(b"event: ended\ndata: ended\n\n")
    assert b"id: 43\n" in text
    assert process.returncode == 0
    assert json.loads(output.splitlines()[-1])["scans_taken"] == 43
    assert files(tmp_path / "watched") == files(tmp_path / "run")


@pytest.mark.costly
def test_ctrl_c_ends_it_tells_the_page_and_keeps_what_is_done(tmp_path):
    with (
        watching(HARBOUR, "--out", tmp_path, "--json") as (address, process),
        urlopen(address + "events", timeout=60) as answer,
    ):
        while not answer.readline().startswith(b"id: "):
            pass
        process.send_signal(signal.SIGINT)
        assert answer.read().endswith(b"event: ended\ndata: interrupted\n\n")
        output, said = process.communicate(timeout=60)
    assert (process.returncode, said) == (130, "")
    found = json.loads(output.splitlines()[-1])
    assert found["interrupted"]
    assert len((tmp_path / "recording.jsonl").read_text().splitlines()) > found["scans_taken"] > 0


def test_in_the_terminal_it_shows_the_tracks(tmp_path, capsys):
    pytest.importorskip("rich", reason="needs rich, which is not installed")
    (tmp_path / "config.json").write_text(json.dumps(config()))
    assert main(["watch", str(tmp_path / "config.json"), "--terminal", "--speed", "max"]) == 0
    output = capsys.readouterr().out
    assert "A test" in output
    assert "existence" in output
    assert output.splitlines()[-1].startswith("43 scans, 2 confirmed tracks of")


@pytest.mark.parametrize(
    ("arguments", "told"),
    [
        (["--speed", "0"], "--speed: must be above 0, as in '10' for ten times as fast as recorded, or 'max', got '0'"),
        (["--port", "99999"], "--port: must be a whole number from 1 to 65535, got '99999'"),
        (["--terminal", "--port", "80"], "--port: is for the page, and --terminal shows none: give one of the two"),
        (["--terminal", "--underlay", "x"], "--underlay: is for the page, and --terminal shows none: give one of the two"),
        (["--underlay", "missing.geojson"], "missing.geojson: there is no such file"),
    ],
)
def test_wrong_use_is_told_in_a_line(arguments, told, capsys):
    assert main(["watch", HARBOUR, *arguments]) == 2
    assert capsys.readouterr().err == f"vedette: error: {told}\n"


@pytest.mark.costly
def test_a_camera_keeps_its_own_pace(tmp_path, capsys):
    cv2 = pytest.importorskip("cv2", reason="needs opencv, which is not installed")
    path = tmp_path / "clip.avi"
    writer = cv2.VideoWriter(str(path), cv2.VideoWriter_fourcc(*"FFV1"), 25.0, (48, 40), False)
    if not writer.isOpened():
        pytest.skip("this OpenCV writes no video")
    for i in range(5):
        frame = np.full((40, 48), 20, np.uint8)
        frame[15:21, 10 + i : 16 + i] = 200
        writer.write(frame)
    writer.release()
    source = {"kind": "video_stream", "address": str(path), "box": [11, 16, 6, 6]}
    example = tomllib.loads((EXAMPLES / "flir.toml").read_text())
    made = {name: value for name, value in example.items() if name != "judge"} | {"source": source}
    (tmp_path / "config.json").write_text(json.dumps(made))
    assert main(["watch", str(tmp_path / "config.json"), "--speed", "2"]) == 2
    assert "--speed: is for recordings: these scans" in capsys.readouterr().err
    with watching(tmp_path / "config.json", "--out", tmp_path / "out") as (address, process):
        with urlopen(address + "events", timeout=60) as answer:
            text = answer.read()
        process.communicate(timeout=60)
    assert process.returncode == 0
    assert b"id: 5\n" in text
    (shown,) = (json.loads(each[6:]) for each in text.split(b"\n") if b'"png"' in each and b'"scan": 4' in each)
    assert (shown["size"], shown["corner"]) == ([48, 40], [0.0, 0.0])
