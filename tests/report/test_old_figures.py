"""Figures of runs that older versions wrote: the NEES was told as it is, not over the number of its axes."""

import pytest

from vedette_report.page.run import _renamed

OLD = {"bias_m": [0.1, -0.2], "anees": 2.4, "anees_state": 4.8, "anees_state_axes": ["x", "y", "vx", "vy"], "nis": 1.1}


def test_the_nees_of_old_files_is_scaled_to_one():
    told = _renamed(OLD)
    assert (told["nees_position"], told["nees_state"], told["nis"]) == (pytest.approx(1.2), pytest.approx(1.2), 1.1)
    assert not {"anees", "anees_state"} & set(told)


def test_unknown_stays_unknown_and_new_files_stay_as_they_are():
    unknown = _renamed({"bias_m": None, "anees": None, "anees_state": None, "anees_state_axes": None})
    assert (unknown["nees_position"], unknown["nees_state"]) == (None, None)
    new = {"bias_m": [0.1, -0.2], "nees_position": 1.2, "nees_state": None}
    assert _renamed(new) == new
