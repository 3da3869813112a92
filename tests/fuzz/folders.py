"""Folders that commands left, with one of their files changed, and commands that read them again.

Finished and unfinished runs and studies; reports, exports, going on. Whatever comes of it is an exit code with one line, and
what else the folder holds stays as it was.
"""

from __future__ import annotations

import io
import json
import shutil
import tempfile
from contextlib import contextmanager, redirect_stderr, redirect_stdout
from functools import cache
from pathlib import Path

import numpy as np

from fuzz.cases import pick
from fuzz.results import changed
from fuzz.trees import mutated
from support.results import config
from vedette.cli import main
from vedette.commands.exit_codes import DONE, WRONG
from vedette_report.running import growing
from vedette_report.series import recorder as series

RUN, LEFT, STUDY = "run", "left", "study"
COMMANDS = {
    RUN: (["report", RUN], ["export", RUN, "--to", "a.kml"], ["export", RUN, "--to", "a.csv"], ["run", "config.json"]),
    LEFT: (["report", LEFT], ["run", "--resume", LEFT], ["run", "config.json", "--resume", LEFT]),
    STUDY: (["report", STUDY], ["study", "study.json", "--out", STUDY, "--resume", "--threads", "1"]),
}


class Killed(BaseException):
    """Ends a run where it stands."""


@cache
def made() -> Path:
    """Return a folder with a run, one that was killed, and a study, each of which takes a moment."""
    folder = Path(tempfile.mkdtemp(prefix="vedette-fuzz-"))
    experiment = config()
    (folder / "config.json").write_text(json.dumps(experiment))
    study = {"experiment": experiment, "runs": 4, "chunk": 2}
    (folder / "study.json").write_text(json.dumps(study))
    with at(folder):
        for line in (
            ["run", "config.json", "--stream", "--out", RUN],
            ["study", "study.json", "--out", STUDY, "--threads", "1"],
        ):
            assert quiet(line)[0] == DONE
        killed()
    return folder


def killed() -> None:
    """Leave an unfinished run."""
    original, blocks, written = growing.scan_line, (series.SCANS, growing.BLOCKS), iter(range(30))

    def line(*given):  # type: ignore[no-untyped-def]
        if next(written, None) is None:
            raise Killed
        return original(*given)

    growing.scan_line, series.SCANS, growing.BLOCKS = line, 4, 2
    try:
        quiet(["run", "config.json", "--stream", "--out", LEFT])
    except Killed:
        pass
    finally:
        growing.scan_line, (series.SCANS, growing.BLOCKS) = original, blocks


@contextmanager
def at(folder: Path):  # type: ignore[no-untyped-def]
    """Work in a folder."""
    import os

    before = Path.cwd()
    os.chdir(folder)
    try:
        yield
    finally:
        os.chdir(before)


def quiet(line: list[str]) -> tuple[int, str]:
    """Run a command; return its exit code, and what it told on standard error."""
    out, told = io.StringIO(), io.StringIO()
    with redirect_stdout(out), redirect_stderr(told):
        code = main(line)
    return code, told.getvalue()


def case(rng: np.random.Generator, folder: Path) -> str:
    """Change a file and run a command."""
    what = pick(rng, list(COMMANDS))
    with tempfile.TemporaryDirectory(dir=folder) as place, at(Path(place)):
        own = Path(place)
        shutil.copytree(made(), own, dirs_exist_ok=True)
        files = sorted(path for path in (own / what).rglob("*") if path.is_file())
        spoiled = pick(rng, files)
        spoil(rng, spoiled)
        before = {path: path.read_bytes() for path in files if path.exists()}
        line = pick(rng, list(COMMANDS[what]))
        code, told = quiet(line)
        if code != DONE:
            assert code == WRONG, f"{line}: exit code {code}: {told[:300]}"
            assert "vedette: error: " in told, f"{line} says nothing: {told[:300]}"
            lost = [path.name for path, data in before.items() if not path.exists() or path.read_bytes() != data]
            assert not lost or what == STUDY, f"{line}, {spoiled.name} changed: refused, and {lost} are not as they were"
    return "done" if code == DONE else "refused"


def spoil(rng: np.random.Generator, path: Path) -> None:
    """Change, cut, empty or delete a file, or what a table says in it."""
    data, how = path.read_bytes(), rng.random()
    if how < 0.05:
        path.unlink()
    elif how < 0.1:
        path.write_bytes(b"")
    elif how < 0.4 and path.suffix in (".json", ".jsonl"):
        lines = data.decode().splitlines() if path.suffix == ".jsonl" or path.name.startswith(".") else [data.decode()]
        at = int(rng.integers(len(lines)))
        lines[at] = json.dumps(mutated(rng, json.loads(lines[at]), [json.loads(lines[0])]), default=str)
        path.write_text("\n".join(lines) + "\n", encoding="utf-8", errors="replace")
    else:
        path.write_bytes(changed(rng, data))
