"""Radars on the earth: their own north and level, slant ranges, heights; against the textbook's positions."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest
from attrs import evolve

from vedette import Array, Sensor
from vedette.errors import ConfigError
from vedette.streams import Message
from vedette_files import FRAMES, Origin
from vedette_live.formats.asterix import Asterix
from vedette_live.placing import Placing
from vedette_live.sources.stream import StreamSource
from vedette_live.stations import Site
from vedette_standard import LinearSensor, PositionVelocity, RangeBearing, RangeBearingElevation, RangeBearingRate

ORIGIN, SITE = Origin(52.0, 5.0), Site(51.46, 6.44, 50.0)
FLAT, STEEP = RangeBearing(50.0, 0.0014), RangeBearingElevation(50.0, 0.0014, 0.001)
OF_RADAR, HEIGHT = ("range", "azimuth"), 10_973.0


def earth(latitude: Any, longitude: Any, height: Any) -> Array:
    """Return places (k, 3) from the middle of WGS 84."""
    b, c, squared = np.radians(latitude), np.radians(longitude), 6.69437999014e-3
    n = 6378137.0 / np.sqrt(1 - squared * np.sin(b) ** 2)
    return np.stack([
        (n + height) * np.cos(b) * np.cos(c), (n + height) * np.cos(b) * np.sin(c), (n * (1 - squared) + height) * np.sin(b)
    ], axis=-1)  # fmt: skip


def local(points: Array, site: Origin | Site) -> Array:
    """Return east, north and up of places (k, 3) as seen from a site."""
    b, c = np.radians(site.latitude), np.radians(site.longitude)
    east = [-np.sin(c), np.cos(c), 0]
    north = [-np.sin(b) * np.cos(c), -np.sin(b) * np.sin(c), np.cos(b)]
    up = [np.cos(b) * np.cos(c), np.cos(b) * np.sin(c), np.sin(b)]
    return (points - earth(site.latitude, site.longitude, site.altitude)) @ np.array([east, north, up]).T


ROUND = np.radians(np.arange(0, 360, 45))
AIRCRAFT = [
    earth(SITE.latitude + d * np.cos(ROUND) / 111e3, SITE.longitude + d * np.sin(ROUND) / 69e3, HEIGHT)
    for d in (15e3, 60e3, 180e3)
]


def told(points: Array, site: Origin | Site) -> Array:
    """Return range, azimuth and elevation (k, 3) of places by a radar at a site."""
    east, north, up = local(points, site).T
    r = np.sqrt(east**2 + north**2 + up**2)
    return np.stack([r, np.arctan2(east, north) % (2 * np.pi), np.arcsin(up / r)], axis=-1)


def shown(placing: Placing, sensor: Sensor, message: Message) -> Array:
    """Return where a tracker puts a message's returns: x, y and, if the sensor tells it, z, as its noise shifts them."""
    pose = placing.pose("radar")
    return sensor.placed(pose).invert(placing.returns(message, "radar")).mean


@pytest.mark.parametrize("frame", FRAMES)
@pytest.mark.parametrize("points", AIRCRAFT)
def test_a_radar_with_a_site_puts_targets_where_they_are(points: Array, frame: str) -> None:
    """Of one 117 km from the origin, places were 1 to 3.4 km off, and heights 3.3 km; slant ranges near it 3.5 km."""
    truth, z = local(points, ORIGIN), told(points, SITE)
    truth[:, :2] = truth[:, :2] if frame == FRAMES[0] else truth[:, 1::-1]
    height = np.full(len(z), HEIGHT)
    by_height = Message("radar", 0.0, np.column_stack([z[:, :2], height]), (*OF_RADAR, "altitude"))
    in_space = Message("radar", 0.0, z, (*OF_RADAR, "elevation"))
    for sensor, message in ((FLAT, by_height), (FLAT, in_space), (STEEP, by_height), (STEEP, in_space)):
        placing = Placing({"radar": sensor}, {}, ORIGIN, frame, {"radar": SITE})
        seen = shown(placing, sensor, message)
        # what the sensors' mean is short of the place by their angles' noise, and the sphere of the ellipsoid
        np.testing.assert_allclose(seen, truth[:, : seen.shape[1]], atol=1.0 + 1e-6 * 2.2 * float(np.max(z[:, 0])))


