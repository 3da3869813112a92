"""Errors that hold what they promise, over many simulated data sets, from far too small and from far too large."""

import numpy as np
import pytest
from scipy.stats import binom

from support.tuned import RANGES, RATES, TRUTH, off, recorded, switching
from vedette_tools.tuning.tuner import tune

FACTORS = (0.1, 10.0)


def ended(config, ranges, overrides=()):
    """Return path to the tuned value, its error and the parameter."""
    free = [f"{path}={bounds}" for path, bounds in ranges.items()]
    tuned = tune(config, free, overrides=overrides, part=1.0, starts=2)
    return {each.free.path: (each.after, each.error or np.nan, each.free) for each in tuned.parameters}


def apart(ends):
    """Return by how many standard errors two tunings of the same data differ at worst."""
    first, second = ends
    return max(abs(first[path][0] - second[path][0]) / max(first[path][1], second[path][1]) for path in first)


@pytest.mark.nightly("tunes some two hundred times, for ten minutes")
def test_errors_hold_what_they_promise(tmp_path):
    """The truth lies within two standard errors in 90 to 99 of 100 data sets, and within one in 55 to 80.

    From ten times too small and too large; both end at the same top, to a quarter of its error.
    """
    near = {(path, factor): np.zeros(2, dtype=int) for path in TRUTH for factor in FACTORS}
    for seed in range(100):
        config = recorded(tmp_path / f"{seed}.jsonl", seed)
        ends = [ended(config, RANGES, off(TRUTH, factor)) for factor in FACTORS]
        assert apart(ends) < 0.25, seed
        for factor, found in zip(FACTORS, ends, strict=True):
            for path, (after, error, _) in found.items():
                away = abs(after - TRUTH[path]) / error
                near[path, factor] += [away < 1.0, away < 2.0]
    for path, (once, twice) in near.items():
        assert 55 <= once <= 80, (path, once, twice)
        assert 90 <= twice <= 99, (path, once, twice)


SETS = 40


@pytest.mark.nightly("tunes some two hundred times, for ten minutes")
def test_an_imms_transition_is_found_within_its_error(tmp_path):
    """Counts of 40 data sets, from ten times too small odds, within what a normal error makes of them in 998 of 1,000."""
    ranges, near = dict.fromkeys(RATES, "0.001..0.9"), {path: np.zeros(2, dtype=int) for path in RATES}
    for seed in range(SETS):
        config = switching(tmp_path / f"{seed}.jsonl", seed, 0.1)
        found = ended(config, ranges)
        for path, (after, error, free) in found.items():
            there = float(free.position(after))
            away = abs(there - float(free.position(RATES[path]))) / (error / free.slope(there))
            near[path] += [away < 1.0, away < 2.0]
        if seed < 5:
            assert apart([found, ended(switching(tmp_path / f"{seed}.jsonl", seed, 10.0), ranges)]) < 0.25
    for path, counts in near.items():
        for count, share in zip(counts, (0.6827, 0.9545), strict=True):
            low, high = binom.ppf([0.0005, 0.9995], SETS, share)
            assert low <= count <= high, (path, counts)
