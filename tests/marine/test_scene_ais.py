"""What simulated ships say of themselves, their scene as points, and the folder of pictures that other programs read."""

import numpy as np
import pytest
from attrs import evolve

import vedette
from support.paths import EXAMPLES
from vedette import ConfigError
from vedette_marine.ais.reports import KNOT
from vedette_marine.ais.tracks import between
from vedette_marine.screen import RadarScreen
from vedette_marine.sources.pictures import RadarPictures
from vedette_sim import Leg, PpiRadar, RadarPicturesScene, RadarPointsScene, Ship, Transponder, Vessel
from vedette_sim.ais import STEP, antenna_path, nominal_intervals, report_times, reports
from vedette_sim.marine_write import main, write_pictures
from vedette_standard.sensors.cartesian_position import CartesianPosition

HOME = (54.17, 12.1)


def steady(carriage, knots, seconds=600.0, rate=0.0, **more):
    """The intervals of a ship that keeps speed and turn rate, deg/s."""
    steps = int(seconds / STEP)
    return nominal_intervals(carriage, np.full(steps, knots), np.radians(rate) * STEP * np.arange(steps), **more)


@pytest.mark.parametrize(
    ("carriage", "knots", "straight", "turning"),
    [
        ("A", 0.0, 10.0, 10 / 3), ("A", 13.9, 10.0, 10 / 3), ("A", 14.1, 6.0, 2.0), ("A", 22.9, 6.0, 2.0),
        ("A", 23.1, 2.0, 2.0),
        ("B", 1.9, 180.0, 180.0), ("B", 2.1, 30.0, 30.0), ("B", 14.1, 15.0, 15.0), ("B", 23.1, 5.0, 5.0),
    ],
)  # fmt: skip
def test_intervals_are_those_of_the_recommendation(carriage, knots, straight, turning):
    """ITU-R M.1371, tables 1 and 2: speed in knots to seconds between reports."""
    assert np.all(steady(carriage, knots) == straight)
    assert np.all(steady(carriage, knots, rate=1.0)[int(60 / STEP) :] == pytest.approx(turning))
    drawn = report_times(7.0, steady(carriage, knots, 4000.0), 0.1, np.random.default_rng(1))
    gaps = np.diff(drawn)
    assert 7.0 <= drawn[0] < 7.0 + straight
    assert np.all(np.abs(gaps - straight) <= 0.1 * straight + 1e-9)
    assert np.ptp(gaps) > 0.1 * straight


def test_a_ship_at_anchor_reports_each_three_minutes_unless_she_drags():
    assert np.all(steady("A", 0.5, moored=True) == 180.0)
    assert np.all(steady("A", 3.5, moored=True) == 10.0)
    assert np.all(steady("A", 0.5, moored=False) == 10.0)


def test_a_turn_is_over_5_degrees_from_the_mean_of_30_s_and_lasts_20_s_more():
    slow = steady("A", 8.0, rate=0.3)  # lags the mean by 4.5 degrees
    assert np.all(slow == 10.0)
    assert np.all(steady("A", 8.0, rate=0.36)[int(40 / STEP) :] == pytest.approx(10 / 3))
    heading = np.zeros(int(200 / STEP))
    heading[int(100 / STEP) :] = np.radians(8.0)  # at once: 8 degrees, then less and less from the mean
    found = nominal_intervals("A", np.full(len(heading), 8.0), heading)
    quick = np.flatnonzero(found < 5.0) * STEP
    assert quick[0] == pytest.approx(100.0, abs=STEP)
    assert quick[-1] == pytest.approx(100.0 + 30.0 * 3 / 8 + 20.0, abs=3.1 * STEP)


def test_a_faster_rate_comes_at_once_and_a_slower_after_three_minutes():
    speed = np.concatenate([np.full(int(200 / STEP), 10.0), np.full(int(100 / STEP), 16.0), np.full(int(400 / STEP), 10.0)])
    found = nominal_intervals("A", speed, np.zeros(len(speed)))
    quick = np.flatnonzero(found == 6.0) * STEP
    assert quick[0] == pytest.approx(200.0, abs=2 * STEP)
    assert quick[-1] == pytest.approx(300.0 + 180.0, abs=3.1 * STEP)


