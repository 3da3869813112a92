"""Targets that nobody marked: the detector over the whole frame, tracks that start by it, and drafts for one's own video."""

import json
import tomllib

import cv2
import numpy as np
import pytest
from hypothesis import strategies as st

import vedette
from support.paths import EXAMPLES
from vedette import ConfigError, Frame, Scan
from vedette.cli import main
from vedette.testing import conformance
from vedette_flir.births.detected import Detected
from vedette_flir.drafting import draft
from vedette_flir.lifecycles.sought import SoughtTarget
from vedette_flir.preprocessors.spot_detector import SpotDetector
from vedette_flir.sensors.box_centroid import BoxCentroid
from vedette_flir.sensors.detected_box import DetectedBox
from vedette_report.watching.picking import Picking

TestDetectedBox = conformance(DetectedBox)
TestSoughtTarget = conformance(SoughtTarget, known_failures=SoughtTarget.known_failures)
TestSpotDetector = conformance(SpotDetector, sensors=st.just({"camera": BoxCentroid()}), sides=st.just((7.0, 15.0)))
TestDetected = conformance(Detected)


def picture(k, snr=8.0, at=None, size=(120, 160)):
    """A sky with noise of two counts, brighter to one side, and a spot of a spread of 2 px; and where it is."""
    y, x = np.mgrid[: size[0], : size[1]]
    at = np.array([40.0 + 0.7 * k, 50.0 + 0.3 * k]) if at is None else at
    noise = np.random.default_rng([11, k]).normal(0.0, 2.0, size)
    return 50.0 + 0.1 * x + noise + 2.0 * snr * np.exp(-((x - at[0]) ** 2 + (y - at[1]) ** 2) / 8.0), at


def detected(pixels, **options):
    detector = SpotDetector(sensors={"camera": BoxCentroid()}, **options)
    return detector.process({"camera": Scan.image(0.0, "camera", Frame(pixels))}).z


def test_a_spot_is_detected_where_it_is_hot_or_dark():
    pixels, at = picture(0, snr=20.0)
    (found,) = detected(pixels)
    np.testing.assert_allclose(found[:2], at, atol=0.35)  # the middle of its box would be off by up to 1.2 px
    assert np.all((found[2:] >= 4.0) & (found[2:] <= 10.0))
    assert not len(detected(200.0 - pixels))
    (dark,) = detected(200.0 - pixels, polarity="dark")
    np.testing.assert_allclose(dark[:2], at, atol=1.0)


def test_a_spot_near_a_treeline_is_detected_and_what_the_edge_cuts_is_not():
    pixels, at = picture(0, snr=20.0)
    pixels[58:] = 160.0 + np.random.default_rng(1).normal(0.0, 30.0, pixels[58:].shape)
    assert any(np.allclose(each[:2], at, atol=1.0) for each in detected(pixels, sides=[7.0, 15.0]))
    assert not len(detected(picture(0, snr=20.0, at=np.array([40.0, 0.0]))[0]))


@pytest.mark.parametrize("shape", [(1, 1), (1, 100), (2, 200), (3, 3)])
def test_nothing_is_detected_in_frames_of_a_few_rows(shape):
    assert not len(detected(np.random.default_rng(0).integers(0, 255, shape).astype(np.uint8)))


def test_false_alarms_and_detections_by_signal_to_noise():
    """In noise alone hardly anything is found; a spot is, the more often the stronger it is."""
    share = {}
    for snr in (0.0, 4.0, 6.0, 12.0):
        hits = 0
        for k in range(20):
            pixels, at = picture(k, snr)
            found = detected(pixels, clear=5.0)
            near = np.all(np.abs(found[:, :2] - at) < 3.0, axis=1) if len(found) else np.zeros(0, dtype=bool)
            hits += bool(near.any()) if snr else bool(len(found))
        share[snr] = hits / 20
    assert share[0.0] <= 0.3
    assert share[4.0] <= share[6.0] <= share[12.0]
    assert share[12.0] >= 0.95


def folder_of(path, count=40, snr=20.0, dark=False):
    path.mkdir()
    for k in range(count):
        pixels = picture(k, snr)[0]
        cv2.imwrite(str(path / f"{k:03d}.png"), (200.0 - pixels if dark else pixels).clip(0, 255).astype(np.uint8))
    return path


@pytest.mark.costly
def test_an_unmarked_target_is_found_confirmed_and_followed(tmp_path):
    path = folder_of(tmp_path / "clip")
    experiment = vedette.load(EXAMPLES / "flir_found.toml", overrides=[f"source.path={path}"])
    result = experiment.run()
    (track,) = result.tracks
    np.testing.assert_allclose(track.mean[-1, :2], picture(39)[1], atol=0.7)
    assert track.times[0] <= 1.0
    again = experiment.run()
    np.testing.assert_array_equal(again.tracks[0].mean, track.mean)


