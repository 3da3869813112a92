"""A scene of many objects keeps its summary short; the figures of whole tracks take one line."""

import json

import pytest

import vedette
from support.paths import EXAMPLES
from vedette.cli import main
from vedette_report.summary.words import MOST_OBJECTS


@pytest.mark.costly
def test_more_objects_than_fit_are_counted_and_the_json_has_all(tmp_path, capsys):
    changes = ["source.populations.boats.count=60", "source.duration=10", "source.crossings={}"]
    sets = [part for change in changes for part in ("--set", change)]
    assert main(["run", str(EXAMPLES / "fleet.toml"), "--out", str(tmp_path), "--json", "--all", *sets]) == 0
    said = capsys.readouterr().out.splitlines()
    figures = json.loads(said[-1])
    objects = len(figures["truths"])
    assert objects >= 62
    more = objects - MOST_OBJECTS
    assert any(f"and {more} more, which summary.json has" in line for line in said)
    assert sum(line.startswith("  boats.") for line in said) == MOST_OBJECTS
    assert f"boats.{MOST_OBJECTS} and {more} more" in " ".join(" ".join(said).split())
    (line,) = [line for line in said if line.startswith("  whole tracks")]
    assert f"HOTA {figures['hota']:.3g}, MOTA {figures['mota']:.3g}" in line
    assert not any("Cramer" in each for each in said)


@pytest.mark.costly
def test_the_bound_is_told_where_it_is_asked_for(tmp_path, capsys):
    motion = "{ kind = 'constant_velocity', sigma_accel = 0.05 }"
    bound = f"judge.bound={{ motion = {motion}, start = {{ x = 6, y = 6, vx = 4, vy = 4 }} }}"
    path = EXAMPLES / "fleet.toml"
    assert main(["run", str(path), "--out", str(tmp_path), "--json", "--set", "source.duration=100", "--set", bound]) == 0
    said = capsys.readouterr().out.splitlines()
    figures = json.loads(said[-1])
    (line,) = [line for line in said if line.startswith("  lower bound")]
    assert f"{figures['position_bound_m']:.3g} m: posterior Cramer-Rao bound of the position error" in line
    assert 2.0 < figures["position_bound_m"] < figures["position_rmse_m"]
    assert vedette.to_config(vedette.load(path, overrides=[bound]))["judge"]["bound"]["method"] == "information_reduction"
