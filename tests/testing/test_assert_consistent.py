"""assert_consistent: right trackers pass, wrong ones are told what is wrong, and the seed repeats it.

Every right tracker here is judged at a false-alarm rate of 1e-6 in all.
"""

import attrs
import numpy as np
import pytest
from attrs import evolve

import vedette
from vedette import Gaussian
from vedette.errors import ConfigError
from vedette.testing import Misuse, assert_consistent, consistency
from vedette_report.drawing.consistency import drawn
from vedette_report.recorded import recorded_consistency
from vedette_standard.estimators.imm import Imm
from vedette_standard.estimators.kalman import Kalman

START = {"x": [0, 20], "y": [0, 20], "vx": [12, 2], "vy": [0, 2]}
LINEAR = {
    "estimator": {"kind": "kalman", "motion": {"kind": "constant_velocity", "sigma_accel": 0.5}},
    "sensors": {"radar": {"kind": "cartesian_position", "sigma": 5.0}},
    "associator": {"kind": "pda"},
    "birth": {"kind": "given", "start": START},
    "lifecycle": {"kind": "single_target"},
}
TURN = {"kind": "coordinated_turn", "sigma_accel": 0.2, "sigma_turn_rate": 0.01}
IMM = LINEAR | {
    "estimator": {
        "kind": "imm",
        "modes": [
            {"kind": "ekf", "motion": {"kind": "constant_velocity", "sigma_accel": 0.05}},
            {"kind": "ekf", "motion": TURN},
        ],
        "transition": [[0.95, 0.05], [0.05, 0.95]],
    },
    "birth": {"kind": "given", "start": START | {"turn_rate": [0, 0.03]}},
    "lifecycle": {"kind": "single_target"},
}
SPARSE = {"kind": "cartesian_position", "sigma": 5.0, "detection_probability": 0.9}
CLUTTERED = LINEAR | {"sensors": {"radar": SPARSE | {"clutter_density": 2e-5}}}
RADAR = {"kind": "range_bearing", "sigma_range": 5.0, "sigma_bearing": 0.005}
POLAR = LINEAR | {
    "estimator": {"kind": "ekf", "motion": {"kind": "constant_velocity", "sigma_accel": 0.5}},
    "sensors": {"radar": RADAR},
    "birth": {"kind": "given", "start": START | {"x": [1000, 20]}},
    "lifecycle": {"kind": "single_target"},
}


@pytest.mark.statistical(alpha=1e-6)
@pytest.mark.parametrize(
    ("config", "reason"),
    [
        (LINEAR, ""),
        (LINEAR | {"sensors": {"radar": SPARSE}}, ""),
        (LINEAR | {"sensors": {"radar": SPARSE, "lidar": {"kind": "cartesian_position", "sigma": 2.0}}}, ""),
        (IMM, "the estimator 'imm' is not exact"),
        (CLUTTERED, "there is clutter on 'radar'"),
        (POLAR, "the sensor 'radar' is not linear"),
    ],
    ids=["kalman", "misses", "two sensors", "imm", "clutter", "polar"],
)
@pytest.mark.by_turns
def test_a_right_tracker_passes_and_says_how_it_was_judged(config, reason):
    report = assert_consistent(config, runs=200, scans=40, alpha=1e-6)
    assert (report.exact, report.why) == (not reason, reason)
    assert "consistent: 200 runs, seed 0" in report.text.splitlines()[0]


@attrs.frozen
class Sure(Kalman):
    """Too sure of one axis after each scan, as of a certain number of standard deviations."""

    kind = "test_sure"
    factors: tuple = (1.0, 1.0, 1.0, 1.0)

    def update(self, belief, innovation, weights):
        after = Kalman.update(self, belief, innovation, weights)
        scale = np.sqrt(self.factors)
        return Gaussian(after.mean, after.cov * np.outer(scale, scale))


def with_estimator(estimator):
    tracker = vedette.build(LINEAR)
    return evolve(tracker, estimator=estimator(tracker.estimator.motion))


@pytest.mark.costly
def test_a_covariance_that_is_too_small_is_told_with_its_size_and_time():
    with pytest.raises(AssertionError, match=r"NEES at .*times too small (throughout|from \d+ s on)") as failure:
        assert_consistent(with_estimator(lambda motion: Sure(motion, factors=(0.8,) * 4)), runs=200)
    assert "NOT consistent" in str(failure.value)


@pytest.mark.costly
def test_the_direction_that_is_wrong_is_named():
    report = consistency(with_estimator(lambda motion: Sure(motion, factors=(1.0, 0.5, 1.0, 1.0))), runs=200)
    calibration = next(verdict for verdict in report.verdicts if verdict.name == "calibration")
    assert not calibration.inside
    assert "too small along y" in calibration.text or "too small along cross-track" in calibration.text


