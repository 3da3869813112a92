"""What no sensor sends is told, in tables and JSON lines alike, and nothing is told of sound recordings."""

import json

import numpy as np
import pytest

from vedette_files import CsvSource, JsonLinesSource
from vedette_files.tables.returns import DetectionColumns
from vedette_standard.sensors.cartesian_position import CartesianPosition
from vedette_standard.sensors.range_bearing import RangeBearing

RNG = np.random.default_rng(0)


def scene(extra=lambda time, z: [], count=60, round_to=2):
    """Scans (time, [[x, y], ..]) of two targets and false returns, with what else each holds."""
    rng, scans = np.random.default_rng(1), []
    for k in range(count):
        z = [[300 + 4 * k, -200 + k], [50.0 - 3 * k, 400.0], *rng.uniform(-500, 500, (3, 2)).tolist()]
        z = np.round(z + rng.normal(0, 5, (5, 2)), round_to).tolist()
        scans.append((float(k), z + extra(k, z)))
    return scans


def table(folder, scans, **more):
    lines = ["t,x,y", *(f"{time},{x},{y}" for time, z in scans for x, y in z)]
    (folder / "d.csv").write_text("\n".join(lines) + "\n")
    columns = DetectionColumns(time="t", columns={"x": "x", "y": "y"}, **more.pop("columns", {}))
    return CsvSource(columns, str(folder / "d.csv"), **more).open({"radar": CartesianPosition(sigma=5.0)}, RNG).warnings


def lines(folder, scans, **more):
    head = {"format": "vedette", "version": 1, "sensors": {"radar": {"x": "m", "y": "m"}}}
    rows = [{"time": time, "sensor": "radar", "z": z} for time, z in scans]
    (folder / "d.jsonl").write_text("\n".join(map(json.dumps, [head, *rows])) + "\n")
    return JsonLinesSource(str(folder / "d.jsonl"), **more).open({"radar": CartesianPosition(sigma=5.0)}, RNG).warnings


WRITTEN = pytest.mark.parametrize("written", [table, lines])


@WRITTEN
@pytest.mark.parametrize("mark", [[-999.0, -999.0], [0.0, 0.0], [-9999.0, -9999.0]])
@pytest.mark.parametrize("often", [1, 3])
def test_one_row_that_comes_again_and_again_is_told(tmp_path, written, mark, often):
    told = written(tmp_path, scene(lambda k, z: [mark] * (k % often == 0)))
    assert all("stands for what is missing" in one for one in told)
    assert f"{60 // often} returns are x = {mark[0]:.10g} m, y = {mark[1]:.10g} m" in told[-1]


@WRITTEN
def test_rows_written_twice_are_told(tmp_path, written):
    rng = np.random.default_rng(5)
    (told,) = written(tmp_path, scene(lambda k, z: [one for one in z if rng.random() < 0.3]))
    assert "returns repeat another of their scan" in told


@WRITTEN
@pytest.mark.parametrize(
    "extra",
    [
        lambda k, z: [],
        lambda k, z: [[120.5, -30.25]],  # what stands there
        lambda k, z: [[120.0, 120.0], [-40.0, -40.0]],  # two that do
        lambda k, z: [[7.0, 7.0]] * (k % 20 == 0),
    ],
)
@pytest.mark.parametrize("round_to", [0, 2])
def test_nothing_is_told_of_what_a_sensor_sends(tmp_path, written, extra, round_to):
    assert written(tmp_path, scene(extra, round_to=round_to)) == ()


def test_objects_of_a_name_may_stand_still(tmp_path):
    scans = scene(lambda k, z: [[0.0, 0.0]])
    lines = ["t,x,y,id", *(f"{time},{x},{y},{i}" for time, z in scans for i, (x, y) in enumerate(z))]
    (tmp_path / "d.csv").write_text("\n".join(lines) + "\n")
    columns = DetectionColumns(time="t", columns={"x": "x", "y": "y"}, identity="id")
    recording = CsvSource(columns, str(tmp_path / "d.csv")).open({"radar": CartesianPosition(sigma=5.0)}, RNG)
    assert recording.warnings == ()