@pytest.mark.parametrize("origin", [ORIGIN, None])
def test_a_height_takes_the_slant_out_of_a_range_of_the_plane(origin: Origin | None) -> None:
    """At 15 km an aircraft at 11 km was seen 3.5 km too far off."""
    north = np.arange(15e3, 200e3, 30e3)
    points = earth(ORIGIN.latitude + north / 111.26e3, np.full(len(north), ORIGIN.longitude), HEIGHT)
    z, truth = told(points, ORIGIN), local(points, ORIGIN)
    given = np.column_stack([z[:, :2], np.full(len(z), HEIGHT)])
    placing = Placing({"radar": FLAT}, {}, origin)
    seen = placing.returns(Message("radar", 0.0, given, (*OF_RADAR, "altitude")), "radar")
    np.testing.assert_allclose(seen[:, 0], truth[:, 1], atol=1.0 if origin else 20.0)
    given[0, 2] = np.nan
    unknown = placing.returns(Message("radar", 0.0, given, (*OF_RADAR, "altitude")), "radar")
    assert unknown[0, 0] == z[0, 0]
    np.testing.assert_array_equal(unknown[1:], seen[1:])


def test_a_range_rate_is_that_along_the_plane() -> None:
    """By differences, of one that flies level over the radar's north."""
    sensor, at = RangeBearingRate(50.0, 0.0014, 1.0), ORIGIN.latitude + (np.array([0.0, 1.0]) * 200.0 + 20e3) / 111.26e3
    points = earth(at, np.full(2, ORIGIN.longitude), HEIGHT)
    z, truth = told(points, ORIGIN), local(points, ORIGIN)
    given = np.array([[*z[0, :2], HEIGHT, np.diff(z[:, 0])[0]]])
    message = Message("radar", 0.0, given, (*OF_RADAR, "altitude", "range_rate"))
    (seen,) = Placing({"radar": sensor}, {}, ORIGIN).returns(message, "radar")
    assert seen[-1] == pytest.approx(np.diff(truth[:, 1])[0], rel=5e-3)


def test_a_sensor_of_space_takes_no_height_of_none() -> None:
    """Latitude and longitude alone were taken to be of altitude 0: aircraft were 11 km too low."""
    sensor = LinearSensor(("x", "y", "z"), np.eye(3))
    placing = Placing({"radar": sensor}, {}, ORIGIN)
    given = np.array([[52.9, 6.8, HEIGHT], [52.9, 6.8, np.nan]])
    axes = ("latitude", "longitude", "altitude")
    seen = placing.returns(Message("radar", 0.0, given, axes), "radar")
    np.testing.assert_allclose(seen[0], local(earth(52.9, 6.8, HEIGHT), ORIGIN), atol=1e-3)
    assert np.isnan(seen[1, 2])
    for wrong in (Message("radar", 0.0, given[:, :2], axes[:2]), Message("radar", 0.0, given[1:], axes)):
        with pytest.raises(ValueError, match=r"^z: "):
            placing.returns(wrong, "radar")


@pytest.mark.parametrize(
    ("sites", "origin", "place"),
    [
        ({"north": SITE}, ORIGIN, "sites.north"),
        ({"radar": SITE}, None, "sites.radar"),
        ({"radar": Site(0.0, 90.0)}, ORIGIN, "sites.radar"),
        ({"fixed": SITE}, ORIGIN, "sites.fixed"),
        ({"moved": SITE}, ORIGIN, "sites.moved"),
    ],
)
def test_a_site_that_says_nothing_or_too_much_is_refused(sites: dict[str, Site], origin: Origin | None, place: str) -> None:
    sensors = {"radar": FLAT, "fixed": PositionVelocity(5.0, 0.5), "moved": RangeBearing(5.0, 0.01, x=7.0)}
    with pytest.raises(ConfigError) as told:
        StreamSource(Asterix(), "none.ast", origin=origin, sites=sites).open(sensors, np.random.default_rng(0))
    as_run = told.value.within("source")
    assert [problem.place for problem in as_run.problems] == [f"source.{place}"]


def test_a_radar_far_from_the_origin_without_a_site_is_told() -> None:
    """Its north was taken for the plane's without a word: 117 km away places were up to 3.4 km off."""
    far = RangeBearing(50.0, 0.0014, x=100e3, y=-60e3)
    turned, blunt, near = (evolve(far, x=x, sigma_bearing=sigma) for x, sigma in ((1e5, 0.0014), (1e5, 0.05), (1e3, 0.0014)))
    sensors = {"far": far, "near": near, "blunt": blunt, "turned": evolve(turned, heading=-0.02), "sited": FLAT}
    told = Placing(sensors, {}, ORIGIN, sites={"sited": SITE}).doubts()
    assert [sentence.partition(":")[0] for sentence in told] == ["far"]
    assert Placing(sensors, {}, None).doubts() == ()
