"""The one door out: what is read is never written, one process writes at a time, former results stay until a run ends."""

import errno
import json
import os
import random
import signal
import subprocess
import sys
import zipfile
from time import sleep

import pytest

from support.commands import FILES, files
from support.results import config
from vedette.cli import main
from vedette.errors import ConfigError
from vedette_files import read_recording, read_series, read_tracks
from vedette_files.files_read import Inputs
from vedette_files.results import UNFINISHED, unfinished_runs
from vedette_files.writing import LOCK, locked
from vedette_report.commands import run as running
from vedette_report.running import streaming, track_files
from vedette_report.series import recorder as series


@pytest.fixture
def given(tmp_path, monkeypatch):
    """A config in a folder of its own, where commands run."""
    monkeypatch.chdir(tmp_path)
    (tmp_path / "config.json").write_text(json.dumps(config()))
    return tmp_path


@pytest.fixture
def ran(given):
    """A run whose results are in `out`."""
    assert main(["run", "config.json", "--out", "out", "--stream"]) == 0
    assert sorted(files(given / "out")) == FILES
    return given / "out"


def refused(capsys, *arguments):
    """The one line that a command is refused with."""
    capsys.readouterr()
    assert main([str(argument) for argument in arguments]) == 2
    *_, line = capsys.readouterr().err.splitlines()
    return line


@pytest.mark.parametrize("stream", [[], ["--stream"]])
@pytest.mark.parametrize("way", ["named", "linked file", "linked folder", "hard link"])
@pytest.mark.by_turns
def test_a_run_does_not_write_what_it_reads(ran, capsys, way, stream):
    source, out = ran / "recording.jsonl", ran
    if way == "linked file":
        source = ran.parent / "other.jsonl"
        source.symlink_to(ran / "recording.jsonl")
    if way == "linked folder":
        out = ran.parent / "same"
        out.symlink_to(ran)
    if way == "hard link":
        source = ran.parent / "other.jsonl"
        os.link(ran / "recording.jsonl", source)
    before = files(ran)
    told = refused(
        capsys, "run", "config.json", "--set", f"source={{ kind='jsonl', path='{source}' }}", "--out", out, *stream
    )
    assert "--out" in told
    assert str(source) in told
    assert str(out / "recording.jsonl") in told
    assert files(ran) == before


def test_a_table_that_is_named_as_a_result_is_not_overwritten(given, capsys):
    (given / "out").mkdir()
    table = given / "out" / "tracks.csv"
    table.write_text("t,x,y\n0,1,2\n1,2,3\n2,3,4\n")
    columns = "detections={ sensor='beacon', time='t', columns={ x='x', y='y' } }"
    source = f"source={{ kind='csv', path='{table}', {columns} }}"
    assert str(table) in refused(capsys, "run", "config.json", "--set", source, "--out", "out")
    assert table.read_text().startswith("t,x,y\n0,")


@pytest.mark.parametrize("stream", [[], ["--stream"]])
def test_results_are_not_written_through_links(ran, capsys, stream):
    precious = ran.parent / "precious.csv"
    precious.write_text("keep\n")
    (ran / "tracks.csv").unlink()
    (ran / "tracks.csv").symlink_to(precious)
    assert "tracks.csv" in refused(capsys, "run", "config.json", "--out", "out", *stream)
    assert precious.read_text() == "keep\n"


def test_a_linked_folder_is_followed(given):
    (given / "far").mkdir()
    (given / "out").symlink_to(given / "far")
    assert main(["run", "config.json", "--out", "out", "--stream"]) == 0
    assert (given / "out").is_symlink()
    assert sorted(files(given / "far")) == FILES


def test_a_link_to_no_folder_is_told(given, capsys):
    """It said that the file exists."""
    (given / "out").symlink_to("elsewhere")
    assert "'elsewhere'" in refused(capsys, "run", "config.json", "--out", "out/new")
    assert not (given / "elsewhere").exists()


@pytest.mark.parametrize("name", ["tracks.jsonl", "series.npz", "recording.jsonl", "config.json"])
@pytest.mark.by_turns
def test_a_page_or_an_export_does_not_take_the_place_of_its_run(ran, capsys, name):
    before = files(ran)
    assert name in refused(capsys, "report", "out", "--out", ran / name)
    if name == "tracks.jsonl":
        (ran / "tracks.csv").unlink()
        os.link(ran / "tracks.jsonl", ran.parent / "linked.csv")
        assert "linked.csv" in refused(capsys, "export", "out", "--to", "linked.csv")
        del before["tracks.csv"]
    assert files(ran) == before


