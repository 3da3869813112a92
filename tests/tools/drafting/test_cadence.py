"""Scans that a file leaves out because nothing was returned: a draft puts them back, and nothing else."""

import tomllib
from pathlib import Path

import numpy as np
import pytest

import vedette
from support.foreign_files import paths
from vedette_tools.drafting.cadence import left_out_period
from vedette_tools.drafting.config import draft_config

RNG = np.random.default_rng


def looks(kept, period=2.5, jitter=0.0, seed=0):
    """The times of the scans that are kept, each off its period by some jitter."""
    times = period * np.arange(len(kept)) + RNG(seed).normal(0, jitter, len(kept))
    return times[kept]


def counts_of(binomial, clutter, size, seed=0):
    rng = RNG(seed)
    return rng.binomial(*binomial, size) + rng.poisson(clutter, size)


@pytest.mark.parametrize("jitter", [0.0, 0.03])
@pytest.mark.parametrize(("binomial", "clutter"), [((1, 0.75), 0.0), ((2, 0.7), 0.0), ((1, 0.9), 0.5), ((0, 0.5), 1.2)])
def test_scans_without_returns_are_missed(binomial, clutter, jitter):
    counts = counts_of(binomial, clutter, 300)
    found = left_out_period(looks(counts > 0, jitter=jitter), counts[counts > 0].tolist())
    assert found == pytest.approx(2.5, rel=0.01)


def test_a_busy_radar_that_paused_was_not_without_returns():
    """Of 300 scans with some eight returns each, 20 are not in the file: the recorder lost them."""
    kept, counts = np.ones(300, dtype=bool), counts_of((4, 0.9), 4.0, 300)
    kept[RNG(1).choice(300, 20, replace=False)] = False
    assert left_out_period(looks(kept), counts[kept].tolist()) is None


def test_times_without_a_beat_have_no_period():
    rng = RNG(2)
    assert left_out_period(np.cumsum(rng.exponential(2.0, 300)), [1] * 300) is None
    assert left_out_period(np.cumsum(rng.uniform(1.0, 6.0, 300)), [1] * 300) is None
    assert left_out_period(np.cumsum(rng.integers(1, 8, 300)) * 1.0, [1] * 300) is None
    assert left_out_period(2.5 * np.arange(300), [1] * 300) is None
    assert left_out_period(looks(np.arange(15) % 3 > 0), [1] * 10) is None
    assert left_out_period(np.zeros(0), []) is None


def one_target(seed, p_detect=0.75):
    rng = RNG(seed)
    states = paths(rng, 1, 2.0 * np.arange(200), 0.1, 500, 8)[0]
    rows = [f"{2 * k},{x:.2f},{y:.2f}" for k, (x, y) in enumerate(states[:, :2] + rng.normal(0, 5, (200, 2)))]
    return ["t_s,x,y", *(row for row in rows if rng.random() < p_detect)]


@pytest.mark.costly
def test_a_draft_counts_the_looks_that_the_file_leaves_out(tmp_path, monkeypatch):
    """One target, no clutter, P_D 0.75: without the period, each scan in the file would hold it."""
    monkeypatch.chdir(tmp_path)
    drawn = []
    for seed in range(2):
        rows = one_target(seed)
        Path("d.csv").write_text("\n".join(rows) + "\n")
        text = draft_config(Path("d.csv"))
        config = tomllib.loads(text)
        assert config["source"]["detections"]["periods"] == {"sensor": 2.0}
        assert "gaps of whole periods are scans without returns" in text
        drawn.append(config["sensors"]["sensor"]["detection_probability"])
    assert np.mean(drawn) == pytest.approx(0.75, abs=4 * np.sqrt(0.75 * 0.25 / 400))
    Path("d.toml").write_text(text)
    result = vedette.load("d.toml").run()
    assert len(result.scans) == 1 + (float(rows[-1].split(",")[0]) - float(rows[1].split(",")[0])) / 2
    assert sum(not len(scan.detections.z) for scan in result.scans) > 30


@pytest.mark.costly
def test_a_sensors_name_of_two_words_is_written_as_toml_has_it(tmp_path):
    rows = one_target(1)
    named = [f"{row},{'sensor' if i == 0 else 'sonar 1'}" for i, row in enumerate(rows)]
    named += [f"{row},lidar" for row in one_target(2)[1:]]
    file = tmp_path / "d.csv"
    file.write_text("\n".join(named) + "\n")
    assert tomllib.loads(draft_config(file))["source"]["detections"]["periods"] == {"lidar": 2.0, "sonar 1": 2.0}
