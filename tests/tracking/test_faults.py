"""A method of a third party that raises or returns what it must not: the error names place, kind, class and method."""

import cProfile
import re
import tomllib

import numpy as np
import pytest
from attrs import frozen

import vedette
from support.faulty import CONFIG, SOURCE, methods, spoiled, with_plugin
from vedette import Registry
from vedette.cli import main
from vedette.tracking import faults
from vedette.tracking.postconditions import broken
from vedette.tracking.tracker import Tracker
from vedette_report.running.streaming import stream

INSTALLED = Registry.installed()

WRONG = [
    ("Drift", "move", 'raise KeyError("gone")', "estimator.of.motion: x_motion", "raised KeyError: 'gone'"),
    ("Drift", "jacobian", "return given[..., :1]", "estimator.of.motion: x_motion", "must return (*b, 4, 4) or (4, 4)"),
    ("Drift", "noise", "return given * np.nan", "estimator.of.motion: x_motion", "got nan in 16 of 16"),
    ("Drift", "noise", "return str(given)", "estimator.of.motion: x_motion", "got a str"),
    ("Lidar", "measure", "return given.astype(str)", "sensors.lidar: x_sensor", "values"),
    ("Lidar", "jacobian", "return np.swapaxes(given, -1, -2)", "sensors.lidar: x_sensor", "or (3, 2), *b being"),
    ("Lidar", "noise", "return given[..., 0]", "sensors.lidar: x_sensor", "must return (*b, 3, 3) or (3, 3)"),
    ("Lidar", "detects", "return {}['p']", "sensors.lidar: x_sensor", "raised KeyError: 'p'"),
    ("Lidar", "detects", "return given * np.inf", "sensors.lidar: x_sensor", "got inf in"),
    ("Lidar", "clutter", "return None", "sensors.lidar: x_sensor", "got nothing"),
    ("Lidar", "invert", "return given.mean, given.cov", "sensors.lidar: x_sensor", "must return a Gaussian(mean, cov)"),
    (
        "Lidar",
        "invert",
        "with np.errstate(all='ignore'): return Gaussian(z[:, 1:] / 0, given.cov + self.jacobian(z[:, 1:] / 0).sum())",
        "sensors.lidar: x_sensor",
        "must return finite numbers; got inf in",
    ),
    ("Alone", "associate", "return given[..., 1:]", "associator: x_associator", "must return ("),
    ("Alone", "associate", "return -given", "associator: x_associator", "no negative numbers; got -"),
    ("Alone", "associate", "return given, scores", "associator: x_associator", "got a tuple of 2"),
    (
        "Filter",
        "start",
        "return Gaussian(given.mean, given.cov[..., 0])",
        "estimator: x_estimator",
        "must return cov (0, 4, 4)",
    ),
    ("Filter", "predict", "return None", "estimator: x_estimator", "must return a belief, a Gaussian as it was given"),
    ("Filter", "evaluate", "return given.loglik", "estimator: x_estimator", "must return Innovation(loglik"),
    ("Filter", "update", "return Gaussian(given.mean, given.cov[..., :1])", "estimator: x_estimator", "must return cov"),
    ("Filter", "update", "return Gaussian(given.mean, -given.cov)", "estimator: x_estimator", "without negative variances"),
    ("Filter", "moments", "return given.mean", "estimator: x_estimator", "must return a Gaussian(mean, cov)"),
    ("Filter", "moments", "return Gaussian(given.mean * np.nan, given.cov)", "estimator: x_estimator", "got nan in"),
    ("Unclaimed", "reveal", "return given[0][:1]", "birth: x_birth", "must return (density, "),
    ("Unclaimed", "begin", "return given.prior", "birth: x_birth", "must return Newborn(returns, prior, existence)"),
    ("Seen", "start", "return Count(np.ones(7))", "lifecycle: x_lifecycle", "must return a memory whose arrays lead"),
    ("Seen", "predict", "return given[..., None, None]", "lifecycle: x_lifecycle", "must return (0,); got (0, 1, 1)"),
    ("Seen", "review", "return given[1:]", "lifecycle: x_lifecycle", "must return (memory, confirmed, alive)"),
    ("Same", "process", "return given.z[:, 0]", "preprocessors.lidar: x_preprocessor", "must return Detections(z"),
    ("Scene", "open", "return given.scans", "source: x_source", "must return a Recording"),
    ("Scene", "open", "return Recording([each.time for each in given.scans])", "source: x_source", "got a float"),
]


