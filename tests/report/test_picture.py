"""Pictures of a run: what the picture holds."""

import json
import re
import struct
from types import SimpleNamespace

import numpy as np
import pytest
from attrs import evolve
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy import stats

import vedette
from support.results import PLANE, config, drawn_lines, result, still, track, words, write_pictures
from vedette import Gaussian, Recording, Scan, Space, metrics
from vedette.metrics import judge
from vedette.types import Detections, Pose
from vedette_files.readers import NORTH_EAST
from vedette_report.drawing import canvas
from vedette_report.drawing.errors import errors
from vedette_report.drawing.picture import _facts, ellipses, picture
from vedette_report.figures import figures
from vedette_report.map.plane import Plane, returns, stands
from vedette_report.summary.words import summary


@given(st.integers(0, 2**32 - 1))
@settings(max_examples=30)
def test_an_ellipse_holds_95_percent(seed):
    rng = np.random.default_rng(seed)
    root = rng.standard_normal((3, 2, 2))
    cov = root @ np.swapaxes(root, -1, -2) + 1e-3 * np.eye(2)
    mean = rng.standard_normal((3, 2))
    lines = ellipses(mean, cov)
    away = lines - mean[:, None, :]
    squared = np.einsum("tki,tij,tkj->tk", away, np.linalg.inv(cov), away)
    np.testing.assert_allclose(squared, stats.chi2.ppf(0.95, 2), rtol=1e-8)
    np.testing.assert_allclose(lines[:, 0], lines[:, -1], atol=1e-9)


def test_an_ellipse_without_width_is_a_line():
    lines = ellipses(np.zeros((1, 2)), np.diag([4.0, 0.0])[None])
    assert np.all(np.isfinite(lines))
    np.testing.assert_array_equal(lines[..., 1], 0.0)


@pytest.mark.parametrize("order", [("x", "y", "vx", "vy"), ("vy", "y", "vx", "x")])
def test_a_map_has_x_to_the_right_or_north_up(order):
    space = Space.of(**{name: "m" if len(name) == 1 else "m/s" for name in order})
    state = np.array([[{"x": 1.0, "y": 2.0}.get(name, 9.0) for name in order]])
    cov = np.diag(state[0])[None]
    chart, ship = Plane.of(space, Recording(())), Plane.of(space, Recording((), notes={"frame": NORTH_EAST}))
    assert chart.points(space, state).tolist() == [[1.0, 2.0]]
    assert ship.points(space, state).tolist() == [[2.0, 1.0]]
    assert np.diagonal(ship.covariances(space, cov)[0]).tolist() == [2.0, 1.0]
    assert ship.platform(np.array([[1.0, 2.0]])).tolist() == [[2.0, 1.0]]
    assert (chart.labels, ship.labels) == (("x [m]", "y [m]"), ("east, y [m]", "north, x [m]"))


def test_a_state_without_a_ground_shows_its_first_axes_and_no_platform():
    pixels = Space.of(column="px", row="px", gain="1")
    plane = Plane.of(pixels, Recording((), notes={"frame": NORTH_EAST}))
    assert plane.labels == ("column [px]", "row [px]")
    sensor = vedette.load(config()).tracker.sensors["radar"]
    scan = Scan(0.0, "radar", Detections.of([], 2), Pose(np.zeros(2)))
    assert stands([scan], {"radar": sensor}, plane) == []
    assert returns([scan], {"radar": sensor}, plane) == {"radar": None}


def test_returns_lie_where_the_sensor_saw_them_from():
    sensors = vedette.load(config()).tracker.sensors
    plane = Plane.of(PLANE, Recording(()))
    z = np.array([[100.0, 0.0], [50.0, np.pi / 2]])
    padded = Detections(z, np.array([True, False]))
    scans = [
        Scan(0.0, "radar", Detections.of(z)),
        Scan(1.0, "radar", padded, Pose(np.array([1000.0, 2000.0]), heading=np.pi / 2)),
        Scan(2.0, "beacon", Detections.of([[7.0, 8.0]])),
        Scan(3.0, "beacon", Detections.of([], 2)),
    ]
    spots = returns(scans, sensors, plane)
    expected = [[140.0, -30.0], [40.0, 20.0], [1000.0, 2100.0]]
    np.testing.assert_allclose(spots["radar"], expected, atol=0.01)  # the unbiased conversion is .005 m longer
    assert spots["beacon"].tolist() == [[7.0, 8.0]]


def test_a_sensor_that_gives_no_position_is_told_not_drawn(scene):
    _, done = scene

    class Bearings:
        observes = Space.of(x="m", y="m")

        def placed(self, pose):
            return self

        def invert(self, z, noise=None) -> Gaussian:
            raise NotImplementedError

    plane = Plane.of(PLANE, done.recording)
    assert returns(done.scans, {"radar": Bearings()}, plane) == {"radar": None}


