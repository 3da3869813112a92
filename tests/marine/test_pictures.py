"""Folders of radar pictures: read one at a time, tracked, drawn; and what corrupted, lost and foreign frames do."""

import json
import math
from pathlib import Path

import numpy as np
import pytest
from attrs import evolve

import vedette
from vedette import ConfigError, Gaussian, InputError, LazyScans, Recording, Scan, ScanRefused, Trajectory
from vedette.cli import main
from vedette.metrics import judge
from vedette_marine import configs, outcome, picture_runs
from vedette_marine import reproduction as study
from vedette_marine.geometry import PictureGeometry, write_geometry
from vedette_marine.lifecycles.announced import Announced
from vedette_marine.picture import colours
from vedette_marine.picture.png import check_png
from vedette_marine.screen import POSITION, RadarScreen
from vedette_marine.sources.pictures import RadarPictures
from vedette_standard.motion.constant_velocity import ConstantVelocity

cv2 = pytest.importorskip("cv2")

EXAMPLES = Path(__file__).parent.parent.parent / "examples"
SIZE, FRAMES = 128, 12
GEOMETRY = PictureGeometry(5.0, [63.5, 63.5], SIZE, SIZE, latitude=54.0, longitude=12.0)
RADAR = {"kind": "cartesian_position", "sigma": 5.0, "detection_probability": 0.9, "clutter_density": 1e-6}
START, SPEED = np.array([-200.0, 150.0]), np.array([6.0, -4.0])


@pytest.fixture
def folder(tmp_path):
    """Twelve pictures of one boat, the sixth of which was lost, with its truth and its AIS."""
    from pymap3d import enu2geodetic

    rows, columns = np.mgrid[:SIZE, :SIZE]
    frames, truth, ais = ["file,time_s,heading_rad"], ["object,time_s,east_m,north_m,east_mps,north_mps"], []
    for k in range(FRAMES):
        place = START + SPEED * k
        latitude, longitude, _ = enu2geodetic(*place, 0.0, 54.0, 12.0, 0.0)
        course, knots = math.degrees(math.atan2(*SPEED)) % 360, np.hypot(*SPEED) / 0.514444
        ais.append(f"{k},211000001,{latitude},{longitude},{course},{knots}")
        truth.append(f"boat,{k},{place[0]},{place[1]},{SPEED[0]},{SPEED[1]}")
        if k == 5:
            continue
        x, y = GEOMETRY.to_pixels(place)
        grey = 230 * np.exp(-0.5 * ((columns - x) ** 2 + (rows - y) ** 2) / 2.0**2)
        cv2.imwrite(str(tmp_path / f"{k:03}.png"), grey.astype(np.uint8))
        frames.append(f"{k:03}.png,{k},0.3")
    (tmp_path / "frames.csv").write_text("\n".join(frames) + "\n")
    (tmp_path / "truth.csv").write_text("\n".join(truth) + "\n")
    header = "Time,MMSI,Latitude_degrees,Longitude_degrees,COG_degrees,SOG_knots"
    (tmp_path / "ais.csv").write_text("\n".join([header, *ais]) + "\n")
    write_geometry(tmp_path, GEOMETRY)
    return tmp_path


def opened(folder, **more):
    return RadarPictures(str(folder), **more).open({"screen": RadarScreen()}, np.random.default_rng(0))


def config(folder, lifecycle="announced", **source):
    spread = {"vx": 8.0, "vy": 8.0}
    if lifecycle == "announced":
        spread |= {"x": 10.0, "y": 10.0}
    return {
        "source": {"kind": "radar_pictures", "path": str(folder), **source},
        "preprocessors": {
            "radar": {"kind": "radar_picture", "sensors": {"screen": {"kind": "radar_screen"}}, "chain": {"nearest": 20}}
        },
        "sensors": {
            "radar": {"kind": "cartesian_position", "sigma": 5.0, "detection_probability": 0.9, "clutter_density": 1e-6}
        },
        "estimator": {"kind": "ekf", "motion": {"kind": "constant_velocity", "sigma_accel": 0.1}},
        "associator": {"kind": "pda"},
        "lifecycle": {"kind": lifecycle, "spread": spread},
    }


def judged(given):
    experiment = vedette.load(given)
    result = experiment.run()
    return result, judge(result.tracks, result.recording.truth, result.scans, experiment.judge, 0.99)