def test_a_report_comes_early_when_the_interval_becomes_shorter():
    intervals = np.concatenate([np.full(300, 30.0), np.full(300, 2.0)])
    drawn = report_times(0.0, intervals, 0.0, np.random.default_rng(3))
    change = 300 * STEP
    before = drawn[drawn < change]
    np.testing.assert_allclose(np.diff(before), 30.0)
    after = drawn[drawn >= change]
    assert after[0] <= change + 2.0
    np.testing.assert_allclose(np.diff(after), 2.0, atol=STEP)


def test_reports_hold_the_antenna_in_the_steps_of_the_message():
    legs = (Leg("accelerate", seconds=60, accel=0.02), Leg("turn", seconds=300, rate="1 deg/s"))
    path = Ship(start=[300.0, -200.0], course=0.4, speed=6.0, legs=legs)
    sends = Transponder(antenna=[-65.0, 4.0], gnss=0.0)
    sent = reports(path, sends, 7, 200.0, HOME, np.random.default_rng(1))
    for value, step in (
        (sent.latitude * 60, 1e-4),
        (sent.longitude * 60, 1e-4),
        (sent.speed / KNOT, 0.1),
        (np.degrees(sent.course), 0.1),
        (np.degrees(sent.heading), 1.0),
    ):
        np.testing.assert_allclose(value / step, np.rint(value / step), atol=1e-4)
        assert len(np.unique(np.rint(value / step))) > 1
    true = antenna_path(path, sends.antenna, sent.time)
    place = between(sent, HOME, sent.time).place
    assert np.max(np.hypot(*(place - true).T)) < 1e-4 / 60 * 111e3  # half a step north, half a step east
    np.testing.assert_allclose(np.hypot(*(true - path.states(sent.time)[:, :2]).T), np.hypot(65.0, 4.0))
    # Clockwise from north, and to starboard positive on the wire: the turn to port is positive in the filters' sense.
    np.testing.assert_allclose(
        np.mod(np.degrees(sent.heading) - (90 - np.degrees(path.heading(sent.time))) + 180, 360), 180, atol=0.51
    )
    np.testing.assert_allclose(np.degrees(sent.turn)[sent.time > 60], 1.0, atol=0.03)
    own = evolve(sends, carriage="B")
    assert np.all(np.isnan(reports(path, own, 7, 200.0, HOME, np.random.default_rng(1)).turn))


def test_an_antenna_aft_and_to_port():
    """Bound south at 5 m/s, the antenna 60 m aft and 7 m to port is 60 m north and 7 m east of the middle."""
    path = Ship(start=[0.0, 0.0], course=-np.pi / 2, speed=5.0)
    place = antenna_path(path, np.array([-60.0, 7.0]), np.array([0.0, 10.0]))
    np.testing.assert_allclose(place, [[7.0, 60.0], [7.0, 10.0]], atol=1e-9)
    sent = reports(path, Transponder(gnss=0.0), 1, 60.0, HOME, np.random.default_rng(1))
    np.testing.assert_allclose(np.degrees(sent.course), 180.0)
    np.testing.assert_allclose(np.degrees(sent.heading), 180.0)
    np.testing.assert_allclose(sent.velocity, np.broadcast_to([0.0, -5.0], (len(sent.time), 2)), atol=0.05 * KNOT)


def test_speed_and_course_are_those_of_the_antenna():
    path = Ship(start=[0.0, 0.0], course=0.0, speed=5.0, legs=(Leg("turn", seconds=101, rate="3 deg/s"),))
    sent = reports(path, Transponder(antenna=[-60.0, 0.0], gnss=0.0), 1, 100.0, HOME, np.random.default_rng(1))
    swing = np.radians(3.0) * 60.0
    np.testing.assert_allclose(sent.speed, np.hypot(5.0, swing), atol=0.05 * KNOT + 0.02)


