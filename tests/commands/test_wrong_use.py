"""Wrong use is told without a traceback, before anything is written."""

import errno
import importlib.metadata
import os
import re
import subprocess
import sys
from pathlib import Path

import pytest

from support.commands import command
from vedette.cli import main
from vedette_files.writing import whole_file

WRONG = {
    "no such file": (lambda path: ["run", path.with_name("none.toml")], "there is no such file"),
    "not a config": (lambda path: ["run", path.parent], "is a folder"),
    "a typo": (lambda path: ["run", path, "--set", "gate.probabilty=0.9"], "did you mean 'probability'?"),
    "a kind that is not there": (lambda path: ["run", path, "--set", "associator.kind=gn"], "did you mean 'gnn'?"),
    "a wrong sign": (lambda path: ["run", path, "--set", "sensors.radar.sigma=-1"], "must be > 0, got -1 m"),
    "an override without a value": (lambda path: ["run", path, "--set", "seed"], "--set seed"),
    "a seed that is no number": (lambda path: ["run", path, "--seed", "x"], "seed: must be a number"),
    "no recording": (
        lambda path: ["run", path, "--set", "source.kind=jsonl", "--set", "source.path=none"],
        f"source.path: there is no file or folder 'none', as paths begin in the current folder, '{Path.cwd().anchor}",
    ),
    "a recording of another format": (
        lambda path: ["run", path, "--set", "source.kind=jsonl", "--set", f"source.path={path}"],
        "ships.toml:1: ",
    ),
    "an output that is a file": (lambda path: ["run", path, "--out", path], "is a file, and results need a folder"),
    "an output inside a file": (lambda path: ["run", path, "--out", path / "deep" / "er"], "is a file, and results need"),
    "no name": (lambda path: ["new", "config", ""], ".: is a folder"),
    "a draft of another format": (lambda path: ["new", "config", path, "--out", "c.yaml"], "--out: must end in .toml"),
    "a report of what is no folder": (lambda path: ["report", path], "ships.toml: is a file; must be the folder that"),
    "a report of nothing": (
        lambda path: ["report", "none"],
        "error: none: there is no such folder; must be the folder that",
    ),
    "a draft for a config": (
        lambda path: ["new", "config", path],
        "ships.toml: is a config, not data; `vedette run` runs it",
    ),
    "no such role": (lambda path: ["components", "motions"], "did you mean 'motion'?"),
}


@pytest.mark.parametrize("case", WRONG, ids=str)
def test_what_is_wrong_is_told_without_a_traceback_before_anything_is_written(case, config, tmp_path, monkeypatch, capsys):
    arguments, expected = WRONG[case]
    monkeypatch.chdir(tmp_path)
    before = sorted(tmp_path.rglob("*"))
    assert main(list(map(str, arguments(config)))) == 2
    told = capsys.readouterr()
    assert told.out == ""
    assert expected in told.err
    assert all(line.startswith("vedette: error: ") for line in told.err.splitlines())
    assert sorted(tmp_path.rglob("*")) == before


def test_all_problems_of_a_config_are_told_one_a_line(config, capsys):
    wrong = ["--set", "sensors.radar.sigma=-1", "--set", "gate.probability=2", "--set", "judge.cover_radius=0"]
    assert main(["run", str(config), *wrong]) == 2
    told = capsys.readouterr().err.splitlines()
    assert [line.split(": ")[2] for line in told] == ["sensors.radar.sigma", "gate.probability", "judge.cover_radius"]


@pytest.mark.costly
def test_the_process_ends_with_the_code(config, tmp_path):
    done = command("run", config, "--set", "associator.kind=gn", cwd=tmp_path)
    assert (done.returncode, done.stdout) == (2, "")
    assert "Traceback" not in done.stderr
    assert done.stderr.startswith("vedette: error: associator.kind: ")
    assert not (tmp_path / "out").exists()


def test_a_file_that_cannot_be_written_is_told(config, tmp_path, capsys, undrawn):
    (tmp_path / "results" / "tracks.csv").mkdir(parents=True)
    (tmp_path / "results" / "tracks.csv" / "mine.txt").write_text("mine")
    assert main(["run", str(config), "--out", str(tmp_path / "results")]) == 2
    assert re.fullmatch(r"vedette: error: .*tracks\.csv.*: Is a directory\n", capsys.readouterr().err)
    assert [path.name for path in (tmp_path / "results").rglob("*")] == ["tracks.csv", "mine.txt"]


@pytest.mark.parametrize("arguments", [[], ["fly"], ["explain"], ["run", "a.toml", "--sed", "1"]])
def test_wrong_use_shows_the_usage(arguments, capsys):
    with pytest.raises(SystemExit) as ended:
        main(arguments)
    assert ended.value.code == 2
    assert "usage: vedette" in capsys.readouterr().err


