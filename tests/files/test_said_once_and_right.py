"""What a reader says of a file fits the file: its unit, its sensors, its blank lines."""

import json

import numpy as np
import pytest

from support.csv_recordings import opened
from vedette import InputError
from vedette_files import JsonLinesSource
from vedette_standard.sensors.cartesian_position import CartesianPosition
from vedette_standard.sensors.range_bearing import RangeBearing

PLANE = {"radar": CartesianPosition(sigma=1.0)}
POLAR = {"radar": RangeBearing(sigma_range=1.0, sigma_bearing=0.01)}


@pytest.mark.parametrize("blank", ["\n", "\n\n\n", "\r\n\r\n", "   \n\t\n", "sep=;\n\n"])
def test_a_table_of_blank_lines_has_no_header(tmp_path, blank):
    with pytest.raises(InputError, match=r"d\.csv: holds blank lines only"):
        opened(tmp_path, blank)


@pytest.mark.parametrize(
    ("largest", "units", "told"),
    [
        (300.0, {}, "goes up to 300 rad, beyond its period of 6.283 rad: are the values in degrees? Then state it, as in "),
        (300.0, {"bearing": "rad"}, "are the values in degrees?"),
        (3600.0, {}, "goes up to 3,600 rad, beyond its period of 6.283 rad, and beyond a turn in degrees, too: is it the "),
        (3600.0, {"bearing": "rad"}, "too: is it the right column, and its unit another, as in source.detections.units.be"),
        (3600.0, {"bearing": "deg"}, "goes up to 3,600 (62.83 rad by source.detections.units.bearing = 'deg'), beyond its "),
        (7200.0, {"bearing": "0.1 deg"}, "goes up to 7,200 (12.57 rad by source.detections.units.bearing = '0.1 deg')"),
        (300.0, {"bearing": "deg"}, None),
        (3600.0, {"bearing": "0.1 deg"}, None),
    ],
)
def test_an_angle_beyond_a_turn_is_told_in_the_unit_that_is_stated(tmp_path, largest, units, told):
    text = f"t,r,b\n0,100,0\n1,100,{largest}\n"
    columns = {"range": "r", "bearing": "b"}
    warnings = opened(tmp_path, text, sensors=POLAR, columns=columns, units=units).warnings
    assert len(warnings) == (told is not None)
    assert all(told in each for each in warnings)
    assert all("degrees" not in each for each in warnings if "deg" in str(units))


HEADER = {"format": "vedette", "version": 1, "sensors": {"radar": {"x": "m", "y": "m"}}}


@pytest.mark.parametrize(
    ("header", "lines", "told"),
    [
        (HEADER, [], "of 'radar': there is nothing"),
        (
            HEADER,
            [{"truth": "a", "time": 0, "state": [1]}],
            r"'radar'; the first problem: .*truth must be",
        ),
        (HEADER | {"sensors": {}}, [{"time": 0, "sensor": "b", "z": []}], "of 'radar', but of no sensor"),
        (HEADER | {"sensors": {"sonar": {"x": "m"}}}, [], "of 'radar', but of 'sonar': there is nothing"),
    ],
)
def test_a_recording_without_scans_is_not_told_to_hold_what_it_lacks(tmp_path, header, lines, told):
    (tmp_path / "r.jsonl").write_text("".join(json.dumps(line) + "\n" for line in [header, *lines]))
    with pytest.raises(InputError, match=told):
        JsonLinesSource(path=str(tmp_path / "r.jsonl")).open(PLANE, np.random.default_rng(0))
