"""The examples run as they stand, and reach on recorded data what docs/real-data.md says."""

import runpy
import tomllib

import numpy as np
import pytest

import vedette
from support.paths import EXAMPLES, recording
from vedette import metrics

JOYRIDE_WINDOW = ("judge.last_scan=211", "judge.offset=[-4.0, 8.0]")


def judged(name, *overrides):
    experiment = vedette.load(EXAMPLES / name, overrides=overrides)
    result = experiment.run()
    assert not result.refused
    gate = experiment.tracker.gate.probability
    return metrics.judge(result.tracks, result.recording.truth, result.scans, experiment.judge, gate)


def test_the_harbour_is_tracked_whole():
    score = judged("harbour.toml")
    assert score.coverage > 0.95
    assert score.id_switches == 0
    assert score.false_tracks < 0.05
    assert score.position_rmse_m < 10.0


def test_compose_runs_and_finds_the_ship(capsys):
    runpy.run_path(str(EXAMPLES / "compose.py"))
    assert capsys.readouterr().out.startswith("track 0: x 15")
    user_code = (EXAMPLES / "compose.py").read_text().split("import vedette", 1)[1].strip().splitlines()
    assert len([line for line in user_code if line.strip()]) < 25


def test_joyride_automatic():
    score = judged("joyride.toml", f"source.path={recording('joyride')}")
    assert score.scans == 238
    assert score.coverage >= 0.91
    assert score.id_switches <= 3
    assert score.position_rmse_m <= 23.5


@pytest.mark.parametrize("offset", ["{x=10.0}", "{x=-10.0}", "{y=10.0}", "{y=-10.0}"])
def test_joyride_single_target(offset):
    path = recording("joyride")
    overrides = ("lifecycle.kind=single_target", f"lifecycle.offset={offset}", f"source.path={path}", *JOYRIDE_WINDOW)
    score = judged("joyride.toml", *overrides)
    assert score.scans == 212
    assert not score.lost
    assert score.position_rmse_m <= 28.5
    assert score.anees <= 7.0


@pytest.mark.parametrize(
    ("overrides", "gospa", "rmse"),
    [
        ((), 11.6, 7.4),
        (("source.lag.radar=1.7",), 7.8, 4.5),
        (('source.sensors=["radar", "lidar"]',), 11.6, 7.4),
    ],
)
def test_autoferry(overrides, gospa, rmse):
    path = recording("autoferry")
    scores = [judged("autoferry.toml", f"source.path={path}", f"source.scenario={n}", *overrides) for n in (2, 5, 13, 16)]
    assert np.mean([score.gospa_m for score in scores]) <= gospa
    assert np.sqrt(np.mean([score.position_rmse_m**2 for score in scores])) <= rmse
    assert np.mean([score.coverage for score in scores]) >= 0.91
    assert np.mean([score.false_tracks for score in scores]) <= 0.11
    assert sum(score.id_switches for score in scores) <= 3


@pytest.mark.parametrize("name", sorted(path.name for path in EXAMPLES.glob("*.toml") if path.name != "study.toml"))
def test_every_example_config_is_written_back(name):
    with (EXAMPLES / name).open("rb") as file:
        config = tomllib.load(file)
    experiment = vedette.load(config)
    assert vedette.load(vedette.to_config(experiment)) == experiment