@pytest.fixture
def command(monkeypatch, tmp_path):
    """Run `vedette run` with a plugin; return the exit code."""
    path = tmp_path / "faulty.toml"
    path.write_text(CONFIG)
    monkeypatch.setattr("vedette_report.drawing.brought.can_draw", lambda: False)

    def run(source, *options):
        monkeypatch.setattr(Registry, "installed", lambda: with_plugin(INSTALLED, source))
        return main([*options, "run", str(path), "--out", str(tmp_path / "out")])

    return run


@pytest.mark.parametrize(("cls", "method", "fault", "place", "said"), WRONG)
@pytest.mark.by_turns
def test_a_faulty_method_is_named_in_one_paragraph(cls, method, fault, place, said, command, capsys):
    assert command(spoiled(cls, method, fault)) == 2
    error = capsys.readouterr().err.strip()
    assert error.count("\n") == 0, error
    assert f"{place} (vedette_x.{cls}).{method} " in error
    assert said in error
    assert f"`vedette check {place.split()[-1]}`" in error
    assert "Traceback" not in error


def test_the_plugin_without_a_fault_runs(command, tmp_path):
    assert command(SOURCE) == 0
    assert "2 confirmed of 2 begun" in (tmp_path / "out" / "summary.txt").read_text()


def test_the_traceback_is_there_for_who_asks(command, capsys):
    assert command(spoiled("Drift", "move", 'raise KeyError("gone")'), "--traceback") == 2
    said = capsys.readouterr().err
    assert "Traceback" in said
    assert "KeyError: 'gone'" in said
    assert "vedette_x.py" in said


@pytest.mark.parametrize(("name", "place"), [("lidar", "sensors.lidar"), ("on port", 'sensors."on port"')])
def test_a_step_that_fails_says_so_too_with_the_place_as_configs_write_it_and_leaves_the_state(name, place):
    config = {name: part for name, part in tomllib.loads(CONFIG).items() if name not in ("source", "preprocessors")}
    config["sensors"][name] = config["sensors"].pop("lidar")
    wrong = spoiled("Lidar", "jacobian", "return np.swapaxes(given, -1, -2) if len(x) else given")
    tracker = vedette.build(config, with_plugin(INSTALLED, wrong))
    one = vedette.Detections.of([[5.0, 3.0, 4.0]])
    state = tracker.step(tracker.start(), vedette.Scan(0.0, name, one))
    with pytest.raises(vedette.PluginError, match=rf"^{place}: x_sensor \(vedette_x\.Lidar\)\.jacobian must return") as it:
        tracker.step(state, vedette.Scan(1.0, name, one))
    assert isinstance(it.value.__cause__, ValueError), "the original error is behind it"
    assert len(state.ids) == 1


def test_who_profiles_is_told_too_and_sees_what_follows():
    """Python 3.11's `sys.setprofile` does not take `cProfile` back: the error was its own."""

    def later():
        return None

    config = {name: part for name, part in tomllib.loads(CONFIG).items() if name not in ("source", "preprocessors")}
    tracker = vedette.build(config, with_plugin(INSTALLED, spoiled("Seen", "predict", "return given[..., None, None]")))
    with cProfile.Profile() as profile:
        with pytest.raises(vedette.PluginError, match=r"^lifecycle: x_lifecycle"):
            tracker.step(tracker.start(), vedette.Scan(0.0, "lidar", vedette.Detections.of([[5.0, 3.0, 4.0]])))
        later()
    assert later.__code__ in {each.code for each in profile.getstats()}


@pytest.mark.costly
def test_a_track_that_would_begin_nowhere_fails_the_step():
    config = {name: part for name, part in tomllib.loads(CONFIG).items() if name not in ("source", "preprocessors")}
    nowhere = spoiled("Lidar", "invert", "return Gaussian(given.mean * np.nan, given.cov)")
    tracker = vedette.build(config, with_plugin(INSTALLED, nowhere))
    scan = vedette.Scan(0.0, "lidar", vedette.Detections.of([[5.0, 3.0, 4.0]]))
    with pytest.raises(vedette.PluginError, match=r"Lidar\)\.invert"):
        tracker.step(tracker.start(), scan)