@pytest.mark.parametrize(
    ("moves", "hold", "told"),
    [
        (4.0, 0.2, 1),  # a position that stands until the next one comes
        (4.0, 0.0, 0),
        (0.02, 0.2, 0),  # who hardly moves, in a file of one decimal: each step is one of the last digit
    ],
)
def test_positions_that_are_held_are_told_of_objects_that_go_on(tmp_path, moves, hold, told):
    rng, kept, rows = np.random.default_rng(3), {}, []
    for time in range(150):
        for i in range(3):
            if rng.random() >= hold or i not in kept:
                kept[i] = np.round([moves * time + 50 * i, -moves * time], 1)
            rows.append(f"{time},{kept[i][0]},{kept[i][1]},{i}")
    (tmp_path / "d.csv").write_text("\n".join(["t,x,y,id", *rows]))
    columns = DetectionColumns(time="t", columns={"x": "x", "y": "y"}, identity="id")
    warnings = CsvSource(columns, str(tmp_path / "d.csv")).open({"radar": CartesianPosition(sigma=5.0)}, RNG).warnings
    assert len(warnings) == told
    assert all("keep the first row of each" in one for one in warnings)


def test_a_range_of_zero_is_told_and_a_fixed_echo_is_not(tmp_path):
    radar = {"radar": RangeBearing(sigma_range=5.0, sigma_bearing=0.01)}
    for r, told in ((0, 1), (850, 0)):
        rows = [f"{k},{300 + k + i},{0.01 * k + i}" for k in range(40) for i in range(3)] + [
            f"{k},{r},0.5" for k in range(40)
        ]
        (tmp_path / "d.csv").write_text("\n".join(["t,r,b", *sorted(rows, key=lambda row: float(row.split(",")[0]))]))
        columns = DetectionColumns(time="t", columns={"range": "r", "bearing": "b"})
        assert len(CsvSource(columns, str(tmp_path / "d.csv")).open(radar, RNG).warnings) == told


@WRITTEN
def test_a_clock_set_back_is_told_where_lines_are_sorted(tmp_path, written):
    scans = [(time if time < 35 else time - 20, z) for time, z in scene()]
    (told,) = written(tmp_path, scans, sort=True)
    assert "times go back by 19 s and on in order: sorted, 20 times lie among those before" in told
    assert ":177: radar" in told if written is table else ":37: radar" in told


@WRITTEN
@pytest.mark.parametrize("order", ["shuffled", "late", "parts"])
def test_lines_out_of_order_are_sorted_without_a_word(tmp_path, written, order):
    scans, rng = scene(), np.random.default_rng(2)
    by = {
        "shuffled": rng.permutation(60),
        "late": np.argsort(np.arange(60) + rng.uniform(0, 4, 60)),
        "parts": np.roll(range(60), 30),
    }
    assert written(tmp_path, [scans[i] for i in by[order]], sort=True) == ()


@WRITTEN
@pytest.mark.parametrize(
    ("begins", "back", "told"),
    [
        (7180, 3600, 1),  # the hour comes again, and none of it was there before but its last 20 s
        (7198, 3600, 1),
        (7180, 1800, 0),
        (7205, 3600, 0),  # never at the end of an hour
    ],
)
def test_an_hour_that_comes_again_is_told_where_no_times_lie_among_others(tmp_path, written, begins, back, told):
    times = [(begins + k, z) for k, (_, z) in enumerate(scene())]
    found = written(tmp_path, [(time if time < 7200 else time - back, z) for time, z in times], sort=True)
    assert len(found) == told
    assert all(
        "times go back by 3599 s and on in order: did summer time end? Then write them in UTC" in one for one in found
    )


def test_one_line_that_is_late_by_an_hour_is_no_end_of_summer_time(tmp_path):
    times = [*range(7150, 7200), 3600, *range(7200, 7250)]
    scans = [(time, scene()[0][1]) for time in times]
    assert not [one for one in lines(tmp_path, scans, sort=True) if "summer" in one]


@pytest.mark.parametrize(("column", "told"), [("boat", 0), ("radar", 1)])
def test_no_clock_was_set_back_where_the_rows_of_one_object_follow_those_of_another(tmp_path, column, told):
    rows = [f"{time},{time * speed},{speed},{speed},7" for speed in (3, 5) for time in range(40)]
    (tmp_path / "d.csv").write_text("\n".join(["t,x,y,boat,radar", *rows]))
    columns = DetectionColumns(time="t", columns={"x": "x", "y": "y"}, identity=column)
    source = CsvSource(columns, str(tmp_path / "d.csv"), sort=True)
    assert len(source.open({"gps": CartesianPosition(sigma=5.0)}, RNG).warnings) == told


def test_scans_that_are_copies_are_told(tmp_path):
    scans = scene()
    told = lines(tmp_path, [*scans, *scans[-2:]], sort=True)
    assert told == ("radar: 2 of 62 scans are copies of another: each counts as one more; delete the copies",)
    alike = [one for time, z in scans for one in ((time, z), (time, z[::-1]), (time, []), (time, []))]
    assert lines(tmp_path, alike) == ()
