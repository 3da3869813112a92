"""The published crossing by horizon: what later scans tell of earlier ones, and whether links are as probable as stated."""

import math

import numpy as np
import pytest
from scipy.stats import norm

from benchmarks import crossing, horizons
from support.paths import recording

RUNS = 20
LIMIT = norm.isf(norm.sf(3.0) / (4 * horizons.BINS))
"""Three standard errors for all bins of the four horizons together."""


@pytest.mark.nightly("twenty runs of the crossing, at four horizons: minutes")
def test_horizons_on_the_crossing():
    """On draws that no constant was chosen on: seed 3."""
    recording("mtt")
    kinds = ("k_best, 200", "n_scan, 3 scans")
    runs = [horizons.judged(3, run, kinds) for run in range(RUNS)]
    for name in kinds:
        base = np.array([run[name, "lag 0's links"][0] for run in runs])
        for horizon in ("3 s", "10 s", "whole"):
            square = np.array([run[name, horizon][0] for run in runs])
            apart = square - base
            assert np.mean(apart) <= 2 * np.std(apart) / math.sqrt(RUNS), (name, horizon)
            assert math.sqrt(np.mean(square)) <= 2.6, (name, horizon)
    for horizon in ("online", "3 s", "10 s", "whole"):
        rows = horizons.calibration([run["k_best, 200", horizon][2] for run in runs])
        assert len(rows) == horizons.BINS
        assert max(abs(row[3]) for row in rows) < LIMIT, (horizon, rows)


@pytest.mark.nightly("a hundred runs of the crossing: minutes")
def test_the_figures_of_the_crossing_are_those_of_the_page():
    recording("mtt")
    runs = [crossing.judged(2018, run) for run in range(100)]
    told = {"k_best, 200": 2.912, "k_best, 20": 2.928, "n_scan, 3 scans": 2.944, "variational": 2.899, "lmb": 3.022}
    told |= {"jpda": 3.210, "m_best_jpda, 200": 3.210, "gnn": 3.282}
    for name, rms in told.items():
        assert math.sqrt(np.mean([run[name][0] for run in runs])) == pytest.approx(rms, abs=6e-4), name
