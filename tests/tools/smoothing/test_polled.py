"""Objects that report in turn, told apart by a column whose title does not say so."""

import numpy as np
import pandas as pd
import pytest

import vedette
from vedette.errors import InputError
from vedette_files.tables.columnar import FrameTable
from vedette_tools.drafting.recognising import read_table


def polled(title):
    """Return six animals 2 km apart, each heard every ten minutes, one a minute."""
    rng, k = np.random.default_rng(1), np.arange(360)
    lat = 36 + 0.02 * (k % 6) + 2e-4 * (k // 6) + rng.normal(0, 2e-5, 360)
    lon = -102 + 3e-4 * (k // 6) + rng.normal(0, 2e-5, 360)
    times = 1_780_000_000 + 600 * (k // 6) + 60 * (k % 6)
    return pd.DataFrame({"fix": k, title: [f"A{i}" for i in k % 6], "time": times, "lat": lat, "lon": lon})


def test_a_column_that_tells_polled_objects_apart_is_named():
    """They were smoothed to one object of 37 m/s, with small deviations; a draft made 60 tracks, and did not say why."""
    frame = polled("cow")
    with pytest.raises(InputError, match=r"by='cow'"):
        vedette.smooth_positions(frame)
    assert vedette.smooth_positions(frame, by="cow").speed_mps.median() < 1.0
    assert any("title it cow_id" in said for said in read_table(FrameTable(frame)).said)
    assert read_table(FrameTable(frame.rename(columns={"cow": "cow_id"}))).identity == "cow_id"


def test_kinds_of_the_rows_of_one_object_do_not_tell_it_apart():
    frame = polled("cow").query("cow == 'A0'")
    for kind in (["a", "b"] * 30, ["a"] * 30 + ["b"] * 30):
        assert not read_table(FrameTable(frame.assign(cow=kind))).apart