@pytest.mark.costly
@pytest.mark.parametrize("dark", [False, True])
def test_a_draft_looks_whether_targets_are_hot_or_dark(tmp_path, dark):
    path = folder_of(tmp_path / "clip", dark=dark)
    made = draft(path, {})
    assert ('polarity = "both"' in made) == dark
    result = vedette.load(tomllib.loads(made)).run()
    np.testing.assert_allclose(result.tracks[0].mean[-1, :2], picture(39)[1], atol=1.0)
    assert result.recording.notes["frames"].endswith("uint8, taken as 30 a second: set source.rate")


@pytest.mark.costly
def test_that_a_target_is_always_detected_is_no_fault(tmp_path, monkeypatch, capsys):
    """What a detector finds in frames that are tracked themselves starts tracks; how often it does so tells nothing."""
    folder_of(tmp_path / "clip", count=80)
    monkeypatch.chdir(tmp_path)
    assert main(["run", "clip"]) == 0
    told = capsys.readouterr().out
    assert "1 confirmed" in told
    assert "LOOKS WRONG" not in told
    assert "a frame has no innovation of its own" in told


@pytest.mark.costly
def test_what_stands_in_the_scene_is_no_target_until_it_moves():
    """A lamp is as clear as the target; it starts to move in frame 45."""
    experiment = vedette.load(EXAMPLES / "flir_found.toml")
    tracker, detector = experiment.tracker, experiment.preprocessors["spots"]
    state, confirmed = tracker.start(seed=1), []
    for k in range(75):
        lamp = np.array([120.0 + 0.8 * max(k - 45, 0), 80.0])
        pixels = np.maximum(picture(k, 20.0)[0], picture(k, 20.0, at=lamp)[0])
        frame = Scan.image(k / 30, "camera", Frame(pixels))
        state = tracker.step(state, Scan(k / 30, "spots", detector.process({"camera": frame})))
        state = tracker.step(state, frame)
        confirmed.append(tracker.estimate(state).mean[state.confirmed, :2])
    for k in (30, 44):
        np.testing.assert_allclose(confirmed[k], [picture(k)[1]], atol=1.0)
    assert len(confirmed[-1]) == 2
    np.testing.assert_allclose(confirmed[-1][np.argmax(confirmed[-1][:, 0])], lamp, atol=1.0)


def test_a_track_that_was_never_held_is_not_sought_elsewhere():
    """A speck that is gone in the next frame does not jump to a target on the other side."""
    experiment = vedette.load(EXAMPLES / "flir_found.toml")
    tracker, detector, places = experiment.tracker, experiment.preprocessors["spots"], []
    state = tracker.start(seed=1)
    for k in range(4):
        pixels = picture(k, 20.0, at=np.array([40.0, 50.0] if k == 0 else [120.0, 80.0]))[0]
        frame = Scan.image(k / 30, "camera", Frame(pixels))
        state = tracker.step(state, Scan(k / 30, "spots", detector.process({"camera": frame})))
        state = tracker.step(state, frame)
        places += tracker.estimate(state).mean[state.ids == 0, 0].tolist()
    assert places
    assert max(places) < 60.0


def test_a_frame_is_counted_once():
    """Boxes of a frame claim and start tracks; position and existence of a track are those by the frame alone."""
    experiment = vedette.load(EXAMPLES / "flir_found.toml")
    tracker, detector = experiment.tracker, experiment.preprocessors["spots"]
    state = tracker.start(seed=1)
    for k in range(20):
        frame = Scan.image(k / 30, "camera", Frame(picture(k, 20.0)[0]))
        before = tracker.step(state, frame)
        state = tracker.step(before, Scan(k / 30, "spots", detector.process({"camera": frame})))
        if len(before.ids):
            assert len(state.ids) == len(before.ids) == 1
            np.testing.assert_allclose(state.existence, before.existence, atol=1e-6)
            np.testing.assert_allclose(tracker.estimate(state).mean, tracker.estimate(before).mean)


def test_no_config_is_drafted_for_what_is_no_video(tmp_path, monkeypatch, capsys):
    (tmp_path / "clip.mp4").write_text("not a video\n")
    monkeypatch.chdir(tmp_path)
    assert main(["new", "config", "clip.mp4"]) == 2
    assert "clip.mp4: is no video" in capsys.readouterr().err
    assert not (tmp_path / "clip.toml").exists()