@pytest.mark.statistical(alpha=1e-5)
@pytest.mark.costly
def test_the_receiver_s_error_is_stationary_and_correlated():
    path, sends = Ship(start=[0.0, 0.0]), Transponder(gnss=2.0, gnss_seconds=40.0, spread=0.0)
    errors = []
    for seed in range(200):
        sent = reports(path, sends, 1, 100.0, HOME, np.random.default_rng(seed))
        errors.append(between(sent, HOME, sent.time).place[:8])
    errors = np.array(errors)
    squares = np.mean(errors**2, axis=(1, 2))
    assert abs(squares.mean() - 4.0) < 5 * squares.std(ddof=1) / np.sqrt(200)
    products = np.mean(errors[:, 1:] * errors[:, :-1], axis=(1, 2))
    assert abs(products.mean() - 4.0 * np.exp(-10 / 40)) < 5 * products.std(ddof=1) / np.sqrt(200)


@pytest.mark.parametrize(("carriage", "least", "most"), [("A", 2.4, 3.4), ("B", 11.0, 19.0)])
def test_ais_between_reports_errs_as_its_intervals_let_it(carriage, least, most):
    """Straight lines between reports of the two boats: measured 3.0 m rms (A) and 15 to 16 m (B)."""
    scene = vedette.load(EXAMPLES / "manv_scene.toml").source
    vessels = {name: evolve(each, ais=evolve(each.ais, carriage=carriage)) for name, each in scene.vessels.items()}
    scene = evolve(scene, vessels=vessels)
    times = scene.times(1)
    squares = []
    for run in range(4):
        for name, sent in scene.ais(1, run).items():
            error = between(sent, HOME, times, 200.0).place - scene.antenna(name, times)
            squares.append(np.nanmean(np.sum(error**2, axis=-1)))
    assert least < np.sqrt(np.mean(squares)) < most


def small(**more):
    boat = Vessel(
        Ship(start=[-100.0, 150.0], course=0.3, speed=6.0, legs=(Leg("turn", seconds=30, rate="2 deg/s"),)),
        length=30.0, width=8.0, ais=Transponder(antenna=[-8.0, 1.0], mmsi=211000007),
    )  # fmt: skip
    radar = PpiRadar(metres_per_pixel=6.0, range=500.0, size=168, azimuths=128, beam="3 deg")
    return RadarPicturesScene(**({"radar": radar, "vessels": {"boat": boat}, "frames": 8, "lost": 2} | more))


def points(**more):
    return RadarPointsScene(**({"scene": small(frames=60, lost=5)} | more))


@pytest.mark.statistical(alpha=1e-5)
@pytest.mark.costly
def test_points_err_along_and_across_the_hull_and_clutter_fills_the_disc():
    given = points(clutter=4e-5, detection_probability=0.8, extent=0.5)
    runs = given.batch(60, 3)
    assert runs.z.shape[:2] == (60, 55)
    counts = runs.valid.sum(axis=(1, 2)) / 55
    expected = 0.8 + 4e-5 * np.pi * 500.0**2
    assert abs(counts.mean() - expected) < 5 * counts.std(ddof=1) / np.sqrt(60)
    clean = points(clutter=0.0, detection_probability=1.0, extent=0.5).batch(60, 3)
    path = given.scene.vessels["boat"].path
    error = clean.z[:, :, 0] - path.states(clean.times)[:, :2]
    heading = path.heading(clean.times)
    for turn, size in ((0.0, 30.0), (np.pi / 2, 8.0)):
        along = np.mean((error @ np.eye(2) * np.stack([np.cos(heading + turn), np.sin(heading + turn)], -1)).sum(-1) ** 2, 1)
        assert abs(along.mean() - (16.0 + 0.25 * size**2)) < 5 * along.std(ddof=1) / np.sqrt(60)
    false = points(clutter=1e-4, detection_probability=0.0).batch(40, 1)
    near = np.hypot(*np.moveaxis(false.z, -1, 0)) < 250.0
    share = np.array([near[r][false.valid[r]].mean() for r in range(40)])
    assert abs(share.mean() - 0.25) < 5 * share.std(ddof=1) / np.sqrt(40)
    assert np.all(np.hypot(*false.z[false.valid].T) <= 500.0)