def rewrite(path, old, new):
    path.write_text(path.read_text().replace(old, new))


# Reading.


def test_pictures_are_read_when_they_are_asked_for(folder):
    recording = opened(folder)
    assert isinstance(recording.scans, LazyScans)
    assert [scan.time for scan in recording.scans] == [k for k in range(FRAMES) if k != 5]
    scan = recording.scans[-1]
    assert scan.frame.pixels.shape == (SIZE, SIZE)
    assert scan.frame.geometry["metres_per_pixel"] == 5.0
    assert scan.pose.heading == pytest.approx(math.pi / 2 - 0.3)
    assert [each.time for each in recording.scans[1:3]] == [1, 2]
    with pytest.raises(IndexError):
        recording.scans[FRAMES]


@pytest.mark.parametrize("reference", ["truth", "ais"])
def test_a_boat_is_tracked_from_pictures_over_a_lost_frame(folder, reference):
    result, score = judged(config(folder, reference=reference))
    assert not result.refused
    assert len(result.scans) == FRAMES - 1
    assert score.coverage == 1
    assert score.position_rmse_m < 3.0
    assert np.diff([scan.time for scan in result.scans]).max() == 2.0


def test_tracks_start_by_themselves_too(folder):
    result, score = judged(config(folder, lifecycle="m_of_n"))
    assert len(result.tracks) == 1
    assert score.position_rmse_m < 3.0


def test_the_command_draws_what_it_saw(folder, tmp_path, capsys):
    given = tmp_path / "config.json"
    given.write_text(json.dumps(config(folder)))
    out = tmp_path / "out"
    assert main(["run", str(given), "--out", str(out)]) == 0
    video = cv2.VideoCapture(str(out / "tracks.mp4"))
    assert int(video.get(cv2.CAP_PROP_FRAME_COUNT)) == FRAMES - 1
    assert cv2.imread(str(out / "stages.png")).shape == (2 * SIZE, 3 * SIZE, 3)
    assert "tracks.mp4, stages.png" in capsys.readouterr().out


# What is wrong with a folder.


@pytest.mark.parametrize(
    ("spoil", "message"),
    [
        (lambda f: (f / "003.png").write_bytes((f / "003.png").read_bytes()[:-20]), "003.png is cut off after"),
        (lambda f: _flip(f / "003.png"), "003.png is corrupted: wrong checksum"),
        (lambda f: (f / "003.png").write_bytes(b"GIF89a, not a PNG"), "003.png is no PNG"),
        (lambda f: (f / "003.png").write_bytes(b""), "003.png is no PNG"),
        (lambda f: (f / "003.png").unlink(), "003.png cannot be read: No such file"),
        (lambda f: cv2.imwrite(str(f / "003.png"), np.zeros((SIZE, 64), np.uint8)), "must be 128 x 128 px as"),
        (lambda f: cv2.imwrite(str(f / "003.png"), np.zeros((SIZE, SIZE), np.uint16)), "must have 8 bit, got 16"),
        (lambda f: rewrite(f / "frames.csv", "003.png,3,", "003.png,300,"), "out of order"),
        (lambda f: rewrite(f / "frames.csv", "003.png,3,", "003.png,soon,"), "time_s must be a number, got 'soon'"),
        (lambda f: rewrite(f / "frames.csv", "003.png,3,", "003.png,nan,"), "time_s must be a finite number"),
        (lambda f: rewrite(f / "frames.csv", "003.png,3,0.3", "003.png,3"), "must have 3 columns"),
        (lambda f: rewrite(f / "frames.csv", "003.png", "../003.png"), "file must be a name in the folder"),
        (lambda f: rewrite(f / "ais.csv", "3,211000001,54", "3,211000001,55"), "cannot be reached from those around it"),
        (lambda f: rewrite(f / "ais.csv", "3,211000001,54", "3,211000001,95"), "Latitude_degrees must be from -90 to 90"),
    ],
)  # fmt: skip
def test_one_bad_part_is_told_and_costs_nothing_else(folder, spoil, message):
    spoil(folder)
    given = config(folder, reference="ais")
    result, score = judged(given)
    assert len(result.refused) == 1
    assert message in str(result.refused[0])
    assert len(result.scans) >= FRAMES - 2
    assert score.coverage == 1
    with pytest.raises(ScanRefused, match=r"."):
        vedette.load(given).run(strict=True)


