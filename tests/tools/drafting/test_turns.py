"""Plots of a rotating antenna: returns of a scan have times of their own, and are drafted at them."""

import math
import tomllib

import numpy as np
import pytest

import vedette
from vedette_tools.drafting.config import drafted

TURN, TARGETS, TURNS = 4.0, 4, 40


def plots(seed=4):
    """Targets at up to 150 m/s, with errors of 30 m and .1 deg, in order of time."""
    rng = np.random.default_rng(seed)
    start, pace, rows = rng.uniform(-20_000, 20_000, (TARGETS, 2)), rng.normal(0, 60, (TARGETS, 2)), []
    for turn in range(TURNS):
        for i in range(TARGETS):
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
