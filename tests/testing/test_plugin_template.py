"""The example of a third-party plugin: the page quotes its files and says how long they are, and they keep the laws."""

import ast
import importlib
import sys
import tomllib
from types import SimpleNamespace

import numpy as np
import pytest
from hypothesis import strategies as st

import vedette
from support.architecture import PUBLIC
from support.paths import ROOT
from vedette.config.registry import Registry
from vedette.testing import FAST, consistency, examine, laws_of
from vedette.testing.strategies import components

TEMPLATE = ROOT / "examples/plugin_template"
PAGE = (ROOT / "docs/write-a-plugin.md").read_text()
SOURCES = sorted(path.name for path in (TEMPLATE / "src/vedette_road").glob("*.py"))
FILES = ["pyproject.toml", "tests/test_components.py", "road.toml", *(f"src/vedette_road/{name}" for name in SOURCES)]


@pytest.fixture(scope="module")
def road():
    sys.path.insert(0, str(TEMPLATE / "src"))
    try:
        yield importlib.import_module("vedette_road")
    finally:
        sys.path.remove(str(TEMPLATE / "src"))
        for name in [name for name in sys.modules if name.partition(".")[0] == "vedette_road"]:
            del sys.modules[name]


@pytest.fixture(scope="module")
def registry(road):
    return Registry.of(*road.vedette_components(), *(entry.cls for entry in Registry.installed()))


def lines(name):
    return sum(bool(line.strip()) for line in (TEMPLATE / "src/vedette_road" / name).read_text().splitlines())


@pytest.mark.parametrize("name", FILES)
def test_the_page_quotes_the_file_as_it_is_or_leads_to_it(name):
    language = "python" if name.endswith(".py") else "toml"
    if f"`{name}`:\n" in PAGE:
        assert f"`{name}`:\n\n```{language}\n{(TEMPLATE / name).read_text()}```\n" in PAGE
    else:
        assert f"](../examples/plugin_template/{name})" in PAGE


def test_it_asks_for_the_python_that_vedette_does():
    """Without it, its wheel said that Python 2 would do."""
    asked = [tomllib.loads((at / "pyproject.toml").read_text())["project"]["requires-python"] for at in (TEMPLATE, ROOT)]
    assert asked[0] == asked[1]


def test_each_component_is_short():
    assert all(lines(name) <= 100 for name in SOURCES)


@pytest.mark.parametrize("name", FILES[3:])
def test_it_imports_public_modules_only(name):
    tree = ast.walk(ast.parse((TEMPLATE / name).read_text()))
    found = {node.module for node in tree if isinstance(node, ast.ImportFrom)}
    assert {module for module in found if module.partition(".")[0] == "vedette"} <= set(PUBLIC)


def test_its_picture_and_command_know_runs_without_a_speed(road):
    """Each run of another motion model told that the picture had failed."""
    from vedette_road.speeds import SpeedsOverTime, speeds

    track = SimpleNamespace(id=1, space=vedette.Space.of(x="m", y="m"))
    for tracks in ((), (track,)):
        assert SpeedsOverTime().draw(SimpleNamespace(tracks=tracks)) is None
    with pytest.raises(vedette.InputError):
        speeds(track)


def test_its_own_tests_try_each_component(road):
    tested = (TEMPLATE / "tests/test_components.py").read_text()
    for cls in road.vedette_components():
        assert f"Test{cls.__name__} = conformance(road.{cls.__name__}" in tested


@pytest.mark.nightly("the plugin's own tests try all its laws, as its author does, in every `.ci/run`")
@pytest.mark.parametrize("name", ["Clothoid", "TimeDifference", "CheapJPDA", "InARow"])
def test_it_keeps_the_laws(road, name):
    cls = getattr(road, name)
    spots = {"first": st.just((-300.0, 0.0)), "second": st.just((0.0, 400.0))} if name == "TimeDifference" else {}
    outcomes = [examine(cls, law, components(cls, spots), FAST) for law in laws_of(cls)]
    assert [outcome.law.name for outcome in outcomes if outcome.verdict == "failed"] == []
    assert sum(outcome.verdict == "held" for outcome in outcomes) >= 8


def test_the_cheap_weights_are_those_of_pda_for_a_track_alone_and_share_what_two_want(road):
    alone = np.array([[0.3, -1.0, 2.0]])
    np.testing.assert_allclose(road.CheapJPDA().associate(alone, None), np.exp(alone) / np.exp(alone).sum(), rtol=1e-12)
    both = road.CheapJPDA().associate(np.array([[0.0, 60.0], [0.0, 60.0]]), None)
    np.testing.assert_allclose(both, 0.5, rtol=1e-12)


