"""Studies on a recording: what each run draws of it, the same for all settings; and runs that would all be the same."""

import json
from pathlib import Path

import attrs
import numpy as np
import pytest
from scipy import stats

import vedette
from support.statistics import ALPHA, moments_match
from vedette import ConfigError, Detections, Gaussian, LazyScans, Recording, Scan, Space, Trajectory
from vedette.cli import main
from vedette.types import Frame
from vedette_files import write_recording
from vedette_study.plan import plan
from vedette_study.redraw import Redraw
from vedette_study.seeds import sequence
from vedette_study.summary import charts, text

KALMAN = {"kind": "kalman", "motion": {"kind": "constant_velocity", "sigma_accel": 1.0}}
PARTICLES = {"kind": "bootstrap_particles", "motion": {"kind": "constant_velocity", "sigma_accel": 1.0}, "particles": 100}
PLANE = Space.of(x="m", y="m")
AS_IT_IS = {"drop": 0.0, "starts": False}


def recording(path, seed=1):
    """Write a recording of one object at rest among two false returns a scan."""
    dice = np.random.default_rng(seed)
    scans = tuple(
        Scan(float(t), "radar", Detections.of([dice.normal(0.0, 5.0, 2), *dice.uniform(-400, 400, (2, 2))]))
        for t in range(30)
    )
    truth = Trajectory("buoy", PLANE, np.array([0.0, 29.0]), np.zeros((2, 2)))
    write_recording(path, Recording(scans, (truth,)), {"radar": PLANE})
    return str(path)


def config(path):
    """A config on a recording."""
    return {
        "estimator": KALMAN,
        "sensors": {"radar": {"kind": "cartesian_position", "sigma": 5.0, "clutter_density": 1e-6}},
        "associator": {"kind": "pda"},
        "birth": {"kind": "from_returns", "spread": {"vx": 1.0, "vy": 1.0}},
        "lifecycle": {"kind": "existence"},
        "source": {"kind": "jsonl", "path": path},
        "judge": {"cover_radius": 20.0},
    }


@pytest.fixture(scope="module")
def recorded(tmp_path_factory):
    return config(recording(tmp_path_factory.mktemp("recording") / "recording.jsonl"))


def table(config, **more):
    return {"experiment": config, **more}


# What is drawn.
def many(count=400, returns=5):
    z = np.arange(2.0 * count * returns).reshape(count, returns, 2)
    names = ("radar", "lidar")
    return Recording(tuple(Scan(float(i), names[i % 2], Detections.of(part)) for i, part in enumerate(z)))


def kept(recording, run, drop=0.1):
    return Redraw(drop).recording(recording, sequence(3, run))


def test_returns_are_left_out_independently_and_as_often_as_stated():
    whole = many()
    left = [kept(whole, run) for run in range(10)]
    numbers = np.array([[len(scan.detections.z) for scan in each.scans] for each in left])
    assert stats.binomtest(int(numbers.sum()), 10 * 2000, 0.9).pvalue > ALPHA
    expected = stats.binom(5, 0.9).pmf(np.arange(6)) * numbers.size
    found = np.bincount(numbers.ravel(), minlength=6)
    assert stats.chisquare(np.append(found[:3].sum(), found[3:]), np.append(expected[:3].sum(), expected[3:])).pvalue > ALPHA
    assert [scan.time for scan in left[0].scans] == [scan.time for scan in whole.scans]
    for before, after in zip(whole.scans, left[0].scans, strict=True):
        assert set(map(tuple, after.detections.z)) <= set(map(tuple, before.detections.z))


def test_a_run_draws_the_same_alone_and_among_other_sensors():
    whole = many()
    radar = attrs.evolve(whole, scans=whole.scans[::2])
    together = [scan.detections.z for scan in kept(whole, 4).scans if scan.sensor == "radar"]
    alone = [scan.detections.z for scan in kept(radar, 4).scans]
    for one, other in zip(together, alone, strict=True):
        np.testing.assert_array_equal(one, other)
    assert any(
        len(a.detections.z) != len(b.detections.z) for a, b in zip(kept(whole, 4).scans, kept(whole, 5).scans, strict=True)
    )