def test_what_the_filters_keep_of_earlier_answers_does_not_hide_the_fault(command, capsys):
    """The matrices of a linear motion are asked for once: the diagnosis must ask again."""
    linear = spoiled("Drift", "noise", "return given[:, :3]").replace(
        'kind = "x_motion"', 'kind = "x_motion"\n    linear = True'
    )
    assert command(linear) == 2
    assert "x_motion (vedette_x.Drift).noise must return (*b, 4, 4) or (4, 4)" in capsys.readouterr().err


NAN_IN = [("Lidar", "detects"), ("Lidar", "clutter"), ("Seen", "predict"), ("Unclaimed", "begin")]
EACH = [(*of, by) for of in NAN_IN for by in ("x_associator", "gnn", "jpda", "n_scan")]


@pytest.mark.parametrize(("cls", "method", "associator"), [*EACH, ("Alone", "associate", "x_associator")])
@pytest.mark.filterwarnings("ignore:(invalid|divide):RuntimeWarning")  # numpy tells of nan on some processors only
def test_numbers_that_are_none_are_told_after_the_run(cls, method, associator):
    """Nothing fails where a method returns nan, so that the tracks are looked at in the end, and the fault then found.

    A track whose existence is nan must not end unseen before; where no track was confirmed, the first scans are looked at.
    """
    with pytest.raises(vedette.PluginError, match=rf"\(vedette_x\.{cls}\)\.{method} must return .*numbers; got nan"):
        with_nan(cls, method, associator).run()


@pytest.mark.filterwarnings("ignore:(invalid|divide):RuntimeWarning")
def test_a_streamed_run_tells_of_numbers_that_are_none(tmp_path):
    with pytest.raises(vedette.PluginError, match=r"\(vedette_x\.Lidar\)\.clutter must return .*numbers; got nan"):
        stream(with_nan("Lidar", "clutter", "jpda"), tmp_path / "out")


@pytest.mark.parametrize("empty", [False, True])
@pytest.mark.parametrize(("cls", "method"), [("Drift", "move"), ("Drift", "noise")])
@pytest.mark.parametrize("associator", ["x_associator", "jpda", "n_scan"])
@pytest.mark.filterwarnings("ignore:(invalid|divide):RuntimeWarning")
def test_a_step_gives_no_track_of_nan(cls, method, associator, empty):
    """Who steps by hand, as a service does, is told at once who gave nan, even where a scan has no return."""
    tracker = with_nan(cls, method, associator).tracker
    state = tracker.start(vedette.Gaussian(np.zeros((2, 4)), np.ones((2, 1, 1)) * np.eye(4)), 0.0)
    scan = vedette.Scan(1.0, "lidar", vedette.Detections.of(np.zeros((0, 3)) if empty else [[5.0, 3.0, 4.0]]))
    with pytest.raises(vedette.PluginError, match=rf"\(vedette_x\.{cls}\)\.{method} must return .*numbers; got nan"):
        tracker.step(state, scan)


def with_nan(cls, method, associator):
    """Return a run in which a method of the plugin returns nan."""
    nan = "Newborn(given.returns, given.prior, given.existence * np.nan)" if method == "begin" else "given * np.nan"
    registry = with_plugin(INSTALLED, spoiled(cls, method, f"return {nan}"))
    return vedette.config.load(tomllib.loads(CONFIG) | {"associator": {"kind": associator}}, registry)


@pytest.mark.parametrize(
    ("method", "fault", "said"),
    [
        (
            "update",
            "return Gaussian(given.mean * np.nan, given.cov)",
            "must return finite numbers; got nan in 4 of 4 of mean",
        ),
        ("update", "return Gaussian(given.mean[:0], given.cov[:0])", r"must return mean \(1, 4\); got \(0, 4\)"),
        (
            "evaluate",
            "import attrs; return attrs.evolve(given, loglik=given.loglik + np.inf)",
            "loglik below infinity; got inf",
        ),
        (
            "evaluate",
            "import attrs; return attrs.evolve(given, distance=given.distance * np.nan)",
            "got nan in 1 of 1 of dist",
        ),
    ],
)
@pytest.mark.filterwarnings("ignore:(invalid|divide):RuntimeWarning")
def test_who_steps_by_hand_is_told_of_an_estimators_fault_whatever_comes_of_it(method, fault, said):
    """Its associator was blamed, or nobody, or tracks ended without a word: nan of `update` is of use in the next step."""
    given = {"kind": "given", "start": {axis: [5.0, 9.0] for axis in ("x", "y", "vx", "vy")}}
    tracker = tracker_of(spoiled("Filter", method, fault), birth=given)

    def steps():
        state = tracker.start(seed=1)
        for k in range(3):
            state = tracker.step(state, vedette.Scan(float(k), "lidar", vedette.Detections.of([[5.0, 3.0, 4.0]])))

    with pytest.raises(vedette.PluginError, match=rf"^estimator: x_estimator \(vedette_x\.Filter\)\.{method} .*{said}"):
        steps()


