"""Sectors, polygons and tables of detection: who is detected, where clutter lies, and how much of it."""

import numpy as np
import pytest

import vedette
import vedette_standard as standard
from vedette import Detections, Gaussian, Pose, Scan
from vedette.sampling import Bounds, draw_clutter
from vedette_standard.regions import Polygon
from vedette_standard.sensors.view import Detection, Sector

TRIANGLE = Polygon([[0.0, 0.0], [400.0, 0.0], [0.0, 300.0]])
BESIDE = Polygon([[-500.0, -500.0], [-100.0, -500.0], [-100.0, 0.0]])
TWO = (Sector(-0.5, 0.5), Sector(2.0, 4.0))
RING = {"max_range": 900.0, "min_range": 100.0, "clutter_per_scan": 7.0}
BOX = {"x": Bounds(-1000.0, 1000.0), "y": Bounds(-1000.0, 1000.0)}
DISC = {"range": Bounds(0.0, 1000.0)}
SEEN = {
    "sectors": {"sectors": TWO},
    "polygons": {"polygons": (TRIANGLE, BESIDE)},
    "both": {"sectors": TWO, "polygons": (TRIANGLE, BESIDE)},
}
SENSORS = {
    "range_bearing": lambda **more: (standard.RangeBearing(1.0, 0.1, **RING, **more), DISC),
    "polar_position": lambda **more: (standard.PolarPosition(1.0, 0.1, **RING, **more), BOX),
    "range_bearing_rate": lambda **more: (
        standard.RangeBearingRate(1.0, 0.1, 1.0, max_rate=10.0, **RING, **more),
        DISC | {"range_rate": Bounds(-10.0, 10.0)},
    ),
    "range_only": lambda **more: (standard.RangeOnly(1.0, **RING, **more), DISC),
}
POSITIONS = {
    "ring": lambda **more: (standard.CartesianPosition(1.0, **RING, **more), BOX),
    "half a box": lambda **more: (
        standard.CartesianPosition(1.0, view={"y": Bounds(-1000.0, 30.0), "x": Bounds(-1e3, 1e3)}, **RING, **more),
        BOX,
    ),
}


def number(sensor, region, runs=300):
    z, valid = draw_clutter(sensor, region, np.random.default_rng(4), (runs,))
    assert np.all(np.broadcast_to(sensor.covers(z), valid.shape)[valid])
    return valid.sum() / runs


@pytest.mark.parametrize("seen", SEEN)
@pytest.mark.parametrize("over", ["area", "range"])
@pytest.mark.parametrize("kind", SENSORS)
def test_false_returns_lie_in_view_and_are_as_many_as_stated(kind, over, seen):
    sensor, region = SENSORS[kind](clutter_uniform_over=over, **SEEN[seen])
    assert number(sensor, region) == pytest.approx(7.0, abs=4 * np.sqrt(7 / 300))


@pytest.mark.parametrize("seen", SEEN)
@pytest.mark.parametrize("kind", POSITIONS)
def test_so_are_those_of_sensors_of_positions(kind, seen):
    sensor, region = POSITIONS[kind](**SEEN[seen])
    assert number(sensor, region) == pytest.approx(7.0, abs=4 * np.sqrt(7 / 300))


@pytest.mark.parametrize("along", [1000.0, 2000.0, 5000.0])
def test_far_from_the_origin_a_view_without_a_side_has_as_many(along):
    """It was cut off beyond twice the range from the origin: at 2 km its clutter was too dense, at 5 km it saw nothing."""
    sensor = standard.CartesianPosition(1.0, view={"y": Bounds(-1000.0, 30.0)}, **RING)
    density = sensor.clutter(np.array([200.0, 0.0]))
    assert 7.0 / (np.pi * (900.0**2 - 100.0**2)) < density < 7.0
    assert sensor.at(Pose(np.array([along, 0.0]))).clutter(np.array([along + 200.0, 0.0])) == pytest.approx(density)


def test_so_are_those_of_bearings_and_of_directions_in_space():
    assert number(standard.BearingOnly(0.1, sectors=TWO, clutter_per_scan=7.0), {}) == pytest.approx(
        7.0, abs=4 * np.sqrt(7 / 300)
    )
    whole = standard.RangeBearingElevation(1.0, 0.1, 0.1, sectors=TWO, max_range=1e3, clutter_per_scan=7.0)
    upright = {"elevation": Bounds(-np.pi / 2, np.pi / 2)}
    assert number(whole, DISC | upright, 300) == pytest.approx(7.0, abs=4 * np.sqrt(7 / 300))


def test_a_density_makes_as_many_as_the_view_is_large():
    sensor = standard.PolarPosition(1.0, 0.1, sectors=(Sector(0.0, np.pi / 2),), max_range=1000.0, clutter_density=1e-5)
    assert number(sensor, BOX) == pytest.approx(1e-5 * np.pi * 1e6 / 4, abs=4 * np.sqrt(7.9 / 300))
    triangle = standard.RangeBearing(1.0, 0.1, polygons=(TRIANGLE,), max_range=1000.0, clutter_density=1e-4)
    assert number(triangle, DISC) == pytest.approx(1e-4 * 60000, abs=4 * np.sqrt(6 / 300))


