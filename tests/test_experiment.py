"""Runs at the edge of what there is to track: nothing, one thing, far too much; each ends with results or one clear line."""

import numpy as np
import pytest
from attrs import evolve, field, frozen

import vedette
from support.results import write_pictures
from vedette import Detections, Recording, Scan, Source, Space, Trajectory
from vedette.metrics import judge
from vedette_report.figures import figures
from vedette_report.running.files import write_files
from vedette_report.series.recorder import recorded_run
from vedette_report.summary.words import summary

PLANE = Space.of(x="m", y="m", vx="m/s", vy="m/s")
ESTIMATORS = {
    "kalman": {"kind": "kalman", "motion": {"kind": "constant_velocity", "sigma_accel": 1.0}},
    "imm": {
        "kind": "imm",
        "modes": [{"kind": "kalman", "motion": {"kind": "constant_velocity", "sigma_accel": s}} for s in (0.1, 2.0)],
        "transition": [[0.9, 0.1], [0.1, 0.9]],
    },
}


@frozen
class Given(Source):
    """A recording that a test has made."""

    kind = "given"
    scans: tuple = ()
    truth: tuple = ()
    refused: tuple = field(default=())

    def open(self, sensors, rng):
        return Recording(self.scans, self.truth, self.refused)


def experiment(scans, truth=(), estimator="kalman", **changes):
    built = vedette.load(
        {
            "estimator": ESTIMATORS[estimator],
            "sensors": {"radar": {"kind": "cartesian_position", "sigma": 5.0, "clutter_density": 1e-6}},
            "associator": {"kind": "gnn"},
            "birth": {"kind": "from_returns", "spread": {"vx": 10.0, "vy": 10.0}},
            "lifecycle": {"kind": "m_of_n"},
            **changes,
        }
    )
    return evolve(built, source=Given(tuple(scans), tuple(truth)))


def scan(time, *returns):
    return Scan(float(time), "radar", Detections.of(list(returns), 2))


def path(times, name="ship"):
    times = np.asarray(times, dtype=float)
    return Trajectory(name, PLANE, times, np.stack([3.0 * times, 0 * times, 3.0 + 0 * times, 0 * times], axis=-1))


def told(built, folder, pictures=True):
    """All that `vedette run` does after a run; the result, its figures, its summary."""
    recorded = recorded_run(built, built.steps(named=np.inf))
    result = recorded.result
    score = judge(result.tracks, result.recording.truth, result.scans, built.judge, built.tracker.gate.probability)
    found, text = figures(built, result, score), summary(built, result, score)
    write_files(folder, evolve(built, source=None), recorded, found, text)
    if pictures:
        pytest.importorskip("matplotlib")
        write_pictures(folder, built, result)
    return result, found, text


QUIET = [scan(t) for t in range(20)]
EDGES = {
    "a quiet sea": QUIET,
    "no scans": [],
    "one scan without a return": [scan(0)],
    "one scan, one return": [scan(0, [0.0, 0.0])],
    "one return in all": [scan(t, *([[1.0, 2.0]] if t == 7 else [])) for t in range(20)],
    "all scans refused": [Scan(float(t), "sonar", Detections.of([[0.0, 0.0]])) for t in range(5)],
    "all returns refused": [scan(t, [np.nan, 0.0]) for t in range(5)],
    "all at one time": [scan(0.0, [0.0, 0.0]) for _ in range(6)],
    "one object at rest": [scan(t, [0.0, 0.0]) for t in range(6)],
}
TRUTHS = {
    "no truth": (),
    "a truth": (path(np.arange(21.0)),),
    "a truth elsewhere in time": (path(np.arange(500.0, 510.0)),),
    "a truth of one moment": (path([3.0]),),
    "a truth of no moment": (path([]),),
}


@pytest.mark.parametrize("estimator", ESTIMATORS)
@pytest.mark.parametrize("truth", TRUTHS)
@pytest.mark.parametrize("edge", EDGES)
@pytest.mark.by_turns
def test_a_run_at_the_edge_ends_with_a_summary(edge, truth, estimator, tmp_path):
    built = experiment(EDGES[edge], TRUTHS[truth], estimator)
    result, found, text = told(built, tmp_path, pictures=estimator == "imm" and truth in ("no truth", "a truth"))
    assert found["scans_taken"] == len(result.scans)
    assert len(result.scans) == (0 if edge in ("no scans", "all scans refused", "all returns refused") else len(EDGES[edge]))
    assert (tmp_path / "tracks.csv").read_text().startswith("track,time,x,y,vx,vy,")
    if not result.tracks:
        assert f"0 confirmed of {result.begun:,} begun" in text
    assert "nan" not in text.replace("got [nan, 0.0]", "")


@pytest.mark.parametrize("kind", ["single_target", "m_of_n", "existence", "score", "coast_limited"])
@pytest.mark.by_turns
def test_tracks_there_from_the_start_live_through_a_quiet_sea(kind, tmp_path):
    parts = {"lifecycle": {"kind": kind}}
    if kind == "single_target":
        parts["birth"] = {"kind": "given", "start": {name: [0.0, 10.0] for name in PLANE.names}}
    result, _, _ = told(experiment(QUIET, TRUTHS["a truth"], **parts), tmp_path)
    assert len(result.tracks) == result.begun == (kind == "single_target")


def test_a_study_of_quiet_seas_has_no_error_to_tell():
    config = {
        "estimator": ESTIMATORS["imm"],
        "sensors": {"radar": {"kind": "cartesian_position", "sigma": 5.0, "detection_probability": 0.0}},
        "associator": {"kind": "gnn"},
        "birth": {"kind": "from_returns", "spread": {"vx": 10.0, "vy": 10.0}},
        "lifecycle": {"kind": "m_of_n"},
        "source": {
            "kind": "simulation",
            "duration": 10.0,
            "looks": {"radar": {"interval": 1.0}},
            "ships": {"one": {"start": [0.0, 0.0]}},
        },
    }
    found = vedette.monte_carlo(config, runs=3).means(0)
    assert found["coverage"].value == 0
    assert found["lost"].value == 1
    assert found["position_rmse"].value is None


@pytest.mark.parametrize("edge", ["no scans", "one scan, one return"])
def test_a_picture_of_one_point_or_none_has_axes_that_can_be_read(edge):
    pytest.importorskip("matplotlib")
    from vedette_report.drawing.errors import errors
    from vedette_report.drawing.picture import picture

    built = experiment(EDGES[edge])
    result = built.run()
    for axes in (*picture(built, result).axes, *errors(built, result).axes):
        assert np.ptp(axes.get_xlim()) > 0.9
