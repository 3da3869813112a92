"""Latitudes, longitudes, courses and several platforms in CSV recordings."""

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from support.csv_recordings import PLANE, opened, told
from vedette.errors import ConfigError, InputError
from vedette.space import Space
from vedette_files import CsvSource
from vedette_files.geodesy import COURSE, GEODETIC, Origin, into_plane, made
from vedette_files.tables.platform import POSE, PlatformColumns
from vedette_files.tables.returns import DetectionColumns
from vedette_files.tables.truth import TruthColumns
from vedette_standard.sensors.position_velocity import PositionVelocity
from vedette_standard.sensors.range_bearing import RangeBearing

pytest.importorskip("pymap3d")
RNG = np.random.default_rng(0)
EARTH = {"latitude": "lat", "longitude": "lon"}
POLAR = RangeBearing(sigma_range=1.0, sigma_bearing=0.01)
A, E2 = 6378137.0, 0.0066943799901413165
"""WGS 84: semi-major axis in m and first eccentricity squared."""


def source(folder, text, columns=EARTH, detections=None, **more):
    (folder / "d.csv").write_text(text)
    return CsvSource(
        DetectionColumns(**({"time": "t", "columns": columns} | (detections or {}))), str(folder / "d.csv"), **more
    )


def cartesian(latitude, longitude, altitude):
    """Earth-centred coordinates, by the textbook."""
    phi, lam = np.deg2rad(latitude), np.deg2rad(longitude)
    n = A / np.sqrt(1 - E2 * np.sin(phi) ** 2)
    return np.stack(
        [
            (n + altitude) * np.cos(phi) * np.cos(lam),
            (n + altitude) * np.cos(phi) * np.sin(lam),
            (n * (1 - E2) + altitude) * np.sin(phi),
        ],
        axis=-1,
    )


def in_plane(origin, latitude, longitude, altitude):
    """East, north, up by the textbook."""
    apart = cartesian(latitude, longitude, altitude) - cartesian(origin.latitude, origin.longitude, origin.altitude)
    phi, lam = np.deg2rad(origin.latitude), np.deg2rad(origin.longitude)
    east = np.array([-np.sin(lam), np.cos(lam), 0.0])
    north = np.array([-np.sin(phi) * np.cos(lam), -np.sin(phi) * np.sin(lam), np.cos(phi)])
    up = np.array([np.cos(phi) * np.cos(lam), np.cos(phi) * np.sin(lam), np.sin(phi)])
    return apart @ east, apart @ north, apart @ up


ORIGINS = st.builds(Origin, st.floats(-85, 85), st.floats(-180, 180), st.floats(-100, 3000))
STEPS = st.lists(st.tuples(st.floats(-0.5, 0.5), st.floats(-0.5, 0.5), st.floats(-500, 9e3)), min_size=1, max_size=5)


@settings(max_examples=40, deadline=None)
@given(origin=ORIGINS, steps=STEPS)
def test_the_plane_is_the_tangent_plane_of_the_ellipsoid_and_back(origin, steps):
    north, east, altitude = np.array(steps).T
    latitude, longitude = origin.latitude + north, origin.longitude + east
    place = origin.to_plane(latitude, longitude, altitude)
    np.testing.assert_allclose(place, in_plane(origin, latitude, longitude, altitude), atol=1e-6)
    back = origin.from_plane(*place)
    np.testing.assert_allclose(back[0], latitude, atol=1e-9)
    np.testing.assert_allclose((back[1] - longitude + 180) % 360, 180, atol=1e-8)
    np.testing.assert_allclose(back[2], altitude, atol=1e-3)


@settings(max_examples=40, deadline=None)
@given(origin=ORIGINS, steps=STEPS)
def test_a_place_on_the_ground_comes_back_without_its_height(origin, steps):
    north, east, _ = np.array(steps).T
    latitude, longitude = origin.latitude + north, origin.longitude + east
    x, y, _ = origin.to_plane(latitude, longitude)
    back = origin.from_plane(x, y, None)
    np.testing.assert_allclose(back[0], latitude, atol=1e-7)
    np.testing.assert_allclose((back[1] - longitude + 180) % 360, 180, atol=1e-6)
    np.testing.assert_allclose(back[2], 0, atol=1e-2)


