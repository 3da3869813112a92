"""Parquet files and data frames in the place of CSV files."""

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from support.csv_recordings import PLANE, XY, opened, shown
from vedette.errors import InputError
from vedette_files import CsvSource
from vedette_files.tables.columnar import cell
from vedette_files.tables.returns import DetectionColumns

pd = pytest.importorskip("pandas")
pa = pytest.importorskip("pyarrow")
RNG = np.random.default_rng(0)
TEXT = "t,north,east,who\n0.1,1,2.5,a\n0.1,3,4,b\n0.3,,,c\n0.7,-5e-7,6,d\n"
SOURCE = DetectionColumns(time="t", columns=XY)


def frame(folder, text=TEXT):
    (folder / "f.csv").write_text(text)
    return pd.read_csv(folder / "f.csv")


def of_parquet(folder, given):
    given.to_parquet(folder / "d.parquet")
    return CsvSource(SOURCE, str(folder / "d.parquet")).open(PLANE, RNG)


def test_a_parquet_file_and_a_data_frame_read_as_the_csv_file(tmp_path):
    wanted = opened(tmp_path, TEXT)
    given = frame(tmp_path)
    for found in (of_parquet(tmp_path, given), CsvSource(SOURCE).open_frame(given, PLANE)):
        assert shown(found) == shown(wanted)
        assert found.rows == wanted.rows
        assert found.notes["table"] == "Parquet"


@settings(max_examples=40, deadline=None)
@given(value=st.floats(allow_nan=False) | st.integers(-(2**60), 2**60))
def test_a_number_goes_through_a_cell_to_the_last_bit(value):
    assert type(value)(cell(value)) == value
    assert cell(np.float64("nan")) == cell(pd.NaT) == cell(None) == ""


@pytest.mark.parametrize("zone", [None, "UTC", "Europe/Oslo"])
@pytest.mark.parametrize("unit", ["ns", "us", "ms"])
def test_dates_of_a_column_are_dates(tmp_path, zone, unit):
    given = frame(tmp_path)
    times = pd.to_datetime([0, 0, 250, 1000], unit="ms").as_unit(unit).tz_localize(zone)
    given["t"] = times
    start = 0.0 if zone != "Europe/Oslo" else -3600.0  # Norway was an hour ahead
    for found in (of_parquet(tmp_path, given), CsvSource(SOURCE).open_frame(given, PLANE)):
        np.testing.assert_allclose([scan.time - start for scan in found.scans], [0, 0.25, 1.0], atol=1e-9)
        assert found.notes["time"] == "s since 1970-01-01T00:00:00Z"


def test_a_named_index_is_a_column(tmp_path):
    given = frame(tmp_path).set_index("t")
    assert len(CsvSource(SOURCE).open_frame(given, PLANE).scans) == 3


def test_columns_of_records_in_a_parquet_file_are_columns_of_what_these_hold(tmp_path):
    """A column of positions was one of text, and no x was found."""
    given = pd.DataFrame({"t": [0.0, 1.0], "at": [{"place": {"x": 1.0, "y": 2.0}}, {"place": {"x": 3.0, "y": 4.0}}]})
    given.to_parquet(tmp_path / "d.parquet")
    columns = DetectionColumns(time="t", columns={"x": "at.place.x", "y": "at.place.y"})
    found = CsvSource(columns, str(tmp_path / "d.parquet")).open(PLANE, RNG)
    assert [scan.detections.z.tolist() for scan in found.scans] == [[[1.0, 2.0]], [[3.0, 4.0]]]


def test_a_bad_row_of_a_parquet_file_is_told_by_its_number(tmp_path):
    given = frame(tmp_path)
    given["north"] = ["1", "x", None, "-5"]
    found = of_parquet(tmp_path, given)
    assert [str(problem) for problem in found.refused] == [
        "d.parquet:row 2: north must be a number, got 'x'; write one, as 12.5, or name another column"
    ]


def test_what_is_no_parquet_file_and_what_lacks_a_column_is_said(tmp_path):
    (tmp_path / "d.parquet").write_text(TEXT)
    with pytest.raises(InputError, match=r"d.parquet: cannot be read as Parquet"):
        CsvSource(SOURCE, str(tmp_path / "d.parquet")).open(PLANE, RNG)
    with pytest.raises(InputError, match=r"data frame: there is no.*'north'"):
        CsvSource(SOURCE).open_frame(frame(tmp_path).drop(columns="north"), PLANE)
    with pytest.raises(InputError, match="has a header and no rows"):
        of_parquet(tmp_path, frame(tmp_path).iloc[:0])


def test_without_pyarrow_the_error_says_what_to_install(tmp_path, monkeypatch):
    (tmp_path / "d.parquet").write_text(TEXT)
    monkeypatch.setitem(__import__("sys").modules, "pyarrow", None)
    with pytest.raises(InputError, match=r"pip install 'vedette\[data\]'"):
        CsvSource(SOURCE, str(tmp_path / "d.parquet")).open(PLANE, RNG)
