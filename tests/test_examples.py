"""The examples run as they stand, and reach on recorded data what docs/real-data.md says."""

import runpy
import tomllib

import numpy as np
import pytest

import vedette
from support.paths import EXAMPLES, recording
from vedette import metrics
from vedette.config.files import read_file
from vedette_study.plan import plan, read_study
from vedette_study.study import perform

JOYRIDE_WINDOW = ("judge.last_scan=211",)


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
    assert score.coverage >= 0.94
    assert score.id_switches == 0
    assert score.position_rmse_m <= 20.0


@pytest.mark.parametrize("offset", ["{x=10.0}", "{x=-10.0}", "{y=10.0}", "{y=-10.0}"])
@pytest.mark.by_turns
def test_joyride_single_target(offset):
    path = recording("joyride")
    overrides = (
        "lifecycle.kind=single_target",
        "birth.kind=given",
        f"birth.offset={offset}",
        f"source.path={path}",
        *JOYRIDE_WINDOW,
    )
    score = judged("joyride.toml", *overrides)
    assert score.scans == 212
    assert not score.lost
    assert score.position_rmse_m <= 28.5
    assert score.nees_position <= 3.5


@pytest.mark.parametrize(
    ("overrides", "gospa", "rmse", "coverage"),
    [
        ((), 10.75, 7.4, 0.93),
        (("source.lag.radar=1.7",), 6.8, 4.4, 0.93),
        (('source.sensors=["radar", "lidar"]',), 9.0, 6.2, 0.92),
        (("retroactive=false", "lifecycle.confirm=0.999"), 11.0, 7.4, 0.91),
    ],
)
@pytest.mark.costly
def test_autoferry(overrides, gospa, rmse, coverage):
    path = recording("autoferry")
    scores = [judged("autoferry.toml", f"source.path={path}", f"source.scenario={n}", *overrides) for n in (2, 5, 13, 16)]
    assert np.mean([score.gospa_m for score in scores]) <= gospa
    assert np.sqrt(np.mean([score.position_rmse_m**2 for score in scores])) <= rmse
    assert np.mean([score.coverage for score in scores]) >= coverage
    assert np.mean([score.false_tracks for score in scores]) <= 0.06
    assert sum(score.id_switches for score in scores) <= 2


def studied(name, *overrides, **changed):
    """The study of an example, with some of its table changed."""
    return perform(plan(read_study(EXAMPLES / name) | changed, overrides))


@pytest.mark.nightly("recordings, ten draws")
def test_joyrides_bias_pays_over_ten_draws():
    """One error of the difference is .3 m."""
    found = studied("joyride_study.toml", f"source.path={recording('joyride')}", runs=10)
    lower = found.differences(1)
    assert lower["position_rmse"].value < -2 * lower["position_rmse"].error
    assert lower["coverage"].value > -2 * lower["coverage"].error
    assert lower["nees"].value < -0.5


@pytest.mark.nightly("recordings, ten draws")
def test_autoferry_over_ten_draws():
    """The issue's bounds: GOSPA 10.75 m, coverage .92, false tracks .04; the delay that is found gives 7.0 m at most."""
    sweep, path = {"source.scenario": [2, 5, 13, 16]}, f"source.path={recording('autoferry')}"
    alone = studied("autoferry_study.toml", path, sweep=sweep).means(0)
    assert alone["gospa"].value < 10.75
    assert 0 < alone["gospa"].error < 0.2
    assert alone["coverage"].value > 0.92
    assert alone["false_tracks"].value < 0.04
    corrected = studied("autoferry_study.toml", path, "source.lag.radar=1.6", sweep=sweep).means(0)
    assert corrected["gospa"].value < 7.0


@pytest.mark.costly
def test_a_radars_delay_is_found_without_truth():
    """One scenario's lag by the truth is 2.2 s; it depends on the bearing, so that a constant is found to some tenths."""
    path = f"source.path={recording('autoferry')}"
    result = vedette.load(EXAMPLES / "autoferry_delay.toml", overrides=[path, "source.scenario=2"]).run()
    (mean,), ((variance,),) = result.offsets.mean, result.offsets.cov
    assert abs(mean - 2.2) < 0.6
    assert variance < 0.3**2


@pytest.mark.parametrize(
    "name", sorted(path.name for path in EXAMPLES.glob("*.toml") if "experiment" not in read_file(path))
)
def test_every_example_config_is_written_back(name):
    with (EXAMPLES / name).open("rb") as file:
        config = tomllib.load(file)
    experiment = vedette.load(config)
    assert vedette.load(vedette.to_config(experiment)) == experiment
