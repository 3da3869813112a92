"""The simulated marine radar: shapes of its echoes, places on its screen; its seed decides."""

import hashlib
import subprocess
import sys

import numpy as np
import pytest
from attrs import evolve

import vedette
from support.marine import SMALL, within, world
from support.paths import EXAMPLES
from vedette import ConfigError
from vedette_marine.screen import RadarScreen
from vedette_sim import Buoy, Land, Leg, Racon, RadarPicturesScene, Rain, SeaClutter, Ship, Vessel
from vedette_sim import ppi_display as display
from vedette_sim.marine_hull import hull
from vedette_sim.marine_synthesis import Synthesis

FAR = Vessel(Ship(start=[0.0, 590.0]), length=2.0, width=1.0, cross_section=1e-9)
SCREEN = {"screen": RadarScreen()}


def scene(**more):
    return RadarPicturesScene(**({"radar": SMALL, "vessels": {"far": FAR}, "frames": 12} | more))


def opened(source, seed=1):
    return source.open(SCREEN, np.random.default_rng(seed))


def test_a_point_s_echo_is_as_wide_as_beam_and_pulse():
    radar = evolve(SMALL, azimuths=1024, beam=np.radians(1.2), pulse=30.0)
    power = np.zeros((radar.azimuths, len(radar.ranges)), dtype=np.float32)
    radar.add_points(power, np.array([1.0]), np.array([300.0]), np.array([5.0]))
    row, column = np.unravel_index(np.argmax(power), power.shape)

    def width(profile, places):
        half = np.flatnonzero(profile >= 0.5 * profile.max())
        ends = []
        for inside, outside in ((half[0], half[0] - 1), (half[-1], half[-1] + 1)):
            logs = np.log(profile[[outside, inside]])
            ends.append(np.interp(np.log(0.5 * profile.max()), logs, places[[outside, inside]]))
        return ends[1] - ends[0]

    assert width(power[:, column], radar.bearings) == pytest.approx(radar.beam, rel=0.03)
    assert width(power[row], radar.ranges) == pytest.approx(radar.pulse, rel=0.03)
    assert np.sum(power * radar.bearings[:, None]) / power.sum() == pytest.approx(1.0, abs=1e-4)
    assert np.sum(power * radar.ranges) / power.sum() == pytest.approx(300.0, abs=0.02)
    assert power.sum() == pytest.approx(5.0 * 2 * np.pi * radar.spread[0] * radar.spread[1], rel=1e-4)
    assert radar.strength(np.array(500.0)) / radar.strength(np.array(1000.0)) == pytest.approx(16.0)


def test_a_point_at_the_bow_is_seen_on_both_sides_of_it():
    power = np.zeros((SMALL.azimuths, len(SMALL.ranges)), dtype=np.float32)
    SMALL.add_points(power, np.array([0.0]), np.array([300.0]), np.array([1.0]))
    np.testing.assert_allclose(power[0], power[-1], rtol=1e-6)
    assert power[0].max() > 0.75


@pytest.mark.parametrize("up", ["north-up", "head-up"])
@pytest.mark.parametrize("at", [(310.0, 205.0), (280.0, -350.0), (-150.0, -420.0), (-390.0, 180.0), (3.0, 400.0)])
@pytest.mark.parametrize("course", [np.pi / 2, np.radians(-200.0)])
def test_an_echo_is_where_the_geometry_says(up, at, course):
    """The centre of brightness, by the plugin's own geometry: within half a pixel, in all quadrants."""
    own = Ship(start=[40.0, -60.0], course=course)
    radar = evolve(SMALL, azimuths=1024, beam="2 deg", up=up)
    made = opened(scene(radar=radar, ownship=own, buoys=(Buoy(at, 3e3),), interface=False))
    frame, pose = made.scans[3].frame, made.scans[3].pose
    painter = scene(radar=radar, ownship=own, interface=False).painter(1)
    heading = np.pi / 2 - pose.heading
    expected = painter.geometry.to_pixels(np.array(at) - pose.position, heading)
    light = frame.pixels.astype(float).sum(axis=0)
    light = np.where(light >= 0.5 * light.max(), light, 0.0)
    rows, columns = np.indices(light.shape)
    found = np.array([np.sum(light * columns), np.sum(light * rows)]) / light.sum()
    assert np.hypot(*(found - expected)) < 0.5
    mirrored = painter.geometry.to_pixels((np.array(at) - pose.position) * [-1, 1], heading)
    assert np.hypot(*(found - mirrored)) > 3.0


