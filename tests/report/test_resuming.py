"""A streamed run that was killed is gone on from: its files are, byte for byte, those of one that nobody ended."""

import json
import os
import random
import shutil
import subprocess
import sys
import zipfile
from pathlib import Path

import attrs
import numpy as np
import pytest

import vedette
from support import killing
from support.commands import FILES, files
from support.results import config
from vedette import Detections, Source
from vedette.cli import main
from vedette.tracking import State
from vedette_files import read_series
from vedette_files.results import CHECKPOINT, UNFINISHED, WHOLE, results_in, unfinished_runs
from vedette_report import identity
from vedette_report.running import growing, lagging, streaming
from vedette_report.running.resuming import Former
from vedette_report.series import recorder as series

EXISTENCE = {"kind": "existence"}
KINDS = {
    "imm": {},
    "lmb": {"associator": {"kind": "lmb"}, "lifecycle": EXISTENCE},
    "k_best": {"associator": {"kind": "k_best"}, "lifecycle": EXISTENCE},
    "particles": {
        "estimator": {
            "kind": "bootstrap_particles",
            "motion": {"kind": "constant_velocity", "sigma_accel": 0.5},
            "particles": 200,
        }
    },
}


class Killed(BaseException):
    """Ends a run in its tracks, as SIGKILL does."""


@pytest.fixture(autouse=True)
def small(monkeypatch, tmp_path):
    """Blocks of three scans, and a state that is kept every second one."""
    monkeypatch.setattr(series, "SCANS", 3)
    monkeypatch.setattr(growing, "BLOCKS", 2)
    monkeypatch.chdir(tmp_path)


def write(name="config.json", **changes):
    Path(name).write_text(json.dumps(config(**changes)))


def ended_after(count):
    """What writes so many scans, and then ends the run."""
    written, original = iter(range(count)), growing.scan_line

    def line(*given):
        if next(written, None) is None:
            raise Killed
        return original(*given)

    return line


def killed(monkeypatch, after, *arguments):
    """Run a command that is ended when so many scans were written."""
    with monkeypatch.context() as patch:
        patch.setattr(growing, "scan_line", ended_after(after))
        with pytest.raises(Killed):
            main([*map(str, arguments)])


@pytest.fixture
def left(monkeypatch):
    """A run of `config.json` into `whole`, and one into `out` that was killed after 20 scans."""
    write()
    assert main(["run", "config.json", "--out", "whole", "--stream"]) == 0
    killed(monkeypatch, 20, "run", "config.json", "--out", "out", "--stream")
    (place,) = unfinished_runs(Path("out"))
    return place


def refused(capsys, *arguments):
    capsys.readouterr()
    assert main([str(argument) for argument in arguments]) == 2
    return capsys.readouterr().err


@pytest.mark.parametrize(("command", "streamed"), [("export", True), ("export", False), ("report", False)])
def test_who_asks_for_a_run_that_did_not_end_is_told_what_finishes_it(command, streamed, tmp_path, capsys):
    place = tmp_path / f"{UNFINISHED}1"
    place.mkdir()
    (place / (CHECKPOINT if streamed else "recording.jsonl")).write_text("{}")
    cure = f"`vedette run --resume {tmp_path}` finishes it" if streamed else "as it writes all at its end, run it again"
    more = ["--to", "x.kml"] if command == "export" else []
    assert f"RUN_DIR: the run in '{tmp_path}' did not end: {cure}" in refused(capsys, command, tmp_path, *more)


@pytest.mark.parametrize("kind", KINDS)
@pytest.mark.by_turns
def test_what_comes_out_is_what_an_undisturbed_run_leaves(kind, monkeypatch, capsys):
    write(**KINDS[kind])
    assert main(["run", "config.json", "--out", "whole", "--stream"]) == 0
    killed(monkeypatch, 14, "run", "config.json", "--out", "out", "--stream")
    killed(monkeypatch, 33, "run", "--resume", "out")
    assert len(unfinished_runs(Path("out"))) == 2
    assert main(["run", "--resume", "out"]) == 0
    assert "from scan 30" in capsys.readouterr().err
    assert sorted(files(Path("out"))) == FILES
    assert files(Path("out")) == files(Path("whole"))


