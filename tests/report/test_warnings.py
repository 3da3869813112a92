"""What looks wrong is said, in the summary's first lines; what is right is not."""

import numpy as np
import pytest
from attrs import evolve, field, frozen

import vedette
from vedette import Detections, Pose, Recording, Scan, Source, Space, Trajectory
from vedette.metrics import judge
from vedette_files import DATED
from vedette_report.summary.words import summary
from vedette_report.warnings.joined import joined
from vedette_report.warnings.words import warnings

SENSORS = {
    "radar": {"kind": "range_bearing", "sigma_range": 10.0, "sigma_bearing": 0.01, "max_range": 5000.0},
    "beacon": {"kind": "cartesian_position", "sigma": 5.0},
}


@frozen
class Given(Source):
    kind = "given"
    scans: tuple = ()
    refused: tuple = ()
    truth: tuple = ()
    notes: dict = field(factory=dict)

    def open(self, sensors, rng):
        return Recording(self.scans, self.truth, self.refused, self.notes)


def said(scans, truth=(), notes=None, **changes):
    config = {
        "estimator": {"kind": "ekf", "motion": {"kind": "constant_velocity", "sigma_accel": 1.0}},
        "sensors": SENSORS,
        "associator": {"kind": "gnn"},
        "birth": {"kind": "from_returns", "spread": {"vx": 10.0, "vy": 10.0}},
        "lifecycle": {"kind": "m_of_n"},
        **changes,
    }
    experiment = evolve(vedette.load(config), source=Given(tuple(scans), (), truth, notes or {}))
    result = experiment.run()
    score = judge(result.tracks, result.recording.truth, result.scans, experiment.judge, 0.99)
    found, text = list(warnings(experiment, result, score)), summary(experiment, result, score)
    assert ("LOOKS WRONG" in text.splitlines()[3]) == bool(found)
    return found


def polar(time, *returns):
    return Scan(float(time), "radar", Detections.of(list(returns), 2))


def plane(time, *returns):
    return Scan(float(time), "beacon", Detections.of(list(returns), 2))


def steady(unit=1.0, far=1.0):
    return [polar(t, [far * (1000.0 + 5 * t), unit * 0.5]) for t in range(30)]


def test_what_is_right_is_not_said():
    assert said(steady()) == []
    assert said([plane(2.0 * t, [5.0 * t, 0.0]) for t in range(30)]) == []
    assert said([polar(t) for t in range(5)]) == []
    at_rest = [plane(2.0 * t, [7.0, 5.0]) for t in range(30)]  # its returns are where they are expected, to the last bit
    assert not any("did a track take a return" in each for each in said(at_rest))


