"""A third party's command, picture and name of `vedette` come by the doors that Vedette's own come by."""

import json
import re
import sys

import pytest

import vedette
from vedette.cli import main
from vedette.errors import PluginError
from vedette_tools.json_schema import schema

GREET = '''
from typing import ClassVar
from attrs import frozen
import vedette

VEDETTE_CONTRACT = 2


@frozen
class Greet(vedette.Command):
    """Greet somebody by name.

    It is of no further use.
    """

    kind: ClassVar[str] = "KIND"

    def options(self, parser):
        parser.add_argument("name", metavar="NAME", help="who is greeted")
        parser.add_argument("--tone", choices=["warm", "cool"], default="warm", help="how warmly")
        BROKEN

    def run(self, arguments):
        RUNNING
        print(f"{arguments.name}, {arguments.tone}")
        return 3


@frozen
class Dots(vedette.Picture):
    """Times of the scans."""

    kind: ClassVar[str] = "dots"

    def draw(self, subject):
        from matplotlib.figure import Figure

        DRAWING
        figure = Figure()
        figure.subplots().plot([scan.time for scan in subject.scans])
        return figure


def welcome():
    return "welcome"


@vedette.plugin
def vedette_components():
    return [Greet, Dots]


@vedette.plugin
def vedette_warnings(intake, recording, sensors):
    WARNING
    return [f"odd-{intake.scans}"]
'''


@pytest.fixture
def greeting(tmp_path, monkeypatch):
    """Install a distribution whose command has this kind."""
    monkeypatch.syspath_prepend(tmp_path)

    def install(kind="greet", broken="", drawing="", warning="", running="", names="welcome = vedette_test_greet:welcome"):
        info = tmp_path / "greet-1.0.dist-info"
        info.mkdir()
        (info / "METADATA").write_text("Metadata-Version: 2.1\nName: greet\nVersion: 1.0\n")
        (info / "entry_points.txt").write_text(f"[vedette]\ngreet = vedette_test_greet\n[vedette.names]\n{names}\n")
        source = (
            GREET.replace("KIND", kind).replace("BROKEN", broken).replace("DRAWING", drawing).replace("RUNNING", running)
        )
        (tmp_path / "vedette_test_greet.py").write_text(source.replace("WARNING", warning))

    yield install
    sys.modules.pop("vedette_test_greet", None)
    vars(vedette).pop("welcome", None)


def test_it_stands_in_help_completions_and_schema_and_runs(greeting, capsys):
    greeting()
    with pytest.raises(SystemExit):
        main(["--help"])
    assert re.search(r"greet\s+greet somebody by name", capsys.readouterr().out)
    with pytest.raises(SystemExit):
        main(["greet", "--help"])
    assert "of no further use" in capsys.readouterr().out
    for shell in ("bash", "zsh", "fish"):
        assert main(["completions", shell]) == 0
        assert "--tone" in capsys.readouterr().out.replace("-l tone", "--tone").replace("-l 'tone'", "--tone")
    options = schema()["$defs"]["command.greet"]["properties"]
    assert options["tone"] == {"description": "how warmly", "enum": ["warm", "cool"]}
    assert main(["greet", "Ada", "--tone", "cool"]) == 3
    assert capsys.readouterr().out == "Ada, cool\n"


def test_a_command_that_two_bring_is_no_ones(greeting, capsys):
    greeting(kind="info")
    with pytest.raises(SystemExit):
        main(["info"])
    told = capsys.readouterr().err
    assert "greet 1.0" in told
    assert "vedette 0.1.0" in told


def test_one_whose_options_fail_harms_no_other(greeting, capsys):
    greeting(broken="raise RuntimeError('no pen')")
    assert main(["info", "--json"]) == 0
    told = capsys.readouterr()
    assert "no pen" in told.err
    assert "'greet'" in told.err
    assert json.loads(told.out)["vedette"]


def test_one_that_fails_ends_in_a_line_that_names_it(greeting, capsys):
    """It was a traceback with exit code 1, which says that a law failed."""
    greeting(running="[][1]")
    assert main(["greet", "Ada"]) == 2
    told = capsys.readouterr().err
    assert told.count("\n") == 1, told
    assert "greet (vedette_test_greet.Greet).run" in told
    assert "IndexError" in told
    assert "(vedette_test_greet.py:" in told
    assert "vedette check" not in told  # there are no laws of commands
    assert main(["--traceback", "greet", "Ada"]) == 2
    assert "Traceback" in capsys.readouterr().err


@pytest.mark.parametrize("running", ["raise SystemExit(7)", "import sys; sys.exit(7)"])
def test_one_may_end_the_process_with_its_own_code(greeting, running):
    greeting(running=running)
    with pytest.raises(SystemExit, match="7"):
        main(["greet", "Ada"])


def test_a_fault_of_vedettes_own_command_keeps_its_traceback(monkeypatch):
    monkeypatch.setattr("vedette.commands.own.Info.run", lambda self, arguments: [][1])
    with pytest.raises(IndexError):
        main(["info"])


@pytest.mark.costly
def test_its_picture_is_drawn_of_every_run(greeting, config, tmp_path):
    pytest.importorskip("matplotlib")
    greeting()
    assert main(["run", str(config), "--out", str(tmp_path / "out")]) == 0
    assert (tmp_path / "out" / "dots.png").stat().st_size > 1000


@pytest.mark.costly
def test_a_picture_that_fails_is_told_and_costs_the_run_nothing(greeting, config, tmp_path, capsys):
    pytest.importorskip("matplotlib")
    greeting(drawing="raise ValueError('no ink')")
    assert main(["run", str(config), "--out", str(tmp_path / "out")]) == 0
    told = capsys.readouterr()
    assert "'dots' of greet 1.0" in told.err
    assert "no ink" in told.err
    assert "coverage" in told.out
    assert (tmp_path / "out" / "picture.png").exists()


@pytest.mark.parametrize("command", ["run", "consistency"])
@pytest.mark.parametrize(("warning", "told"), [("", r"odd-\d+"), ("raise ValueError('no eyes')", r"of greet 1\.0.*no eyes")])
@pytest.mark.by_turns
def test_its_warning_is_told_wherever_a_recording_is_read_and_a_failing_one_harms_nothing(
    greeting, config, tmp_path, capsys, undrawn, command, warning, told
):
    greeting(warning=warning)
    assert main([command, str(config), "--out", str(tmp_path / "out")]) == 0
    assert re.search(told, " ".join(capsys.readouterr().out.split()))


def test_its_name_is_vedettes(greeting):
    greeting()
    assert vedette.welcome() == "welcome"
    assert "welcome" in dir(vedette)


def test_a_name_that_cannot_be_had_names_who_brings_it(greeting):
    greeting(names="welcome = vedette_test_nowhere:welcome")
    with pytest.raises(PluginError, match=r"vedette\.welcome .*vedette_test_nowhere:welcome of greet"):
        vedette.welcome  # noqa: B018


def test_a_name_that_two_bring_is_refused_with_both(greeting):
    greeting(names="track = vedette_test_greet:welcome")
    vars(vedette).pop("track", None)
    with pytest.raises(PluginError) as refused:
        vedette.track  # noqa: B018
    assert "vedette_test_greet:welcome" in str(refused.value)
    assert "vedette_tools" in str(refused.value)
