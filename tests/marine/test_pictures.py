"""Folders of radar pictures: read one at a time, tracked and drawn."""

import json
import math

import numpy as np
import pytest
from attrs import evolve

import vedette
from support.paths import EXAMPLES
from support.radar_pictures import FRAMES, SIZE, config, judged, opened
from vedette import Gaussian, LazyScans, Recording, Scan, Trajectory
from vedette.cli import main
from vedette.metrics import judge
from vedette_marine import configs
from vedette_marine.births.announced import Announced
from vedette_marine.picture import colours
from vedette_marine.screen import POSITION
from vedette_standard.motion.constant_velocity import ConstantVelocity

cv2 = pytest.importorskip("cv2")


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


@pytest.mark.costly
def test_the_command_draws_what_it_saw(folder, tmp_path, capsys):
    given = tmp_path / "config.json"
    given.write_text(json.dumps(config(folder)))
    out = tmp_path / "out"
    assert main(["run", str(given), "--out", str(out)]) == 0
    video = cv2.VideoCapture(str(out / "tracks.mp4"))
    assert int(video.get(cv2.CAP_PROP_FRAME_COUNT)) == FRAMES - 1
    assert cv2.imread(str(out / "stages.png")).shape == (2 * SIZE, 3 * SIZE, 3)
    assert "tracks.mp4, stages.png" in capsys.readouterr().out


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
    birth = Announced(spread={"x": 10, "y": 10, "vx": 1, "vy": 1})
    given = birth.given(space, recording)
    assert isinstance(given, Gaussian)
    np.testing.assert_allclose(given.mean, [[2, 4, 1, 2], [7, 9, 0, 0]])
    np.testing.assert_allclose(given.cov[0], np.diag([100, 100, 1, 1]))
    with pytest.raises(ValueError, match="nothing is announced at"):
        birth.given(space, Recording(recording.scans, truth[2:]))
    with pytest.raises(ValueError, match=r"spread: must state the standard deviation.*'vy'"):
        Announced(spread={"x": 10, "y": 10}).given(space, recording)


def loaded(scene, preprocessor):
    config = configs.tracker(configs.TUNED_SHIP["CV-PDAF"], 20.0)
    return vedette.load(config | {"source": scene, "preprocessors": {"radar": preprocessor}}).preprocessors["radar"]


@pytest.mark.costly
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


@pytest.mark.costly
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


@pytest.mark.costly
def test_the_example_runs():
    experiment = vedette.load(EXAMPLES / "marine_picture.toml", overrides=["source.frames=20", "source.lost=1"])
    result = experiment.run()
    score = judge(result.tracks, result.recording.truth, result.scans, experiment.judge, 0.99)
    assert not result.refused
    assert score.scans == 19
    assert score.coverage > 0.7  # the first seconds are for confirming
    assert score.position_rmse_m < 15