def test_each_azimuth_is_seen_at_its_own_time_also_from_a_turning_ship():
    own = Ship(start=[0.0, 0.0], course=0.3, speed=10.0, legs=(Leg("turn", seconds=60, rate="3 deg/s"),))
    target = Ship(start=[400.0, 100.0], course=2.0, speed=12.0)
    sees = world(evolve(SMALL, period=2.5), ownship=own)
    for turn in (0, 3, 7):
        time, azimuth, away = sees.sighted(turn, lambda t: target.states(np.array(t))[:2])
        assert time == pytest.approx((turn + azimuth / (2 * np.pi)) * 2.5, abs=1e-6)
        np.testing.assert_allclose(away, (target.states(time) - own.states(time))[:2], atol=1e-4)
        true = np.arctan2(away[0], away[1]) - (np.pi / 2 - own.heading(np.array(time)))
        assert np.mod(azimuth - true + np.pi, 2 * np.pi) == pytest.approx(np.pi, abs=1e-6)


def test_a_slow_antenna_repeats_what_it_has_not_swept_since():
    synthesis = Synthesis(world(evolve(SMALL, period=2.5), sea=SeaClutter()), 3)
    before, then = synthesis.sweeps(5.0)
    after, later = synthesis.sweeps(6.0)
    old = later == then
    assert np.mean(old) == pytest.approx(0.6, abs=0.01)
    np.testing.assert_array_equal(before[old], after[old])
    assert not np.any(np.all(before[~old] == after[~old], axis=1))
    assert np.all((later <= 6.0 + 1e-6) & (later > 3.5 - 0.02))


def test_an_own_ship_that_turns_shows_still_things_where_they_are():
    """North-up from a ship that turns by 20 degrees a second: a still buoy stays on its pixel."""
    own = Ship(start=[0.0, 0.0], course=1.0, legs=(Leg("turn", seconds=60, rate="20 deg/s"),))
    radar = evolve(SMALL, azimuths=1024)
    synthesis = Synthesis(world(radar, ownship=own, buoys=(Buoy((300.0, 0.0), 1e4),)), 2)
    for time in (3.0, 5.0, 9.0):
        picture = synthesis.picture(time).astype(float)
        picture[picture < 0.5 * picture.max()] = 0.0
        rows, columns = np.indices(picture.shape)
        found = np.array([np.sum(picture * columns), np.sum(picture * rows)]) / picture.sum()
        np.testing.assert_allclose(found, [100.5 + 50.0, 100.5], atol=0.6)


@pytest.mark.costly
def test_the_seed_decides_whatever_the_order_and_the_process():
    given = RadarPicturesScene(
        radar=evolve(SMALL, period=1.5), vessels={"far": FAR, "near": evolve(FAR, cross_section=100.0)}, frames=6,
        sea=SeaClutter(), rain=(Rain((100.0, 100.0), 80.0),), land=(Land([(-300, -300), (300, -300), (0, -500)]),),
        buoys=(Buoy((200.0, 50.0)),), racons=(Racon((-200.0, 100.0)),),
    )  # fmt: skip
    forward, backward = opened(given).scans, opened(given).scans
    first = [forward[i].frame.pixels for i in range(6)]
    for i in (5, 2, 0, 4, 1, 3):
        np.testing.assert_array_equal(first[i], backward[i].frame.pixels)
    assert not np.array_equal(first[0], first[1])
    assert not np.array_equal(first[0], opened(given, seed=2).scans[0].frame.pixels)
    code = (
        "import hashlib, numpy as np, vedette\n"
        "from vedette_marine.screen import RadarScreen\n"
        "small = ['source.radar.size=256', 'source.radar.range=700']\n"
        "source = vedette.load('examples/manv_scene.toml', overrides=small).source\n"
        "scans = source.open({'screen': RadarScreen()}, np.random.default_rng(5)).scans\n"
        "print(hashlib.sha256(scans[40].frame.pixels.tobytes()).hexdigest())"
    )
    told = subprocess.run([sys.executable, "-c", code], cwd=EXAMPLES.parent, capture_output=True, text=True, check=True)
    small = ["source.radar.size=256", "source.radar.range=700"]
    here = opened(vedette.load(EXAMPLES / "manv_scene.toml", overrides=small).source, seed=5).scans
    assert here[50] is not None
    assert told.stdout.strip() == hashlib.sha256(here[40].frame.pixels.tobytes()).hexdigest()


