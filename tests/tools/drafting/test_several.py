"""One file of several sensors that measure different things: a radar's ranges beside what ships report of themselves."""

import math
import tomllib

import numpy as np
import pytest

import vedette
from vedette.errors import InputError
from vedette_tools.drafting.chains import Chain
from vedette_tools.drafting.choosing import stood
from vedette_tools.drafting.config import drafted
from vedette_tools.drafting.reading import TRACKER, read
from vedette_tools.drafting.recognising import read_table
from vedette_tools.drafting.several import stand

SHIPS, HEARD, SCANS = 4, 3, 60
KIEL = (54.3, 10.2)


def geodetic(east, north):
    return KIEL[0] + north / 111_320, KIEL[1] + east / (111_320 * math.cos(math.radians(KIEL[0])))


def told(seed=1, moves=0.0, at=(0.0, 0.0)):
    """Yield sensor, time, range and bearing from the radar, east, north, code, and east and north of the radar."""
    rng = np.random.default_rng(seed)
    start, pace = rng.uniform(-3000, 3000, (SHIPS, 2)), rng.normal(0, 6, (SHIPS, 2))
    rows = []
    for time in 2.5 * np.arange(SCANS):
        own = np.array(at) + moves * time
        for i in range(SHIPS):
            east, north = start[i] + pace[i] * time - own
            if rng.random() < 0.9:
                polar = (
                    math.hypot(east, north) + rng.normal(0, 15),
                    math.degrees(math.atan2(east, north)) + rng.normal(0, 0.5),
                )
                rows.append(("radar", float(time), *polar, None, None, "", *own))
    for i in range(HEARD):
        for time in np.arange(rng.uniform(0, 5), 2.5 * SCANS, 5.0).round(1):
            own, spot = np.array(at) + moves * time, start[i] + pace[i] * time + rng.normal(0, 4, 2)
            rows.append(("ais", float(time), None, None, *spot, 211_000_000 + i, *own))
    return sorted(rows, key=lambda row: row[1])


def as_moving(sensor, time, r, b, east, north, code, *own):
    spot = ",".join(f"{each:.6f}" for each in geodetic(east, north)) if r is None else ","
    polar = "," if r is None else f"{r:.1f},{b % 360:.2f}"
    return f"{time},{polar},{spot},{code}," + ",".join(f"{each:.6f}" for each in geodetic(*own))


def as_ashore(sensor, time, r, b, east, north, code, *own):
    spot = ",".join(f"{each:.6f}" for each in geodetic(east, north)) if r is None else ","
    return f"{time},{sensor},{'' if r is None else f'{r:.1f}'},{'' if r is None else f'{b % 360:.2f}'},{spot},{code}"


def in_plane(sensor, time, r, b, east, north, code, *own):
    polar = "," if r is None else f"{r:.1f},{b % 360:.2f}"
    return f"{time},{sensor},{polar},{f'{east:.1f},{north:.1f}' if r is None else ','},{code}"


def all_geodetic(sensor, time, r, b, east, north, code, *own):
    if r is not None:
        east, north = r * math.sin(math.radians(b)) + own[0], r * math.cos(math.radians(b)) + own[1]
    return f"{time},{sensor},{','.join(f'{each:.6f}' for each in geodetic(east, north))},{code}"


FILES = {
    "ashore, nobody says where": ("time,sensor,range_m,bearing_deg,lat,lon,mmsi", as_ashore, {"at": (700.0, -400.0)}),
    "no column of sensors, under way": ("time,range_m,bearing_deg,lat,lon,mmsi,own_lat,own_lon", as_moving, {"moves": 3.0}),
    "x and y beside compass bearings": ("t,source,range,azimuth,x,y,mmsi", in_plane, {}),
    "both as latitudes": ("time,sensor,lat,lon,mmsi", all_geodetic, {}),
}
BY_NIGHT = pytest.mark.nightly("a draft each: the first is drafted by day, and what the others need is tried below")


def written(name, path):
    title, row, scene = FILES[name]
    path.write_text("\n".join([title, *(row(*each) for each in told(**scene))]) + "\n")
    return path


@pytest.mark.costly
@pytest.mark.parametrize("name", [pytest.param(name, marks=BY_NIGHT if i > 0 else ()) for i, name in enumerate(FILES)])
def test_each_ship_has_one_track_of_both_sensors(name, tmp_path):
    """Errors of 15 m and .5 deg, and of 4 m, are found to a third; the fourth ship reports nothing."""
    draft = drafted(written(name, tmp_path / "d.csv"))
    assert not draft.failure
    config = tomllib.loads(draft.text)
    reports = config["sensors"]["reports" if "no column" in name else "ais"]
    assert reports["kind"] == "cartesian_position"
    assert 2.7 < reports["sigma"] < 5.3
    if "latitudes" in name:
        assert config["sensors"]["radar"]["sigma"] > 10
    else:
        assert config["sensors"]["radar"]["kind"] == "range_bearing"
        assert 10 < config["sensors"]["radar"]["sigma_range"] < 20
    tracks = vedette.load(config).run().tracks
    assert len(tracks) == SHIPS
    codes = [set(track.identity[track.identity >= 0].tolist()) for track in tracks]
    assert sorted(code for each in codes for code in each) == [211_000_000 + i for i in range(HEARD)]