def _flip(path):
    data = bytearray(path.read_bytes())
    data[len(data) // 2] ^= 0xFF
    path.write_bytes(bytes(data))


def test_no_flipped_bit_of_a_picture_passes(folder):
    path = folder / "003.png"
    data = path.read_bytes()
    assert check_png(path) == (SIZE, SIZE)
    for at in np.random.default_rng(0).integers(0, len(data), 60).tolist():
        path.write_bytes(data[:at] + bytes([data[at] ^ 4]) + data[at + 1 :])
        with pytest.raises(ValueError, match=r"is (corrupted|cut off|no PNG)"):
            check_png(path)


@pytest.mark.parametrize(
    ("spoil", "message"),
    [
        (lambda f: (f / "geometry.json").unlink(), "geometry.json: is missing: without it no pixel has a place"),
        (lambda f: (f / "frames.csv").unlink(), "frames.csv: cannot be read"),
        (
            lambda f: rewrite(f / "frames.csv", "time_s", "t"),
            "frames.csv:1: must have the columns file, time_s; lacks",
        ),
        (lambda f: (f / "frames.csv").write_text("file,time_s\n"), "holds no usable picture"),
        (
            lambda f: [p.unlink() for p in f.glob("*.png")],
            "holds no usable picture; the first problem: frames.csv:2:",
        ),
        (lambda f: (f / "ais.csv").unlink(), "ais.csv: cannot be read"),
        (lambda f: rewrite(f / "geometry.json", '"latitude": 54.0', '"latitude": null'), "lacks latitude and longitude"),
        (
            lambda f: rewrite(f / "geometry.json", '"land": ""', '"land": "chart.png"'),
            "chart.png: must be a picture of 128",
        ),
    ],
)
def test_a_folder_that_cannot_be_used_is_told(folder, spoil, message):
    spoil(folder)
    with pytest.raises(InputError) as error:
        opened(folder, reference="ais")
    assert message in str(error.value)


def test_a_picture_that_is_spoiled_after_opening_is_refused(folder):
    experiment = vedette.load(config(folder))
    source = experiment.source
    recording = source.open({"screen": RadarScreen()}, np.random.default_rng(0))
    (folder / "003.png").unlink()
    assert recording.scans[3].frame.pixels.shape == (0, 0)
    given = vedette.load(config(folder))
    rows = opened(folder)
    assert len(rows.refused) == 1
    assert len(given.run().scans) == FRAMES - 2


def test_wrong_uses_are_told(folder):
    with pytest.raises(ConfigError, match="path: is not given"):
        opened("")
    with pytest.raises(ConfigError, match="there is no file or folder"):
        opened(folder / "none")
    with pytest.raises(ConfigError, match="need one screen behind a preprocessor"):
        RadarPictures(str(folder)).open({}, np.random.default_rng(0))


# Announced targets.


def test_every_announced_target_starts_where_it_is():
    path = np.array([[0.0, 0, 1, 2], [10, 20, 1, 2]])
    space = ConstantVelocity(1.0).state
    truth = (
        Trajectory("a", space, np.array([0.0, 10]), path),
        Trajectory("b", POSITION, np.array([0.0, 10]), path[:, :2] + 5),
        Trajectory("late", space, np.array([5.0, 10]), path),
    )
    recording = Recording((Scan(2.0, "radar", vedette.Detections.of([], 2)),), truth)
    lifecycle = Announced(spread={"x": 10, "y": 10, "vx": 1, "vy": 1})
    given = lifecycle.given(space, recording)
    assert isinstance(given, Gaussian)
    np.testing.assert_allclose(given.mean, [[2, 4, 1, 2], [7, 9, 0, 0]])
    np.testing.assert_allclose(given.cov[0], np.diag([100, 100, 1, 1]))
    with pytest.raises(ValueError, match="nothing is announced at the first scan"):
        lifecycle.given(space, Recording(recording.scans, truth[2:]))
    with pytest.raises(ValueError, match=r"lifecycle.spread: must state the standard deviation of 'vx', 'vy'"):
        Announced(spread={"x": 10, "y": 10}).given(space, recording)


# Simulated pictures.


def quietly(items, about):
    return items


def short(name, frames, **more):
    """A scene's first frames."""
    from vedette_marine.reproduction import SCENES

    scene = SCENES[name]() | {"frames": frames, "lost": frames // 20} | more
    return {name: lambda: scene}


def tracked_from_pictures(name, runs, seed):
    """Each target's records by filter, tracked from the scene's pictures. Their figures are printed: pytest -rP."""
    points = picture_runs.seen(name, runs, seed, quietly)
    presets, found = study.TUNED[name], {}
    for k, target in enumerate(points.names):
        found[target] = {each: study.record(name, points, k, presets[each], study.SIGMA[name]) for each in outcome.FILTERS}
    rows = {(target, "tuned"): records for target, records in found.items()}
    for table in (outcome.error_table(name, "tuned", rows, "RMSE in m"), outcome.ratio_table(rows)):
        for label, cells in table.rows:
            print(
                label,
                *(f"{c}: {v.measured or 0:.4g} +- {v.error or 0:.2g}" for c, v in zip(table.columns, cells, strict=True)),
            )
    return found


def test_boats_are_tracked_from_simulated_pictures(pytestconfig, monkeypatch):
    """Against AIS at most 12 m in the mean of 20 runs of the whole scene and none lost, at night; IMM-PDAF errs least.

    Else one run of 20 s, in which the error of the AIS itself and of the start do not average out: at most 20 m.
    """
    night = pytestconfig.getoption("vedette_profile") == "nightly"
    if not night:
        monkeypatch.setattr(picture_runs, "SCENES", short("MANV-like", 30))
    for records in tracked_from_pictures("MANV-like", 20 if night else 1, 2026).values():
        assert not any(each.lost.any() for each in records.values())
        assert outcome.rms(records["IMM-PDAF"], "ais") <= (12.0 if night else 20.0)
        if night:
            assert outcome.ratio(records, "CV-PDAF", "ais").measured < 0.96


ROUGH = {"shape": 0.5, "level": 5.0, "seconds": 6.2}
"""A spiky sea, 4 dB above that of the scene: 80 false returns a picture instead of 3."""


def test_evidence_of_the_picture_keeps_spikes_from_becoming_tracks():
    """Tracks that start by themselves in a spiky sea: with brightness and size at most three quarters of the false ones."""
    overrides = ["source.frames=30", "source.lost=0", "source.buoys=[]", "sensors.radar.clutter_density=2e-6"]
    overrides += [f"source.sea.{name}={value}" for name, value in ROUGH.items()]
    config = vedette.to_config(vedette.load(EXAMPLES / "marine_picture.toml", overrides=overrides))
    config["judge"].pop("near")
    result, informed = judged(config)
    assert all(scan.detections.evidence is not None for scan in result.scans)
    config["preprocessors"]["radar"].pop("evidence")
    result, plain = judged(config)
    assert all(scan.detections.evidence is None for scan in result.scans)
    assert plain.false_tracks > 2
    assert informed.false_tracks < 0.75 * plain.false_tracks
    assert informed.coverage >= plain.coverage


def test_boats_are_kept_in_a_rough_sea(pytestconfig, monkeypatch):
    """Announced boats, whose tracks need the gate alone: no worse than in the scene's own sea. Four runs at night."""
    night = pytestconfig.getoption("vedette_profile") == "nightly"
    monkeypatch.setattr(picture_runs, "SCENES", short("MANV-like", 1000 if night else 30, sea=ROUGH))
    for records in tracked_from_pictures("MANV-like", 4 if night else 1, 2027).values():
        assert not any(each.lost.any() for each in records.values())
        assert outcome.rms(records["IMM-PDAF"], "ais") <= (12.0 if night else 20.0)


def test_the_large_ship_is_tracked_from_simulated_pictures(pytestconfig, monkeypatch):
    """A beacon sends every 45 s. What is seen is the hull; the antenna that AIS tells of stands 65 m aft of its middle."""
    night = pytestconfig.getoption("vedette_profile") == "nightly"
    if not night:
        monkeypatch.setattr(picture_runs, "SCENES", short("DARC-like", 40))
    (records,) = tracked_from_pictures("DARC-like", 4 if night else 1, 2026).values()
    assert not any(each.lost.any() for each in records.values())
    assert outcome.rms(records["IMM-PDAF"], "centre") <= 30.0
    assert 40.0 < outcome.rms(records["IMM-PDAF"], "ais") < 90.0
    assert outcome.ratio(records, "CV-PDAF", "ais").measured == pytest.approx(1.0, abs=0.02)


def test_the_study_from_pictures_says_all_and_a_run_is_the_same_among_others(monkeypatch):
    scenes = short("MANV-like", 24) | short("DARC-like", 20)
    monkeypatch.setattr(picture_runs, "SCENES", scenes)
    monkeypatch.setattr(picture_runs, "tuned", lambda scene, seed, number: study.TUNED[scene])
    results = [picture_runs.MarinePicturesReproduction().run(runs, 3, quietly) for runs in (1, 2)]
    labels = {label for label, _ in results[0].tables[0].rows}
    assert labels == {"MANV-like boat 1", "MANV-like boat 2", "DARC-like ship"}
    alone, both = (result.charts[0].panels[0].curves[1] for result in results)
    np.testing.assert_array_equal(alone.x, both.x)  # the first run is the same however many follow
    assert len(results[0].claims) == 4


def loaded(scene, preprocessor):
    config = configs.tracker(configs.TUNED_SHIP["CV-PDAF"], 20.0)
    return vedette.load(config | {"source": scene, "preprocessors": {"radar": preprocessor}}).preprocessors["radar"]


def test_a_boat_under_the_heading_line_is_one_return(monkeypatch):
    """The line that is drawn from the own ship to the north cuts boat 1 in two at 13 s, for who takes it for black water."""
    from vedette_marine import scenes
    from vedette_marine.points import source

    scene = scenes.manoeuvres()
    opened, preprocessor = source(scene), loaded(scene, configs.BOATS_IN_PICTURES)
    painter, boat = opened.painter(5), opened.centres(opened.times(5))[0]

    def returns():
        counts = []
        for time in np.arange(11.0, 18.0):
            z = preprocessor.process({"screen": painter.scan(time, "screen")}).z
            counts.append(int(np.sum(np.linalg.norm(z - boat.at(time)[:2], axis=1) < 50)))
        return counts

    assert returns() == [1] * 7
    monkeypatch.setattr(colours, "bridged", lambda grey, hidden: grey)
    assert max(returns()) == 2


def test_a_beacon_leaves_no_returns_and_hides_who_is_on_its_spoke():
    """A beacon between the radar and the ship's path answers for 18 s of 45 s: while it does, nothing is seen behind it."""
    from vedette_marine import scenes
    from vedette_marine.points import source

    at, azimuth = np.array([-1500.0, 980.0]), math.atan2(-1500.0, 980.0)
    scene = scenes.large_ship() | {"racons": [{"at": at.tolist(), "length": 1800.0}], "buoys": [], "frames": 60, "lost": 0}
    opened = source(scene)
    painter, (ship,) = opened.painter(5), opened.centres(opened.times(5))
    preprocessor = loaded(scene, configs.SHIP_IN_PICTURES)
    blind = evolve(preprocessor, chain=evolve(preprocessor.chain, spoke_length=1e5))
    for time, on in [(4.0, True), (10.0, True), (15.0, True), (22.0, False), (30.0, False), (40.0, False), (50.0, True)]:
        scan = painter.scan(time, "screen")
        z = preprocessor.process({"screen": scan}).z
        beside = np.abs(np.arctan2(z[:, 0], z[:, 1]) - azimuth) > np.radians(3.0)
        stages = preprocessor.stages(scan.frame, scan.pose)
        assert (stages.beacon.sum() > 500) == on
        hull = ship.at(time)[:2]
        if on:
            assert not np.any(~beside & (np.linalg.norm(z, axis=1) > np.hypot(*at) + 50.0))
            assert len(blind.process({"screen": scan}).z) > len(z)
        elif np.hypot(*hull) > 1000:
            assert np.min(np.linalg.norm(z - hull, axis=1)) < 90.0


def test_the_example_runs():
    experiment = vedette.load(EXAMPLES / "marine_picture.toml", overrides=["source.frames=20", "source.lost=1"])
    result = experiment.run()
    score = judge(result.tracks, result.recording.truth, result.scans, experiment.judge, 0.99)
    assert not result.refused
    assert score.scans == 19
    assert score.coverage > 0.7  # the first seconds are for confirming
    assert score.position_rmse_m < 15