def test_all_that_a_return_brings_goes_with_it():
    detections = Detections(
        np.arange(20.0).reshape(10, 2),
        np.arange(10) > 2,
        np.arange(10.0),
        np.arange(10.0)[:, None, None] * np.eye(2),
        np.arange(20).reshape(10, 2) == 7,
    )
    (scan,) = kept(Recording((Scan(0.0, "radar", detections),)), 0, 0.5).scans
    left, which = scan.detections, (scan.detections.z[:, 0] / 2).astype(int)
    assert 0 < len(which) < 10
    for name in ("z", "valid", "evidence", "noise", "missing"):
        np.testing.assert_array_equal(getattr(left, name), getattr(detections, name)[which])


def test_what_one_sensor_loses_another_may_see():
    """Returns of two sensors are left out independently, whatever the order of their scans."""
    scans = [Scan(0.0, name, Detections.of(np.arange(400.0).reshape(200, 2))) for name in ("radar", "lidar")]
    seen = {}
    for order in (scans, scans[::-1]):
        for scan in kept(Recording(tuple(order)), 0, 0.5).scans:
            seen.setdefault(scan.sensor, []).append(set(scan.detections.z[:, 0].tolist()))
    assert all(first == second for first, second in seen.values())
    assert 20 < len(seen["radar"][0] & seen["lidar"][0]) < 80  # of 200 some 50, +- 6


@pytest.mark.parametrize("lazy", [False, True])
def test_of_frames_whole_scans_are_left_out(lazy):
    scans = tuple(Scan.image(float(t), "camera", Frame(np.zeros((2, 2)))) for t in range(200))
    left = kept(Recording(LazyScans(200, lambda i: scans[i]) if lazy else scans), 0, 0.25).scans
    assert isinstance(left, LazyScans) == lazy
    assert stats.binomtest(len(left), 200, 0.75).pvalue > ALPHA
    assert all(scan.frame is not None for scan in left)


def test_given_tracks_start_from_their_prior():
    prior = Gaussian(np.array([[10.0, 3.0]]), np.array([[[4.0, 1.0], [1.0, 2.0]]]))
    space = Space.of(x="m", bearing="rad mod 2pi")
    draws = np.array([Redraw().start(prior, space, (), sequence(0, run)).mean[0] for run in range(400)])
    error = space.difference(draws, prior.mean)
    white = np.linalg.solve(np.linalg.cholesky(prior.cov[0]), error.T)
    assert stats.kstest(white[0], "norm").pvalue > ALPHA
    assert np.all(np.abs(draws[:, 1]) <= np.pi)
    assert Redraw().start(None, space, (), sequence(0, 0)) is None
    assert Redraw(starts=False).start(prior, space, (), sequence(0, 0)) is prior


def test_what_the_truth_does_not_know_starts_where_it_is_said_to():
    space = Space.of(x="m", azimuth_bias="rad", y="m")
    prior = Gaussian(np.array([[10.0, 0.5, 3.0]]), np.array([[[4.0, 0.1, 1.0], [0.1, 1.0, 0.1], [1.0, 0.1, 2.0]]]))
    truth = Trajectory("boat", PLANE, np.array([0.0]), np.zeros((1, 2)))
    draws = np.array([Redraw().start(prior, space, (truth,), sequence(0, run)).mean[0] for run in range(400)])
    assert np.all(draws[:, 1] == 0.5)
    assert moments_match(draws[:, [0, 2]], np.array([10.0, 3.0]), np.array([[4.0, 1.0], [1.0, 2.0]]))


# Studies.
@pytest.mark.costly
def test_a_study_of_a_recording_has_errors(recorded):
    found = vedette.monte_carlo(recorded, runs=10)
    means = found.means(0)
    assert found.runs == 10
    assert all(means[name].error > 0 for name in ("position_rmse", "nis", "gospa", "nees"))
    assert found.plan.redraw == Redraw(0.1, starts=False)
    assert plan(table(recorded)).runs == 10


