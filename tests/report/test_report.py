"""Pictures, traces and words of a run: against figures made another way, and against what the picture holds."""

import json
import struct
from types import SimpleNamespace

import numpy as np
import pytest
from attrs import evolve
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy import stats

import vedette
from vedette import Gaussian, Recording, Result, Scan, Space, Track, Trajectory, metrics
from vedette.io.reading import NORTH_EAST
from vedette.metrics.coverage import NONE
from vedette.report import canvas
from vedette.report.errors import errors
from vedette.report.figures import figures
from vedette.report.files import write_pictures
from vedette.report.picture import ellipses, picture
from vedette.report.plane import Plane, returns, stands
from vedette.report.summary import summary
from vedette.report.traces import Normalised, innovations, mode_names, position_nees, traces
from vedette.types import Detections, Pose

PLANE = Space.of(x="m", y="m", vx="m/s", vy="m/s")


def config(**changes):
    modes = [{"kind": "ekf", "motion": {"kind": "constant_velocity", "sigma_accel": sigma}} for sigma in (0.1, 1.0)]
    return {
        "title": "A test",
        "estimator": {"kind": "imm", "modes": modes, "transition": [[0.9, 0.1], [0.1, 0.9]]},
        "sensors": {
            "radar": {"kind": "range_bearing", "sigma_range": 5.0, "sigma_bearing": 0.01, "x": 40.0, "y": -30.0},
            "beacon": {"kind": "cartesian_position", "sigma": 3.0},
        },
        "associator": {"kind": "gnn"},
        "lifecycle": {"kind": "m_of_n", "spread": {"vx": 8.0, "vy": 8.0}},
        "source": {
            "kind": "simulation",
            "duration": 60.0,
            "looks": {"radar": {"interval": 2.0}, "beacon": {"interval": 5.0, "first": 1.0}},
            "ships": {
                "near": {"start": [100.0, 200.0], "speed": 8.0},
                "late": {"start": [-300.0, 0.0], "speed": 5.0, "course": 2.0, "appears": 31.0},
            },
        },
        **changes,
    }


def run(**changes):
    experiment = vedette.load(config(**changes))
    return experiment, experiment.run()


@pytest.fixture(scope="module")
def scene():
    return run()


def track(times, mean, cov, number=0, nis=1.0, hit=1.0, space=PLANE, modes=None):
    """A track that is confirmed all the time."""
    count = len(times)
    each = np.ones(count)
    return Track(
        id=number,
        space=space,
        times=np.asarray(times, dtype=float),
        mean=np.asarray(mean, dtype=float),
        cov=np.broadcast_to(cov, (count, len(space), len(space))).astype(float),
        confirmed=each.astype(bool),
        existence=each,
        mode_prob=modes,
        weights=(np.array([1.0 - hit, hit]),) * count,
        nis=nis * each,
        hit=hit * each,
    )


def result(tracks=(), truth=(), times=(), returns_per_scan=1, refused=(), notes=None):
    """A result whose scans hold returns at the origin."""
    detections = Detections.of(np.zeros((returns_per_scan, 2)), 2)
    scans = tuple(Scan(float(time), "beacon", detections) for time in times)
    recording = Recording(scans, tuple(truth), (), notes or {})
    return Result(tuple(tracks), recording, scans, tuple(refused), len(tracks), 0.0, False)


def still(name, times, position):
    return Trajectory(name, PLANE, np.asarray(times, dtype=float), np.tile([*position, 0.0, 0.0], (len(times), 1)))


# ---- what is drawn


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

        def at(self, pose):
            return self

        def invert(self, z, noise=None) -> Gaussian:
            raise NotImplementedError

    plane = Plane.of(PLANE, done.recording)
    assert returns(done.scans, {"radar": Bearings()}, plane) == {"radar": None}


def test_platforms_are_those_of_sensors_that_looked():
    sensors = vedette.load(config()).tracker.sensors
    plane = Plane.of(PLANE, Recording(()))
    seen, pose = Detections.of([], 2), Pose(np.array([5.0, 6.0]))
    assert stands([Scan(0.0, "beacon", seen)], sensors, plane) == []
    assert [path.tolist() for path in stands([Scan(0.0, "radar", seen)], sensors, plane)] == [[[40.0, -30.0]]]
    assert [path.tolist() for path in stands([Scan(0.0, "radar", seen, pose)], sensors, plane)] == [[[5.0, 6.0]]]


def drawn_lines(axes):
    return [np.column_stack([line.get_xdata(), line.get_ydata()]).astype(float) for line in axes.lines]


def words(made):
    axes_texts = [text.get_text() for axes in made.axes for text in axes.texts]
    return axes_texts + [text.get_text() for text in made.texts]


