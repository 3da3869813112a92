"""From a clone to the page of one's own CSV: the commands that the docs say, and no more than three."""

import re
import shlex

import numpy as np
import pytest

from support.paths import DOCS
from vedette.cli import main
from vedette_files import read_series


@pytest.fixture
def commands():
    text = (DOCS / "command-line.md").read_text(encoding="utf-8")
    (block,) = re.findall(r"## From your CSV to its page\n.*?```text\n(.*?)```", text, re.DOTALL)
    return [shlex.split(line, comments=True) for line in block.splitlines()]


def test_three_commands_lead_from_a_clone_to_the_page_of_a_csv(commands, tmp_path, monkeypatch):
    assert len(commands) <= 3
    install, *own = commands
    assert install[:2] == ["pip", "install"]
    assert [command[0] for command in own] == ["vedette"] * len(own)
    rng = np.random.default_rng(3)
    rows = ["time [s],x [m],y [m]"]
    for k in range(40):
        for x, y in ((-500 + 20 * k, 300 + 4 * k), (600 - 12 * k, 10 * k), rng.uniform(-900, 900, 2)):
            rows.append(f"{2.0 * k},{x + 4 * rng.normal():.2f},{y + 4 * rng.normal():.2f}")
    monkeypatch.chdir(tmp_path)
    monkeypatch.setattr("vedette_report.drawing.can_draw", lambda: False)
    (tmp_path / "mine.csv").write_text("\n".join(rows) + "\n")
    for command in own:
        assert main(command[1:]) == 0
    (page,) = tmp_path.rglob("report.html")
    entries = read_series(page.parent / "series.npz")["entries"]
    assert len(np.unique(entries["track"][entries["confirmed"]])) >= 2