@pytest.mark.parametrize(
    "command",
    [
        ["run", "config.json"],
        ["run", "config.json", "--stream"],
        ["consistency", "config.json"],
        ["tune", "config.json", "--free", "estimator.modes[0].motion.sigma_accel"],
        ["reproduce", "vts"],
    ],
)
@pytest.mark.costly
def test_a_second_process_is_refused(given, capsys, command):
    code = "import sys; from pathlib import Path; from vedette_files.writing import locked\n"
    code += "with locked(Path('out')): print('held', flush=True); sys.stdin.read()"
    with subprocess.Popen([sys.executable, "-c", code], stdin=-1, stdout=-1, text=True) as other:
        assert other.stdout.readline() == "held\n"
        told = refused(capsys, *command, "--out", "out")
        assert str(other.pid) in told
        assert "'out'" in told
        other.stdin.close()
        assert other.wait(60) == 0
    assert not (given / "out").exists(), "it made the folder, and it was empty"


def test_the_lock_of_a_killed_process_is_told_and_taken_over(given, capsys):
    (given / "out").mkdir()
    (given / "out" / LOCK).write_text(" 4711")
    with locked(given / "out"):
        assert "4711" in capsys.readouterr().err
        with pytest.raises(ConfigError, match=str(os.getpid())), locked(given / "out"):
            pass
    assert not list((given / "out").iterdir())


def test_an_input_is_known_by_its_number(tmp_path):
    (tmp_path / "data").mkdir()
    for name in ("a", "b"):
        (tmp_path / "data" / name).write_text(name)
    os.link(tmp_path / "data" / "b", tmp_path / "c")
    (tmp_path / "data" / "part").mkdir()
    (tmp_path / "data" / "part" / "e").write_text("e")
    source = {"path": str(tmp_path / "data"), "rate": 3.0, "title": "x" * 10_000, "about": "", "more": [{"file": "part/e"}]}
    inputs = Inputs.of({"source": source}, None, str(tmp_path))
    for path in (
        tmp_path / "data" / "a",
        tmp_path / "c",
        tmp_path / "data" / ".." / "data" / "b",
        tmp_path / "data" / "part" / "e",
    ):
        with pytest.raises(ConfigError):
            inputs.check(path)
    for name in ("d", "f"):
        (tmp_path / "f").write_text("f")
        inputs.check(tmp_path / name)


class Full:
    """A file on a disk that gets full."""

    def __init__(self, file):
        self._file = file

    def __getattr__(self, name):
        return getattr(self._file, name)

    def write(self, text):
        raise OSError(errno.ENOSPC, "No space left on device")

    writelines = write


@pytest.mark.parametrize("stream", [[], ["--stream"]])
def test_a_full_disk_is_told_and_former_results_stay(ran, capsys, monkeypatch, stream):
    before = files(ran)
    monkeypatch.setattr(series, "SCANS", 3)
    seen, original = [], track_files.TrackFiles.write

    def write(self, rows):
        original(self, rows)
        seen.append(rows)
        if not stream or len(seen) == 3:
            Full(self._csv).write("")

    monkeypatch.setattr(track_files.TrackFiles, "write", write)
    told = refused(capsys, "run", "config.json", "--out", "out", *stream)
    assert "No space left" in told
    left = unfinished_runs(ran)
    assert bool(left) == bool(stream), "of a run that goes on there is something to see"
    assert all(place.name in told for place in left)
    assert {name: content for name, content in before.items() if (ran / name).read_bytes() == content} == before


def test_a_folder_that_is_removed_meanwhile_is_told(given, capsys, monkeypatch):
    original = streaming.write_summaries

    def removed(folder, *arguments):
        for path in sorted((given / "out").rglob("*"), reverse=True):
            path.rmdir() if path.is_dir() else path.unlink()
        (given / "out").rmdir()
        return original(folder, *arguments)

    monkeypatch.setattr(streaming, "write_summaries", removed)
    assert UNFINISHED in refused(capsys, "run", "config.json", "--out", "out", "--stream")


@pytest.mark.costly
def test_of_a_run_that_is_replaced_nothing_is_left_and_of_others_all(ran, capsys):
    """Its smoothed tracks were exported as those of the run that took its place, and its page lay beside."""
    assert main(["run", "config.json", "--out", "out", "--smooth", "5 s", "--report", "--format", "svg"]) == 0
    assert {"smoothed.jsonl", "report.html", "picture.svg"} < set(files(ran))
    (ran / "notes.txt").write_text("mine")
    assert main(["run", "config.json", "--out", "out", "--stream"]) == 0
    assert sorted(files(ran)) == sorted([*FILES, "notes.txt"])
    assert "--smooth" in refused(capsys, "export", "out", "--smoothed", "--to", "a.csv")