@pytest.mark.parametrize("kind", ["imm", "k_best"])
@pytest.mark.costly
def test_a_run_that_smooths_goes_on_smoothing(kind, monkeypatch, capsys):
    """The states within the lag are kept with the last one, and what was smoothed is played again."""
    write(**KINDS[kind])
    smoothing = ("--stream", "--smooth", "3.3 s")
    assert main(["run", "config.json", "--out", "whole", *smoothing]) == 0
    killed(monkeypatch, 4, "run", "config.json", "--out", "out", *smoothing)
    killed(monkeypatch, 14, "run", "--resume", "out")
    killed(monkeypatch, 33, "run", "--resume", "out")
    capsys.readouterr()
    assert main(["run", "--resume", "out"]) == 0
    assert "from scan 30" in capsys.readouterr().err
    assert "smoothed.npz" in files(Path("out"))
    assert files(Path("out")) == files(Path("whole"))


def test_states_that_are_none_of_the_scans_that_wait_are_refused(monkeypatch, capsys):
    own = lagging.SmoothedFiles.to_data
    write()
    with monkeypatch.context() as patch:
        patch.setattr(lagging.SmoothedFiles, "to_data", lambda self: (told := own(self)) | {"states": told["states"][1:]})
        killed(monkeypatch, 14, "run", "config.json", "--out", "out", "--stream", "--smooth", "3.3 s")
    assert "states" in refused(capsys, "run", "--resume", "out")


@attrs.frozen
class Flawed(Source):
    """Scans of a simulation, some of them with a return that is no number, some once more when they are late."""

    kind = "flawed"

    def open(self, sensors, rng):
        recording = vedette.load(config()).source.open(sensors, rng)
        scans = list(recording.scans)
        for i in (8, 25):
            seen = scans[i].detections
            with_nan = Detections.of(np.concatenate([np.full((1, 2), np.nan), seen.z]))
            scans[i] = attrs.evolve(scans[i], detections=with_nan)
            scans.insert(i + 1, scans[i - 4])
        return attrs.evolve(recording, scans=tuple(scans))


@pytest.mark.costly
def test_scans_that_were_refused_or_lack_returns_stay_so(monkeypatch):
    """The source's scans are those of the recording without what was left out."""
    experiment = attrs.evolve(vedette.load(config()), source=Flawed())
    whole = streaming.stream(experiment, Path("whole"))
    assert whole.result.intake.refused.count == 4
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(growing, "scan_line", ended_after(20))
        with pytest.raises(Killed):
            streaming.stream(experiment, Path("out"))
    former = Former.of(Path("out"))
    assert former.scans < former.drawn
    again = streaming.stream(experiment, Path("out"), former=former)
    assert files(Path("out")) == files(Path("whole"))
    assert list(map(str, again.result.refused)) == list(map(str, whole.result.refused))
    assert again.result.intake.came["radar"].scans == whole.result.intake.came["radar"].scans


@pytest.mark.costly
def test_a_run_that_was_killed_before_it_kept_a_state_begins_anew(monkeypatch, left):
    killed(monkeypatch, 4, "run", "config.json", "--out", "early", "--stream")
    assert main(["run", "--resume", "early"]) == 0
    assert files(Path("early")) == files(Path("whole"))


@pytest.mark.costly
def test_the_config_may_be_named_and_is_compared(left, capsys):
    write(title="Another")
    told = refused(capsys, "run", "config.json", "--resume", "out")
    assert "title" in told
    assert '"Another"' in told
    write()
    assert main(["run", "config.json", "--resume", "out"]) == 0


@pytest.mark.costly
def test_other_code_is_refused_unless_it_is_accepted(left, capsys, monkeypatch):
    made = identity.identity
    monkeypatch.setattr(identity, "identity", lambda packages: made(packages) | {"sources of vedette": "0"})
    assert "sources of vedette" in refused(capsys, "run", "--resume", "out")
    assert main(["run", "--resume", "out", "--accept-other-code"]) == 0
    assert "sources of vedette" in capsys.readouterr().err


def test_a_state_of_another_version_says_which_and_what_to_do(left, capsys):
    path = left / CHECKPOINT
    path.write_text(path.read_text().replace('"version": 1', '"version": 99', 1))
    assert main(["run", "--resume", str(left.parent)]) == 2
    error = capsys.readouterr().err
    assert 'of version 1, got {"format": "vedette checkpoint", "version": 99' in error
    assert "run it anew, without --resume" in error