@pytest.mark.costly
def test_settings_are_compared_on_the_same_draws(recorded):
    sweep = {"sensors.radar.sigma": [5.0, 5.0]}
    found = vedette.monte_carlo(recorded, runs=4, sweep=sweep)
    for values in found.figures.values():
        np.testing.assert_array_equal(values[0], values[1])
    again = vedette.monte_carlo(recorded, runs=4, sweep=sweep, chunk=2)
    for name, values in found.figures.items():
        np.testing.assert_array_equal(values, again.figures[name])
    other = vedette.monte_carlo(recorded, runs=4, seed=1).figures["position_rmse"]
    assert np.all(other[0] != found.figures["position_rmse"][0])


def test_where_nis_is_all_there_is_the_text_says_what_it_does_not_tell(recorded):
    sweep = {"estimator.motion.sigma_accel": [0.5, 2.0]}
    with_truth = vedette.monte_carlo(recorded, runs=2, sweep=sweep)
    nis = {"nis": with_truth.figures["nis"]}
    assert "vedette tune" in text(attrs.evolve(with_truth, figures=nis))
    assert "vedette tune" not in text(with_truth)


def test_runs_that_would_all_be_the_same_are_refused(recorded):
    with pytest.raises(ConfigError, match=r"^runs: must be 1, got 200: neither"):
        plan(table(recorded, runs=200, redraw=AS_IT_IS))
    assert plan(table(recorded, redraw=AS_IT_IS)).runs == 1


@pytest.mark.costly
def test_a_study_that_draws_nothing_is_the_run_itself(recorded, tmp_path, capsys):
    (tmp_path / "study.json").write_text(json.dumps(table(recorded, redraw=AS_IT_IS)))
    (tmp_path / "run.json").write_text(json.dumps(recorded))
    assert main(["study", str(tmp_path / "study.json"), "--json", "--threads", "1"]) == 0
    (row,) = json.loads(capsys.readouterr().out.splitlines()[-1])["table"]
    assert main(["run", str(tmp_path / "run.json"), "--json", "--out", str(tmp_path / "out")]) == 0
    figures = json.loads(capsys.readouterr().out.splitlines()[-1])
    assert row["gospa"] == {"value": figures["gospa_m"], "error": None, "runs": 1}
    assert row["nees"]["value"] == pytest.approx(figures["nees_state"])


def test_a_given_track_may_start_anew_on_the_whole_recording(recorded):
    given = recorded | {"birth": {"kind": "given", "spread": {"x": 5.0, "y": 5.0, "vx": 1.0, "vy": 1.0}}}
    given |= {"lifecycle": {"kind": "single_target"}}
    planned = plan(table(given, redraw={"drop": 0}))
    assert (planned.runs, planned.redraw) == (10, Redraw(0.0, starts=True))


def test_a_filter_that_draws_may_run_often(recorded):
    found = vedette.monte_carlo(recorded | {"estimator": PARTICLES}, runs=3, redraw=AS_IT_IS)
    assert found.means(0)["nis"].error > 0


@pytest.mark.parametrize(
    ("more", "said"),
    [
        ({"redraw": {"drop": 1.0}}, "redraw.drop: must be >= 0 and < 1, got 1"),
        ({"redraw": {"dropped": 0.1}}, "redraw.dropped: unknown; did you mean 'drop'? known: drop, starts"),
        ({"redraw": 0.1}, "redraw: must be a table such as { drop = 0.1 }, got 0.1"),
        ({"average": ["source.path"]}, "average: 'source.path' is not swept; swept: nothing"),
        ({"average": "source.path"}, "average: must be a list of swept paths, got 'source.path'"),
    ],
)
def test_bad_input_is_told(recorded, more, said):
    with pytest.raises(ConfigError) as error:
        plan(table(recorded, **more))
    assert str(error.value) == said