@pytest.mark.parametrize(("frame", "sign"), [("x east, y north", [0, 1]), ("x north, y east", [1, 0])])
def test_returns_in_latitude_and_longitude_stand_around_a_stated_origin(tmp_path, frame, sign):
    origin = Origin(59.0, 10.0)
    recording = source(tmp_path, "t,lat,lon\n0,59.01,10\n1,59.01,10\n1,59,10.02\n", origin=origin, frame=frame).open(
        PLANE, RNG
    )
    z = np.concatenate([scan.detections.z for scan in recording.scans])
    east, north, _ = in_plane(origin, np.array([59.01, 59.01, 59.0]), np.array([10.0, 10.0, 10.02]), 0.0)
    np.testing.assert_allclose(z[:, sign], np.stack([east, north], axis=-1), atol=1e-6)
    assert recording.notes["origin"] == "59.0, 10.0, 0.0"
    assert Origin.of(recording.notes["origin"]) == origin


def test_the_origin_is_the_middle_of_the_returns_also_across_the_date_line(tmp_path):
    recording = source(tmp_path, "t,lat,lon\n0,10,179.999\n1,10.002,-179.999\n2,10.001,-179.9995\n3,x,5\n").open(PLANE, RNG)
    assert recording.notes["origin"] == "10.001, -179.9995, 0.0"
    assert max(np.abs(scan.detections.z).max() for scan in recording.scans) < 200
    assert told(recording) == ["d.csv:5: lat must be a number, got 'x'; write one, as 12.5, or name another column"]


def test_the_far_side_of_the_earth_is_refused_and_does_not_fold_over(tmp_path):
    """59 S 170 W once lay 37.8 km north of 59 N 10 E, without a word."""
    text = "t,lat,lon\n0,59,10\n1,-59,-170\n2,59.1,10\n3,59,36\n4,59,37.5\n5,0,100\n"
    recording = source(tmp_path, text, origin=Origin(59.0, 10.0)).open(PLANE, RNG)
    assert [problem.place for problem in recording.refused] == ["d.csv:3", "d.csv:6", "d.csv:7"]
    assert "20,015 km" in told(recording)[0]
    assert sum(len(scan.detections.z) for scan in recording.scans) == 3


@pytest.mark.parametrize("place", [(59.0, 11.0), (70.0, -30.0), (-10.0, 179.0), (59.0, 10.0)])
def test_distances_on_the_ground_are_those_of_the_ellipsoid(place):
    origin, vincenty = Origin(59.0, 10.0), pytest.importorskip("pymap3d.vincenty")
    wanted, _ = vincenty.vdist(59.0, 10.0, *place)
    np.testing.assert_allclose(origin.on_ground(*place), wanted, rtol=6e-3, atol=1.0)


def test_an_impossible_latitude_is_refused_and_a_far_place_is_said(tmp_path):
    recording = source(tmp_path, "t,lat,lon\n0,59,10\n1,91,10\n2,59,10\n3,59,30\n").open(PLANE, RNG)
    (problem,) = told(recording)
    assert problem.startswith("d.csv:3: lat ")
    assert "-90 to 90, got '91'" in problem
    assert "are up to 1,1" in recording.warnings[0]
    assert "km from the origin" in recording.warnings[0]


def test_range_and_bearing_from_a_ship_whose_place_is_in_latitude_and_longitude(tmp_path):
    text = "t,lat,lon,own_lat,own_lon,hdg\n0,59.01,10,59,10,90\n1,59,10.02,59,10,350\n"
    own = PlatformColumns(
        time="t", columns={"latitude": "own_lat", "longitude": "own_lon", "heading": "hdg"}, units={"heading": "deg"}
    )
    recording = source(tmp_path, text, platform=own, frame="x north, y east").open({"radar": POLAR}, RNG)
    first, second = (scan.detections.z[0] for scan in recording.scans)
    assert first == pytest.approx([1114.2, -np.pi / 2], rel=1e-3)
    assert second == pytest.approx([1150.0, np.deg2rad(100)], rel=2e-3)


