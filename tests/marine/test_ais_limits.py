"""AIS files that are none: what each costs, and that it is told."""

import pytest

from vedette import InputError
from vedette_marine.ais.csv import WANTED, read_csv
from vedette_marine.ais.nmea import read_nmea
from vedette_marine.sources.tables import read_table

HEADER = ",".join(WANTED)
GOOD = "10,235070716,50.8,-1.3,90,10"
SENTENCE = "!AIVDM,1,1,,A,33P;Tw0tjBQO22:E7dm66DrB20UP,0*2E"


def read(tmp_path, *rows, header=HEADER):
    (tmp_path / "ais.csv").write_text("\n".join([header, *rows]) + "\n")
    return read_csv(tmp_path / "ais.csv")


@pytest.mark.parametrize("time", ["nan", "inf", "-inf", "NaN", "1e300", "-1e16", "infinity"])
def test_a_time_that_is_no_time_is_refused(tmp_path, time):
    ships, refused = read(tmp_path, GOOD, GOOD.replace("10,", f"{time},", 1))
    assert ships[235070716].time.tolist() == [10.0]
    assert [problem.place for problem in refused] == ["ais.csv:3"]
    (tmp_path / "ais.txt").write_text(f"1 {SENTENCE}\n{time} {SENTENCE}\n")
    ships, refused, _ = read_nmea(tmp_path / "ais.txt")
    assert ships[235070716].time.tolist() == [1.0]
    assert [problem.place for problem in refused] == ["ais.txt:2"]


@pytest.mark.parametrize("wide", ["7" * 200_000, '"' + "7" * 200_000 + '"', '"7'])
def test_a_wide_or_open_cell_is_an_error_of_its_line(tmp_path, wide):
    with pytest.raises(InputError, match=r"ais.csv:1: "):
        read(tmp_path, GOOD, header=f"{wide},{HEADER}")
    ships, refused = read(tmp_path, GOOD, f"{wide},235070716,50.8,-1.3,90,10")
    assert len(ships[235070716].time) == len(refused) == 1
    assert len(str(refused[0])) < 300
    (tmp_path / "frames.csv").write_text(f"{wide},time_s\na,1\n")
    with pytest.raises(InputError, match=r"frames.csv:1: "):
        read_table(tmp_path / "frames.csv", ("file",), ("time_s",), (), [])
    (tmp_path / "frames.csv").write_text(f"file,time_s\na,1\nb,{wide}\n")
    told = []
    assert len(read_table(tmp_path / "frames.csv", ("file",), ("time_s",), (), told)) == len(told) == 1


def test_a_column_that_stands_twice_is_an_error(tmp_path):
    with pytest.raises(InputError, match=r"ais.csv:1: must have each column once"):
        read(tmp_path, GOOD + ",1", header=f"{HEADER},MMSI")
