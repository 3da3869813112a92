"""`vedette run` over many scans: judged and written as it goes by itself, unless it is told to keep all."""

import pytest

from support.commands import files
from vedette.cli import main
from vedette_report.commands import run as command

PICTURES = {"errors.png", "picture.png"}


@pytest.mark.parametrize("most", ["LONG", "MANY"])
@pytest.mark.by_turns
@pytest.mark.costly
def test_a_run_of_many_scans_or_returns_keeps_nothing_and_says_what_it_leaves_out(
    config, tmp_path, monkeypatch, capsys, most
):
    """200 scans of 5,000 objects each took 2 GB, and ten times as many none could keep."""
    assert main(["run", str(config), "--out", str(tmp_path / "short")]) == 0
    monkeypatch.setattr(command, most, 30)
    assert main(["run", str(config), "--out", str(tmp_path / "long")]) == 0
    assert "keeps no history" in capsys.readouterr().err
    short, long = files(tmp_path / "short"), files(tmp_path / "long")
    assert set(short) - set(long) == PICTURES
    for name in ("recording.jsonl", "config.json"):
        assert long[name] == short[name], name
    assert sorted(long["tracks.csv"].splitlines()) == sorted(short["tracks.csv"].splitlines())


def test_it_keeps_all_when_it_is_told_to_or_must(config, tmp_path, monkeypatch, undrawn):
    monkeypatch.setattr(command, "LONG", 30)
    for i, option in enumerate(("--keep", "--strict", "--smooth")):
        assert main(["run", str(config), option, "--out", str(tmp_path / str(i))]) == 0
        lines = files(tmp_path / str(i))["tracks.csv"].splitlines()[1:]
        assert lines == sorted(lines, key=lambda line: int(line.split(b",")[0])), "track by track"


def test_stream_and_keep_exclude_each_other(config, capsys):
    assert main(["run", str(config), "--stream", "--keep"]) == 2
    assert "--stream: keeps nothing of the past" in capsys.readouterr().err
