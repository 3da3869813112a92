"""`vedette check`: in JSON, and of what cannot be checked."""

from __future__ import annotations

import json
from pathlib import Path

import pytest

from vedette.cli import main
from vedette.testing import laws_of
from vedette_standard.associators.nearest import Nearest


def test_the_last_line_is_the_table_in_json(capsys: pytest.CaptureFixture[str]) -> None:
    assert main(["check", "nearest", "--json"]) == 0
    (component,) = json.loads(capsys.readouterr().out.splitlines()[-1])["components"]
    assert (component["role"], component["kind"], component["failed"]) == ("associator", "nearest", False)
    assert [law["law"] for law in component["laws"]] == [law.name for law in laws_of(Nearest)]
    assert {law["verdict"] for law in component["laws"]} <= {"held", "skipped"}


HOOK = "import vedette\n@vedette.plugin\ndef vedette_components(): "
CASES = {
    "an import that fails": ("raise ImportError('no tides')", "could not be imported: ImportError: no tides"),
    "no Python": ("def (", "could not be imported: SyntaxError"),
    "a hook that fails": (HOOK + "return 1 / 0", "its vedette_components failed: ZeroDivisionError"),
    "a class of no role": (HOOK + "return [dict]", "dict plays none of the roles"),
    "a class that is incomplete": (HOOK + "return [vedette.Associator]", "Associator is incomplete"),
}


@pytest.mark.parametrize("case", CASES)
def test_what_cannot_be_checked_is_told(
    case: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    source, told = CASES[case]
    name = "vedette_test_check_" + case.split()[-1].lower() + str(len(case))
    (tmp_path / f"{name}.py").write_text(source)
    monkeypatch.syspath_prepend(str(tmp_path))
    assert main(["check", name]) == 2
    assert told in capsys.readouterr().err
