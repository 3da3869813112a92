"""Tables as they are found: names, times and places of all kinds, several objects under one name, folders of files."""

import json
from pathlib import Path

import numpy as np
import pandas as pd
import pyarrow as pa
import pyarrow.parquet as pq
import pytest

import vedette
from support.reports import METRES, reports_frame
from vedette.cli import main
from vedette_tools.smoothing import files, several_objects, two_chains
from vedette_tools.smoothing.cells import DEVIATIONS, PIECE

STILL = ["x", "y", DEVIATIONS[0]]


@pytest.fixture(scope="module")
def frame():
    return reports_frame(objects=3, rows=60)[0]


@pytest.fixture(scope="module")
def plain(frame):
    return vedette.smooth_positions(frame)


@pytest.fixture
def folder(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    return tmp_path


NUMBERS = {
    "whole": lambda ids: ids.str[5:].astype(int),
    "floating": lambda ids: ids.str[5:].astype(float),
    "nullable": lambda ids: ids.str[5:].astype("Int64"),
    "text and numbers": lambda ids: pd.Series(
        [int(one[5:]) if k % 2 else one[5:] for k, one in enumerate(ids)], dtype=object
    ),
    "bytes": lambda ids: ids.str.encode("ascii"),
}


@pytest.mark.parametrize("kind", NUMBERS)
def test_names_are_what_they_say_whatever_their_type(kind, frame, plain):
    smooth = vedette.smooth_positions(frame.assign(id=NUMBERS[kind](frame.id)), by="id")
    pd.testing.assert_frame_equal(smooth[STILL], plain[STILL])


@pytest.mark.parametrize("nothing", ["", "NULL", "nan", None])
def test_a_cell_that_says_nothing_is_no_name(nothing, frame):
    some = np.arange(len(frame)) % 5 == 0
    assert len(vedette.smooth_positions(frame.assign(id=frame.id.mask(some, nothing)))) == np.count_nonzero(~some)


ZONE = "Europe/Oslo"
TIMES = {
    "a zone": lambda when: when.dt.tz_localize("UTC").dt.tz_convert(ZONE),
    "durations": lambda when: when - pd.Timestamp(0),
    "microseconds of 1500": lambda when: when.astype("datetime64[us]") - np.timedelta64(471 * 365, "D"),
}


@pytest.mark.parametrize("kind", TIMES)
def test_times_of_all_kinds_come_back_as_they_were(kind, frame, plain):
    """In nanoseconds a date of 1500 is one of 2084."""
    told = frame.assign(time=TIMES[kind](pd.to_datetime(frame.time, unit="s")))
    np.testing.assert_allclose(vedette.smooth_positions(told)[STILL], plain[STILL], atol=1e-3)
    every = vedette.smooth_positions(told, every="20 s").time
    assert every.dtype.kind == told.time.dtype.kind
    assert getattr(every.dt, "tz", None) == getattr(told.time.dt, "tz", None)
    assert told.time.min() <= every.min() < every.max() <= told.time.max()


def test_a_time_may_be_a_date_and_a_time_of_day_in_two_columns(frame, folder):
    when = pd.to_datetime(frame.time.round(), unit="s")
    whole = frame.assign(time=when.dt.strftime("%Y-%m-%d %H:%M:%S"))
    parted = frame.assign(date=when.dt.strftime("%Y-%m-%d"), time=when.dt.strftime("%H:%M:%S"))
    smooth = vedette.smooth_positions(parted)
    pd.testing.assert_frame_equal(smooth[STILL], vedette.smooth_positions(whole)[STILL])
    assert smooth.time.equals(parted.time)
    parted.to_csv("d.csv", index=False)
    assert main(["smooth", "d.csv", "--workers", "1"]) == 0
    found = pd.read_csv("d-smoothed.csv").sort_values(["date", "time", "id"])
    np.testing.assert_allclose(found.x, smooth.sort_values(["date", "time", "id"]).x, atol=1e-6)
    with pytest.raises(vedette.InputError, match="every"):
        vedette.smooth_positions(parted, every="20 s")


def test_a_path_over_a_pole_keeps_its_speed_and_longitudes_their_way_of_counting():
    """In one plane around the middle of its longitudes it flew at 190 m/s."""
    times = 10.0 * np.arange(200)
    x, y = np.full(200, -300.0), 5.0 * (times - 990.0)
    for pole in (1, -1):
        place = {"lat": pole * (90.0 - np.hypot(x, y) / 111_694), "lon": np.degrees(np.arctan2(x, -pole * y)) % 360.0}
        north = pd.DataFrame({"time": times, "mmsi": 1, **place})
        smooth = vedette.smooth_positions(north)
        assert np.abs(smooth.speed_mps - 5.0).max() < 0.1
        assert smooth.lon.between(0, 360).all()
        assert smooth.lon.max() > 180
        off = (smooth.lon - north.lon + 180) % 360 - 180
        assert (np.abs(off) * np.cos(np.radians(smooth.lat)) * METRES).max() < 1.0
        again = vedette.smooth_positions(smooth[["time", "mmsi", "lat", "lon", "speed_mps", "course_deg"]])
        assert np.abs(again.speed_mps - 5.0).max() < 0.1


def test_an_object_without_positions_may_be_the_last(frame):
    smooth = vedette.smooth_positions(frame.assign(x=frame.x.mask(frame.id == "ship 2")))
    assert smooth[smooth.id == "ship 2"].x.isna().all()


def test_a_lone_report_claims_no_speed_and_pieces_of_one_no_errors(frame):
    lone = pd.DataFrame({"time": [5.0], "id": ["far"], "x": [9e4], "y": [0.0]})
    smooth = vedette.smooth_positions(pd.concat([frame, lone], ignore_index=True))
    assert smooth.speed_deviation_mps.iloc[-1] > smooth.speed_mps.median()
    apart = vedette.smooth_positions(frame, gap="1 ms")
    assert apart[PIECE].max() == 59
    assert apart[list(DEVIATIONS)].isna().all(axis=None)


def pair(rng, apart, *, in_turn, share=0.5):
    """Two objects side by side under one name, that report in turn at random or at the same times; share: of the second."""
    times = 10.0 * np.arange(240) if in_turn else np.repeat(10.0 * np.arange(120), 2)
    second = rng.random(240) < share if in_turn else np.arange(240) % 2 == 1
    x, y = 5.0 * times + rng.normal(0, 3, 240), 3.0 * times + apart * second + rng.normal(0, 3, 240)
    return pd.DataFrame({"time": times, "id": "shared", "x": x, "y": y})


@pytest.mark.parametrize("in_turn", [True, False], ids=["in turn", "at once"])
@pytest.mark.parametrize("apart", [60.0, 1000.0])
@pytest.mark.by_turns
def test_of_several_objects_under_one_name_nothing_is_claimed(apart, in_turn, frame, folder, capsys):
    """Their path in the middle was sure to 3 m, half-way between them; the others lose nothing."""
    shared = pair(np.random.default_rng(1), apart, in_turn=in_turn)
    smooth = vedette.smooth_positions(pd.concat([frame, shared], ignore_index=True))
    own = smooth.id == "shared"
    assert smooth.loc[own, list(DEVIATIONS)].isna().all(axis=None)
    assert smooth.loc[~own, list(DEVIATIONS)].notna().all(axis=None)
    pd.concat([frame, shared]).to_csv("d.csv", index=False)
    assert main(["smooth", "d.csv", "--workers", "1", "--json"]) == 0
    out = capsys.readouterr().out
    assert "rows of 1 object seem to be of several" in out
    assert ("cells hold nan" in out) == ("nan" in Path("d-smoothed.csv").read_text())
    assert json.loads(out.splitlines()[-1])["mixed"] == 1


@pytest.mark.parametrize(("apart", "share"), [(1000.0, 0.3), (1000.0, 0.15), (24.0, 0.3), (15.0, 0.5), (15.0, 0.3)])
@pytest.mark.by_turns
def test_of_two_objects_that_are_near_or_unlike_often_nothing_is_claimed(apart, share, frame, monkeypatch):
    """By five to eight deviations of 3 m, too; the mutant asks for no likelihood, and finds two in one."""
    shared = pair(np.random.default_rng(1), apart, in_turn=True, share=share)
    mixture = pd.concat([frame, shared], ignore_index=True)
    smooth = vedette.smooth_positions(mixture)
    claimed = smooth[DEVIATIONS[0]].notna()
    assert claimed.equals(smooth.id != "shared")
    monkeypatch.setattr(two_chains, "SURE", -np.inf)
    assert vedette.smooth_positions(pd.concat([frame, shared.assign(y=0.0)]))[DEVIATIONS[0]].isna().any()


def test_an_object_that_comes_by_again_is_one(monkeypatch):
    """A shuttle with ten reports a round; the mutant does not look at the way between."""
    times = 10.0 * np.arange(300)
    x = 2000.0 * (1 - 4 * np.abs(times % 100 / 100 - 0.5)) + np.random.default_rng(2).normal(0, 3, 300)
    table = {"time": times, "x": x, "y": np.zeros(300)}
    assert vedette.smooth_positions(table)[DEVIATIONS[0]].notna().all()
    monkeypatch.setattr(several_objects, "ASIDE", 0.0)
    with pytest.raises(vedette.InputError, match="several objects"):
        vedette.smooth_positions(table)


def test_a_frame_that_cannot_be_used_is_told_by_row_and_column(frame):
    for wrong, told in (
        (frame.assign(x="north"), "row 1: x .*'north'"),
        (frame.assign(id=None), "row 1: id must name an object"),
        (pd.concat([frame, frame[["x"]]], axis=1), "two columns are called 'x'"),
    ):
        with pytest.raises(vedette.InputError, match=told):
            vedette.smooth_positions(wrong, by="id")


def test_other_columns_of_parquet_keep_their_types_and_numbers(frame, folder, monkeypatch):
    """By way of a data frame whole numbers beside an empty cell lost digits, and a part's empty column its type."""
    monkeypatch.setattr(files, "ROWS", 50)
    table = pa.Table.from_pandas(frame, preserve_index=False)
    count = len(frame)
    large = pa.array([2**60 + k if k % 5 else None for k in range(count)], pa.int64())
    note = pa.array(["a" if name == "ship 2" else None for name in frame.id])
    for title, cells in (("large", large), ("note", note), ("list", pa.array([[1, 2]] * count)), ("none", pa.nulls(count))):
        table = table.append_column(title, cells)
    pq.write_table(table, "d.parquet")
    assert main(["smooth", "d.parquet", "--workers", "1"]) == 0
    found = pq.read_table("d-smoothed.parquet").sort_by("time")
    kept = table.sort_by("time")
    for title in ("id", "large", "note", "list", "none"):
        assert found[title].combine_chunks().equals(kept[title].combine_chunks()), title


def test_a_folder_of_files_is_one_table_however_it_was_parted(frame, plain, folder, capsys):
    """By the names of folders, as Spark and Dask write it, and with columns in another order."""
    for name, own in frame.groupby("id"):
        place = Path("parted") / f"id={name.replace(' ', '%20')}"
        place.mkdir(parents=True)
        own.drop(columns="id").reset_index(drop=True).to_parquet(place / "0.parquet")
    Path("pieces").mkdir()
    frame.iloc[:100].to_parquet("pieces/a.parquet", index=False)
    frame.iloc[100:][["y", "id", "x", "time"]].to_parquet("pieces/b.parquet", index=False)
    for given in ("parted", "pieces"):
        assert main(["smooth", given, "--workers", "1"]) == 0
        found = pd.read_parquet(f"{given}-smoothed.parquet").sort_values("time", kind="stable").reset_index(drop=True)
        pd.testing.assert_frame_equal(found[["id", *STILL]], plain[["id", *STILL]], check_dtype=False, atol=2e-6)
    frame.assign(z=1.0).to_parquet("pieces/c.parquet", index=False)
    assert main(["smooth", "pieces", "--workers", "1", "--out", "more.parquet"]) == 2
    assert "c.parquet: has a column 'z'" in capsys.readouterr().err
    Path("pieces/c.parquet").write_bytes(b"PAR1")
    assert main(["smooth", "pieces", "--workers", "1", "--out", "more.parquet"]) == 2
    assert "c.parquet: cannot be read as Parquet" in capsys.readouterr().err


def test_records_and_degrees_with_minutes_are_smoothed(frame, plain, folder):
    frame.to_json("d.jsonl", orient="records", lines=True, double_precision=15)
    assert main(["smooth", "d.jsonl", "--workers", "1"]) == 0
    found = pd.read_csv("d-smoothed.csv").sort_values("time", kind="stable")
    np.testing.assert_allclose(found[STILL], plain[STILL], atol=1e-5)

    def minutes(metres, letters):
        degrees = 10 + metres / METRES
        return [f"{int(each)} {each % 1 * 60:.5f} {letters}" for each in degrees]

    told = {"time": frame.time, "mmsi": frame.id, "lat": minutes(frame.y, "N"), "lon": minutes(frame.x, "E")}
    written = {"time": frame.time, "mmsi": frame.id, "lat": 10 + frame.y / METRES, "lon": 10 + frame.x / METRES}
    found, right = (vedette.smooth_positions(pd.DataFrame(each))[["lat", "lon"]] for each in (told, written))
    np.testing.assert_allclose(found, right, atol=1e-6)


def test_a_guess_of_the_times_unit_is_told(folder, capsys):
    Path("d.csv").write_text("t,id,x,y\n" + "".join(f"{300 * k},a,{40.25 * k},{k % 3}.5\n" for k in range(30)))
    for more, said in (([], True), (["--units", "time=s"], False)):
        assert main(["smooth", "d.csv", "--workers", "1", "--out", f"{said}.csv", *more]) == 0
        assert ("t counts ms" in capsys.readouterr().out) == said