@pytest.mark.parametrize(
    ("scans", "words"),
    [
        (steady(unit=180 / np.pi), "radar: bearing goes up to 28.65 rad, beyond its period of 6.283 rad"),
        (steady(far=1852.0), "radar: all of the first 30 returns lie where the sensor says that it detects nothing"),
        ([polar(t) for t in range(30)], "radar: none of 30 scans holds a return"),
        ([plane(t // 10, [0.0, 0.0]) for t in range(30)], "beacon: 27 of 30 scans have the very time of the one before"),
        ([plane(2500.0 * t, [5.0 * t, 0.0]) for t in range(30)], "scans are 2,500 s apart on average"),
        ([plane(t, [1e5 * t * t, 0.0]) for t in range(30)], "in none of them did a track take a return"),
        ([plane(t, [0.0, 0.0]) for t in [*range(3), *range(-30, 0)]], "30 of them go back in time: sort the recording"),
        ([plane(t, [t if t > 13 else np.nan, 0.0]) for t in range(30)], "much of the input was left out: 14 parts"),
        ([plane(t, [np.nan, 0.0]) for t in range(30)], "most of the input was left out: 30 parts, and 0 scans taken"),
    ],
)
def test_what_looks_wrong_is_said(scans, words):
    assert any(words in each for each in said(scans)), said(scans)


def test_times_that_are_dates_are_in_no_other_unit():
    """Buoys and storms report every few hours."""
    assert said([plane(2500.0 * t, [5.0 * t, 0.0]) for t in range(30)], notes={"time": DATED}) == []


def test_refused_input_is_said_first():
    found = said([plane(t, [0.0, 0.0]) for t in [*range(12), *range(-30, 0)]])
    assert found[0].startswith("most of the input was left out")


def test_tracks_far_from_all_truth_are_said():
    times = np.arange(30.0)
    truth = vedette.Trajectory("one", vedette.Space.of(x="m", y="m"), times, np.full((30, 2), 9e5))
    assert any("none was ever near a true object" in each for each in said(steady(), (truth,)))


def test_a_csv_file_s_angles_are_checked_before_they_are_wrapped(tmp_path):
    rows = "\n".join(f"{t},{1000 + 5 * t},{100.0 + t}" for t in range(30))
    (tmp_path / "radar.csv").write_text(f"t,r,b\n{rows}\n")
    columns = {"time": "t", "columns": {"range": "r", "bearing": "b"}}
    source = {"kind": "csv", "path": str(tmp_path / "radar.csv"), "detections": columns}
    experiment = vedette.load(
        {
            "estimator": {"kind": "ekf", "motion": {"kind": "constant_velocity", "sigma_accel": 1.0}},
            "sensors": {"radar": SENSORS["radar"]},
            "associator": {"kind": "gnn"},
            "birth": {"kind": "from_returns", "spread": {"vx": 10.0, "vy": 10.0}},
            "lifecycle": {"kind": "m_of_n"},
            "source": source,
        }
    )
    (word,) = experiment.run().recording.warnings
    assert word.startswith("radar: bearing goes up to 129 rad, beyond its period")
    right = evolve(experiment, source=vedette.load(_with_degrees(experiment, source)).source)
    assert right.run().recording.warnings == ()


def _with_degrees(experiment, source):
    config = vedette.to_config(evolve(experiment, source=None))
    return config | {"source": source | {"detections": source["detections"] | {"units": {"bearing": "deg"}}}}


@pytest.mark.parametrize("lacks", [True, False])
def test_returns_that_lack_a_component_are_said_to_start_no_track(lacks):
    """The lifecycle, noise and clutter were to be compared with the data."""
    whole = {"kind": "range_bearing_rate", "sigma_range": 10.0, "sigma_bearing": 0.01, "sigma_rate": 1.0}
    sensors = {"radar": {"kind": "partial", "optional": {"range_rate": 50.0}, "of": {**whole, "crossing_speed": 10.0}}}
    missing = np.array([[False, False, lacks]])
    scans = [Scan(float(t), "radar", Detections([[1000.0, 0.5, 0.0]], [True], missing=missing)) for t in range(30)]
    (word,) = said(scans, sensors=sensors, lifecycle={"kind": "m_of_n", "hits": 40, "looks": 40})
    assert ("lack range_rate" in word and "'poisson'" in word) == lacks


@pytest.mark.parametrize(("angle", "told"), [(0.45, True), (0.5, False)])
def test_a_radar_that_is_turned_against_the_truth_is_said(angle, told):
    times = np.arange(30.0)
    path = (1000.0 + 5 * times)[:, None] * [np.cos(angle), np.sin(angle)]
    truth = vedette.Trajectory("one", vedette.Space.of(x="m", y="m"), times, path)
    assert any(each.startswith("radar:") and "bearing" in each for each in said(steady(), (truth,))) == told


@pytest.mark.parametrize(
    ("motion", "deviation", "told"),
    [
        ({"kind": "carrying", "carries": {"lag": "m"}}, 20.0, 1),
        ({"kind": "carrying", "carries": {"lag": "m"}}, 0.0, 0),
        ({"kind": "product", "models": [{"kind": "random_walk", "axes": ["lag"], "sigma": 0.0}]}, 20.0, 0),
    ],
)
def test_an_axis_that_a_sensor_sees_and_the_motion_holds_is_told(motion, deviation, told):
    """Its deviation would be dropped without a word, and what the sensor says of it with it."""
    plain = {"kind": "constant_velocity", "sigma_accel": 1.0}
    motion = motion | ({"models": [plain, *motion["models"]]} if "models" in motion else {"motion": plain})
    beacon = {"kind": "linear", "axes": ["x", "y", "lag"], "units": {"lag": "m"}, "H": [[1.0, 0, 1], [0, 1, 1]]}
    birth = {"kind": "given", "start": {**{axis: [0.0, 10.0] for axis in ("x", "y", "vx", "vy")}, "lag": [0.0, deviation]}}
    parts = {"estimator": {"kind": "kalman", "motion": motion}, "birth": birth, "lifecycle": {"kind": "single_target"}}
    sensors = {"beacon": beacon | {"R": [[9.0, 0], [0, 9.0]], "measures": ["p", "q"]}}
    found = said([plane(t, [5.0 + t, 7.0]) for t in range(20)], sensors=sensors, **parts)
    assert len(found) == told
    assert all(one.startswith("lag begins with a deviation, beacon sees it") for one in found)


@pytest.mark.parametrize(("gap", "told"), [(1.0, False), (20.0, True)])
def test_a_truth_of_which_lines_make_much_is_told(gap, told):
    """22,927 of 172,026 true boxes were of gaps of the file, and counted as missed. Scans in a gap count, not the gap."""
    times = np.arange(100.0) + gap * (np.arange(100) > 50)
    path = Trajectory("a", Space.of(x="m", y="m"), times, np.zeros((100, 2)))
    assert bool(list(joined([path], np.arange(times[-1])))) == told
    assert not list(joined([path], times))


@pytest.mark.parametrize(("velocity", "told"), [(None, True), ([0.0, 0.0], False)])
def test_a_moving_platform_of_range_rates_without_a_velocity_is_told(velocity, told):
    radar = {"kind": "range_bearing_rate", "sigma_range": 1.0, "sigma_bearing": 0.01, "sigma_rate": 1.0}
    seen = Detections.of([[100.0, 0.0, 0.0]])
    moving = [Scan(float(t), "radar", seen, Pose(np.array([5.0 * t, 0.0]), velocity)) for t in range(30)]
    standing = [evolve(scan, pose=moving[0].pose) for scan in moving]
    found = [said(scans, sensors={"radar": radar}) for scans in (moving, standing)]
    assert [any("without a velocity" in each for each in every) for every in found] == [told, False]