def test_each_run_of_points_is_itself_in_any_batch():
    few, many = points(clutter=2e-5).batch(2, 9), points(clutter=2e-5).batch(7, 9)
    np.testing.assert_array_equal(few.z[1][few.valid[1]], many.z[1][many.valid[1]])
    np.testing.assert_array_equal(few.ais[1]["boat"].time, many.ais[1]["boat"].time)
    assert not np.array_equal(many.ais[0]["boat"].time, many.ais[1]["boat"].time)
    assert not np.array_equal(few.z[0][few.valid[0]], few.z[1][few.valid[1]])
    scans = few.scans("radar")
    np.testing.assert_array_equal(scans[4].detections.z, few.z[:, 4])
    with pytest.raises(ConfigError, match="sensors: points need one sensor"):
        points().open({}, np.random.default_rng(1))
    single = points().open({"radar": CartesianPosition(5.0)}, np.random.default_rng(1))
    assert len(single.scans) == 55
    assert single.truth[0].name == "boat"


def test_a_written_folder_reads_back_as_the_scene(tmp_path):
    from vedette_sim import Land

    scene = small(land=(Land([(-400, -300), (400, -300), (0, -480)]),))
    count = write_pictures(scene, tmp_path, np.random.default_rng(4))
    direct = scene.open({"screen": RadarScreen()}, np.random.default_rng(4))
    read = RadarPictures(str(tmp_path)).open({"screen": RadarScreen()}, np.random.default_rng(0))
    assert not read.refused
    assert count == len(read.scans) == len(direct.scans) == 6
    for one, other in zip(direct.scans, read.scans, strict=True):
        assert other.time == pytest.approx(one.time, abs=1e-6)
        np.testing.assert_array_equal(one.frame.pixels, other.frame.pixels)
        np.testing.assert_allclose(other.pose.position, one.pose.position, atol=1e-6)
        assert other.pose.heading == pytest.approx(one.pose.heading, abs=1e-6)
        np.testing.assert_array_equal(one.frame.geometry["land"], other.frame.geometry["land"])
        plain = [{k: v for k, v in each.frame.geometry.items() if k != "land"} for each in (one, other)]
        assert plain[0] == plain[1]
    for time in (2.0, 5.5):
        np.testing.assert_allclose(read.truth[0].at(time)[:4], direct.truth[0].at(time)[:4], atol=0.01)
    by_ais = RadarPictures(str(tmp_path), reference="ais").open({"screen": RadarScreen()}, np.random.default_rng(0))
    told = evolve(scene, reference="ais").open({"screen": RadarScreen()}, np.random.default_rng(4))
    assert by_ais.truth[0].name == told.truth[0].name
    np.testing.assert_allclose(by_ais.truth[0].states, told.truth[0].states, atol=0.01)


def test_the_command_writes_and_tells_what_is_wrong(tmp_path, capsys):
    target = tmp_path / "made"
    few = ["--set", "source.frames=2", "--set", "source.lost=0", "--set", "source.radar.size=240",
           "--set", "source.radar.range=700"]  # fmt: skip
    assert main([str(EXAMPLES / "manv_scene.toml"), str(target), *few]) == 0
    assert sorted(each.name for each in target.iterdir()) == [
        "000000.png", "000001.png", "ais.csv", "frames.csv", "geometry.json", "land.png", "truth.csv",
    ]  # fmt: skip
    assert main([str(EXAMPLES / "harbour.toml"), str(target)]) == 2
    assert "source.kind: must be 'radar_pictures_scene', got 'simulation'" in capsys.readouterr().err
    (tmp_path / "file").write_text("")
    assert main([str(EXAMPLES / "manv_scene.toml"), str(tmp_path / "file"), *few]) == 2
    assert "cannot be written" in capsys.readouterr().err