def test_what_a_head_says_fits_the_picture(scene):
    """It was cut at the right edge."""
    blind = {f"station {i}": None for i in range(6)}
    for facts in (_facts(result(), blind, 0, 0), "many words about this run " * 12):
        made = canvas.figure(7.78)
        canvas.head(made, "Tracks", facts)
        assert all(text.get_window_extent().x1 <= made.bbox.x1 for text in made.texts)
    assert "6 sensors: one return" in _facts(result(), blind, 0, 0)


def test_platforms_are_those_of_sensors_that_looked():
    sensors = vedette.load(config()).tracker.sensors
    plane = Plane.of(PLANE, Recording(()))
    seen, pose = Detections.of([], 2), Pose(np.array([5.0, 6.0]))
    assert stands([Scan(0.0, "beacon", seen)], sensors, plane) == []
    assert [path.tolist() for path in stands([Scan(0.0, "radar", seen)], sensors, plane)] == [[[40.0, -30.0]]]
    assert [path.tolist() for path in stands([Scan(0.0, "radar", seen, pose)], sensors, plane)] == [[[5.0, 6.0]]]


def test_the_picture_holds_truth_tracks_ids_and_names(scene):
    experiment, done = scene
    axes = picture(experiment, done).axes[0]
    lines = drawn_lines(axes)
    for path in done.recording.truth:
        assert is_drawn(path.states[:, :2], lines)
    for one in done.tracks:
        assert is_drawn(one.mean[:, :2], lines)
        assert is_drawn(np.where(one.confirmed[:, None], one.mean[:, :2], np.nan), lines)
    texts = [text.get_text() for text in axes.texts]
    assert {str(one.id) for one in done.tracks} | {"near", "late"} == set(texts)
    count = sum(len(scan.detections.z) for scan in done.scans if scan.sensor == "radar")
    assert f"returns of radar ({count})" in axes.get_legend_handles_labels()[1]
    held = [np.flatnonzero(one.confirmed & (one.times >= 0)) for one in done.tracks]
    first = [ellipses(one.mean[k[:1], :2], one.cov[k[:1], :2, :2])[0] for one, k in zip(done.tracks, held, strict=True)]
    assert all(is_drawn(ring, lines) for ring in first)


def is_drawn(path, lines):
    """Return whether some line goes along a path, between two breaks or ends."""
    gap = np.full((1, 2), np.nan)
    piece = np.concatenate([gap, path, gap]).tobytes()
    return any(piece in np.concatenate([gap, line, gap]).tobytes() for line in lines)


def test_a_map_of_many_tracks_names_the_longest_and_says_so(monkeypatch):
    """The number of things to draw does not grow with the tracks: a line costs some 100 us beside its points."""
    monkeypatch.setattr("vedette_report.drawing.picture._NAMED", 3)
    monkeypatch.setattr("vedette_report.drawing.picture._RINGED", 5)
    times, cov = np.arange(4.0), np.eye(4)
    tracks = [track(times[: 4 - i % 3], np.full((4 - i % 3, 4), float(i)), cov, number=i) for i in range(40)]
    truth = [still(f"ship {i}", times[: 2 + (i == 7)], (float(i), 0.0)) for i in range(30)]
    made = picture(vedette.load(config()), result(tracks, truth, times))
    axes = made.axes[0]
    assert {text.get_text() for text in axes.texts} == {"0", "3", "6", "ship 7", "ship 0", "ship 1"}
    assert len(axes.lines) < 60
    lines = drawn_lines(axes)
    assert all(is_drawn(one.mean[:, :2], lines) for one in tracks)
    ringed = [is_drawn(ellipses(one.mean[:1, :2], one.cov[:1, :2, :2])[0], lines) for one in tracks]
    assert np.flatnonzero(ringed).tolist() == [0, 3, 6, 9, 12]
    facts = next(text for text in words(made) if "scans over" in text)
    assert "of the 3 longest" in facts
    assert "of the 5 longest" in facts


def test_the_picture_reaches_all_paths_and_no_far_outlier(scene):
    experiment, done = scene
    far = Scan(60.0, "beacon", Detections.of([[1e6, -1e6]]))
    made = picture(experiment, evolve(done, scans=(*done.scans, far)))
    axes = made.axes[0]
    (left, right), (bottom, top) = axes.get_xlim(), axes.get_ylim()
    for path in [*(path.states for path in done.recording.truth), *(one.mean[one.confirmed] for one in done.tracks)]:
        assert np.all((left < path[:, 0]) & (path[:, 0] < right) & (bottom < path[:, 1]) & (path[:, 1] < top))
    assert right - left < 2500.0
    assert axes.get_aspect() == 1.0
    assert any("1 return outside the picture" in text for text in words(made))