def test_a_birth_at_an_entrance_is_the_bayes_rule_of_one_target(road):
    """One place, a Kalman filter of positions and velocities, one return: mu P_D N(z; h, S) against clutter."""
    place = {"x": (100.0, 30.0), "y": (-50.0, 20.0), "vx": (15.0, 2.0), "vy": (0.0, 1.0)}
    motion = {"kind": "constant_velocity", "sigma_accel": 1.0}
    radar = {"kind": "cartesian_position", "sigma": 5.0, "detection_probability": 0.8, "clutter_density": 1e-4}
    from vedette_road.entrances import Entrance

    birth = road.Entrances((Entrance(place, 36.0),), stay=20.0, least=1e-6)
    tracker = vedette.build(
        {
            "estimator": {"kind": "kalman", "motion": motion},
            "sensors": {"radar": radar},
            "associator": {"kind": "pda"},
            "birth": birth,
            "lifecycle": {"kind": "existence"},
        }
    )
    z = np.array([110.0, -40.0])
    state = tracker.step(tracker.start(seed=0), vedette.Scan(0.0, "radar", vedette.Detections.of([z])))
    P, R, nu = np.diag([30.0**2, 20.0**2]), 25.0 * np.eye(2), z - [100.0, -50.0]
    S = P + R
    expected = 36.0 * 20.0 / 3600.0
    rate = expected * 0.8 * np.exp(-0.5 * nu @ np.linalg.solve(S, nu)) / (2 * np.pi * np.sqrt(np.linalg.det(S)))
    np.testing.assert_allclose(state.existence, rate / (rate + 1e-4), rtol=1e-9)
    names = tracker.state.names
    at = [names.index("x"), names.index("y")]
    estimate = tracker.estimate(state)
    np.testing.assert_allclose(estimate.mean[0, at], [100.0, -50.0] + P @ np.linalg.solve(S, nu), rtol=1e-9)
    np.testing.assert_allclose(estimate.cov[0][np.ix_(at, at)], P - P @ np.linalg.solve(S, P), rtol=1e-9)
    np.testing.assert_allclose(state.unseen.expected, expected * (1.0 - 0.8 * tracker.gate.probability), rtol=1e-9)
    later = birth.predict(state.unseen, tracker.estimator, 20.0, np.random.default_rng(0))
    np.testing.assert_allclose(later.expected, expected * (1.0 - 0.8 * tracker.gate.probability * np.exp(-1.0)), rtol=1e-9)


@pytest.mark.parametrize(
    ("change", "problem"),
    [
        (
            {"places": [{"start": {"x": [0, 9]}}]},
            "birth.places[0].start: must state [mean, standard deviation] of y, vx",
        ),
        ({"places": []}, "birth.places: "),
        (
            {"kind": "from_returns", "spread": {"vx": 9, "vy": 9}},
            "birth: none of the sensors can start tracks: 'ears': one return",
        ),
    ],
)
@pytest.mark.by_turns
def test_what_a_config_lacks_is_told_when_it_is_built(registry, change, problem):
    config = {
        "estimator": {"kind": "second_order", "motion": {"kind": "constant_velocity", "sigma_accel": 1.0}},
        "sensors": {"ears": {"kind": "time_difference", "sigma": 3, "first": [0, 0], "second": [100, 0]}},
        "associator": {"kind": "cheap_jpda"},
        "lifecycle": {"kind": "in_a_row"},
        "birth": {"kind": "entrances"} | change,
    }
    with pytest.raises(vedette.ConfigError) as caught:
        vedette.build(config, registry)
    assert str(caught.value).startswith(problem)


def test_what_a_square_adds_to_mean_and_covariance_is_exact(road):
    """For x ~ N(m, P), (x1^2, x1 x2) has the mean (m1^2 + P11, m1 m2 + P12) and, beside H P H', the covariance below."""
    from vedette_road.second_order import bend

    P = np.array([[2.0, 0.6], [0.6, 0.5]])
    slope = lambda x: np.stack([np.stack([2 * x[..., 0], 0 * x[..., 0]], -1), np.stack([x[..., 1], x[..., 0]], -1)], -2)  # noqa: E731
    shift, spread = bend(slope, np.array([3.0, -1.0]), P)
    np.testing.assert_allclose(shift, [2.0, 0.6], rtol=1e-12)
    np.testing.assert_allclose(spread, [[8.0, 2.4], [2.4, 2.0 * 0.5 + 0.36]], rtol=1e-12)


def test_a_track_is_confirmed_by_hits_without_a_gap_and_ends_after_its_patience(road):
    lifecycle = road.InARow(hits=3, patience=5.0)
    memory, verdicts = lifecycle.start(np.ones(1)), []
    for hit, dt in [(1, 1), (1, 1), (0, 1), (0, 4), (0, 0.5)]:
        memory, confirmed, alive = lifecycle.review(memory, vedette.Review(dt, *np.array([[1.0], [hit], [0.9]])))
        verdicts.append((bool(confirmed[0]), bool(alive[0])))
    assert verdicts == [(False, True), (True, True), (True, True), (True, True), (True, False)]
    memory = lifecycle.start(np.ones(1))
    assert lifecycle.review(memory, vedette.Review(1.0, *np.array([[1.0], [0.0], [0.9]])))[2].tolist() == [False]


@pytest.mark.costly
def test_it_works_in_a_config(registry):
    """In a scene with clutter of 5 returns a scan one vehicle comes in, and is held nearly all the time."""
    experiment = vedette.load(TEMPLATE / "road.toml", registry)
    result = experiment.run()
    (track,) = result.tracks
    (car,) = result.recording.truth
    errors = [np.hypot(*(mean[:2] - car.at(time)[:2])) for time, mean in zip(track.times, track.mean, strict=True)]
    assert len(track.times) > 110
    assert np.sqrt(np.mean(np.square(errors))) < 10.0


@pytest.mark.costly
def test_its_filter_is_consistent_on_what_its_motion_draws(road, registry):
    tracker = vedette.build(TEMPLATE / "road.toml", registry)
    prior = {"x": (0, 3), "y": (0, 3), "heading": (0, 0.05), "speed": (15, 1), "curvature": (0, 2), "sharpness": (0, 1)}
    assert consistency(tracker, prior=prior, runs=100, scans=20, interval=0.5).consistent