@pytest.mark.costly
def test_a_run_that_fails_leaves_the_folder_as_it_was(ran, capsys, monkeypatch):
    before = files(ran)
    monkeypatch.setattr(running, "write_of_plugins", lambda *arguments: 1 / 0)
    with pytest.raises(ZeroDivisionError):
        main(["run", "config.json", "--out", "out"])
    assert files(ran) == before


def started(folder, *more, pause=0.0, stays=99):
    """A streamed run of small blocks in a process of its own, which pauses at each scan, and `stays` at one to be killed."""
    code = "import sys; from time import sleep; from vedette_report.series import recorder; recorder.SCANS = 2\n"
    code += "import vedette_report.running.growing as s; s.BLOCKS = 1; old = s.scan_line\n"
    code += "from itertools import count; scan = count(1)\n"
    code += f"s.scan_line = lambda *given: (sleep({pause} if next(scan) < {stays} else 600.0), old(*given))[1]\n"
    code += "from vedette.cli import main; sys.exit(main(sys.argv[1:]))"
    line = [sys.executable, "-c", code, "run", "config.json", "--out", "out", "--stream", *more]
    return subprocess.Popen(line, cwd=folder, stdout=subprocess.DEVNULL, stderr=subprocess.PIPE, text=True)


def assert_killed_run_is_seen(out, before, capsys):
    """What was there is as it was, and what is left of the killed run reads back, or says why not."""
    assert {name: (out / name).read_bytes() for name in before} == before
    for place in unfinished_runs(out):
        assert [path.name for path in place.iterdir()] != []
        if (place / "series.npz").exists():
            found = read_series(place / "series.npz").tables
            if not found:  # it was killed before its first complete block
                assert "series.npz: is empty" in refused(capsys, "report", str(place))
            elif scans := len(found["scans"]["time"]):
                read_tracks(place / "tracks.jsonl") if (place / "tracks.jsonl").read_text().endswith("\n") else None
                assert len(read_recording(place / "recording.jsonl")[0].scans) >= scans


@pytest.mark.costly
def test_a_killed_run_leaves_former_results_and_is_shown(ran, capsys):
    before = files(ran)
    with started(ran.parent, stays=40) as run:
        while not any(path.stat().st_size > 40_000 for path in ran.glob(f"{UNFINISHED}*/series.npz")):
            assert run.poll() is None
            sleep(0.01)
        run.kill()
    assert_killed_run_is_seen(ran, before, capsys)
    (place,) = unfinished_runs(ran)
    assert json.loads((place / "config.json").read_text())["title"] == config()["title"]
    for name in before:
        (ran / name).unlink()
    assert main(["report", "out"]) == 0
    assert place.name in capsys.readouterr().err
    assert (ran / "report.html").stat().st_size > 10_000
    assert main(["run", "config.json", "--out", "out", "--stream"]) == 0
    told = capsys.readouterr().err
    assert place.name in told
    assert "lock" in told
    assert {name: content for name, content in files_of(ran).items() if name in before} == before


@pytest.mark.parametrize("name", ["config.json", "recording.jsonl"])
def test_what_a_killed_run_left_from_which_nobody_can_go_on_is_removed(given, capsys, name):
    """Each later run told anew that --resume goes on from it: it refused to, or began anew what was killed at its end."""
    place = given / "out" / f"{UNFINISHED}1"
    place.mkdir(parents=True)
    (place / name).write_text("{}")
    assert main(["run", "config.json", "--out", "out", "--stream"]) == 0
    assert not place.exists()
    assert place.name not in capsys.readouterr().err


def test_a_run_that_was_killed_before_its_first_block_is_told(ran, capsys):
    place = ran / f"{UNFINISHED}1"
    place.mkdir()
    with zipfile.ZipFile(ran / "series.npz") as whole, zipfile.ZipFile(place / "series.npz", "w") as begun:
        begun.writestr("about.json", whole.read("about.json"))
    (ran / "series.npz").unlink()
    assert f"{place.name}/series.npz: is empty" in refused(capsys, "report", "out")


def files_of(folder):
    return {path.name: path.read_bytes() for path in folder.iterdir() if path.is_file()}


@pytest.mark.parametrize("kills", [3, pytest.param(100, marks=pytest.mark.nightly("kills many runs"))])
@pytest.mark.costly
def test_killed_at_any_moment_nothing_is_damaged(ran, capsys, kills):
    before, chance = files(ran), random.Random(kills)
    for _ in range(kills):
        with started(ran.parent, pause=0.1) as run:  # 43 scans: it does not end before it is killed
            sleep(chance.uniform(0.2, 3.0))
            run.send_signal(signal.SIGKILL)
        assert_killed_run_is_seen(ran, {name: (ran / name).read_bytes() for name in before}, capsys)
        assert files_of(ran).items() >= {name: content for name, content in before.items() if name != LOCK}.items()