def test_nothing_can_be_drawn_of_a_scene_that_is_drawn_whole(recorded):
    scene = recorded | {"source": {"kind": "simulation", "duration": 5, "looks": {"radar": {"interval": 1}}}}
    with pytest.raises(ConfigError, match=r"^redraw: is what is drawn"):
        plan(table(scene, redraw={"drop": 0.1}))
    assert plan(table(scene)).redraw is None


def test_another_redraw_is_another_study(recorded):
    assert plan(table(recorded)).hash == plan(table(recorded, redraw={"drop": 0.1})).hash
    assert plan(table(recorded)).hash != plan(table(recorded, redraw={"drop": 0.2})).hash


def test_a_study_does_not_go_on_with_another_recording(tmp_path):
    """Its chunks would be of both."""
    given, out = config(recording(tmp_path / "recording.jsonl")), tmp_path / "out"
    vedette.monte_carlo(given, runs=1, out=out)
    vedette.monte_carlo(given, runs=2, out=out, resume=True)
    recording(tmp_path / "recording.jsonl", seed=2)
    with pytest.raises(ConfigError, match=r"manifest\.json: data"):
        vedette.monte_carlo(given, runs=2, out=out, resume=True)


# Several recordings as one, and the operating point.
@pytest.fixture(scope="module")
def averaged(tmp_path_factory):
    paths = [recording(tmp_path_factory.mktemp("recordings") / f"{seed}.jsonl", seed) for seed in (1, 2)]
    sweep = {"lifecycle.confirm": [0.5, 0.95, 0.9999], "source.path": paths}
    return vedette.monte_carlo(config(paths[0]), runs=4, sweep=sweep, average=["source.path"])


@pytest.mark.costly
def test_recordings_are_averaged_run_by_run(averaged):
    assert [point.labels for point in averaged.plan.points] == [
        {"lifecycle.confirm": value} for value in (0.5, 0.95, 0.9999)
    ]
    for name, values in averaged.figures.items():
        parts = averaged.parts.figures[name]
        np.testing.assert_allclose(values, (parts[::2] + parts[1::2]) / 2)
    data = averaged.data()
    assert (len(data["table"]), len(data["parts"])) == (3, 6)
    assert data["averaged_over"] == ["source.path"]


@pytest.mark.costly
def test_coverage_is_drawn_against_false_tracks_with_the_operating_point(averaged):
    (panel,) = next(chart for chart in charts(averaged) if chart.name == "coverage_confirm").panels
    line, ring = panel.curves
    np.testing.assert_array_equal(line.y, [averaged.means(i)["coverage"].value for i in range(3)])
    np.testing.assert_array_equal(line.x, [averaged.means(i)["false_tracks"].value for i in range(3)])
    assert line.notes == ("0.5", "0.95", "0.9999")
    assert ring.label == "as configured: confirm 0.95"  # the lifecycle's default
    assert (ring.x.tolist(), ring.y.tolist()) == ([line.x[1]], [line.y[1]])


def test_a_configured_value_that_is_not_swept_is_told(recorded):
    found = vedette.monte_carlo(recorded, runs=2, sweep={"lifecycle.confirm": [0.5, 0.9]})
    (panel,) = next(chart for chart in charts(found) if chart.name == "coverage_confirm").panels
    assert panel.title.endswith("the configured confirm is not among the values")
    assert [curve.style for curve in panel.curves] == ["marked"]


@pytest.mark.costly
def test_the_command_says_what_is_drawn_and_draws_the_picture(recorded, tmp_path, capsys):
    path, out = Path(tmp_path / "study.json"), tmp_path / "out"
    path.write_text(json.dumps(table(recorded, runs=2, sweep={"lifecycle.confirm": [0.9, 0.95]})))
    assert main(["study", str(path), "--threads", "1", "--out", str(out)]) == 0
    said = capsys.readouterr().out
    assert "each run leaves out 10 % of the recording's returns, drawn anew; all points meet the same draws" in said
    assert (out / "coverage_confirm.png").stat().st_size > 10_000