@pytest.mark.parametrize("option", ["--out=other", "--keep", "--smooth"])
@pytest.mark.by_turns
def test_options_that_make_no_sense_are_refused(left, capsys, option):
    assert option.partition("=")[0] in refused(capsys, "run", "--resume", "out", option)


@pytest.mark.costly
def test_where_there_is_nothing_to_go_on_from_it_is_told(left, capsys):
    assert "--resume" in refused(capsys, "run", "--resume", "whole")
    assert "CONFIG" in refused(capsys, "run")
    for name in ("recording.jsonl", "tracks.csv", "tracks.jsonl", "series.npz", CHECKPOINT):
        (left / name).unlink()
    assert left.name in refused(capsys, "run", "--resume", "out")


@pytest.mark.parametrize("name", [CHECKPOINT, "series.npz", "recording.jsonl", "config.json"])
@pytest.mark.by_turns
def test_damage_is_refused_with_its_file_and_harms_nothing(left, capsys, name):
    content = (left / name).read_bytes()
    chance = random.Random(3)
    for i in range(6):
        altered = bytearray(content)
        altered[chance.randrange(len(content) // 2)] ^= 1 << chance.randrange(8)
        (left / name).write_bytes(content[: len(content) // 3] if i == 0 else altered)
        code = main(["run", "--resume", "out"])
        if code == 2:
            assert str(left) in capsys.readouterr().err or name == "config.json"
            assert [path.name for path in Path("out").iterdir()] == [left.name]
        else:  # a byte that says nothing, as the time of day of a member
            assert code == 0
            assert name != CHECKPOINT
            if name != "config.json":
                assert files(Path("out")) == files(Path("whole"))
            return


@pytest.mark.costly
def test_a_source_that_gives_something_else_is_refused(left, capsys, monkeypatch):
    write("first.json")
    assert main(["run", "first.json", "--out", "first"]) == 0
    shutil.copy("first/recording.jsonl", "given.jsonl")
    write(source={"kind": "jsonl", "path": "given.jsonl"})
    killed(monkeypatch, 20, "run", "config.json", "--out", "other", "--stream")
    lines = Path("given.jsonl").read_text().splitlines()
    (number,) = [i for i, line in enumerate(lines) if '"sensor"' in line][3:4]
    told = json.loads(lines[number])
    lines[number] = json.dumps(told | {"time": told["time"] + 1e-9})
    Path("given.jsonl").write_text("\n".join(lines) + "\n")
    assert f"recording.jsonl:{number + 1}:" in refused(capsys, "run", "--resume", "other")


def test_a_state_that_cannot_be_written_is_refused_with_its_place(capsys, monkeypatch):
    def to_data(self):
        raise TypeError("state.belief.weights: a Tensor cannot be written")

    write()
    monkeypatch.setattr(State, "to_data", to_data)
    killed(monkeypatch, 20, "run", "config.json", "--out", "out", "--stream")
    assert "state.belief.weights" in refused(capsys, "run", "--resume", "out")
    assert main(["report", "out"]) == 0


@pytest.mark.costly
def test_series_whose_last_block_was_being_written_are_shown_and_gone_on_from(left, capsys):
    path = left / "series.npz"
    with zipfile.ZipFile(path) as whole:
        members = [member for member in whole.infolist() if member.filename.endswith(".2.npy")]
        cut = members[4].header_offset + 40
    path.write_bytes(path.read_bytes()[:cut])
    assert len(read_series(path)["scans"]["time"]) == 12
    assert main(["report", "out"]) == 0
    (Path("out") / "report.html").unlink()
    assert str(path) in refused(capsys, "run", "--resume", "out")
    shutil.copy(path, "elsewhere.npz")
    assert "elsewhere" in refused(capsys, "report", "elsewhere.npz")


@pytest.mark.parametrize("reader", ["a run", "report", "export"])
@pytest.mark.by_turns
@pytest.mark.costly
def test_a_run_that_was_killed_while_its_files_moved_is_whole_for_who_comes_next(reader, left, monkeypatch, capsys):
    """A page or an export was of files of two runs, and said nothing."""
    whole = files(Path("whole"))
    shutil.copytree("whole", "moving")
    (Path("moving") / "tracks.jsonl").write_text(Path("whole/tracks.jsonl").read_text().splitlines()[0])
    replace, moved = Path.replace, []

    def twice(self, target):
        if self.parent.name.startswith(UNFINISHED) and not self.name.startswith("."):
            if len(moved) == 2:
                raise Killed
            moved.append(target)
        return replace(self, target)

    with monkeypatch.context() as patch:
        patch.setattr(Path, "replace", twice)
        patch.setattr("vedette_files.results.rmtree", lambda *given, **options: None)
        with pytest.raises(Killed):
            main(["run", "config.json", "--out", "moving", "--stream"])
    (place,) = unfinished_runs(Path("moving"))
    assert (place / WHOLE).exists()
    if reader == "a run":
        with results_in(Path("moving")):
            assert files_of(Path("moving")) == whole
        return
    assert main([reader, "moving", *(["--to", "moved.csv"] if reader == "export" else [])]) == 0
    assert files_of(Path("moving")) == whole
    assert not unfinished_runs(Path("moving"))


def files_of(folder):
    return {path.name: path.read_bytes() for path in folder.iterdir() if path.is_file() and path.name in FILES}


def all_files(folder):
    """Return the content of a file, or of each file in a folder; how long something took is left out."""
    paths = [path for path in folder.rglob("*") if path.is_file()] if folder.is_dir() else [folder]
    return {str(path.relative_to(folder)): path.read_bytes() for path in paths}


@pytest.mark.parametrize("moves", range(len(FILES) + 2))
@pytest.mark.by_turns
def test_a_run_that_was_killed_while_its_files_moved_has_ended(monkeypatch, capsys, moves):
    """After any number of moves and deletions; what goes on from it puts the rest in its place."""
    write()
    assert main(["run", "config.json", "--out", "whole", "--stream"]) == 0
    left = iter([None] * moves)

    def till_killed(change):
        def once(*given):
            if next(left, 0) == 0:
                raise Killed
            return change(*given)

        return once

    def ends():
        with results_in(Path("out")) as results:
            for path in Path("whole").iterdir():
                shutil.copy(path, results.place / path.name)
            (results.place / CHECKPOINT).write_text("{}")

    with monkeypatch.context() as patch:
        for name in ("replace", "unlink", "rmdir"):
            patch.setattr(f"vedette_files.results.Path.{name}", till_killed(getattr(Path, name)))
        patch.setattr("vedette_files.results.rmtree", lambda *given, **more: None)
        with pytest.raises(Killed):
            ends()
    assert unfinished_runs(Path("out"))
    assert main(["run", "--resume", "out"]) == 0
    assert "had come to its end" in capsys.readouterr().err
    assert files(Path("out")) == files(Path("whole"))
    assert not list(Path("out").glob(f"{UNFINISHED}*"))


@pytest.mark.parametrize(
    ("command", "name", "kills"),
    [
        (["run", "config.json", "--stream"], "out", 3),
        pytest.param(["run", "config.json", "--stream"], "out", 100, marks=pytest.mark.nightly("kills many runs")),
        pytest.param(["study", "study.json", "--threads", "1"], "out", 60, marks=pytest.mark.nightly("kills many studies")),
        pytest.param(["export", "whole"], "a.kml", 60, marks=pytest.mark.nightly("kills many exports")),
    ],
)
@pytest.mark.costly
def test_killed_at_any_moment_it_comes_to_the_same_end(command, name, kills):
    write()
    Path("study.json").write_text(json.dumps({"experiment": config(), "runs": 6, "chunk": 1}))
    if command[0] == "export":
        assert main(["run", "config.json", "--out", "whole", "--set", "source.ships.near.speed=3"]) == 0
        command = [*command, "--origin", "59,10", "--epoch", "2026-01-01T00:00:00Z"]
    line = [sys.executable, "-m", "support.killing", kills, 1, name, *command]
    where = os.environ | {"PYTHONPATH": str(Path(killing.__file__).parents[1])}
    done = subprocess.run([str(each) for each in line], env=where, capture_output=True, text=True, check=False, timeout=1800)
    assert done.returncode == 0, done.stderr[-2000:]
    killed_runs, chains = map(int, done.stdout.split())
    assert killed_runs >= kills
    place = Path(name)
    wanted = all_files(place.with_name(f"{place.stem}-whole{place.suffix}"))
    for i in range(chains):
        found = all_files(place.with_name(f"{place.stem}-{i}{place.suffix}"))
        found = {
            each: content for each, content in found.items() if not each.startswith(".run-")
        }  # killed before it kept a state
        assert {each for each in found.keys() | wanted.keys() if found.get(each) != wanted.get(each)} == set()