@pytest.mark.costly
def test_a_draft_for_a_folder_runs_by_itself(tmp_path, monkeypatch, capsys):
    folder_of(tmp_path / "clip", count=25)
    monkeypatch.chdir(tmp_path)
    monkeypatch.setattr("vedette_report.drawing.brought.can_draw", lambda: False)
    assert main(["new", "config", "clip"]) == 0
    assert "run it: vedette run clip.toml" in capsys.readouterr().out
    text = (tmp_path / "clip.toml").read_text()
    assert tomllib.loads(text)["source"]["steady"] is False  # noise would turn it
    assert "\n# rate = 30.0 " in text
    assert main(["run", "clip"]) == 0
    assert "1 confirmed" in capsys.readouterr().out
    assert not list((tmp_path / "out").rglob("episodes.csv"))  # a track that begins was not lost
    assert main(["new", "config", "clip", "--box", "36,46,10,10", "--out", "box.toml"]) == 0
    assert tomllib.loads((tmp_path / "box.toml").read_text())["source"]["box"] == [36.0, 46.0, 10.0, 10.0]
    assert main(["new", "config", "clip", "--box", "36,46,10,10", "--box", "5,6,7,8", "--out", "boxes.toml"]) == 0
    assert tomllib.loads((tmp_path / "boxes.toml").read_text())["source"]["boxes"] == [[36, 46, 10, 10], [5, 6, 7, 8]]
    (tmp_path / "table.csv").write_text("t,x,y\n0,1,2\n1,2,3\n")
    assert main(["new", "config", "table.csv", "--box", "1,2,3,4"]) == 2


def test_the_folder_of_a_run_is_no_video(tmp_path, capsys):
    """Its pictures were: they differ in size, and a template of them was nan."""
    folder_of(tmp_path / "run", count=2)
    (tmp_path / "run" / "config.json").write_text("{}")
    assert main(["run", str(tmp_path / "run")]) == 2
    assert "config.json" in capsys.readouterr().err


@pytest.mark.costly
def test_where_nothing_stands_out_the_draft_says_what_to_change(tmp_path, monkeypatch, capsys, recwarn):
    folder_of(tmp_path / "dim", snr=5.0)
    monkeypatch.chdir(tmp_path)
    assert main(["run", "dim"]) == 0
    told = capsys.readouterr().out
    assert "for dim ones a smaller `clear`" in told
    assert told.count("LOOKS WRONG") == 1
    assert not recwarn.list
    main(["new", "config", "dim"])
    (track,) = vedette.load("dim.toml", overrides=["preprocessors.spots.clear=4"]).run().tracks
    np.testing.assert_allclose(track.mean[-1, :2], picture(39)[1], atol=1.0)


@pytest.mark.costly
def test_where_what_stands_out_does_not_move_the_run_asks_for_what_does(tmp_path, monkeypatch, capsys):
    (tmp_path / "clip").mkdir()
    spots = sum(picture(0, 20.0, at=(x, 50.0))[0] - picture(0, 0.0)[0] for x in (40.0, 80.0, 120.0))
    for k in range(20):
        cv2.imwrite(str(tmp_path / "clip" / f"{k}.png"), (picture(k, 0.0)[0] + spots).clip(0, 255).astype(np.uint8))
    monkeypatch.chdir(tmp_path)
    assert main(["run", "clip"]) == 0
    told = " ".join(capsys.readouterr().out.split())
    assert "does a target move there, and stand out?" in told
    assert "return" not in told.split("returns:", 1)[1].split("spots")[0]  # frames confirm a target, not returns


@pytest.mark.parametrize("count", [1, 2])
def test_a_box_is_drawn_on_the_page_of_a_first_frame(tmp_path, monkeypatch, capsys, count):
    """The middle of a box that is drawn around a spot is where the spot is."""
    monkeypatch.chdir(tmp_path)
    (tmp_path / "clip").mkdir()
    pixels, at = picture(0, snr=20.0)
    cv2.imwrite(str(tmp_path / "clip" / "000.png"), np.clip(pixels, 0, 255).astype(np.uint8))
    drawn = [at[0] + 0.5 - 5.0, at[1] + 0.5 - 4.0, 10.0, 8.0]  # a pixel's middle is half a pixel from its edge

    def drawing(page, wait=None):
        assert page.take(json.dumps([drawn] * count).encode()) is None
        return list(page._boxes)

    monkeypatch.setattr(Picking, "boxes", drawing)
    assert main(["new", "config", "clip", "--pick"]) == 0
    assert "http://127.0.0.1:" in capsys.readouterr().err
    boxes = [start.states[0] for start in vedette.load("clip.toml").steps().recording.starts]
    np.testing.assert_allclose(boxes, [[*at, 10.0, 8.0]] * count, atol=0.06)
    assert main(["new", "config", "clip", "--pick", "--box", "1,2,3,4", "--out", "other.toml"]) == 2
    (tmp_path / "table.csv").write_text("t,x,y\n0,1,2\n")
    assert main(["new", "config", "table.csv", "--pick", "--out", "other.toml"]) == 2


@pytest.mark.parametrize("box", ["1,2,3", "a,b,c,d", "1,2,0,4", "1,2,nan,4", "900,2,9,9", "1,2,0.5,4", "1,2,400,4"])
def test_a_box_that_is_none_in_the_first_frame_is_refused(tmp_path, box):
    folder_of(tmp_path / "clip", count=1)
    with pytest.raises(ConfigError, match=r"^--box: must [^\n]*$"):
        draft(tmp_path / "clip", {"box": ["36,46,10,10", box]})


def test_other_files_are_not_drafted(tmp_path):
    assert draft(tmp_path / "table.csv", {}) is None
    assert draft(tmp_path, {}) is None