def test_speed_and_course_are_velocities(tmp_path):
    sensors = {"ais": PositionVelocity(sigma=1.0, sigma_speed=1.0)}
    columns = EARTH | {"speed": "sog", "course": "cog"}
    given = source(tmp_path, "t,lat,lon,sog,cog\n0,59,10,10,90\n", columns, {"units": {"speed": "kn", "course": "deg"}})
    z = given.open(sensors, RNG).scans[0].detections.z[0]
    assert z[2:] == pytest.approx([10 * 1852 / 3600, 0], abs=1e-9)


def test_truth_in_latitude_and_longitude_lies_on_the_returns(tmp_path):
    (tmp_path / "truth.csv").write_text("t,who,lat,lon,sog,cog\n0,a,59.01,10.01,5,0\n1,a,59.02,10.01,5,0\n")
    truth = TruthColumns(
        file="truth.csv",
        time="t",
        object="who",
        columns=EARTH | {"speed": "sog", "course": "cog"},
        units={"course": "deg"},
    )
    recording = source(tmp_path, "t,lat,lon\n0,59.01,10.01\n1,59.02,10.01\n", truth=truth).open(PLANE, RNG)
    path = recording.truth[0]
    assert path.space.names == ("x", "y", "vx", "vy")
    np.testing.assert_array_equal(path.states[:, :2], [scan.detections.z[0] for scan in recording.scans])
    np.testing.assert_allclose(path.states[:, 2:], [[0, 5], [0, 5]], atol=1e-9)


@pytest.mark.parametrize(
    ("columns", "text"),
    [
        ({"latitude": "lat"}, "columns: must also name a column"),
        (EARTH | {"x": "t"}, "columns: name columns for x"),
        ({"x": "t", "y": "t", "altitude": "t"}, "columns: altitude goes with latitude"),
    ],
)
def test_columns_that_do_not_go_together(columns, text):
    with pytest.raises(ValueError, match=text):
        DetectionColumns(time="t", columns=columns)


PLATFORMS = "t,who,ship,px,py\n0,,north,0,1000\n0,,south,0,-1000\n10,,north,100,1000\n10,,south,0,-900\n"
RADARS = {"near": POLAR, "far": POLAR, "mast": RangeBearing(sigma_range=1.0, sigma_bearing=0.01, x=5.0)}


def test_several_platforms_in_one_file_carry_the_sensors_that_the_config_says(tmp_path):
    (tmp_path / "own.csv").write_text(PLATFORMS)
    own = PlatformColumns(
        file="own.csv", time="t", object="ship", columns={"x": "px", "y": "py"}, sensors={"near": "north", "far": "south"}
    )
    text = "t,who,r,b\n5,near,10,0\n5,far,10,0\n5,mast,10,0\n"
    recording = opened(tmp_path, text, RADARS, columns={"range": "r", "bearing": "b"}, sensor_column="who", platform=own)
    poses = {scan.sensor: None if scan.pose is None else scan.pose.position.tolist() for scan in recording.scans}
    assert poses == {"near": [50, 1000], "far": [0, -950], "mast": None}


def test_a_sensors_platform_has_its_name_where_the_config_does_not_say(tmp_path):
    text = "t,who,r,b,px,py\n0,near,10,0,1,2\n0,far,10,0,3,4\n1,near,10,0,5,6\n1,far,,,,\n1,far,10,0,7,8\n"
    own = PlatformColumns(time="t", object="who", columns={"x": "px", "y": "py"})
    sensors = {name: RADARS[name] for name in ("near", "far")}
    recording = opened(tmp_path, text, sensors, columns={"range": "r", "bearing": "b"}, sensor_column="who", platform=own)
    poses = [(scan.time, scan.sensor, scan.pose.position.tolist()) for scan in recording.scans]
    assert poses == [(0, "near", [1, 2]), (0, "far", [3, 4]), (1, "near", [5, 6]), (1, "far", [7, 8])]
    assert (recording.rows["platform"].used, recording.rows["platform"].left_out) == (4, 1)


