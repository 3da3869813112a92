"""FilterPy's filters as configs of at most 15 lines: examples/filterpy against what FilterPy 2.0.0 answered.

`support.filterpy_answers` made the answers; where the library is installed, they are made anew in the nightly profile.
"""

import json

import numpy as np
import pytest

import vedette
from support import filterpy_answers
from support.paths import EXAMPLES, ROOT
from vedette import smooth

FOLDER = EXAMPLES / "filterpy"
STORED = json.loads((ROOT / "tests" / "standard" / "filterpy.json").read_text(encoding="utf-8"))
CONFIGS = sorted(path.stem for path in FOLDER.glob("*.toml"))
FILTERS = [name for name in CONFIGS if name not in ("ensemble", "rts")]


def run(name, *overrides, **how):
    data = FOLDER / ("radar.csv" if name in ("ekf", "ukf", "ckf") else "line.csv")
    experiment = vedette.load(FOLDER / f"{name}.toml", overrides=(f"source.path={data}", *overrides))
    return experiment, experiment.run(**how)


def agrees(track, answer, first=0):
    """States and covariances to 1e-9 of the deviations and of their products."""
    x = np.array(answer["x"])[first:]
    P = np.array(answer["P"])[first:] if "P" in answer else track.cov[first:]
    spread = np.sqrt(np.diagonal(P, axis1=-2, axis2=-1))
    assert np.max(np.abs(track.mean[first:] - x) / np.maximum(spread, np.abs(x))) < 1e-9
    assert np.max(np.abs(track.cov[first:] - P) / (spread[:, :, None] * spread[:, None, :])) < 1e-9
    if "mode_prob" in answer:
        np.testing.assert_allclose(track.mode_prob, answer["mode_prob"], atol=1e-9)


@pytest.mark.parametrize("name", FILTERS)
def test_a_config_answers_as_filterpy(name):
    (track,) = run(name)[1].tracks
    agrees(track, STORED[name], first=1 if name == "least_squares" else 0)


def test_smoothing_answers_as_filterpy():
    experiment, result = run("rts", keep_states=True)
    (track,) = smooth(experiment.tracker, result.states)
    agrees(track, STORED["rts"])


@pytest.mark.costly
def test_the_ensemble_is_filterpys_in_distribution():
    """Mean and deviation over seeds of the estimate at the last scan, and of the deviations that the ensemble states."""
    experiment, _ = run("ensemble")
    recording, runs = experiment.source.open(experiment.tracker.sensors, np.random.default_rng(0)), 400
    prior = experiment.tracker.birth.given(experiment.tracker.estimator.state, recording)
    many = vedette.Gaussian(np.tile(prior.mean, (runs, 1, 1)), np.tile(prior.cov, (runs, 1, 1, 1)))
    state = experiment.tracker.start(many, recording.scans[0].time, 5)
    for scan in recording.scans:
        seen = vedette.Detections(np.tile(scan.detections.z, (runs, 1, 1)), np.tile(scan.detections.valid, (runs, 1)))
        state = experiment.tracker.step(state, vedette.Scan(scan.time, scan.sensor, seen))
    found = experiment.tracker.estimate(state)
    deviations = np.sqrt(np.diagonal(found.cov[:, 0], axis1=-2, axis2=-1))
    ends = np.concatenate([found.mean[:, 0], deviations], axis=-1)
    theirs = STORED["ensemble"]
    mean, deviation, others = (np.array(theirs[key]) for key in ("mean", "deviation", "runs"))
    error = np.sqrt(ends.var(axis=0, ddof=1) / runs + deviation**2 / others)
    assert np.all(np.abs(ends.mean(axis=0) - mean) < 5 * error)
    # The logarithm of a deviation over n runs has a standard error of 1 / sqrt(2 n).
    ratio = np.log(ends.std(axis=0, ddof=1) / deviation)
    assert np.all(np.abs(ratio) < 5 * np.sqrt(1 / runs / 2 + 1 / others / 2))


def test_every_config_is_short_and_tested():
    for name in CONFIGS:
        assert len((FOLDER / f"{name}.toml").read_text(encoding="utf-8").splitlines()) <= 15
    assert set(CONFIGS) == set(STORED)


@pytest.mark.nightly("the answers are stored")
@pytest.mark.parametrize("name", [name for name in STORED if name != "ensemble"])
def test_the_stored_answers_are_filterpys(name):
    pytest.importorskip("filterpy", reason="filterpy is not installed: its stored answers stand unchecked")
    for key, values in filterpy_answers.ANSWERS[name]().items():
        np.testing.assert_allclose(values, STORED[name][key], rtol=1e-9, atol=1e-9)
