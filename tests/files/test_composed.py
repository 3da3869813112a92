"""Columns that are made of others: times in several columns, positions in the cells of one, angles with letters."""

import math

import pytest
from hypothesis import given
from hypothesis import strategies as st

from vedette_files.tables.composed import cell_of, coordinates, made_of
from vedette_files.tables.numbers import degrees

HEADER = ["Date", "Time", "stamp.secs", "stamp.nsecs", "geom", "x"]
ROW = ["2026-05-12T00:00:00", "08:30:00", "12", "5000000", "POINT Z(10.5 59.4 3)", "7"]


@pytest.mark.parametrize(
    ("title", "parts", "cell"),
    [
        ("x", ("x",), "7"),
        ("Date + Time", ("Date", "Time"), "2026-05-12 08:30:00"),
        ("stamp.secs + stamp.nsecs", ("stamp.secs", "stamp.nsecs"), "12.005000000"),
        ("geom.x", ("geom",), "10.5"),
        ("geom.y", ("geom",), "59.4"),
    ],
)
def test_a_cell_is_read_from_the_columns_it_is_made_of(title, parts, cell):
    assert made_of(title, HEADER) == parts
    assert cell_of(title, HEADER)(ROW) == cell


def test_what_no_column_makes_is_made_of_none():
    assert made_of("y", HEADER) == made_of("Date + y", HEADER) == made_of("y.x", HEADER) == ()


def test_an_empty_part_makes_an_empty_cell():
    assert cell_of("Date + Time", HEADER)(["2026-05-12", "", *ROW[2:]]) == ""


@pytest.mark.parametrize(
    "cell", ["", "7", "POINT EMPTY", "POINT(1)", "LINESTRING(1 2, 3 4)", "1, 2, 3, 4", "08:30:00", "a, b"]
)
def test_what_is_no_position_holds_none(cell):
    assert coordinates(cell) == ()


@given(
    st.floats(-89.9, 89.9),
    st.sampled_from(["{d}°{m}'{s:.4f}\"{h}", "{d} {dm:.6f} {h}", "{h}{d:02}-{dm:.6f}", "{d:02}{dm:09.6f}{h}"]),
)
def test_minutes_and_seconds_are_degrees(angle, written):
    """However they are written, to the digits they are written with; what rounds up to 60 is refused as it is."""
    size = abs(angle)
    d, m = int(size), int(size % 1 * 60)
    dm, s = size % 1 * 60, (size % 1 * 60 - m) * 60
    if round(dm, 6) >= 60 or round(s, 4) >= 60:
        return
    cell = written.format(d=d, m=m, dm=dm, s=s, h="NS"[math.copysign(1, angle) < 0])
    assert degrees(cell) == pytest.approx(angle, abs=1e-7)


@pytest.mark.parametrize("cell", ["N", "12 99 N", "nan N", "59.4 Q", "1_0"])
def test_what_is_no_angle_is_refused(cell):
    with pytest.raises(ValueError, match=r"^$"):
        degrees(cell)