def test_the_picture_holds_truth_tracks_ids_and_names(scene):
    experiment, done = scene
    axes = picture(experiment, done).axes[0]
    lines = drawn_lines(axes)
    for path in done.recording.truth:
        assert any(np.array_equal(line, path.states[:, :2]) for line in lines)
    for one in done.tracks:
        assert any(np.array_equal(line, one.mean[:, :2]) for line in lines)
        sure = np.where(one.confirmed[:, None], one.mean[:, :2], np.nan)
        assert any(np.array_equal(line, sure, equal_nan=True) for line in lines)
    texts = [text.get_text() for text in axes.texts]
    assert {str(one.id) for one in done.tracks} | {"near", "late"} == set(texts)
    count = sum(len(scan.detections.z) for scan in done.scans if scan.sensor == "radar")
    assert f"returns of radar ({count})" in axes.get_legend_handles_labels()[1]
    rings = sum(len(one.get_segments()) for one in axes.collections)
    assert 10 <= rings <= 40


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


def test_the_pictures_are_png_of_a_readable_size(scene, tmp_path):
    assert write_pictures(tmp_path, *scene) == ["picture.png", "errors.png"]
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
def test_whatever_a_run_lacks_it_can_be_drawn_and_told(case, scene, tmp_path):
    experiment, done = scene[0], CASES[case]()
    assert write_pictures(tmp_path, experiment, done) == ["picture.png", "errors.png"]
    score = metrics.judge(done.tracks, done.recording.truth, done.scans, experiment.judge)
    assert "nan" not in summary(experiment, done, score)
    json.dumps(figures(experiment, done, score), allow_nan=False)


def test_one_axis_makes_no_map(tmp_path):
    tracker = SimpleNamespace(state=Space.of(x="m"), sensors={}, estimator=None)
    experiment = SimpleNamespace(tracker=tracker, title="", judge=metrics.Judge(), preprocessors={})
    assert write_pictures(tmp_path, experiment, result()) == ["errors.png"]


def test_colours_repeat_after_twelve():
    assert len({canvas.colour(i) for i in range(12)}) == 12
    assert canvas.colour(12) == canvas.colour(0)


# ---- traces


def test_traces_agree_with_the_figures(scene):
    experiment, done = scene
    score = metrics.judge(done.tracks, done.recording.truth, done.scans, experiment.judge)
    followed = traces(experiment, done)
    assert [trace.name for trace in followed] == ["near", "late"]
    error = np.concatenate([trace.error[trace.covered] for trace in followed])
    speed = np.concatenate([trace.speed_error[trace.covered] for trace in followed])
    assert np.sqrt(np.mean(error**2)) == pytest.approx(score.position_rmse_m)
    assert np.sqrt(np.mean(speed**2)) == pytest.approx(score.velocity_rmse_mps)
    assert np.mean(position_nees(followed).value) == pytest.approx(score.anees)
    for trace, fate in zip(followed, score.truths, strict=True):
        assert (len(trace.times), np.mean(trace.covered)) == (fate.scans, fate.coverage)
        assert np.array_equal(np.isnan(trace.error), ~trace.covered)
        np.testing.assert_allclose(np.sum(trace.modes[trace.covered], axis=1), 1.0)


def test_a_trace_by_hand():
    experiment = vedette.load(config(judge={"cover_radius": 20.0, "offset": [1.0, 0.0]}))
    cov = np.diag([9.0, 16.0, 1.0, 3.0])
    mean = np.tile([4.0, 4.0, 0.6, 0.8], (4, 1))
    mean[2] = [500.0, 0.0, 0.0, 0.0]
    done = result([track(range(4), mean, cov)], [still("buoy", [1, 9], (0.0, 0.0))], range(6))
    (trace,) = traces(experiment, done)
    assert trace.times.tolist() == [1.0, 2.0, 3.0, 4.0, 5.0]
    assert trace.track.tolist() == [0, NONE, 0, NONE, NONE]
    np.testing.assert_allclose(trace.error[[0, 2]], 5.0)
    np.testing.assert_allclose(trace.sigma[[0, 2]], 5.0)
    np.testing.assert_allclose(trace.speed_error[[0, 2]], 1.0)
    np.testing.assert_allclose(trace.speed_sigma[[0, 2]], 2.0)
    np.testing.assert_allclose(trace.nees[[0, 2]], 9 / 9 + 16 / 16)
    assert trace.modes is None
    for values in (trace.error, trace.sigma, trace.speed_error, trace.speed_sigma, trace.nees):
        assert np.isnan(values[[1, 3, 4]]).all()


def test_errors_are_drawn_where_a_track_covers_and_gaps_are_shaded(scene):
    experiment, done = scene
    followed = traces(experiment, done)
    made = errors(experiment, done)
    assert not followed[1].covered.all()
    for trace, axes in zip(followed, made.axes[::3], strict=False):
        assert axes.get_title(loc="left") == trace.name
        (line,) = drawn_lines(axes)
        np.testing.assert_array_equal(line[:, 0], trace.times - done.scans[0].time)
        np.testing.assert_array_equal(line[:, 1], trace.error)
        gaps = np.count_nonzero(np.diff(np.concatenate([[True], trace.covered]).astype(int)) < 0)
        assert len(axes.patches) == gaps
    seen = made.axes[-1].collections[0].get_offsets()
    np.testing.assert_allclose(seen[:, 1], innovations(experiment, done).value)