def test_another_vessel_changes_nothing_elsewhere():
    plain = Synthesis(world(sea=SeaClutter(), vessels={"far": FAR}), 7).power(4)
    other = evolve(FAR, path=Ship(start=[300.0, 0.0]), cross_section=1e4)
    more = Synthesis(world(sea=SeaClutter(), vessels={"other": other, "far": FAR}), 7).power(4)
    assert np.max(more / plain) > 100.0
    elsewhere = np.abs(SMALL.bearings - np.pi / 2) > 0.3
    np.testing.assert_array_equal(plain[elsewhere], more[elsewhere])


@pytest.mark.statistical(alpha=1e-5)
def test_a_vessel_s_mean_echo_is_its_cross_section_and_comes_from_its_near_side():
    vessel = Vessel(Ship(start=[0.0, 0.0]), length=100.0, width=20.0, cross_section=500.0, superstructure=0.2, bridge=-0.3)
    places, sections = vessel.scatterers(0.7, np.array([-np.sin(0.7), np.cos(0.7)]) * 900.0)  # seen broadside
    assert sections.sum() == pytest.approx(500.0)
    turn = np.array([[np.cos(0.7), -np.sin(0.7)], [np.sin(0.7), np.cos(0.7)]])
    body = places @ turn
    assert np.all(np.abs(body) <= [50.0 + 1e-9, 10.0 + 1e-9])
    np.testing.assert_allclose(body[-1], [-30.0, 0.0], atol=1e-9)
    assert sections[-1] == pytest.approx(100.0)
    near = body[:-1, 1] < 0  # the radar is to starboard
    assert sections[:-1][near].sum() > 0.9 * 400.0
    _, ahead = vessel.scatterers(0.7, np.array([np.cos(0.7), np.sin(0.7)]) * 900.0)
    assert ahead.sum() == pytest.approx(500.0 * 0.2)
    rng = np.random.default_rng(1)
    drawn = np.array([vessel.draw(rng) for _ in range(4000)])
    assert within(drawn[:, 0], 1.0)
    totals = (drawn * sections).sum(axis=1) / 500.0
    share = sections / 500.0  # variance of gamma x sum of exponentials: (1 + 1/k)(1 + sum share^2) - 1
    assert within((totals - 1.0) ** 2, (1 + 1 / vessel.steadiness) * (1 + np.sum(share**2)) - 1.0)
    plates, normals, _ = hull(100.0, 20.0)
    assert np.all(np.sum(normals * plates, axis=1) > 0)


def test_a_racon_sends_its_letter_behind_its_place_18_of_45_s():
    racon = Racon((0.0, 200.0), letter="K", length=270.0, delay=30.0)
    assert [racon.answers(t) for t in (0.0, 17.9, 18.1, 44.9, 45.1)] == [True, True, False, False, True]
    units = racon.profile(30.0 + 30.0 * (np.arange(9) + 0.5))
    np.testing.assert_array_equal(units, [1, 1, 1, 0, 1, 0, 1, 1, 1])  # -.-
    on, off = (Synthesis(world(racons=(racon,)), 1).power(turn) for turn in (5, 20))
    assert on[0, round(250 / 3)] > 100.0  # inside the first dash
    assert off[0, round(250 / 3)] < 20.0
    assert np.all(on[64] < 30.0)


def test_land_stays_rain_drifts_and_only_speckle_changes():
    coast = Land([(-600, 200), (600, 200), (600, 700), (-600, 700)], level=50.0)
    radar = evolve(SMALL, gain=0.0)
    resting = Synthesis(world(radar, lands=(coast,)), 1)
    resting.lay_land(100.0)
    np.testing.assert_array_equal(resting.mean(0), resting.mean(9))
    north, south = resting.mean(0)[0], resting.mean(0)[128]
    assert north[int(230 / 3)] > 1e3
    assert np.all(south == 1.0)
    assert np.all(north[: int(190 / 3)] == 1.0)
    moving = Synthesis(world(radar, lands=(coast,), ownship=Ship(start=[0, 0], course=np.pi / 2, speed=10.0)), 1)
    moving.lay_land(20.0)
    assert np.argmax(moving.mean(10)[0] > 10) == pytest.approx(np.argmax(moving.mean(0)[0] > 10) - 100 / 3, abs=2.1)
    shower = Rain((300.0, 0.0), 150.0, level=20.0, drift=(0.0, 20.0))
    wet = Synthesis(world(radar, rains=(shower,)), 1).mean(10)  # 10.5 s later it is 210 m farther north
    x, y = np.sin(radar.bearings)[:, None] * radar.ranges, np.cos(radar.bearings)[:, None] * radar.ranges
    profile = np.exp(-0.5 * ((x - 300.0) ** 2 + (y - 210.0) ** 2) / 150.0**2)
    far = radar.ranges > 30.0
    np.testing.assert_allclose(((wet - 1.0) * (radar.ranges / 1000.0) ** 2 / 100.0)[:, far], profile[:, far], atol=0.03)


