"""From a CSV to its page: the commands that the first page of the docs says, and no more than three."""

import re
import shlex

import numpy as np
import pytest

from support.paths import DOCS
from vedette.cli import main
from vedette_files import read_series


@pytest.fixture
def commands():
    text = (DOCS / "index.md").read_text(encoding="utf-8").partition("## Your own file, in three commands")[2]
    block = re.search(r"```sh\n(.*?)```", text, re.DOTALL)
    return [shlex.split(line, comments=True) for line in block[1].splitlines()]


@pytest.mark.costly
def test_three_commands_lead_from_a_csv_to_its_page(commands, tmp_path, monkeypatch):
    assert len(commands) <= 3
    assert [command[0] for command in commands] == ["vedette"] * len(commands)
    rng = np.random.default_rng(3)
    rows = ["time [s],x [m],y [m]"]
    for k in range(40):
        for x, y in ((-500 + 20 * k, 300 + 4 * k), (600 - 12 * k, 10 * k), rng.uniform(-900, 900, 2)):
            rows.append(f"{2.0 * k},{x + 4 * rng.normal():.2f},{y + 4 * rng.normal():.2f}")
    monkeypatch.chdir(tmp_path)
    monkeypatch.setattr("vedette_report.drawing.brought.can_draw", lambda: False)
    mine = tmp_path / commands[0][-1]
    mine.parent.mkdir()
    mine.write_text("\n".join(rows) + "\n")
    for command in commands:
        assert main(command[1:]) == 0
    (page,) = tmp_path.rglob("report.html")
    entries = read_series(page.parent / "series.npz")["entries"]
    assert len(np.unique(entries["track"][entries["confirmed"]])) >= 2
