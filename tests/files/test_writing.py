"""Files are written whole or not at all, and what a killed process left of one is used up."""

import os
import signal
import subprocess
import sys

import pytest

from vedette_files import writing
from vedette_files.writing import whole_file, write_text

KILLED = """
import os, signal, sys
from pathlib import Path
from vedette_files.writing import whole_file
with whole_file(Path(sys.argv[1])) as file:
    file.write("half" * 10_000)
    os.kill(os.getpid(), signal.SIGKILL)
"""


@pytest.mark.skipif(sys.platform == "win32", reason="there a name is never used again")
def test_what_a_killed_process_left_of_a_file_is_used_up(tmp_path):
    """Each kill left a file that nothing removed."""
    for _ in range(2):
        assert subprocess.run([sys.executable, "-c", KILLED, tmp_path / "a.txt"]).returncode == -signal.SIGKILL
    assert len(list(tmp_path.iterdir())) == 1
    write_text(tmp_path / "a.txt", "whole")
    assert {path.name: path.read_text() for path in tmp_path.iterdir()} == {"a.txt": "whole"}


def test_two_who_write_a_file_at_once_each_write_it_whole(tmp_path):
    with whole_file(tmp_path / "a.txt") as first:
        first.write("first, ")
        first.flush()
        write_text(tmp_path / "a.txt", "second")
        assert (tmp_path / "a.txt").read_text() == "second"
        first.write("and longer")
    assert {path.name: path.read_text() for path in tmp_path.iterdir()} == {"a.txt": "first, and longer"}


def test_what_has_just_got_its_name_is_not_emptied(tmp_path, monkeypatch):
    """A process may open what another one writes, wait, and find it free when it is whole and elsewhere."""
    opened = os.open

    def too_late(place, flags, mode=0o777):
        file = opened(place, flags, mode)
        if place.name == ".a.txt.part" and not (tmp_path / "b.txt").exists():
            place.replace(tmp_path / "b.txt")
            (tmp_path / "b.txt").write_text("whole")
        return file

    monkeypatch.setattr(writing.os, "open", too_late)
    write_text(tmp_path / "a.txt", "mine")
    assert {path.name: path.read_text() for path in tmp_path.iterdir()} == {"a.txt": "mine", "b.txt": "whole"}


@pytest.mark.parametrize("error", [OSError, BlockingIOError])
@pytest.mark.skipif(sys.platform == "win32", reason="there no file is locked")
def test_without_a_lock_a_file_is_written_under_a_name_of_its_own(tmp_path, monkeypatch, error):
    def refused(*_):
        raise error

    monkeypatch.setattr("fcntl.flock", refused)
    write_text(tmp_path / "a.txt", "whole")
    assert (tmp_path / "a.txt").read_text() == "whole"
    assert len(list(tmp_path.iterdir())) == (2 if error is BlockingIOError else 1)  # another one's is not ours to remove


def test_an_error_names_the_file_that_was_to_be_written(tmp_path):
    with pytest.raises(FileNotFoundError) as raised:
        write_text(tmp_path / "nowhere" / "a.txt", "whole")
    assert raised.value.filename == str(tmp_path / "nowhere" / "a.txt")