def test_a_platform_that_is_not_in_the_file_is_said(tmp_path):
    (tmp_path / "own.csv").write_text(PLATFORMS)
    own = PlatformColumns(
        file="own.csv", time="t", object="ship", columns={"x": "px", "y": "py"}, sensors={"near": "nord", "radar": "south"}
    )
    with pytest.raises(ConfigError) as caught:
        opened(tmp_path, "t,r,b\n5,10,0\n", {"near": POLAR}, columns={"range": "r", "bearing": "b"}, platform=own)
    assert str(caught.value).splitlines() == [
        "platform.sensors.near: the file has no platform 'nord', only 'north', 'south'",
        "platform.sensors.radar: the tracker has no sensor 'radar', only 'near'",
    ]


def test_without_pymap3d_the_error_says_what_to_install(tmp_path, monkeypatch):
    monkeypatch.setitem(__import__("sys").modules, "pymap3d", None)
    with pytest.raises(InputError, match=r"pip install 'vedette\[data\]'"):
        source(tmp_path, "t,lat,lon\n0,59,10\n").open(PLANE, RNG)


def test_an_underscore_makes_no_number(tmp_path):
    """Python reads 1_0 as 10."""
    recording = source(tmp_path, "t,lat,lon\n0,59,10\n1,5_9,10\n2,59,10\n").open(PLANE, RNG)
    assert [problem.place for problem in recording.refused] == ["d.csv:3"]


@pytest.mark.parametrize("frame", ["x north, y east", "x east, y north"])
def test_bearings_count_from_the_north_of_their_own_place(frame, tmp_path):
    """Meridians run together: of a radar two degrees of longitude east of the origin all bearings were 1.6 degrees off."""
    pymap3d = pytest.importorskip("pymap3d")
    site, target = (55.7, 14.7, 0.0), (55.9, 14.2, 0.0)
    azimuth, _, distance = pymap3d.geodetic2aer(*target, *site)
    bearing = azimuth if frame == "x north, y east" else 90.0 - azimuth
    (tmp_path / "d.csv").write_text(f"t,r,b,lat,lon\n0,{distance},{bearing},{site[0]},{site[1]}\n")
    columns = DetectionColumns(time="t", columns={"range": "r", "bearing": "b"}, units={"bearing": "deg"})
    platform = PlatformColumns(time="t", columns={"latitude": "lat", "longitude": "lon"})
    origin = Origin(55.6, 12.7)
    source = CsvSource(columns, str(tmp_path / "d.csv"), platform=platform, origin=origin, frame=frame)
    sensor = RangeBearing(sigma_range=1.0, sigma_bearing=1e-6)
    (scan,) = source.open({"radar": sensor}, RNG).scans
    found = sensor.placed(scan.pose).invert(scan.detections.z).mean[0, :2]
    east, north, _ = origin.to_plane(*map(np.array, target))
    np.testing.assert_allclose(found, [north, east] if frame == "x north, y east" else [east, north], atol=20.0)


@pytest.mark.parametrize(("frame", "way"), [("x north, y east", 1.0), ("x east, y north", -1.0)])
def test_courses_and_headings_count_from_the_north_of_their_own_place(frame, way):
    """A ship that goes north two degrees of longitude east of the origin comes nearer to the origin's meridian."""
    origin, read = Origin(55.6, 12.7), Space((*GEODETIC.axes[:2], *COURSE.axes, POSE.axes[-1]))
    there = into_plane(read, [(lat, 14.7, 10.0, 0.0, 0.0) for lat in (55.699, 55.7, 55.701)], origin, frame)
    space = made(read)
    moved = (there[2] - there[0])[space.locate(Space.of(x="m", y="m"))]
    velocity = there[1, space.locate(Space.of(vx="m/s", vy="m/s"))]
    np.testing.assert_allclose(velocity, 10.0 * moved / np.linalg.norm(moved), atol=1e-3)
    assert there[1, space.names.index("heading")] == pytest.approx(
        -way * np.radians(2.0) * np.sin(np.radians(55.7)), rel=1e-3
    )
