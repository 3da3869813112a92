"""What shells offer after TAB: bash is asked; the grammar of zsh and fish is checked where they are installed."""

import re
import shutil
import subprocess
from argparse import _SubParsersAction

import pytest

from vedette.cli import _parser
from vedette_tools.commands.completions import completion_script


@pytest.fixture(scope="module")
def scripts():
    return {shell: completion_script(_parser(), shell) for shell in ("bash", "zsh", "fish")}


def offered(script, folder, *words):
    """Return what bash offers for the last of some words."""
    line = " ".join(f"'{word}'" for word in ("vedette", *words))
    asked = f'{script}\nCOMP_WORDS=({line}); COMP_CWORD={len(words)}; _shtab_vedette; printf "%s\\n" "${{COMPREPLY[@]}}"'
    done = subprocess.run(["bash", "-c", asked], cwd=folder, capture_output=True, text=True, check=True, timeout=60)
    assert not done.stderr
    return set(done.stdout.split())


@pytest.mark.skipif(not shutil.which("bash"), reason="bash is not installed")
def test_bash_offers_commands_options_files_and_kinds(scripts, tmp_path):
    for name in ("harbour.toml", "plots.csv", "notes.txt"):
        (tmp_path / name).touch()
    (tmp_path / "runs").mkdir()

    def ask(*words):
        return offered(scripts["bash"], tmp_path, *words)

    assert {"run", "new", "check", "completions"} <= ask("")
    assert ask("re") == {"replay", "report", "reproduce"}
    assert ask("run", "") == {"harbour.toml", "runs"}
    assert {"--out", "--smooth", "--set"} <= ask("run", "harbour.toml", "--")
    assert ask("run", "harbour.toml", "--out", "") == {"runs"}
    assert ask("run", "--format", "") == {"png", "svg", "pdf"}
    assert ask("new", "") == {"config", "plugin"}
    assert ask("new", "config", "") == {"plots.csv", "runs"}
    assert ask("new", "config", "--o") == {"--out"}
    assert {"ekf", "motion", "constant_velocity"} <= ask("components", "")
    assert ask("check", "constant_vel") == {"constant_velocity", "constant_velocity_piecewise"}
    assert ask("check", "har") == {"harbour.toml"}
    assert "vts" in ask("reproduce", "")
    assert ask("completions", "") == {"bash", "zsh", "fish"}
    assert ask("run", "check", "--pro") == set()  # a config of that name: its options are those of `run`


def places(parser, path=()):
    """Yield the words of each command, with its options."""
    yield path, [flag for action in parser._actions for flag in action.option_strings]
    for action in parser._actions:
        if isinstance(action, _SubParsersAction):
            for name, below in action.choices.items():
                yield from places(below, (*path, name))


@pytest.mark.parametrize("shell", ["bash", "zsh", "fish"])
def test_each_script_knows_each_command_and_option(shell, scripts):
    script = scripts[shell]
    for path, flags in places(_parser()):
        assert [word for word in path if word not in script] == []
        for flag in flags:
            wanted = flag if shell != "fish" else f"-l {flag[2:]}" if flag.startswith("--") else f"-s {flag[1:]}"
            assert re.search(rf"{re.escape(wanted)}\b", script), (path, flag)


@pytest.mark.parametrize(("shell", "check"), [("bash", "-n"), ("zsh", "-n"), ("fish", "--no-execute")])
def test_each_script_is_of_its_shells_grammar(shell, check, scripts, tmp_path):
    if not shutil.which(shell):
        pytest.skip(f"{shell} is not installed")
    file = tmp_path / "script"
    file.write_text(scripts[shell])
    done = subprocess.run([shell, check, str(file)], capture_output=True, text=True, timeout=60, check=False)
    assert done.returncode == 0, done.stderr