@attrs.frozen
class Pulled(Kalman):
    """A prediction that drifts along x by 2 m a step."""

    kind = "test_pulled"

    def predict(self, belief, dt, rng):
        after = Kalman.predict(self, belief, dt, rng)
        return Gaussian(after.mean + np.array([2.0, 0, 0, 0]) * (dt > 0), after.cov)


def test_a_bias_is_told():
    report = consistency(with_estimator(Pulled), runs=200)
    bias = next(verdict for verdict in report.verdicts if verdict.name == "bias")
    assert not bias.inside
    assert bias.text.startswith("biased: the mean error of")


@attrs.frozen
class Overconfident(Imm):
    """Reports a third of its variance."""

    kind = "test_overconfident"

    def moments(self, belief):
        found = Imm.moments(self, belief)
        return Gaussian(found.mean, found.cov / 3)


@pytest.mark.costly
def test_a_wrong_mixture_fails_by_its_run_means():
    tracker = vedette.build(IMM)
    wrong = Overconfident(tracker.estimator.modes, transition=tracker.estimator.transition)
    report = consistency(evolve(tracker, estimator=wrong), runs=200)
    assert not next(verdict for verdict in report.verdicts if verdict.name.startswith("NEES")).inside
    assert "times too small" in report.text


def test_too_few_points_are_told_though_their_errors_have_a_heavy_tail():
    """A mean NEES of 5 to 20, with its spread in every run: Student's band reaches from 0 to 40."""
    points = {"kind": "bootstrap_particles", "particles": 200, "motion": LINEAR["estimator"]["motion"]}
    report = consistency(LINEAR | {"estimator": points, "sensors": {"radar": SPARSE}}, runs=60, scans=20)
    assert "NEES, mean over a run" in report.wrong
    assert report.cause.startswith("too few points: ")
    assert "800" in report.cause


@pytest.mark.costly
def test_a_q_that_is_too_small_is_not_called_too_few_points():
    points = {"kind": "bootstrap_particles", "particles": 400}
    right, wrong = (
        LINEAR | {"estimator": points | {"motion": {"kind": "constant_velocity", "sigma_accel": q}}} for q in (5.0, 1.0)
    )
    report = consistency(wrong, world=vedette.build(right), runs=30, scans=10)
    assert "NEES, mean over a run" in report.wrong
    assert report.cause.startswith("Q is ")


def test_what_is_not_shown_is_not_called_consistent():
    """Two modes far apart, and 30 runs of 10 scans: a band in which a covariance off by 2 has its place."""
    report = consistency(IMM, runs=30, scans=10)
    assert not report.wrong
    assert not report.consistent
    assert report.text.startswith("not shown to be consistent")
    assert "\n  ?     " in report.text


@attrs.frozen
class Reporting(Kalman):
    """Takes R `factor` times as large as its sensor says, and reports `times` the squared distance."""

    kind = "test_reporting"
    factor: float = 1.0
    times: float = 1.0

    def evaluate(self, belief, sensor, observed, p_gate):
        sensor = evolve(sensor, sigma=sensor.sigma * self.factor**0.5)
        made = Kalman.evaluate(self, belief, sensor, observed, p_gate)
        return evolve(made, nis=made.nis * self.times, distance=made.distance * self.times)


@pytest.mark.parametrize(
    ("how", "words"),
    [
        ({"times": 2.0}, "what `evaluate` reports is wrong"),
        ({"factor": 0.5}, "`evaluate` takes another R or prediction than are stated"),
    ],
)
def test_what_the_estimator_reports_of_innovations_is_judged(how, words):
    """The kit once made S alone: a doubled NIS was consistent, and an R / 2 of the filter was blamed on R of the sensor."""
    wrong = with_estimator(lambda motion: Reporting(motion, **how))
    report = consistency(wrong, world=vedette.build(LINEAR), runs=100, scans=20)
    assert "NIS of radar as the estimator reports it" in report.wrong
    assert report.cause.startswith("the innovation covariance of the estimator: ")
    assert words in report.cause


def test_a_filter_that_takes_the_right_r_is_right_where_its_sensor_states_another():
    right = vedette.build(LINEAR)
    blunt = {"radar": evolve(right.sensors["radar"], sigma=10.0)}
    tracker = evolve(right, estimator=Reporting(right.estimator.motion, factor=0.25), sensors=blunt)
    report = consistency(tracker, world=right, runs=100, scans=20)
    assert report.wrong >= {"NIS of radar"}
    assert "what it reports fits, R of radar or its prediction does not" in report.cause


def test_the_seed_repeats_a_report():
    first, again, other = (consistency(LINEAR, runs=50, scans=12, seed=seed) for seed in (3, 3, 4))
    assert np.array_equal(first.nees, again.nees)
    assert not np.array_equal(first.nees, other.nees)


@pytest.mark.costly
def test_the_picture_is_drawn(tmp_path):
    consistency(LINEAR, runs=50, scans=12).plot(tmp_path / "picture.png")
    assert (tmp_path / "picture.png").read_bytes().startswith(b"\x89PNG")