def test_truth_without_velocity_leaves_its_error_unknown(scene):
    ground = Trajectory("buoy", Space.of(x="m", y="m"), np.array([0.0, 9.0]), np.zeros((2, 2)))
    done = result([track(range(5), np.zeros((5, 4)), np.eye(4))], [ground], range(5))
    (trace,) = traces(scene[0], done)
    assert np.isnan(trace.speed_error).all()
    assert "unknown" in words(errors(scene[0], done))


def test_innovations_are_per_return_and_only_of_likely_ones(scene):
    tracks = [
        track(range(3), np.zeros((3, 4)), np.eye(4), 0, nis=1.2, hit=0.6),
        track(range(3), np.zeros((3, 4)), np.eye(4), 1, nis=1.2, hit=0.4),
        track(range(3), np.zeros((3, 4)), np.eye(4), 2, nis=0.0, hit=1.0),
    ]
    seen = innovations(scene[0], result(tracks, times=range(3)))
    np.testing.assert_allclose(seen.value, [2.0, 2.0, 2.0])
    assert (seen.track.tolist(), seen.axes.tolist(), seen.times.tolist()) == ([0] * 3, [2] * 3, [0.0, 1.0, 2.0])


def test_the_part_inside_uses_each_values_own_band():
    values, axes = [], []
    for m in (1, 2, 3):
        low, high = stats.chi2.ppf([0.025, 0.975], m)
        values += [0.99 * low, 1.01 * low, 0.99 * high, 1.01 * high]
        axes += [m] * 4
    seen = Normalised(np.zeros(12), np.zeros(12, dtype=int), np.array(values), np.array(axes))
    assert seen.inside() == 0.5
    assert Normalised(np.zeros(0), np.zeros(0, dtype=int), np.zeros(0), np.zeros(0, dtype=int)).inside() is None


def test_modes_are_called_by_their_motion(scene):
    assert mode_names(scene[0], 2) == ("constant_velocity (1)", "constant_velocity (2)")
    assert mode_names(scene[0], 3) == ("mode 1", "mode 2", "mode 3")
    turning = {"kind": "ekf", "motion": {"kind": "coordinated_turn", "sigma_accel": 1.0, "sigma_turn_rate": 0.1}}
    straight = {"kind": "ekf", "motion": {"kind": "constant_velocity", "sigma_accel": 1.0}}
    changes = {"estimator": {"kind": "imm", "modes": [straight, turning], "transition": [[0.9, 0.1], [0.1, 0.9]]}}
    changes["lifecycle"] = {"kind": "m_of_n", "spread": {"vx": 8.0, "vy": 8.0, "turn_rate": 0.1}}
    assert mode_names(vedette.load(config(**changes)), 2) == ("constant_velocity", "coordinated_turn")


# ---- words


def told(experiment, done):
    return summary(experiment, done, metrics.judge(done.tracks, done.recording.truth, done.scans, experiment.judge))


@pytest.mark.parametrize(
    ("variance", "verdict"),
    [
        (1.0, "the covariance fits the errors to within a factor of 2"),
        (0.1, "the covariance is 10 times too small for the errors"),
        (20.0, "the covariance is 20 times too large for the errors"),
    ],
)
def test_the_summary_says_how_nees_stands(variance, verdict, scene):
    done = result(
        [track(range(5), np.tile([1.0, 1.0, 0.0, 0.0], (5, 1)), variance * np.eye(4))],
        [still("buoy", [0, 9], (0.0, 0.0))],
        range(5),
    )
    text = told(scene[0], done)
    assert verdict in text
    assert f"{2 / variance:.3g} on average, 2 expected" in text


@pytest.mark.parametrize(
    ("nis", "verdict"),
    [
        (2.0, "the innovations are as large as the models say"),
        (8.0, "the squared innovations are 4 times larger"),
        (0.2, "the squared innovations are 10 times smaller"),
    ],
)
def test_the_summary_says_how_nis_stands(nis, verdict, scene):
    done = result([track(range(200), np.zeros((200, 4)), np.eye(4), nis=nis)], times=range(200))
    assert verdict in " ".join(told(scene[0], done).split())


def test_the_summary_counts_and_names_what_was_read_and_refused(scene):
    refused = [vedette.Problem(f"line {i}", "is no good") for i in range(8)]
    text = told(scene[0], result(times=range(3), returns_per_scan=4, refused=refused, notes={"recording": "of 1999"}))
    assert "3 scans, 12 returns" in text
    assert "8 parts of the input left out" in text
    assert "line 4: is no good" in text
    assert "line 5: is no good" not in text
    assert "and 3 more" in text
    assert "recording: of 1999" in text


def test_figures_hold_no_number_that_json_lacks(scene):
    experiment, done = scene
    score = metrics.judge(done.tracks, done.recording.truth, done.scans, experiment.judge)
    found = figures(experiment, done, evolve(score, nis=float("nan"), bias_m=(1.0, float("inf"))))
    assert found["nis"] is None
    assert found["bias_m"] == [1.0, None]
    assert json.loads(json.dumps(found, allow_nan=False)) == found