def tracker_of(source, **changes):
    """Return the tracker of a plugin's source."""
    config = {name: part for name, part in tomllib.loads(CONFIG).items() if name not in ("source", "preprocessors")}
    return vedette.build(config | changes, with_plugin(INSTALLED, source))


@frozen
class Points:
    """A belief of an estimator's own, of points (t, p, n)."""

    points: np.ndarray


@pytest.mark.parametrize(
    ("index", "said"), [(np.s_[:0], r"lead with the tracks, \(1,\); got one of \(0, 7, 4\)"), (np.s_[:], "")]
)
def test_a_belief_of_ones_own_is_looked_at_too(index, said):
    of = tracker_of(SOURCE).estimator

    class Ensemble(type(of)):
        def moments(self, belief):
            return vedette.Gaussian(belief.points.mean(axis=-2), np.broadcast_to(np.eye(4), (len(belief.points), 4, 4)))

    its, belief = Ensemble(of.of), Points(np.ones((1, 7, 4)))
    assert re.search(said, broken(its, "update", (belief, None, None), Points(belief.points[index])) or "")
    told = broken(its, "update", (belief, None, None), Points(belief.points * np.nan))
    assert told == "must return numbers; got nan in 28 of 28"


@pytest.mark.parametrize(("axis", "length"), [("range", 0.0), ("range", -1.0), ("range", np.nan), ("rang", 5.0)])
def test_an_axis_that_a_return_may_lack_is_one_of_the_sensors_and_has_a_length(axis, length):
    """Its logarithm was -inf, and the associator blamed for the nan that came of it."""
    source = SOURCE.replace('kind = "x_sensor"', f'kind = "x_sensor"\n    optional = {{"{axis}": float("{length}")}}')
    with pytest.raises(vedette.ConfigError, match=r"sensors.lidar: optional of 'x_sensor'"):
        tracker_of(source)


@pytest.mark.parametrize(("variance", "blamed"), [(-1.0, False), (0.0, True)])
def test_who_was_given_a_negative_variance_is_not_blamed(variance, blamed):
    """The covariance that another spoiled in a step before goes through the methods of this one."""
    config = {name: part for name, part in tomllib.loads(CONFIG).items() if name not in ("source", "preprocessors")}
    given, gave = (vedette.Gaussian(np.zeros((1, 4)), each * np.eye(4)[None]) for each in (variance, -1.0))
    estimator = vedette.build(config, with_plugin(INSTALLED, SOURCE)).estimator
    assert (broken(estimator, "predict", (given, 1.0, None), gave) is not None) is blamed


@pytest.mark.costly
def test_right_components_break_no_promise():
    """No false alarm: every call of these runs is looked at."""
    for config in ("harbour", "flir", "swarm"):
        experiment = vedette.load(f"examples/{config}.toml")

        def some(experiment=experiment):
            for scan, state in experiment.steps():
                experiment.tracker.estimate(state)
                if state.steps > 4:
                    return scan
            return None

        assert faults.broken_promise(experiment, some) is None


def test_an_error_that_is_no_components_is_left_as_it_is(monkeypatch):
    config = {name: part for name, part in tomllib.loads(CONFIG).items() if name not in ("source", "preprocessors")}
    tracker = vedette.build(config, with_plugin(INSTALLED, SOURCE))
    monkeypatch.setattr("vedette.tracking.gate.kernels.gate_scores", lambda *given: np.zeros(0)[7])
    with pytest.raises(IndexError, match="out of bounds"):
        tracker.step(tracker.start(), vedette.Scan(0.0, "lidar", vedette.Detections.of([[5.0, 3.0, 4.0]])))
    assert isinstance(tracker, Tracker)


def test_every_method_of_the_plugin_is_tried():
    assert {(cls, method) for cls, method, *_ in WRONG} >= set(methods()) - {("Unclaimed", "predict")}