def test_rows_without_a_column_of_sensors_are_of_the_one_whose_columns_they_fill(tmp_path):
    path = tmp_path / "d.csv"
    path.write_text("t,r,b,x,y\n0,10,1,,\n1,,,3,4\n2,10,1,3,4\n3,,,,\n4,11,1,,\n")
    columns = {"range": "r", "bearing": "b", "x": "x", "y": "y"}
    sensors = {
        "radar": {"kind": "range_bearing", "sigma_range": 1.0, "sigma_bearing": 0.1},
        "ais": {"kind": "cartesian_position", "sigma": 1.0},
    }
    source = {"kind": "csv", "path": str(path), "detections": {"time": "t", "columns": columns}}
    experiment = vedette.load(TRACKER | {"sensors": sensors, "source": source})
    recording = experiment.source.open(experiment.tracker.sensors, np.random.default_rng(0))
    assert [(scan.time, scan.sensor) for scan in recording.scans] == [(0, "radar"), (1, "ais"), (4, "radar")]
    assert [problem.place for problem in recording.refused] == ["d.csv:4", "d.csv:5"]


@pytest.mark.costly
def test_x_is_east_or_north_as_it_meets_the_radar(tmp_path):
    path = written("x and y beside compass bearings", tmp_path / "d.csv")
    table = read_table(path)
    assert table.others["ais"] == {"x": "x", "y": "y"}
    best, hindered = stood(read(table))
    assert not hindered
    assert best.table.others["ais"] == {"x": "y", "y": "x"}


def reports(paths, times):
    scans = np.arange(len(times))
    return [Chain(scans, 0 * scans, times, path) for path in paths]


def test_a_sensor_stands_where_its_returns_meet_reports():
    """To a fifth of the errors; a grid of 1 m tells whether the median or a cell's middle is returned."""
    rng, times = np.random.default_rng(2), np.arange(50.0)
    paths = np.array([[2000.0 * i, -500.0 * i] + np.outer(times, (5.0, -3.0 * i)) for i in range(3)])
    spots = [paths[:, s] - (312.0, -77.0) + rng.normal(0, 5, (3, 2)) for s in range(50)]
    place, share = stand(reports(paths, times), times, spots, 15.0)
    np.testing.assert_allclose(place, (312.0, -77.0), atol=4 * 5 / 12)
    assert share > 0.9


def test_a_sensor_that_sees_others_stands_nowhere():
    rng, times = np.random.default_rng(3), np.arange(50.0)
    paths = np.array([[2000.0 * i, -500.0 * i] + np.outer(times, (5.0, -3.0 * i)) for i in range(3)])
    spots = [rng.uniform(-5000, 5000, (3, 2)) for _ in times]
    assert stand(reports(paths, times), times, spots, 15.0) is None


def test_ships_at_anchor_do_not_tell_where():
    """A return of one and a report of another tell a place as steadily as those of one do."""
    times = np.arange(50.0)
    paths = np.array([np.tile([2000.0 * i, 0.0], (50, 1)) for i in range(2)])
    spots = [paths[:1, s] - (312.0, -77.0) for s in range(50)]
    assert stand(reports(paths, times), times, spots, 15.0) is None


def test_positions_of_two_kinds_are_refused(tmp_path):
    path = tmp_path / "d.csv"
    rows = [f"{i},a,{i},{i}.5,,\n{i},b,,,54.{i:05d},10.{i:05d}" for i in range(30)]
    path.write_text("\n".join(["time,sensor,x,y,lat,lon", *rows]) + "\n")
    with pytest.raises(InputError, match=r"d\.csv: .*a gives x and y.* b gives lat"):
        read_table(path)


def test_a_sensor_of_bearings_alone_is_left_out(tmp_path):
    path = tmp_path / "d.csv"
    rows = [f"{i},radar,{1000 + i},{i % 7}\n{i},camera,,{i % 7}" for i in range(30)]
    path.write_text("\n".join(["time,sensor,range,bearing", *rows]) + "\n")
    table = read_table(path)
    assert table.sensors == ("radar",)
    assert table.source()["detections"]["sensor_column"] == "sensor"
    assert any("camera" in each for each in table.assumed)