def test_the_version_is_the_distributions(capsys):
    with pytest.raises(SystemExit) as ended:
        main(["--version"])
    assert ended.value.code == 0
    assert capsys.readouterr().out == f"vedette {importlib.metadata.version('vedette')}\n"


@pytest.mark.costly
def test_a_reader_that_goes_away_is_no_error():
    reading, writing = os.pipe()
    os.close(reading)
    line = [sys.executable, "-m", "vedette", "schema"]
    done = subprocess.run(line, stdout=writing, stderr=subprocess.PIPE, text=True, timeout=300)
    os.close(writing)
    assert (done.returncode, done.stderr) == (141, "")


PRESSED = """
import sys
class Pressed:
    def find_spec(self, name, path, target=None):
        if name == "numpy.linalg":
            sys.meta_path.remove(self)
            raise KeyboardInterrupt
sys.meta_path.insert(0, Pressed())
from vedette.cli import main
sys.exit(main(["info"]))
"""


@pytest.mark.costly
def test_ctrl_c_while_libraries_are_loaded_is_no_traceback():
    """Most of the time that a command takes to begin, numpy is being loaded."""
    done = subprocess.run([sys.executable, "-c", PRESSED], stderr=subprocess.PIPE, text=True, timeout=300)
    assert (done.returncode, done.stderr) == (130, "vedette: interrupted\n")


def test_commands_to_type_name_a_path_with_blanks_as_a_shell_reads_it(tmp_path, monkeypatch, capsys):
    """They were to be pasted, and named other files."""
    monkeypatch.chdir(tmp_path)
    assert main(["new", "plugin", "road", "--out", "my lake"]) == 0
    assert "cd 'my lake'; " in capsys.readouterr().out
    Path("my lake.csv").write_text("0,1.5,2.5\n1,2.5,3.5\n")
    assert main(["new", "config", "my lake.csv"]) == 2
    assert "; tail -n +1 'my lake.csv')" in capsys.readouterr().err
    Path("my run/.run-1").mkdir(parents=True)
    for name in ("recording.jsonl", ".checkpoint.json"):
        (Path("my run/.run-1") / name).touch()
    assert main(["report", "my run"]) == 2
    assert "--resume 'my run'`" in capsys.readouterr().err


MEANT = {
    "a command": (["runn", "c.toml"], "invalid choice: 'runn'", "did you mean run?"),
    "an option": (["run", "c.toml", "--frmat", "svg"], "vedette run: error: unknown: --frmat svg", "did you mean --format?"),
    "a second word": (["new", "confg", "d.csv"], "invalid choice: 'confg'", "did you mean config?"),
    "no command, but data": (["d.csv"], "invalid choice: 'd.csv'", "`vedette new config d.csv` drafts a config for it"),
}


@pytest.mark.parametrize("case", MEANT)
def test_a_misspelled_word_gets_the_one_that_was_meant(case, capsys):
    arguments, *told = MEANT[case]
    with pytest.raises(SystemExit) as ended:
        main(arguments)
    assert ended.value.code == 2
    last = capsys.readouterr().err.splitlines()[-1]
    assert all(text in last for text in told)


@pytest.mark.parametrize(
    ("redirected", "code", "told"),
    [
        (">&-", 0, ""),
        ("2>&- >/dev/null", 0, ""),
        (">/dev/full", 2, "vedette: error: a file or the output: No space left on device\n"),
    ],
)
@pytest.mark.costly
def test_closed_streams_and_full_ones_end_without_a_traceback(redirected, code, told):
    line = ["sh", "-c", f'"$0" -m vedette completions bash {redirected}', sys.executable]
    done = subprocess.run(line, stderr=subprocess.PIPE, text=True)
    assert (done.returncode, done.stderr) == (code, told)


def test_a_name_that_is_no_text_is_told(tmp_path, monkeypatch, capsys):
    monkeypatch.chdir(tmp_path)
    name = os.fsdecode(b"Me\xdfwerte.csv")
    Path(name).write_text("t,x,y\n0,1,2\n")
    assert main(["new", "config", name]) == 2
    assert "cannot be written in utf-8" in capsys.readouterr().err


def test_a_disk_that_is_full_names_the_file(tmp_path):
    with pytest.raises(OSError, match="No space left") as full, whole_file(tmp_path / "a.txt"):
        raise OSError(errno.ENOSPC, os.strerror(errno.ENOSPC))
    assert full.value.filename == str(tmp_path / "a.txt")
