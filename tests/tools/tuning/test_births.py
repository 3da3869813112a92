"""What is tuned where tracks begin and end by themselves: it is the data's, not that of thresholds."""

import copy

import numpy as np
import pytest
from scipy.stats import binom, chi2

import vedette
from support.births import CONFIG, RANGES, STARTS, TRUTH, drawn, written
from vedette.config import Registry
from vedette.types import Recording
from vedette_tools.tuning.evaluation import data_of, evaluate, settled
from vedette_tools.tuning.parameters import read_free
from vedette_tools.tuning.tuner import tune
from vedette_tools.tuning.unthresholded import kept_thresholds, unthresholded

P_D, DENSITY = "sensors.radar.detection_probability", "sensors.radar.clutter_density"


@pytest.fixture(scope="module")
def recording():
    return drawn(1, 80)


def likely(recording: Recording, **parts):
    config = copy.deepcopy(CONFIG) | parts
    return evaluate(data_of(vedette.load(config), recording, 1.0), [], []).loglik


@pytest.mark.parametrize(
    "parts",
    [
        {
            "lifecycle": {
                "kind": "existence",
                "delete": 0.15,
                "confirm": 0.6,
                "max_without_detection": 2.0,
                "max_spread": 9.0,
            }
        },
        {"lifecycle": {"kind": "m_of_n", "misses": 2}},
        {"gate": {"probability": 0.7}},
        {"gate": "off"},
    ],
    ids=["lifecycle", "another lifecycle", "gate", "no gate"],
)
@pytest.mark.by_turns
def test_when_tracks_end_and_what_gates_leave_out_changes_nothing(recording, parts):
    assert likely(recording, **parts) == pytest.approx(likely(recording), abs=1e-9)


def test_a_likelihood_looks_for_no_plugins(recording, monkeypatch):
    """That took 7 ms, a tenth of the time of each likelihood where tracks begin by themselves."""
    data = data_of(vedette.load(CONFIG), recording, 1.0)
    monkeypatch.setattr(Registry, "installed", lambda: pytest.fail("plugins are listed for each likelihood"))
    assert np.isfinite(evaluate(data, [], []).loglik).all()


def test_what_new_tracks_are_said_to_be_is_found_in_the_data(recording):
    """Of some 700 new tracks 3 are of targets; a birth that guesses a fifth comes to the same as one that guesses more."""
    ends = []
    for initial in (0.2, 0.6):
        config = copy.deepcopy(CONFIG)
        config["birth"]["initial"] = initial
        data = settled(data_of(vedette.load(config), recording, 1.0), [], [])
        ends.append((data.unstated.real, evaluate(data, [], []).loglik))
    returns = sum(len(scan.detections.z) for scan in recording.scans)
    assert ends[0][0] == pytest.approx(3.5 / (returns - 0.85 * 240), rel=0.1)
    assert ends[0][0] == pytest.approx(ends[1][0], rel=0.02)
    assert ends[0][1].sum() == pytest.approx(ends[1][1].sum(), abs=0.1)


def tops(data, ranges):
    """Return the highest of the values along each parameter, the others as the config has them."""
    found = {}
    for path, grid in ranges.items():
        free = read_free(data.experiment, [f"{path}={min(grid)}..{max(grid)}"])
        heights = [evaluate(data, free, [value]).loglik.sum() for value in grid.tolist()]
        found[path] = float(grid[int(np.argmax(heights))])
    return found


def test_a_probability_of_detection_is_that_of_the_data(recording):
    """A newborn of existence .2 that had to survive its first miss bound it to .797. Within three errors of hits."""
    data = settled(data_of(vedette.load(CONFIG), recording, 1.0), [], [])
    top = tops(data, {P_D: np.linspace(0.73, 0.97, 13)})[P_D]
    assert abs(top - 0.85) < 3.0 * np.sqrt(0.85 * 0.15 / 240)


@pytest.mark.costly
def test_targets_that_leave_the_clutter_do_not_thin_it():
    """A target that goes 1,500 m beyond the clutter makes the box of all returns twice as large: within four errors."""
    recording = drawn(3, 60, ({"x": [1200, 1], "y": [0, 1], "vx": [30, 0.1], "vy": [0, 0.1]}, *STARTS[1:]))
    config = copy.deepcopy(CONFIG)
    config["birth"]["spread"] = {"vx": 30, "vy": 30}
    data = data_of(vedette.load(config), recording, 1.0)
    grid = {DENSITY: np.geomspace(5e-7, 1.5e-6, 15)}
    thinned, top = tops(data, grid)[DENSITY], tops(settled(data, [], []), grid)[DENSITY]
    count = 60 * 9
    assert thinned < 0.75e-6
    assert abs(np.log(top / 1e-6)) < 4.0 / np.sqrt(count)


def test_a_threshold_that_is_tuned_itself_has_its_part_and_is_named(recording):
    tracker = vedette.load(CONFIG).tracker
    freed = [("gate", "probability"), ("lifecycle", "delete"), ("lifecycle", "lifetime"), ("birth", "initial")]
    told = kept_thresholds(tracker, freed)
    assert [f"{'.'.join(path)} is tuned" in told for path in freed] == [True, True, False, False]
    assert not kept_thresholds(tracker, freed[2:])
    kept = unthresholded(tracker, 0.01, freed)
    assert (kept.gate, kept.lifecycle, kept.birth) == (tracker.gate, tracker.lifecycle, tracker.birth)


DRAWS, FALSE = 30, 0.0025
"""Tunings of 19 s of CPU each, and the part of right errors that fails by each count or scatter."""


@pytest.mark.nightly("tunes thirty times, for ten minutes")
def test_errors_hold_what_they_promise(tmp_path):
    """The truth lies within two stated errors as often as a normal does, and errors are no larger than the scatter.

    Of 30 draws in 25 at least: errors of half their size pass in one of twenty runs.
    """
    after, errors = np.zeros((2, DRAWS, len(TRUTH)))
    for seed in range(DRAWS):
        config = written(tmp_path / "recording.jsonl", drawn(1000 + seed, 300))
        off = ["sensors.radar.sigma=12", "estimator.motion.sigma_accel=0.5", f"{P_D}=0.7"]
        tuned = tune(config, [f"{path}={bounds}" for path, bounds in RANGES.items()], overrides=off, part=1.0, starts=1)
        after[seed] = [each.after for each in tuned.parameters]
        errors[seed] = [each.error or np.nan for each in tuned.parameters]
    near = np.sum(np.abs(after - list(TRUTH.values())) < 2.0 * errors, axis=0)
    over = np.median(errors, axis=0) / np.std(after, axis=0, ddof=1)
    print(dict(zip(TRUTH, zip(near.tolist(), over.tolist(), strict=True), strict=True)))
    assert np.all(near >= binom.ppf(FALSE, DRAWS, 0.9545)), near
    assert np.all(over <= np.sqrt((DRAWS - 1) / chi2.ppf(FALSE, DRAWS - 1))), over