def size_of(path):
    data = path.read_bytes()
    assert data[:8] == b"\x89PNG\r\n\x1a\n"
    return struct.unpack(">II", data[16:24])


def test_a_track_that_was_lost_does_not_stretch_the_map(scene):
    experiment, done = scene
    limits = picture(experiment, done).axes[0].get_xlim()
    path = np.zeros((30, 4))
    path[:, 0] = 100.0 + 1_000.0 * np.arange(30)
    hit = np.where(np.arange(30) < 1, 1.0, 0.0)
    lost = track(np.arange(30.0), path, np.eye(4), number=99)
    coasting = picture(experiment, evolve(done, tracks=(*done.tracks, evolve(lost, hit=hit)))).axes[0].get_xlim()
    assert coasting == pytest.approx(limits)
    assert picture(experiment, evolve(done, tracks=(*done.tracks, lost))).axes[0].get_xlim()[1] > 20_000, "it had returns"


def test_the_titles_say_what_the_summary_says(scene):
    experiment, done = scene
    options, gate = experiment.judge, experiment.tracker.gate.probability
    text = " ".join(summary(experiment, done, judge(done.tracks, done.recording.truth, done.scans, options, gate)).split())
    for name, axes in zip(("NEES", "NIS"), errors(experiment, done).axes[-2:], strict=True):
        told, inside = axes.get_title("left").split("; ")
        part, count = re.fullmatch(r"(\S+) % of (\S+) in the 95 % band", inside).groups()
        ratio = re.fullmatch(r"mean (\S+) times the expected one", told)[1]
        assert re.search(rf"{name}(?: of the position)? {re.escape(ratio)} {re.escape(part)} % of {count}", text)


@pytest.mark.costly
def test_the_pictures_are_png_of_a_readable_size(scene, tmp_path):
    assert write_pictures(tmp_path, *scene) == ["errors.png", "picture.png"]
    assert size_of(tmp_path / "picture.png") == (1200, 900)
    assert size_of(tmp_path / "errors.png") == (1200, 900)


CASES = {
    "nothing at all": lambda: result(),
    "scans only": lambda: result(times=(0.0, 1.0)),
    "one scan": lambda: result([track([0.0], np.zeros((1, 4)), np.eye(4))], times=(0.0,)),
    "no returns": lambda: result(times=(0.0, 1.0), returns_per_scan=0),
    "truth without tracks": lambda: result(truth=[still("buoy", [0, 9], (1.0, 2.0))], times=range(10)),
    "a track without truth": lambda: result([track(range(10), np.zeros((10, 4)), np.eye(4))], times=range(10)),
    "more objects than rows": lambda: result(
        [track(range(5), np.tile([100.0 * i, 0, 0, 0], (5, 1)), np.eye(4), i) for i in range(9)],
        [still(f"buoy {i}", [0, 9], (100.0 * i, 1.0)) for i in range(9)],
        range(10),
    ),
    "a singular covariance": lambda: result(
        [track(range(5), np.ones((5, 4)), np.zeros((4, 4)))], [still("buoy", [0, 9], (1.0, 2.0))], range(10)
    ),
    "more tracks than labels": lambda: result(
        [track([0.0, 1.0], np.tile([i, 0.1 * i, 0, 0], (2, 1)), np.eye(4), i) for i in range(90)], times=(0.0, 1.0)
    ),
}


@pytest.mark.parametrize("case", CASES, ids=str)
@pytest.mark.costly
def test_whatever_a_run_lacks_it_can_be_drawn_and_told(case, scene, tmp_path):
    experiment, done = scene[0], CASES[case]()
    assert write_pictures(tmp_path, experiment, done) == ["errors.png", "picture.png"]
    score = metrics.judge(done.tracks, done.recording.truth, done.scans, experiment.judge)
    assert "nan" not in summary(experiment, done, score)
    json.dumps(figures(experiment, done, score), allow_nan=False)


def test_one_axis_makes_no_map(tmp_path):
    tracker = SimpleNamespace(state=Space.of(x="m"), sensors={}, estimator=None, gate=SimpleNamespace(probability=1.0))
    experiment = SimpleNamespace(tracker=tracker, title="", judge=metrics.Judge(), preprocessors={})
    assert write_pictures(tmp_path, experiment, result()) == ["errors.png"]


def test_colours_repeat_after_twelve():
    assert len({canvas.colour(i) for i in range(12)}) == 12
    assert canvas.colour(12) == canvas.colour(0)
