"""Tables in memory: what pandas, dicts and arrays hold is read as a file's cells are, or refused in words."""

import numpy as np
import pytest

import vedette
from vedette.errors import VedetteError

pd = pytest.importorskip("pandas")
TIMES = 2.0 * np.arange(30)
COLUMNS = {"t": TIMES, "x": 100 + 8 * TIMES, "y": 50 - 3 * TIMES}
FRAME = pd.DataFrame(COLUMNS)

SAME = {
    "columns by name": COLUMNS,
    "rows by name": FRAME.to_dict("records"),
    "a structured array": FRAME.to_records(index=False),
    "durations": FRAME.assign(t=pd.to_timedelta(TIMES, unit="s")),
    "an index with a name": FRAME.set_index("t"),
}


@pytest.mark.parametrize("name", SAME)
@pytest.mark.costly
def test_it_is_tracked(name):
    result = vedette.track(SAME[name])
    assert (len(result.scans), len(result.refused), len(result.tracks)) == (30, 0, 1)


@pytest.mark.costly
def test_cells_without_a_value_are_refused_one_by_one():
    frame = FRAME.astype({"x": "Float64"})
    frame.loc[3, "x"] = pd.NA
    frame["y"] = [np.ones(2) if k == 5 else y for k, y in enumerate(frame["y"])]
    result = vedette.track(frame)
    assert [problem.place for problem in result.refused] == ["data frame:row 4", "data frame:row 6"]


@pytest.mark.parametrize(
    "data", [None, FRAME.to_numpy(), FRAME["x"], b"d.csv", [], [1.0]], ids=lambda data: type(data).__name__
)
def test_what_is_no_table_is_told(data):
    with pytest.raises(VedetteError, match=f"the data must be a file's path, a data frame .*, got {type(data).__name__}"):
        vedette.track(data)


def test_columns_of_different_length_and_an_override_that_is_no_list_are_told():
    with pytest.raises(VedetteError, match="the data are no table"):
        vedette.track({"t": [1, 2], "x": [1], "y": [2]})
    with pytest.raises(VedetteError, match=r"overrides: must be a list of 'path.to.key=value'.*'seed=3'"):
        vedette.track(FRAME, None, "seed=3")


def test_a_title_that_stands_twice_in_parquet_is_told(tmp_path):
    pa, parquet = pytest.importorskip("pyarrow"), pytest.importorskip("pyarrow.parquet")
    parquet.write_table(pa.table([TIMES, TIMES, TIMES, TIMES], names=["t", "x", "x", "y"]), tmp_path / "d.parquet")
    with pytest.raises(VedetteError, match=r"there is more than one.*'x'"):
        vedette.track(tmp_path / "d.parquet")


def test_returns_of_one_scan_look_wrong():
    from vedette_report.warnings.words import warnings

    experiment = vedette.load(ONE)
    result = vedette.track(FRAME.assign(t=1.0), ONE)
    assert any("all 30 returns are of one scan" in said for said in warnings(experiment, result, result.score()))


ONE = {
    "source": {"kind": "csv", "detections": {"time": "t", "columns": {"x": "x", "y": "y"}}},
    "sensors": {"radar": {"kind": "cartesian_position", "sigma": 5.0}},
    "estimator": {"kind": "kalman", "motion": {"kind": "constant_velocity", "sigma_accel": 0.1}},
    "associator": {"kind": "gnn"},
    "birth": {"kind": "from_returns", "spread": {"vx": 10.0, "vy": 10.0}},
    "lifecycle": {"kind": "m_of_n"},
}