def test_the_size_of_a_view_is_found_from_within_from_outside_and_from_a_platform():
    for x, y in ((0.0, 0.0), (100.0, 60.0), (-300.0, 700.0)):
        sensor = standard.PolarPosition(1.0, 0.1, x=x, y=y, polygons=(TRIANGLE,), clutter_per_scan=6.0, max_range=5e3)
        assert sensor.clutter(np.zeros((1, 2))) == pytest.approx(6.0 / 60000, rel=1e-4)
        far = {"polygons": (TRIANGLE,), "clutter_per_scan": 6.0, "max_range": 700.0}
        there = standard.PolarPosition(1.0, 0.1, **far).at(Pose(np.array([x, y])))
        assert there.clutter(np.zeros((1, 2))) == standard.PolarPosition(1.0, 0.1, x=x, y=y, **far).clutter(np.zeros((1, 2)))
    with pytest.raises(ValueError, match=r"^polygons:"):
        standard.PolarPosition(1.0, 0.1, **far).at(Pose(np.array([2e3, 0.0])))


def test_detection_is_the_tables_within_the_view_and_none_outside():
    table = Detection([[0.9, 0.5], [0.6, 0.2]], [0.0, 500.0], [-1.0, 1.0])
    radar = standard.RangeBearing(
        1.0, 0.1, x=10.0, heading=0.5, max_range=1e3, detection_probability=0.5, detection=table, sectors=TWO
    )
    polar = [
        (100.0, 0.0),
        (600.0, 0.4),
        (600.0, 2.5),
        (100.0, 3.9),
        (100.0, 1.5),
        (1001.0, 0.0),
        (500.0, 0.0),
        (499.0, -3.0),
    ]
    r, b = np.array(polar).T
    x = np.array([10.0, 0.0]) + r[:, None] * np.stack([np.cos(b + 0.5), np.sin(b + 0.5)], axis=-1)
    wanted = [0.45, 0.3, 0.1, 0.25, 0.0, 0.0, 0.3, 0.25]
    np.testing.assert_allclose(radar.detects(x * (1 + 1e-12)), wanted, rtol=1e-12)
    assert radar.covers(np.array(polar)).tolist() == [True, True, True, True, False, False, True, True]


def test_polygons_hold_what_is_inside_them():
    places = np.array([[10.0, 10.0], [200.0, 151.0], [200.0, 149.0], [-1.0, 10.0], [-200.0, -450.0], [-120.0, -100.0]])
    sensor = standard.CartesianPosition(1.0, polygons=(TRIANGLE, BESIDE), detection_probability=0.8)
    assert sensor.detects(places).tolist() == [0.8, 0.0, 0.8, 0.0, 0.8, 0.8]
    corners = [[0, 0], [4, 0], [4, 4], [2, 1], [0, 4]]
    assert Polygon(corners).holds(np.array([[2.0, 0.9], [2.0, 2.0], [3.5, 2.0], [0.5, 2.0]])).tolist() == [
        True,
        False,
        True,
        True,
    ]


@pytest.mark.parametrize(
    ("place", "given"),
    [
        ("sectors[1]", {"sectors": (Sector(0.0, 1.0), Sector(0.5, 2.0))}),
        ("sectors[1]", {"sectors": (Sector(3.0, 4.0), Sector(-3.0, -2.0))}),
        ("polygons", {"polygons": (TRIANGLE,), "sectors": (Sector(3.0, 4.0),), "clutter_per_scan": 1.0}),
        ("clutter_per_scan", {"sectors": (Sector(3.0, 4.0),), "clutter_per_scan": 1.0}),
    ],
)
def test_views_that_make_no_sense_are_refused(place, given):
    with pytest.raises(ValueError, match=rf"^{place.replace('[', '.').replace(']', '.')}:"):
        standard.RangeBearing(1.0, 0.1, **given)


@pytest.mark.parametrize(
    ("place", "make"),
    [
        ("high", lambda: Sector(1.0, 1.0)),
        ("high", lambda: Sector(0.0, 7.0)),
        ("corners", lambda: Polygon([[0, 0], [1, 1], [2, 2]])),
        ("corners", lambda: Polygon([[0, 0], [1, 1]])),
        ("probability", lambda: Detection([[1.5]])),
        ("probability", lambda: Detection([[0.5, 0.5]])),
        ("ranges", lambda: Detection([[0.5], [0.5]], [5.0, 1.0])),
        ("bearings", lambda: Detection([[0.5, 0.5]], bearings=[-3.0, 4.0])),
    ],
)
def test_parts_that_make_no_sense_are_refused(place, make):
    with pytest.raises(ValueError, match=f"^{place}"):
        make()


def scans_without_returns(config, scans=20):
    tracker = vedette.load(config).tracker
    prior = Gaussian(np.array([[500.0, 0.0, 0.0, 0.0]]), np.diag([25.0, 25.0, 1.0, 1.0])[None])
    state = tracker.start(prior)
    for second in range(scans):
        state = tracker.step(state, Scan(float(second), "radar", Detections.of([], 2)))
    return state


@pytest.mark.parametrize("lifecycle", [{"kind": "existence", "lifetime": 1e9}, {"kind": "m_of_n"}])
def test_a_track_outside_the_view_is_not_punished_for_misses(lifecycle):
    config = {
        "sensors": {"radar": {"kind": "range_bearing", "sigma_range": 5.0, "sigma_bearing": 0.01, "max_range": 2000.0,
                              "clutter_per_scan": 1.0, "detection_probability": 0.9}},
        "estimator": {"kind": "ekf", "motion": {"kind": "constant_velocity", "sigma_accel": 0.1}},
        "associator": {"kind": "jpda"},
        "lifecycle": lifecycle,
        "birth": {"kind": "from_returns", "spread": {"vx": 5.0, "vy": 5.0}},
    }  # fmt: skip
    assert not len(scans_without_returns(config).ids)
    config["sensors"]["radar"]["sectors"] = [{"low": "90 deg", "high": "270 deg"}]
    left = scans_without_returns(config)
    assert len(left.ids) == 1
    assert left.existence[0] == pytest.approx(scans_without_returns(config, 1).existence[0], rel=1e-6)