@pytest.mark.costly
def test_a_picture_of_another_format_is_refused_with_those_there_are(tmp_path):
    with pytest.raises(ConfigError, match=r"path: .*\.png, \.svg, \.pdf, got 'picture\.html'"):
        consistency(LINEAR, runs=50, scans=12).plot(tmp_path / "picture.html")
    assert not list(tmp_path.iterdir())


@pytest.mark.costly
def test_the_picture_shows_the_bands_of_the_verdicts():
    report = consistency(IMM, runs=50, scans=12)
    assert not report.exact
    for panel, name in zip(drawn(report).axes, ("NEES, mean over a run", "NIS of radar"), strict=False):
        (verdict,) = (one for one in report.verdicts if one.name == name)
        edges = [line.get_ydata()[0] for line in panel.lines if line.get_linestyle() == "--"]
        assert edges == [verdict.low, verdict.high]


@pytest.mark.parametrize(
    ("how", "words"),
    [
        ({"prior": {"z": (0, 1)}}, r"prior\.z: the tracker has no"),
        ({"prior": {"x": (0, 1)}}, r"prior: must give \[mean, standard deviation\] of y, vx"),
        ({"runs": 10}, r"runs: must be a whole number.*got 10"),
        ({"runs": "all"}, r"runs: must be a whole number.*got 'all'"),
        ({"runs": 99.5}, r"runs: must be a whole number.*got 99.5"),
        ({"seed": True}, "seed: .*got True"),
        ({"seed": -1}, r"seed: must be a whole number.*got -1"),
        ({"interval": 0.0}, r"interval: must be a number of s.*got 0\.0"),
        ({"interval": True}, "interval: .*got True"),
        ({"interval": (1.0, -0.5)}, r"interval: .*got -0\.5"),
        ({"interval": []}, r"interval: .*got \[\]"),
        ({"interval": (4.0, 0.2)}, r"interval: .*got \(4\.0, 0\.2\)"),
        ({"interval": (0.2, 1.0, 4.0)}, r"interval: .*got \(0\.2, 1\.0, 4\.0\)"),
        ({"alpha": 2}, "alpha: must be between 0 and 1, got 2"),
    ],
)
def test_misuse_is_told_in_one_line(how, words):
    with pytest.raises(Misuse, match=words) as error:
        consistency(LINEAR, **how)
    assert "\n" not in str(error.value)


def test_a_tracker_that_does_not_say_where_its_target_starts_needs_a_prior():
    birth = {"kind": "from_returns", "spread": {"vx": 10.0, "vy": 10.0}}
    config = LINEAR | {"birth": birth, "lifecycle": {"kind": "m_of_n"}}
    with pytest.raises(Misuse, match="does not say where"):
        consistency(config)
    prior = {name: tuple(pair) for name, pair in START.items()}
    assert consistency(config, prior=prior, runs=60, scans=12).consistent


DRAWN = {"models": [{"kind": "constant_velocity", "sigma_accel": 0.5}], "start": START}
SCENE = {
    "source": {"kind": "simulation", "duration": 400.0, "looks": {"radar": {"interval": 1.0}}, "drawn": {"boat": DRAWN}},
    "birth": {"kind": "given", "spread": {"x": 20, "y": 20, "vx": 2, "vy": 2}},
    "lifecycle": {"kind": "single_target"},
}


@pytest.mark.costly
@pytest.mark.statistical(alpha=1e-6)
def test_a_recording_is_told_of_and_a_right_filter_is_near_one_on_it():
    (told,) = recorded_consistency(vedette.load(LINEAR | SCENE))
    assert (told.truth, told.scans) == ("boat", 401)
    assert told.anees == pytest.approx(1.0, abs=0.6)  # scans of one run depend on one another
    assert told.nis == pytest.approx(1.0, abs=5 * np.sqrt(1 / 400))
    assert abs(told.whiteness) < 5 / np.sqrt(800)
    assert told.text.startswith("boat: track 0, 401 scans, ANEES ")


@pytest.mark.costly
def test_a_recording_tells_a_filter_that_is_too_sure():
    experiment = vedette.load(LINEAR | SCENE)
    wrong = Sure(experiment.tracker.estimator.motion, factors=(0.5,) * 4)
    right, (told,) = (
        recorded_consistency(experiment),
        recorded_consistency(evolve(experiment, tracker=evolve(experiment.tracker, estimator=wrong))),
    )
    assert told.anees > 2 * right[0].anees
    assert told.credibility.inclination > 3.0
    assert told.whiteness > 0.2


def test_a_recording_without_a_track_is_misuse():
    scene = SCENE["source"] | {"drawn": {}}
    with pytest.raises(vedette.InputError, match="source: gives no track with enough"):
        recorded_consistency(vedette.load(LINEAR | {"source": scene}))
