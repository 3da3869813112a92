"""IMM-PDAF beside CV-PDAF and CT-PDAF on recorded radar, tracks begun by themselves: docs/measured/marine.md."""

import runpy

import pytest

from support.paths import EXAMPLES, recording

EXAMPLE = EXAMPLES / "marine_filters.py"
BOUNDS = {
    "joyride": (0.94, 0.15, 24.0, (1.0, 3.0)),
    "autoferry 2": (0.94, 0.10, 5.0, (0.7, 2.0)),
    "autoferry 5": (0.97, 0.15, 6.5, (1.5, 4.0)),
    "autoferry 13": (0.80, 0.05, 3.0, (0.2, 1.0)),
    "autoferry 16": (0.93, 0.15, 3.3, (0.2, 1.0)),
}
"""Of IMM-PDAF: least coverage, most false tracks at a time, most RMSE in m, NEES / 2 from and to."""


@pytest.fixture(scope="module")
def scores():
    folder = recording("joyride").parent
    recording("autoferry")
    found = {}
    for name, label, score in runpy.run_path(str(EXAMPLE))["scores"](folder):
        found.setdefault(name, {})[label] = score
    return found


@pytest.mark.costly
@pytest.mark.parametrize("recording", list(BOUNDS))
def test_imm_pdaf_tracks_recorded_boats(scores, recording):
    coverage, false, rmse, (low, high) = BOUNDS[recording]
    imm, cv = scores[recording]["IMM-PDAF"], scores[recording]["CV-PDAF"]
    assert imm.coverage >= coverage
    assert imm.false_tracks <= false
    assert imm.position_rmse_m <= rmse
    assert low < imm.nees_position < high
    assert imm.coverage >= cv.coverage - 0.02
    assert imm.position_rmse_m <= 1.1 * cv.position_rmse_m


@pytest.mark.costly
def test_on_the_boat_that_turns_hard_imm_pdaf_is_the_best(scores):
    imm, *others = (scores["joyride"][name] for name in ("IMM-PDAF", "CV-PDAF", "CT-PDAF"))
    assert imm.id_switches == 0
    assert all(imm.coverage >= each.coverage and imm.gospa_m < each.gospa_m for each in others)
