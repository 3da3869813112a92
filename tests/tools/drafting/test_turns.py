"""Plots of a rotating antenna: returns of a scan have times of their own, and are drafted at them."""

import math
import tomllib

import numpy as np
import pytest

import vedette
from vedette_tools.drafting.config import drafted
from vedette_tools.drafting.reading import Reading, opened
from vedette_tools.drafting.recognising import read_table

TURN, TARGETS, TURNS = 4.0, 4, 40


def plots(seed=4, targets=TARGETS, turns=TURNS, false=0.0):
    """Targets at up to 150 m/s, with errors of 30 m and .1 deg, in order of time, and so many false ones a turn."""
    rng = np.random.default_rng(seed)
    start, pace, rows = rng.uniform(-20_000, 20_000, (targets, 2)), rng.normal(0, 60, (targets, 2)), []
    for turn in range(turns):
        for _ in range(rng.poisson(false)):
            bearing = rng.uniform(0, 360)
            rows.append(f"{TURN * (turn + bearing / 360):.3f},{turn},{rng.uniform(1e3, 4e4):.1f},{bearing:.3f}")
        for i in range(targets):
            time = (turn + 0.5) * TURN
            for _ in range(4):  # the beam meets the target where it is then
                time = TURN * (turn + (math.atan2(*(start[i] + pace[i] * time)) % (2 * math.pi)) / (2 * math.pi))
            spot = start[i] + pace[i] * time
            bearing = math.degrees(math.atan2(*spot)) + rng.normal(0, 0.1)
            if rng.random() < 0.9:
                rows.append(f"{time:.3f},{turn},{math.hypot(*spot) + rng.normal(0, 30):.1f},{bearing % 360:.3f}")
    return sorted(rows, key=lambda row: float(row.split(",")[0]))


@pytest.mark.costly
def test_turns_are_kept_and_each_return_is_taken_at_its_time(tmp_path):
    """At the time of its turn's last return a plot is up to 600 m off: the errors drafted then were 110 m for 30."""
    path = tmp_path / "d.csv"
    path.write_text("\n".join(["time,turn,range,azimuth", *plots()]) + "\n")
    draft = drafted(path)
    config = tomllib.loads(draft.text)
    assert not draft.failure
    assert config["source"]["detections"]["scan"] == "turn"
    assert 20 < config["sensors"]["sensor"]["sigma_range"] < 45
    assert config["sensors"]["sensor"]["detection_probability"] == pytest.approx(0.9, abs=0.08)
    assert len(vedette.load(config).run().tracks) == TARGETS


@pytest.mark.costly
def test_one_chain_of_all_plots_holds_none_of_them(tmp_path):
    """Nine targets' plots and a quarter of false ones, whose turns no column tells, were drafted with errors of 20 km."""
    cells = [row.split(",") for row in plots(targets=9, turns=60, false=3.0)]
    path = tmp_path / "d.csv"
    path.write_text("\n".join(["time,range,azimuth", *(f"{time},{r},{bearing}" for time, _, r, bearing in cells)]) + "\n")
    table = read_table(path)
    found = Reading.of(table, opened(table))
    assert len(found.seen["sensor"].chains) <= 11
    assert 20 < found.noise["sensor"].sensor[0] < 45