def test_the_display_keeps_order_and_the_interface_stays_in_its_boxes():
    levels = np.linspace(-10.0, 40.0, 300, dtype=np.float32)[None]
    shown = display.quantised(levels, 30.0)[0].astype(int)
    assert np.all(np.diff(shown) >= 0)
    assert (shown[0], shown[-1]) == (0, 255)
    grey = np.array([0.114, 0.587, 0.299]) @ display.palette()
    assert np.all(np.diff(grey) > 0)
    assert np.max(np.abs(grey - np.arange(256))) < 20.0
    plain, drawn = (scene(interface=flag, radar=evolve(SMALL, size=512, range=1500.0)).painter(1) for flag in (False, True))
    changed = np.any(plain.pixels(1.0) != drawn.pixels(1.0), axis=0)
    i, j = np.indices(changed.shape)[::-1] - 255.5
    outside = changed & (np.hypot(i, j) * 6.0 > 1500.0 + 6.0)
    for x, y, width, height in drawn.geometry.overlays.astype(int):
        outside[y : y + height, x : x + width] = False
    assert not outside.any()


def test_pictures_are_colour_with_pose_and_geometry_and_lost_ones_leave_true_times():
    made = opened(scene(frames=20, lost=5, interval=2.0, reference="none"))
    assert made.truth == ()
    assert len(made.scans) == 15
    times = np.array([scan.time for scan in made.scans])
    assert (times[0], times[-1]) == (1.0, 39.0)
    assert np.all(np.isin(times, 1.0 + 2.0 * np.arange(20)))
    frame = made.scans[0].frame
    assert (frame.pixels.dtype, frame.pixels.shape) == (np.uint8, (3, 202, 202))
    assert frame.geometry["stabilisation"] == "north-up"
    for name, frames in (("darc", 527), ("manv", 976)):
        assert len(vedette.load(EXAMPLES / f"{name}_scene.toml").source.times(1)) == frames


@pytest.mark.parametrize(
    ("change", "place"),
    [
        ({"vessels": {}}, "vessels"),
        ({"frames": 4, "lost": 3}, "lost"),
        ({"first": 0.5}, "first"),
        ({"reference": "ais"}, "reference"),
        ({"ownship": Ship(start=[0, 0], appears=3.0)}, "ownship"),
        ({"vessels": {"late": evolve(FAR, path=Ship(start=[0, 0], appears=99.0))}}, "vessels.late.path.appears"),
    ],
)
def test_wrong_scenes_are_told_with_their_place(change, place):
    with pytest.raises(ValueError, match=rf"^{place}: "):
        scene(**change)


@pytest.mark.parametrize(
    ("override", "place"),
    [
        ("source.radar.range=9999", "source.radar.range"),
        ("source.radar.azimuths=1001", "source.radar.azimuths"),
        ("source.radar.beam=-1", "source.radar.beam"),
        ("source.radar.beam=0.001", "beam: must be >= the angle between two sweeps"),
        ("source.radar.pulse=1e6", "pulse: must be >= half a pixel"),
        ("source.interval=1e6", "interval: must make a scene of at most"),
        ("source.land[0].outline=[[0, 0], [1, 1]]", r"source.land\[0\].outline: must hold at least 3 corners"),
        ("source.sea.shape=0", "source.sea.shape"),
        ("source.racons[0].letter=Q1", r"source.racons\[0\].letter: must be one of"),
        ("source.vessels.ship.width=400", "source.vessels.ship.width"),
        ("source.vessels.ship.ais.carriage=C", "source.vessels.ship.ais.carriage"),
        ("source.radar.up=south", "source.radar.up"),
    ],
)
def test_wrong_configs_are_told_with_their_place(override, place):
    with pytest.raises(ConfigError, match=rf"{place}"):
        vedette.load(EXAMPLES / "darc_scene.toml", overrides=[override])


def test_a_scene_needs_a_screen_and_lands_that_fit_into_memory():
    with pytest.raises(ConfigError, match="sensors: radar pictures need one sensor"):
        scene().open({}, np.random.default_rng(1))
    far = Ship(start=[0.0, 0.0], speed=5e4)
    with pytest.raises(ConfigError, match=r"^land: takes .* cells"):
        opened(scene(land=(Land([(0, 0), (9, 0), (0, 9)]),), ownship=far, frames=100, interval=10.0))
