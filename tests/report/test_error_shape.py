"""Errors that grow, and errors with heavy tails, found in returns without truth; white ones and motion are neither."""

import json

import numpy as np
import pandas as pd
import pytest

from vedette.cli import main
from vedette.commands import DONE
from vedette_report.detector_errors.shape import Measured, shape_of

KINDS = {
    "white": lambda rng, r: rng.normal(size=len(r)),
    "grow": lambda rng, r: rng.normal(size=len(r)) * r / 2000.0,
    "tails": lambda rng, r: rng.normal(size=len(r)) * np.where(rng.random(len(r)) < 0.03, 6.0, 1.0),
}


def drawn(seed, kind, turns=0.0, targets=4, count=300):
    """Return the ranges of targets that come and go, a tenth of them missed, and what errors of 10 m do to them."""
    rng, paths = np.random.default_rng(seed), []
    for _ in range(targets):
        times = np.arange(count)[rng.random(count) < 0.9].astype(float)
        pace = np.cumsum(rng.normal(0, 0.5, count)) + rng.uniform(5, 20)
        far = np.abs(rng.uniform(500, 4000) + np.cumsum(pace))[times.astype(int)] + 100.0
        far += turns * np.sin(times / 8.0)
        paths.append(Measured(times, far + 10.0 * KINDS[kind](rng, far), far))
    return paths


def test_errors_that_grow_are_found_with_their_power():
    """Within four of its stated errors."""
    shape = shape_of(drawn(1, "grow"))
    assert shape.grows
    assert abs(shape.growth - 1.0) < 4.0 * shape.growth_error < 0.6
    assert not shape.tailed


def test_errors_that_are_often_far_off_are_found():
    """Three in a hundred are six times as large: these lie beyond three deviations in .6 of the cases, each in five sums."""
    shape = shape_of(drawn(2, "tails"))
    assert shape.tailed
    assert shape.far > 0.01
    assert not shape.grows


@pytest.mark.parametrize("turns", [0.0, 200.0])
@pytest.mark.by_turns
def test_white_errors_show_neither(turns):
    """Of 12 draws at most 3 are called either; 1 in 100 is (100 draws), so a right rule fails here once in 2,000 times."""
    shapes = [shape_of(drawn(seed, "white", turns)) for seed in range(12)]
    assert sum(shape.grows or shape.tailed for shape in shapes) <= 3
    assert abs(np.mean([shape.growth for shape in shapes])) < 4.0 * 0.075 / np.sqrt(12)


def test_nothing_is_said_of_few_returns_and_of_motion():
    assert shape_of(drawn(3, "white", count=40, targets=1)) is None
    assert shape_of([]) is None
    times = np.arange(300.0)
    wild = [Measured(times, 1e4 * np.sin(times / 2.0 + i), np.full(300, np.nan)) for i in range(4)]
    assert shape_of(wild) is None


CONFIG = """
[estimator]
kind = "ekf"
motion = { kind = "constant_velocity", sigma_accel = 0.3 }
[sensors.radar]
kind = "range_bearing"
sigma_range = 10.0
sigma_bearing = 0.003
detection_probability = 0.95
clutter_density = 1e-7
[associator]
kind = "gnn"
[birth]
kind = "from_returns"
spread = { vx = 15, vy = 15 }
[lifecycle]
kind = "m_of_n"
[source]
kind = "csv"
path = "plots.csv"
detections = { time = "time", columns = { range = "range", bearing = "bearing" } }
"""


@pytest.mark.costly
def test_a_radars_ranges_and_bearings_are_judged_each_by_itself(tmp_path, monkeypatch, capsys):
    """Ranges with errors that go on (.8 from scan to scan, 30 m), bearings with white ones; `consistency` tells which."""
    monkeypatch.chdir(tmp_path)
    rng, rows = np.random.default_rng(5), []
    times = 2.0 * np.arange(300)
    for i in range(4):
        x, y = -3000.0 + 10.0 * times, 2000.0 + 1500.0 * i + 0.0 * times
        error = rng.normal(0, 30, len(times))
        for k in range(1, len(times)):
            error[k] = 0.8 * error[k - 1] + 0.6 * error[k]
        bearing = np.arctan2(y, x) + rng.normal(0, 0.003, len(times))
        rows.append(pd.DataFrame({"time": times, "range": np.hypot(x, y) + error, "bearing": bearing}))
    pd.concat(rows).sort_values("time", kind="stable").to_csv("plots.csv", index=False)
    (tmp_path / "c.toml").write_text(CONFIG)
    assert main(["consistency", "c.toml", "--set", "sensors.radar.sigma_range=30", "--json"]) == DONE
    told = {one["axis"]: one for one in json.loads(capsys.readouterr().out.splitlines()[-1])["errors"]}
    assert told["range"]["correlated"]
    assert not told["bearing"]["correlated"]
    assert told["range"]["deviation"] == pytest.approx(30, rel=0.25)
    assert told["range"]["correlation_time"] == pytest.approx(-2.0 / np.log(0.8), rel=0.5)
    assert not told["bearing"]["shape"]["grows"]
