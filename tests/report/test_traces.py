"""Traces of errors, NEES and innovations against the figures."""

import numpy as np
import pytest
from scipy import stats

import vedette
from support.results import config, drawn_lines, result, still, track, words
from vedette import Space, Trajectory, metrics
from vedette.metrics.coverage import NONE
from vedette_report.drawing.errors import errors
from vedette_report.series.traces import Judged, Normalised, mode_names


def test_traces_agree_with_the_figures(scene):
    experiment, done = scene
    score = metrics.judge(done.tracks, done.recording.truth, done.scans, experiment.judge)
    followed = Judged.of(experiment, done).traces(done.recording.truth)
    assert [trace.name for trace in followed] == ["near", "late"]
    error = np.concatenate([trace.error[trace.covered] for trace in followed])
    speed = np.concatenate([trace.speed_error[trace.covered] for trace in followed])
    assert np.sqrt(np.mean(error**2)) == pytest.approx(score.position_rmse_m)
    assert np.sqrt(np.mean(speed**2)) == pytest.approx(score.velocity_rmse_mps)
    assert np.mean(Judged.of(experiment, done).position_nees().value) == pytest.approx(2 * score.nees_position)
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
    (trace,) = Judged.of(experiment, done).traces(done.recording.truth)
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
    followed = Judged.of(experiment, done).traces(done.recording.truth)
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
    np.testing.assert_allclose(seen[:, 1], Judged.of(experiment, done).innovations().value)


def test_truth_without_velocity_leaves_its_error_unknown(scene):
    ground = Trajectory("buoy", Space.of(x="m", y="m"), np.array([0.0, 9.0]), np.zeros((2, 2)))
    done = result([track(range(5), np.zeros((5, 4)), np.eye(4))], [ground], range(5))
    (trace,) = Judged.of(scene[0], done).traces(done.recording.truth)
    assert np.isnan(trace.speed_error).all()
    assert "unknown" in words(errors(scene[0], done))


def test_innovations_are_per_return_and_only_of_likely_ones(scene):
    tracks = [
        track(range(3), np.zeros((3, 4)), np.eye(4), 0, nis=1.2, hit=0.6),
        track(range(3), np.zeros((3, 4)), np.eye(4), 1, nis=1.2, hit=0.4),
        track(range(3), np.zeros((3, 4)), np.eye(4), 2, nis=0.0, hit=1.0),
    ]
    seen = Judged.of(scene[0], result(tracks, times=range(3))).innovations()
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
    plain = {"estimator": {"kind": "ekf", "motion": {"kind": "constant_velocity", "sigma_accel": 1.0}}}
    assert mode_names(vedette.load(config(**plain)), 0) == ()
    turning = {"kind": "ekf", "motion": {"kind": "coordinated_turn", "sigma_accel": 1.0, "sigma_turn_rate": 0.1}}
    straight = {"kind": "ekf", "motion": {"kind": "constant_velocity", "sigma_accel": 1.0}}
    changes = {"estimator": {"kind": "imm", "modes": [straight, turning], "transition": [[0.9, 0.1], [0.1, 0.9]]}}
    changes["birth"] = {"kind": "from_returns", "spread": {"vx": 8.0, "vy": 8.0, "turn_rate": 0.1}}
    assert mode_names(vedette.load(config(**changes)), 2) == ("constant_velocity", "coordinated_turn")


def test_modes_of_products_are_called_by_the_motions_that_not_all_have():
    """They were 'product (1)' and 'product (2)'."""
    height = {"kind": "constant_velocity", "sigma_accel": 0.5, "axes": ["z"]}
    turn = {"kind": "coordinated_turn", "sigma_accel": 1.0, "sigma_turn_rate": 0.1}
    straight = {"kind": "constant_velocity", "sigma_accel": 1.0, "axes": ["x", "y"]}
    modes = [{"kind": "ekf", "motion": {"kind": "product", "models": [own, height]}} for own in (straight, turn)]
    changes = {"estimator": {"kind": "imm", "modes": modes, "transition": [[0.9, 0.1], [0.1, 0.9]]}}
    changes["birth"] = {"kind": "from_returns", "spread": {"vx": 8.0, "vy": 8.0, "turn_rate": 0.1, "z": 9.0, "vz": 1.0}}
    assert mode_names(vedette.load(config(**changes)), 2) == ("constant_velocity", "coordinated_turn")
