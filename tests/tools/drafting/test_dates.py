"""Dates that are not by ISO 8601 are read as they were written, and positions in degrees without a unit are told apart."""

from datetime import datetime, timedelta

import pytest
from hypothesis import given
from hypothesis import strategies as st

from vedette_files.tables.times import check_pattern, stamp
from vedette_tools.drafting.dates import pattern_of
from vedette_tools.drafting.recognising import read_table

PATTERNS = [
    f"{between.join(order)}{gap}{clock}"
    for order in (("%d", "%m", "%Y"), ("%m", "%d", "%Y"), ("%d", "%m", "%y"), ("%d", "%b", "%Y"), ("%Y", "%m", "%d"))
    for between in "/."
    for gap, clock in ((" ", "%H:%M"), ("T", "%H:%M:%S"), (" ", "%I:%M:%S %p"), (", ", "%H:%M:%S.%f"))
]


@given(
    st.sampled_from(PATTERNS),
    st.datetimes(datetime(1990, 1, 1), datetime(2060, 1, 1)),
    st.lists(st.integers(1, 5000), min_size=3, max_size=40),
)
def test_dates_are_read_as_they_were_written(pattern, begin, minutes):
    """In the order of time, over more than one day where day and month look alike: otherwise both patterns are told."""
    moments = [begin]
    for each in minutes:
        moments.append(moments[-1] + timedelta(minutes=each))
    cells = [moment.strftime(pattern) for moment in moments]
    found, told = pattern_of(cells)
    check_pattern(found)
    read = [stamp(cell, found) for cell in cells]
    assert found == pattern or told or read == [stamp(cell, pattern) for cell in cells]
    if any(moment.day > 12 for moment in moments):
        assert found == pattern
        assert not told


@pytest.mark.parametrize(
    ("spelt", "told"),
    [
        ("%a %b %d %H:%M:%S %Y", False),
        ("%a %b %d %H:%M:%S PDT %Y", True),
        ("%a %b %d %H:%M:%S UTC %Y", False),
        ("%a, %d %b %Y %H:%M:%S +0200", False),
    ],
)
def test_dates_as_unix_and_mail_spell_them(spelt, told):
    """A zone without an offset is told, as it is not read."""
    moments = [datetime(2026, 9, 7, 6) + timedelta(minutes=47 * k) for k in range(60)]
    cells = [moment.strftime(spelt) for moment in moments]
    found, said = pattern_of(cells)
    check_pattern(found)
    late = 7200.0 if "+0200" in spelt else 0.0
    assert [stamp(cell, found)[1] + late for cell in cells] == [stamp(moment.isoformat())[1] for moment in moments]
    assert ("PDT" in said) == told == bool(said)


def test_a_pattern_with_the_name_of_a_zone_is_refused():
    with pytest.raises(ValueError, match="must not hold %Z"):
        check_pattern("%d/%m/%Y %H:%M:%S %Z")


@pytest.mark.parametrize(
    "cells", [[], ["12.5", "13"], ["2026-11-23 08:39:04"], ["2026-11-23T08:39:04.5Z"], ["08:39:04"], ["99/99/2026 10:00"]]
)
def test_other_times_have_no_pattern(cells):
    assert pattern_of(cells) == ("", "")


def test_of_day_and_month_the_order_of_time_decides():
    days = [f"{day:02d}/03/2026 10:00" for day in range(1, 12)]
    assert pattern_of(days)[0].startswith("%d/%m")
    assert "%m/%d/%Y %H:%M" in pattern_of(days)[1]
    months = [f"03/{day:02d}/2026 10:00" for day in range(1, 12)]
    assert pattern_of(months)[0].startswith("%m/%d")


def table(path, header, rows):
    path.write_text("\n".join([header, *rows]) + "\n")
    return read_table(path)


def test_a_fleet_as_others_write_it(tmp_path):
    """A BOM, days first, an id of rows beside one of vehicles, degrees under X and Y."""
    rows = [f"{i},bus {i % 3},20/03/2021 10:{i:02d},{32.3 + i % 3 + 1e-5 * i:.6f},{31.4 + 2e-5 * i:.6f}" for i in range(60)]
    found = table(tmp_path / "a.csv", "\ufeffid,vehicle_id,timestamp,X,Y", rows)
    assert found.dates == "%d/%m/%Y %H:%M"
    assert found.identity == "vehicle_id"
    assert found.measured == {"latitude": "Y", "longitude": "X"}


def near(scale, digits, x0=0.0):
    return [f"{i},{x0 + scale * i:.{digits}f},{-0.3 * scale * i + 2 * scale:.{digits}f}" for i in range(50)]


@pytest.mark.parametrize(
    ("header", "rows"),
    [
        ("t,x,y", near(0.01, 6)),  # a radar or a lidar at the origin
        ("t,x,y", near(1.0, 6, 100.0)),  # before it
        ("t,x,y", near(1e-5, 2, 116.3)),  # no digits for a metre
        ("t,x [m],y [m]", near(1e-5, 6, 116.3)),  # a unit
        ("t,x,y", near(1e-5, 6, 500_000.0)),  # out of range
    ],
)
def test_metres_stay_metres(header, rows, tmp_path):
    assert set(table(tmp_path / "a.csv", header, rows).measured) == {"x", "y"}
